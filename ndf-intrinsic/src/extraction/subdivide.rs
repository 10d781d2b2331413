//! Rounds of splits inside the faces of a coarse triangulation, over all threads.
//!
//! Every edge whose chord is too long is halved and its faces are cut by [template](super::templates): no edge is
//! followed over Ω′, since the middle of two points of a coarse face lies in that face. All that a thread needs
//! to know of other faces is whether they halve a side as well, and that is a matter of the side alone.

use ndf_core::{DVec3, Progress};
use ndf_mesh::halfedge::numbers;
use ndf_mesh::{Face, FacePoint, Halfedge, NO_HALFEDGE, Topology, Vertex};
use ndf_model::DisplacementField;
use rayon::prelude::*;

use super::curve::curve_order;
use super::map;
use super::templates::{Gluing, Templates};
use super::{ChordMesh, ExtractionError, ExtractionOptions, Work};
use crate::intrinsic_mesh::IntrinsicMesh;
use crate::intrinsic_triangulation::IntrinsicTriangulation;
use crate::locating::FaceLayout;

/// Rounds halve edges: so many more than that takes are granted, for spots that g stretches. Where it folds an edge
/// so that its ends come near each other, the edge stays whole however far its middle is away, and the faces on it
/// become ever flatter: further rounds would go on without end. Flips and collapses clear such spots.
const EXTRA_ROUNDS: usize = 4;
/// From so many faces on, it is asked how many there will be before they are made.
const FORETOLD: usize = 1 << 20;
/// Places are exact for so many rounds.
const MOST_ROUNDS: usize = 22;

/// Stands for the missing twin of a half-edge of a piece on the boundary.
const NO_TWIN: u32 = NO_HALFEDGE.0;

/// A point of a coarse face: its second and third barycentric coordinate, multiples of a power of ½ and so exact.
type Place = [f32; 2];

/// A triangle, where it lies in its coarse face, and how it is cut: 64 bytes.
#[derive(Clone, Copy, Debug, Default)]
struct Piece {
    corners: [u32; 3],
    /// What its half-edges are glued to: half-edges `3 piece + corner` or [`NO_TWIN`].
    twins: [u32; 3],
    /// The coarse face, by its rank along the curve that orders them.
    coarse: u32,
    places: [Place; 3],
    /// A bit for each side that is halved; none for what stays.
    halved: u8,
    /// Those of them of which this piece numbers the middle: of two half-edges the lower does.
    owned: u8,
    /// Which of two diagonals cuts the quad that is left where two sides are halved.
    other: bool,
    first_child: u32,
    first_vertex: u32,
}

impl Piece {
    /// Decides which sides are halved. Both faces of a side decide alike, to the last bit.
    fn plan(&mut self, number: u32, points: &[DVec3], squared_limit: f64) {
        let p = self.corners.map(|v| points[v as usize]);
        let squared = [0, 1, 2].map(|c| p[c].distance_squared(p[(c + 1) % 3]));
        for c in 0..3 {
            let long = squared[c] > squared_limit;
            self.halved |= u8::from(long) << c;
            self.owned |= u8::from(long && 3 * number + (c as u32) < self.twins[c]) << c;
        }
        // The median of a longer side is shorter.
        let whole = (!self.halved & 7).trailing_zeros() as usize;
        self.other = self.halved.count_ones() == 2 && squared[(whole + 1) % 3] < squared[(whole + 2) % 3];
    }
}

/// A coarse triangulation, and where its vertices lie and are mapped to.
pub(super) struct Coarse<'m> {
    pub(super) triangulation: IntrinsicTriangulation<'m>,
    pub(super) origins: Vec<FacePoint>,
    pub(super) points: Vec<DVec3>,
}

/// Halves edges until none is longer than `limit`. Vertices, edges and faces of the result are numbered along the
/// coarse faces, and these along a curve that fills space: what is near on the surface is near in memory.
/// O(n log n).
pub(super) fn subdivide(
    field: &DisplacementField,
    coarse: Coarse<'_>,
    limit: f64,
    options: &ExtractionOptions,
    work: &mut Work,
    progress: &dyn Progress,
) -> Result<ChordMesh, ExtractionError> {
    let Coarse { triangulation, mut origins, mut points } = coarse;
    let order = curve_order(triangulation.mesh(), &points);
    let mut forest = Forest::of(triangulation.mesh(), &order);
    let mut layouts = Vec::new();
    let needed = (forest.longest(&points) / limit).log2().ceil().max(0.0) as usize;
    for _ in 0..needed.saturating_add(EXTRA_ROUNDS).min(MOST_ROUNDS) {
        progress.check()?;
        let Some(growth) = forest.plan(&points, limit) else { break };
        let is_many = growth.leaves > FORETOLD;
        if growth.leaves > options.max_faces
            || is_many && forest.foretold(&points, limit) > options.max_faces as f64
        {
            return Err(ExtractionError::TooManyFaces(options.max_faces));
        }
        if layouts.is_empty() {
            // What the first round leaves whole has no long side and stays so.
            let layout = |(piece, &f): (&Piece, &Face)| {
                (piece.halved != 0)
                    .then(|| FaceLayout::of(&triangulation.coordinates, &triangulation.base, f))
            };
            layouts = forest.last().0.par_iter().zip(&order).map(layout).collect();
        }
        progress.check()?;
        let new = forest.places(&layouts);
        points.extend(map(field, &new, progress)?);
        work.evaluations += new.len();
        origins.extend(new);
        forest.cut();
        work.splits += growth.vertices;
        work.rounds += 1;
    }
    progress.check()?;
    Ok(forest.assemble(&origins, &points))
}

/// What a round adds.
struct Growth {
    vertices: usize,
    /// Faces afterwards.
    leaves: usize,
}

/// The coarse faces, and what they are cut into. A piece without long side is a leaf for good.
///
/// Pieces are numbered level by level. A side that is halved has both its faces in the last level: only sides that
/// stay lead to older ones, which are leaves.
struct Forest {
    levels: Vec<Vec<Piece>>,
    /// The number of the first piece of every level.
    starts: Vec<u32>,
    leaves: usize,
    /// The coarse face each vertex was found in.
    vertex_faces: Vec<u32>,
    templates: Templates,
}

impl Forest {
    fn of(mesh: &IntrinsicMesh, order: &[Face]) -> Self {
        let ranks = numbers(order, order.len());
        let rank = |h: Halfedge| 3 * ranks[h.face().index()] + h.corner() as u32;
        let piece = |(&f, coarse): (&Face, u32)| Piece {
            corners: mesh.face_vertices(f).map(u32::from),
            twins: f.halfedges().map(|h| mesh.twin(h).map_or(NO_TWIN, rank)),
            coarse,
            places: [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
            ..Piece::default()
        };
        let pieces: Vec<Piece> = order.iter().zip(0..).map(piece).collect();
        let vertex_faces = mesh.vertices().map(|v| ranks[mesh.vertex_halfedge(v).face().index()]).collect();
        let leaves = pieces.len();
        Self { levels: vec![pieces], starts: vec![0], leaves, vertex_faces, templates: Templates::new() }
    }

    /// The level that may be cut, and the number of its first piece.
    fn last(&self) -> (&[Piece], u32) {
        (&self.levels[self.levels.len() - 1], self.starts[self.starts.len() - 1])
    }

    fn piece(&self, number: u32) -> &Piece {
        let level = self.starts.partition_point(|&start| start <= number) - 1;
        &self.levels[level][(number - self.starts[level]) as usize]
    }

    /// The longest side of the pieces of the last level.
    fn longest(&self, points: &[DVec3]) -> f64 {
        let longest = |piece: &Piece| {
            let [a, b, c] = piece.corners.map(|v| points[v as usize]);
            a.distance(b).max(b.distance(c)).max(c.distance(a))
        };
        self.last().0.par_iter().map(longest).reduce(|| 0.0, f64::max)
    }

    /// How many faces the last level would be cut into at least if its pieces were flat. Templates halve all sides that are
    /// long: a piece falls into as many as its two shorter sides have parts, whatever its area.
    fn foretold(&self, points: &[DVec3], limit: f64) -> f64 {
        let parts = |piece: &Piece| {
            let [a, b, c] = piece.corners.map(|v| points[v as usize]);
            let mut sides = [a.distance(b), b.distance(c), c.distance(a)];
            sides.sort_by(f64::total_cmp);
            (sides[0] / limit).max(1.0) * (sides[1] / limit).max(1.0)
        };
        self.last().0.par_iter().map(parts).sum()
    }

    /// Decides how the pieces of the last level are cut, and numbers what comes about; `None` if nothing does.
    fn plan(&mut self, points: &[DVec3], limit: f64) -> Option<Growth> {
        let first = self.last().1;
        let level = self.levels.last_mut().expect("the coarse faces are a level");
        let mut children = first + level.len() as u32;
        level
            .par_iter_mut()
            .zip(first..children)
            .with_min_len(1024)
            .for_each(|(piece, number)| piece.plan(number, points, limit * limit));
        for piece in level.iter_mut().filter(|piece| piece.halved != 0) {
            (piece.first_child, piece.first_vertex) = (children, self.vertex_faces.len() as u32);
            children += 1 + piece.halved.count_ones();
            self.leaves += piece.halved.count_ones() as usize;
            self.vertex_faces.extend((0..piece.owned.count_ones()).map(|_| piece.coarse));
        }
        let vertices = self.vertex_faces.len() - points.len();
        (vertices > 0).then_some(Growth { vertices, leaves: self.leaves })
    }

    /// Where the new vertices lie on Ω′.
    fn places(&self, layouts: &[Option<FaceLayout>]) -> Vec<FacePoint> {
        let in_piece = |piece: &Piece, c: usize| {
            let [b, c] = middle(piece.places[c], piece.places[(c + 1) % 3]).map(f64::from);
            let layout = layouts[piece.coarse as usize].as_ref();
            layout.expect("only faces with long sides are cut").locate([1.0 - b - c, b, c]).place
        };
        let owned: Vec<(u32, u8)> = (0..)
            .zip(self.last().0)
            .flat_map(|(k, piece)| (0..3).filter(|c| piece.owned >> c & 1 != 0).map(move |c| (k, c)))
            .collect();
        let level = self.last().0;
        owned
            .into_par_iter()
            .with_min_len(256)
            .map(|(k, c)| in_piece(&level[k as usize], c as usize))
            .collect()
    }

    /// The vertex in the middle of a side that is halved.
    fn middle_vertex(&self, halfedge: u32, twin: u32) -> u32 {
        let (level, first) = self.last();
        let owner = halfedge.min(twin);
        let piece = &level[(owner / 3 - first) as usize];
        piece.first_vertex + (piece.owned & ((1 << (owner % 3)) - 1)).count_ones()
    }

    /// The half-edge along a part of a half-edge after the cut.
    fn part_of(&self, halfedge: u32, part: u8) -> u32 {
        let (level, first) = self.last();
        match (halfedge / 3).checked_sub(first).map(|k| &level[k as usize]) {
            Some(piece) if piece.halved != 0 => {
                let along = self.templates.get(piece.halved, piece.other).along[halfedge as usize % 3];
                3 * piece.first_child + u32::from(along[part as usize])
            }
            _ => halfedge,
        }
    }

    /// Cuts the pieces of the last level as planned; the children are the next.
    fn cut(&mut self) {
        let this = &*self;
        let (level, first) = this.last();
        let parents: Vec<(u32, u8)> = (first..)
            .zip(level)
            .filter(|(_, piece)| piece.halved != 0)
            .flat_map(|(number, piece)| (0..=piece.halved.count_ones() as u8).map(move |k| (number, k)))
            .collect();
        let children: Vec<Piece> =
            parents.into_par_iter().with_min_len(256).map(|(number, k)| this.child(number, k)).collect();
        // Leaves that are glued to a child now.
        let seams: Vec<[u32; 2]> = level
            .par_iter()
            .zip(first..first + level.len() as u32)
            .with_min_len(1024)
            .flat_map_iter(|(piece, number)| {
                let whole = (0..3).filter(move |side| piece.halved != 0 && piece.halved >> side & 1 == 0);
                whole.filter_map(move |side| {
                    let across = piece.twins[side as usize];
                    let is_leaf = across != NO_TWIN && this.part_of(across, 0) == across;
                    is_leaf.then(|| [across, this.part_of(3 * number + side, 0)])
                })
            })
            .collect();
        let start = first + level.len() as u32;
        for [leaf, child] in seams {
            let number = leaf / 3;
            let level = self.starts.partition_point(|&start| start <= number) - 1;
            let piece = &mut self.levels[level][(number - self.starts[level]) as usize];
            piece.twins[leaf as usize % 3] = child;
        }
        self.starts.push(start);
        self.levels.push(children);
    }

    /// Child `k` of a piece of the last level.
    fn child(&self, number: u32, k: u8) -> Piece {
        let (level, first) = self.last();
        let piece = &level[(number - first) as usize];
        let template = self.templates.get(piece.halved, piece.other);
        let child = template.pieces[k as usize];
        let corner = |point: u8| match point.checked_sub(3) {
            None => piece.corners[point as usize],
            Some(side) => self.middle_vertex(3 * number + u32::from(side), piece.twins[side as usize]),
        };
        let place = |point: u8| match point.checked_sub(3) {
            None => piece.places[point as usize],
            Some(side) => middle(piece.places[side as usize], piece.places[(side as usize + 1) % 3]),
        };
        let twin = |c: usize| match template.gluing[3 * k as usize + c] {
            Gluing::Inside(h) => 3 * piece.first_child + u32::from(h),
            Gluing::Outside { side, part } => match piece.twins[side as usize] {
                NO_TWIN => NO_TWIN,
                across => self.part_of(across, if piece.halved >> side & 1 != 0 { 1 - part } else { 0 }),
            },
        };
        Piece {
            corners: child.map(corner),
            twins: [0, 1, 2].map(twin),
            coarse: piece.coarse,
            places: child.map(place),
            ..Piece::default()
        }
    }

    /// A surface of the leaves.
    fn assemble(&self, origins: &[FacePoint], points: &[DVec3]) -> ChordMesh {
        let pieces = || self.levels.iter().flatten();
        let ((leaves, new_face), (vertices, new_vertex)) = rayon::join(
            || {
                let leaves = by_bucket(pieces().map(|p| (p.halved == 0).then_some(p.coarse)));
                let numbers = numbers(&leaves, pieces().count());
                (leaves, numbers)
            },
            || {
                let vertices = by_bucket(self.vertex_faces.iter().map(|&f| Some(f)));
                let numbers = numbers(&vertices, points.len());
                (vertices, numbers)
            },
        );
        let new_halfedge =
            |h: u32| Halfedge(if h == NO_TWIN { h } else { 3 * new_face[h as usize / 3] + h % 3 });
        let gluing = leaves.par_iter().with_min_len(1024).flat_map_iter(|&number| {
            let piece = self.piece(number);
            [0, 1, 2].map(|c| (Vertex(new_vertex[piece.corners[c] as usize]), new_halfedge(piece.twins[c])))
        });
        let (topology, (origins, points)) = rayon::join(
            || Topology::from_trusted_gluing(points.len(), gluing),
            || {
                let origins = vertices.iter().map(|&v| origins[v as usize]).collect();
                let points = vertices.iter().map(|&v| points[v as usize]).collect();
                (origins, points)
            },
        );
        ChordMesh {
            mesh: IntrinsicMesh { lengths: vec![0.0; topology.edge_count()], topology },
            origins,
            points,
        }
    }
}

fn middle(a: Place, b: Place) -> Place {
    [0, 1].map(|k| f32::midpoint(a[k], b[k]))
}

/// The items that have a bucket, by bucket and then by number (a counting sort).
fn by_bucket(buckets: impl Iterator<Item = Option<u32>> + Clone) -> Vec<u32> {
    let mut starts = Vec::new();
    for bucket in buckets.clone().flatten() {
        if bucket as usize + 2 > starts.len() {
            starts.resize(bucket as usize + 2, 0);
        }
        starts[bucket as usize + 1] += 1;
    }
    let mut total = 0;
    for start in &mut starts {
        total += *start;
        *start = total;
    }
    let mut sorted = vec![0; total as usize];
    for (item, bucket) in (0..).zip(buckets) {
        if let Some(bucket) = bucket {
            let start = &mut starts[bucket as usize];
            sorted[*start as usize] = item;
            *start += 1;
        }
    }
    sorted
}
