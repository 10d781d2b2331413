//! Shortest paths, followed back from a point to its source.
//!
//! A path is straight between pseudo-sources: each piece is found by the window that gives the distance, and
//! unrolled face by face towards the window's root.
//!
//! A line that passes a vertex by a hair may unroll around its wrong side, or over a boundary, after which it
//! leads nowhere; along slender faces every line does. Lengths tell: on its way what is left of the line is
//! compared with the ways over the vertices around, whose distances are known, and with the way to a source in
//! the face. The path takes one as soon as it is no longer than the line; where the line leads nowhere, it takes
//! the one that was the least longer.

use ndf_core::DVec3;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{Halfedge, ManifoldMesh, SurfacePoint, Vertex};

use crate::error::GeodesicError;
use crate::exact::Geodesics;
use crate::pseudo_sources::{Arrival, Root};
use crate::queries::Piece;
use crate::sources::{Place, above, to_surface_point};
use crate::unfolding::Layout;
use crate::windows::Window;

/// A way is as short as a line if it is longer by less than this part of the distance.
const AS_SHORT: f64 = 1e-12;

/// A way that is longer by less than this part of the distance replaces a line that leads nowhere.
const NEARLY_AS_SHORT: f64 = 1e-10;

/// A shortest path on a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// The corners of the polyline, from the point asked for to the source: straight in a face between each
    /// two.
    pub points: Vec<SurfacePoint>,
    /// Its length: the distance of the point.
    pub length: f64,
    /// Which source it ends at, as an index of those given.
    pub source: usize,
}

impl Path {
    /// Positions of the polyline's corners on the embedded mesh.
    ///
    /// # Panics
    /// If `mesh` is not the one whose distances these are.
    pub fn positions(&self, mesh: &ManifoldMesh) -> Vec<DVec3> {
        self.points.iter().map(|p| p.position(mesh)).collect()
    }
}

/// A line on its way back through the surface: it crosses `halfedge`, leaving that half-edge's face, towards
/// a root.
#[derive(Clone, Copy, Debug)]
struct Ray {
    halfedge: Halfedge,
    /// Where it crosses, as a length from the tail.
    crossing: f64,
    /// The root in the frame of the half-edge: along it, and below it.
    x: f64,
    depth: f64,
}

impl Geodesics<'_> {
    /// A shortest path from a point of the mesh back to its nearest source; where several are equally short,
    /// one of them. O(windows of the faces with a corner, and faces crossed).
    ///
    /// # Errors
    /// If the windows were not [kept](crate::ExactOptions::keep_windows), the point is not on the mesh, no
    /// source reaches it, or lengths that are not those of a surface mislead the path.
    pub fn path_to(&self, point: SurfacePoint) -> Result<Path, GeodesicError> {
        let length = self.distance_at(point)?;
        if self.windows.is_empty() {
            return Err(GeodesicError::WindowsNotKept);
        }
        if length.is_infinite() {
            return Err(GeodesicError::Unreached { point });
        }
        let lost = || GeodesicError::PathLost { point };
        let place = Place::of(self.mesh, point)?;
        let mut points = vec![match place {
            Place::Vertex(v) => SurfacePoint::Vertex(v),
            Place::Face(_) => point,
        }];
        let mut piece = match place {
            Place::Face(p) => self.nearest_in_face(&p).piece.ok_or_else(lost)?,
            Place::Vertex(v) => Piece::Vertex(v),
        };
        // Every vertex on the way is nearer than the one before.
        let mut from = length;
        for _ in 0..=self.mesh.vertex_count() {
            let reached = match piece {
                Piece::Vertex(v) => Root::Vertex(v),
                Piece::Source(number) => Root::Source(number),
                Piece::Window { halfedge, window, crossing } => {
                    let ray = Ray { halfedge, crossing, x: window.x, depth: window.depth };
                    self.follow(ray, &window, from, &mut points).ok_or_else(lost)?
                }
            };
            let vertex = match reached {
                Root::Source(number) => {
                    let Place::Face(source) = self.sources[number as usize] else { return Err(lost()) };
                    push(&mut points, to_surface_point(self.mesh, source));
                    return Ok(Path { points, length, source: number as usize });
                }
                Root::Vertex(vertex) => vertex,
            };
            push(&mut points, SurfacePoint::Vertex(vertex));
            let vertex = self.where_reached(vertex);
            push(&mut points, SurfacePoint::Vertex(vertex));
            if let Some(source) = self.sources.iter().position(|s| *s == Place::Vertex(vertex)) {
                return Ok(Path { points, length, source });
            }
            from = self.distances[vertex.index()];
            piece = self.nearest_to_vertex(vertex).piece.ok_or_else(lost)?;
        }
        Err(lost())
    }

    /// The vertex of the group of this one through which the path comes, or which is a source.
    fn where_reached(&self, vertex: Vertex) -> Vertex {
        let is_source = |v: &Vertex| self.sources.contains(&Place::Vertex(*v));
        let is_reached = |v: &Vertex| self.arrivals[v.index()] != Arrival::NONE || is_source(v);
        let is_as_near = |v: &Vertex| self.distances[v.index()] == self.distances[vertex.index()];
        if is_reached(&vertex) {
            return vertex;
        }
        self.joints.others(vertex).filter(is_as_near).find(is_reached).unwrap_or(vertex)
    }

    /// Follows a window's line, which begins at the distance `from`, back to its root or to a vertex over which
    /// the rest of the way is as short, appending where it crosses edges; returns which. `None` where the line
    /// is lost.
    fn follow(
        &self,
        mut ray: Ray,
        window: &Window,
        from: f64,
        points: &mut Vec<SurfacePoint>,
    ) -> Option<Root> {
        let mesh = self.mesh;
        let root = Root::decode(window.root, mesh.vertex_count());
        let mut other = Other { longer: NEARLY_AS_SHORT * from, to: None, points: 0 };
        // A shortest path crosses a face at most once for every source and bend.
        for _ in 0..=2 * mesh.face_count() {
            let Ray { halfedge, crossing, x, depth } = ray;
            let rest = window.offset + (crossing - x).hypot(depth);
            let over = |vertex: Vertex, along: f64| {
                let distance = self.distances[vertex.index()];
                if distance < from { distance + along - rest } else { f64::INFINITY }
            };
            let [tail, tip] = [mesh.tail(halfedge), mesh.tip(halfedge)];
            other.offer(over(tail, crossing), Root::Vertex(tail), points);
            other.offer(over(tip, mesh.halfedge_length(halfedge) - crossing), Root::Vertex(tip), points);
            if other.longer <= AS_SHORT * from {
                break;
            }
            push(points, on_halfedge(mesh, halfedge, crossing));
            let Some(entered) = mesh.twin(halfedge) else { break };
            let layout = Layout::of(mesh, entered);
            let start = layout.length - crossing;
            let to = |[px, py]: [f64; 2]| (px - start).hypot(py);
            let apex = mesh.tail(entered.previous());
            other.offer(over(apex, to(layout.apex)), Root::Vertex(apex), points);
            if let Root::Source(number) = root
                && let Place::Face(source) = self.sources[number as usize]
                && source.face == entered.face()
            {
                other.offer(to(above(&source, &layout, entered.corner())) - rest, root, points);
            }
            if other.longer <= AS_SHORT * from {
                break;
            }
            ray = leave(entered, &layout, start, [layout.length - x, depth]);
        }
        points.truncate(other.points);
        other.to
    }
}

/// The shortest other way than the line: over a vertex, or straight to the root.
struct Other {
    /// By how much it is longer.
    longer: f64,
    to: Option<Root>,
    /// How many points of the path it keeps.
    points: usize,
}

impl Other {
    fn offer(&mut self, longer: f64, to: Root, points: &[SurfacePoint]) {
        if longer < self.longer {
            *self = Self { longer, to: Some(to), points: points.len() };
        }
    }
}

/// Carries a line on from the point `from` of the x axis through the face of `halfedge`, laid out above it,
/// towards the root `to`: to the side where it leaves.
fn leave(halfedge: Halfedge, layout: &Layout, from: f64, to: [f64; 2]) -> Ray {
    let tip = [layout.length, 0.0];
    let (right, right_miss) = meet(halfedge.next(), tip, layout.apex, from, to);
    let (left, left_miss) = meet(halfedge.previous(), layout.apex, [0.0, 0.0], from, to);
    let [ax, ay] = layout.apex;
    let apex_is_left = to[0] * ay - from * ay - to[1] * (ax - from) > 0.0;
    // In a face without area the line is parallel to all sides; the side that it lies on is the one it does
    // not miss.
    if right_miss < left_miss || (right_miss == left_miss && apex_is_left) { right } else { left }
}

/// Where the line from the point `from` of the x axis to `to` meets the side between two points, and by how
/// much it misses that side.
fn meet(side: Halfedge, [tx, ty]: [f64; 2], [hx, hy]: [f64; 2], from: f64, to: [f64; 2]) -> (Ray, f64) {
    let length = (hx - tx).hypot(hy - ty);
    let [ex, ey] = if length > 0.0 { [(hx - tx) / length, (hy - ty) / length] } else { [1.0, 0.0] };
    let into = |x: f64, y: f64| {
        let [dx, dy] = [x - tx, y - ty];
        [dx * ex + dy * ey, ex * dy - ey * dx]
    };
    let ([px, py], [x, y]) = (into(from, 0.0), into(to[0], to[1]));
    let (above, depth) = (py.max(0.0), (-y).max(0.0));
    let sum = above + depth;
    let crossing = if sum > 0.0 { px + (x - px) * (above / sum) } else { px };
    // Missing also means a root on this side of the side's line.
    let miss = (-crossing).max(crossing - length).max(y).max(0.0);
    (Ray { halfedge: side, crossing: crossing.clamp(0.0, length), x, depth }, miss)
}

/// The point of a half-edge at this length from its tail.
fn on_halfedge(mesh: &IntrinsicMesh, halfedge: Halfedge, along: f64) -> SurfacePoint {
    let length = mesh.halfedge_length(halfedge);
    let t = if length > 0.0 { along / length } else { 0.0 };
    let edge = mesh.halfedge_edge(halfedge);
    SurfacePoint::Edge { edge, t: if mesh.edge_halfedge(edge) == halfedge { t } else { 1.0 - t } }
}

/// Appends a point that is not the last one again.
fn push(points: &mut Vec<SurfacePoint>, point: SurfacePoint) {
    if points.last() != Some(&point) {
        points.push(point);
    }
}
