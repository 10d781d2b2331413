//! Extraction of a manifold Delaunay mesh from a displacement field, at a chosen edge length
//! (Noma et al. 2026; the steps below are this project's).
//!
//! 1. Start from the base mesh Ω′; the length of an edge is that of its chord, `|g(i) − g(j)|`.
//! 2. Split edges longer than 4h/3 in the middle of their course over Ω′, which normal coordinates know; all new
//!    vertices of a round are mapped in one batch. Flip towards Delaunay; repeat.
//! 3. Collapse edges much shorter than h; this makes meshes coarser than Ω′.
//! 4. Relax vertices over Ω′ towards well-shaped triangles, one batch a round, flipping in between.
//! 5. Freeze the lengths and flip to the intrinsic Delaunay triangulation.
//!
//! Chords change under flips of step 2 to 4, so those end only because each improves its own edge and they are
//! limited in number. Step 5 always ends. Every property of the result is computed: see [`ExtractionReport`].

mod chords;
mod coarsen;
mod refine;
mod relax;
mod renumber;
mod report;

use ndf_core::sampling::FaceSample;
use ndf_core::{DVec3, DisplacementField, ManifoldMesh, TriangleMesh};

pub use report::ExtractionReport;

use crate::intrinsic_mesh::{IntrinsicMesh, Mollification};

/// Faces flatter than this, relative to the mean edge, are mollified before the final flips.
const MOLLIFICATION: f64 = 1e-10;

/// What to extract.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExtractionOptions {
    /// h: the edge length wanted, in the normalised box. Edges up to 4h/3 are left alone.
    pub edge_length: f64,
    /// More faces than this are refused.
    pub most_faces: usize,
    /// Rounds of relaxation; 0 leaves vertices where splits put them.
    pub relaxations: usize,
    /// Whether edges much shorter than h are collapsed.
    pub collapse: bool,
}

impl ExtractionOptions {
    /// Triangles with sides of about `edge_length`, well shaped.
    pub fn new(edge_length: f64) -> Self {
        Self { edge_length, most_faces: 50_000_000, relaxations: 3, collapse: true }
    }
}

/// Why nothing was extracted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExtractionError {
    /// The edge length is not a positive number.
    #[error("the edge length must be a positive number, not {0}")]
    EdgeLength(f64),
    /// More faces than asked for at most.
    #[error("this edge length needs more than {0} triangles; ask for a longer one")]
    TooManyFaces(usize),
    /// The network maps a point of the base to NaN or infinity.
    #[error("the field is not finite on base face {0}")]
    NotFinite(u32),
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
    pub origins: Vec<FaceSample>,
    /// What was done, and what is true of the result.
    pub report: ExtractionReport,
}

/// A mesh over Ω′: an intrinsic mesh with chords as lengths, and its vertices' places and images.
struct Surface {
    mesh: IntrinsicMesh,
    origins: Vec<FaceSample>,
    points: Vec<DVec3>,
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
/// If the edge length is not positive, the field is not finite, or more faces than allowed are needed.
pub fn extract(
    field: &DisplacementField,
    options: &ExtractionOptions,
) -> Result<Extraction, ExtractionError> {
    let h = options.edge_length;
    if !(h.is_finite() && h > 0.0) {
        return Err(ExtractionError::EdgeLength(h));
    }
    let mut work = Work::default();
    let mut surface = refine::refine(field, options, &mut work)?;
    surface = renumber::renumber(&surface);
    if options.collapse {
        coarsen::collapse_short(&mut surface, h, &mut work);
    }
    for _ in 0..options.relaxations {
        relax::relax(&mut surface, field, &mut work)?;
        chords::flip_all(&mut surface, &mut work);
    }
    Ok(finish(field, h, surface, work))
}

/// Step 5, and the report.
fn finish(field: &DisplacementField, h: f64, surface: Surface, mut work: Work) -> Extraction {
    let Surface { mesh: chords, origins, points } = surface;
    let mut intrinsic = chords.clone();
    let mollification: Mollification = intrinsic.mollify(MOLLIFICATION);
    let flips = intrinsic.flip_to_delaunay();
    work.intrinsic_flips = flips.flips;
    let embeds_intrinsic = flips.flips == 0 || intrinsic.is_simplicial();
    let embedded = if embeds_intrinsic { &intrinsic } else { &chords };
    let faces = (0..embedded.face_count() as u32).map(|f| embedded.face_vertices(f)).collect();
    let mesh = TriangleMesh::new(points, faces).expect("corners of a complex are its vertices");
    let mesh = ManifoldMesh::try_from(mesh).expect("an oriented simplicial surface is a manifold mesh");
    let report = ExtractionReport::of(field, h, &intrinsic, &mesh, embeds_intrinsic, mollification, work);
    Extraction { intrinsic, mesh, origins, report }
}
