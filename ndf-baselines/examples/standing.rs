//! Where each rival stands: the figures of README.md.
//!
//! ```sh
//! cargo run --release -p ndf-baselines --example standing
//! ```

#![expect(clippy::print_stdout, reason = "the table that was asked for")]

use std::error::Error;
use std::time::Instant;

use ndf_baselines::{OdcOptions, occupancy_dual_contouring};
use ndf_core::analytic::Torus;
use ndf_core::{DVec3, ImplicitField, NoProgress};
use ndf_mesh::SelfIntersections;
use ndf_meshing::{Isosurface, MarchingCubesOptions, marching_cubes};

fn main() -> Result<(), Box<dyn Error>> {
    contouring()
}

const TORUS: Torus = Torus { center: DVec3::ZERO, ring: 1.0, tube: 0.4 };

fn contouring() -> Result<(), Box<dyn Error>> {
    println!("| torus, 100 cells | seconds | queries | faces | mean error, cells | self-intersections |");
    println!("|---|---|---|---|---|---|");
    let row = |name: &str, start: Instant, surface: &Isosurface| -> Result<(), Box<dyn Error>> {
        let seconds = start.elapsed().as_secs_f64();
        let mesh = &surface.mesh;
        let centers: Vec<DVec3> =
            mesh.face_indices().map(|f| mesh.corner_positions(f).into_iter().sum::<DVec3>() / 3.0).collect();
        let mut distances = vec![0.0; centers.len()];
        TORUS.values(&centers, &mut distances);
        let error = distances.iter().map(|d| d.abs()).sum::<f64>() / distances.len() as f64 / surface.cell;
        let crossing = SelfIntersections::of(mesh, &NoProgress)?.pairs;
        let (queries, faces) = (surface.evaluations, mesh.face_count());
        println!("| {name} | {seconds:.2} | {queries} | {faces} | {error:.4} | {crossing} |");
        Ok(())
    };
    let start = Instant::now();
    let options = OdcOptions { grid: 100, ..OdcOptions::default() };
    row("ODC", start, &occupancy_dual_contouring(&TORUS, &options, &NoProgress)?)?;
    let start = Instant::now();
    let options = MarchingCubesOptions { grid: 100, ..MarchingCubesOptions::default() };
    row("marching cubes", start, &marching_cubes(&TORUS, &options, &NoProgress)?)
}
