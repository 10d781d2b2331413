//! All readers of point clouds; which one, the content decides.

#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use ndf_formats::point_cloud::{CloudOptions, parse_cloud};

// A panic that a reader catches, as of the decoder of LAZ, is no find.
fuzz_target!(init: std::panic::set_hook(Box::new(|_| {})), |bytes: &[u8]| {
    // Any answer will do but a panic, a hang or a large allocation.
    let _ = parse_cloud(bytes, Path::new("cloud"), &CloudOptions::default());
});
