//! Checkpoints of runs.

#![no_main]

use libfuzzer_sys::fuzz_target;
use ndf_train::Checkpoint;

fuzz_target!(|bytes: &[u8]| {
    let mut bytes = bytes.to_vec();
    // The checksum would stop nearly everything that is tried.
    if bytes.len() > 12 {
        let sum = crc32fast::hash(&bytes[12..]);
        bytes[8..12].copy_from_slice(&sum.to_le_bytes());
    }
    let _ = Checkpoint::from_bytes(&bytes);
});
