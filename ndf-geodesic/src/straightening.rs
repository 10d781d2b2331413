//! Geodesics in the homotopy class of a path or a loop: edges are flipped until it runs straight (Sharp and Crane 2020, "You can
//! find geodesic paths in triangle meshes by just flipping edges").
//!
//! What comes out is locally shortest, not shortest: no path nearby that winds in the same way around handles, holes and
//! vertices it must pass is shorter.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f64::consts::PI;

use ndf_core::{Cancelled, Progress};
use ndf_intrinsic::{IntrinsicMesh, IntrinsicTriangulation};
use ndf_mesh::{Halfedge, ManifoldMesh, NO_HALFEDGE, SurfacePoint, Vertex};

use crate::GeodesicError;
use crate::edge_path::{EdgePath, Id, Step};

/// A path bends where the angle on one of its sides is smaller than a straight one by more than this.
const STRAIGHT: f64 = 1e-9;

/// How often a loop of one edge is halved.
const MOST_HALVINGS: usize = 100;

/// Joints that are looked at between two reports.
const REPORT: usize = 1024;

/// What of the vertices that a path was given it must pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ThroughOptions {
    /// Lead from the last vertex back to the first: a loop.
    pub closed: bool,
    /// Keep to the vertices; else they only say how the path winds, but for the ends of one that is open.
    pub pass_vertices: bool,
}

/// A path that is straight, or nearly.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct StraightenedPath {
    /// The corners of the polyline: straight in a face between each two. The first and last of a loop are the same point. A
    /// loop that can be drawn together has shrunk to nothing.
    pub points: Vec<SurfacePoint>,
    /// Its length.
    pub length: f64,
    /// Whether it is straight at all vertices that it need not pass. Where a path touches itself it may be held back.
    pub is_geodesic: bool,
    /// Edges that were flipped.
    pub flips: usize,
}

/// A geodesic through vertices, or in the class of the way through them: shortest ways along edges between each two
/// (Dijkstra 1959), made straight.
///
/// O(n log n) for each of the ways, and as many flips as it takes, in practice a few for each edge that is crossed.
///
/// # Errors
/// If there are fewer than two vertices, one is not of the mesh, or none leads to the next; or the observer asks to stop.
pub fn geodesic_through(
    mesh: &ManifoldMesh,
    vertices: &[Vertex],
    options: ThroughOptions,
    progress: &dyn Progress,
) -> Result<StraightenedPath, GeodesicError> {
    let missing = |v: &&Vertex| v.index() >= mesh.vertex_count();
    if let Some(&vertex) = vertices.iter().find(missing) {
        return Err(GeodesicError::NotOnMesh { point: SurfacePoint::Vertex(vertex) });
    }
    let (Some(&first), true) = (vertices.first(), vertices.len() > 1) else {
        return Err(GeodesicError::NoSource);
    };
    let mut triangulation = IntrinsicTriangulation::new(mesh);
    let mut steps = Vec::new();
    let mut ends = vertices.to_vec();
    ends.extend(options.closed.then_some(first));
    let mut passed = Vec::new();
    for pair in ends.windows(2) {
        passed.push(steps.len());
        shortest_along_edges(triangulation.mesh(), [pair[0], pair[1]], &mut steps)?;
    }
    let mut work = Straightening {
        path: EdgePath::new(&steps, options.closed),
        triangulation: &mut triangulation,
        is_fixed: vec![false; steps.len()],
        flips: 0,
        halvings: 0,
    };
    if options.pass_vertices {
        passed.iter().filter(|&&k| k < steps.len()).for_each(|&k| work.is_fixed[k] = true);
    }
    let is_geodesic = work.run(progress)?;
    let (flips, path) = (work.flips, work.path);
    Ok(StraightenedPath { flips, is_geodesic, ..traced(&triangulation, &path, first) })
}

/// Adds the steps of a shortest way along edges.
fn shortest_along_edges(
    mesh: &IntrinsicMesh,
    [from, to]: [Vertex; 2],
    steps: &mut Vec<Step>,
) -> Result<(), GeodesicError> {
    let topology = mesh.topology();
    // Backwards, so that the way is found forwards.
    let mut distances = vec![f64::INFINITY; topology.vertex_count()];
    let mut onwards: Vec<Option<Step>> = vec![None; topology.vertex_count()];
    // Not negative, so the bits order like the numbers.
    let mut queue = BinaryHeap::from([Reverse((0_u64, to))]);
    distances[to.index()] = 0.0;
    while let Some(Reverse((bits, v))) = queue.pop() {
        if v == from {
            break;
        }
        let distance = f64::from_bits(bits);
        if distance > distances[v.index()] {
            continue;
        }
        for h in topology.edges_at(v) {
            let is_outgoing = topology.tail(h) == v;
            let step = if is_outgoing { Step::against(mesh, h) } else { Step { halfedge: h, forward: true } };
            let (other, longer) = (step.from(mesh), distance + mesh.halfedge_length(h));
            if longer < distances[other.index()] {
                distances[other.index()] = longer;
                onwards[other.index()] = Some(step);
                queue.push(Reverse((longer.to_bits(), other)));
            }
        }
    }
    if distances[from.index()].is_infinite() {
        return Err(GeodesicError::Unreached { point: SurfacePoint::Vertex(to) });
    }
    let mut v = from;
    while v != to {
        let step = onwards[v.index()].expect("every vertex that was reached leads on");
        steps.push(step);
        let h = step.halfedge;
        v = if step.forward { topology.tip(h) } else { topology.tail(h) };
    }
    Ok(())
}

/// A side of a joint: the corners of faces between the step that arrives and the one that leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Left,
    Right,
}

struct Straightening<'a, 'm> {
    triangulation: &'a mut IntrinsicTriangulation<'m>,
    path: EdgePath,
    /// Whether the path must pass the vertex at which a step begins.
    is_fixed: Vec<bool>,
    flips: usize,
    halvings: usize,
}

/// Joints by the angle of their narrower side, the sharpest first; a joint is the step that leaves it and that which arrives.
type Joints = BinaryHeap<Reverse<(u64, [Id; 2])>>;

impl Straightening<'_, '_> {
    /// Straightens joint by joint. Whether all are straight at the end.
    fn run(&mut self, progress: &dyn Progress) -> Result<bool, GeodesicError> {
        let mut joints = Joints::new();
        self.path.ids().into_iter().for_each(|id| self.enqueue(id, &mut joints));
        let (mut looks, mut is_geodesic) = (0, true);
        let mut blocked: Vec<Id> = Vec::new();
        loop {
            let Some(Reverse((_, [a, b]))) = joints.pop() else {
                // What was in the way may be gone.
                let flips = self.flips;
                for b in std::mem::take(&mut blocked) {
                    if self.path.step(b).is_some() && !self.straighten(b, &mut joints) {
                        blocked.push(b);
                    }
                }
                if self.flips == flips && joints.is_empty() {
                    is_geodesic &= blocked.iter().all(|&b| self.narrower(b).is_none());
                    return Ok(is_geodesic);
                }
                continue;
            };
            looks += 1;
            if looks % REPORT == 0 && progress.cancelled() {
                return Err(Cancelled.into());
            }
            let is_there = self.path.step(b).is_some() && self.path.before(b) == Some(a);
            if is_there && !self.straighten(b, &mut joints) {
                blocked.push(b);
            }
        }
    }

    /// Queues the joint at which a step begins if it bends.
    fn enqueue(&self, id: Id, joints: &mut Joints) {
        if let (Some(before), Some((_, angle))) = (self.path.before(id), self.narrower(id)) {
            joints.push(Reverse((angle.to_bits(), [before, id])));
        }
    }

    /// The side of the joint at which step `b` begins that is narrower than a straight one, and its angle.
    fn narrower(&self, b: Id) -> Option<(Side, f64)> {
        if self.is_fixed[b] {
            return None;
        }
        let sides = [Side::Left, Side::Right].map(|side| (side, self.angle(b, side)));
        let narrowest = sides.into_iter().min_by(|x, y| x.1.total_cmp(&y.1))?;
        (narrowest.1 < PI - STRAIGHT).then_some(narrowest)
    }

    /// The angle of a side; infinite where the boundary is there.
    fn angle(&self, b: Id, side: Side) -> f64 {
        let mesh = self.triangulation.mesh();
        self.spokes(b, side)
            .map_or(f64::INFINITY, |spokes| spokes.iter().map(|&h| mesh.corner_angle(h)).sum())
    }

    /// The half-edges out of the vertex at which step `b` begins whose corners make up a side of the joint, counter-clockwise;
    /// none where the path turns back, `None` where the boundary is there.
    fn spokes(&self, b: Id, side: Side) -> Option<Vec<Halfedge>> {
        let mesh = self.triangulation.mesh();
        let topology = mesh.topology();
        let [arriving, leaving] = [self.path.step(self.path.before(b)?)?, self.path.step(b)?];
        // Out of the vertex along the first edge, and into it along the last.
        let (first, last) = match side {
            Side::Left => (leaving.left(), arriving.left()),
            Side::Right => (arriving.right(mesh), leaving.right(mesh)),
        };
        if topology.halfedge_edge(arriving.halfedge) == topology.halfedge_edge(leaving.halfedge)
            && first.is_none_or(|first| last.is_none_or(|last| topology.raw_twin(first) == last))
        {
            return Some(Vec::new());
        }
        let (mut h, last) = (first?, last?);
        let mut spokes = Vec::new();
        loop {
            spokes.push(h);
            let back = h.previous();
            if back == last {
                return Some(spokes);
            }
            h = topology.raw_twin(back);
            if h == NO_HALFEDGE {
                return None;
            }
        }
    }

    /// Halves a loop of one edge by a vertex in its middle: one edge has no other side to go around. Whether it did.
    fn halve(&mut self, b: Id, joints: &mut Joints) -> bool {
        let Some(step) = self.path.step(b) else { return true };
        let topology = self.triangulation.mesh().topology();
        let edge = topology.halfedge_edge(step.halfedge);
        if self.halvings == MOST_HALVINGS || topology.twin(step.halfedge).is_none() {
            return false;
        }
        let Ok(middle) = self.triangulation.split_edge(edge, 0.5) else { return false };
        self.halvings += 1;
        let topology = self.triangulation.mesh().topology();
        // The edge keeps its number up to the middle, from where the first half-edge leads on.
        let halves = [topology.edge_halfedge(edge), topology.vertex_halfedge(middle)];
        self.path = EdgePath::new(&halves.map(|halfedge| Step { halfedge, forward: true }), true);
        self.is_fixed = vec![false; 2];
        joints.clear();
        (0..2).for_each(|id| self.enqueue(id, joints));
        true
    }

    /// Straightens the joint at which a step begins, if it bends and nothing is in the way: flips edges out of its narrower side
    /// until none is left that bends the other way, and goes around (Sharp and Crane 2020, §3.2). Whether that is done.
    fn straighten(&mut self, b: Id, joints: &mut Joints) -> bool {
        let Some((side, _)) = self.narrower(b) else { return true };
        let Some(a) = self.path.before(b) else { return true };
        if a == b {
            return self.halve(b, joints);
        }
        let mut spokes = self.spokes(b, side).expect("it was narrow");
        let crosses = |this: &Self, spokes: &[Halfedge]| {
            let mesh = this.triangulation.mesh();
            spokes.iter().skip(1).any(|&h| this.path.has(mesh, mesh.topology().halfedge_edge(h)))
        };
        if crosses(self, &spokes) {
            return false;
        }
        'flips: loop {
            for &h in spokes.iter().skip(1) {
                let mesh = self.triangulation.mesh();
                let twin = mesh.topology().raw_twin(h);
                let inner = mesh.corner_angle(h.next()) + mesh.corner_angle(twin);
                let edge = mesh.topology().halfedge_edge(h);
                if inner < PI - STRAIGHT && self.path.flip(self.triangulation, edge) {
                    self.flips += 1;
                    let Some(after) = self.spokes(b, side) else { return false };
                    spokes = after;
                    continue 'flips;
                }
            }
            break;
        }
        let mesh = self.triangulation.mesh();
        let outer = spokes.iter().map(|h| h.next());
        let around: Vec<Step> = match side {
            Side::Left => outer.rev().map(|h| Step::against(mesh, h)).collect(),
            Side::Right => outer.map(|halfedge| Step { halfedge, forward: true }).collect(),
        };
        let length = |steps: &[Step]| steps.iter().map(|s| mesh.halfedge_length(s.halfedge)).sum::<f64>();
        let straight: Vec<Step> = [a, b].into_iter().filter_map(|id| self.path.step(id)).collect();
        // Rounding alone makes no way shorter.
        if length(&around) >= length(&straight) {
            return true;
        }
        let is_fixed = self.is_fixed[a];
        let after = self.path.after(b).filter(|&after| after != a);
        let ids = self.path.replace([a, b], &around);
        self.is_fixed.resize(self.is_fixed.len() + ids.len(), false);
        if let Some(&first) = ids.first() {
            self.is_fixed[first] = is_fixed;
        } else if let Some(after) = after {
            self.is_fixed[after] |= is_fixed;
        }
        ids.into_iter().chain(after).for_each(|id| self.enqueue(id, joints));
        true
    }
}

/// The polyline of a path of edges over the input. A loop that has shrunk to nothing is at `place`.
fn traced(triangulation: &IntrinsicTriangulation<'_>, path: &EdgePath, place: Vertex) -> StraightenedPath {
    let mesh = triangulation.mesh();
    let input = triangulation.input().topology();
    let (mut points, mut length) = (Vec::new(), 0.0);
    for step in path.ids().into_iter().filter_map(|id| path.step(id)) {
        let edge = mesh.topology().halfedge_edge(step.halfedge);
        length += mesh.length(edge);
        points.push(triangulation.location(step.from(mesh)));
        let mut crossings: Vec<SurfacePoint> = triangulation
            .trace_edge(edge)
            .into_iter()
            .map(|crossing| {
                let edge = input.halfedge_edge(crossing.input_halfedge);
                let is_canonical = input.edge_halfedge(edge) == crossing.input_halfedge;
                let t = crossing.along_input;
                SurfacePoint::Edge { edge, t: if is_canonical { t } else { 1.0 - t } }
            })
            .collect();
        if (mesh.topology().edge_halfedge(edge) == step.halfedge) != step.forward {
            crossings.reverse();
        }
        points.append(&mut crossings);
    }
    let last = path.ids().last().and_then(|&id| path.step(id));
    let end = last.map_or(place, |step| {
        let h = step.halfedge;
        if step.forward { mesh.topology().tip(h) } else { mesh.topology().tail(h) }
    });
    points.push(triangulation.location(end));
    StraightenedPath { points, length, is_geodesic: true, flips: 0 }
}
