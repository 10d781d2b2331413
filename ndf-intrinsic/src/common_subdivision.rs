//! The common subdivision: the triangulation cut along the edges of the input.
//!
//! Its faces lie in one face of the input and one of the intrinsic triangulation, so that linear functions of
//! both are linear on it.

use ndf_core::DVec3;
use ndf_mesh::SurfacePoint;
use ndf_mesh::{Face, FacePoint, Halfedge};

use crate::intrinsic_triangulation::IntrinsicTriangulation;
use crate::normal_coordinates::{Arcs, Region};
use crate::tracing::Strip;

/// A vertex of the common subdivision, on both meshes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommonPoint {
    /// On the input.
    pub input: SurfacePoint,
    /// On the intrinsic triangulation.
    pub intrinsic: SurfacePoint,
}

/// A snapshot of how the two triangulations overlap. It owns what it holds: later changes of the triangulation
/// leave it as it is.
#[derive(Clone, Debug)]
pub struct CommonSubdivision {
    /// Vertices: those of the intrinsic triangulation with their numbers, then crossings, edge by edge.
    pub points: Vec<CommonPoint>,
    /// Triangles, with the orientation of both meshes.
    pub faces: Vec<[u32; 3]>,
    /// The input face of every triangle.
    pub input_faces: Vec<Face>,
    /// The intrinsic face of every triangle.
    pub intrinsic_faces: Vec<Face>,
}

impl IntrinsicTriangulation<'_> {
    /// Cuts the triangulation along the input's edges. O(n + length of all traces).
    pub fn common_subdivision(&self) -> CommonSubdivision {
        let mut builder = Builder::new(self);
        for face in self.mesh().faces() {
            builder.cut(face);
        }
        builder.subdivision
    }

    /// Values at the vertices of this triangulation of a function that is linear on the input's faces.
    ///
    /// # Panics
    /// If there is not one value for every vertex of the input.
    pub fn sample_input_function(&self, values: &[f64]) -> Vec<f64> {
        assert_eq!(values.len(), self.input().vertex_count());
        let at_place = |place: FacePoint| {
            place.interpolate(self.input().faces()[place.face.index()].map(|v| values[v as usize]))
        };
        let inserted = self.coordinates.places.iter().map(|&place| at_place(place));
        values.iter().copied().chain(inserted).collect()
    }
}

impl CommonSubdivision {
    /// Positions of the vertices on the input's surface.
    pub fn positions(&self, input: &ndf_mesh::ManifoldMesh) -> Vec<DVec3> {
        self.points.iter().map(|p| p.input.position(input)).collect()
    }

    /// Values at the vertices of a function that is linear on the input's faces.
    ///
    /// # Panics
    /// If there is not one value for every vertex of the input.
    pub fn sample_input_function(&self, input: &ndf_mesh::ManifoldMesh, values: &[f64]) -> Vec<f64> {
        assert_eq!(values.len(), input.vertex_count());
        let value = |point: SurfacePoint| {
            let point = point.in_some_face(input);
            point.interpolate(input.faces()[point.face.index()].map(|v| values[v as usize]))
        };
        self.points.iter().map(|p| value(p.input)).collect()
    }

    /// Values at the vertices of a function that is linear on the faces of the triangulation, which must not have
    /// changed since.
    ///
    /// # Panics
    /// If there is not one value for every vertex of the triangulation.
    pub fn sample_intrinsic_function(
        &self,
        triangulation: &IntrinsicTriangulation<'_>,
        values: &[f64],
    ) -> Vec<f64> {
        assert_eq!(values.len(), triangulation.mesh().vertex_count());
        let value = |point: SurfacePoint| match point {
            SurfacePoint::Vertex(v) => values[v.index()],
            SurfacePoint::Edge { edge, t } => {
                let [a, b] = triangulation.mesh().edge_vertices(edge);
                (1.0 - t) * values[a.index()] + t * values[b.index()]
            }
            SurfacePoint::Face(point) => {
                point.interpolate(triangulation.mesh().face_vertices(point.face).map(|v| values[v.index()]))
            }
        };
        self.points.iter().map(|p| value(p.intrinsic)).collect()
    }
}

struct Builder<'t, 'm> {
    triangulation: &'t IntrinsicTriangulation<'m>,
    subdivision: CommonSubdivision,
    /// The first point of every edge's crossings.
    first_crossings: Vec<u32>,
    /// The input faces every edge passes, one more than crossings, and where each edge's begin.
    passed: Vec<Face>,
    first_passed: Vec<u32>,
}

impl<'t, 'm> Builder<'t, 'm> {
    /// Points of the subdivision, and what edges pass.
    fn new(triangulation: &'t IntrinsicTriangulation<'m>) -> Self {
        let (mesh, input) = (triangulation.mesh(), triangulation.input());
        let mut points: Vec<CommonPoint> = mesh
            .vertices()
            .map(|v| CommonPoint { input: triangulation.location(v), intrinsic: SurfacePoint::Vertex(v) })
            .collect();
        let (mut first_crossings, mut passed, mut first_passed) = (Vec::new(), Vec::new(), Vec::new());
        let mut strip = Strip::default();
        for edge in mesh.edges() {
            first_crossings.push(points.len() as u32);
            first_passed.push(passed.len() as u32);
            triangulation.coordinates.fill_strip(&triangulation.base, mesh.edge_halfedge(edge), &mut strip);
            for q in 0..strip.crossings() {
                let crossing = strip.crossing(q);
                let input_edge = input.topology().halfedge_edge(crossing.input_halfedge);
                let canonical = input.topology().edge_halfedge(input_edge) == crossing.input_halfedge;
                let t = if canonical { crossing.along_input } else { 1.0 - crossing.along_input };
                points.push(CommonPoint {
                    input: SurfacePoint::Edge { edge: input_edge, t },
                    intrinsic: SurfacePoint::Edge { edge, t: crossing.along },
                });
            }
            passed.extend(strip.frames.iter().map(|frame| frame.halfedge.face()));
        }
        let subdivision = CommonSubdivision {
            points,
            faces: Vec::new(),
            input_faces: Vec::new(),
            intrinsic_faces: Vec::new(),
        };
        Self { triangulation, subdivision, first_crossings, passed, first_passed }
    }

    /// Crossing `q` of a half-edge, counted from its tail.
    fn crossing(&self, halfedge: Halfedge, q: i32) -> u32 {
        let mesh = self.triangulation.mesh();
        let edge = mesh.halfedge_edge(halfedge);
        let forward = mesh.edge_halfedge(edge) == halfedge;
        let q = if forward { q } else { self.triangulation.coordinates.normal[edge.index()] - 1 - q };
        self.first_crossings[edge.index()] + q as u32
    }

    /// The input face of a region of a face.
    fn input_face(&self, face: Face, region: &Region) -> Face {
        let h = face.halfedge(region.side);
        let edge = self.triangulation.mesh().halfedge_edge(h);
        let n = self.triangulation.coordinates.normal[edge.index()];
        if n < 0 {
            return self.triangulation.coordinates.first_face(h);
        }
        let forward = self.triangulation.mesh().edge_halfedge(edge) == h;
        let segment = if forward { region.segment } else { n - region.segment };
        self.passed[self.first_passed[edge.index()] as usize + segment as usize]
    }

    /// Adds a convex polygon as a fan of triangles.
    fn polygon(&mut self, face: Face, region: &Region, corners: &[u32]) {
        let input_face = self.input_face(face, region);
        for pair in corners[1..].windows(2) {
            self.subdivision.faces.push([corners[0], pair[0], pair[1]]);
            self.subdivision.input_faces.push(input_face);
            self.subdivision.intrinsic_faces.push(face);
        }
    }

    /// Cuts a face along the curves that cross it.
    fn cut(&mut self, face: Face) {
        let arcs = self.triangulation.coordinates.arcs_from(face.halfedge(0));
        let vertices = self.triangulation.mesh().face_vertices(face).map(u32::from);
        for (c, &corner) in vertices.iter().enumerate() {
            let mut inner = None;
            for level in 0..arcs.cutting[c] {
                let (on_side, on_last) = self.arc_ends(face, &arcs, c, level);
                let region = arcs.corner_region(c, level);
                match inner {
                    None => self.polygon(face, &region, &[corner, on_side, on_last]),
                    Some((a, b)) => self.polygon(face, &region, &[a, on_side, on_last, b]),
                }
                inner = Some((on_side, on_last));
            }
        }
        // What is left of a corner, counter-clockwise: the outermost arc around it, or the corner.
        let rest = |this: &Self, c: usize| match arcs.cutting[c] {
            0 => vec![vertices[c]],
            n => {
                let (on_side, on_last) = this.arc_ends(face, &arcs, c, n - 1);
                vec![on_last, on_side]
            }
        };
        let Some(c) = (0..3).find(|&c| arcs.emanating[c] > 0) else {
            let corners = [rest(self, 0), rest(self, 1), rest(self, 2)].concat();
            return self.polygon(face, &arcs.central_region(), &corners);
        };
        let (next, last) = ((c + 1) % 3, (c + 2) % 3);
        let mut corners = vec![vertices[c]];
        corners.extend(rest(self, next));
        for m in 0..arcs.emanating[c] {
            let hit = self.crossing(face.halfedge(next), arcs.cutting[next] + m);
            corners.push(hit);
            self.polygon(face, &arcs.fan_region(c, m), &corners);
            corners = vec![vertices[c], hit];
        }
        corners.extend(rest(self, last));
        self.polygon(face, &arcs.fan_region(c, arcs.emanating[c]), &corners);
    }

    /// Ends of the arc around a corner: on the side that begins there and on the one that ends there.
    fn arc_ends(&self, face: Face, arcs: &Arcs, c: usize, level: i32) -> (u32, u32) {
        let last = (c + 2) % 3;
        let on_last = self.crossing(face.halfedge(last), arcs.crossings[last] - 1 - level);
        (self.crossing(face.halfedge(c), level), on_last)
    }
}
