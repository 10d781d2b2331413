//! Plain tessellation of a displacement field: base faces subdivided until every mapped edge is short enough.
//!
//! Rounds of conforming subdivision: every edge whose image is too long is halved, its faces are cut into two,
//! three or four by template (as in red–green refinement, Bank et al. 1983). All new vertices of a round are
//! mapped in one batch. The result is manifold because the base is; its triangles are as well shaped as the
//! templates leave them.

use std::collections::BTreeMap;

use ndf_core::{DVec3, Progress};
use ndf_mesh::{Face, FacePoint, ManifoldMesh, TriangleMesh, Vertex};
use ndf_model::DisplacementField;

use super::ExtractionError;

/// A tessellation, in the normalised box.
#[derive(Clone, Debug)]
pub struct Tessellation {
    /// The mapped triangles.
    pub mesh: ManifoldMesh,
    /// Where on the base mesh every vertex lies.
    pub origins: Vec<FacePoint>,
}

/// Subdivides until no mapped edge is longer than `edge_length` (normalised). O(n log n).
///
/// # Errors
/// If the length is not positive, the field not finite, or more than `max_faces` triangles would be needed, or the
/// work is cancelled, which it can be between rounds.
pub fn tessellate(
    field: &DisplacementField,
    edge_length: f64,
    max_faces: usize,
    progress: &dyn Progress,
) -> Result<Tessellation, ExtractionError> {
    if edge_length.is_nan() || edge_length <= 0.0 {
        return Err(ExtractionError::EdgeLength(edge_length));
    }
    let mut triangles = Triangles::of_base(field);
    loop {
        triangles.check_finite()?;
        // A triangle with sides up to h has an area up to √3/4 h².
        let min_faces = triangles.area() / (3.0_f64.sqrt() / 4.0 * edge_length * edge_length);
        if triangles.faces.len().max(min_faces as usize) > max_faces {
            return Err(ExtractionError::TooManyFaces(max_faces));
        }
        progress.report("extraction", (triangles.faces.len() as f64 / min_faces).min(1.0));
        progress.check()?;
        if !triangles.subdivide(field, edge_length) {
            break;
        }
    }
    let mesh = TriangleMesh::new(triangles.positions, triangles.faces)
        .expect("faces refer to vertices made before them");
    let mesh = ManifoldMesh::try_from(mesh).expect("subdividing a manifold conformingly keeps it manifold");
    Ok(Tessellation { mesh, origins: triangles.origins })
}

struct Triangles {
    origins: Vec<FacePoint>,
    positions: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
    /// The base face of every face.
    base_faces: Vec<Face>,
    /// Barycentric coordinates of every face's corners in its base face.
    corners: Vec<[[f64; 3]; 3]>,
}

const UNIT: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

impl Triangles {
    fn of_base(field: &DisplacementField) -> Self {
        let base = field.base();
        let origin = |v: Vertex| FacePoint::at_corner(base.topology().vertex_halfedge(v));
        let origins: Vec<FacePoint> = base.topology().vertices().map(origin).collect();
        Self {
            positions: field.map(&origins),
            origins,
            faces: base.faces().to_vec(),
            base_faces: base.face_indices().collect(),
            corners: vec![UNIT; base.face_count()],
        }
    }

    fn area(&self) -> f64 {
        let area = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| self.positions[v as usize]);
            0.5 * (b - a).cross(c - a).length()
        };
        self.faces.iter().map(area).sum()
    }

    fn check_finite(&self) -> Result<(), ExtractionError> {
        match self.positions.iter().position(|p| !p.is_finite()) {
            Some(v) => Err(ExtractionError::NotFinite(self.origins[v].face)),
            None => Ok(()),
        }
    }

    /// Halves every edge longer than `edge_length`; whether there was one.
    fn subdivide(&mut self, field: &DisplacementField, edge_length: f64) -> bool {
        let mut midpoints: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        let mut new_origins = Vec::new();
        for (f, face) in self.faces.iter().enumerate() {
            for c in 0..3 {
                let (a, b) = (face[c], face[(c + 1) % 3]);
                let length = self.positions[a as usize].distance(self.positions[b as usize]);
                if length > edge_length {
                    midpoints.entry((a.min(b), a.max(b))).or_insert_with(|| {
                        let barycentric = midpoint(self.corners[f][c], self.corners[f][(c + 1) % 3]);
                        new_origins.push(FacePoint { face: self.base_faces[f], barycentric });
                        (self.origins.len() + new_origins.len() - 1) as u32
                    });
                }
            }
        }
        if midpoints.is_empty() {
            return false;
        }
        self.positions.extend(field.map(&new_origins));
        self.origins.extend(new_origins);

        let old = (
            std::mem::take(&mut self.faces),
            std::mem::take(&mut self.base_faces),
            std::mem::take(&mut self.corners),
        );
        for ((face, base_face), corners) in old.0.into_iter().zip(old.1).zip(old.2) {
            let middle = |c: usize| {
                let (a, b) = (face[c], face[(c + 1) % 3]);
                midpoints.get(&(a.min(b), a.max(b))).copied()
            };
            let middles = [middle(0), middle(1), middle(2)];
            // Points of the template: the three corners, then the middles of the sides.
            let points = [
                face[0],
                face[1],
                face[2],
                middles[0].unwrap_or(u32::MAX),
                middles[1].unwrap_or(u32::MAX),
                middles[2].unwrap_or(u32::MAX),
            ];
            let places = [
                corners[0],
                corners[1],
                corners[2],
                midpoint(corners[0], corners[1]),
                midpoint(corners[1], corners[2]),
                midpoint(corners[2], corners[0]),
            ];
            let distance = |i: usize, j: usize| {
                self.positions[points[i] as usize].distance_squared(self.positions[points[j] as usize])
            };
            for piece in pieces(middles.map(|m| m.is_some()), distance) {
                self.faces.push(piece.map(|i| points[i]));
                self.base_faces.push(base_face);
                self.corners.push(piece.map(|i| places[i]));
            }
        }
        true
    }
}

fn midpoint(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| f64::midpoint(a[k], b[k]))
}

/// Cuts a triangle with corners 0, 1, 2 and side middles 3 (of 0–1), 4 (of 1–2), 5 (of 2–0) of which some
/// are there. Where a quad is left, the shorter of its diagonals is taken.
fn pieces(halved: [bool; 3], distance: impl Fn(usize, usize) -> f64) -> Vec<[usize; 3]> {
    let corner = |c: usize| c % 3;
    let middle = |c: usize| 3 + c % 3;
    match halved.iter().filter(|&&h| h).count() {
        0 => vec![[0, 1, 2]],
        1 => {
            let c = halved.iter().position(|&h| h).expect("one side is halved");
            vec![[corner(c), middle(c), corner(c + 2)], [middle(c), corner(c + 1), corner(c + 2)]]
        }
        2 => {
            // Side `c` is whole; the corner opposite to it is cut off.
            let c = halved.iter().position(|&h| !h).expect("one side is whole");
            let (a, b, tip) = (corner(c), corner(c + 1), corner(c + 2));
            let (on_b, on_a) = (middle(c + 1), middle(c + 2));
            let mut all = vec![[on_a, on_b, tip]];
            if distance(a, on_b) <= distance(b, on_a) {
                all.extend([[a, b, on_b], [a, on_b, on_a]]);
            } else {
                all.extend([[a, b, on_a], [b, on_b, on_a]]);
            }
            all
        }
        _ => vec![[0, 3, 5], [1, 4, 3], [2, 5, 4], [3, 4, 5]],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_core::NoProgress;
    use ndf_mesh::ValidationReport;
    use ndf_mesh::shapes;
    use ndf_model::FieldShape;
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    fn wavy(base: TriangleMesh) -> DisplacementField {
        let base = ManifoldMesh::try_from(base).unwrap();
        let field = DisplacementField::untrained(base, FieldShape::default(), 2).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        let mut random = |n: usize| (0..n).map(|_| rng.random_range(-0.2..0.2)).collect::<Vec<f32>>();
        let (f, p) = (
            random(field.network().unwrap().features().len()),
            random(field.network().unwrap().mlp().parameters().len()),
        );
        field.with_parameters(f, p).unwrap()
    }

    #[test]
    fn edges_are_short_topology_is_kept_and_origins_map_to_vertices() {
        for base in [shapes::icosphere(1), shapes::torus(10, 6, 1.0, 0.5), shapes::grid(3, 2)] {
            let field = wavy(base);
            for h in [0.3, 0.1] {
                let t = tessellate(&field, h, 1_000_000, &NoProgress).unwrap();
                assert_eq!(
                    t.mesh.topology().euler_characteristic(),
                    field.base().topology().euler_characteristic()
                );
                let report = ValidationReport::of(&t.mesh);
                assert_eq!(report.boundary_loops, ValidationReport::of(field.base()).boundary_loops);
                for e in t.mesh.topology().edges() {
                    let [a, b] = t.mesh.topology().edge_vertices(e).map(|v| t.mesh.positions()[v.index()]);
                    assert!(a.distance(b) <= h);
                }
                for (p, q) in t.mesh.positions().iter().zip(field.map(&t.origins)) {
                    assert!(p.distance(q) < 1e-6);
                }
            }
        }
    }

    #[test]
    fn long_edges_leave_the_base_alone_and_absurd_lengths_are_refused() {
        let field = wavy(shapes::icosphere(1));
        assert_eq!(tessellate(&field, 10.0, 1000, &NoProgress).unwrap().mesh.faces(), field.base().faces());
        assert_eq!(
            tessellate(&field, 1e-9, 1000, &NoProgress).unwrap_err(),
            ExtractionError::TooManyFaces(1000)
        );
        assert!(matches!(tessellate(&field, -1.0, 1000, &NoProgress), Err(ExtractionError::EdgeLength(_))));
        assert!(matches!(
            tessellate(&field, f64::NAN, 1000, &NoProgress),
            Err(ExtractionError::EdgeLength(_))
        ));
    }
}
