//! A triangle mesh as a surface, and as a signed distance field.

use ndf_core::{Answer, BoundingBox, DVec3, Foot, Hint, ImplicitField, Inside, Miss, Query, Surface};
use ndf_mesh::{ClosestPoint, Face, TriangleMesh, TriangleTree};

use crate::WindingNumber;
use crate::crossings::winding_of_closed;
use crate::pseudonormals::Pseudonormals;
use crate::sheets::{OFFSET, inner_walls};

/// A triangle mesh of any quality: soups, holes and self-intersections are welcome.
///
/// **Projection** is the closest point, exact; its normal is the [pseudonormal](Pseudonormals) there. A query
/// with a normal that opposes the one at its closest point (by more than 105°, so that the sides of a crease do
/// not oppose each other) has come too close to the wrong side of a thin wall. It then goes to the closest point
/// among the faces that do not oppose it (by more than 90°), if that is no farther than the closest point and a
/// [reach](MeshSurface::with_guide_reach) more, which is thus the thickest wall that counts as thin.
///
/// **The field** is the distance, negative where the [winding number](WindingNumber) exceeds ½: that is right
/// also where the mesh has holes, doubled faces or pieces that intersect, where the sign of a pseudonormal is
/// not. Of a closed mesh it is told by the faces that a ray crosses. Sheets that are shut in by the others bound nothing and do not count. Only a mesh with an inside has one: at least half of a sample of its faces must part inside from
/// outside, what is inside of others aside. A flat sheet is a surface without a field.
///
/// A closed mesh whose volume is negative is taken to be inside out and turned.
#[derive(Clone, Debug)]
pub struct MeshSurface {
    tree: TriangleTree,
    normals: Pseudonormals,
    /// Of a closed mesh none: what rays cross tells the same.
    winding: Option<WindingNumber>,
    parting_share: f64,
    has_inside: bool,
    guide_reach: f64,
    area: f64,
}

/// No face of the mesh has three finite corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the mesh has no face with finite corners")]
pub struct EmptyMesh;

/// Cosine of the angle from which two normals oppose each other.
const OPPOSED: f64 = -0.25;

/// Default of [`MeshSurface::with_guide_reach`], in diagonals of the bounding box.
const GUIDE_REACH: f64 = 0.02;

/// Faces asked whether they part inside from outside.
const SIDE_SAMPLES: usize = 256;

/// The winding number of the surface.
const HALF: f64 = 0.5;

impl MeshSurface {
    /// The surface of a mesh. Faces with a corner that is not finite are left out. O(n log n).
    ///
    /// # Errors
    /// If no face is left.
    pub fn new(mesh: &TriangleMesh) -> Result<Self, EmptyMesh> {
        let normals = Pseudonormals::new(mesh);
        if normals.is_closed() && mesh.signed_volume() < 0.0 {
            let faces = mesh.faces().iter().map(|&[a, b, c]| [a, c, b]).collect();
            let turned = TriangleMesh::new(mesh.positions().to_vec(), faces)
                .expect("turning faces leaves their indices in range");
            Self::of_turned(&turned, Pseudonormals::new(&turned))
        } else {
            Self::of_turned(mesh, normals)
        }
    }

    fn of_turned(mesh: &TriangleMesh, normals: Pseudonormals) -> Result<Self, EmptyMesh> {
        let tree = TriangleTree::new(mesh);
        if tree.is_empty() {
            return Err(EmptyMesh);
        }
        let diagonal = tree.bounds().diagonal();
        let (offset, guide_reach) = (OFFSET * diagonal, GUIDE_REACH * diagonal);
        let is_wall = inner_walls(mesh, &tree, &normals, offset);
        let winding = if is_wall.contains(&true) {
            let bounding = mesh.faces().iter().zip(&is_wall).filter(|(_, is_wall)| !**is_wall);
            let bounding = bounding.map(|(face, _)| *face).collect();
            let bounding = TriangleMesh::new(mesh.positions().to_vec(), bounding)
                .expect("leaving out faces leaves indices in range");
            Some(WindingNumber::new(&bounding))
        } else {
            let is_whole = normals.is_closed() && mesh.positions().iter().all(|p| p.is_finite());
            (!is_whole).then(|| WindingNumber::new(mesh))
        };
        let area = mesh.area();
        let mut surface =
            Self { tree, normals, winding, parting_share: 0.0, has_inside: false, guide_reach, area };
        surface.ask_sides(mesh, &is_wall);
        Ok(surface)
    }

    /// The same surface with another limit, a length, to how much farther than the closest point one with a
    /// fitting normal may be. 0 makes normals of queries count for nothing.
    #[must_use]
    pub fn with_guide_reach(self, length: f64) -> Self {
        Self { guide_reach: length, ..self }
    }

    /// The box around all faces; named here so that it need not be told from those of the two traits.
    pub fn bounds(&self) -> BoundingBox {
        self.tree.bounds()
    }

    /// The share of a sample of the faces that part inside from outside: 1 for the boundary of a solid, less where pieces of
    /// the mesh are inside of others or bound nothing.
    pub fn parting_share(&self) -> f64 {
        self.parting_share
    }

    /// Signed distance of `p` to the mesh, negative inside, and the closest point; `None` if `p` is not finite. Where both
    /// sides of the mesh are inside, as at an inner wall, it is never 0. Meaningful where the mesh
    /// [has a field](Surface::as_field).
    pub fn signed_distance(&self, p: DVec3, hint: Hint) -> Option<(f64, ClosestPoint)> {
        let closest = self.tree.closest_point(p, hint)?;
        let distance = closest.distance_squared.sqrt();
        let signed = if distance <= self.offset() {
            match self.sides(closest.point, self.normals.of_face(closest.at.face)) {
                [true, true] => -distance.max(self.tolerance()),
                [false, false] => distance.max(self.tolerance()),
                _ if self.is_inside(p) => -distance,
                _ => distance,
            }
        } else if self.is_inside(p) {
            -distance
        } else {
            distance
        };
        Some((signed, closest))
    }

    /// Whether the winding number around a point exceeds ½.
    fn is_inside(&self, p: DVec3) -> bool {
        match &self.winding {
            Some(winding) => winding.at(p) > HALF,
            None => winding_of_closed(&self.tree, &self.normals, p) > 0,
        }
    }

    /// How far from a face its sides are asked for.
    fn offset(&self) -> f64 {
        OFFSET * self.tree.bounds().diagonal()
    }

    /// Whether it is inside behind and before a point of a face with this normal.
    fn sides(&self, point: DVec3, normal: DVec3) -> [bool; 2] {
        [-1.0, 1.0].map(|side| self.is_inside(point + side * self.offset() * normal))
    }

    /// Asks some faces, evenly picked, whether they have the inside behind and the outside before them.
    fn ask_sides(&mut self, mesh: &TriangleMesh, is_wall: &[bool]) {
        let usable: Vec<Face> =
            mesh.face_indices().filter(|&f| self.normals.of_face(f) != DVec3::ZERO).collect();
        let picked = || usable.iter().step_by(usable.len().div_ceil(SIDE_SAMPLES).max(1));
        let (mut all, mut parting, mut within) = (0, 0, 0);
        for &f in picked() {
            let [a, b, c] = mesh.corner_positions(f);
            let sides = self.sides((a + b + c) / 3.0, self.normals.of_face(f));
            all += 1;
            parting += usize::from(sides == [true, false]);
            // Solids in solids, and walls.
            within += usize::from(is_wall[f.index()] || (sides == [true, true] && self.normals.is_closed()));
        }
        self.parting_share = parting as f64 / all.max(1) as f64;
        self.has_inside = parting > 0 && 2 * parting >= all - within;
    }

    /// The foot of a query whose closest point is known.
    fn foot(&self, query: &Query, closest: &ClosestPoint) -> Foot {
        let normal = self.normal(query.point, closest);
        if let Some(guide) = query.normal
            && normal.dot(guide) < OPPOSED * guide.length()
        {
            let radius = closest.distance_squared.sqrt() + self.guide_reach;
            let agrees = |face: Face| self.normals.of_face(face).dot(guide) >= 0.0;
            let fitting = self.tree.closest_point_within(query.point, radius * radius, query.hint, agrees);
            if let Some(fitting) = fitting {
                let normal = self.normal(query.point, &fitting);
                return Foot { point: fitting.point, normal, hint: fitting.hint() };
            }
        }
        Foot { point: closest.point, normal, hint: closest.hint() }
    }

    /// The pseudonormal at a closest point. On a triangle without area and neighbours, any unit vector that
    /// points to the query.
    fn normal(&self, p: DVec3, closest: &ClosestPoint) -> DVec3 {
        let normal = self.normals.at(&closest.at);
        if normal == DVec3::ZERO { (p - closest.point).try_normalize().unwrap_or(DVec3::Z) } else { normal }
    }
}

impl Surface for MeshSurface {
    fn bounds(&self) -> BoundingBox {
        self.tree.bounds()
    }

    fn project(&self, queries: &[Query], feet: &mut [Answer]) {
        // Closest points first, then normals: a loop over independent look-ups hides their cache misses.
        let closest: Vec<Option<ClosestPoint>> =
            queries.iter().map(|query| self.tree.closest_point(query.point, query.hint)).collect();
        for ((query, closest), foot) in queries.iter().zip(&closest).zip(feet) {
            *foot = match closest {
                Some(closest) => Ok(self.foot(query, closest)),
                // The tree is not empty.
                None => Err(Miss::NotFinite),
            };
        }
    }

    /// A billionth of the diagonal, or the rounding of coordinates far from the origin if that is more.
    fn tolerance(&self) -> f64 {
        let bounds = self.tree.bounds();
        let farthest = bounds.min.abs().max(bounds.max.abs()).max_element();
        (1e-9 * bounds.diagonal()).max(16.0 * f64::EPSILON * farthest)
    }

    fn area(&self) -> Option<f64> {
        self.area.is_finite().then_some(self.area)
    }

    fn as_field(&self) -> Option<&dyn ImplicitField> {
        self.has_inside.then_some(self)
    }
}

impl ImplicitField for MeshSurface {
    fn values(&self, points: &[DVec3], values: &mut [f64]) {
        let mut hint = Hint::NONE;
        for (&p, value) in points.iter().zip(values) {
            *value = self.signed_distance(p, hint).map_or(f64::NAN, |(distance, closest)| {
                hint = closest.hint();
                distance
            });
        }
    }

    /// The direction away from the closest point outside, towards it inside; the normal on the surface itself.
    fn gradients(&self, points: &[DVec3], gradients: &mut [DVec3]) {
        let mut hint = Hint::NONE;
        for (&p, gradient) in points.iter().zip(gradients) {
            *gradient = self.signed_distance(p, hint).map_or(DVec3::NAN, |(distance, closest)| {
                hint = closest.hint();
                if distance.abs() <= self.tolerance() {
                    self.normal(p, &closest)
                } else {
                    (p - closest.point) / distance
                }
            });
        }
    }

    fn bounds(&self) -> BoundingBox {
        self.tree.bounds()
    }

    fn level(&self) -> f64 {
        0.0
    }

    fn inside(&self) -> Inside {
        Inside::Below
    }

    /// 1 for a closed mesh. Across a hole the sign changes away from the surface, and no bound holds.
    fn lipschitz(&self) -> Option<f64> {
        self.normals.is_closed().then_some(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use ndf_core::conformance::Facts;
    use ndf_core::projected;
    use ndf_mesh::shapes;

    fn surface(mesh: TriangleMesh) -> MeshSurface {
        MeshSurface::new(&mesh).unwrap()
    }

    fn triangle() -> TriangleMesh {
        TriangleMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]]).unwrap()
    }

    /// A sphere without a twentieth of its faces.
    fn holed() -> TriangleMesh {
        let (positions, faces) = shapes::icosphere(4).into_parts();
        TriangleMesh::new(positions, faces[256..].to_vec()).unwrap()
    }

    /// A box a hundredth as thick as it is wide.
    fn plate() -> TriangleMesh {
        shapes::cube(20).map_positions(|p| DVec3::new(p.x, p.y, 0.01 * p.z))
    }

    ndf_core::surface_conformance!(sphere, surface(shapes::icosphere(4)));
    ndf_core::surface_conformance!(knot, surface(shapes::trefoil_knot(200, 16, 0.2)));
    ndf_core::surface_conformance!(cube, surface(shapes::cube(3)));
    ndf_core::surface_conformance!(thin_plate, surface(plate()));
    ndf_core::surface_conformance!(flat_sheet, surface(shapes::grid(7, 5)), Facts::open());
    ndf_core::surface_conformance!(one_triangle, surface(triangle()), Facts::open());
    ndf_core::surface_conformance!(with_a_hole, surface(holed()));
    ndf_core::surface_conformance!(far_away, surface(shapes::icosphere(3).map_positions(|p| p + 1e6)));
    ndf_core::surface_conformance!(tiny, surface(shapes::icosphere(3).map_positions(|p| 1e-6 * p)));

    fn values(surface: &MeshSurface, points: &[DVec3]) -> Vec<f64> {
        let mut values = vec![0.0; points.len()];
        surface.values(points, &mut values);
        values
    }

    #[test]
    fn distances_are_signed() {
        let cube = surface(shapes::cube(2));
        let points = [DVec3::ZERO, DVec3::new(0.75, 0.1, 0.0), DVec3::new(4.0, 5.0, 0.0), DVec3::X];
        for (found, expected) in values(&cube, &points).into_iter().zip([-1.0, -0.25, 5.0, 0.0]) {
            assert_abs_diff_eq!(found, expected, epsilon = 1e-12);
        }
        assert!(values(&cube, &[DVec3::NAN])[0].is_nan());
        assert_eq!(cube.lipschitz(), Some(1.0));
        assert_eq!(surface(holed()).lipschitz(), None);
    }

    #[test]
    fn intersecting_pieces_unite() {
        let (mut positions, mut faces) = shapes::icosphere(3).into_parts();
        let count = positions.len() as u32;
        positions.extend(positions.clone().iter().map(|&p| p + DVec3::X));
        faces.extend(faces.clone().iter().map(|face| face.map(|v| v + count)));
        let union = surface(TriangleMesh::new(positions, faces).unwrap());
        let inner = [DVec3::new(0.5, 0.0, 0.0), DVec3::new(-0.5, 0.0, 0.0), DVec3::new(1.5, 0.0, 0.0)];
        assert!(values(&union, &inner).iter().all(|&d| d < 0.0));
        assert!(values(&union, &[DVec3::new(0.5, 0.95, 0.0)])[0] > 0.0);
    }

    #[test]
    fn sheets_have_no_inside_and_holes_do_no_harm() {
        assert!(surface(shapes::grid(4, 4)).as_field().is_none());
        assert!(surface(triangle()).as_field().is_none());
        let holed = surface(holed());
        assert!(holed.as_field().is_some());
        let signs = values(&holed, &[DVec3::ZERO, DVec3::splat(0.8), DVec3::new(0.0, -0.9, 0.0)]);
        assert!(signs[0] < 0.0 && signs[1] > 0.0 && signs[2] < 0.0);
    }

    #[test]
    fn inner_walls_are_inside() {
        // A box of two rooms.
        let (mut positions, mut faces) = shapes::cube(1).into_parts();
        let first = positions.len() as u32;
        positions
            .extend([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(y, z)| DVec3::new(0.0, y, z)));
        faces.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        let rooms = surface(TriangleMesh::new(positions, faces).unwrap());
        let on_wall = [DVec3::ZERO, DVec3::new(0.0, 0.3, -0.7), DVec3::new(1e-8, 0.5, 0.5)];
        assert!(values(&rooms, &on_wall).iter().all(|&d| d < 0.0 && d > -1e-7));
        assert_eq!(values(&rooms, &[DVec3::new(0.5, 0.25, 0.0)]), [-0.5]);
        assert!((rooms.parting_share() - 12.0 / 14.0).abs() < 1e-12);
    }

    #[test]
    fn meshes_that_are_inside_out_are_turned() {
        let (positions, faces) = shapes::icosphere(3).into_parts();
        let faces = faces.into_iter().map(|[a, b, c]| [a, c, b]).collect();
        let sphere = surface(TriangleMesh::new(positions, faces).unwrap());
        assert!(values(&sphere, &[DVec3::ZERO])[0] < 0.0);
        let foot = projected(&sphere, &[Query::at(2.0 * DVec3::Z)])[0].unwrap();
        assert!(foot.normal.z > 0.9);
    }

    #[test]
    fn guides_tell_the_sides_of_a_thin_wall_apart() {
        let plate = surface(plate());
        let below_the_middle = DVec3::new(0.312, 0.123, -0.004);
        let foot = |normal: DVec3| {
            let query = Query { normal: Some(normal), ..Query::at(below_the_middle) };
            projected(&plate, &[query])[0].unwrap()
        };
        assert!(foot(DVec3::Z).point.distance(below_the_middle.with_z(0.01)) < 1e-15);
        assert!(foot(DVec3::NEG_Z).point.distance(below_the_middle.with_z(-0.01)) < 1e-15);
        // A crease is no wall: the closest point stays, though the normal is square to the guide.
        assert!(foot(DVec3::X).point.z < 0.0);

        // What is thicker than the reach is not thin.
        let thick = plate.clone().with_guide_reach(0.005);
        let query = Query { normal: Some(DVec3::Z), ..Query::at(below_the_middle) };
        assert!(projected(&thick, &[query])[0].unwrap().point.z < 0.0);
    }

    #[test]
    fn degenerate_faces_are_survived_and_nothing_is_an_error() {
        let point = TriangleMesh::new(vec![DVec3::ONE], vec![[0, 0, 0]]).unwrap();
        let foot = projected(&surface(point), &[Query::at(DVec3::ZERO)])[0].unwrap();
        assert_eq!(foot.point, DVec3::ONE);
        assert_abs_diff_eq!(foot.normal.length(), 1.0, epsilon = 1e-12);
        assert_eq!(MeshSurface::new(&TriangleMesh::default()).unwrap_err(), EmptyMesh);
        let nan = triangle().map_positions(|_| DVec3::NAN);
        assert_eq!(MeshSurface::new(&nan).unwrap_err(), EmptyMesh);
    }
}
