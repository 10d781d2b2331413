//! Where straight lines begin: sources, and the saddle and boundary vertices at which shortest paths bend.
//!
//! A shortest path bends at a vertex only so that it leaves an angle of at least π on both sides of it
//! (Mitchell, Mount and Papadimitriou 1987, lemma 3.4). A vertex therefore sends out windows only into the
//! directions that make at least π with the one its own shortest path arrives from: none at all where the
//! surface is flat or curved like a sphere, a thin sector at most saddles, everything at a source.

use std::f64::consts::PI;

use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{Halfedge, NO_HALFEDGE, Vertex};

use crate::unfolding::Shapes;
use crate::windows::Window;

/// How a shortest path arrives at a vertex: through which side of which face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Arrival {
    /// The half-edge opposite to the vertex in the face the path comes through; [`NO_HALFEDGE`] at a source
    /// and where nothing arrived.
    pub(crate) halfedge: Halfedge,
    /// Where its line crosses that half-edge, as a length from the tail; an end for a path along an edge.
    pub(crate) crossing: f64,
    /// Where the line begins: an encoded [`Root`]; nothing at a source and where nothing arrived.
    pub(crate) root: u32,
}

impl Arrival {
    pub(crate) const NONE: Self = Self { halfedge: NO_HALFEDGE, crossing: 0.0, root: u32::MAX };
}

/// What a root is: a vertex, or beyond all vertices a source that is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Root {
    Vertex(Vertex),
    Source(u32),
}

impl Root {
    pub(crate) fn decode(code: u32, vertices: usize) -> Self {
        if (code as usize) < vertices {
            Self::Vertex(Vertex(code))
        } else {
            Self::Source(code - vertices as u32)
        }
    }

    pub(crate) fn encode(self, vertices: usize) -> u32 {
        match self {
            Self::Vertex(v) => v.0,
            Self::Source(s) => vertices as u32 + s,
        }
    }
}

/// Angles beyond flat below which a vertex bends no path: windows that pass it leave a gap of this angle, over
/// which paths err by less than this, relatively. Sums of computed angles of flat vertices miss 2π by some 1e-15.
const FLAT: f64 = 1e-10;

/// Sectors are widened by this angle on both sides, so that no direction falls between them and the windows
/// that pass the vertex.
const WIDENING: f64 = 1e-9;

/// Faces flatter than this, relatively, are crossed whole: positions along them say little about directions.
const NEEDLE: f64 = 1e-7;

/// A vertex this near to its source, relative to an edge there, sends windows everywhere: as positions along that
/// edge are rounded, windows of the source pass such a vertex in directions that are round-off.
const NEXT_TO: f64 = 1e-10;

/// What a root sends out.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Emission {
    /// A window that enters a face through this half-edge.
    Window(Halfedge, Window),
    /// A window whose root lies on this half-edge: all its lines cross at one point, where it ties with
    /// whatever else comes by. It has crossed the face already.
    Crossed(Halfedge, Window),
}

/// Faces a window may cross before it is sent out: flat faces in a row.
pub(crate) const FLAT_FACES: u32 = 32;

/// Sends a window into the face it enters through `halfedge`; beyond that face where the root lies on the
/// half-edge.
pub(crate) fn cast(
    mesh: &IntrinsicMesh,
    shapes: &Shapes,
    halfedge: Halfedge,
    window: Window,
    faces: u32,
    out: &mut Vec<Emission>,
) {
    let on_halfedge = window.x > window.start && window.x < window.end;
    if window.depth > NEEDLE * shapes.length(halfedge) || !on_halfedge || faces == 0 {
        // Lines along the half-edge lead nowhere that its ends do not.
        if window.depth > 0.0 || on_halfedge {
            out.push(Emission::Window(halfedge, window));
        }
        return;
    }
    let layout = shapes.layout(halfedge);
    let [x, y] = layout.apex;
    let crossing = window.crossing(x, y);
    let (goes_left, goes_right) = (crossing > window.start, crossing < window.end);
    out.push(Emission::Crossed(halfedge, window));
    for (goes, side, part) in [
        (goes_left, halfedge.previous(), layout.left_part(&window, crossing)),
        (goes_right, halfedge.next(), layout.right_part(&window, crossing)),
    ] {
        if let (true, Some(entered), Some(part)) = (goes, mesh.twin(side), part) {
            cast(mesh, shapes, entered, part, faces - 1, out);
        }
    }
}

/// Appends what a vertex at `distance` sends out to `out`.
pub(crate) fn emit_windows(
    mesh: &IntrinsicMesh,
    shapes: &Shapes,
    vertex: Vertex,
    distance: f64,
    arrival: Arrival,
    out: &mut Vec<Emission>,
) {
    // An edge without length joins two vertices into one, whose angles neither of them knows.
    let is_joined = |length: f64| length == 0.0 || distance < NEXT_TO * length;
    let joined = |h: Halfedge| is_joined(shapes.length(h)) || is_joined(shapes.length(h.previous()));
    if arrival.halfedge == NO_HALFEDGE || is_lost(shapes, arrival) || mesh.outgoing(vertex).any(joined) {
        for h in mesh.outgoing(vertex) {
            send(mesh, shapes, vertex, distance, h, None, out);
        }
        return;
    }
    let boundary = mesh.is_boundary_vertex(vertex);
    if !boundary && !exceeds_full_turn(mesh, shapes, vertex) {
        return;
    }
    let angle = |h: Halfedge| {
        let [cos, sin] = shapes.corner(h);
        sin.atan2(cos)
    };
    let mut total = 0.0;
    let mut arriving = None;
    for h in mesh.outgoing(vertex) {
        if h.next() == arrival.halfedge {
            arriving = Some(total + direction(shapes, arrival));
        }
        total += angle(h);
    }
    let arriving = arriving.expect("a path arrives through a face of the vertex");
    // Leaving directions, counter-clockwise from the first half-edge; modulo the total where there is no
    // boundary.
    let sectors = if boundary {
        [(f64::NEG_INFINITY, arriving - PI), (arriving + PI, f64::INFINITY)]
    } else if total <= 2.0 * PI + FLAT {
        return;
    } else {
        [(arriving + PI, arriving - PI + total), (arriving + PI - total, arriving - PI)]
    };
    let mut from = 0.0;
    for h in mesh.outgoing(vertex) {
        let corner = angle(h);
        for (low, high) in sectors {
            let (low, high) = (low - WIDENING - from, high + WIDENING - from);
            // A boundary's own direction is an edge, which is relaxed as such.
            if low < corner - 2.0 * WIDENING && high > 2.0 * WIDENING {
                let sector = Some((low.max(0.0), high.min(corner), corner));
                send(mesh, shapes, vertex, distance, h, sector, out);
            }
        }
        from += corner;
    }
}

/// Whether the angles around an inner vertex may sum to more than 2π. Most vertices are answered without an
/// arc tangent, by turning a vector through the corners and counting when it passes the direction it started
/// from.
fn exceeds_full_turn(mesh: &IntrinsicMesh, shapes: &Shapes, vertex: Vertex) -> bool {
    let (mut x, mut y) = (1.0_f64, 0.0_f64);
    let mut below = false;
    for h in mesh.outgoing(vertex) {
        let [cos, sin] = shapes.corner(h);
        // Only the direction counts; sums of magnitudes keep it from over- and underflow.
        let scale = 1.0 / ((cos.abs() + sin) * (x.abs() + y.abs()));
        (x, y) = ((x * cos - y * sin) * scale, (x * sin + y * cos) * scale);
        if below && y >= 0.0 {
            return true;
        }
        below |= y < 0.0;
    }
    // Flat but for round-off, to be settled by the sum of angles; NaN where a face is a point.
    y >= -1e-6 || y.is_nan()
}

/// Whether the direction of an arriving path cannot be told: it comes through a face so flat that the vertex
/// lies on the side the path crosses.
fn is_lost(shapes: &Shapes, arrival: Arrival) -> bool {
    let layout = shapes.layout(arrival.halfedge);
    let along_edge = arrival.crossing == 0.0 || arrival.crossing == layout.length;
    !along_edge && layout.apex[1] <= NEEDLE * layout.length
}

/// The angle from the arriving face's first half-edge at the vertex, counter-clockwise, to the arriving path.
fn direction(shapes: &Shapes, arrival: Arrival) -> f64 {
    let layout = shapes.layout(arrival.halfedge);
    let [x, y] = layout.apex;
    // The first half-edge at the apex runs to the tail.
    let (ax, ay) = (-x, -y);
    let (bx, by) = (arrival.crossing - x, -y);
    (ax * by - ay * bx).atan2(ax * bx + ay * by)
}

/// Sends a window through the side opposite to the vertex in the face of its outgoing half-edge; in a sector
/// `(from, to, corner)` of angles from that half-edge, or everywhere.
fn send(
    mesh: &IntrinsicMesh,
    shapes: &Shapes,
    vertex: Vertex,
    distance: f64,
    outgoing: Halfedge,
    sector: Option<(f64, f64, f64)>,
    out: &mut Vec<Emission>,
) {
    let opposite = outgoing.next();
    let Some(entered) = mesh.twin(opposite) else { return };
    let layout = shapes.layout(opposite);
    let (length, [x, y]) = (layout.length, layout.apex);
    let mut window =
        Window { start: 0.0, end: length, x: length - x, depth: y, offset: distance, root: vertex.0 };
    if let Some((from, to, corner)) = sector
        && y > NEEDLE * length
    {
        // Where the direction at this angle from the outgoing half-edge, which runs to the tail of the
        // opposite side, meets that side.
        let meet = |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            let down = x * sin + y * cos;
            if down > 0.0 { (x + y * (y * sin - x * cos) / down).clamp(0.0, length) } else { length }
        };
        if to < corner {
            window.start = length - meet(to);
        }
        if from > 0.0 {
            window.end = length - meet(from);
        }
    }
    if window.start < window.end {
        cast(mesh, shapes, entered, window, FLAT_FACES, out);
    }
}
