//! All readers of tensors, and the recognition of networks among them.

#![no_main]

use libfuzzer_sys::fuzz_target;
use ndf_surfaces::networks::{Latent, NetworkOptions, NeuralField};
use ndf_formats::tensors::TensorFile;

fuzz_target!(|bytes: &[u8]| {
    // Any answer will do but a panic, a hang or a large allocation.
    if let Ok(file) = TensorFile::parse(bytes) {
        let _ = NeuralField::from_tensors(&file, &NetworkOptions { latent: Latent::from_tensors(&file, 0), ..NetworkOptions::default() });
    }
});
