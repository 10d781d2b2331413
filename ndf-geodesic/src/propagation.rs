//! The wavefront: windows carried from face to face until nothing gets shorter.
//!
//! All windows waiting at a half-edge cross its face at once ("triangle-oriented", Qin et al. 2016), trimmed
//! against one another where they meet. Whatever the order of the crossings, the distances end up exact:
//! every shorter way is carried on. The order decides how often a face is crossed.

use ndf_core::Progress;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{FacePoint, Halfedge, Vertex};

use crate::envelope::{cut_by_left_rival, cut_by_right_rival, cut_by_tail, cut_by_tip};
use crate::error::GeodesicError;
use crate::front::{Front, Task};
use crate::joints::Joints;
use crate::pending::Pending;
use crate::pseudo_sources::{Arrival, Emission, FLAT_FACES, Root, cast, emit_windows};
use crate::sources::{above, bound};
use crate::unfolding::{ApexArrival, Shapes};
use crate::windows::{TIE, Window};

/// Tasks between two looks at the observer.
const TASKS_PER_REPORT: u64 = 4096;

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
    left: Vec<Window>,
    right: Vec<Window>,
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
            left: Vec::new(),
            right: Vec::new(),
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
    pub(crate) fn run(&mut self, progress: &dyn Progress) -> Result<(), GeodesicError> {
        let mut settled = 0;
        let most = MAX_WINDOWS * (self.mesh.face_count() as u64 + 100);
        self.tighten_bound();
        while let Some((distance, task)) = self.front.pop() {
            match task {
                Task::Vertex(vertex) => {
                    // Otherwise it was reached by a shorter way meanwhile.
                    if distance == self.distances[vertex.index()] && distance <= self.bound {
                        settled += 1;
                        self.settle(vertex, distance);
                    }
                }
                Task::Edge(halfedge) => self.cross(halfedge),
            }
            self.report.tasks += 1;
            if self.report.windows + self.pending.waiting as u64 > most {
                return Err(GeodesicError::TooManyWindows { windows: most });
            }
            if self.report.tasks.is_multiple_of(TASKS_PER_REPORT) {
                progress.check()?;
                progress.report("geodesic distances", settled as f64 / self.mesh.vertex_count() as f64);
            }
        }
        self.report.peak_windows = self.pending.peak;
        self.report.front_bytes = self.pending.bytes();
        Ok(())
    }

    fn improve(&mut self, vertex: Vertex, distance: f64, arrival: Arrival) {
        // What round-off gains would only send the same windows out again.
        if distance < self.distances[vertex.index()] * (1.0 - TIE) && distance <= self.bound {
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

    /// Carries the windows waiting at a half-edge across its face.
    fn cross(&mut self, halfedge: Halfedge) {
        let Some((slot, mut list)) = self.pending.take(halfedge) else { return };
        let mesh = self.mesh;
        let (next, previous) = (halfedge.next(), halfedge.previous());
        let [tail, tip, apex] = [halfedge, next, previous].map(|h| mesh.tail(h));
        let layout = self.shapes.layout(halfedge);
        let [at_tail, at_tip] = [tail, tip].map(|v| self.distances[v.index()]);
        let gone = cut_by_tail(&mut list, at_tail);
        let kept = cut_by_tip(&mut list[gone..], layout.length, at_tip);
        let windows = &list[gone..gone + kept];
        self.report.windows += windows.len() as u64;
        if let Some(all) = self.kept.get_mut(halfedge.index()) {
            all.extend_from_slice(windows);
        }
        let (mut left, mut right) = (std::mem::take(&mut self.left), std::mem::take(&mut self.right));
        left.clear();
        right.clear();
        if let Some(arrival) = layout.propagate(windows, &mut left, &mut right) {
            let ApexArrival { distance, crossing, root } = arrival;
            self.improve(apex, distance, Arrival { halfedge, crossing, root });
        }
        self.pending.recycle(slot, list);
        let at_apex = self.distances[apex.index()];
        if let Some(entered) = mesh.twin(previous) {
            let kept = cut_by_right_rival(&mut left, &layout.tip_from_left(at_tip));
            let kept = cut_by_tip(&mut left[..kept], self.shapes.length(previous), at_apex);
            let gone = cut_by_tail(&mut left[..kept], at_tail);
            self.wait(entered, &left[gone..kept]);
        }
        if let Some(entered) = mesh.twin(next) {
            let gone = cut_by_left_rival(&mut right, &layout.tail_from_right(at_tail));
            let gone = gone + cut_by_tail(&mut right[gone..], at_apex);
            let kept = cut_by_tip(&mut right[gone..], self.shapes.length(next), at_tip);
            self.wait(entered, &right[gone..gone + kept]);
        }
        (self.left, self.right) = (left, right);
    }

    /// Lets windows wait at the half-edge through which they enter a face.
    fn wait(&mut self, entered: Halfedge, mut windows: &[Window]) {
        if self.bound < f64::INFINITY {
            while let [first, rest @ ..] = windows
                && first.nearest() > self.bound
            {
                windows = rest;
            }
            while let [rest @ .., last] = windows
                && last.nearest() > self.bound
            {
                windows = rest;
            }
        }
        if windows.is_empty() {
            return;
        }
        let nearest = windows.iter().map(Window::nearest).fold(f64::INFINITY, f64::min);
        if self.pending.add(entered, windows, nearest) {
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
