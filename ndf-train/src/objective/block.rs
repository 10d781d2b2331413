//! A block of samples as terms see it, and the gradients that they add to.

use std::any::Any;

use ndf_core::glam::Vec3;
use ndf_mesh::{FacePoint, Halfedge, Vertex};
use ndf_model::intrinsic_network::IntrinsicEncoding;
use ndf_network::{Activations, Packed};

use super::place::Place;
use super::target::Target;
use crate::base::Base;

/// How far a stage of training has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Epoch {
    /// Counted from 0.
    pub number: usize,
    /// How many the stage has.
    pub of: usize,
}

/// A block of samples as a term sees it. All slices have the same length, 32 or fewer; positions are normalised.
///
/// Faces and vertices that the methods tell are those of the base mesh that training was given, whatever the order in which
/// the model keeps them.
#[derive(Clone, Copy)]
pub struct Block<'a> {
    /// The epoch.
    pub epoch: Epoch,
    /// Points x of the base mesh.
    pub base: &'a [Vec3],
    /// Their images g(x).
    pub images: &'a [Vec3],
    /// J u and J v for the [frame](Self::frame) (u, v). All zero unless a term [needs](super::Needs::tangents) them.
    pub tangents: [&'a [Vec3]; 2],
    /// What is known of the surface near the images.
    pub targets: &'a [Target],
    /// The parameters of the term's own network, where it has one.
    pub network: Option<&'a Packed>,
    pub(crate) places: &'a [Place],
    pub(crate) mesh: &'a Base,
    pub(crate) encoding: IntrinsicEncoding<'a>,
    /// What g is given, row by row.
    pub(crate) rows: &'a [f32],
    pub(crate) stride: usize,
    pub(crate) prepared: Option<&'a (dyn Any + Send + Sync)>,
    /// Number of the first sample in the batch.
    pub(crate) first: usize,
}

impl Block<'_> {
    /// Samples.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Where sample i is on the base mesh.
    pub fn face_point(&self, i: usize) -> FacePoint {
        let Place { face, barycentric } = self.places[i];
        let first = Halfedge(self.mesh.order.faces[face.index()]);
        let mut turned = [0.0; 3];
        for (c, b) in barycentric.into_iter().enumerate() {
            turned[(first.corner() + c) % 3] = f64::from(b);
        }
        FacePoint { face: first.face(), barycentric: turned }
    }

    /// The base vertices around sample i and their weights: its barycentric coordinates.
    pub fn corners(&self, i: usize) -> [(Vertex, f32); 3] {
        let Place { face, barycentric } = self.places[i];
        let corners = self.mesh.faces[face.index()];
        [0, 1, 2].map(|c| (Vertex(self.mesh.order.vertices[corners[c] as usize]), barycentric[c]))
    }

    /// The value at sample i of a function that is given at the vertices of the base mesh.
    ///
    /// # Panics
    /// If there are not as many values as vertices.
    pub fn interpolate(&self, i: usize, at_vertices: &[f32]) -> f32 {
        self.corners(i).iter().map(|&(v, weight)| weight * at_vertices[v.index()]).sum()
    }

    /// An orthonormal, right-handed frame (u, v) of the base face of sample i: zero where the face has no area.
    pub fn frame(&self, i: usize) -> [Vec3; 2] {
        let face = self.places[i].face.index();
        let corners = self.mesh.faces[face].map(|v| Vec3::from(self.mesh.positions[v as usize]));
        self.mesh.frames[face].map(|[a, b, c]| a * corners[0] + b * corners[1] + c * corners[2])
    }

    /// The features z(x), interpolated at sample i.
    pub fn features(&self, i: usize) -> &[f32] {
        &self.rows[i * self.stride..][..self.encoding.dimension()]
    }

    /// What the term [prepared](super::Term::prepare) at the last projection.
    pub fn prepared<T: 'static>(&self) -> Option<&T> {
        self.prepared?.downcast_ref()
    }

    /// The sum of a loss of the two tangents and of the surface's unit normal at the foot, over the samples that have such a
    /// normal. The loss adds its gradients by the tangents to what it is given.
    pub(super) fn sum_over_normals(
        &self,
        gradients: &mut Gradients<'_>,
        mut loss: impl FnMut([Vec3; 2], Vec3, [&mut Vec3; 2]) -> f32,
    ) -> f64 {
        let [by_u, by_v] = &mut gradients.tangents;
        let mut sum = 0.0;
        for (i, target) in self.targets.iter().enumerate() {
            if target.surface_normal != Vec3::ZERO {
                let tangents = [self.tangents[0][i], self.tangents[1][i]];
                sum += loss(tangents, target.surface_normal, [&mut by_u[i], &mut by_v[i]]);
            }
        }
        f64::from(sum)
    }

    /// Number of sample i in the batch, in whose order things were prepared.
    pub fn number(&self, i: usize) -> usize {
        self.first + i
    }
}

/// Gradients of the objective by what a term sees of a block, to be added to.
pub struct Gradients<'a> {
    /// By the images.
    pub images: &'a mut [Vec3],
    /// By the two tangents.
    pub tangents: [&'a mut [Vec3]; 2],
    /// By the interpolated features, d a sample; empty unless a term [needs](super::Needs::feature_gradients) it.
    pub features: &'a mut [f32],
    /// The term's own network, where it has one.
    pub network: Option<&'a mut OwnNetwork>,
}

/// Room for a block's way through a term's own network, and the gradients of its parameters, which add up.
#[derive(Clone, Debug)]
pub struct OwnNetwork {
    /// The way there.
    pub activations: Activations,
    /// The way back.
    pub gradients: ndf_network::Gradients,
}

impl OwnNetwork {
    pub(crate) fn new(packed: &Packed) -> Self {
        Self { activations: Activations::new(packed), gradients: ndf_network::Gradients::new(packed) }
    }
}
