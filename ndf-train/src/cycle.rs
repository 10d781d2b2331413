//! The cycle loss ‖g_φ(g_θ(x)) − x‖² of a block of samples, for every form of the reverse map g_φ.

use ndf_network::simd::{InputGradient, backward, forward};
use ndf_network::{Activations, BLOCK, Gradients, Packed, encoding};
use pulp::Simd;

use crate::batch::Sample;
use crate::origin::Origin;
use crate::settings::ReverseMap;
use crate::step::Model;
use crate::terms::dot;

/// Memory for the network of the reverse map.
pub(crate) struct ReverseNetwork {
    activations: Activations,
    pub(crate) gradients: Gradients,
}

impl ReverseNetwork {
    pub(crate) fn new(phi: &Packed) -> Self {
        Self { activations: Activations::new(phi), gradients: Gradients::new(phi) }
    }
}

/// Samples of a block: as many of everything but `origins`, of which there may be none.
pub(crate) struct Cycle<'a> {
    pub(crate) samples: &'a [Sample],
    pub(crate) origins: &'a [Origin],
    /// x.
    pub(crate) base: &'a [[f32; 3]],
    /// What g_φ is given: g_θ(x), or x itself while it learns the identity.
    pub(crate) points: &'a [[f32; 3]],
}

impl Cycle<'_> {
    /// Adds `weight` times the gradient of the loss to those of the network; writes that by `points` to `dy`. Returns the
    /// sum of the loss, unweighted.
    #[inline(always)]
    pub(crate) fn accumulate<S: Simd>(
        &self,
        simd: S,
        model: &Model<'_>,
        mut network: Option<&mut ReverseNetwork>,
        weight: f32,
        dy: &mut [[f32; 3]],
    ) -> f64 {
        if let (Some(network), Some(phi)) = (&mut network, model.phi) {
            self.forward(simd, model, phi, &mut network.activations);
        }
        let mut sum = 0.0;
        for (s, (dy, &y)) in dy.iter_mut().zip(self.points).enumerate() {
            let (start, normal) = self.start(model.reverse_map, s, y);
            let out = network.as_ref().map_or([0.0; 3], |network| {
                let row = &network.activations.output()[s * network.activations.output_stride()..];
                [row[0], row[1], row[2]]
            });
            let r = [0, 1, 2].map(|c| start[c] + out[c] - self.base[s][c]);
            sum += dot(r, r);
            let delta = r.map(|r| 2.0 * weight * r);
            if let Some(network) = &mut network {
                let stride = network.activations.output_stride();
                network.gradients.output_mut()[s * stride..][..3].copy_from_slice(&delta);
            }
            let along = normal.map_or(0.0, |normal| dot(normal, delta));
            *dy = normal.map_or([0.0; 3], |normal| [0, 1, 2].map(|c| delta[c] - along * normal[c]));
        }
        if let (Some(network), Some(phi)) = (network, model.phi) {
            self.backward(simd, model, phi, network, dy);
        }
        f64::from(sum)
    }

    /// What the network is added to, and the direction in which that does not follow y; none if it does not at all.
    #[inline(always)]
    fn start(&self, map: ReverseMap, sample: usize, y: [f32; 3]) -> ([f32; 3], Option<[f32; 3]>) {
        match (map, self.origins.get(sample)) {
            (ReverseMap::Plain, _) => ([0.0; 3], None),
            (ReverseMap::Residual, _) | (_, None) => (y, Some([0.0; 3])),
            (_, Some(Origin { point, image, normal, .. })) => {
                let away = [0, 1, 2].map(|c| y[c] - image[c]);
                let height = dot(*normal, away);
                ([0, 1, 2].map(|c| point[c] + (away[c] - height * normal[c])), Some(*normal))
            }
        }
    }

    #[inline(always)]
    fn forward<S: Simd>(&self, simd: S, model: &Model<'_>, phi: &Packed, activations: &mut Activations) {
        let (stride, first) = (activations.input_stride(), model.reverse_prefix());
        let rows = activations.input_mut().chunks_exact_mut(stride);
        for (s, (row, y)) in rows.zip(self.points).enumerate() {
            if first > 0 {
                let Sample { face, barycentric } =
                    self.origins.get(s).map_or(self.samples[s], |origin| origin.place);
                model.encoding.encode(simd, face, barycentric, &mut row[..first]);
            }
            row[first..][..3].copy_from_slice(y);
        }
        let rows = &mut activations.input_mut()[first + 3..];
        encoding::encode_rows(simd, self.points, model.reverse_octaves, rows, stride);
        forward(simd, phi, activations);
    }

    /// From the output of the network to its parameters and to `dy`. The encoding of the closest base point is taken as
    /// given: nothing goes back to its features.
    #[inline(always)]
    fn backward<S: Simd>(
        &self,
        simd: S,
        model: &Model<'_>,
        phi: &Packed,
        network: &mut ReverseNetwork,
        dy: &mut [[f32; 3]],
    ) {
        let ReverseNetwork { activations, gradients } = network;
        let (n, out_stride) = (self.points.len(), activations.output_stride());
        for row in gradients.output_mut().chunks_exact_mut(out_stride).take(BLOCK).skip(n) {
            row[..3].fill(0.0);
        }
        backward(simd, phi, activations, gradients, InputGradient::Wanted);
        let (stride, first) = (activations.input_stride(), model.reverse_prefix());
        let inputs = activations.input().chunks_exact(stride);
        for ((input, gradient), dy) in inputs.zip(gradients.input().chunks_exact(stride)).zip(dy) {
            let (input, gradient) = (&input[first..], &gradient[first..]);
            let through = encoding::encode_backward(&input[3..], &gradient[3..], model.reverse_octaves);
            for c in 0..3 {
                dy[c] += gradient[c] + through[c];
            }
        }
    }
}
