//! Reading and writing model files on one thread: `cargo bench -p ndf-model --bench model -- [MODEL.ndf …]`.
//!
//! Besides the files that are named, a made model: features and weights uniform at random, plain and in the default
//! precision. Learned features, of which most are small, take about half the bytes.

#![allow(clippy::print_stdout)]

use std::fs;
use std::hint::black_box;
use std::time::Instant;

use ndf_mesh::ManifoldMesh;
use ndf_mesh::shapes;
use ndf_model::file::{Precision, StoredBase};
use ndf_model::{DisplacementField, FieldShape, Model};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

fn main() {
    println!("{:<24} {:>7} {:>8} {:>8} {:>8}", "model", "faces", "bytes", "read ms", "write ms");
    let model = made();
    bench("made, single precision", &model.to_bytes());
    bench("made, default precision", &model.rounded(Precision::default()).to_bytes());
    for path in std::env::args().skip(1).filter(|arg| !arg.starts_with('-')) {
        match fs::read(&path) {
            Ok(bytes) => bench(path.rsplit('/').next().unwrap_or(&path), &bytes),
            Err(error) => println!("{path}: {error}"),
        }
    }
}

fn made() -> Model {
    let base = ManifoldMesh::try_from(shapes::trefoil_knot(200, 10, 0.2)).expect("a knot is a manifold");
    let StoredBase { mesh: base, similarity, .. } = StoredBase::new(&base, Some(Precision::default()), 0.0);
    let shape = FieldShape::default();
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut numbers = |n: usize| (0..n).map(|_| rng.random_range(-0.5..0.5)).collect::<Vec<f32>>();
    let features = numbers(base.vertex_count() * shape.network.features);
    let parameters = numbers(shape.mlp().parameter_count());
    let field = DisplacementField::new(base, shape, features, parameters).expect("the parts fit");
    Model { field, similarity, metric: None, scalars: Vec::new(), provenance: "{}".to_owned() }
}

fn bench(name: &str, bytes: &[u8]) {
    let model = match Model::from_bytes(bytes) {
        Ok(model) => model,
        Err(error) => return println!("{name}: {error}"),
    };
    let faces = model.field.base().face_count();
    let read = 1e3 * median_seconds(|| black_box(Model::from_bytes(black_box(bytes))).is_ok());
    let write = 1e3 * median_seconds(|| black_box(black_box(&model).to_bytes()).len());
    println!("{name:<24} {faces:>7} {:>8} {read:>8.2} {write:>8.2}", bytes.len());
}

/// The median of 21 runs.
fn median_seconds<T>(mut work: impl FnMut() -> T) -> f64 {
    let mut seconds: Vec<f64> = (0..21)
        .map(|_| {
            let start = Instant::now();
            black_box(work());
            start.elapsed().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    seconds[10]
}
