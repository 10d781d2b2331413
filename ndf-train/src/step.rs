//! One chunk of an epoch: samples through g_θ and g_φ, losses, and all the way back.
//!
//! Everything of a block of [`BLOCK`] samples stays in the first-level cache. Gradients of the networks
//! accumulate per chunk. Samples come ordered by face, and a face belongs to one chunk: the gradients by the features
//! are summed per corner of a face here, and per vertex by the optimiser.

use ndf_model::intrinsic_network::IntrinsicEncoding;
use ndf_network::simd::{InputGradient, backward, backward_tangent, forward, forward_tangent};
use ndf_network::{Activations, BLOCK, Gradients, Packed};
use pulp::{Simd, WithSimd};

use crate::batch::Sample;
use crate::cycle::{Cycle, ReverseNetwork};
use crate::objective::Objective;
use crate::origin::Origin;
use crate::settings::ReverseMap;
use crate::terms::{SampleGradients, Samples, Target};

/// A chunk's own memory, kept from epoch to epoch.
pub(crate) struct Chunk {
    theta: Activations,
    theta_tangents: Option<[Activations; 2]>,
    pub(crate) theta_gradients: Gradients,
    /// None where the reverse map has no network.
    pub(crate) phi: Option<ReverseNetwork>,
    /// Sums over samples of each term of the objective, unweighted.
    pub(crate) terms: Vec<f64>,
    /// Sum over samples of the cycle loss, unweighted.
    pub(crate) cycle: f64,
}

impl Chunk {
    pub(crate) fn new(theta: &Packed, phi: Option<&Packed>, objective: &Objective) -> Self {
        let tangent = || Activations::new(theta);
        Self {
            theta: Activations::new(theta),
            theta_tangents: objective.needs_tangents().then(|| [tangent(), tangent()]),
            theta_gradients: Gradients::new(theta),
            phi: phi.map(ReverseNetwork::new),
            terms: vec![0.0; objective.terms.len()],
            cycle: 0.0,
        }
    }
}

impl Chunk {
    /// Adds the sums of another chunk.
    pub(crate) fn add(&mut self, other: &Self) {
        self.theta_gradients.add(&other.theta_gradients);
        if let (Some(phi), Some(other)) = (&mut self.phi, &other.phi) {
            phi.gradients.add(&other.gradients);
        }
        self.terms.iter_mut().zip(&other.terms).for_each(|(to, from)| *to += from);
        self.cycle += other.cycle;
    }
}

/// The networks as they are in this epoch.
#[derive(Clone, Copy)]
pub(crate) struct Model<'a> {
    pub(crate) encoding: IntrinsicEncoding<'a>,
    /// Derivatives of the barycentric coordinates of every base face along its orthonormal frame.
    pub(crate) frames: &'a [[[f32; 3]; 2]],
    pub(crate) theta: &'a Packed,
    /// None where the reverse map has no network.
    pub(crate) phi: Option<&'a Packed>,
    pub(crate) reverse_map: ReverseMap,
    pub(crate) reverse_octaves: usize,
    pub(crate) residual: bool,
}

impl Model<'_> {
    /// Columns of the reverse map's input before y: the encoding of the closest point of the base mesh, or none.
    #[inline(always)]
    pub(crate) fn reverse_prefix(&self) -> usize {
        if self.reverse_map == ReverseMap::Encoding { self.theta.layers()[0].inputs } else { 0 }
    }
}

/// The work of one chunk, to be dispatched.
pub(crate) struct Step<'a> {
    pub(crate) model: Model<'a>,
    pub(crate) objective: &'a Objective,
    /// 1 / number of samples of the epoch.
    pub(crate) share: f32,
    pub(crate) chunk: &'a mut Chunk,
    pub(crate) samples: &'a [Sample],
    pub(crate) targets: &'a [Target],
    /// Of every sample, where the reverse map asks for them; else empty.
    pub(crate) origins: &'a [Origin],
    /// The face whose corners come first in `corner_gradients`.
    pub(crate) first_face: u32,
    /// Derivatives of the objective by the features of the corners of faces, to be added to: 3 d floats a face.
    pub(crate) corner_gradients: &'a mut [f32],
}

impl WithSimd for Step<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { model, objective, share, chunk, samples, targets, origins, first_face, corner_gradients } =
            self;
        chunk.theta_gradients.clear();
        if let Some(phi) = &mut chunk.phi {
            phi.gradients.clear();
        }
        chunk.terms.fill(0.0);
        chunk.cycle = 0.0;
        let mut corners =
            CornerGradients { first_face, by_corner: corner_gradients, encoding: model.encoding };
        for (b, (samples, targets)) in samples.chunks(BLOCK).zip(targets.chunks(BLOCK)).enumerate() {
            let origins = origins.get(b * BLOCK..).unwrap_or_default();
            let mut block = Block::new(samples, targets, origins);
            block.forward(simd, &model, chunk);
            block.terms(objective, share, chunk);
            if objective.lambda_c > 0.0 {
                block.cycle(simd, &model, chunk, objective.lambda_c * share, objective.is_identity);
            }
            block.backward(simd, &model, chunk, &mut corners);
        }
    }
}

/// A block of samples on its way.
struct Block<'a> {
    samples: &'a [Sample],
    targets: &'a [Target],
    origins: &'a [Origin],
    x: [[f32; 3]; BLOCK],
    y: [[f32; 3]; BLOCK],
    tangents: [[[f32; 3]; BLOCK]; 2],
    dy: [[f32; 3]; BLOCK],
    dtangents: [[[f32; 3]; BLOCK]; 2],
}

impl<'a> Block<'a> {
    #[inline(always)]
    fn new(samples: &'a [Sample], targets: &'a [Target], origins: &'a [Origin]) -> Self {
        let zero = [[0.0; 3]; BLOCK];
        Self {
            samples,
            targets,
            origins,
            x: zero,
            y: zero,
            tangents: [zero; 2],
            dy: zero,
            dtangents: [zero; 2],
        }
    }

    #[inline(always)]
    fn forward<S: Simd>(&mut self, simd: S, model: &Model<'_>, chunk: &mut Chunk) {
        let stride = chunk.theta.input_stride();
        let rows = chunk.theta.input_mut().chunks_exact_mut(stride);
        for ((sample, row), x) in self.samples.iter().zip(rows).zip(&mut self.x) {
            *x = model.encoding.encode(simd, sample.face, sample.barycentric, row);
        }
        forward(simd, model.theta, &mut chunk.theta);
        let outputs = chunk.theta.output().chunks_exact(chunk.theta.output_stride());
        for ((y, x), out) in self.y.iter_mut().zip(&self.x).zip(outputs) {
            for c in 0..3 {
                y[c] = if model.residual { x[c] + out[c] } else { out[c] };
            }
        }
        let Some(tangents) = &mut chunk.theta_tangents else { return };
        let d = model.encoding.dimension();
        for (k, activations) in tangents.iter_mut().enumerate() {
            let mut last_face = None;
            for (s, sample) in self.samples.iter().enumerate() {
                let (before, tangent) = activations.input_mut().split_at_mut(s * stride);
                if model.encoding.is_linear() && last_face == Some(sample.face) {
                    // The derivative of linear functions: the same all over the face.
                    tangent[..stride].copy_from_slice(&before[before.len() - stride..]);
                    continue;
                }
                last_face = Some(sample.face);
                let row = &chunk.theta.input()[s * stride..][..stride];
                let direction = model.frames[sample.face as usize][k];
                model.encoding.encode_tangent(sample.face, direction, row, &mut tangent[..stride]);
            }
            forward_tangent(simd, model.theta, &chunk.theta, activations);
            let outputs = activations.output().chunks_exact(activations.output_stride());
            let inputs = activations.input().chunks_exact(stride);
            for ((t, out), row) in
                self.tangents[k].iter_mut().zip(outputs).zip(inputs).take(self.samples.len())
            {
                for c in 0..3 {
                    t[c] = if model.residual { row[d + c] + out[c] } else { out[c] };
                }
            }
        }
    }

    fn terms(&mut self, objective: &Objective, share: f32, chunk: &mut Chunk) {
        let n = self.samples.len();
        let [u, v] = &self.tangents;
        let samples = Samples {
            base: &self.x[..n],
            points: &self.y[..n],
            tangents: [&u[..n], &v[..n]],
            targets: self.targets,
        };
        let [du, dv] = &mut self.dtangents;
        let mut gradients =
            SampleGradients { points: &mut self.dy[..n], tangents: [&mut du[..n], &mut dv[..n]] };
        for ((weight, term), sum) in objective.terms.iter().zip(&mut chunk.terms) {
            *sum += term.accumulate(&samples, weight * share, &mut gradients);
        }
    }

    /// Cycle loss: adds its value, the gradients of g_φ, and its part of `dy`. In the identity stage g_φ is given x, not
    /// g_θ(x), and has no part in `dy`.
    #[inline(always)]
    fn cycle<S: Simd>(
        &mut self,
        simd: S,
        model: &Model<'_>,
        chunk: &mut Chunk,
        weight: f32,
        is_identity: bool,
    ) {
        let n = self.samples.len();
        let points = if is_identity { &self.x[..n] } else { &self.y[..n] };
        let cycle = Cycle { samples: self.samples, origins: self.origins, base: &self.x[..n], points };
        let mut by_points = [[0.0; 3]; BLOCK];
        chunk.cycle += cycle.accumulate(simd, model, chunk.phi.as_mut(), weight, &mut by_points[..n]);
        if !is_identity {
            for (dy, by_point) in self.dy.as_flattened_mut().iter_mut().zip(by_points.as_flattened()) {
                *dy += by_point;
            }
        }
    }

    #[inline(always)]
    fn backward<S: Simd>(
        &self,
        simd: S,
        model: &Model<'_>,
        chunk: &mut Chunk,
        corners: &mut CornerGradients<'_>,
    ) {
        let gradients = &mut chunk.theta_gradients;
        let (stride, out_stride) = (chunk.theta.input_stride(), chunk.theta.output_stride());
        for (k, tangent) in chunk.theta_tangents.iter().flatten().enumerate() {
            if self.dtangents[k].as_flattened().iter().all(|&d| d == 0.0) {
                // Terms that only look at tangents: there is nothing to carry back.
                continue;
            }
            set_rows(gradients, &self.dtangents[k], self.samples.len(), out_stride);
            backward_tangent(simd, model.theta, &chunk.theta, tangent, gradients, InputGradient::Wanted);
            corners
                .add(self.samples, gradients.input(), stride, |sample| model.frames[sample.face as usize][k]);
        }
        set_rows(gradients, &self.dy, self.samples.len(), out_stride);
        backward(simd, model.theta, &chunk.theta, gradients, InputGradient::Wanted);
        corners.add(self.samples, gradients.input(), stride, |sample| sample.barycentric);
    }
}

/// Sums of the gradients by the features, corner by corner.
pub(crate) struct CornerGradients<'a> {
    /// The face whose corners come first in `by_corner`.
    pub(crate) first_face: u32,
    /// d floats a corner.
    pub(crate) by_corner: &'a mut [f32],
    pub(crate) encoding: IntrinsicEncoding<'a>,
}

impl CornerGradients<'_> {
    /// Adds the derivatives by the interpolated features, which begin the rows, times the weights of the corners.
    #[inline(always)]
    pub(crate) fn add(
        &mut self,
        samples: &[Sample],
        rows: &[f32],
        stride: usize,
        weights: impl Fn(&Sample) -> [f32; 3],
    ) {
        let d = self.encoding.dimension();
        if d == 0 {
            return;
        }
        for (sample, row) in samples.iter().zip(rows.chunks_exact(stride)) {
            let face = (sample.face - self.first_face) as usize;
            self.encoding.add_to_corners(weights(sample), row, &mut self.by_corner[3 * face * d..]);
        }
    }
}

/// Writes the derivative by the output; rows without a sample get zeros.
#[inline(always)]
fn set_rows(gradients: &mut Gradients, values: &[[f32; 3]; BLOCK], count: usize, stride: usize) {
    let rows = gradients.output_mut().chunks_exact_mut(stride);
    for (s, (row, value)) in rows.zip(values).enumerate() {
        row[..3].copy_from_slice(if s < count { value } else { &[0.0; 3] });
    }
}
