//! Signed distance to curves by heat (Feng and Crane 2024, "A Heat Method for Generalized Signed Distance").
//!
//! The normals of the curves diffuse for a short time, as vectors at the middles of edges; made unit, they point away from the nearest
//! piece of a curve, to its right; the function whose gradient fits them best is the signed distance. Curves may have gaps: the
//! normals on both sides of one agree, and the sign continues over it.

mod curves;
mod edge_fields;

use ndf_core::Progress;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{SurfacePoint, Vertex};
use ndf_spectral::{CsrMatrix, LaplaceBeltrami, Mass, MetricTriangles, SymbolicCholesky};
use num_complex::Complex64;

use crate::error::FieldError;
use crate::faces::{Layout, direction_in_face, unit, weak_divergence};
use crate::points::in_faces;
use crate::reach::is_underflow;
pub use curves::joined_curve;
use curves::{Piece, along, pieces};
use edge_fields::{EdgeDiffusion, add, sum};

/// Faces without area are widened by this fraction of the mean edge length: cotangents must be finite.
const MOLLIFICATION: f64 = 1e-8;

/// How strongly sources are held at zero, beside the weights of the Laplacian, which are about 1.
const HOLD: f64 = 1e8;

/// What is zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ZeroSet {
    /// Every point by which a curve is given: the distance of curves that are right.
    #[default]
    Curves,
    /// The mean over all curves of a component: curves that are noisy, or steps of edges, are smoothed.
    Mean,
}

/// How signed distances are measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignedHeatOptions {
    /// How long normals diffuse, in squared mean edge lengths. The authors take 1/4, the square of the distance between middles of edges.
    pub time: f64,
    /// What is zero.
    pub zero_set: ZeroSet,
}

impl Default for SignedHeatOptions {
    fn default() -> Self {
        Self { time: 0.25, zero_set: ZeroSet::default() }
    }
}

/// Signed distances from curves.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SignedDistances {
    /// Of every vertex, in the unit of the mesh's lengths: negative to the left of the curves, and so inside a loop that runs
    /// counter-clockwise. +∞ on components without a source.
    pub values: Vec<f64>,
    /// Vertices of components with a source that heat does not reach in double precision, whose distances are wrong: a larger time
    /// reaches farther, in proportion to its root.
    pub out_of_reach: usize,
    /// The length of all curves.
    pub curve_length: f64,
}

/// Signed distances of all vertices from oriented curves, approximate as those of the heat method are. Curves are polylines of which each
/// two points that follow each other are in one face; a closed one ends where it begins, and they may be open, broken and on the
/// boundary. Where curves do not part the surface, the distance is the generalised one of the paper: it falls to zero across what is
/// missing. `points` are vertices whose distance is unsigned; where they are nearest, values are positive.
///
/// Works on the Delaunay triangulation around the curves: edges that a curve runs along and faces that it crosses stay as they are. One
/// complex factorisation of as many rows as there are edges, and one of V. No boundary needs anything: nothing flows over it.
///
/// # Errors
/// If there is no source, one is not on the mesh, a curve leaves its faces, the time is not positive, a matrix is not positive definite
/// to double precision, or the observer asks to stop.
pub fn signed_distances(
    mesh: &IntrinsicMesh,
    curves: &[Vec<SurfacePoint>],
    points: &[Vertex],
    options: &SignedHeatOptions,
    progress: &dyn Progress,
) -> Result<SignedDistances, FieldError> {
    let mut parts = Vec::new();
    for (number, curve) in curves.iter().enumerate() {
        parts.extend(pieces(mesh, number, curve)?);
    }
    if let Some(&v) = points.iter().find(|v| v.index() >= mesh.vertex_count()) {
        return Err(FieldError::NotOnMesh { point: SurfacePoint::Vertex(v) });
    }
    if parts.is_empty() && points.is_empty() {
        return Err(FieldError::NoSource);
    }
    let mut nodes: Vec<Node> = points.iter().map(|&v| vec![(v, 1.0)]).collect();
    for &point in curves.iter().flatten() {
        nodes.extend(in_faces(mesh, point)?.first().map(|point| {
            let corners = mesh.face_vertices(point.face).into_iter().zip(point.barycentric);
            corners.filter(|(_, weight)| *weight != 0.0).collect()
        }));
    }
    let mut mesh = mesh.clone();
    mesh.mollify(MOLLIFICATION);
    mesh.flip_to_delaunay_around(&held(&mesh, &parts));
    let mean = mesh.lengths().iter().sum::<f64>() / mesh.edge_count().max(1) as f64;
    let time = options.time * mean * mean;
    if !(time > 0.0 && time.is_finite()) {
        return Err(FieldError::NotPositive { name: "the time step", value: time });
    }
    progress.report("factoring", 0.0);
    let field = EdgeDiffusion::new(&mesh, time)?.of(&normals(&mesh, &parts, points, mean));
    progress.check()?;
    progress.report("factoring", 0.7);
    let operator = LaplaceBeltrami::from_lengths(&MetricTriangles::from(&mesh), Mass::Barycentric)?;
    let labels = operator.components().labels();
    let mut sources = vec![false; operator.components().count()];
    nodes.iter().flatten().for_each(|(v, _)| sources[labels[v.index()] as usize] = true);
    let has_source = |v: Vertex| sources[labels[v.index()] as usize];
    let out_of_reach = out_of_reach(&mesh, &field, has_source);
    let vectors: Vec<Complex64> = mesh.faces().map(|face| unit(sum(&mesh, &field, face))).collect();
    let mut values = weak_divergence(&mesh, &vectors);
    let matrix = match options.zero_set {
        ZeroSet::Curves => holding(&operator, &nodes, &sources),
        ZeroSet::Mean => operator.grounded(),
    };
    SymbolicCholesky::new(&matrix)?.cholesky(&matrix)?.solve(&mut [&mut values]);
    match options.zero_set {
        ZeroSet::Curves => {
            for node in nodes.iter().filter(|node| node.len() == 1) {
                values[node[0].0.index()] = 0.0;
            }
        }
        ZeroSet::Mean => shift(&mesh, &mut values, &parts, &nodes, labels, sources.len()),
    }
    for v in mesh.vertices().filter(|&v| !has_source(v)) {
        values[v.index()] = f64::INFINITY;
    }
    let curve_length = parts.iter().map(|piece| piece.length(&mesh)).sum();
    Ok(SignedDistances { values, out_of_reach, curve_length })
}

/// A point that a curve is given by, as weights of vertices.
type Node = Vec<(Vertex, f64)>;

/// Which edges stay: those that a curve runs along, and those of faces that it crosses.
fn held(mesh: &IntrinsicMesh, parts: &[Piece]) -> Vec<bool> {
    let mut held = vec![false; mesh.edge_count()];
    for piece in parts {
        match *piece {
            Piece::Edge { edge, .. } => held[edge.index()] = true,
            Piece::Face([point, _]) => {
                mesh.face_edges(point.face).iter().for_each(|e| held[e.index()] = true);
            }
        }
    }
    held
}

/// The normals to the right of the curves, and those away from the points, times lengths: what diffuses.
fn normals(mesh: &IntrinsicMesh, parts: &[Piece], points: &[Vertex], radius: f64) -> Vec<Complex64> {
    let right = -Complex64::i();
    let mut field = vec![Complex64::default(); mesh.edge_count()];
    for piece in parts {
        match *piece {
            Piece::Edge { edge, from, to } => {
                field[edge.index()] += right * (to - from) * mesh.length(edge);
            }
            Piece::Face(ends) => {
                let face = ends[0].face;
                let normal = right * along(&Layout::of(mesh, face), ends);
                add(mesh, &mut field, face, [normal / 3.0; 3]);
            }
        }
    }
    for &v in points {
        let scale = radius / mesh.angle_sum(v);
        for h in mesh.outgoing(v) {
            // ∫ e^{iθ} dθ over the corner.
            let outward = (Complex64::cis(mesh.corner_angle(h)) - 1.0) * right * scale;
            let turned = outward * Complex64::cis(direction_in_face(mesh, h));
            add(mesh, &mut field, h.face(), [turned; 3]);
        }
    }
    field
}

/// Vertices of components with a source none of whose edges has heat that double precision resolves.
fn out_of_reach(mesh: &IntrinsicMesh, field: &[Complex64], has_source: impl Fn(Vertex) -> bool) -> usize {
    let size = |z: &Complex64| z.re.abs().max(z.im.abs());
    let hottest = field.iter().map(size).fold(0.0, f64::max);
    let mut is_reached = vec![false; mesh.vertex_count()];
    for edge in mesh.edges().filter(|e| !is_underflow(size(&field[e.index()]), hottest)) {
        mesh.edge_vertices(edge).iter().for_each(|v| is_reached[v.index()] = true);
    }
    mesh.vertices().filter(|&v| has_source(v) && !is_reached[v.index()]).count()
}

/// The stiffness matrix with the sources held at zero, and a vertex of every component without one.
fn holding(operator: &LaplaceBeltrami, nodes: &[Node], sources: &[bool]) -> CsrMatrix {
    let mut diagonal = vec![0.0; operator.vertex_count()];
    let mut couplings = Vec::new();
    for (i, j, x) in operator.laplacian().entries() {
        match i.cmp(&j) {
            std::cmp::Ordering::Equal => diagonal[i] += x,
            std::cmp::Ordering::Less => couplings.push((i as u32, j as u32, x)),
            std::cmp::Ordering::Greater => {}
        }
    }
    for node in nodes {
        for (k, &(v, a)) in node.iter().enumerate() {
            diagonal[v.index()] += HOLD * a * a;
            couplings.extend(node[k + 1..].iter().map(|&(w, b)| (v.0, w.0, HOLD * a * b)));
        }
    }
    let mut is_held = sources.to_vec();
    for (v, &component) in operator.components().labels().iter().enumerate() {
        if !std::mem::replace(&mut is_held[component as usize], true) {
            diagonal[v] += 1.0;
        }
    }
    CsrMatrix::symmetric(&diagonal, couplings.into_iter())
}

/// Makes the mean over the curves of every component zero; where there are only points, the least of their values.
fn shift(
    mesh: &IntrinsicMesh,
    values: &mut [f64],
    parts: &[Piece],
    nodes: &[Node],
    labels: &[u32],
    components: usize,
) {
    let (mut lengths, mut sums) = (vec![0.0; components], vec![0.0; components]);
    for piece in parts {
        let component = labels[piece.vertex(mesh).index()] as usize;
        let length = piece.length(mesh);
        lengths[component] += length;
        sums[component] += length * piece.mean(mesh, values);
    }
    let mut lowest = vec![f64::INFINITY; components];
    for node in nodes {
        let value = node.iter().map(|&(v, weight)| weight * values[v.index()]).sum();
        let lowest = &mut lowest[labels[node[0].0.index()] as usize];
        *lowest = lowest.min(value);
    }
    for (value, &component) in values.iter_mut().zip(labels) {
        let c = component as usize;
        *value -= if lengths[c] > 0.0 { sums[c] / lengths[c] } else { lowest[c] };
    }
}
