//! Evaluating networks and their tangents at many points of the base mesh, over all threads.

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::encoding::{IntrinsicEncoding, single};
use super::network::IntrinsicNetwork;
use ndf_mesh::FacePoint;
use ndf_mesh::ManifoldMesh;
use ndf_network::simd::{forward, forward_tangent};
use ndf_network::{Activations, BLOCK};

/// Points a thread takes at a time.
const CHUNK: usize = 16 * BLOCK;

/// What of the network a row of its output holds.
#[derive(Clone, Copy)]
pub(crate) enum Part {
    /// Values, from this channel on.
    Values(usize),
    /// Derivatives in this of the directions.
    Tangent(usize),
}

impl IntrinsicNetwork {
    /// The values of all channels at points of the base mesh, point by point. About 3,000 floating-point operations a
    /// pass with the default shape.
    ///
    /// # Panics
    /// If `base` has another number of vertices than this was made for, or a face does not exist in it.
    pub fn evaluate(&self, base: &ManifoldMesh, points: &[FacePoint]) -> Vec<f32> {
        let channels = self.passes().channels();
        let mut values = vec![0.0; points.len() * channels];
        self.evaluate_into(base, points, &[], &mut values, channels, |part, _, row, to| {
            if let Part::Values(first) = part {
                to[first..][..row.len()].copy_from_slice(row);
            }
        });
        values
    }

    /// Hands the values at every point, pass by pass, and the derivatives in every direction (given as derivatives of the
    /// barycentric coordinates, whose entries sum to 0) to `take`, together with the point and the `width` items of `out`
    /// that are its own. A direction costs as much as the values. Directions are for networks of one pass.
    ///
    /// # Panics
    /// As [`evaluate`](Self::evaluate).
    pub(crate) fn evaluate_into<T: Send>(
        &self,
        base: &ManifoldMesh,
        points: &[FacePoint],
        directions: &[[f32; 3]],
        out: &mut [T],
        width: usize,
        take: impl Fn(Part, &FacePoint, &[f32], &mut [T]) + Sync,
    ) {
        let positions = single(base.positions());
        let encoding = self.encoding(base, &positions);
        let room = || Activations::new(&self.packed);
        points.par_chunks(CHUNK).zip(out.par_chunks_mut(CHUNK * width)).for_each_init(
            || (room(), (!directions.is_empty()).then(room)),
            |(activations, tangent), (points, out)| {
                let (tangent, take) = (tangent.as_mut(), &take);
                let network = self;
                pulp::Arch::new().dispatch(Evaluation {
                    network,
                    encoding,
                    points,
                    directions,
                    activations,
                    tangent,
                    out,
                    width,
                    take,
                });
            },
        );
    }
}

/// The work of one thread at a time, to be dispatched.
struct Evaluation<'a, T, F> {
    network: &'a IntrinsicNetwork,
    encoding: IntrinsicEncoding<'a>,
    points: &'a [FacePoint],
    directions: &'a [[f32; 3]],
    activations: &'a mut Activations,
    tangent: Option<&'a mut Activations>,
    out: &'a mut [T],
    width: usize,
    take: &'a F,
}

impl<T, F: Fn(Part, &FacePoint, &[f32], &mut [T])> WithSimd for Evaluation<'_, T, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { network, encoding, activations, mut tangent, width, .. } = self;
        let (passes, packed) = (network.passes(), &network.packed);
        let stride = activations.input_stride();
        for (points, out) in self.points.chunks(BLOCK).zip(self.out.chunks_mut(BLOCK * width)) {
            let mut take = |part: Part, activations: &Activations| {
                let rows = activations.output().chunks_exact(activations.output_stride());
                for ((point, row), to) in points.iter().zip(rows).zip(out.chunks_exact_mut(width)) {
                    (self.take)(part, point, &row[..passes.outputs], to);
                }
            };
            for (point, row) in points.iter().zip(activations.input_mut().chunks_exact_mut(stride)) {
                encoding.encode(simd, point.face, point.barycentric.map(|b| b as f32), row);
            }
            for pass in 0..passes.count {
                passes.set_code(pass, activations.input_mut(), stride);
                forward(simd, packed, activations);
                take(Part::Values(pass * passes.outputs), activations);
            }
            let Some(tangent) = tangent.as_deref_mut() else { continue };
            for (k, direction) in self.directions.iter().enumerate() {
                let rows = activations.input().chunks_exact(stride);
                let tangents = tangent.input_mut().chunks_exact_mut(stride);
                for (point, (row, tangent)) in points.iter().zip(rows.zip(tangents)) {
                    encoding.encode_tangent(point.face, *direction, row, tangent);
                }
                forward_tangent(simd, packed, activations, tangent);
                take(Part::Tangent(k), tangent);
            }
        }
    }
}
