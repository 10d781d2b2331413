//! Rounds of splits over the base mesh, in integer coordinates.

use ndf_core::sampling::FaceSample;
use ndf_core::{DVec3, DisplacementField, SurfacePoint};

use super::chords::{flip_all, flip_towards_delaunay};
use super::{ExtractionError, ExtractionOptions, Surface, Work};
use crate::delaunay::{EdgeQueue, Flip, Quad, quad_edges};
use crate::intrinsic_mesh::IntrinsicMesh;
use crate::intrinsic_triangulation::IntrinsicTriangulation;

/// Edges longer than this many h are split: their halves are then about as far below h as they were above.
const LONG: f64 = 4.0 / 3.0;
/// Flips may leave no turn with a smaller sine than this on Ω′: chords there do not see slivers of Ω′ come about.
const STRAIGHT: f64 = 1e-3;
/// Rounds halve edges: so many more than that takes are granted. Where g folds or stretches faces of Ω′ many times
/// over, chords of slivers may stay long for ever; the report says how long.
const EXTRA_ROUNDS: usize = 4;

/// A triangulation of Ω′ by geodesics, flipped where chords want it and Ω′ allows it.
struct OverBase<'m>(IntrinsicTriangulation<'m>);

impl Flip for OverBase<'_> {
    fn mesh(&self) -> &IntrinsicMesh {
        self.0.mesh()
    }

    fn flip(&mut self, edge: u32, _chord: f64) -> bool {
        let convex = Quad::of(self.mesh(), edge).is_some_and(|quad| quad.is_convex(STRAIGHT));
        convex && self.0.flip(edge).is_ok()
    }
}

/// Splits edges of the mapped base mesh until none is longer than 4h/3.
///
/// Edges stay geodesics of Ω′: they are split in the middle of their course, and flips that Ω′ does not allow are
/// left to later steps. So no triangle is turned over on Ω′, however far the chords' metric is from that of Ω′.
pub(super) fn refine(
    field: &DisplacementField,
    options: &ExtractionOptions,
    work: &mut Work,
) -> Result<Surface, ExtractionError> {
    let base = field.base();
    let mut triangulation = OverBase(IntrinsicTriangulation::new(base));
    let mut origins: Vec<FaceSample> = (0..base.vertex_count() as u32)
        .map(|v| {
            let (face, barycentric) = SurfacePoint::Vertex(v).in_some_face(base);
            FaceSample { face, barycentric }
        })
        .collect();
    let mut points = map(field, &origins, work)?;
    let limit = LONG * options.edge_length;
    let mut changed: Vec<u32> = (0..base.edge_count() as u32).collect();
    let mut rounds_left = usize::MAX;
    loop {
        let mut queue = EdgeQueue::default();
        changed.iter().rev().for_each(|&e| queue.push(e));
        work.chord_flips += flip_towards_delaunay(&mut triangulation, &points, limit, &mut queue);

        let mesh = triangulation.mesh();
        let chord = |e: u32| {
            let [a, b] = mesh.edge_vertices(e);
            points[a as usize].distance(points[b as usize])
        };
        let mut long: Vec<(f64, u32)> = (0..mesh.edge_count() as u32)
            .map(|e| (chord(e), e))
            .filter(|&(length, _)| length > limit)
            .collect();
        let longest = long.iter().map(|&(length, _)| length).fold(0.0, f64::max);
        rounds_left = rounds_left.min((longest / limit).log2().ceil() as usize + EXTRA_ROUNDS);
        if long.is_empty() || rounds_left == 0 {
            break;
        }
        rounds_left -= 1;
        if mesh.face_count() + 2 * long.len() > options.most_faces {
            return Err(ExtractionError::TooManyFaces(options.most_faces));
        }
        // The longest first, by octaves: cutting a face at its longest side keeps its angles (Rivara 1984). Within
        // an octave in order of edges, which is one of space.
        let octave = |length: f64| (length / limit).log2() as i32;
        long.sort_by_key(|&(length, _)| std::cmp::Reverse(octave(length)));
        changed.clear();
        for &(_, e) in &long {
            let before = triangulation.mesh().edge_count() as u32;
            triangulation.0.split_edge(e, 0.5).expect("the middle is inside");
            changed.push(e);
            changed.extend(before..triangulation.mesh().edge_count() as u32);
        }
        let new = &triangulation.0.coordinates.places[origins.len() - base.vertex_count()..];
        points.extend(map(field, new, work)?);
        origins.extend_from_slice(new);
        // The sides around the new edges may face other corners now.
        let mesh = triangulation.mesh();
        let inner = changed.iter().filter(|&&e| !mesh.is_boundary_edge(e));
        let outer: Vec<u32> = inner.flat_map(|&e| quad_edges(mesh, e)).collect();
        changed.extend(outer);
        work.splits += long.len();
        work.rounds += 1;
    }
    let mut surface = Surface { mesh: triangulation.0.into_mesh(), origins, points };
    flip_all(&mut surface, work);
    Ok(surface)
}

/// g at every place.
pub(super) fn map(
    field: &DisplacementField,
    places: &[FaceSample],
    work: &mut Work,
) -> Result<Vec<DVec3>, ExtractionError> {
    work.evaluations += places.len();
    let points = field.map(places);
    match points.iter().position(|p| !p.is_finite()) {
        Some(i) => Err(ExtractionError::NotFinite(places[i].face)),
        None => Ok(points),
    }
}
