//! Repairs of an imperfect mesh: small, separate ones, and [all of them](repaired) with the way back to the mesh that was
//! repaired. Each returns a new mesh; none changes the geometry beyond what its name says, and all keep the order of what
//! remains.

mod components;
mod double_cover;
mod fans;
mod joining;
mod note;
mod orientation;
mod origins;

pub use components::{Components, Kept, Parts};
pub use double_cover::double_cover;
pub use fans::split_fans;
pub use joining::welded;
pub use note::RepairNote;
pub use orientation::oriented;
pub use origins::Origins;

use crate::validation::ValidationReport;
use crate::{Face, ManifoldMesh, NotManifold, Sides, TriangleMesh};

/// What a repair may do.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RepairOptions {
    /// Leave vertices in the same place apart: seams and the edges of soups are borders then.
    pub keep_seams: bool,
    /// Which components are kept.
    pub parts: Parts,
}

impl RepairOptions {
    /// The largest component alone.
    pub const LARGEST: Self = Self { keep_seams: false, parts: Parts::Largest };
}

/// A manifold made of an imperfect mesh, and what was done to it.
#[derive(Clone, Debug)]
pub struct Repaired {
    /// The repaired mesh.
    pub mesh: ManifoldMesh,
    /// Where its faces and vertices come from.
    pub origins: Origins,
    /// What was changed; empty if nothing.
    pub notes: Vec<RepairNote>,
    /// The share of the area that was left out, from 0 to 1: components, and faces whose corners are not finite, each of
    /// which counts as one of mean area.
    pub area_left_out: f64,
}

/// Why a mesh cannot be repaired to be a manifold.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Irreparable {
    /// It has a component that is a manifold and has only one side.
    #[error("a surface that cannot be oriented: there is a Möbius strip in it")]
    OneSided,
    /// It is no manifold.
    #[error(transparent)]
    NotManifold(#[from] NotManifold),
}

/// Repairs what can be repaired without inventing geometry: unusable faces and unused vertices go, vertices in one place
/// are merged where the mesh has boundary there, fans are separated, faces are turned to agree and outward, and the
/// components that are wanted are kept. A mesh that is an oriented manifold stays as it is, but for its orientation, seams,
/// and components. O(n log n).
///
/// # Errors
/// If the result is not an oriented manifold.
pub fn repaired(mesh: &TriangleMesh, options: &RepairOptions) -> Result<Repaired, Irreparable> {
    if let Some(whole) = whole(mesh, options) {
        return Ok(whole);
    }
    let mut notes = Vec::new();
    let mut work = Work::new(mesh, options, &mut notes);
    let kept = Components::of(&work.mesh).kept(options.parts);
    if kept.left_out > 0 {
        let faces = kept.faces.iter().filter(|kept| !**kept).count();
        let area = kept.area_left_out;
        notes.push(RepairNote::ComponentsLeftOut { components: kept.left_out, faces, area });
        work.retain(&kept.faces);
    }
    let turn = orientation::faces_to_turn(&work.mesh);
    let changed = turn.iter().filter(|turn| **turn).count();
    if changed > 0 {
        let all = changed == turn.len();
        notes.push(if all { RepairNote::AllFacesTurned } else { RepairNote::FacesTurned { faces: changed } });
    }
    let faces = work.kept.iter().copied().zip(turn.iter().copied()).collect();
    let turned = orientation::turned(&work.mesh, &turn);
    let origins = Origins::new(mesh, &work.places, &turned, faces);
    let found = ManifoldMesh::try_from(turned).map_err(|NotManifold(report)| {
        let is_one_sided = report.is_manifold() && report.inconsistent_edges.count > 0;
        if is_one_sided { Irreparable::OneSided } else { NotManifold(report).into() }
    })?;
    let unused: Vec<_> = origins.unused().collect();
    if let [first, ..] = unused[..] {
        notes.push(RepairNote::VerticesUnused { vertices: unused.len(), first });
    }
    Ok(Repaired { mesh: found, origins, notes, area_left_out: left_out(mesh, &kept) })
}

/// What [`repaired`] makes of a mesh that leaves nothing to repair, as most large ones do not: a closed manifold of which all
/// components are kept and enclose a positive volume. Costs one pass over its edges in place of one for every repair.
fn whole(mesh: &TriangleMesh, options: &RepairOptions) -> Option<Repaired> {
    let manifold = ManifoldMesh::proven(mesh.clone()).ok()?;
    if manifold.topology().boundary_edge_count() > 0 {
        return None;
    }
    let components = Components::of_manifold(&manifold);
    let kept = components.kept(options.parts);
    let is_whole = kept.left_out == 0 && orientation::is_outward(&manifold, &components);
    is_whole.then(|| Repaired {
        origins: Origins::same(&manifold),
        mesh: manifold,
        notes: Vec::new(),
        area_left_out: kept.area_left_out,
    })
}

/// Triangles that can be computed on, whether or not they make a manifold.
#[derive(Clone, Debug)]
pub struct Usable {
    /// The triangles.
    pub mesh: TriangleMesh,
    /// Where they come from.
    pub origins: Origins,
    /// The share of the area that was left out, as that of [`Repaired`].
    pub area_left_out: f64,
}

/// The usable triangles of a mesh: vertices in the same place are merged, unless they are to stay apart, and unusable faces,
/// components that are not wanted and unused vertices left out.
pub fn usable_triangles(mesh: &TriangleMesh, options: &RepairOptions) -> Usable {
    let joined = if options.keep_seams { mesh.clone() } else { welded(mesh, 0.0) };
    let places = joined.faces().to_vec();
    let mut work = Work { mesh: joined, kept: mesh.face_indices().collect(), places };
    work.retain(&usable_faces(&work.mesh));
    let kept = Components::of(&work.mesh).kept(options.parts);
    work.retain(&kept.faces);
    let origins =
        Origins::new(mesh, &work.places, &work.mesh, work.kept.iter().map(|&f| (f, false)).collect());
    Usable { mesh: work.mesh, origins, area_left_out: left_out(mesh, &kept) }
}

/// The share of the area of a mesh that is left out: faces that are not finite, and components.
fn left_out(mesh: &TriangleMesh, kept: &Kept) -> f64 {
    let lost = not_finite(mesh) as f64 / mesh.face_count().max(1) as f64;
    lost + (1.0 - lost) * kept.area_left_out
}

/// A mesh that is being repaired, which knows where its faces come from.
struct Work {
    mesh: TriangleMesh,
    /// Of every face, the face of the mesh that is repaired.
    kept: Vec<Face>,
    /// Of every face of the mesh that is repaired, its corners as far as they were joined, and before fans were separated.
    places: Vec<[u32; 3]>,
}

impl Work {
    /// What every repair begins with: unusable faces go, borders are joined, fans separated.
    fn new(mesh: &TriangleMesh, options: &RepairOptions, notes: &mut Vec<RepairNote>) -> Self {
        let places = mesh.faces().to_vec();
        let mut work = Self { mesh: mesh.clone(), kept: mesh.face_indices().collect(), places };
        work.retain(&usable_faces(mesh));
        if let Some(joined) = (!options.keep_seams).then(|| joining::joined(&work.mesh)).flatten() {
            let (vertices, exactly) = (joined.vertices, joined.exactly);
            notes.push(RepairNote::VerticesMerged { vertices, exactly });
            work.mesh = joined.mesh;
            for (&face, &corners) in work.kept.iter().zip(work.mesh.faces()) {
                work.places[face.index()] = corners;
            }
            work.retain(&usable_faces(&work.mesh));
        }
        let faces = mesh.face_count() - work.kept.len();
        if faces > 0 {
            notes.insert(0, RepairNote::UnusableFaces { faces });
        }
        if ValidationReport::of(&work.mesh).nonmanifold_vertices.count > 0 {
            work.mesh = split_fans(&work.mesh);
            notes.push(RepairNote::FansSeparated);
        }
        work
    }

    /// Leaves out the other faces, and vertices that no face uses.
    fn retain(&mut self, keep: &[bool]) {
        let faces = self.mesh.faces().iter().zip(keep).filter_map(|(face, keep)| keep.then_some(*face));
        let mesh = TriangleMesh::from_parts(self.mesh.positions().to_vec(), faces.collect());
        self.mesh = without_unreferenced_vertices(&mesh).0;
        let mut keep = keep.iter();
        self.kept.retain(|_| keep.next() == Some(&true));
    }
}

/// Whether all corners of a face are finite.
fn is_finite(mesh: &TriangleMesh, face: &[u32; 3]) -> bool {
    face.iter().all(|&v| mesh.positions()[v as usize].is_finite())
}

/// How many faces have a corner that is not finite.
fn not_finite(mesh: &TriangleMesh) -> usize {
    mesh.faces().iter().filter(|face| !is_finite(mesh, face)).count()
}

/// The faces of a mesh whose corners are finite, with the vertices they use, and the share of the faces that is left out.
pub fn finite_part(mesh: &TriangleMesh) -> (TriangleMesh, f64) {
    let faces = mesh.faces().iter().filter(|face| is_finite(mesh, face)).copied().collect();
    let finite = TriangleMesh::from_parts(mesh.positions().to_vec(), faces);
    let share = not_finite(mesh) as f64 / mesh.face_count().max(1) as f64;
    (without_unreferenced_vertices(&finite).0, share)
}

/// Which faces [`without_unusable_faces`] keeps.
fn usable_faces(mesh: &TriangleMesh) -> Vec<bool> {
    let is_usable = |&[a, b, c]: &[u32; 3]| a != b && b != c && c != a && is_finite(mesh, &[a, b, c]);
    let mut usable: Vec<bool> = mesh.faces().iter().map(is_usable).collect();
    let faces = mesh.face_indices().zip(mesh.faces().iter().copied());
    let sides = Sides::of(mesh.vertex_count(), faces.filter(|(face, _)| usable[face.index()]));
    sides.repeated_faces(mesh.faces()).into_iter().for_each(|face| usable[face.index()] = false);
    usable
}

/// Drops faces no topology can be made of: those that name a vertex twice, repeat the corners of an earlier
/// face, or have a vertex that is not finite.
pub fn without_unusable_faces(mesh: &TriangleMesh) -> TriangleMesh {
    let faces = mesh.faces().iter().zip(usable_faces(mesh)).filter_map(|(f, usable)| usable.then_some(*f));
    TriangleMesh::from_parts(mesh.positions().to_vec(), faces.collect())
}

/// Drops vertices that no face uses. The second value gives the old index of every vertex that is left.
pub fn without_unreferenced_vertices(mesh: &TriangleMesh) -> (TriangleMesh, Vec<u32>) {
    let mut new_index = vec![u32::MAX; mesh.vertex_count()];
    mesh.faces().iter().flatten().for_each(|&v| new_index[v as usize] = 0);
    let old_index: Vec<u32> =
        (0..mesh.vertex_count() as u32).filter(|&v| new_index[v as usize] == 0).collect();
    for (new, &old) in old_index.iter().enumerate() {
        new_index[old as usize] = new as u32;
    }
    let positions = old_index.iter().map(|&v| mesh.positions()[v as usize]).collect();
    let faces = mesh.faces().iter().map(|f| f.map(|v| new_index[v as usize])).collect();
    (TriangleMesh::from_parts(positions, faces), old_index)
}

#[cfg(test)]
mod tests;
