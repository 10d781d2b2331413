//! Writes the seeds of all fuzzers: `cargo run --bin seeds`, in this folder.

use std::fs;
use std::path::Path;

fn main() -> std::io::Result<()> {
    let write = |target: &str, files: Vec<(&'static str, Vec<u8>)>| -> std::io::Result<()> {
        let folder = Path::new("corpus").join(target);
        fs::create_dir_all(&folder)?;
        files.iter().try_for_each(|(name, bytes)| fs::write(folder.join(name), bytes))
    };
    write("clouds", ndf_surfaces::point_cloud::samples::all())?;
    write("tensors", ndf_surfaces::tensors::samples::all())?;
    write("networks", ndf_surfaces::networks::samples::all())?;
    write("splats", ndf_surfaces::splats::samples::all())
}
