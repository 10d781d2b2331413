//! Learning by Adam: the surface forward, the gradient of the loss back.

use ndf_core::glam::Vec3;
use ndf_core::{Cancelled, Progress};
use ndf_mesh::ManifoldMesh;
use ndf_network::simd::{InputGradient, backward, forward};
use ndf_network::{Activations, BLOCK, Gradients, Packed, encoding};
use pulp::{Arch, Simd, WithSimd};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::loss::Target;
use super::tessellation::{Sample, Tessellation};
use super::{NeuralGeometryField, NgfOptions, OCTAVES};

/// The rate of features is so many times that of the network.
const FEATURE_RATE: f32 = 10.0;
/// The encoding has the angles 2ᵏ x, where ours has 2ᵏ π x.
const ANGLE: f32 = std::f32::consts::FRAC_1_PI;
/// Parts of the samples whose gradients are added in order, whatever the number of threads.
const PARTS: usize = 32;

/// Features to begin with.
pub(crate) fn first_features(count: usize, rng: &mut ChaCha8Rng) -> Vec<f32> {
    (0..count).map(|_| rng.random_range(-0.1..0.1)).collect()
}

/// A block of samples on its way through the network, and back if there is a gradient.
struct Block<'a> {
    field: &'a NeuralGeometryField,
    packed: &'a Packed,
    samples: &'a [Sample],
    activations: &'a mut Activations,
    /// The gradient by the places of the samples, and what to add to.
    back: Option<(&'a [Vec3], &'a mut Gradients)>,
}

/// What comes of a sample: its place, or, on the way back, the gradient by its place on the quadrilateral, and by its
/// features.
#[derive(Default)]
struct BlockResult {
    places: Vec<Vec3>,
    by_point: Vec<Vec3>,
    by_features: Vec<f32>,
}

impl WithSimd for Block<'_> {
    type Output = BlockResult;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> BlockResult {
        let Self { field, packed, samples, activations, back } = self;
        let features = field.feature_count();
        let (stride, out_stride) = (activations.input_stride(), activations.output_stride());
        let end = features + encoding::width(OCTAVES);
        let mut points = [Vec3::ZERO; BLOCK];
        for ((sample, point), row) in
            samples.iter().zip(&mut points).zip(activations.input_mut().chunks_exact_mut(stride))
        {
            row[..features].fill(0.0);
            for (&corner, &weight) in field.quads[sample.quad].iter().zip(&sample.weights) {
                *point += weight * field.points[corner as usize];
                let of_corner = &field.features[corner as usize * features..][..features];
                row[..features].iter_mut().zip(of_corner).for_each(|(x, f)| *x += weight * f);
            }
            encoding::encode(simd, (ANGLE * *point).to_array(), OCTAVES, &mut row[features..end]);
        }
        forward(simd, packed, activations);
        let moved = |(point, row): (&Vec3, &[f32])| *point + Vec3::new(row[0], row[1], row[2]);
        let rows = activations.output().chunks_exact(out_stride);
        let places = points.iter().zip(rows).take(samples.len()).map(moved).collect();
        let mut result = BlockResult { places, ..BlockResult::default() };
        if let Some((by_place, gradients)) = back {
            let output = gradients.output_mut();
            output.fill(0.0);
            for (row, g) in output.chunks_exact_mut(out_stride).zip(by_place) {
                row[..3].copy_from_slice(&g.to_array());
            }
            backward(simd, packed, activations, gradients, InputGradient::Wanted);
            let rows = activations.input().chunks_exact(stride).zip(gradients.input().chunks_exact(stride));
            for ((row, by_row), g) in rows.zip(by_place) {
                let by_encoding =
                    encoding::encode_backward(&row[features..end], &by_row[features..end], OCTAVES);
                result.by_point.push(*g + ANGLE * Vec3::from_array(by_encoding));
                result.by_features.extend_from_slice(&by_row[..features]);
            }
        }
        result
    }
}

/// The places of all samples.
pub(crate) fn places(field: &NeuralGeometryField, packed: &Packed, tessellation: &Tessellation) -> Vec<Vec3> {
    let of_chunk = |samples: &[Sample]| {
        let mut activations = Activations::new(packed);
        let mut found = Vec::with_capacity(samples.len());
        for samples in samples.chunks(BLOCK) {
            let block = Block { field, packed, samples, activations: &mut activations, back: None };
            found.extend(Arch::new().dispatch(block).places);
        }
        found
    };
    tessellation.samples.par_chunks(64 * BLOCK).flat_map_iter(of_chunk).collect()
}

/// Gradients of all that is learned.
pub(crate) struct FieldGradient {
    pub(crate) points: Vec<Vec3>,
    pub(crate) features: Vec<f32>,
    pub(crate) network: Vec<f32>,
}

/// The gradient by the field of a loss with this gradient by the places of samples.
pub(crate) fn gradient(
    field: &NeuralGeometryField,
    packed: &Packed,
    tessellation: &Tessellation,
    by_place: &[Vec3],
) -> FieldGradient {
    let features = field.feature_count();
    let part = tessellation.samples.len().div_ceil(PARTS).next_multiple_of(BLOCK);
    let of_part = |(samples, by_place): (&[Sample], &[Vec3])| {
        let mut activations = Activations::new(packed);
        let mut gradients = Gradients::new(packed);
        let mut all = BlockResult::default();
        for (samples, by_place) in samples.chunks(BLOCK).zip(by_place.chunks(BLOCK)) {
            let back = Some((by_place, &mut gradients));
            let block = Block { field, packed, samples, activations: &mut activations, back };
            let found = Arch::new().dispatch(block);
            all.by_point.extend(found.by_point);
            all.by_features.extend(found.by_features);
        }
        (gradients, all)
    };
    let parts: Vec<(Gradients, BlockResult)> =
        tessellation.samples.par_chunks(part).zip(by_place.par_chunks(part)).map(of_part).collect();
    let mut sum = FieldGradient {
        points: vec![Vec3::ZERO; field.points.len()],
        features: vec![0.0; field.features.len()],
        network: vec![0.0; field.network.parameters().len()],
    };
    for (samples, (gradients, found)) in tessellation.samples.chunks(part).zip(&parts) {
        gradients.add_to(&mut sum.network);
        let by_features = found.by_features.chunks_exact(features);
        for ((sample, by_point), by_features) in samples.iter().zip(&found.by_point).zip(by_features) {
            for (&corner, &weight) in field.quads[sample.quad].iter().zip(&sample.weights) {
                sum.points[corner as usize] += weight * *by_point;
                let of_corner = &mut sum.features[corner as usize * features..][..features];
                of_corner.iter_mut().zip(by_features).for_each(|(to, g)| *to += weight * g);
            }
        }
    }
    sum
}

/// Learns a field of a mesh in the normalised box; returns the last loss.
pub(crate) fn run(
    field: &mut NeuralGeometryField,
    mesh: &ManifoldMesh,
    options: &NgfOptions,
    progress: &dyn Progress,
) -> Result<f64, Cancelled> {
    let target = Target::new(mesh);
    let mut packed = Packed::new(&field.network);
    let mut adams =
        [3 * field.points.len(), field.features.len(), field.network.parameters().len()].map(Adam::new);
    let mut last = 0.0;
    let total = (options.tessellations.len() * options.iterations) as f64;
    for (round, &steps) in options.tessellations.iter().enumerate() {
        let tessellation = Tessellation::new(field.points.len(), &field.quads, steps);
        for iteration in 0..options.iterations {
            progress.check()?;
            progress.report("neural geometry field", (round * options.iterations + iteration) as f64 / total);
            // Down to nothing with each tessellation, along half a cosine.
            let done = iteration as f32 / options.iterations as f32;
            let rate = options.rate * 0.5 * (1.0 + (std::f32::consts::PI * done).cos());
            let places = places(field, &packed, &tessellation);
            let (loss, by_place) = target.loss(&places, &tessellation.faces);
            progress.detail(&format!("loss {loss:.5}"));
            last = loss;
            let by_place: Vec<Vec3> = by_place.iter().map(|g| g.as_vec3()).collect();
            let gradient = gradient(field, &packed, &tessellation, &by_place);
            let [of_points, of_features, of_network] = &mut adams;
            let by_points: Vec<f32> = gradient.points.iter().flat_map(Vec3::to_array).collect();
            let mut points: Vec<f32> = field.points.iter().flat_map(Vec3::to_array).collect();
            of_points.step(rate, &mut points, &by_points);
            field.points = points.chunks_exact(3).map(Vec3::from_slice).collect();
            of_features.step(FEATURE_RATE * rate, &mut field.features, &gradient.features);
            of_network.step(rate, field.network.parameters_mut(), &gradient.network);
            packed.pack(field.network.parameters());
        }
    }
    progress.report("neural geometry field", 1.0);
    Ok(last)
}

/// Adam (Kingma and Ba 2015) with its usual constants.
struct Adam {
    first: Vec<f32>,
    second: Vec<f32>,
    steps: i32,
}

impl Adam {
    fn new(count: usize) -> Self {
        Self { first: vec![0.0; count], second: vec![0.0; count], steps: 0 }
    }

    fn step(&mut self, rate: f32, parameters: &mut [f32], gradient: &[f32]) {
        self.steps += 1;
        let (keep, keep_squares) = (0.9_f32, 0.999_f32);
        let rate = rate * (1.0 - keep_squares.powi(self.steps)).sqrt() / (1.0 - keep.powi(self.steps));
        let moments = self.first.iter_mut().zip(&mut self.second);
        for ((p, g), (m, v)) in parameters.iter_mut().zip(gradient).zip(moments) {
            *m = keep * *m + (1.0 - keep) * g;
            *v = keep_squares * *v + (1.0 - keep_squares) * g * g;
            *p -= rate * *m / (v.sqrt() + 1e-8);
        }
    }
}
