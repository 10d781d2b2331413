//! Exact polyhedral distances.

use ndf_core::Progress;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{SurfacePoint, Vertex};

use crate::error::GeodesicError;
use crate::joints::Joints;
use crate::propagation::{ExactReport, Wavefront};
use crate::pseudo_sources::{Arrival, Root};
use crate::sources::Place;
use crate::windows::Window;

/// What to compute besides distances at vertices, and where to stop.
#[derive(Clone, Debug, PartialEq)]
pub struct ExactOptions {
    /// Keep all windows, which paths and distances at points other than vertices need. Memory then grows with
    /// all windows ever made, by some hundred bytes a window, and not with the front.
    pub keep_windows: bool,
    /// Stop at this distance; what lies beyond stays infinite.
    pub radius: f64,
    /// Stop when the distances of all these points are known; what lies beyond the farthest stays infinite.
    /// Empty to go everywhere.
    pub targets: Vec<SurfacePoint>,
    /// Groups of vertices that are one place, as where fans of faces meet in one vertex: paths pass from each to the others
    /// of its group. Groups with a vertex in common are one.
    pub joined: Vec<Vec<Vertex>>,
}

impl Default for ExactOptions {
    /// Distances at all vertices and nothing else.
    fn default() -> Self {
        Self { keep_windows: false, radius: f64::INFINITY, targets: Vec::new(), joined: Vec::new() }
    }
}

impl ExactOptions {
    /// Distances everywhere and paths.
    pub fn with_windows() -> Self {
        Self { keep_windows: true, ..Self::default() }
    }
}

/// Exact distances from a set of sources.
#[derive(Clone, Debug)]
pub struct Geodesics<'a> {
    pub(crate) mesh: &'a IntrinsicMesh,
    pub(crate) sources: Vec<Place>,
    pub(crate) distances: Vec<f64>,
    pub(crate) arrivals: Vec<Arrival>,
    pub(crate) bound: f64,
    /// By half-edge; empty when not kept.
    pub(crate) windows: Vec<Vec<Window>>,
    pub(crate) joints: Joints,
    report: ExactReport,
}

impl Geodesics<'_> {
    /// Distance of every vertex from its nearest source; +∞ where none reaches, and beyond the radius or the
    /// targets at which the computation stopped.
    pub fn distances(&self) -> &[f64] {
        &self.distances
    }

    /// The nearest source of every vertex, as an index of those given: the regions of a Voronoi diagram. Of several equally near
    /// ones it is any. `None` where there is no finite distance. O(n log n).
    pub fn nearest_sources(&self) -> Vec<Option<usize>> {
        let vertices = self.distances.len();
        let mut nearest = vec![None; vertices];
        for (number, source) in self.sources.iter().enumerate().rev() {
            if let Place::Vertex(v) = source {
                nearest[v.index()] = Some(number);
            }
        }
        // Lines begin at vertices that are nearer.
        let mut order: Vec<Vertex> = (0..vertices).map(Vertex::new).collect();
        order.retain(|v| self.distances[v.index()].is_finite());
        order.sort_by(|a, b| self.distances[a.index()].total_cmp(&self.distances[b.index()]));
        // Once, unless edges have no length.
        loop {
            let before = order.len();
            order.retain(|&v| {
                nearest[v.index()] = nearest[v.index()].or_else(|| self.nearest_through(v, &nearest));
                nearest[v.index()].is_none()
            });
            if order.len() == before || order.is_empty() {
                return nearest;
            }
        }
    }

    /// The nearest source of a vertex that is none, once that of those before it on its path is known.
    fn nearest_through(&self, v: Vertex, nearest: &[Option<usize>]) -> Option<usize> {
        let arrival = self.arrivals[v.index()];
        if arrival == Arrival::NONE {
            // It is one place with a vertex that something arrived at.
            return self.joints.others(v).find_map(|other| nearest[other.index()]);
        }
        match Root::decode(arrival.root, nearest.len()) {
            Root::Vertex(root) => nearest[root.index()],
            Root::Source(number) => Some(number as usize),
        }
    }

    /// How many vertices have no finite distance.
    pub fn unreached(&self) -> usize {
        self.distances.iter().filter(|d| d.is_infinite()).count()
    }

    /// What the computation took.
    pub fn report(&self) -> ExactReport {
        self.report
    }
}

/// Exact geodesic distances on a polyhedral surface from the nearest of `sources`.
///
/// Distances are in the unit of the mesh's lengths and exact up to round-off: every one is the length of a
/// path on the surface, and no path is shorter by more than some 1e-12 of it; 1e-10 where angles exceed the full turn
/// by as little, or a source lies that near to a vertex. On triangles of the slenderness s lengths in double
/// precision, hence distances, are uncertain by some 1e-16/s of an edge. Cost: O(n² log n) at worst,
/// about O(n^1.5) on the meshes of practice, on all threads of the current pool, whose number changes no digit; memory a few dozen bytes a face plus the windows of the front,
/// see [`ExactOptions::keep_windows`].
///
/// Sources: Mitchell, Mount and Papadimitriou (1987) for windows and pseudo-sources; Chen and Han (1990) and
/// Xin and Wang (2009) for what vertices rule out; Qin et al. (2016) for crossing faces with whole lists of
/// windows. Lists are kept as exact lower envelopes here, and vertices send windows only into the sector a
/// shortest path can take.
///
/// # Errors
/// If there is no source, a source, target or joined vertex is not on the mesh, faces are so slender that windows multiply
/// without end, or the observer cancels.
pub fn exact_distances<'a>(
    mesh: &'a IntrinsicMesh,
    sources: &[SurfacePoint],
    options: &ExactOptions,
    progress: &dyn Progress,
) -> Result<Geodesics<'a>, GeodesicError> {
    if sources.is_empty() {
        return Err(GeodesicError::NoSource);
    }
    let places = |points: &[SurfacePoint]| -> Result<Vec<Place>, GeodesicError> {
        points.iter().map(|&p| Place::of(mesh, p)).collect()
    };
    let sources = places(sources)?;
    let targets = places(&options.targets)?.into_iter().map(|p| p.as_face_point(mesh)).collect();
    let joints = Joints::new(mesh.vertex_count(), &options.joined)?;
    let mut wavefront = Wavefront::new(mesh, options.radius, targets, options.keep_windows, &joints);
    for (number, source) in sources.iter().enumerate() {
        match *source {
            Place::Vertex(v) => wavefront.add_vertex_source(v),
            Place::Face(point) => wavefront.add_face_source(point, number as u32),
        }
    }
    wavefront.run(progress)?;
    let Wavefront { mut distances, arrivals, bound, kept, report, .. } = wavefront;
    // Beyond the bound distances are only estimates.
    distances.iter_mut().filter(|d| **d > bound).for_each(|d| *d = f64::INFINITY);
    Ok(Geodesics { mesh, sources, distances, arrivals, bound, windows: kept, joints, report })
}
