//! Little-endian reading that never reads past the end and never trusts a count.

use super::error::{ModelError, PartDefect};
use ndf_mesh::io::FileDefect;

/// The unread rest of a section.
pub(super) struct Reader<'a> {
    section: &'static str,
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    pub(super) fn new(section: &'static str, bytes: &'a [u8]) -> Self {
        Self { section, rest: bytes }
    }

    pub(super) fn truncated(&self) -> ModelError {
        self.defect(FileDefect::truncated("it ends too early"))
    }

    pub(super) fn defect(&self, defect: impl Into<PartDefect>) -> ModelError {
        ModelError::Section { section: self.section, defect: defect.into() }
    }

    pub(super) fn unknown_coding(&self, code: u8) -> ModelError {
        self.defect(FileDefect::unsupported(format!("coding {code} is not known")))
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], ModelError> {
        let (head, rest) = self.rest.split_first_chunk().ok_or_else(|| self.truncated())?;
        self.rest = rest;
        Ok(*head)
    }

    /// The next `length` bytes.
    pub(super) fn take(&mut self, length: usize) -> Result<&'a [u8], ModelError> {
        let (head, rest) = self.rest.split_at_checked(length).ok_or_else(|| self.truncated())?;
        self.rest = rest;
        Ok(head)
    }

    /// All bytes that are left.
    pub(super) fn rest(&mut self) -> &'a [u8] {
        std::mem::take(&mut self.rest)
    }

    pub(super) fn u8(&mut self) -> Result<u8, ModelError> {
        self.array().map(u8::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Result<u32, ModelError> {
        self.array().map(u32::from_le_bytes)
    }

    pub(super) fn f32(&mut self) -> Result<f32, ModelError> {
        self.array().map(f32::from_le_bytes)
    }

    pub(super) fn f64(&mut self) -> Result<f64, ModelError> {
        self.array().map(f64::from_le_bytes)
    }

    /// `count` values of `N` bytes each; the count is checked against what is left before anything is allocated.
    fn many<const N: usize, T>(
        &mut self,
        count: usize,
        from: impl Fn([u8; N]) -> T,
    ) -> Result<Vec<T>, ModelError> {
        let length =
            count.checked_mul(N).filter(|&l| l <= self.rest.len()).ok_or_else(|| self.truncated())?;
        let (head, rest) = self.rest.split_at(length);
        self.rest = rest;
        let (chunks, _) = head.as_chunks::<N>();
        Ok(chunks.iter().map(|c| from(*c)).collect())
    }

    pub(super) fn f32s(&mut self, count: usize) -> Result<Vec<f32>, ModelError> {
        self.many(count, f32::from_le_bytes)
    }

    pub(super) fn u8s(&mut self, count: usize) -> Result<Vec<u8>, ModelError> {
        self.many(count, u8::from_le_bytes)
    }

    pub(super) fn u16s(&mut self, count: usize) -> Result<Vec<u16>, ModelError> {
        self.many(count, u16::from_le_bytes)
    }

    pub(super) fn u32s(&mut self, count: usize) -> Result<Vec<u32>, ModelError> {
        self.many(count, u32::from_le_bytes)
    }

    pub(super) fn end(&self) -> Result<(), ModelError> {
        if self.rest.is_empty() { Ok(()) } else { Err(self.defect(FileDefect::TrailingBytes("its end"))) }
    }
}

/// Appends little-endian values.
#[derive(Default)]
pub(super) struct Writer(pub(super) Vec<u8>);

impl Writer {
    pub(super) fn u8(&mut self, x: u8) {
        self.0.push(x);
    }

    pub(super) fn u16(&mut self, x: u16) {
        self.0.extend(x.to_le_bytes());
    }

    pub(super) fn u32(&mut self, x: u32) {
        self.0.extend(x.to_le_bytes());
    }

    pub(super) fn f64(&mut self, x: f64) {
        self.0.extend(x.to_le_bytes());
    }

    pub(super) fn f32s(&mut self, values: impl IntoIterator<Item = f32>) {
        self.0.extend(values.into_iter().flat_map(f32::to_le_bytes));
    }
}
