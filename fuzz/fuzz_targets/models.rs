//! Model files and their export.

#![no_main]

use libfuzzer_sys::fuzz_target;
use ndf_model::Model;

fuzz_target!(|bytes: &[u8]| {
    let _ = Model::from_safetensors(bytes);
    let mut bytes = bytes.to_vec();
    // Checksums would stop nearly everything that is tried.
    mend(&mut bytes);
    if let Ok(model) = Model::from_bytes(&bytes) {
        assert!(Model::from_bytes(&model.to_bytes()).is_ok());
    }
});

/// Makes all checksums right, as far as the table of sections makes sense.
fn mend(bytes: &mut [u8]) -> Option<()> {
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
