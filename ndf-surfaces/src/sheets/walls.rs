//! Walls inside of a solid, which its winding number must not count.
//!
//! A shelf in a box bounds nothing, but adds up to ±½ to the winding numbers beside it, and several add up to more. So
//! sheets that are shut in are left out of the sum. The *shell* are patches that are closed by themselves or seen from
//! outside. Patches that are shut in join it, one layer after the other, where they go on with it: its winding number is ½ on what
//! closes it, and 1 on walls. What is left are walls, except for sheets that close on each other, as around a cavity that a
//! strut holds: their outermost stay if they point the same way all around, and what is inside of them is looked through in turn.

use ndf_mesh::{TriangleMesh, TriangleTree};
use rayon::prelude::*;

use super::{Sample, Sheets};
use crate::WindingNumber;
use crate::pseudonormals::Pseudonormals;

/// Between the winding number on a patch that goes on with the shell, about ¾ where half of a channel is still missing, and
/// that on a wall.
const SHUT_IN: f64 = 0.85;
/// How far winding numbers beside sheets that close on each other may be from integers.
const WHOLE: f64 = 0.2;

/// Whether a face belongs to a wall inside. `offset` is how far beside a face its sides are asked for. O(n log n), with up to
/// a million rays for the patches that may be walls; nothing for closed manifolds.
pub(crate) fn inner_walls(
    mesh: &TriangleMesh,
    tree: &TriangleTree,
    normals: &Pseudonormals,
    offset: f64,
) -> Vec<bool> {
    let mut is_wall = vec![false; mesh.face_count()];
    if normals.is_sewn() {
        return is_wall;
    }
    let sheets = Sheets::new(mesh, normals, offset);
    let all: Vec<usize> = (0..sheets.patches.len()).collect();
    if all.len() < 2 || all.iter().all(|&p| sheets.is_closed(p)) {
        return is_wall;
    }
    for wall in sheets.walls(&all, tree) {
        sheets.patches[wall].faces.iter().for_each(|&f| is_wall[f as usize] = true);
    }
    is_wall
}

impl Sheets<'_> {
    /// The walls among some patches, in ascending order as these; `tree` has their faces only.
    fn walls(&self, among: &[usize], tree: &TriangleTree) -> Vec<usize> {
        let directions = self.directions(among);
        let is_seen =
            |p: usize| self.leaving(p, &directions, tree).nth(self.through_cracks(p, &directions)).is_some();
        // Patches without area add nothing, whatever they are.
        let may_be_wall = |p: &&usize| !self.is_closed(**p) && !self.samples[**p].is_empty() && !is_seen(**p);
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
        let within = self.walls(&core, &TriangleTree::new(&self.mesh_of(&core)));
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
