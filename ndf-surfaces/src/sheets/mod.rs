//! Meshes that are not sewn to manifolds, as sheets: which of them bound a solid, and which way these face.
//!
//! A mesh is cut into *patches* at all edges that do not have exactly two faces. A patch without such edges is closed by itself. For
//! the others, rays tell whether they are seen from outside, and from which side: Takayama et al. (2014) orient soups that way.

mod facing;
#[cfg(test)]
mod tests;
mod walls;

use ndf_core::DVec3;
use ndf_mesh::{Face, Halfedge, TriangleMesh, TriangleTree};
use rayon::prelude::*;

use crate::pseudonormals::Pseudonormals;

pub use facing::facing_out;
pub(crate) use walls::inner_walls;

/// How far beside a face its sides are asked for, in diagonals of the bounding box.
pub(crate) const OFFSET: f64 = 1e-6;

/// Points within a patch, and points on its rim, that are asked, at most.
const SAMPLES: usize = 16;
/// How close to the rim, on the way from the centroid of a face to its side.
const NEAR_RIM: f64 = 0.9;
/// Rays of all patches together, and from a point, about.
const ALL_RAYS: usize = 1 << 20;
const MIN_DIRECTIONS: usize = 8;
const MAX_DIRECTIONS: usize = 32;
/// A patch is seen from outside if more than one ray of so many leaves the mesh: less get out through cracks.
const RAYS_PER_CRACK: usize = 256;

/// A part of a mesh whose faces are joined by edges with two faces.
#[derive(Clone, Debug, Default)]
struct Patch {
    faces: Vec<u32>,
    /// Its edges that do not have exactly two faces, with the half-edges there; empty if the patch is closed by itself.
    rim: Vec<(u32, Halfedge)>,
}

/// A point of a patch and the normal there.
#[derive(Clone, Copy)]
struct Sample {
    point: DVec3,
    normal: DVec3,
}

/// A mesh and its patches.
struct Sheets<'a> {
    mesh: &'a TriangleMesh,
    /// How far beside a face its sides are asked for.
    offset: f64,
    patches: Vec<Patch>,
    /// Of every patch.
    samples: Vec<Vec<Sample>>,
}

impl<'a> Sheets<'a> {
    fn new(mesh: &'a TriangleMesh, normals: &Pseudonormals, offset: f64) -> Self {
        let patches = patches(mesh, normals);
        let samples = patches.par_iter().map(|patch| samples(patch, mesh, normals)).collect();
        Self { mesh, offset, patches, samples }
    }

    /// Whether patches, by number, are closed by themselves.
    fn is_closed(&self, patch: usize) -> bool {
        self.patches[patch].rim.is_empty()
    }

    /// Directions of the rays from every sample of some patches.
    fn directions(&self, among: &[usize]) -> Vec<DVec3> {
        let open = among.iter().filter(|&&p| !self.is_closed(p)).count();
        directions((ALL_RAYS / open.max(1) / (2 * SAMPLES)).clamp(MIN_DIRECTIONS, MAX_DIRECTIONS))
    }

    /// On which side of a patch rays begin that leave the mesh, behind it (`false`) or before: at all samples in turn, so that
    /// one outside is found at once. `tree` has the faces that stand in their way.
    fn leaving(&self, patch: usize, directions: &[DVec3], tree: &TriangleTree) -> impl Iterator<Item = bool> {
        let samples = &self.samples[patch];
        let rays = directions.iter().flat_map(move |ray| samples.iter().map(move |sample| (sample, ray)));
        rays.filter_map(|(sample, &ray)| {
            let is_before = ray.dot(sample.normal) > 0.0;
            let aside = if is_before { self.offset } else { -self.offset } * sample.normal;
            tree.first_hit(sample.point + aside, ray).is_none().then_some(is_before)
        })
    }

    /// Of the rays of a patch, how many get out through cracks at most.
    fn through_cracks(&self, patch: usize, directions: &[DVec3]) -> usize {
        self.samples[patch].len() * directions.len() / RAYS_PER_CRACK
    }
}

/// The patches of a mesh.
fn patches(mesh: &TriangleMesh, normals: &Pseudonormals) -> Vec<Patch> {
    let mut edges: Vec<(u32, u32)> = Vec::with_capacity(3 * mesh.face_count());
    for (f, sides) in (0..).zip(normals.sides()) {
        edges.extend(sides.map(|edge| (edge, f)));
    }
    edges.sort_unstable();
    // Of an edge with two faces, both.
    let mut beside: Vec<Option<[u32; 2]>> = Vec::new();
    for faces in edges.chunk_by(|a, b| a.0 == b.0) {
        beside.push(if let &[(_, f), (_, g)] = faces { Some([f, g]) } else { None });
    }
    let mut is_taken = vec![false; mesh.face_count()];
    let mut patches = Vec::new();
    for start in 0..mesh.face_count() {
        if std::mem::replace(&mut is_taken[start], true) {
            continue;
        }
        let mut patch = Patch { faces: vec![start as u32], rim: Vec::new() };
        let mut next = 0;
        while let Some(&f) = patch.faces.get(next) {
            next += 1;
            for (edge, side) in normals.sides()[f as usize].into_iter().zip(Face(f).halfedges()) {
                match beside[edge as usize] {
                    Some(pair) => {
                        let fresh = pair.into_iter().find(|&g| !is_taken[g as usize]);
                        fresh.iter().for_each(|&g| is_taken[g as usize] = true);
                        patch.faces.extend(fresh);
                    }
                    None => patch.rim.push((edge, side)),
                }
            }
        }
        patches.push(patch);
    }
    patches
}

/// Some points of a patch, evenly picked: centroids of faces, and points close to its rim.
fn samples(patch: &Patch, mesh: &TriangleMesh, normals: &Pseudonormals) -> Vec<Sample> {
    let sample = |face: Face, towards: Option<usize>| {
        let corners = mesh.corner_positions(face);
        let center = corners.iter().sum::<DVec3>() / 3.0;
        let point =
            towards.map_or(center, |k| center.lerp(corners[k].midpoint(corners[(k + 1) % 3]), NEAR_RIM));
        let normal = normals.of_face(face);
        (normal != DVec3::ZERO).then_some(Sample { point, normal })
    };
    let faces = patch.faces.iter().step_by(patch.faces.len().div_ceil(SAMPLES));
    let rim = patch.rim.iter().step_by(patch.rim.len().div_ceil(SAMPLES).max(1));
    let inner = faces.map(|&f| (Face(f), None));
    let outer = rim.map(|(_, side)| (side.face(), Some(side.corner())));
    inner.chain(outer).filter_map(|(face, towards)| sample(face, towards)).collect()
}

/// Directions spread evenly over the sphere (a Fibonacci lattice), at most 36, in an order that jumps about.
fn directions(count: usize) -> Vec<DVec3> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..count)
        .map(|i| {
            let i = (i * 37) % count;
            let z = 1.0 - 2.0 * (i as f64 + 0.5) / count as f64;
            let (sine, cosine) = (golden * i as f64).sin_cos();
            DVec3::new((1.0 - z * z).sqrt() * cosine, (1.0 - z * z).sqrt() * sine, z)
        })
        .collect()
}
