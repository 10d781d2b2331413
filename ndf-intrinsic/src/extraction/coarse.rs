//! Rounds of splits over the base mesh, in integer coordinates.

use ndf_core::{Progress, Sparingly};
use ndf_mesh::{Edge, FacePoint};
use ndf_model::DisplacementField;

use super::chords::flip_towards_delaunay;
use super::map;
use super::subdivide::Coarse;
use super::{ExtractionError, ExtractionOptions, Work};
use crate::delaunay::{EdgeQueue, Flip, quad_edges};
use crate::intrinsic_mesh::IntrinsicMesh;
use crate::intrinsic_triangulation::IntrinsicTriangulation;
use crate::quad::Quad;

/// Flips may leave no turn with a smaller sine than this on Ω′: chords there do not see slivers of Ω′ come about.
const STRAIGHT: f64 = 1e-3;
/// Rounds halve edges: so many more than that takes are granted. Where g folds or stretches faces of Ω′ many times
/// over, what Ω′ does not let flip may stay long; subdivision takes care of it.
const EXTRA_ROUNDS: usize = 2;

/// A triangulation of Ω′ by geodesics, flipped where chords want it and Ω′ allows it.
struct OverBase<'m>(IntrinsicTriangulation<'m>);

impl Flip for OverBase<'_> {
    fn mesh(&self) -> &IntrinsicMesh {
        self.0.mesh()
    }

    /// The lengths are those of geodesics, not of chords.
    fn is_settled(&self, _edge: Edge) -> bool {
        false
    }

    fn flip(&mut self, edge: Edge, _chord: f64) -> bool {
        let convex = Quad::of(self.mesh(), edge).is_some_and(|quad| quad.is_convex(STRAIGHT));
        convex && self.0.flip(edge).is_ok()
    }
}

/// Splits edges of the mapped base mesh that are longer than its mean edge, rounded up to a power of two times
/// `limit`, or than `limit` itself. So the work is of the order of the base mesh, however fine the result will be.
///
/// Edges stay geodesics of Ω′: they are split in the middle of their course, and flips that Ω′ does not allow are
/// left to later steps. So no triangle is turned over on Ω′, however far the chords' metric is from that of Ω′.
pub(super) fn refine<'f>(
    field: &'f DisplacementField,
    limit: f64,
    options: &ExtractionOptions,
    work: &mut Work,
    progress: &dyn Progress,
) -> Result<Coarse<'f>, ExtractionError> {
    let base = field.base();
    let mut triangulation = OverBase(IntrinsicTriangulation::new(base));
    let mut origins: Vec<FacePoint> = base
        .topology()
        .vertices()
        .map(|v| FacePoint::at_corner(base.topology().vertex_halfedge(v)))
        .collect();
    let mut points = map(field, &origins, progress)?;
    let chord = |mesh: &IntrinsicMesh, points: &[ndf_core::DVec3], e: Edge| {
        let [a, b] = mesh.edge_vertices(e);
        points[a.index()].distance(points[b.index()])
    };
    let mean = base.topology().edges().map(|e| chord(triangulation.mesh(), &points, e)).sum::<f64>()
        / base.topology().edge_count() as f64;
    let limit = limit * (mean / limit).log2().ceil().max(0.0).exp2();

    let mut changed: Vec<Edge> = base.topology().edges().collect();
    let mut rounds_left = usize::MAX;
    loop {
        let mut queue = EdgeQueue::default();
        changed.iter().rev().for_each(|&e| queue.push(e));
        work.chord_flips += flip_towards_delaunay(&mut triangulation, &points, limit, &mut queue, progress)?;

        let mesh = triangulation.mesh();
        let mut long: Vec<(f64, Edge)> = mesh
            .edges()
            .map(|e| (chord(mesh, &points, e), e))
            .filter(|&(length, _)| length > limit)
            .collect();
        let longest = long.iter().map(|&(length, _)| length).fold(0.0, f64::max);
        rounds_left = rounds_left.min((longest / limit).log2().ceil() as usize + EXTRA_ROUNDS);
        if long.is_empty() || rounds_left == 0 {
            break;
        }
        rounds_left -= 1;
        if mesh.face_count() + 2 * long.len() > options.max_faces {
            return Err(ExtractionError::TooManyFaces(options.max_faces));
        }
        // The longest first, by octaves: cutting a face at its longest side keeps its angles (Rivara 1984). Within
        // an octave in order of edges, which is one of space.
        let octave = |length: f64| (length / limit).log2() as i32;
        long.sort_by_key(|&(length, _)| std::cmp::Reverse(octave(length)));
        changed.clear();
        let mut asked = Sparingly::new(progress, 1024);
        for &(_, e) in &long {
            asked.check()?;
            let before = triangulation.mesh().edge_count();
            triangulation.0.split_edge(e, 0.5).expect("the middle is inside");
            changed.push(e);
            changed.extend(triangulation.mesh().edges().skip(before));
        }
        let new = &triangulation.0.coordinates.places[origins.len() - base.vertex_count()..];
        points.extend(map(field, new, progress)?);
        origins.extend_from_slice(new);
        // The sides around the new edges may face other corners now.
        let mesh = triangulation.mesh();
        let inner = changed.iter().filter(|&&e| !mesh.is_boundary_edge(e));
        let outer: Vec<Edge> = inner.flat_map(|&e| quad_edges(mesh, e)).collect();
        changed.extend(outer);
        work.splits += long.len();
        work.rounds += 1;
    }
    work.evaluations += origins.len();
    Ok(Coarse { triangulation: triangulation.0, origins, points })
}
