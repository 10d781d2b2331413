//! The cycle loss, for every form of the reverse map.

use std::sync::OnceLock;

use ndf_core::glam::Vec3;
use ndf_mesh::TriangleTree;
use ndf_network::simd::{InputGradient, backward, forward};
use ndf_network::{BLOCK, Mlp, MlpShape, Packed, encoding};
use pulp::{Simd, WithSimd};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::origin::{Origin, closest_origins, inverse_origins};
use super::{Block, Gradients, OwnNetwork, Place, Prepared, Projecting, Term};
use crate::settings::{ReverseMap, Settings};

/// L_C: ‖g_φ(g_θ(x)) − x‖², which keeps g from folding. The reverse map g_φ may be a network, learned with g; it may begin
/// at points of the base mesh, which are sought at every projection.
#[derive(Debug)]
pub struct Cycle {
    map: ReverseMap,
    octaves: usize,
    network: Option<MlpShape>,
    /// Whether g_φ is given x itself, and g_θ hears nothing of it.
    is_of_base: bool,
    /// Of the base mesh.
    tree: OnceLock<TriangleTree>,
}

impl Cycle {
    pub(crate) const NAME: &'static str = "cycle";

    /// The loss with the reverse map of these settings.
    pub fn new(settings: &Settings) -> Self {
        Self {
            map: settings.reverse_map,
            octaves: settings.reverse_octaves,
            network: settings.reverse_network(),
            is_of_base: false,
            tree: OnceLock::new(),
        }
    }

    /// The loss ‖g_φ(x) − x‖² of the identity stage. The gradient that goes through octaves of encoding into g_θ would keep
    /// that from learning the identity.
    pub fn of_base(settings: &Settings) -> Self {
        Self { is_of_base: true, ..Self::new(settings) }
    }

    /// What the network is added to, and the direction in which that does not follow y; none if it does not at all.
    #[inline(always)]
    fn start(&self, origin: Option<&Origin>, y: Vec3) -> (Vec3, Option<Vec3>) {
        match (self.map, origin) {
            (ReverseMap::Plain, _) => (Vec3::ZERO, None),
            (ReverseMap::Residual, _) | (_, None) => (y, Some(Vec3::ZERO)),
            (_, Some(Origin { point, image, normal, .. })) => {
                let away = y - *image;
                let height = normal.dot(away);
                (*point + (away - height * *normal), Some(*normal))
            }
        }
    }
}

impl Term for Cycle {
    fn name(&self) -> &str {
        Self::NAME
    }

    fn network(&self, seed: u64) -> Option<Mlp> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x9e37_79b9_7f4a_7c15);
        self.network.clone().map(|shape| match self.map {
            ReverseMap::Plain => Mlp::kaiming(shape, &mut rng),
            _ => Mlp::zero_at_birth(shape, &mut rng),
        })
    }

    fn prepare(&self, batch: &Projecting<'_>) -> Option<Prepared> {
        if !self.map.needs_origins() {
            return None;
        }
        let Projecting { field, samples, images } = *batch;
        let base = field.base();
        let tree = self.tree.get_or_init(|| TriangleTree::new(base));
        let origins = match self.map {
            ReverseMap::Inverse => inverse_origins(field, tree, images, samples),
            _ => closest_origins(base, tree, images, samples),
        };
        Some(Box::new(origins))
    }

    fn accumulate(&self, block: &Block<'_>, weight: f32, gradients: &mut Gradients<'_>) -> f64 {
        let mut by_points = [Vec3::ZERO; BLOCK];
        let by_points = &mut by_points[..block.len()];
        let origins = block.prepared::<Vec<Origin>>().and_then(|origins| origins.get(block.first..));
        let origins = origins.unwrap_or_default();
        let points = if self.is_of_base { block.base } else { block.images };
        let step = Step { cycle: self, block, origins, points, weight };
        let sum = match (&mut gradients.network, block.network) {
            (Some(network), Some(phi)) => {
                pulp::Arch::new().dispatch(Fused { step, phi, network, dy: by_points })
            }
            _ => step.compare(None, by_points),
        };
        if !self.is_of_base {
            gradients.images.iter_mut().zip(by_points).for_each(|(dy, by_point)| *dy += *by_point);
        }
        sum
    }
}

/// A block on its way through the reverse map and back.
#[derive(Clone, Copy)]
struct Step<'a> {
    cycle: &'a Cycle,
    block: &'a Block<'a>,
    /// As many as samples, or none.
    origins: &'a [Origin],
    /// What g_φ is given.
    points: &'a [Vec3],
    weight: f32,
}

/// The same with a network, to be dispatched.
struct Fused<'a> {
    step: Step<'a>,
    phi: &'a Packed,
    network: &'a mut OwnNetwork,
    dy: &'a mut [Vec3],
}

impl WithSimd for Fused<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let Self { step, phi, network, dy } = self;
        step.forward(simd, phi, network);
        let sum = step.compare(Some(network), dy);
        step.backward(simd, phi, network, dy);
        sum
    }
}

impl Step<'_> {
    /// Columns of the network's input before y: the encoding of the closest point of the base mesh, or none.
    #[inline(always)]
    fn prefix(&self) -> usize {
        if self.cycle.map == ReverseMap::Encoding { self.block.encoding.width() } else { 0 }
    }

    #[inline(always)]
    fn forward<S: Simd>(&self, simd: S, phi: &Packed, network: &mut OwnNetwork) {
        let activations = &mut network.activations;
        let (stride, first) = (activations.input_stride(), self.prefix());
        let mut points = [[0.0; 3]; BLOCK];
        points.iter_mut().zip(self.points).for_each(|(to, y)| *to = y.to_array());
        let points = &points[..self.points.len()];
        let rows = activations.input_mut().chunks_exact_mut(stride);
        for (s, (row, y)) in rows.zip(points).enumerate() {
            if first > 0 {
                let Place { face, barycentric } =
                    self.origins.get(s).map_or(self.block.places[s], |origin| origin.place);
                self.block.encoding.encode(simd, face, barycentric, &mut row[..first]);
            }
            row[first..][..3].copy_from_slice(y);
        }
        let rows = &mut activations.input_mut()[first + 3..];
        encoding::encode_rows(simd, points, self.cycle.octaves, rows, stride);
        forward(simd, phi, activations);
    }

    /// The sum of the loss; writes the derivatives by the output of the network, and those by `points` that do not go
    /// through it.
    #[inline(always)]
    fn compare(&self, mut network: Option<&mut OwnNetwork>, dy: &mut [Vec3]) -> f64 {
        let mut sum = 0.0;
        for (s, (dy, &y)) in dy.iter_mut().zip(self.points).enumerate() {
            let (start, normal) = self.cycle.start(self.origins.get(s), y);
            let out = network.as_ref().map_or(Vec3::ZERO, |network| {
                Vec3::from_slice(&network.activations.output()[s * network.activations.output_stride()..])
            });
            let r = start + out - self.block.base[s];
            sum += r.length_squared();
            let delta = 2.0 * self.weight * r;
            if let Some(network) = &mut network {
                let stride = network.activations.output_stride();
                delta.write_to_slice(&mut network.gradients.output_mut()[s * stride..]);
            }
            let along = normal.map_or(0.0, |normal| normal.dot(delta));
            *dy = normal.map_or(Vec3::ZERO, |normal| delta - along * normal);
        }
        f64::from(sum)
    }

    /// From the output of the network to its parameters and to `dy`. The encoding of the closest base point is taken as
    /// given: nothing goes back to its features.
    #[inline(always)]
    fn backward<S: Simd>(&self, simd: S, phi: &Packed, network: &mut OwnNetwork, dy: &mut [Vec3]) {
        let OwnNetwork { activations, gradients } = network;
        let (n, out_stride) = (self.points.len(), activations.output_stride());
        for row in gradients.output_mut().chunks_exact_mut(out_stride).take(BLOCK).skip(n) {
            row[..3].fill(0.0);
        }
        backward(simd, phi, activations, gradients, InputGradient::Wanted);
        let (stride, first) = (activations.input_stride(), self.prefix());
        let inputs = activations.input().chunks_exact(stride);
        for ((input, gradient), dy) in inputs.zip(gradients.input().chunks_exact(stride)).zip(dy) {
            let (input, gradient) = (&input[first..], &gradient[first..]);
            let through = encoding::encode_backward(&input[3..], &gradient[3..], self.cycle.octaves);
            *dy += Vec3::from_slice(gradient) + Vec3::from(through);
        }
    }
}
