//! The authors' PLY, and that of 2D splats, which have two scales: logarithms of scales, logits of opacities, a quaternion w, x, y, z; properties in any order.

use std::io::{self, Write};
use std::path::Path;

use ndf_mesh::io::{FileDefect, MeshFile, ReadError, parse_mesh};

use super::{Splat, SplatError, sigmoid};

pub(super) fn read(bytes: &[u8]) -> Result<Vec<Splat>, SplatError> {
    let file = parse_mesh(bytes, Path::new("splats")).map_err(|e| match e {
        ReadError::Malformed { defect, .. } => defect,
        other => FileDefect::undecodable(other.to_string()),
    })?;
    let column = |name: &'static str| property(&file, name).ok_or(SplatError::MissingProperty(name));
    let opacity = column("opacity")?;
    let scales = [Some(column("scale_0")?), Some(column("scale_1")?), property(&file, "scale_2")];
    let rotation = [column("rot_0")?, column("rot_1")?, column("rot_2")?, column("rot_3")?];
    let splat = |(i, p): (usize, &ndf_core::DVec3)| Splat {
        center: p.to_array(),
        scales: scales.map(|scale| scale.map_or(0.0, |scale| scale[i].exp())),
        rotation: rotation.map(|part| part[i]),
        opacity: sigmoid(opacity[i]),
    };
    Ok(file.mesh.positions().iter().enumerate().map(splat).collect())
}

fn property<'a>(file: &'a MeshFile, name: &str) -> Option<&'a [f32]> {
    file.scalars.iter().find(|scalar| scalar.name == name).map(|scalar| scalar.values.as_slice())
}

/// Writes splats as the authors' PLY, binary, of one grey colour.
///
/// # Errors
/// If the writer fails.
pub fn write_splats(out: &mut dyn Write, splats: &[Splat]) -> io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}", splats.len())?;
    let names = [
        "x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1",
        "scale_2",
    ];
    for name in names.into_iter().chain(["rot_0", "rot_1", "rot_2", "rot_3"]) {
        writeln!(out, "property float {name}")?;
    }
    writeln!(out, "end_header")?;
    for splat in splats {
        let opacity = splat.opacity.clamp(1e-6, 1.0 - 1e-6);
        let logit = (opacity / (1.0 - opacity)).ln();
        let rest = [0.0; 6].into_iter().chain([logit]).chain(splat.scales.map(f32::ln)).chain(splat.rotation);
        for number in splat.center.map(|x| x as f32).into_iter().chain(rest) {
            out.write_all(&number.to_le_bytes())?;
        }
    }
    Ok(())
}
