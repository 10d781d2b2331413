//! Evaluating `g` and its tangents at many points, over all threads.

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::{DisplacementField, SampleEncoding, sample_encoding};
use ndf_core::DVec3;
use ndf_mesh::ManifoldMesh;
use ndf_mesh::sampling::FaceSample;
use ndf_network::{Activations, BLOCK, forward, forward_tangent};

/// Samples a thread takes at a time.
const CHUNK: usize = 16 * BLOCK;

/// A point of the learned surface and the surface's tangents there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mapped {
    /// g(x).
    pub point: DVec3,
    /// J u and J v, where u and v are the edges of the base face from its corner 0 to corners 1 and 2.
    pub tangents: [DVec3; 2],
}

impl Mapped {
    /// Unit normal of the learned surface, or zero where the tangents are parallel.
    pub fn normal(&self) -> DVec3 {
        self.tangents[0].cross(self.tangents[1]).normalize_or_zero()
    }
}

impl DisplacementField {
    /// g at every point; about 3,000 floating-point operations each with the default shape.
    ///
    /// # Panics
    /// If a face does not exist in the base mesh.
    pub fn map(&self, points: &[FaceSample]) -> Vec<DVec3> {
        let mut mapped = vec![DVec3::ZERO; points.len()];
        let positions = sample_encoding::single(self.base.positions());
        points.par_chunks(CHUNK).zip(mapped.par_chunks_mut(CHUNK)).for_each_init(
            || Activations::new(&self.packed),
            |activations, (points, mapped)| {
                let encoding = self.encoding(&positions);
                pulp::Arch::new().dispatch(Values { field: self, encoding, points, activations, mapped });
            },
        );
        mapped
    }

    /// g and its tangents at every point; three times the work of [`map`](Self::map).
    ///
    /// # Panics
    /// If a face does not exist in the base mesh.
    pub fn map_with_tangents(&self, points: &[FaceSample]) -> Vec<Mapped> {
        let mut mapped = vec![Mapped { point: DVec3::ZERO, tangents: [DVec3::ZERO; 2] }; points.len()];
        let positions = sample_encoding::single(self.base.positions());
        points.par_chunks(CHUNK).zip(mapped.par_chunks_mut(CHUNK)).for_each_init(
            || (Activations::new(&self.packed), Activations::new(&self.packed)),
            |(activations, tangent), (points, mapped)| {
                let encoding = self.encoding(&positions);
                let op = Tangents { field: self, encoding, points, activations, tangent, mapped };
                pulp::Arch::new().dispatch(op);
            },
        );
        mapped
    }

    fn encoding<'a>(&'a self, positions: &'a [[f32; 3]]) -> SampleEncoding<'a> {
        SampleEncoding {
            faces: self.base.faces(),
            positions,
            features: &self.features,
            dimension: self.shape.features,
            octaves: self.shape.octaves,
        }
    }

    /// The displacement's starting point: x where the field is residual.
    fn origin(&self, sample: &FaceSample) -> DVec3 {
        if self.shape.residual { position(&self.base, sample) } else { DVec3::ZERO }
    }
}

fn position(base: &ManifoldMesh, sample: &FaceSample) -> DVec3 {
    sample.position(base.as_triangle_mesh())
}

/// The encodings of up to a block of points, as the rows of the input.
#[inline(always)]
pub(crate) fn fill_block<S: Simd>(
    simd: S,
    encoding: &SampleEncoding<'_>,
    points: &[FaceSample],
    activations: &mut Activations,
) {
    let stride = activations.input_stride();
    let rows = activations.input_mut().chunks_exact_mut(stride);
    for (point, row) in points.iter().zip(rows) {
        encoding.encode(simd, point.face, point.barycentric.map(|b| b as f32), row);
    }
}

fn output_row(activations: &Activations, row: usize) -> DVec3 {
    let y = &activations.output()[row * activations.output_stride()..][..3];
    DVec3::new(f64::from(y[0]), f64::from(y[1]), f64::from(y[2]))
}

struct Values<'a> {
    field: &'a DisplacementField,
    encoding: SampleEncoding<'a>,
    points: &'a [FaceSample],
    activations: &'a mut Activations,
    mapped: &'a mut [DVec3],
}

impl WithSimd for Values<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for (points, mapped) in self.points.chunks(BLOCK).zip(self.mapped.chunks_mut(BLOCK)) {
            fill_block(simd, &self.encoding, points, self.activations);
            forward(simd, &self.field.packed, self.activations);
            for (row, (point, mapped)) in points.iter().zip(mapped).enumerate() {
                *mapped = self.field.origin(point) + output_row(self.activations, row);
            }
        }
    }
}

struct Tangents<'a> {
    field: &'a DisplacementField,
    encoding: SampleEncoding<'a>,
    points: &'a [FaceSample],
    activations: &'a mut Activations,
    tangent: &'a mut Activations,
    mapped: &'a mut [Mapped],
}

impl WithSimd for Tangents<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let base = &self.field.base;
        for (points, mapped) in self.points.chunks(BLOCK).zip(self.mapped.chunks_mut(BLOCK)) {
            fill_block(simd, &self.encoding, points, self.activations);
            forward(simd, &self.field.packed, self.activations);
            for (row, (point, mapped)) in points.iter().zip(mapped.iter_mut()).enumerate() {
                mapped.point = self.field.origin(point) + output_row(self.activations, row);
            }
            for to in [1, 2] {
                let along_edge = if to == 1 { [-1.0, 1.0, 0.0] } else { [-1.0, 0.0, 1.0] };
                let stride = self.activations.input_stride();
                let rows = self.activations.input_mut().chunks_exact(stride);
                let tangent_rows = self.tangent.input_mut().chunks_exact_mut(stride);
                for (point, (row, tangent)) in points.iter().zip(rows.zip(tangent_rows)) {
                    self.encoding.encode_tangent(point.face, along_edge, row, tangent);
                }
                forward_tangent(simd, &self.field.packed, self.activations, self.tangent);
                for (row, (point, mapped)) in points.iter().zip(mapped.iter_mut()).enumerate() {
                    let along = if self.field.shape.residual {
                        let corners = base.corner_positions(point.face);
                        corners[to] - corners[0]
                    } else {
                        DVec3::ZERO
                    };
                    mapped.tangents[to - 1] = along + output_row(self.tangent, row);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{DisplacementField, FieldShape};
    use super::*;
    use ndf_mesh::sampling::AreaSampler;
    use ndf_mesh::shapes;
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    fn random_field(shape: FieldShape) -> DisplacementField {
        let base = ManifoldMesh::try_from(shapes::icosphere(2)).unwrap();
        let field = DisplacementField::untrained(base, shape.clone(), 3).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let mut random = |n: usize| (0..n).map(|_| rng.random_range(-0.3..0.3)).collect::<Vec<f32>>();
        let (f, p) = (random(field.features().len()), random(shape.network().parameter_count()));
        field.with_parameters(f, p).unwrap()
    }

    #[test]
    fn untrained_residual_field_is_the_identity() {
        let base = ManifoldMesh::try_from(shapes::torus(9, 6, 1.0, 0.4)).unwrap();
        let field = DisplacementField::untrained(base, FieldShape::default(), 1).unwrap();
        let samples = AreaSampler::of_manifold(field.base()).unwrap().sample(1001, 0, 0);
        for (sample, y) in samples.iter().zip(field.map(&samples)) {
            assert_eq!(y, position(field.base(), sample));
        }
    }

    #[test]
    fn field_is_continuous_across_edges() {
        let field = random_field(FieldShape { octaves: 2, ..FieldShape::default() });
        let base = field.base();
        for e in 0..base.edge_count() as u32 {
            let h = base.edge_halfedge(e);
            let twin = base.twin(h).unwrap();
            let at = |h: u32, t: f64| {
                let mut barycentric = [0.0; 3];
                barycentric[h as usize % 3] = 1.0 - t;
                barycentric[(h as usize + 1) % 3] = t;
                FaceSample { face: h / 3, barycentric }
            };
            let y = field.map(&[at(h, 0.3), at(twin, 0.7)]);
            assert!((y[0] - y[1]).length() < 1e-5);
        }
    }

    #[test]
    fn tangents_are_the_derivatives() {
        for shape in [
            FieldShape::default(),
            FieldShape { residual: false, ..FieldShape::default() },
            FieldShape { features: 3, octaves: 2, hidden: vec![24], ..FieldShape::default() },
        ] {
            let field = random_field(shape);
            let samples = AreaSampler::of_manifold(field.base()).unwrap().sample(517, 0, 0);
            let values = field.map(&samples);
            let h = 1e-3;
            let moved = |to: usize, h: f64| {
                let step = |s: &FaceSample| {
                    let mut barycentric = s.barycentric;
                    barycentric[0] -= h;
                    barycentric[to] += h;
                    FaceSample { barycentric, ..*s }
                };
                field.map(&samples.iter().map(step).collect::<Vec<_>>())
            };
            let mut agree = 0;
            for to in [1, 2] {
                let (up, down) = (moved(to, h), moved(to, -h));
                for (i, mapped) in field.map_with_tangents(&samples).iter().enumerate() {
                    assert!((mapped.point - values[i]).length() < 1e-6);
                    let slope = (up[i] - down[i]) / (2.0 * h);
                    // ReLU has kinks: a few samples lie within h of one.
                    agree += usize::from((mapped.tangents[to - 1] - slope).length() < 1e-3);
                }
            }
            assert!(agree as f64 > 0.95 * 2.0 * samples.len() as f64, "{agree}");
        }
    }
}
