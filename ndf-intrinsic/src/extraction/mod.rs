//! Extraction of a manifold Delaunay mesh from a displacement field, at a chosen edge length
//! (Noma et al. 2026; the steps below are this project's).
//!
//! 1. Start from the base mesh Ω′; the length of an edge is that of its chord, `|g(i) − g(j)|`.
//! 2. Halve long edges in the middle of their course over Ω′, which normal coordinates know, and flip towards
//!    Delaunay, until edges are near the base mesh's or near h.
//! 3. Cut what that gives by template, over all threads, until no edge is longer than 4h/3: points between corners
//!    of a face lie in the face. All new vertices of a round are mapped in one batch.
//! 4. Flip towards Delaunay; collapse edges much shorter than h; this makes meshes coarser than Ω′.
//! 5. Relax vertices over Ω′ towards well-shaped triangles, flipping in between.
//! 6. Freeze the lengths and flip to the intrinsic Delaunay triangulation.
//!
//! Chords change under flips of steps 2 to 5, so those end only because each improves its own edge and they are
//! limited in number. Step 6 always ends. Every property of the result is computed: see [`ExtractionReport`].

mod chords;
mod coarse;
mod coarsen;
mod curve;
mod relax;
mod report;
mod subdivide;
mod templates;
pub mod tessellation;

use ndf_core::{Cancelled, DVec3, Progress};
use ndf_mesh::{Edge, Face, FacePoint, Halfedge, ManifoldMesh, Topology, TriangleMesh};
use ndf_model::DisplacementField;
use rayon::prelude::*;

pub use report::ExtractionReport;

use report::IntrinsicFigures;

use crate::delaunay::{flip_to_delaunay, violating};
use crate::intrinsic_mesh::{IntrinsicMesh, Mollification};
use crate::intrinsic_triangulation::MOLLIFICATION;

/// Edges longer than this many h are split: their halves are then about as far below h as they were above.
const LONG: f64 = 4.0 / 3.0;

/// What to extract.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExtractionOptions {
    /// h: the edge length wanted, in the normalised box. Edges up to 4h/3 are left alone.
    pub edge_length: f64,
    /// More faces than this are refused.
    pub max_faces: usize,
    /// Rounds of relaxation; 0 leaves vertices where splits put them.
    pub relaxations: usize,
    /// Whether edges much shorter than h are collapsed.
    pub collapse: bool,
}

impl ExtractionOptions {
    /// Triangles with sides of about `edge_length`, well shaped.
    pub fn new(edge_length: f64) -> Self {
        Self { edge_length, max_faces: 50_000_000, relaxations: 2, collapse: true }
    }
}

/// Why nothing was extracted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExtractionError {
    /// The edge length is not a positive number.
    #[error("the edge length must be a positive number, not {0}")]
    EdgeLength(f64),
    /// More faces than asked for at most.
    #[error("this edge length needs more than {0} triangles; choose a longer one")]
    TooManyFaces(usize),
    /// The network maps a point of the base to NaN or infinity.
    #[error("the field is not finite on base face {0}")]
    NotFinite(Face),
    /// The observer asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// An extracted surface, in the normalised box.
#[derive(Clone, Debug)]
pub struct Extraction {
    /// The intrinsic Delaunay triangulation: connectivity and lengths.
    pub intrinsic: IntrinsicMesh,
    /// The embedded mesh, over the same vertices. Its faces are those of the intrinsic triangulation where
    /// [that is simplicial](ExtractionReport::embeds_intrinsic), else those it had before the final flips.
    pub mesh: ManifoldMesh,
    /// Where on the base mesh every vertex lies.
    pub origins: Vec<FacePoint>,
    /// What was done, and what is true of the result.
    pub report: ExtractionReport,
}

/// A mesh over Ω′: an intrinsic mesh with chords as lengths, and its vertices' places and images.
struct ChordMesh {
    mesh: IntrinsicMesh,
    origins: Vec<FacePoint>,
    points: Vec<DVec3>,
}

impl ChordMesh {
    /// Makes all edges as long as their chords.
    fn measure(&mut self) {
        let Self { mesh, points, .. } = self;
        let IntrinsicMesh { topology, lengths } = mesh;
        let chord = |(length, e): (&mut f64, Edge)| {
            let [a, b] = topology.edge_vertices(e);
            *length = points[a.index()].distance(points[b.index()]);
        };
        lengths.par_iter_mut().zip(topology.par_edges()).with_min_len(4096).for_each(chord);
    }
}

/// Counts of what was done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Work {
    pub(crate) rounds: usize,
    pub(crate) splits: usize,
    pub(crate) collapses: usize,
    pub(crate) chord_flips: usize,
    pub(crate) intrinsic_flips: usize,
    pub(crate) evaluations: usize,
}

/// Extracts a mesh of the learned surface. O(n log n) for n faces.
///
/// # Errors
/// If the edge length is not positive, the field is not finite, more faces than allowed are needed, or the work is
/// cancelled.
pub fn extract(
    field: &DisplacementField,
    options: &ExtractionOptions,
    progress: &dyn Progress,
) -> Result<Extraction, ExtractionError> {
    let h = options.edge_length;
    if !(h.is_finite() && h > 0.0) {
        return Err(ExtractionError::EdgeLength(h));
    }
    let mut work = Work::default();
    let limit = LONG * h;
    // Each round of relaxation takes about as long as each step before.
    let steps = (3 + options.relaxations) as f64;
    let begin = |step: usize| {
        progress.report("extraction", step as f64 / steps);
        progress.check()
    };
    begin(0)?;
    let coarse = coarse::refine(field, limit, options, &mut work, progress)?;
    begin(1)?;
    let mut surface = subdivide::subdivide(field, coarse, limit, options, &mut work, progress)?;
    begin(2)?;
    chords::flip_all(&mut surface, &mut work, progress)?;
    if options.collapse {
        coarsen::collapse_short(&mut surface, h, &mut work, progress)?;
    }
    for round in 0..options.relaxations {
        begin(3 + round)?;
        relax::relax(&mut surface, field, h, &mut work, progress)?;
        chords::flip_all(&mut surface, &mut work, progress)?;
    }
    progress.report("extraction", 1.0);
    Ok(finish(field, h, surface, work, progress)?)
}

/// Step 6, and the report.
fn finish(
    field: &DisplacementField,
    h: f64,
    surface: ChordMesh,
    mut work: Work,
    progress: &dyn Progress,
) -> Result<Extraction, Cancelled> {
    progress.check()?;
    let ChordMesh { mesh: chords, origins, points } = surface;
    let mut intrinsic = chords;
    let mollification: Mollification = intrinsic.mollify(MOLLIFICATION);
    let mut queue = violating(&intrinsic);
    let before = (!queue.is_empty()).then(|| intrinsic.topology().clone());
    work.intrinsic_flips = flip_to_delaunay(&mut intrinsic, &mut queue, |_, _| {}).flips;
    progress.check()?;
    let before = before.filter(|_| !intrinsic.is_simplicial());
    let embeds_intrinsic = before.is_none();
    let (mesh, metric) = rayon::join(
        || embedded(before.as_ref().unwrap_or(intrinsic.topology()), points),
        || IntrinsicFigures::of(&intrinsic, mollification),
    );
    progress.check()?;
    let report = ExtractionReport::of(field, h, &intrinsic, &mesh, embeds_intrinsic, metric, work);
    Ok(Extraction { intrinsic, mesh, origins, report })
}

/// The mesh of a simplicial complex and its vertices.
fn embedded(topology: &Topology<u32>, points: Vec<DVec3>) -> ManifoldMesh {
    let faces = topology.par_faces().map(|f| topology.face_vertices(f).map(u32::from)).collect();
    let twins: Vec<Halfedge> = topology.par_halfedges().map(|h| topology.raw_twin(h)).collect();
    let mesh = TriangleMesh::new(points, faces).expect("corners of a topology are its vertices");
    ManifoldMesh::with_twins(mesh, &twins).expect("an oriented simplicial surface is a manifold mesh")
}

/// Places mapped between two questions whether to stop.
const ASKED: usize = 1 << 16;

/// g at every place.
fn map(
    field: &DisplacementField,
    places: &[FacePoint],
    progress: &dyn Progress,
) -> Result<Vec<DVec3>, ExtractionError> {
    let mut points = Vec::with_capacity(places.len());
    for places in places.chunks(ASKED) {
        progress.check()?;
        points.extend(field.map(places));
    }
    match points.par_iter().position_first(|p| !p.is_finite()) {
        Some(i) => Err(ExtractionError::NotFinite(places[i].face)),
        None => Ok(points),
    }
}
