//! Geodesic distances the slow way, to compare with: every straight line through every sequence of faces.
//!
//! A shortest path is a chain of straight lines between vertices, and enters no face of an embedded mesh twice (Sharir
//! and Schorr 1986, lemmas 3.2 and 3.4). Sequences of faces are unfolded into one plane around the point where a line
//! begins, in Cartesian coordinates, as long as lines pass all of their edges; nothing is compared on the way. The
//! chains come from Floyd and Warshall's algorithm. (Chen and Han 1990, without "one angle, one split".)

use ndf_intrinsic::{IntrinsicMesh, triangle};
use ndf_mesh::{Face, FacePoint, Halfedge, SurfacePoint};

type Point = [f64; 2];

/// Lines that miss a point by less than this angle meet it.
const ANGLE: f64 = 1e-11;

/// A line that is traced: where it begins, how far, through which faces.
struct Unfolding<'a> {
    mesh: &'a IntrinsicMesh,
    /// By face, its sites: their numbers and barycentric coordinates.
    sites: &'a [Vec<(usize, [f64; 3])>],
    /// No line needs to be longer.
    limit: f64,
    /// The shortest line to every site.
    lines: &'a mut [f64],
    /// Faces on the way to the present one.
    passed: Vec<bool>,
}

/// Distances between all vertices and `points`, in this order: a symmetric matrix.
pub(crate) fn distances(mesh: &IntrinsicMesh, points: &[SurfacePoint]) -> Vec<Vec<f64>> {
    let mut sites = vec![Vec::new(); mesh.face_count()];
    let mut places: Vec<Vec<FacePoint>> = Vec::new();
    let vertices = mesh.vertex_count();
    for site in 0..vertices + points.len() {
        let of_site = places_of(mesh, site, points);
        for place in &of_site {
            sites[place.face.index()].push((site, place.barycentric));
        }
        places.push(of_site);
    }
    let mut matrix = vec![vec![f64::INFINITY; places.len()]; places.len()];
    for face in mesh.faces() {
        let corners = lay_out(mesh, face);
        for &(i, b) in &sites[face.index()] {
            for &(j, c) in &sites[face.index()] {
                let [p, q] = [b, c].map(|b| combine(b, corners));
                matrix[i][j] = matrix[i][j].min((p[0] - q[0]).hypot(p[1] - q[1]));
            }
        }
    }
    let mut bounds = matrix.clone();
    chain(&mut bounds, vertices);
    for (site, places) in places.iter().enumerate() {
        let limit = bounds[site].iter().copied().filter(|d| d.is_finite()).fold(0.0, f64::max);
        let passed = vec![false; mesh.face_count()];
        let mut unfolding = Unfolding { mesh, sites: &sites, limit, lines: &mut matrix[site], passed };
        places.iter().for_each(|place| unfolding.start(place));
    }
    chain(&mut matrix, vertices);
    matrix
}

/// A site in all faces that it belongs to.
fn places_of(mesh: &IntrinsicMesh, site: usize, points: &[SurfacePoint]) -> Vec<FacePoint> {
    match site.checked_sub(mesh.vertex_count()).map(|i| points[i]) {
        None => {
            let corners = mesh.faces().flat_map(Face::halfedges);
            corners.filter(|&h| mesh.tail(h).index() == site).map(FacePoint::at_corner).collect()
        }
        Some(SurfacePoint::Face(point)) => vec![point],
        Some(SurfacePoint::Edge { edge, t }) => {
            let h = mesh.edge_halfedge(edge);
            let twin = mesh.twin(h).map(|twin| FacePoint::on_halfedge(twin, 1.0 - t));
            std::iter::once(FacePoint::on_halfedge(h, t)).chain(twin).collect()
        }
        Some(SurfacePoint::Vertex(_)) => unreachable!("vertices are sites already"),
    }
}

/// Makes lines into paths that bend at vertices.
fn chain(matrix: &mut [Vec<f64>], vertices: usize) {
    for k in 0..vertices {
        let via = matrix[k].clone();
        for row in matrix.iter_mut() {
            let to = row[k];
            row.iter_mut().zip(&via).for_each(|(d, from)| *d = d.min(to + from));
        }
    }
}

/// Corners of a face in the plane.
fn lay_out(mesh: &IntrinsicMesh, face: Face) -> [Point; 3] {
    let sides = mesh.sides(face);
    [[0.0, 0.0], [sides[0], 0.0], triangle::apex(sides)]
}

fn combine(b: [f64; 3], corners: [Point; 3]) -> Point {
    [0, 1].map(|k| b[0] * corners[0][k] + b[1] * corners[1][k] + b[2] * corners[2][k])
}

/// Sine of the angle from `u` to `v`, counter-clockwise.
fn turn(u: Point, v: Point) -> f64 {
    (u[0] * v[1] - u[1] * v[0]) / (u[0].hypot(u[1]) * v[0].hypot(v[1]))
}

impl Unfolding<'_> {
    /// Sends lines from a point through the sides of its face on which it does not lie.
    fn start(&mut self, place: &FacePoint) {
        let corners = lay_out(self.mesh, place.face);
        let from = combine(place.barycentric, corners);
        let corners = corners.map(|p| [p[0] - from[0], p[1] - from[1]]);
        self.passed[place.face.index()] = true;
        for side in 0..3 {
            if place.barycentric[(side + 2) % 3] > 0.0 {
                let (right, left) = (corners[side], corners[(side + 1) % 3]);
                self.leave(place.face.halfedge(side), right, left, right, left);
            }
        }
        self.passed[place.face.index()] = false;
    }

    /// Lets lines between two directions leave a face by a half-edge between two points.
    fn leave(&mut self, halfedge: Halfedge, tail: Point, tip: Point, right: Point, left: Point) {
        if turn(right, left) <= ANGLE {
            return;
        }
        if let Some(entered) = self.mesh.twin(halfedge)
            && !self.passed[entered.face().index()]
            && distance_to_segment(tip, tail) <= self.limit
        {
            self.passed[entered.face().index()] = true;
            self.enter(entered, tip, tail, right, left);
            self.passed[entered.face().index()] = false;
        }
    }

    /// Measures the sites of a face that lines between two directions enter, and lets them leave.
    fn enter(&mut self, halfedge: Halfedge, tail: Point, tip: Point, right: Point, left: Point) {
        let [x, y] = triangle::apex(self.mesh.sides_from(halfedge));
        let length = self.mesh.halfedge_length(halfedge);
        let [ex, ey] = [0, 1].map(|k| (tip[k] - tail[k]) / length);
        let apex = [tail[0] + x * ex - y * ey, tail[1] + x * ey + y * ex];
        let mut corners = [tail, tip, apex];
        corners.rotate_right(halfedge.corner());
        let sites = self.sites;
        for &(site, barycentric) in &sites[halfedge.face().index()] {
            let to = combine(barycentric, corners);
            if turn(right, to) >= -ANGLE && turn(to, left) >= -ANGLE {
                self.lines[site] = self.lines[site].min(to[0].hypot(to[1]));
            }
        }
        let between = |low: Point, high: Point| if turn(low, high) > 0.0 { high } else { low };
        self.leave(halfedge.next(), tip, apex, right, if turn(apex, left) > 0.0 { apex } else { left });
        self.leave(halfedge.previous(), apex, tail, between(right, apex), left);
    }
}

/// Distance of the origin from the segment between two points.
fn distance_to_segment(a: Point, b: Point) -> f64 {
    let e = [b[0] - a[0], b[1] - a[1]];
    let t = (-(a[0] * e[0] + a[1] * e[1]) / (e[0] * e[0] + e[1] * e[1])).clamp(0.0, 1.0);
    (a[0] + t * e[0]).hypot(a[1] + t * e[1])
}
