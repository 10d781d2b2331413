//! One chunk of an epoch: samples through g_θ and g_φ, losses, and all the way back.
//!
//! Everything of a block of [`BLOCK`] samples stays in the first-level cache. Gradients of the networks
//! accumulate per chunk; the gradients by the encodings z are written out per sample, and summed per vertex
//! afterwards.

use ndf_core::field::SampleEncoding;
use ndf_core::network::backward::InputGradient;
use ndf_core::network::{Activations, BLOCK, Gradients, Packed, backward, encoding, forward};
use pulp::{Simd, WithSimd};

use crate::batch::{Sample, Target};

/// Sums of the loss terms over samples, unweighted.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LossSums {
    pub(crate) projection: f64,
    pub(crate) cycle: f64,
}

/// A chunk's own memory, kept from epoch to epoch.
pub(crate) struct Chunk {
    theta: Activations,
    phi: Activations,
    pub(crate) theta_gradients: Gradients,
    pub(crate) phi_gradients: Gradients,
    pub(crate) losses: LossSums,
}

impl Chunk {
    pub(crate) fn new(theta: &Packed, phi: &Packed) -> Self {
        Self {
            theta: Activations::new(theta),
            phi: Activations::new(phi),
            theta_gradients: Gradients::new(theta),
            phi_gradients: Gradients::new(phi),
            losses: LossSums::default(),
        }
    }
}

/// The networks as they are in this epoch, and the weights of the losses.
#[derive(Clone, Copy)]
pub(crate) struct Model<'a> {
    pub(crate) encoding: SampleEncoding<'a>,
    pub(crate) theta: &'a Packed,
    pub(crate) phi: &'a Packed,
    pub(crate) reverse_octaves: usize,
    pub(crate) residual: bool,
    /// λ_P / s.
    pub(crate) projection_weight: f32,
    /// λ_C / s.
    pub(crate) cycle_weight: f32,
}

/// The work of one chunk, to be dispatched.
pub(crate) struct Step<'a> {
    pub(crate) model: Model<'a>,
    pub(crate) chunk: &'a mut Chunk,
    pub(crate) samples: &'a [Sample],
    pub(crate) targets: &'a [Target],
    /// Receives the derivative of the loss by z of every sample, d floats each.
    pub(crate) encoding_gradients: &'a mut [f32],
}

impl WithSimd for Step<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { model, chunk, samples, targets, encoding_gradients } = self;
        chunk.theta_gradients.clear();
        chunk.phi_gradients.clear();
        chunk.losses = LossSums::default();
        let d = model.encoding.dimension;
        let mut rest = encoding_gradients;
        for (samples, targets) in samples.chunks(BLOCK).zip(targets.chunks(BLOCK)) {
            let (dz, after) = rest.split_at_mut(d * samples.len());
            rest = after;
            block(simd, &model, chunk, samples, targets, dz);
        }
    }
}

#[inline(always)]
fn block<S: Simd>(
    simd: S,
    model: &Model<'_>,
    chunk: &mut Chunk,
    samples: &[Sample],
    targets: &[Target],
    dz: &mut [f32],
) {
    let mut x = [[0.0_f32; 3]; BLOCK];
    let mut y = [[0.0_f32; 3]; BLOCK];
    let mut dy = [[0.0_f32; 3]; BLOCK];

    let stride = chunk.theta.input_stride();
    let rows = chunk.theta.input_mut().chunks_exact_mut(stride);
    for ((sample, row), x) in samples.iter().zip(rows).zip(&mut x) {
        *x = model.encoding.encode(sample.face, sample.barycentric, row);
    }
    forward(simd, model.theta, &mut chunk.theta);
    let outputs = chunk.theta.output().chunks_exact(chunk.theta.output_stride());
    for ((y, x), out) in y.iter_mut().zip(&x).zip(outputs) {
        for c in 0..3 {
            y[c] = if model.residual { x[c] + out[c] } else { out[c] };
        }
    }

    for ((target, y), dy) in targets.iter().zip(&y).zip(&mut dy) {
        let (value, gradient) = projection_term(*y, target);
        chunk.losses.projection += f64::from(value);
        *dy = gradient.map(|g| g * model.projection_weight);
    }
    if model.cycle_weight > 0.0 {
        cycle_block(simd, model, chunk, samples.len(), &x, &y, &mut dy);
    }

    let stride = chunk.theta.output_stride();
    let rows = chunk.theta_gradients.output_mut().chunks_exact_mut(stride);
    for (s, (row, dy)) in rows.zip(&dy).enumerate() {
        row[..3].copy_from_slice(if s < samples.len() { dy } else { &[0.0; 3] });
    }
    backward(simd, model.theta, &chunk.theta, &mut chunk.theta_gradients, InputGradient::Wanted);
    let d = model.encoding.dimension;
    if d > 0 {
        let rows = chunk.theta_gradients.input().chunks_exact(chunk.theta.input_stride());
        for (dz, row) in dz.chunks_exact_mut(d).zip(rows) {
            dz.copy_from_slice(&row[..d]);
        }
    }
}

/// Cycle loss of a block: adds its value, the gradients of g_φ, and its part of `dy`.
#[inline(always)]
fn cycle_block<S: Simd>(
    simd: S,
    model: &Model<'_>,
    chunk: &mut Chunk,
    count: usize,
    x: &[[f32; 3]; BLOCK],
    y: &[[f32; 3]; BLOCK],
    dy: &mut [[f32; 3]; BLOCK],
) {
    let stride = chunk.phi.input_stride();
    let rows = chunk.phi.input_mut().chunks_exact_mut(stride);
    for (row, y) in rows.zip(y).take(count) {
        row[..3].copy_from_slice(y);
        encoding::encode(*y, model.reverse_octaves, &mut row[3..]);
    }
    forward(simd, model.phi, &mut chunk.phi);
    let out_stride = chunk.phi.output_stride();
    let deltas = chunk.phi_gradients.output_mut().chunks_exact_mut(out_stride);
    let mut sum = 0.0;
    for (s, (delta, out)) in deltas.zip(chunk.phi.output().chunks_exact(out_stride)).enumerate() {
        for c in 0..3 {
            delta[c] = 0.0;
            if s < count {
                let back = if model.residual { y[s][c] + out[c] } else { out[c] };
                let r = back - x[s][c];
                sum += r * r;
                delta[c] = 2.0 * model.cycle_weight * r;
                if model.residual {
                    dy[s][c] += delta[c];
                }
            }
        }
    }
    chunk.losses.cycle += f64::from(sum);
    backward(simd, model.phi, &chunk.phi, &mut chunk.phi_gradients, InputGradient::Wanted);
    let stride = chunk.phi.input_stride();
    let inputs = chunk.phi.input().chunks_exact(stride);
    let gradients = chunk.phi_gradients.input().chunks_exact(stride);
    for ((input, gradient), dy) in inputs.zip(gradients).zip(dy).take(count) {
        let through = encoding::encode_backward(&input[3..], &gradient[3..], model.reverse_octaves);
        for c in 0..3 {
            dy[c] += gradient[c] + through[c];
        }
    }
}

/// ‖y − P(y)‖² with the surface taken as its plane at the foot, and its gradient by y.
#[inline(always)]
fn projection_term(y: [f32; 3], target: &Target) -> (f32, [f32; 3]) {
    let n = target.normal;
    let height = (0..3).map(|c| n[c] * (y[c] - target.foot[c])).sum::<f32>();
    (height * height, n.map(|n| 2.0 * height * n))
}
