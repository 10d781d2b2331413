//! All readers of meshes; which one, the content decides, or the extension where it does not.

#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use ndf_mesh::ValidationReport;
use ndf_mesh::io::parse_mesh;

fuzz_target!(|bytes: &[u8]| {
    // Any answer will do but a panic, a hang or a large allocation.
    for name in ["mesh", "mesh.obj"] {
        if let Ok(file) = parse_mesh(bytes, Path::new(name)) {
            let _ = ValidationReport::of(&file.mesh);
        }
    }
});
