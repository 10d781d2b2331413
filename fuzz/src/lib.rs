//! What several fuzzers need.

/// Makes all checksums of a model file right, as far as its table of sections makes sense: they would stop nearly
/// everything that is tried.
pub fn mend_checksums(bytes: &mut [u8]) -> Option<()> {
    let count = u32::from_le_bytes(*bytes.get(12..)?.first_chunk()?) as usize;
    let table_end = 16 + 16 * count.min(64);
    let mut at = table_end + 4;
    for entry in (16..table_end).step_by(16) {
        let length = u64::from_le_bytes(*bytes.get(entry + 8..)?.first_chunk()?);
        let end = at.checked_add(usize::try_from(length).ok()?)?;
        let sum = crc32fast::hash(bytes.get(at..end)?);
        bytes[entry + 4..entry + 8].copy_from_slice(&sum.to_le_bytes());
        at = end;
    }
    let sum = crc32fast::hash(bytes.get(..table_end)?);
    bytes.get_mut(table_end..table_end + 4)?.copy_from_slice(&sum.to_le_bytes());
    Some(())
}
