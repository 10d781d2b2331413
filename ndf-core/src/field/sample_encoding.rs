//! The network's input for a point of the base mesh: `[z(x), x, PE(x)]`.

use crate::network::encoding;

/// What is needed to encode points of a base mesh.
#[derive(Clone, Copy, Debug)]
pub struct SampleEncoding<'a> {
    /// Corners of the base faces.
    pub faces: &'a [[u32; 3]],
    /// Positions of the base vertices, rounded.
    pub positions: &'a [[f32; 3]],
    /// Features, vertex-major.
    pub features: &'a [f32],
    /// Features per vertex.
    pub dimension: usize,
    /// Octaves of positional encoding.
    pub octaves: usize,
}

impl SampleEncoding<'_> {
    /// Writes the encoding of the point of `face` with these barycentric coordinates; returns x.
    #[inline(always)]
    pub fn encode(&self, face: u32, barycentric: [f32; 3], row: &mut [f32]) -> [f32; 3] {
        let corners = self.faces[face as usize];
        let d = self.dimension;
        let (z, rest) = row.split_at_mut(d);
        z.fill(0.0);
        let mut x = [0.0; 3];
        for (&v, b) in corners.iter().zip(barycentric) {
            let features = &self.features[v as usize * d..][..d];
            z.iter_mut().zip(features).for_each(|(z, f)| *z += b * f);
            let p = self.positions[v as usize];
            x = [x[0] + b * p[0], x[1] + b * p[1], x[2] + b * p[2]];
        }
        rest[..3].copy_from_slice(&x);
        encoding::encode(x, self.octaves, &mut rest[3..]);
        x
    }

    /// Writes the derivative of the encoding in a direction within `face`, given as the derivative of the barycentric
    /// coordinates (its entries sum to 0); `row` is the encoding of the point. The same at every point of the face,
    /// but for the positional encoding.
    #[inline(always)]
    pub fn encode_tangent(&self, face: u32, direction: [f32; 3], row: &[f32], tangent: &mut [f32]) {
        let corners = self.faces[face as usize];
        let d = self.dimension;
        let (dz, rest) = tangent.split_at_mut(d);
        dz.fill(0.0);
        let mut dx = [0.0; 3];
        for (&v, b) in corners.iter().zip(direction) {
            let features = &self.features[v as usize * d..][..d];
            dz.iter_mut().zip(features).for_each(|(z, f)| *z += b * f);
            let p = self.positions[v as usize];
            dx = [dx[0] + b * p[0], dx[1] + b * p[1], dx[2] + b * p[2]];
        }
        rest[..3].copy_from_slice(&dx);
        encoding::encode_tangent(&row[d + 3..], dx, self.octaves, &mut rest[3..]);
    }
}

/// Positions in single precision.
pub fn single(positions: &[glam::DVec3]) -> Vec<[f32; 3]> {
    positions.iter().map(|p| p.as_vec3().to_array()).collect()
}
