//! The rows of input that tell a network of a point of the base mesh: `[z(x), x, PE(x)]`, with z the features of the
//! vertices interpolated; their derivatives in a direction, and the way back to the features.

use pulp::Simd;

use super::shape::NetworkShape;
use ndf_core::DVec3;
use ndf_mesh::Face;
use ndf_network::encoding;

/// What is needed to encode points of a base mesh: features at its vertices, interpolated (the intrinsic encoding z), and
/// their positions.
#[derive(Clone, Copy, Debug)]
pub struct IntrinsicEncoding<'a> {
    faces: &'a [[u32; 3]],
    positions: &'a [[f32; 3]],
    features: &'a [f32],
    dimension: usize,
    octaves: usize,
}

impl<'a> IntrinsicEncoding<'a> {
    /// The encoding by the corners of the base faces, the positions of the base vertices, and features, vertex-major.
    pub fn new(
        faces: &'a [[u32; 3]],
        positions: &'a [[f32; 3]],
        features: &'a [f32],
        shape: &NetworkShape,
    ) -> Self {
        Self { faces, positions, features, dimension: shape.features, octaves: shape.octaves }
    }

    /// Features per vertex.
    #[inline(always)]
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Width of a row of input.
    #[inline(always)]
    pub fn width(&self) -> usize {
        self.dimension + 3 + encoding::width(self.octaves)
    }

    /// Whether all points of a face have the same tangents of their encoding.
    #[inline(always)]
    pub fn is_linear(&self) -> bool {
        self.octaves == 0
    }

    /// Writes the encoding of the point of `face` with these barycentric coordinates; returns x.
    #[doc(hidden)]
    #[inline(always)]
    pub fn encode<S: Simd>(&self, simd: S, face: Face, barycentric: [f32; 3], row: &mut [f32]) -> [f32; 3] {
        let corners = self.faces[face.index()];
        let d = self.dimension;
        let (z, rest) = row.split_at_mut(d);
        let x = self.interpolate(corners, barycentric, z);
        rest[..3].copy_from_slice(&x);
        encoding::encode(simd, x, self.octaves, &mut rest[3..]);
        x
    }

    /// Writes the derivative of the encoding in a direction within `face`, given as the derivative of the barycentric
    /// coordinates (its entries sum to 0); `row` is the encoding of the point. The same at every point of the face,
    /// but for the positional encoding.
    #[inline(always)]
    pub fn encode_tangent(&self, face: Face, direction: [f32; 3], row: &[f32], tangent: &mut [f32]) {
        let corners = self.faces[face.index()];
        let d = self.dimension;
        let (dz, rest) = tangent.split_at_mut(d);
        let dx = self.interpolate(corners, direction, dz);
        rest[..3].copy_from_slice(&dx);
        encoding::encode_tangent(&row[d + 3..], dx, self.octaves, &mut rest[3..]);
    }

    /// Adds the derivatives of a loss by the features of the corners of a face to `corners`, corner by corner: `row` begins
    /// with those by the interpolated features, which were combined with these weights.
    #[inline(always)]
    pub fn add_to_corners(&self, weights: [f32; 3], row: &[f32], corners: &mut [f32]) {
        let d = self.dimension;
        let (a, others) = corners[..3 * d].split_at_mut(d);
        let (b, c) = others.split_at_mut(d);
        for (corner, weight) in [a, b, c].into_iter().zip(weights) {
            add_scaled_row(corner, weight, &row[..d]);
        }
    }

    /// Combines the features of three vertices into `z` and their positions into what is returned.
    #[inline(always)]
    fn interpolate(&self, [a, b, c]: [u32; 3], weights: [f32; 3], z: &mut [f32]) -> [f32; 3] {
        let d = self.dimension;
        let features = self.features;
        let rows = [
            &features[a as usize * d..][..d],
            &features[b as usize * d..][..d],
            &features[c as usize * d..][..d],
        ];
        combine_rows(z, weights, rows);
        let mut x = [0.0; 3];
        for (v, weight) in [a, b, c].into_iter().zip(weights) {
            let p = self.positions[v as usize];
            x = [x[0] + weight * p[0], x[1] + weight * p[1], x[2] + weight * p[2]];
        }
        x
    }
}

/// Features are combined in whole vectors of this many. Each is put together in an array of its own before it is
/// stored: only then do compilers know that nothing overlaps.
const OCTET: usize = 8;

/// `to = Σ weights · rows`.
#[inline(always)]
fn combine_rows(to: &mut [f32], weights: [f32; 3], [a, b, c]: [&[f32]; 3]) {
    let (to, to_rest) = to.as_chunks_mut::<OCTET>();
    let (a, a_rest) = a.as_chunks::<OCTET>();
    let (b, b_rest) = b.as_chunks::<OCTET>();
    let (c, c_rest) = c.as_chunks::<OCTET>();
    for (((to, a), b), c) in to.iter_mut().zip(a).zip(b).zip(c) {
        let mut sums = [0.0; OCTET];
        for k in 0..OCTET {
            sums[k] = weights[0] * a[k] + weights[1] * b[k] + weights[2] * c[k];
        }
        *to = sums;
    }
    for (((to, a), b), c) in to_rest.iter_mut().zip(a_rest).zip(b_rest).zip(c_rest) {
        *to = weights[0] * a + weights[1] * b + weights[2] * c;
    }
}

/// `to += factor · from`.
#[inline(always)]
fn add_scaled_row(to: &mut [f32], factor: f32, from: &[f32]) {
    let (to, to_rest) = to.as_chunks_mut::<OCTET>();
    let (from, from_rest) = from.as_chunks::<OCTET>();
    for (to, from) in to.iter_mut().zip(from) {
        let mut sums = *to;
        for k in 0..OCTET {
            sums[k] += factor * from[k];
        }
        *to = sums;
    }
    to_rest.iter_mut().zip(from_rest).for_each(|(t, f)| *t += factor * f);
}

/// Positions in single precision.
pub fn single(positions: &[DVec3]) -> Vec<[f32; 3]> {
    positions.iter().map(|p| p.as_vec3().to_array()).collect()
}
