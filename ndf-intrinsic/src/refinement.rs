//! Intrinsic Delaunay refinement: circumcentres are inserted until all angles are large (Chew 1993; intrinsically
//! Sharp, Soliman and Crane 2019, §4.2).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use ndf_core::{Cancelled, NoProgress, Progress, Sparingly};
use ndf_mesh::SurfacePoint;
use ndf_mesh::{Edge, Face, FacePoint, Halfedge, Vertex};

use crate::delaunay::{EdgeQueue, flip_to_delaunay};
use crate::intrinsic_mesh::IntrinsicMesh;
use crate::intrinsic_triangulation::IntrinsicTriangulation;
use crate::planar::from_barycentric;
use crate::tracing::Frame;
use crate::triangle;
use crate::walking::{WalkEnd, walk};

/// Circumcentres with a smaller barycentric coordinate are put on the edge: a face as flat as that would come
/// about beside it.
const ON_EDGE: f64 = 1e-6;
/// Angles can be bounded at a vertex only if the angles around it sum to more than this, in radians: π / 3.
const NEEDLE: f64 = std::f64::consts::FRAC_PI_3;

/// Faces looked at between two questions whether to stop.
const ASKED: u32 = 256;
/// Insertions between two reports.
const REPORTED: usize = 4096;

/// What to refine for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefinementOptions {
    /// The angle wanted everywhere but at needles, in radians. Ending is proven up to 25 with boundary and 30
    /// without.
    pub min_angle: f64,
    /// The longest circumradius allowed, in the mesh's unit; ∞ for any.
    pub max_circumradius: f64,
    /// Insertions after which refinement gives up and says so.
    pub max_insertions: usize,
}

impl Default for RefinementOptions {
    /// 25°, circumcircles of any size, ten million insertions.
    fn default() -> Self {
        Self { min_angle: 25.0_f64.to_radians(), max_circumradius: f64::INFINITY, max_insertions: 10_000_000 }
    }
}

/// What refinement did, and what is true of the result.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RefinementReport {
    /// Vertices inserted inside.
    pub insertions: usize,
    /// Boundary edges split.
    pub boundary_splits: usize,
    /// Inserted vertices removed because a boundary edge's new middle came too near.
    pub removals: usize,
    /// Flips.
    pub flips: usize,
    /// Faces that keep a small angle at a needle: a vertex whose angles sum to less than 60°.
    pub needle_faces: usize,
    /// Other faces that do not satisfy the bounds. 0 if refinement succeeded.
    pub unrefined_faces: usize,
    /// Whether it was stopped by [`RefinementOptions::max_insertions`].
    pub reached_cap: bool,
    /// The smallest angle but for those at needles, in radians.
    pub min_angle: f64,
}

/// What is wrong with a face.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Verdict {
    Good,
    /// A small angle that nothing can be done about.
    Needle,
    Bad,
}

/// Faces by area, the largest first.
type Queue = BinaryHeap<(u64, Reverse<Face>)>;

struct Refinement<'t, 'm> {
    triangulation: &'t mut IntrinsicTriangulation<'m>,
    options: RefinementOptions,
    /// Whether each of the input's vertices is a needle.
    needles: Vec<bool>,
    queue: Queue,
    /// Empty between uses; kept because its flags are as many as edges.
    edges: EdgeQueue,
    report: RefinementReport,
}

impl IntrinsicTriangulation<'_> {
    /// Makes the triangulation Delaunay and inserts vertices until every face has the smallest angle and the
    /// circumradius asked for, but for small angles at needles. O(n log n) for n faces of the result.
    pub fn refine_delaunay(&mut self, options: &RefinementOptions) -> RefinementReport {
        self.refine_delaunay_with(options, &NoProgress).expect("nothing asks to stop")
    }

    /// The same, with an observer that can stop it. It is told how many of the insertions that are allowed were made.
    ///
    /// # Errors
    /// [`Cancelled`], if the observer asks to stop; the triangulation is a valid one then, too.
    pub fn refine_delaunay_with(
        &mut self,
        options: &RefinementOptions,
        progress: &dyn Progress,
    ) -> Result<RefinementReport, Cancelled> {
        progress.check()?;
        let flips = self.flip_to_delaunay().flips;
        let needles = self.base.angle_sums().into_iter().map(|sum| sum < NEEDLE).collect();
        let report = RefinementReport { flips, ..RefinementReport::default() };
        let mut refinement = Refinement {
            triangulation: self,
            options: *options,
            needles,
            queue: Queue::new(),
            edges: EdgeQueue::default(),
            report,
        };
        refinement.run(progress)?;
        Ok(refinement.conclude())
    }
}

impl Refinement<'_, '_> {
    fn mesh(&self) -> &IntrinsicMesh {
        self.triangulation.mesh()
    }

    fn judge(&self, face: Face) -> Verdict {
        let mesh = self.triangulation.mesh();
        let sides = mesh.sides(face);
        if triangle::circumradius(sides) > self.options.max_circumradius {
            return Verdict::Bad;
        }
        let bound = self.options.min_angle;
        let mut verdict = Verdict::Good;
        for c in 0..3 {
            if triangle::angle(sides, c) < bound {
                let v = mesh.tail(face.halfedge(c));
                if !self.needles.get(v.index()).copied().unwrap_or(false) {
                    return Verdict::Bad;
                }
                verdict = Verdict::Needle;
            }
        }
        verdict
    }

    fn push_if_bad(&mut self, face: Face) {
        if self.judge(face) == Verdict::Bad {
            // Areas are not negative: their bits are in their order.
            self.queue.push((self.mesh().area(face).to_bits(), Reverse(face)));
        }
    }

    fn run(&mut self, progress: &dyn Progress) -> Result<(), Cancelled> {
        let mut asked = Sparingly::new(progress, ASKED);
        self.mesh().faces().for_each(|f| self.push_if_bad(f));
        while let Some((area, Reverse(face))) = self.queue.pop() {
            let gone = face.index() >= self.mesh().face_count();
            if gone || self.mesh().area(face).to_bits() != area || self.judge(face) != Verdict::Bad {
                continue;
            }
            asked.check()?;
            let made = self.report.insertions + self.report.boundary_splits;
            if made.is_multiple_of(REPORTED) {
                progress.report("refinement", made as f64 / self.options.max_insertions.max(1) as f64);
            }
            if made >= self.options.max_insertions {
                self.report.reached_cap = true;
                break;
            }
            match self.walk_to_circumcenter(face) {
                Some(Target::Point(point)) => self.insert(point),
                Some(Target::Boundary(edge)) => self.split_boundary(edge),
                None => {}
            }
        }
        Ok(())
    }

    fn insert(&mut self, point: SurfacePoint) {
        if let Ok(v) = self.triangulation.insert(point) {
            self.report.insertions += 1;
            self.restore_delaunay(&[v]);
        }
    }

    /// Splits a boundary edge that hides a circumcentre, and takes away inserted vertices that are nearer to
    /// its middle than its ends are (Chew 1993).
    fn split_boundary(&mut self, edge: Edge) {
        let radius = 0.5 * self.mesh().length(edge);
        let Ok(v) = self.triangulation.split_edge(edge, 0.5) else { return };
        self.report.boundary_splits += 1;
        self.restore_delaunay(&[v]);
        let mut middle = v;
        loop {
            let mesh = self.mesh();
            let near = mesh.outgoing(middle).find(|&h| {
                let w = mesh.tip(h);
                let inserted = self.triangulation.coordinates.is_inserted(w) && !mesh.is_boundary_vertex(w);
                inserted && w != middle && mesh.halfedge_length(h) < radius
            });
            let Some(near) = near.map(|h| mesh.tip(h)) else { break };
            let last = Vertex::new(mesh.vertex_count() - 1);
            let neighbours = mesh.outgoing(near).map(|h| mesh.tip(h)).filter(|&w| w != near);
            let renumbered = |w: Vertex| if w == last { near } else { w };
            let mut around: Vec<Vertex> = neighbours.map(renumbered).collect();
            around.sort_unstable();
            around.dedup();
            if self.triangulation.remove(near).is_err() {
                break;
            }
            self.report.removals += 1;
            middle = if middle == last { near } else { middle };
            self.restore_delaunay(&around);
        }
    }

    /// Flips around vertices until all is Delaunay again, and queues the faces that came about.
    fn restore_delaunay(&mut self, vertices: &[Vertex]) {
        let mut edges = std::mem::take(&mut self.edges);
        let mesh = self.mesh();
        for h in vertices.iter().flat_map(|&v| mesh.outgoing(v)) {
            edges.push(mesh.halfedge_edge(h));
            edges.push(mesh.halfedge_edge(h.next()));
            edges.push(mesh.halfedge_edge(h.previous()));
        }
        let mut changed: Vec<Face> =
            vertices.iter().flat_map(|&v| mesh.outgoing(v)).map(Halfedge::face).collect();
        let flips = flip_to_delaunay(&mut self.triangulation.coordinates, &mut edges, |t, edge| {
            let h = t.mesh.edge_halfedge(edge);
            changed.push(h.face());
            changed.extend(t.mesh.twin(h).map(Halfedge::face));
        });
        self.edges = edges;
        self.report.flips += flips.flips;
        changed.sort_unstable();
        changed.dedup();
        changed.into_iter().for_each(|f| self.push_if_bad(f));
    }

    /// Follows the straight line from a face's middle to its circumcentre.
    fn walk_to_circumcenter(&self, face: Face) -> Option<Target> {
        let mesh = self.mesh();
        let center = triangle::circumcenter(mesh.sides(face))?;
        let frame = Frame::first(mesh, face.halfedge(0));
        let target = from_barycentric(frame.corners, center);
        let start = from_barycentric(frame.corners, [1.0 / 3.0; 3]);
        match walk(mesh, frame, start, target) {
            WalkEnd::Inside(place) => self.snapped(place).map(Target::Point),
            WalkEnd::Boundary(edge, _) => Some(Target::Boundary(edge)),
            WalkEnd::Lost => None,
        }
    }

    /// A point of a face, or of the edge it is all but on; `None` at a vertex.
    fn snapped(&self, place: FacePoint) -> Option<SurfacePoint> {
        let small = place.barycentric.map(|b| b < ON_EDGE);
        match small.iter().filter(|&&s| s).count() {
            0 => Some(SurfacePoint::Face(place)),
            1 => {
                let c = small.iter().position(|&s| s).expect("one is small");
                let (a, b) = ((c + 1) % 3, (c + 2) % 3);
                let h = place.face.halfedge(a);
                let t = place.barycentric[b] / (place.barycentric[a] + place.barycentric[b]);
                let edge = self.mesh().halfedge_edge(h);
                let canonical = self.mesh().edge_halfedge(edge) == h;
                Some(SurfacePoint::Edge { edge, t: if canonical { t } else { 1.0 - t } })
            }
            _ => None,
        }
    }

    fn conclude(mut self) -> RefinementReport {
        let mut smallest = f64::INFINITY;
        for face in self.mesh().faces() {
            match self.judge(face) {
                Verdict::Good => {}
                Verdict::Needle => self.report.needle_faces += 1,
                Verdict::Bad => self.report.unrefined_faces += 1,
            }
            let sides = self.mesh().sides(face);
            for c in 0..3 {
                let v = self.mesh().tail(face.halfedge(c)).index();
                if !self.needles.get(v).copied().unwrap_or(false) {
                    smallest = smallest.min(triangle::angle(sides, c));
                }
            }
        }
        self.report.min_angle = smallest;
        self.report
    }
}

/// Where the way to a circumcentre ends.
enum Target {
    Point(SurfacePoint),
    /// At this edge.
    Boundary(Edge),
}
