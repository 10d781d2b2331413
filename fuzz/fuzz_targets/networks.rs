//! Snapshots of instant-ngp and networks of bare numbers.

#![no_main]

use libfuzzer_sys::fuzz_target;
use ndf_surfaces::networks::{NetworkOptions, NeuralField, is_snapshot};

fuzz_target!(|bytes: &[u8]| {
    let _ = is_snapshot(bytes);
    let _ = NeuralField::from_snapshot(bytes, &NetworkOptions::default());
    let _ = NeuralField::from_flat_file(bytes, &NetworkOptions::default());
});
