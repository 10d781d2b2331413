//! A triangle mesh proven to be an oriented 2-manifold, with half-edge topology.

use std::ops::Deref;

use ndf_core::DVec3;
use rayon::prelude::*;

use crate::halfedge::Topology;
use crate::{Halfedge, Sides, TriangleMesh, ValidationReport};

/// An oriented manifold triangle mesh, possibly with boundary and several components.
///
/// Invariants: positions are finite; every face has three different vertices and every vertex a face; every
/// edge has one face, or two faces that run along it in opposite directions; the faces around every vertex
/// form one fan. Faces without area are allowed: they are a matter of geometry, not of topology.
///
/// It can only be made by [`ManifoldMesh::try_from`] and [`ManifoldMesh::with_twins`], which check. It dereferences to
/// its positions and faces.
#[derive(Clone, Debug)]
pub struct ManifoldMesh {
    mesh: TriangleMesh,
    topology: Topology,
}

/// Why a mesh is no [`ManifoldMesh`]: the full report.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("not an oriented manifold: {}", .0.manifold_defects())]
pub struct NotManifold(pub Box<ValidationReport>);

impl TryFrom<TriangleMesh> for ManifoldMesh {
    type Error = NotManifold;

    /// Checks the mesh and builds its topology. O(n log degree).
    ///
    /// # Errors
    /// With the report of every defect, if the mesh is not an oriented manifold.
    fn try_from(mesh: TriangleMesh) -> Result<Self, NotManifold> {
        match Self::proven(mesh) {
            Ok(manifold) => Ok(manifold),
            Err(mesh) => Err(NotManifold(Box::new(ValidationReport::of(&mesh)))),
        }
    }
}

/// Positions and faces, with everything that needs no topology.
impl Deref for ManifoldMesh {
    type Target = TriangleMesh;

    fn deref(&self) -> &TriangleMesh {
        &self.mesh
    }
}

impl ManifoldMesh {
    /// A manifold of which the twin of every half-edge is known ([`NO_HALFEDGE`](crate::NO_HALFEDGE) on the boundary): twins are
    /// checked over all threads instead of being searched for. O(n · degree).
    ///
    /// # Errors
    /// With the report of every defect, if the mesh is not an oriented manifold. If it is one, but the twins are
    /// not its own, they are found as by [`try_from`](Self::try_from).
    pub fn with_twins(mesh: TriangleMesh, twins: &[Halfedge]) -> Result<Self, NotManifold> {
        match topology_of(&mesh, twins) {
            Some(topology) => Ok(Self { mesh, topology }),
            None => Self::try_from(mesh),
        }
    }

    /// The mesh with its topology if it is an oriented manifold, or else as it was.
    pub(crate) fn proven(mesh: TriangleMesh) -> Result<Self, TriangleMesh> {
        let sides = Sides::of(mesh.vertex_count(), mesh.face_indices().zip(mesh.faces().iter().copied()));
        let twins = sides.twins(mesh.faces());
        drop(sides);
        match twins.and_then(|twins| topology_of(&mesh, &twins)) {
            Some(topology) => Ok(Self { mesh, topology }),
            None => Err(mesh),
        }
    }

    /// Its connectivity: twins, edges, fans.
    pub fn topology(&self) -> &Topology {
        &self.topology
    }

    /// The mesh without its topology, given away.
    pub fn into_triangle_mesh(self) -> TriangleMesh {
        self.mesh
    }

    /// The same topology with vertices moved to `positions`.
    ///
    /// # Panics
    /// If the number of positions differs or one is not finite.
    #[must_use]
    pub fn with_positions(&self, positions: Vec<DVec3>) -> Self {
        assert_eq!(positions.len(), self.vertex_count());
        assert!(positions.iter().all(|p| p.is_finite()));
        let mesh = TriangleMesh::from_parts(positions, self.faces().to_vec());
        Self { mesh, topology: self.topology.clone() }
    }
}

/// The topology of a mesh by the twins of its half-edges, if with these it is an oriented manifold.
fn topology_of(mesh: &TriangleMesh, twins: &[Halfedge]) -> Option<Topology> {
    let is_finite = !mesh.faces().is_empty() && mesh.positions().par_iter().all(|p| p.is_finite());
    let glued = || Topology::glued(mesh.vertex_count(), mesh.faces().as_flattened(), twins).ok();
    is_finite.then(glued).flatten().filter(Topology::is_simplicial)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{NO_HALFEDGE, shapes};

    #[test]
    fn known_twins_give_the_same_mesh() {
        for mesh in [shapes::icosphere(3), shapes::torus(24, 12, 1.0, 0.4), shapes::grid(5, 3)] {
            let searched = ManifoldMesh::try_from(mesh.clone()).unwrap();
            let topology = &searched.topology;
            let twins: Vec<Halfedge> = topology.halfedges().map(|h| topology.raw_twin(h)).collect();
            let given = ManifoldMesh::with_twins(mesh.clone(), &twins).unwrap();
            let nonsense = ManifoldMesh::with_twins(mesh, &vec![Halfedge(7); twins.len()]).unwrap();
            for other in [given, nonsense] {
                assert_eq!(other.topology, searched.topology);
            }
        }
    }

    #[test]
    fn twins_do_not_hide_defects() {
        let p = |n: usize| (0..n).map(|i| DVec3::new(i as f64, (i * i) as f64, 0.0)).collect();
        let open = NO_HALFEDGE;
        // The two sides of one triangle; two fans that share a vertex; a vertex without a face.
        let pillow = TriangleMesh::new(p(3), vec![[0, 1, 2], [0, 2, 1]]).unwrap();
        assert!(ManifoldMesh::with_twins(pillow, &[5, 4, 3, 2, 1, 0].map(Halfedge)).is_err());
        let bow = TriangleMesh::new(p(5), vec![[0, 1, 2], [0, 3, 4]]).unwrap();
        assert!(ManifoldMesh::with_twins(bow, &[open; 6]).is_err());
        let lonely = TriangleMesh::new(p(4), vec![[0, 1, 2]]).unwrap();
        assert!(ManifoldMesh::with_twins(lonely, &[open; 3]).is_err());
    }
}
