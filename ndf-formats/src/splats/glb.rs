//! Binary glTF with the extension `KHR_gaussian_splatting`: points whose attributes are linear scales, opacities and
//! quaternions x, y, z, w, in the coordinates of glTF.

use std::path::Path;

use ndf_core::DVec3;
use ndf_core::glam::{DAffine3, DQuat};
use ndf_mesh::io::FileDefect;
use ndf_mesh::io::gltf::{self, Document, Primitive, SPLATS};

use super::{Splat, SplatError};

/// Whether a file of binary glTF names the extension.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    gltf::names(bytes, SPLATS)
}

pub(super) fn read(bytes: &[u8]) -> Result<Vec<Splat>, SplatError> {
    let document = Document::parse(bytes, Path::new(""))?;
    let mut splats = Vec::new();
    for placed in document.placed_meshes()? {
        for primitive in document.primitives(placed.mesh) {
            let Some(extension) = primitive.extensions.get(SPLATS) else { continue };
            if extension["extensions"].as_object().is_some_and(|packed| !packed.is_empty()) {
                return Err(FileDefect::unsupported(
                    "its splats are compressed, which is not read; save them uncompressed",
                )
                .into());
            }
            let place = Placement::new(placed.affine)?;
            let attribute = |name: &str, width: usize| numbers(&document, primitive, name, width);
            let opacities = attribute("KHR_gaussian_splatting:OPACITY", 1)?;
            let count = opacities.len();
            // Primitives may share their numbers, but not without end.
            if splats.len() + count > bytes.len() {
                return Err(FileDefect::too_large("its primitives have more splats than it has bytes").into());
            }
            let positions = attribute("POSITION", 3)?;
            let rotations = attribute("KHR_gaussian_splatting:ROTATION", 4)?;
            let scales = attribute("KHR_gaussian_splatting:SCALE", 3)?;
            if positions.len() != 3 * count || rotations.len() != 4 * count || scales.len() != 3 * count {
                return Err(FileDefect::mismatch("its attributes are of different lengths").into());
            }
            splats.extend((0..count).map(|i| {
                place.moved(&Splat {
                    center: [0, 1, 2].map(|k| f64::from(positions[3 * i + k])),
                    scales: [0, 1, 2].map(|k| scales[3 * i + k]),
                    rotation: [3, 0, 1, 2].map(|k| rotations[4 * i + k]),
                    opacity: opacities[i],
                })
            }));
        }
    }
    Ok(splats)
}

/// The numbers of an attribute that all splats have.
fn numbers(
    document: &Document<'_>,
    primitive: &Primitive,
    name: &str,
    width: usize,
) -> Result<Vec<f32>, FileDefect> {
    let missing = || FileDefect::missing(format!("its splats have no attribute {name}"));
    document.numbers(*primitive.attributes.get(name).ok_or_else(missing)?, width, name)
}

/// A similarity of space.
#[derive(Clone, Copy, Debug)]
struct Placement {
    affine: DAffine3,
    scale: f64,
    rotation: DQuat,
}

/// How far axes of a node may be from equal lengths and right angles.
const EVEN: f64 = 1e-5;

impl Placement {
    /// A transformation that keeps angles; splats under any other have other axes.
    fn new(affine: DAffine3) -> Result<Self, FileDefect> {
        let axes = [affine.x_axis, affine.y_axis, affine.z_axis];
        let scale = affine.matrix3.determinant().cbrt();
        let is_even = scale > 0.0
            && (0..3).all(|i| {
                (axes[i].length() / scale - 1.0).abs() < EVEN
                    && axes[i].dot(axes[(i + 1) % 3]).abs() < EVEN * scale * scale
            });
        if !is_even {
            return Err(FileDefect::unsupported(
                "a node stretches or mirrors its splats, which is not read; apply its transformation",
            ));
        }
        Ok(Self { affine, scale, rotation: DQuat::from_mat3(&(affine.matrix3 * scale.recip())) })
    }

    fn moved(&self, splat: &Splat) -> Splat {
        if self.affine == DAffine3::IDENTITY {
            return *splat;
        }
        let [w, x, y, z] = splat.rotation.map(f64::from);
        let turned = self.rotation * DQuat::from_xyzw(x, y, z, w);
        Splat {
            center: self.affine.transform_point3(DVec3::from_array(splat.center)).to_array(),
            scales: splat.scales.map(|s| s * self.scale as f32),
            rotation: [turned.w, turned.x, turned.y, turned.z].map(|q| q as f32),
            opacity: splat.opacity,
        }
    }
}
