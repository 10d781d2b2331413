//! Walls inside of a solid, which its winding number must not count.
//!
//! A shelf in a box bounds nothing, but adds up to ±½ to the winding numbers beside it, and several add up to more. So
//! sheets that are shut in are left out of the sum. A mesh is cut into *patches* at all edges that have not two faces. A
//! patch that has such an edge may be a wall unless it is seen from outside: if rays from it leave the mesh, as those by which
//! Takayama et al. (2014) orient soups. The others are the *shell*. Patches that are shut in join it, one layer after the other,
//! where they go on with it: its winding number is ½ on what closes it, and 1 on walls. What is left are walls,
//! except for sheets that close on each other, as around a cavity that a strut holds: their outermost stay if they point the same
//! way all around, and what is inside of them is looked through in turn.

use ndf_core::DVec3;
use ndf_mesh::{Face, Halfedge, TriangleMesh, TriangleTree};
use rayon::prelude::*;

use crate::WindingNumber;
use crate::pseudonormals::Pseudonormals;

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
/// Between the winding number on a patch that goes on with the shell, at most ¾ where half of a channel is still missing, and
/// that on a wall.
const SHUT_IN: f64 = 0.85;
/// How far winding numbers beside sheets that close on each other may be from integers.
const WHOLE: f64 = 0.2;

/// A part of a mesh whose faces are joined by edges with two faces.
#[derive(Clone, Debug, Default)]
struct Patch {
    faces: Vec<u32>,
    /// Its edges that have not two faces, with the half-edges there; none of a patch that is closed by itself.
    rim: Vec<(u32, Halfedge)>,
}

/// A point of a patch and the normal there.
#[derive(Clone, Copy)]
struct Sample {
    point: DVec3,
    normal: DVec3,
}

/// Whether a face belongs to a wall inside. `offset` is how far beside a face its sides are asked for. O(n log n), with up to
/// a million rays for the patches that may be walls; nothing for closed manifolds.
pub(crate) fn inner_walls(
    mesh: &TriangleMesh,
    tree: &TriangleTree,
    normals: &Pseudonormals,
    offset: f64,
) -> Vec<bool> {
    let mut is_wall = vec![false; mesh.face_count()];
    let patches = patches(mesh, normals);
    if patches.len() < 2 || patches.iter().all(|patch| patch.rim.is_empty()) {
        return is_wall;
    }
    let all: Vec<usize> = (0..patches.len()).collect();
    let samples = patches.par_iter().map(|patch| samples(patch, mesh, normals)).collect();
    let walls = Walls { mesh, offset, patches, samples };
    for wall in walls.find(&all, tree) {
        walls.patches[wall].faces.iter().for_each(|&f| is_wall[f as usize] = true);
    }
    is_wall
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

/// A mesh in which walls are looked for.
struct Walls<'a> {
    mesh: &'a TriangleMesh,
    offset: f64,
    patches: Vec<Patch>,
    /// Of every patch.
    samples: Vec<Vec<Sample>>,
}

impl Walls<'_> {
    /// The walls among some patches, in ascending order as these; `tree` has their faces only.
    fn find(&self, among: &[usize], tree: &TriangleTree) -> Vec<usize> {
        let open = among.iter().filter(|&&p| !self.patches[p].rim.is_empty()).count();
        let directions =
            directions((ALL_RAYS / open.max(1) / (2 * SAMPLES)).clamp(MIN_DIRECTIONS, MAX_DIRECTIONS));
        // Patches without area add nothing, whatever they are.
        let may_be_wall = |p: &&usize| {
            let (patch, samples) = (&self.patches[**p], &self.samples[**p]);
            !patch.rim.is_empty() && !samples.is_empty() && !self.is_seen(samples, &directions, tree)
        };
        let mut shut_in: Vec<usize> = among.par_iter().filter(may_be_wall).copied().collect();
        let mut joining = without(among, &shut_in);
        // The winding number of the shell at the samples of patches that are shut in.
        let mut around: Vec<Vec<f64>> = self.samples.iter().map(|samples| vec![0.0; samples.len()]).collect();
        while !shut_in.is_empty() && !joining.is_empty() {
            let shell = self.winding(&joining);
            let more = |p: &usize| self.samples[*p].iter().map(|sample| shell.at(sample.point)).collect();
            let more: Vec<Vec<f64>> = shut_in.par_iter().map(more).collect();
            for (&p, more) in shut_in.iter().zip(more) {
                around[p].iter_mut().zip(more).for_each(|(around, more)| *around += more);
            }
            let is_within = |p: &usize| around[*p].iter().all(|winding| winding.abs() > SHUT_IN);
            (shut_in, joining) = shut_in.into_iter().partition(is_within);
        }
        let core = self.core(&shut_in);
        if core.is_empty() || core.len() == among.len() {
            return shut_in;
        }
        let within = self.find(&core, &TriangleTree::new(&self.mesh_of(&core)));
        let hull = without(&core, &within);
        let winding = self.winding(&hull);
        // Beside a sheet that ends the inside of the shell: what the hull takes from it, in whole numbers.
        let ends = |sample: &Sample, around: f64| {
            let sides = [-1.0, 1.0].map(|side| winding.at(sample.point + side * self.offset * sample.normal));
            let is_whole = sides.iter().all(|winding| (winding - winding.round()).abs() < WHOLE);
            is_whole && (sides[0].round() + sides[1].round()) * around < 0.0
        };
        let is_consistent = |p: &usize| {
            let ending =
                self.samples[*p].iter().zip(&around[*p]).filter(|(sample, around)| ends(sample, **around));
            2 * ending.count() > self.samples[*p].len()
        };
        let consistent: Vec<usize> = hull.iter().copied().filter(is_consistent).collect();
        // Inside of a hull that points both ways nothing can be told.
        if 2 * consistent.len() > hull.len() { without(&shut_in, &consistent) } else { shut_in }
    }

    /// Whether more rays leave the mesh than get out through cracks.
    fn is_seen(&self, samples: &[Sample], directions: &[DVec3], tree: &TriangleTree) -> bool {
        let leaves = |(sample, direction): &(&Sample, &DVec3)| {
            let side = direction.dot(sample.normal).signum();
            tree.first_hit(sample.point + side * self.offset * sample.normal, **direction).is_none()
        };
        let rays = samples.len() * directions.len();
        // All samples in turn, so that one outside is found at once.
        let rays_of_all =
            directions.iter().flat_map(|direction| samples.iter().map(move |sample| (sample, direction)));
        rays_of_all.filter(leaves).nth(rays / RAYS_PER_CRACK).is_some()
    }

    /// Of some patches, those that close on each other: without patches that have a rim which no other goes on with.
    fn core(&self, patches: &[usize]) -> Vec<usize> {
        let mut core = patches.to_vec();
        loop {
            let mut rims: Vec<u32> =
                core.iter().flat_map(|&p| &self.patches[p].rim).map(|rim| rim.0).collect();
            rims.sort_unstable();
            let is_single = |edge: &u32| {
                let first = rims.partition_point(|other| other < edge);
                rims.get(first + 1) != Some(edge)
            };
            let before = core.len();
            core.retain(|&p| !self.patches[p].rim.iter().any(|rim| is_single(&rim.0)));
            if core.len() == before {
                return core;
            }
        }
    }

    fn mesh_of(&self, patches: &[usize]) -> TriangleMesh {
        let faces = patches.iter().flat_map(|&p| &self.patches[p].faces);
        let faces = faces.map(|&f| self.mesh.faces()[f as usize]).collect();
        TriangleMesh::new(self.mesh.positions().to_vec(), faces).expect("faces of a mesh have its vertices")
    }

    fn winding(&self, patches: &[usize]) -> WindingNumber {
        WindingNumber::new(&self.mesh_of(patches))
    }
}

/// Those of some ascending numbers that are not among others, which ascend too.
fn without(all: &[usize], others: &[usize]) -> Vec<usize> {
    all.iter().copied().filter(|p| others.binary_search(p).is_err()).collect()
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

#[cfg(test)]
mod tests;
