//! A loss of one's own whose gradient is left to dfdx: the map should keep areas.
//!
//! The term sees a block of samples, puts what it needs on dfdx's tape, and hands the gradients back; the network
//! itself runs in the fused kernels. `cargo run --release -p ndf-train --example dfdx_term`

use std::sync::Arc;

use dfdx::prelude::*;
use ndf_core::progress::NoProgress;
use ndf_core::{Answer, BoundingBox, DVec3, Foot, Hint, Miss, Query, Surface};
use ndf_mesh::ManifoldMesh;
use ndf_mesh::shapes;
use ndf_train::terms::{LossTerm, SampleGradients, Samples};
use ndf_train::{Settings, Trainer, train};

/// (|J u × J v| − 1)².
struct KeepArea;

type Column = Tensor<(usize,), f32, Cpu>;

impl LossTerm for KeepArea {
    fn name(&self) -> &'static str {
        "keep_area"
    }

    fn needs_tangents(&self) -> bool {
        true
    }

    fn accumulate(&self, samples: &Samples<'_>, weight: f32, gradients: &mut SampleGradients<'_>) -> f64 {
        let device = Cpu::default();
        let n = samples.points.len();
        let column = |k: usize, c: usize| -> Column {
            device.tensor_from_vec(samples.tangents[k].iter().map(|t| t[c]).collect(), (n,))
        };
        let u: [Column; 3] = std::array::from_fn(|c| column(0, c));
        let v: [Column; 3] = std::array::from_fn(|c| column(1, c));
        let minor = |a: usize, b: usize| {
            (u[a].leaky_trace() * v[b].leaky_trace()) - (u[b].leaky_trace() * v[a].leaky_trace())
        };
        let squared = minor(1, 2).square() + minor(2, 0).square() + minor(0, 1).square();
        let sum = ((squared + 1e-12).sqrt() - 1.0).square().sum::<Rank0, _>();
        let value = sum.array();
        let by = sum.backward();
        for (k, tensors) in [u, v].iter().enumerate() {
            for (c, tensor) in tensors.iter().enumerate() {
                for (gradient, by) in gradients.tangents[k].iter_mut().zip(by.get(tensor).as_vec()) {
                    gradient[c] += weight * by;
                }
            }
        }
        f64::from(value)
    }
}

/// An ellipsoid, by the radial direction: an approximate projection is enough for an example.
struct Ellipsoid(DVec3);

impl Surface for Ellipsoid {
    fn bounds(&self) -> BoundingBox {
        BoundingBox { min: -self.0, max: self.0 }
    }

    fn project(&self, queries: &[Query], feet: &mut [Answer]) {
        for (query, foot) in queries.iter().zip(feet) {
            let scaled = query.point / self.0;
            *foot = match scaled.try_normalize() {
                Some(on_sphere) if query.point.is_finite() => {
                    let (point, normal) = (on_sphere * self.0, (on_sphere / self.0).normalize());
                    Ok(Foot { point, normal, hint: Hint::NONE })
                }
                _ => Err(Miss::NotFinite),
            };
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let surface = Ellipsoid(DVec3::new(1.0, 0.8, 0.7));
    let base = ManifoldMesh::try_from(shapes::icosphere(2).map_positions(|p| p * surface.0))?;
    let settings = Settings { epochs: 400, samples: 2048, ..Settings::default() };
    for weight in [0.0, 100.0] {
        let mut trainer = Trainer::new(&surface, &base, &settings)?.with_term(weight, Arc::new(KeepArea));
        let (fit, _) = train(&mut trainer, None, &NoProgress)?;
        let keep_area = trainer.term_means()[1].1;
        eprintln!(
            "weight {weight}: distance {:.1e}, mean (area − 1)² {keep_area:.1e}",
            fit.report.projection_rms
        );
    }
    Ok(())
}
