//! A loss of one's own whose gradient is left to a tape: the map should keep areas, the more the higher on the surface.
//! Weights are given at the vertices of the base mesh. `cargo run --release -p ndf-train --example keep_area`

use std::sync::Arc;

use ndf_core::DVec3;
use ndf_core::analytic::Sphere;
use ndf_core::progress::NoProgress;
use ndf_mesh::{ManifoldMesh, shapes};
use ndf_train::objective::{Block, Gradients, Needs, Term};
use ndf_train::tape::{Tape, Var};
use ndf_train::{Settings, Trainer, train};

/// w (|J u × J v| − 1)², with w interpolated from the vertices.
struct KeepArea(Vec<f32>);

impl Term for KeepArea {
    fn name(&self) -> &str {
        "keep_area"
    }

    fn needs(&self) -> Needs {
        Needs::TANGENTS
    }

    fn accumulate(&self, block: &Block<'_>, weight: f32, gradients: &mut Gradients<'_>) -> f64 {
        let one = |i: usize| {
            let tape = Tape::default();
            let [u, v]: [[Var<'_>; 3]; 2] =
                block.tangents.map(|t| t[i].to_array().map(|x| tape.variable(x.into())));
            let minor = |a: usize, b: usize| u[a] * v[b] - u[b] * v[a];
            let [x, y, z] = [minor(1, 2), minor(2, 0), minor(0, 1)];
            let excess = (x * x + y * y + z * z + 1e-12).sqrt() - 1.0;
            let loss = excess * excess * f64::from(block.interpolate(i, &self.0));
            let by = loss.gradient();
            for (k, c) in (0..6).map(|k| (k / 3, k % 3)) {
                gradients.tangents[k][i][c] += weight * by.by([u, v][k][c]) as f32;
            }
            loss.value()
        };
        (0..block.len()).map(one).sum()
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let base = ManifoldMesh::try_from(shapes::icosphere(2).map_positions(|p| p * DVec3::new(1.0, 0.8, 0.7)))?;
    let settings = Settings { epochs: 400, samples: 2048, ..Settings::default() };
    let weights: Vec<f32> = base.positions().iter().map(|p| (1.0 + p.z) as f32).collect();
    for weight in [0.0, 100.0] {
        let term = Arc::new(KeepArea(weights.clone()));
        let mut trainer = Trainer::new(&Sphere::UNIT, &base, &settings)?.with_term(weight, term);
        let (fit, _) = train(&mut trainer, None, &NoProgress)?;
        let (name, mean) = trainer.term_means().last().ok_or("there are terms")?;
        eprintln!("weight {weight}: distance {:.1e}, {name} {mean:.1e}", fit.report.projection_rms);
    }
    Ok(())
}
