//! One chunk of an epoch of the field: samples through g_θ, the terms of the objective, and all the way back.
//!
//! Everything of a block of [`BLOCK`] samples stays in the first-level cache. Gradients of the networks
//! accumulate per chunk. Samples come ordered by face, and a face belongs to one chunk: the gradients by the features
//! are summed per corner of a face here, and per vertex by the optimiser.

use std::sync::Arc;

use ndf_core::glam::Vec3;
use ndf_network::simd::{InputGradient, backward, backward_tangent, forward, forward_tangent};
use ndf_network::{Activations, BLOCK, Gradients as NetworkGradients, Packed};
use pulp::{Simd, WithSimd};

use crate::base::Base;
use crate::engine::{CornerGradients, Memory, Network};
use crate::objective::{Block, Epoch, Gradients, Needs, OwnNetwork, Place, Prepared, Target, Term};

/// A term at work.
pub(crate) struct Active {
    pub(crate) weight: f32,
    pub(crate) term: Arc<dyn Term>,
    /// Its own network, where it has one.
    pub(crate) network: Option<Packed>,
    /// The gradient by its parameters.
    pub(crate) by_network: Vec<f32>,
    pub(crate) prepared: Option<Prepared>,
}

impl Active {
    pub(crate) fn new(weight: f32, term: Arc<dyn Term>) -> Self {
        Self { weight, term, network: None, by_network: Vec::new(), prepared: None }
    }

    /// Takes over the gradient of its network, where it has one.
    pub(crate) fn collect(&mut self, own: Option<&OwnNetwork>) {
        if let Some(own) = own {
            self.by_network.fill(0.0);
            own.gradients.add_to(&mut self.by_network);
        }
    }
}

/// A chunk's own memory, kept from epoch to epoch.
pub(crate) struct Chunk {
    theta: Activations,
    theta_tangents: Option<[Activations; 2]>,
    pub(crate) theta_gradients: NetworkGradients,
    /// Derivatives by the interpolated features of a block; empty unless a term asks for it.
    feature_gradients: Vec<f32>,
    /// Of every term that has a network.
    pub(crate) networks: Vec<Option<OwnNetwork>>,
    /// Sums over samples of each term, unweighted.
    pub(crate) sums: Vec<f64>,
}

impl Chunk {
    pub(crate) fn new(theta: &Packed, terms: &[Active], features: usize) -> Self {
        let tangent = || Activations::new(theta);
        let need = |of: fn(Needs) -> bool| terms.iter().any(|active| of(active.term.needs()));
        let floats = if need(|needs| needs.feature_gradients) { BLOCK * features } else { 0 };
        Self {
            theta: Activations::new(theta),
            theta_tangents: need(|needs| needs.tangents).then(|| [tangent(), tangent()]),
            theta_gradients: NetworkGradients::new(theta),
            feature_gradients: vec![0.0; floats],
            networks: terms.iter().map(|active| active.network.as_ref().map(OwnNetwork::new)).collect(),
            sums: vec![0.0; terms.len()],
        }
    }

    fn clear(&mut self) {
        self.theta_gradients.clear();
        self.networks.iter_mut().flatten().for_each(|network| network.gradients.clear());
        self.sums.fill(0.0);
    }
}

impl Memory for Chunk {
    fn gradients(&self) -> &NetworkGradients {
        &self.theta_gradients
    }

    fn add(&mut self, other: &Self) {
        self.theta_gradients.add(&other.theta_gradients);
        for (network, other) in self.networks.iter_mut().flatten().zip(other.networks.iter().flatten()) {
            network.gradients.add(&other.gradients);
        }
        self.sums.iter_mut().zip(&other.sums).for_each(|(to, from)| *to += from);
    }
}

/// What all chunks of an epoch share.
#[derive(Clone, Copy)]
pub(crate) struct Shared<'a> {
    pub(crate) base: &'a Base,
    pub(crate) residual: bool,
    pub(crate) epoch: Epoch,
    pub(crate) terms: &'a [Active],
    /// 1 / number of samples.
    pub(crate) share: f32,
}

/// The work of one chunk, to be dispatched.
pub(crate) struct Step<'a> {
    pub(crate) shared: Shared<'a>,
    pub(crate) network: Network<'a>,
    pub(crate) chunk: &'a mut Chunk,
    pub(crate) places: &'a [Place],
    pub(crate) targets: &'a [Target],
    /// Number of the first sample in the batch.
    pub(crate) first: usize,
    /// Derivatives of the objective by the features, to be added to.
    pub(crate) corners: CornerGradients<'a>,
}

impl WithSimd for Step<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { shared, network, chunk, places, targets, first, mut corners } = self;
        chunk.clear();
        for (b, (places, targets)) in places.chunks(BLOCK).zip(targets.chunks(BLOCK)).enumerate() {
            let mut samples = Samples::new(places, targets);
            samples.forward(simd, &shared, &network, chunk);
            samples.terms(&shared, &network, chunk, first + b * BLOCK);
            samples.backward(simd, &shared, &network, chunk, &mut corners);
        }
    }
}

/// A block of samples on its way.
struct Samples<'a> {
    places: &'a [Place],
    targets: &'a [Target],
    x: [Vec3; BLOCK],
    y: [Vec3; BLOCK],
    tangents: [[Vec3; BLOCK]; 2],
    dy: [Vec3; BLOCK],
    dtangents: [[Vec3; BLOCK]; 2],
}

impl<'a> Samples<'a> {
    #[inline(always)]
    fn new(places: &'a [Place], targets: &'a [Target]) -> Self {
        let zero = [Vec3::ZERO; BLOCK];
        Self { places, targets, x: zero, y: zero, tangents: [zero; 2], dy: zero, dtangents: [zero; 2] }
    }

    #[inline(always)]
    fn forward<S: Simd>(&mut self, simd: S, shared: &Shared<'_>, network: &Network<'_>, chunk: &mut Chunk) {
        let Network { encoding, packed } = network;
        let stride = chunk.theta.input_stride();
        let rows = chunk.theta.input_mut().chunks_exact_mut(stride);
        for ((place, row), x) in self.places.iter().zip(rows).zip(&mut self.x) {
            *x = encoding.encode(simd, place.face, place.barycentric, row).into();
        }
        forward(simd, packed, &mut chunk.theta);
        let outputs = chunk.theta.output().chunks_exact(chunk.theta.output_stride());
        for ((y, x), out) in self.y.iter_mut().zip(&self.x).zip(outputs) {
            let out = Vec3::from_slice(out);
            *y = if shared.residual { *x + out } else { out };
        }
        let Some(tangents) = &mut chunk.theta_tangents else { return };
        let d = encoding.dimension();
        for (k, activations) in tangents.iter_mut().enumerate() {
            let mut last_face = None;
            for (s, place) in self.places.iter().enumerate() {
                let (before, tangent) = activations.input_mut().split_at_mut(s * stride);
                if encoding.is_linear() && last_face == Some(place.face) {
                    // The derivative of linear functions: the same all over the face.
                    tangent[..stride].copy_from_slice(&before[before.len() - stride..]);
                    continue;
                }
                last_face = Some(place.face);
                let row = &chunk.theta.input()[s * stride..][..stride];
                let direction = shared.base.frames[place.face.index()][k];
                encoding.encode_tangent(place.face, direction, row, &mut tangent[..stride]);
            }
            forward_tangent(simd, packed, &chunk.theta, activations);
            let outputs = activations.output().chunks_exact(activations.output_stride());
            let inputs = activations.input().chunks_exact(stride);
            for ((t, out), row) in
                self.tangents[k].iter_mut().zip(outputs).zip(inputs).take(self.places.len())
            {
                let out = Vec3::from_slice(out);
                *t = if shared.residual { Vec3::from_slice(&row[d..]) + out } else { out };
            }
        }
    }

    fn terms(&mut self, shared: &Shared<'_>, network: &Network<'_>, chunk: &mut Chunk, first: usize) {
        let n = self.places.len();
        let [u, v] = &self.tangents;
        let [du, dv] = &mut self.dtangents;
        let Chunk { theta, feature_gradients, networks, sums, .. } = chunk;
        feature_gradients.fill(0.0);
        for ((active, own), sum) in shared.terms.iter().zip(networks).zip(sums) {
            let block = Block {
                epoch: shared.epoch,
                base: &self.x[..n],
                images: &self.y[..n],
                tangents: [&u[..n], &v[..n]],
                targets: self.targets,
                network: active.network.as_ref(),
                places: self.places,
                mesh: shared.base,
                encoding: network.encoding,
                rows: theta.input(),
                stride: theta.input_stride(),
                prepared: active.prepared.as_deref(),
                first,
            };
            let mut gradients = Gradients {
                images: &mut self.dy[..n],
                tangents: [&mut du[..n], &mut dv[..n]],
                features: feature_gradients,
                network: own.as_mut(),
            };
            *sum += active.term.accumulate(&block, active.weight * shared.share, &mut gradients);
        }
    }

    #[inline(always)]
    fn backward<S: Simd>(
        &self,
        simd: S,
        shared: &Shared<'_>,
        network: &Network<'_>,
        chunk: &mut Chunk,
        corners: &mut CornerGradients<'_>,
    ) {
        let gradients = &mut chunk.theta_gradients;
        let (stride, out_stride) = (chunk.theta.input_stride(), chunk.theta.output_stride());
        for (k, tangent) in chunk.theta_tangents.iter().flatten().enumerate() {
            if self.dtangents[k].iter().all(|&d| d == Vec3::ZERO) {
                // Terms that only look at tangents: there is nothing to carry back.
                continue;
            }
            set_rows(gradients, &self.dtangents[k], self.places.len(), out_stride);
            backward_tangent(simd, network.packed, &chunk.theta, tangent, gradients, InputGradient::Wanted);
            corners.add(self.places, gradients.input(), stride, |place| {
                shared.base.frames[place.face.index()][k]
            });
        }
        set_rows(gradients, &self.dy, self.places.len(), out_stride);
        backward(simd, network.packed, &chunk.theta, gradients, InputGradient::Wanted);
        let d = network.encoding.dimension();
        let rows = gradients.input_mut().chunks_exact_mut(stride);
        for (row, by_features) in rows.zip(chunk.feature_gradients.chunks_exact(d.max(1))) {
            row.iter_mut().zip(by_features).for_each(|(to, from)| *to += from);
        }
        corners.add(self.places, gradients.input(), stride, |place| place.barycentric);
    }
}

/// Writes the derivative by the output; rows without a sample get zeros.
#[inline(always)]
fn set_rows(gradients: &mut NetworkGradients, values: &[Vec3; BLOCK], count: usize, stride: usize) {
    let rows = gradients.output_mut().chunks_exact_mut(stride);
    for (s, (row, value)) in rows.zip(values).enumerate() {
        if s < count { *value } else { Vec3::ZERO }.write_to_slice(row);
    }
}
