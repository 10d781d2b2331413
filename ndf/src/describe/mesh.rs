//! What is to be said of a mesh.

use ndf_core::{Cancelled, NoProgress, Progress};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::io::{MeshFile, ReadNote};
use ndf_mesh::repair::oriented;
use ndf_mesh::{ManifoldMesh, SelfIntersections, TriangleMesh, ValidationReport};
use serde::{Serialize, Serializer};

use super::Corners;
use crate::kind::Kind;

/// A mesh, or points of a mesh file. Lengths are in its units.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct MeshDescription {
    /// [`Kind::Mesh`].
    pub kind: Kind,
    /// Format of the file; `None` for a mesh from memory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub format: Option<String>,
    /// Counts and defects.
    #[serde(flatten, serialize_with = "counts")]
    pub report: ValidationReport,
    /// Whether the mesh can be oriented; `None` unless it is a manifold.
    pub orientable: Option<bool>,
    /// Sum of the areas of the faces.
    pub area: f64,
    /// Enclosed volume, negative where the faces are oriented inward; `None` unless the mesh is closed.
    pub volume: Option<f64>,
    /// Smallest box around all vertices, if there are any.
    pub bounds: Option<Corners>,
    /// Its diagonal.
    pub diagonal: f64,
    /// Pairs of faces in which the mesh passes through itself; counting ends at [`SelfIntersections::ENOUGH`].
    pub self_intersections: u64,
    /// How far the triangles are from intrinsic Delaunay; `None` unless the mesh is an oriented manifold.
    #[serde(flatten, serialize_with = "delaunay")]
    pub delaunay: Option<Delaunay>,
    /// Names of the scalars at its vertices.
    pub scalars: Vec<String>,
    /// What the reader of the file changed or left out.
    #[serde(serialize_with = "sentences")]
    pub notes: Vec<ReadNote>,
}

/// How far the triangles of a manifold are from the intrinsic Delaunay triangulation of its surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delaunay {
    /// Share of the inner edges that are locally Delaunay.
    pub fraction: f64,
    /// Flips of edges that lead there.
    pub flips: usize,
}

impl MeshDescription {
    /// Examines the mesh of a file. O(n log n), and the flips to Delaunay.
    pub fn of(file: &MeshFile) -> Self {
        let scalars = file.scalars.iter().map(|s| s.name.clone()).collect();
        let of_mesh = Self::of_mesh(&file.mesh, &NoProgress).expect("nothing asks to stop");
        Self { format: Some(file.format.to_string()), scalars, notes: file.notes.clone(), ..of_mesh }
    }

    /// Examines a mesh.
    ///
    /// # Errors
    /// [`Cancelled`], if the observer asks to stop.
    pub fn of_mesh(mesh: &TriangleMesh, progress: &dyn Progress) -> Result<Self, Cancelled> {
        progress.check()?;
        let report = ValidationReport::of(mesh);
        let bounds = mesh.bounds();
        progress.check()?;
        let self_intersections = SelfIntersections::of(mesh, progress)?.pairs;
        progress.check()?;
        Ok(Self {
            kind: Kind::Mesh,
            format: None,
            orientable: report.is_manifold().then(|| {
                report.inconsistent_edges.count == 0
                    || ValidationReport::of(&oriented(mesh)).inconsistent_edges.count == 0
            }),
            area: mesh.area(),
            volume: (report.faces > 0 && report.is_closed()).then(|| mesh.signed_volume()),
            bounds: (!bounds.is_empty()).then(|| bounds.into()),
            diagonal: bounds.diagonal(),
            self_intersections,
            delaunay: Delaunay::of(mesh, &report),
            scalars: Vec::new(),
            notes: Vec::new(),
            report,
        })
    }

    /// Whether the faces of the closed mesh are oriented inward.
    pub fn is_inward(&self) -> bool {
        self.volume.is_some_and(|volume| volume < 0.0)
    }
}

impl Delaunay {
    fn of(mesh: &TriangleMesh, report: &ValidationReport) -> Option<Self> {
        if !report.is_oriented_manifold() {
            return None;
        }
        let mut intrinsic = IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(mesh.clone()).ok()?);
        let fraction = intrinsic.delaunay_fraction();
        Some(Self { fraction, flips: intrinsic.flip_to_delaunay().flips })
    }
}

fn counts<S: Serializer>(report: &ValidationReport, serializer: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct Counts {
        vertices: usize,
        faces: usize,
        edges: usize,
        components: usize,
        euler_characteristic: i64,
        genus: Option<i64>,
        boundary_edges: usize,
        boundary_loops: usize,
        nonmanifold_edges: usize,
        nonmanifold_vertices: usize,
        inconsistent_edges: usize,
        degenerate_faces: usize,
        duplicate_faces: usize,
        duplicate_vertices: usize,
        unreferenced_vertices: usize,
        nonfinite_vertices: usize,
        manifold: bool,
        oriented: bool,
        closed: bool,
    }
    let counts = Counts {
        vertices: report.vertices,
        faces: report.faces,
        edges: report.edges,
        components: report.components,
        euler_characteristic: report.euler_characteristic,
        genus: report.genus(),
        boundary_edges: report.boundary_edges,
        boundary_loops: report.boundary_loops,
        nonmanifold_edges: report.nonmanifold_edges.count,
        nonmanifold_vertices: report.nonmanifold_vertices.count,
        inconsistent_edges: report.inconsistent_edges.count,
        degenerate_faces: report.degenerate_faces.count,
        duplicate_faces: report.duplicate_faces.count,
        duplicate_vertices: report.duplicate_vertices.count,
        unreferenced_vertices: report.unreferenced_vertices.count,
        nonfinite_vertices: report.nonfinite_vertices.count,
        manifold: report.is_manifold(),
        oriented: report.inconsistent_edges.count == 0,
        closed: report.faces > 0 && report.is_closed(),
    };
    counts.serialize(serializer)
}

fn delaunay<S: Serializer>(delaunay: &Option<Delaunay>, serializer: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct Keys {
        delaunay_intrinsic: Option<bool>,
        delaunay_fraction: Option<f64>,
        delaunay_flips: Option<usize>,
    }
    let keys = Keys {
        delaunay_intrinsic: delaunay.map(|d| d.flips == 0),
        delaunay_fraction: delaunay.map(|d| d.fraction),
        delaunay_flips: delaunay.map(|d| d.flips),
    };
    keys.serialize(serializer)
}

fn sentences<S: Serializer>(notes: &[ReadNote], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(notes.iter().map(ToString::to_string))
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_mesh::io::parse_mesh;
    use std::path::Path;

    fn keys(text: &str) -> serde_json::Value {
        let file = parse_mesh(text.as_bytes(), Path::new("a")).unwrap();
        serde_json::to_value(MeshDescription::of(&file)).unwrap()
    }

    #[test]
    fn flips_to_delaunay_are_counted() {
        // A flat square along its diagonal, and a flat rhombus along its longer one.
        let square = keys("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n");
        assert_eq!(square["delaunay_intrinsic"], true);
        let rhombus = keys("v -2 0 0\nv 0 -1 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n");
        assert_eq!(rhombus["delaunay_intrinsic"], false);
        assert_eq!(rhombus["delaunay_flips"], 1);
        let soup = keys("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n");
        assert!(soup["delaunay_intrinsic"].is_null());
    }

    #[test]
    fn self_intersections_are_counted() {
        let base = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        let stab = "v 0.2 0.2 -1\nv 0.2 0.2 1\nv 5 5 0\nf 4 5 6\n";
        assert_eq!(keys(&format!("{base}{stab}"))["self_intersections"], 1);
        assert_eq!(keys(base)["self_intersections"], 0);
    }
}
