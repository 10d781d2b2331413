//! Where each rival stands: the figures of README.md.
//!
//! ```sh
//! cargo run --release -p ndf-baselines --example standing [WEIGHTS OF NDC OR NDCX]
//! ```

#![expect(clippy::print_stdout, reason = "the table that was asked for")]

use std::error::Error;
use std::time::Instant;

use ndf_baselines::sms::SpectralFidelity;
use ndf_baselines::{
    MicromeshOptions, NdcOptions, NeuralDualContouring, NeuralGeometryField, NgfOptions, OdcOptions,
    SmsOptions, micromesh, occupancy_dual_contouring, spectral_simplification,
};
use ndf_core::analytic::Torus;
use ndf_core::{DVec3, ImplicitField, NoProgress};
use ndf_formats::tensors::TensorFile;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::metrics::{MeasureOptions, measure};
use ndf_mesh::{ManifoldMesh, NotManifold, SelfIntersections, TriangleMesh, shapes};
use ndf_meshing::{DecimationOptions, MarchingCubesOptions, decimate, marching_cubes};
use ndf_spectral::{ModeOptions, OperatorOptions, SpectralError, modes};

fn main() -> Result<(), Box<dyn Error>> {
    contouring()?;
    simplification()?;
    micromeshes()?;
    geometry_fields()
}

const TORUS: Torus = Torus { center: DVec3::ZERO, ring: 1.0, tube: 0.4 };

fn contouring() -> Result<(), Box<dyn Error>> {
    println!("| torus, 100 cells | seconds | queries | faces | mean error, cells | self-intersections |");
    println!("|---|---|---|---|---|---|");
    let row = |name: &str,
               start: Instant,
               mesh: &TriangleMesh,
               cell: f64,
               queries: u64|
     -> Result<(), Box<dyn Error>> {
        let seconds = start.elapsed().as_secs_f64();
        let centers: Vec<DVec3> =
            mesh.face_indices().map(|f| mesh.corner_positions(f).into_iter().sum::<DVec3>() / 3.0).collect();
        let mut distances = vec![0.0; centers.len()];
        TORUS.values(&centers, &mut distances);
        let error = distances.iter().map(|d| d.abs()).sum::<f64>() / distances.len() as f64 / cell;
        let crossing = SelfIntersections::of(mesh, &NoProgress)?.pairs;
        let faces = mesh.face_count();
        println!("| {name} | {seconds:.2} | {queries} | {faces} | {error:.4} | {crossing} |");
        Ok(())
    };
    let start = Instant::now();
    let options = OdcOptions { grid: 100, ..OdcOptions::default() };
    let found = occupancy_dual_contouring(&TORUS, &options, &NoProgress)?;
    row("ODC", start, &found.mesh, found.cell, found.evaluations)?;
    if let Some(weights) = std::env::args().nth(1) {
        let network = NeuralDualContouring::from_tensors(&TensorFile::parse(&std::fs::read(weights)?)?)?;
        let start = Instant::now();
        let options = NdcOptions { grid: 100, ..NdcOptions::default() };
        let found = network.contour(&TORUS, &options, &NoProgress)?;
        let name = if network.is_deep() { "NDCx" } else { "NDC" };
        row(name, start, &found.mesh, found.cell, found.evaluations)?;
    }
    let start = Instant::now();
    let options = MarchingCubesOptions { grid: 100, ..MarchingCubesOptions::default() };
    let found = marching_cubes(&TORUS, &options, &NoProgress)?;
    row("marching cubes", start, &found.mesh, found.cell, found.evaluations)
}

/// A sphere with bumps, without symmetry.
fn bumpy(levels: u32) -> Result<ManifoldMesh, NotManifold> {
    let bump = |p: DVec3| {
        let waves = (5.0 * p.x + 1.0).sin() * (4.0 * p.y).sin() + 0.5 * (9.0 * p.z + p.x).sin();
        p * (1.0 + 0.15 * waves) * DVec3::new(1.0, 1.2, 1.5)
    };
    ManifoldMesh::try_from(shapes::icosphere(levels).map_positions(bump))
}

/// Mean relative error of the 20 smallest eigenvalues but the first, in per cent, and the norms of the paper for 100 modes.
fn fidelity(mesh: &ManifoldMesh, simple: &ManifoldMesh) -> Result<(f64, SpectralFidelity), SpectralError> {
    let operator = OperatorOptions { delaunay: false, ..OperatorOptions::default() };
    let options = ModeOptions { operator, ..ModeOptions::default() };
    let eigenvalues =
        |mesh| modes(&IntrinsicMesh::from_mesh(mesh), &options, &NoProgress).map(|found| found.eigenvalues);
    let errors =
        eigenvalues(simple)?.into_iter().zip(eigenvalues(mesh)?).skip(1).map(|(f, e)| (f - e).abs() / e);
    let error = 100.0 * errors.sum::<f64>() / 19.0;
    Ok((error, SpectralFidelity::of(mesh, simple, 100, &NoProgress)?))
}

fn simplification() -> Result<(), Box<dyn Error>> {
    let mesh = bumpy(5)?;
    println!();
    println!(
        "| bumpy sphere of {} vertices | seconds | 20 eigenvalues off by | commutativity | orthogonality |",
        mesh.vertex_count()
    );
    println!("|---|---|---|---|---|");
    for faces in [4000, 1000] {
        let row = |name: &str, start: Instant, simple: &ManifoldMesh| -> Result<(), Box<dyn Error>> {
            let seconds = start.elapsed().as_secs_f64();
            let (error, norms) = fidelity(&mesh, simple)?;
            let SpectralFidelity { commutativity, orthogonality } = norms;
            println!(
                "| {name} to {faces} faces | {seconds:.1} | {error:.2} % | {commutativity:.3} | {orthogonality:.3} |"
            );
            Ok(())
        };
        for modes in [20, 100] {
            let start = Instant::now();
            let simple = spectral_simplification(&mesh, &SmsOptions { faces, modes }, &NoProgress)?;
            row(&format!("SMS, {modes} modes,"), start, &simple.mesh)?;
        }
        let start = Instant::now();
        row("quadrics", start, &decimate(&mesh, &DecimationOptions::to_faces(faces), &NoProgress).mesh)?;
    }
    Ok(())
}

fn micromeshes() -> Result<(), Box<dyn Error>> {
    let mesh = bumpy(6)?;
    println!();
    println!(
        "| bumpy sphere of {} faces | seconds | bytes | bytes a face of the input | mean distance, diagonals |",
        mesh.face_count()
    );
    println!("|---|---|---|---|---|");
    for faces in [4000, 1000, 250] {
        for micro_faces in [mesh.face_count(), mesh.face_count() / 4] {
            let start = Instant::now();
            let options = MicromeshOptions { base_faces: faces, micro_faces: Some(micro_faces) };
            let baked = micromesh(&mesh, &options, &NoProgress)?;
            let seconds = start.elapsed().as_secs_f64();
            let (bytes, fine) = (baked.to_bytes().len(), baked.tessellated());
            let error = measure(&mesh, &fine, &MeasureOptions::default())?;
            let mean = error.reference_to_mesh.mean / error.diagonal;
            let (micro, share) = (fine.face_count(), bytes as f64 / mesh.face_count() as f64);
            println!(
                "| {faces} faces, {micro} micro-faces | {seconds:.1} | {bytes} | {share:.2} | {mean:.1e} |"
            );
        }
    }
    Ok(())
}

fn geometry_fields() -> Result<(), Box<dyn Error>> {
    let mesh = bumpy(6)?;
    println!();
    println!(
        "| bumpy sphere of {} faces | seconds | bytes | mean distance, diagonals | mean angle of normals |",
        mesh.face_count()
    );
    println!("|---|---|---|---|---|");
    for quads in [100, 400] {
        let start = Instant::now();
        let options = NgfOptions::with_quads(quads);
        let learned = NeuralGeometryField::learn(&mesh, &options, &NoProgress)?;
        let seconds = start.elapsed().as_secs_f64();
        let (bytes, fine) = (learned.field.to_bytes().len(), learned.field.tessellated(16));
        let error = measure(&mesh, &fine, &MeasureOptions::default())?;
        let mean = error.reference_to_mesh.mean / error.diagonal;
        let (count, angle) = (learned.field.quad_count(), error.normal_angle_mean.to_degrees());
        println!("| {count} quadrilaterals | {seconds:.0} | {bytes} | {mean:.1e} | {angle:.1}° |");
    }
    Ok(())
}
