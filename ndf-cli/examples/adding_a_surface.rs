//! A representation of one's own, from its definition to a mesh of the learned surface: docs/adding-a-surface.md.
//!
//! `cargo run --release -p ndf-cli --example adding_a_surface -- blobs.ply`

use ndf_core::{BoundingBox, DVec3, ImplicitField, Inside, NoProgress};
use ndf_intrinsic::extraction::{ExtractionOptions, extract};
use ndf_mesh::io::write_mesh;
use ndf_meshing::{BaseMeshOptions, base_mesh};
use ndf_surfaces::LevelSetSurface;
use ndf_train::{Settings, fit};

/// Blinn's blobs (1982): a sum of Gaussians, solid where it exceeds 1.
struct Blobs {
    /// Centre and radius of each.
    balls: Vec<(DVec3, f64)>,
}

/// How much stronger than the level a blob is at its centre.
const STRENGTH: f64 = 4.0;

impl ImplicitField for Blobs {
    fn values(&self, points: &[DVec3], values: &mut [f64]) {
        for (&p, value) in points.iter().zip(values) {
            let ball = |&(c, r): &(DVec3, f64)| STRENGTH * (-p.distance_squared(c) / (r * r)).exp();
            *value = self.balls.iter().map(ball).sum();
        }
    }

    // Optional: without it, gradients are central differences of the values.
    fn gradients(&self, points: &[DVec3], gradients: &mut [DVec3]) {
        for (&p, gradient) in points.iter().zip(gradients) {
            let ball = |&(c, r): &(DVec3, f64)| {
                let d = p - c;
                -2.0 * STRENGTH / (r * r) * (-d.length_squared() / (r * r)).exp() * d
            };
            *gradient = self.balls.iter().map(ball).sum();
        }
    }

    fn bounds(&self) -> BoundingBox {
        let boxes = self.balls.iter().map(|&(c, r)| BoundingBox { min: c - 2.0 * r, max: c + 2.0 * r });
        boxes.fold(BoundingBox::EMPTY, BoundingBox::union)
    }

    fn level(&self) -> f64 {
        1.0
    }

    fn inside(&self) -> Inside {
        Inside::Above
    }
}

/// Seven blobs along an arc.
fn arc() -> LevelSetSurface<Blobs> {
    let ball = |i: u32| {
        let angle = 0.45 * f64::from(i);
        (DVec3::new(angle.cos(), angle.sin(), 0.2 * (3.0 * angle).sin()), 0.2 + 0.03 * f64::from(i % 3))
    };
    LevelSetSurface::new(Blobs { balls: (0..7).map(ball).collect() })
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let output = std::env::args().nth(1).unwrap_or_else(|| "blobs.ply".to_owned());
    let surface = arc();
    let base = base_mesh(&surface, &BaseMeshOptions { faces: 1000, ..Default::default() }, &NoProgress)?;
    let settings = Settings { epochs: 1500, samples: 4096, ..Settings::default() };
    let learned = fit(&surface, &base.mesh, &settings, &NoProgress)?;
    let extraction = extract(&learned.field, &ExtractionOptions::new(0.04), &NoProgress)?;
    let mesh = extraction.mesh.into_triangle_mesh().map_positions(|p| learned.similarity.to_world(p));
    write_mesh(&output, &mesh, &[])?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    ndf_core::surface_conformance!(blobs, arc());
}
