//! Evaluating scalar fields at many points of the base mesh, over all threads.

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::StoredScalars;
use crate::field::{SampleEncoding, fill_block, sample_encoding};
use ndf_mesh::ManifoldMesh;
use ndf_mesh::io::VertexScalars;
use ndf_mesh::sampling::FaceSample;
use ndf_network::{Activations, BLOCK, forward};

/// Points a thread takes at a time.
const CHUNK: usize = 16 * BLOCK;

impl StoredScalars {
    /// The values of all K channels at points of the base mesh, point by point. About 3,000 floating-point operations
    /// a pass with the default shape.
    ///
    /// # Panics
    /// If `base` has another number of vertices than these fields were made for, or a face does not exist in it.
    pub fn evaluate(&self, base: &ManifoldMesh, points: &[FaceSample]) -> Vec<f32> {
        assert_eq!(base.vertex_count() * self.shape.features, self.features.len(), "another base mesh");
        let channels = self.channels.len();
        let positions = sample_encoding::single(base.positions());
        let encoding = SampleEncoding {
            faces: base.faces(),
            positions: &positions,
            features: &self.features,
            dimension: self.shape.features,
            octaves: self.shape.octaves,
        };
        let mut values = vec![0.0; points.len() * channels];
        let chunks = points.par_chunks(CHUNK).zip(values.par_chunks_mut(CHUNK * channels));
        chunks.for_each_init(
            || Activations::new(&self.packed),
            |activations, (points, values)| {
                pulp::Arch::new().dispatch(Values { fields: self, encoding, points, activations, values });
            },
        );
        values
    }

    /// [`evaluate`](Self::evaluate), channel by channel under their names.
    ///
    /// # Panics
    /// As `evaluate`.
    pub fn columns(&self, base: &ManifoldMesh, points: &[FaceSample]) -> Vec<VertexScalars> {
        let values = self.evaluate(base, points);
        let column = |k: usize| values.iter().skip(k).step_by(self.channels.len()).copied().collect();
        let named = self.channels.iter().enumerate();
        named.map(|(k, channel)| VertexScalars { name: channel.name.clone(), values: column(k) }).collect()
    }
}

struct Values<'a> {
    fields: &'a StoredScalars,
    encoding: SampleEncoding<'a>,
    points: &'a [FaceSample],
    activations: &'a mut Activations,
    values: &'a mut [f32],
}

impl WithSimd for Values<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { fields, encoding, points, activations, values } = self;
        let (passes, channels) = (fields.passes(), fields.channels.as_slice());
        let (stride, out_stride) = (activations.input_stride(), activations.output_stride());
        for (points, values) in points.chunks(BLOCK).zip(values.chunks_mut(BLOCK * channels.len())) {
            fill_block(simd, &encoding, points, activations);
            for pass in 0..passes.count {
                passes.set_code(pass, activations.input_mut(), stride);
                forward(simd, &fields.packed, activations);
                let first = passes.first_channel(pass);
                let outputs = activations.output().chunks_exact(out_stride);
                for (values, outputs) in values.chunks_exact_mut(channels.len()).zip(outputs) {
                    let values = values[first..].iter_mut().zip(&channels[first..]);
                    for ((value, channel), output) in values.zip(&outputs[..passes.outputs]) {
                        *value = channel.value(*output);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::random;
    use super::super::{ChannelIndex, ScalarShape};
    use super::*;
    use ndf_mesh::sampling::AreaSampler;
    use ndf_mesh::shapes;

    fn shapes() -> [ScalarShape; 4] {
        let default = ScalarShape::default();
        [
            default.clone(),
            ScalarShape { index: ChannelIndex::Input, ..default.clone() },
            ScalarShape { features: 0, octaves: 8, index: ChannelIndex::Input, ..default.clone() },
            ScalarShape { features: 9, octaves: 2, hidden: vec![20], ..default },
        ]
    }

    /// The network written down in f64, for one point and channel.
    fn truth(fields: &StoredScalars, base: &ManifoldMesh, point: &FaceSample, k: usize) -> f64 {
        let (shape, channel) = (&fields.shape, &fields.channels[k]);
        let corners = base.faces()[point.face as usize];
        let mut row = vec![0.0; shape.features];
        for (v, b) in corners.into_iter().zip(point.barycentric) {
            let features = &fields.features[v as usize * shape.features..];
            row.iter_mut().zip(features).for_each(|(to, f)| *to += b * f64::from(*f));
        }
        let x = point.position(base.as_triangle_mesh()).to_array();
        row.extend(x);
        for turn in [f64::sin, f64::cos] {
            let octaves = (0..shape.octaves).map(|o| f64::from(1 << o) * std::f64::consts::PI);
            row.extend(octaves.flat_map(|frequency| x.map(|x| turn(frequency * x))));
        }
        let (count, mut output) = (fields.channels.len() as f64, k);
        if shape.index == ChannelIndex::Input {
            row.push((2.0 * k as f64 + 1.0) / count - 1.0);
            output = 0;
        }
        let mut rest = fields.network.parameters();
        let layers = fields.network.shape().layers();
        for (l, &(inputs, outputs)) in layers.iter().enumerate() {
            let (weights, after) = rest.split_at(inputs * outputs);
            let (biases, after) = after.split_at(outputs);
            rest = after;
            let sum = |(w, b): (&[f32], &f32)| {
                let products = w.iter().zip(&row).map(|(w, x)| f64::from(*w) * x);
                let sum = products.sum::<f64>() + f64::from(*b);
                if l + 1 < layers.len() { sum / (1.0 + (-sum).exp()) } else { sum }
            };
            row = weights.chunks_exact(inputs).zip(biases).map(sum).collect();
        }
        let value = f64::from(channel.mean) + f64::from(channel.deviation) * row[output];
        value.clamp(channel.range[0].into(), channel.range[1].into())
    }

    #[test]
    fn values_are_those_of_the_definition() {
        let base = ManifoldMesh::try_from(shapes::icosphere(1)).unwrap();
        let points = AreaSampler::of_manifold(&base).unwrap().sample(1001, 0, 0);
        for shape in shapes() {
            let fields = random(shape, base.vertex_count());
            let values = fields.evaluate(&base, &points);
            // The highest octave multiplies the rounding of coordinates.
            let tolerance = 1e-5 + 1e-6 * f64::from(1 << fields.shape.octaves);
            for (point, values) in points.iter().zip(values.chunks_exact(3)).step_by(7) {
                for (k, value) in values.iter().enumerate() {
                    let truth = truth(&fields, &base, point, k);
                    assert!(
                        (f64::from(*value) - truth).abs() < tolerance,
                        "{:?} {value} {truth}",
                        fields.shape
                    );
                }
            }
            let columns = fields.columns(&base, &points);
            assert_eq!(columns[2].name, "mode_07");
            assert!(columns[2].values.iter().zip(values.chunks_exact(3)).all(|(a, b)| *a == b[2]));
            assert!(columns[1].values.iter().all(|value| *value == 0.1));
        }
    }

    #[test]
    fn a_base_vertex_has_one_value_whichever_face_it_is_asked_in() {
        let base = ManifoldMesh::try_from(shapes::torus(9, 6, 1.0, 0.4)).unwrap();
        for shape in shapes() {
            let fields = random(shape, base.vertex_count());
            for v in 0..base.vertex_count() as u32 {
                let corner = |h: u32| {
                    let mut barycentric = [0.0; 3];
                    barycentric[h as usize % 3] = 1.0;
                    FaceSample { face: h / 3, barycentric }
                };
                let corners: Vec<FaceSample> = base.outgoing(v).map(corner).collect();
                let values = fields.evaluate(&base, &corners);
                for other in values.chunks_exact(3) {
                    assert!(other.iter().zip(&values).all(|(a, b)| (a - b).abs() < 1e-6));
                }
            }
        }
    }
}
