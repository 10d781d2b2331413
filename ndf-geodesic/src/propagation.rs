//! The wavefront: windows carried from face to face until nothing gets shorter.
//!
//! All windows waiting at a half-edge cross its face at once ("triangle-oriented", Qin et al. 2016), trimmed
//! against one another where they meet. Whatever the order of the crossings, the distances end up exact:
//! every shorter way is carried on. The order decides how often a face is crossed. The nearest eighth of the front is
//! crossed at once, on all threads (parallel windows: Ying, Xin and He 2014). That costs few more windows, and the results
//! do not depend on the number of threads.

use ndf_core::Progress;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{FacePoint, Halfedge, Vertex};

use crate::error::GeodesicError;
use crate::front::{Front, Task};
use crate::joints::Joints;
use crate::pending::Pending;
use crate::pseudo_sources::{Arrival, Emission, FLAT_FACES, Root, cast, emit_windows};
use crate::round::{Before, Carrier, Crossing, Exit, is_improved, within};
use crate::sources::{above, bound};
use crate::unfolding::{ApexArrival, Shapes};
use crate::windows::Window;

/// Tasks between two looks at the observer.
const TASKS_PER_REPORT: u64 = 4096;

/// A round takes one in so many tasks of the front, the nearest ones. A third instead of an eighth costs up to 2 % more windows,
/// all of them up to 16 times as many.
const ROUND: usize = 8;

/// The tasks of a round where the front has few.
const SMALLEST_ROUND: usize = 16;

/// The most windows that are made, for every face: what practice needs is some hundred, and on meshes of fewer than ten thousand
/// faces not even the worst case needs so many (Mitchell, Mount and Papadimitriou 1987). Faces so slender that lengths do not
/// determine them let windows multiply without end.
const MAX_WINDOWS: u64 = 10_000;

/// The bound lies beyond the targets by this part of their distance: a way over another corner of a target's face may be its own
/// rounded otherwise, and distances are exact to about as much.
const SLACK: f64 = 1e-12;

/// What an exact computation took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct ExactReport {
    /// Windows carried across a face.
    pub windows: u64,
    /// The largest number of windows that waited at once.
    pub peak_windows: usize,
    /// Bytes of the front's buffers at the end, which never shrink.
    pub front_bytes: usize,
    /// Faces crossed and vertices settled, repetitions included.
    pub tasks: u64,
}

pub(crate) struct Wavefront<'a> {
    mesh: &'a IntrinsicMesh,
    shapes: Shapes,
    pub(crate) distances: Vec<f64>,
    pub(crate) arrivals: Vec<Arrival>,
    front: Front,
    pending: Pending,
    /// Nothing beyond this distance is wanted.
    pub(crate) bound: f64,
    /// Points whose distance, once all are known, bounds the rest.
    targets: Vec<FacePoint>,
    /// The target that was farthest when the bound was looked at, and how far.
    farthest: Option<(usize, f64)>,
    joints: &'a Joints,
    /// Windows that entered a face, by the half-edge they entered through; empty when they are not kept.
    pub(crate) kept: Vec<Vec<Window>>,
    pub(crate) report: ExactReport,
    settled: usize,
    crossings: Vec<Crossing>,
    carrier: Carrier,
    emitted: Vec<Emission>,
}

impl<'a> Wavefront<'a> {
    pub(crate) fn new(
        mesh: &'a IntrinsicMesh,
        bound: f64,
        targets: Vec<FacePoint>,
        keep_windows: bool,
        joints: &'a Joints,
    ) -> Self {
        let vertices = mesh.vertex_count();
        Self {
            mesh,
            shapes: Shapes::of(mesh),
            distances: vec![f64::INFINITY; vertices],
            arrivals: vec![Arrival::NONE; vertices],
            front: Front::default(),
            pending: Pending::new(mesh.halfedge_count()),
            bound,
            farthest: None,
            targets,
            joints,
            kept: if keep_windows { vec![Vec::new(); mesh.halfedge_count()] } else { Vec::new() },
            report: ExactReport::default(),
            settled: 0,
            crossings: Vec::new(),
            carrier: Carrier::default(),
            emitted: Vec::new(),
        }
    }

    /// Starts from a vertex.
    pub(crate) fn add_vertex_source(&mut self, vertex: Vertex) {
        self.improve(vertex, 0.0, Arrival::NONE);
    }

    /// Starts from the point of a face, the source of this number.
    pub(crate) fn add_face_source(&mut self, point: FacePoint, number: u32) {
        let root = Root::Source(number).encode(self.mesh.vertex_count());
        let mut emitted = Vec::new();
        for side in 0..3 {
            let halfedge = point.face.halfedge(side);
            let layout = self.shapes.layout(halfedge);
            let [x, depth] = above(&point, &layout, side);
            let apex = self.mesh.tail(halfedge.previous());
            let [ax, ay] = layout.apex;
            let (behind, ahead) = (point.barycentric[side], point.barycentric[(side + 1) % 3]);
            let total = behind + ahead;
            let crossing = if total > 0.0 { layout.length * ahead / total } else { 0.0 };
            self.improve(apex, (ax - x).hypot(ay - depth), Arrival { halfedge, crossing, root });
            if let Some(entered) = self.mesh.twin(halfedge) {
                let length = layout.length;
                let window = Window { start: 0.0, end: length, x: length - x, depth, offset: 0.0, root };
                if length > 0.0 {
                    cast(self.mesh, &self.shapes, entered, window, FLAT_FACES, &mut emitted);
                }
            }
        }
        self.send_out(&mut emitted);
    }

    /// Runs until nothing waits.
    ///
    /// # Errors
    /// If there are too many windows, or the observer cancels.
    pub(crate) fn run(&mut self, progress: &dyn Progress) -> Result<(), GeodesicError> {
        if rayon::current_num_threads() == 1 {
            return self.run_rounds(progress);
        }
        // From inside the pool, or every round would wake it anew.
        rayon::scope(|_| self.run_rounds(progress))
    }

    fn run_rounds(&mut self, progress: &dyn Progress) -> Result<(), GeodesicError> {
        let most = MAX_WINDOWS * (self.mesh.face_count() as u64 + 100);
        let mut reports = 0;
        self.tighten_bound();
        while !self.front.is_empty() {
            let crossings = self.gather();
            self.carry(crossings);
            if self.report.windows + self.pending.waiting as u64 > most {
                return Err(GeodesicError::TooManyWindows { windows: most });
            }
            if self.report.tasks / TASKS_PER_REPORT > reports {
                reports = self.report.tasks / TASKS_PER_REPORT;
                progress.check()?;
                progress.report("geodesic distances", self.settled as f64 / self.mesh.vertex_count() as f64);
            }
        }
        self.report.peak_windows = self.pending.peak;
        self.report.front_bytes = self.pending.bytes();
        Ok(())
    }

    /// The next round: settles the vertices among the nearest tasks, and takes the windows of the half-edges.
    fn gather(&mut self) -> Vec<Crossing> {
        let tasks = SMALLEST_ROUND.max(self.front.len() / ROUND);
        let mut crossings = std::mem::take(&mut self.crossings);
        for _ in 0..tasks {
            let Some((distance, task)) = self.front.pop() else { break };
            self.report.tasks += 1;
            match task {
                Task::Vertex(vertex) => {
                    // Otherwise it was reached by a shorter way meanwhile.
                    if distance == self.distances[vertex.index()] && distance <= self.bound {
                        self.settled += 1;
                        self.settle(vertex, distance);
                    }
                }
                Task::Edge(halfedge) => {
                    if let Some(entering) = self.pending.take(halfedge) {
                        crossings.push(Crossing::new(self.mesh, halfedge, entering));
                    }
                }
            }
        }
        for exit in crossings.iter_mut().flat_map(|crossing| crossing.exits.iter_mut().flatten()) {
            exit.waiting = Some(self.pending.lend(exit.entered));
        }
        crossings
    }

    /// Carries windows across the faces of half-edges.
    fn carry(&mut self, mut crossings: Vec<Crossing>) {
        let before =
            Before { mesh: self.mesh, shapes: &self.shapes, distances: &self.distances, bound: self.bound };
        self.carrier.carry(&before, &mut crossings);
        for Crossing { halfedge, entering, carried, arrival, exits } in crossings.drain(..) {
            self.report.windows += carried.len() as u64;
            if let Some(all) = self.kept.get_mut(halfedge.index()) {
                all.extend_from_slice(&entering.windows[carried]);
            }
            self.pending.recycle(entering);
            if let Some(ApexArrival { distance, crossing, root }) = arrival {
                let apex = self.mesh.tail(halfedge.previous());
                self.improve(apex, distance, Arrival { halfedge, crossing, root });
            }
            for Exit { entered, waiting } in exits.into_iter().flatten() {
                if let Some(waiting) = waiting
                    && let Some(nearest) = self.pending.put(entered, waiting)
                {
                    self.front.push(nearest, Task::Edge(entered));
                }
            }
        }
        self.crossings = crossings;
    }

    fn improve(&mut self, vertex: Vertex, distance: f64, arrival: Arrival) {
        if is_improved(self.distances[vertex.index()], distance, self.bound) {
            self.distances[vertex.index()] = distance;
            self.arrivals[vertex.index()] = arrival;
            self.front.push(distance, Task::Vertex(vertex));
        }
    }

    /// Relaxes the edges of a vertex and sends out its windows.
    fn settle(&mut self, vertex: Vertex, distance: f64) {
        let mesh = self.mesh;
        if !self.targets.is_empty() {
            self.tighten_bound();
        }
        let joints = self.joints;
        for other in joints.others(vertex) {
            self.improve(other, distance, Arrival::NONE);
        }
        for h in mesh.outgoing(vertex) {
            let length = self.shapes.length(h);
            // The face of `h` seen from its tip: the path arrives along the side that ends at this vertex.
            let opposite = h.previous();
            let crossing = self.shapes.length(opposite);
            let root = Root::Vertex(vertex).encode(mesh.vertex_count());
            self.improve(mesh.tip(h), distance + length, Arrival { halfedge: opposite, crossing, root });
            if mesh.twin(opposite).is_none() {
                let arrival = Arrival { halfedge: h, crossing: 0.0, root };
                self.improve(mesh.tail(opposite), distance + crossing, arrival);
            }
        }
        let arrival = self.arrivals[vertex.index()];
        let mut emitted = std::mem::take(&mut self.emitted);
        emit_windows(mesh, &self.shapes, vertex, distance, arrival, &mut emitted);
        self.send_out(&mut emitted);
        self.emitted = emitted;
    }

    fn send_out(&mut self, emitted: &mut Vec<Emission>) {
        for emission in emitted.drain(..) {
            match emission {
                Emission::Window(halfedge, window) => self.wait(halfedge, &[window]),
                Emission::Crossed(halfedge, window) => {
                    if let Some(all) = self.kept.get_mut(halfedge.index()) {
                        all.push(window);
                    }
                    let [x, y] = self.shapes.layout(halfedge).apex;
                    let (distance, crossing) = window.reach(x, y);
                    let apex = self.mesh.tail(halfedge.previous());
                    self.improve(apex, distance, Arrival { halfedge, crossing, root: window.root });
                }
            }
        }
    }

    /// Lets windows wait at the half-edge through which they enter a face.
    fn wait(&mut self, entered: Halfedge, windows: &[Window]) {
        if let Some(nearest) = self.pending.add(entered, within(windows, self.bound)) {
            self.front.push(nearest, Task::Edge(entered));
        }
    }

    /// Lowers the bound to the largest distance of the targets, as far as known. O(1) as long as the farthest stays as far.
    fn tighten_bound(&mut self) {
        let reach = |p: &FacePoint| bound(self.mesh, p, &self.distances);
        if self.farthest.is_some_and(|(target, before)| reach(&self.targets[target]) >= before) {
            return;
        }
        let reaches = self.targets.iter().map(reach).enumerate();
        if let Some((target, farthest)) = reaches.max_by(|a, b| a.1.total_cmp(&b.1)) {
            self.farthest = Some((target, farthest));
            self.bound = self.bound.min(farthest * (1.0 + SLACK));
        }
    }
}
