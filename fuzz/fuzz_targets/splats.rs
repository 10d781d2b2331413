//! All readers of splats, and their density.

#![no_main]

use libfuzzer_sys::fuzz_target;
use ndf_formats::splats::parse_splats;
use ndf_surfaces::splats::{DensityOptions, SplatDensity};

fuzz_target!(|bytes: &[u8]| {
    if let Ok((_, splats)) = parse_splats(bytes) {
        let _ = SplatDensity::new(&splats, &DensityOptions::default());
    }
});
