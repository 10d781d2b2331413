//! What is true of an extracted mesh, computed from it.

use ndf_mesh::ManifoldMesh;
use ndf_mesh::quality::{Quality, SmallestAngles, Spread};
use ndf_model::DisplacementField;

use super::Work;
use crate::intrinsic_mesh::{IntrinsicMesh, Mollification};

/// What extraction did, and the properties of its result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExtractionReport {
    /// Vertices.
    pub vertices: usize,
    /// Faces.
    pub faces: usize,
    /// Edges with one face.
    pub boundary_edges: usize,
    /// Whether the faces around every edge and vertex form an oriented surface: checked, not assumed.
    pub manifold: bool,
    /// V − E + F of the result.
    pub euler_characteristic: i64,
    /// V − E + F of the base mesh.
    pub base_euler_characteristic: i64,
    /// Whether all inner edges are Delaunay in the intrinsic metric.
    pub delaunay_intrinsic: bool,
    /// Share of the inner edges that are.
    pub delaunay_intrinsic_fraction: f64,
    /// Share of the inner edges of the embedded mesh that are Delaunay as embedded.
    pub delaunay_embedded_fraction: f64,
    /// Whether the intrinsic triangulation is a simplicial complex, so that the embedded mesh has its faces.
    pub embeds_intrinsic: bool,
    /// The smallest `(a + b − c) / (a + b + c)` of the intrinsic faces: the triangle inequality holds where this
    /// is not negative.
    pub min_slack: f64,
    /// What was added to lengths to give all faces an area.
    pub mollification: Mollification,
    /// Smallest angles of the embedded faces, in radians.
    pub min_angle: SmallestAngles,
    /// The smallest angle of the intrinsic triangulation, in radians.
    pub intrinsic_min_angle: f64,
    /// Lengths of the embedded edges.
    pub edge_length: Spread,
    /// h: what was asked for.
    pub target_edge_length: f64,
    /// The longest edge, in h. Splits leave at most 4/3; relaxation and flips may lengthen a few.
    pub longest_in_h: f64,
    /// Rounds of splits.
    pub rounds: usize,
    /// Edges split.
    pub splits: usize,
    /// Edges collapsed.
    pub collapses: usize,
    /// Flips in the metric of chords.
    pub chord_flips: usize,
    /// Final flips in the fixed metric.
    pub intrinsic_flips: usize,
    /// Evaluations of the field.
    pub evaluations: usize,
}

/// What is true of the intrinsic metric.
pub(super) struct IntrinsicFigures {
    mollification: Mollification,
    delaunay_fraction: f64,
    slack: f64,
    smallest_angle: f64,
}

impl IntrinsicFigures {
    pub(super) fn of(mesh: &IntrinsicMesh, mollification: Mollification) -> Self {
        Self {
            mollification,
            delaunay_fraction: mesh.delaunay_fraction(),
            slack: mesh.slack(),
            smallest_angle: mesh.smallest_angle(),
        }
    }
}

impl ExtractionReport {
    pub(super) fn of(
        field: &DisplacementField,
        h: f64,
        intrinsic: &IntrinsicMesh,
        mesh: &ManifoldMesh,
        embeds_intrinsic: bool,
        metric: IntrinsicFigures,
        work: Work,
    ) -> Self {
        let quality = Quality::of(mesh);
        let IntrinsicFigures { mollification, delaunay_fraction, slack, smallest_angle } = metric;
        Self {
            vertices: mesh.vertex_count(),
            faces: mesh.face_count(),
            boundary_edges: mesh.topology().boundary_edge_count(),
            // A manifold mesh is proof of the complex it has its faces and twins from.
            manifold: embeds_intrinsic || intrinsic.check().is_ok(),
            euler_characteristic: mesh.topology().euler_characteristic(),
            base_euler_characteristic: field.base().topology().euler_characteristic(),
            delaunay_intrinsic: delaunay_fraction == 1.0,
            delaunay_intrinsic_fraction: delaunay_fraction,
            delaunay_embedded_fraction: quality.delaunay_fraction,
            embeds_intrinsic,
            min_slack: slack,
            mollification,
            min_angle: quality.min_angle,
            intrinsic_min_angle: smallest_angle,
            edge_length: quality.edge_length,
            target_edge_length: h,
            longest_in_h: quality.edge_length.max / h,
            rounds: work.rounds,
            splits: work.splits,
            collapses: work.collapses,
            chord_flips: work.chord_flips,
            intrinsic_flips: work.intrinsic_flips,
            evaluations: work.evaluations,
        }
    }

    /// Whether the result has the topology of the base mesh and is Delaunay in its intrinsic metric, with valid
    /// triangles: what extraction promises.
    pub fn holds(&self) -> bool {
        self.manifold
            && self.euler_characteristic == self.base_euler_characteristic
            && self.delaunay_intrinsic
            && self.min_slack >= 0.0
    }
}
