//! Model files and their export: no input may panic, hang or ask for absurd memory.
#![no_main]

use libfuzzer_sys::fuzz_target;
use ndf_core::Model;

fuzz_target!(|bytes: &[u8]| {
    let _ = Model::from_safetensors(bytes);
    // Checksums would stop nearly all of what is tried: they are mended.
    let _ = Model::from_bytes(&Model::with_mended_checksums(bytes));
});
