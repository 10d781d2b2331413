//! Large meshes, decimated block by block before they are decimated as a whole.
//!
//! A queue of all edges of a large mesh has collapses all over the memory, one after the other. So its faces are first gathered into
//! blocks that lie together and fit the cache. Each is decimated by itself, on all threads, with the [seams](Seams) to others
//! as they are. What is left is sewn together and keeps the quadrics of the faces that are gone: the collapses that follow, of
//! the seams first, know the whole input.

use std::sync::atomic::{AtomicUsize, Ordering};

use ndf_core::{Cancelled, DVec3, NoProgress, Part, Progress};
use ndf_mesh::{Face, Halfedge, ManifoldMesh, NO_HALFEDGE, TriangleMesh};
use rayon::prelude::*;

use super::seams::{INNER, Seams};
use super::{Decimation, DecimationOptions};
use crate::quadric::Quadric;

/// Faces from which a mesh is large.
const LARGE: usize = 1 << 20;
/// Bits of the number of a face in its block, and the most faces of a block.
const BITS: u32 = 16;
const BLOCK: usize = 1 << BITS;
/// Faces that blocks leave for each that is wanted in the end, so that the choice among them is still free, and at least.
const LEFT: usize = 64;
const MIN_LEFT: usize = 1 << 18;

/// Of the time of a decimation, the share that blocks take.
const SHARE: f64 = 0.75;

/// What is left of a large mesh.
pub(super) struct Reduced {
    pub(super) mesh: ManifoldMesh,
    /// The face of the input that each of its faces has been.
    pub(super) births: Vec<Face>,
    /// Those of the faces of the input, vertex by vertex, relative to the centre of its box.
    pub(super) quadrics: Vec<Quadric>,
    pub(super) areas: Vec<f64>,
    pub(super) collapses: usize,
    pub(super) largest_cost: f64,
}

/// What is left of a block.
struct Remnant {
    positions: Vec<DVec3>,
    /// As those of [`Seams`].
    labels: Vec<u32>,
    faces: Vec<[u32; 3]>,
    births: Vec<Face>,
    quadrics: Vec<Quadric>,
    areas: Vec<f64>,
    collapses: usize,
    largest_cost: f64,
}

/// Decimates the blocks of a mesh; `None` if it is not large, the result is not to be much smaller, or the work was cancelled.
pub(super) fn reduced(
    mesh: &ManifoldMesh,
    options: &DecimationOptions,
    progress: &dyn Progress,
) -> Option<Reduced> {
    // Creases are told by the faces of the input.
    let is_large = mesh.face_count() >= LARGE && options.crease_angle.is_none();
    is_large
        .then(|| reduced_by(BLOCK, (LEFT * options.faces).max(MIN_LEFT), mesh, options, progress))
        .flatten()
}

/// As [`reduced`], in blocks of so many faces, to about so many.
pub(super) fn reduced_by(
    block: usize,
    left: usize,
    mesh: &ManifoldMesh,
    options: &DecimationOptions,
    progress: &dyn Progress,
) -> Option<Reduced> {
    if 2 * left > mesh.face_count() {
        return None;
    }
    let progress = &Part::new(progress, 0.0, SHARE);
    let mut order: Vec<u32> = (0..mesh.face_count() as u32).collect();
    let blocks = blocks(mesh, &mut order, block);
    // Number of the block of a face, and of the face in it.
    let mut places = vec![0_u32; mesh.face_count()];
    for (b, faces) in (0_u32..).zip(&blocks) {
        faces.iter().zip(0..).for_each(|(&f, rank): (_, u32)| places[f as usize] = (b << BITS) | rank);
    }
    let (share, center) = (left as f64 / mesh.face_count() as f64, mesh.bounds().center());
    let done = AtomicUsize::new(0);
    let remnants = blocks.par_iter().enumerate().map(|(b, faces)| {
        progress.check()?;
        let (cut, labels) = cut_out(mesh, faces, b as u32, &places);
        let found = remnant(&cut, labels, faces, center, share, options)?;
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        progress.report("decimation", done as f64 / blocks.len() as f64);
        Ok(found)
    });
    let remnants: Result<Vec<Remnant>, Cancelled> = remnants.collect();
    drop(places);
    sewn(mesh, remnants.ok()?)
}

/// What is left of the work after the blocks, as its observer sees it.
pub(super) fn rest(progress: &dyn Progress) -> Part<'_> {
    Part::new(progress, SHARE, 1.0)
}

/// Faces halved by place until blocks have no more than so many, each in ascending order.
fn blocks<'a>(mesh: &TriangleMesh, order: &'a mut [u32], block: usize) -> Vec<&'a [u32]> {
    let center = mesh.bounds().center();
    let of_face = |corners: &[u32; 3]| {
        let sum: DVec3 = corners.iter().map(|&v| mesh.positions()[v as usize] - center).sum();
        sum.to_array().map(|x| x as f32)
    };
    let centers: Vec<[f32; 3]> = mesh.faces().par_iter().map(of_face).collect();
    halved(order, &centers, block)
}

fn halved<'a>(faces: &'a mut [u32], centers: &[[f32; 3]], block: usize) -> Vec<&'a [u32]> {
    if faces.len() <= block {
        faces.sort_unstable();
        return vec![faces];
    }
    let extent = |axis: usize| {
        let along = || faces.iter().map(|&f| centers[f as usize][axis]);
        along().fold(f32::NEG_INFINITY, f32::max) - along().fold(f32::INFINITY, f32::min)
    };
    let extents = [0, 1, 2].map(extent);
    let axis = (0..3).max_by(|&i, &j| extents[i].total_cmp(&extents[j])).expect("there are three axes");
    let middle = faces.len() / 2;
    let at = |f: u32| centers[f as usize][axis];
    faces.select_nth_unstable_by(middle, |&f, &g| at(f).total_cmp(&at(g)).then(f.cmp(&g)));
    let (low, high) = faces.split_at_mut(middle);
    let (mut low, high) = rayon::join(|| halved(low, centers, block), || halved(high, centers, block));
    low.extend(high);
    low
}

/// A block as a mesh by itself, with a vertex for every fan of its faces, and labels of its vertices as in [`Seams`].
fn cut_out(mesh: &ManifoldMesh, faces: &[u32], block: u32, places: &[u32]) -> (ManifoldMesh, Vec<u32>) {
    let topology = mesh.topology();
    let local = |h: Halfedge| match topology.twin(h) {
        Some(twin) if places[twin.face().index()] >> BITS == block => {
            let rank = places[twin.face().index()] & (BLOCK as u32 - 1);
            Face(rank).halfedge(twin.corner())
        }
        _ => NO_HALFEDGE,
    };
    let twins: Vec<Halfedge> = faces.iter().flat_map(|&f| Face(f).halfedges().map(local)).collect();
    let (mut positions, mut labels) = (Vec::new(), Vec::new());
    let mut corners = vec![[u32::MAX; 3]; faces.len()];
    for h in (0..twins.len()).map(Halfedge::new) {
        let corner = |h: Halfedge| (h.face().index(), h.corner());
        let (f, c) = corner(h);
        if corners[f][c] != u32::MAX {
            continue;
        }
        let vertex = positions.len() as u32;
        let mut take = |h: Halfedge| {
            let (f, c) = corner(h);
            corners[f][c] = vertex;
        };
        // Counter-clockwise, and from the border on clockwise.
        let mut at = h;
        let is_inner = loop {
            take(at);
            at = match twins[at.previous().index()] {
                NO_HALFEDGE => break false,
                next if next == h => break true,
                next => next,
            };
        };
        if !is_inner {
            let mut at = h;
            while twins[at.index()] != NO_HALFEDGE {
                at = twins[at.index()].next();
                take(at);
            }
        }
        let original = mesh.faces()[faces[f] as usize][c];
        positions.push(mesh.positions()[original as usize]);
        labels.push(if is_inner { INNER } else { original });
    }
    let cut = TriangleMesh::new(positions, corners).expect("every corner has a vertex");
    let cut = ManifoldMesh::with_twins(cut, &twins).expect("a part of a manifold, fan by fan, is one");
    (cut, labels)
}

/// A block that was [cut out](cut_out), decimated to a share of its faces but for its seams. Positions are computed on relative to
/// `center`, that of the whole mesh.
fn remnant(
    cut: &ManifoldMesh,
    labels: Vec<u32>,
    faces: &[u32],
    center: DVec3,
    share: f64,
    options: &DecimationOptions,
) -> Result<Remnant, Cancelled> {
    let on_seams = 2 * cut.topology().boundary_edge_count();
    let options = &DecimationOptions { keep_boundary: true, ..*options };
    let mut work = Decimation::around(cut, options, center);
    work.gather_quadrics(true, false);
    work.seams = Some(Seams::new(labels));
    work.run((share * faces.len() as f64) as usize + on_seams, &NoProgress)?;
    let Decimation { mesh, quadrics, areas, seams, collapses, largest_cost, .. } = work;
    let seams = seams.expect("they were set above");
    let is_there = |f: &Face| !mesh.is_hole(f.halfedge(0));
    let left: Vec<Face> = mesh.faces().filter(is_there).collect();
    let vertices: Vec<_> = mesh.vertices().filter(|&v| !mesh.is_vertex_hole(v)).collect();
    let number = ndf_mesh::halfedge::numbers(&vertices, mesh.vertex_count());
    Ok(Remnant {
        positions: vertices.iter().map(|&v| mesh.position(v) + center).collect(),
        labels: vertices.iter().map(|&v| seams.label(v)).collect(),
        faces: left.iter().map(|&f| mesh.face_vertices(f).map(|v| number[v.index()])).collect(),
        births: left.iter().map(|f| Face(faces[f.index()])).collect(),
        quadrics: vertices.iter().map(|v| quadrics[v.index()]).collect(),
        areas: vertices.iter().map(|v| areas[v.index()]).collect(),
        collapses,
        largest_cost,
    })
}

/// The blocks together again, along vertices of the same label; `None` if that is no manifold.
fn sewn(mesh: &ManifoldMesh, remnants: Vec<Remnant>) -> Option<Reduced> {
    let (mut positions, mut faces, mut births) = (Vec::new(), Vec::new(), Vec::new());
    let (mut quadrics, mut areas): (Vec<Quadric>, Vec<f64>) = (Vec::new(), Vec::new());
    let (mut collapses, mut largest_cost) = (0, 0.0_f64);
    let mut of_label = vec![u32::MAX; mesh.vertex_count()];
    for remnant in remnants {
        let mut numbers = Vec::with_capacity(remnant.positions.len());
        for (v, &label) in remnant.labels.iter().enumerate() {
            let known = if label == INNER { u32::MAX } else { of_label[label as usize] };
            if known != u32::MAX {
                quadrics[known as usize] += remnant.quadrics[v];
                areas[known as usize] += remnant.areas[v];
                numbers.push(known);
                continue;
            }
            let number = positions.len() as u32;
            if label == INNER {
                positions.push(remnant.positions[v]);
            } else {
                of_label[label as usize] = number;
                positions.push(mesh.positions()[label as usize]);
            }
            quadrics.push(remnant.quadrics[v]);
            areas.push(remnant.areas[v]);
            numbers.push(number);
        }
        faces.extend(remnant.faces.iter().map(|corners| corners.map(|v| numbers[v as usize])));
        births.extend(remnant.births);
        collapses += remnant.collapses;
        largest_cost = largest_cost.max(remnant.largest_cost);
    }
    let sewn = TriangleMesh::new(positions, faces).expect("every corner has a number");
    let mesh = ManifoldMesh::try_from(sewn).ok()?;
    Some(Reduced { mesh, births, quadrics, areas, collapses, largest_cost })
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_mesh::repair::Components;
    use ndf_mesh::shapes;

    /// Shapes with and without a boundary, and one whose blocks have several pieces.
    fn fine() -> [ManifoldMesh; 4] {
        [
            shapes::icosphere(5),
            shapes::rope_knot(200, 24, 0.24),
            shapes::grid(90, 70),
            shapes::torus(120, 60, 1.0, 0.3),
        ]
        .map(|mesh| ManifoldMesh::try_from(mesh).unwrap())
    }

    #[test]
    fn blocks_together_have_the_topology_and_the_size_of_the_whole() {
        for fine in fine() {
            let options = DecimationOptions::to_faces(100);
            // Small blocks are mostly seams.
            for (block, most) in [(200, 1.0), (2000, 0.6)] {
                let found = reduced_by(block, 1000, &fine, &options, &NoProgress).unwrap();
                let (before, after) = (fine.topology(), found.mesh.topology());
                assert_eq!(after.euler_characteristic(), before.euler_characteristic());
                assert_eq!(after.boundary_edge_count(), before.boundary_edge_count());
                assert_eq!(Components::of(&found.mesh).len(), Components::of(&fine).len());
                let left = found.mesh.face_count() as f64 / fine.face_count() as f64;
                assert!(left < most, "{left} in blocks of {block}");
                assert!((found.mesh.area() / fine.area() - 1.0).abs() < 0.05);
                assert!((found.areas.iter().sum::<f64>() / fine.area() - 1.0).abs() < 1e-9);
                assert_eq!(found.births.len(), found.mesh.face_count());
                let lost = fine.face_count() - found.mesh.face_count();
                assert!(found.collapses >= lost / 2);
            }
        }
    }

    #[test]
    fn a_mesh_that_is_not_to_be_much_smaller_is_left_alone() {
        let [fine, ..] = fine();
        let options = DecimationOptions::to_faces(100);
        assert!(reduced_by(1000, fine.face_count(), &fine, &options, &NoProgress).is_none());
        assert!(reduced(&fine, &options, &NoProgress).is_none());
    }

    #[test]
    fn threads_change_nothing() {
        let [_, fine, ..] = fine();
        let of_threads = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let options = DecimationOptions::to_faces(100);
            let found = pool.install(|| reduced_by(500, 1000, &fine, &options, &NoProgress)).unwrap();
            (found.mesh.positions().to_vec(), found.births, found.areas)
        };
        assert_eq!(of_threads(1), of_threads(3));
    }

    #[test]
    fn planes_of_the_input_are_remembered() {
        let [fine, ..] = fine();
        let found = reduced_by(700, 2000, &fine, &DecimationOptions::to_faces(100), &NoProgress).unwrap();
        let center = fine.bounds().center();
        let at_origin: f64 = found.quadrics.iter().map(|quadric| quadric.at(DVec3::ZERO)).sum();
        // Planes of the faces are all about 1 from the centre, which is the origin of quadrics.
        assert!(center.length() < 1e-12 && (at_origin / fine.area() - 1.0).abs() < 1e-3, "{at_origin}");
    }
}
