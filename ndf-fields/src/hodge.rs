//! The Hodge decomposition of a tangent field (Polthier and Preuß 2003; Wardetzky 2006).

use ndf_core::Progress;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::Edge;
use ndf_spectral::{CsrMatrix, LaplaceBeltrami, Mass, MetricTriangles, SymbolicCholesky};
use num_complex::Complex64;

use crate::error::FieldError;
use crate::faces::{Layout, dot, weak_divergence};

/// A field as the sum of a gradient, a turned gradient, and a rest without sources and whirls.
///
/// Vectors are constant in faces, complex numbers whose real axis is the first half-edge of the face. The parts are orthogonal to each
/// other in the area of the faces, exactly: gradients are of continuous linear functions, turned gradients of linear functions
/// that are continuous in the middles of edges.
#[derive(Clone, Debug, PartialEq)]
pub struct HodgeDecomposition {
    /// The function, at vertices, whose gradient is the part with sources. Its mean is 0 on every component.
    pub potential: Vec<f64>,
    /// The function, at the middles of edges, whose turned gradient is the part with whirls. 0 at the boundary, which it flows along.
    pub stream: Vec<f64>,
    /// ∇ of the potential.
    pub gradient: Vec<Complex64>,
    /// The gradient of the stream function, turned to the left by a right angle.
    pub rotation: Vec<Complex64>,
    /// What is left: along handles and around holes; zero on discs and spheres up to rounding.
    pub harmonic: Vec<Complex64>,
}

impl HodgeDecomposition {
    /// Decomposes a field. Two factorisations: of V rows, and of as many as there are edges.
    ///
    /// # Errors
    /// If there is not one vector for every face, a vertex has no area around it, a matrix is not positive definite to double precision,
    /// or the observer asks to stop.
    pub fn of(
        mesh: &IntrinsicMesh,
        field: &[Complex64],
        progress: &dyn Progress,
    ) -> Result<Self, FieldError> {
        if field.len() != mesh.face_count() {
            return Err(FieldError::Count { found: field.len(), expected: mesh.face_count() });
        }
        progress.report("gradient", 0.0);
        let operator = LaplaceBeltrami::from_lengths(&MetricTriangles::from(mesh), Mass::Barycentric)?;
        let matrix = operator.grounded();
        let mut potential = weak_divergence(mesh, field);
        SymbolicCholesky::new(&matrix)?.cholesky(&matrix)?.solve(&mut [&mut potential]);
        operator.remove_means(&mut potential);
        let layouts: Vec<Layout> = mesh.faces().map(|face| Layout::of(mesh, face)).collect();
        let gradient: Vec<Complex64> = mesh
            .faces()
            .zip(&layouts)
            .map(|(face, layout)| layout.gradient(mesh.face_vertices(face).map(|v| potential[v.index()])))
            .collect();
        progress.check()?;
        progress.report("rotation", 0.5);
        let stream = stream_function(mesh, &layouts, field)?;
        let turned = |values: [f64; 3], layout: &Layout| edge_gradient(layout, values) * Complex64::i();
        let rotation: Vec<Complex64> = mesh
            .faces()
            .zip(&layouts)
            .map(|(face, layout)| turned(mesh.face_edges(face).map(|e| stream[e.index()]), layout))
            .collect();
        let rest = field.iter().zip(&gradient).zip(&rotation);
        let harmonic = rest.map(|((x, gradient), rotation)| x - gradient - rotation).collect();
        Ok(Self { potential, stream, gradient, rotation, harmonic })
    }
}

/// The gradient of the linear function with these values at the middles of the sides. The function that is 1 in the middle of a side and
/// 0 in the others is 1 less twice the hat of the opposite corner (Crouzeix and Raviart 1973).
fn edge_gradient(layout: &Layout, values: [f64; 3]) -> Complex64 {
    let [ab, bc, ca] = values;
    // The corner opposite to the side ab is c, and so on.
    layout.gradient([bc, ca, ab].map(|value| -2.0 * value))
}

/// The function at the middles of edges whose turned gradient fits a field best, 0 on the boundary.
fn stream_function(
    mesh: &IntrinsicMesh,
    layouts: &[Layout],
    field: &[Complex64],
) -> Result<Vec<f64>, FieldError> {
    let edges = mesh.edge_count();
    let mut diagonal = vec![0.0; edges];
    let mut couplings = Vec::new();
    let mut side = vec![0.0; edges];
    for ((face, layout), vector) in mesh.faces().zip(layouts).zip(field) {
        let area = layout.area();
        if area <= 0.0 {
            continue;
        }
        let at = mesh.face_edges(face).map(Edge::index);
        let unit = [0, 1, 2].map(|c| edge_gradient(layout, [0, 1, 2].map(|i| f64::from(u8::from(i == c)))));
        for c in 0..3 {
            let next = (c + 1) % 3;
            diagonal[at[c]] += area * unit[c].norm_sqr();
            couplings.push((at[c] as u32, at[next] as u32, area * dot(unit[c], unit[next])));
            side[at[c]] += area * dot(unit[c] * Complex64::i(), *vector);
        }
    }
    // Zero on the boundary, and at one edge of a component without.
    let mut component = Components::of(mesh);
    let mut is_held: Vec<bool> = mesh.edges().map(|e| mesh.is_boundary_edge(e)).collect();
    for e in mesh.edges().filter(|&e| mesh.is_boundary_edge(e)) {
        component.is_held(mesh.edge_vertices(e)[0].index());
    }
    for e in mesh.edges() {
        if !component.is_held(mesh.edge_vertices(e)[0].index()) {
            is_held[e.index()] = true;
        }
    }
    for (e, held) in is_held.iter().enumerate() {
        if *held {
            side[e] = 0.0;
            diagonal[e] = diagonal[e].max(1.0);
        }
    }
    couplings.retain(|&(i, j, _)| !is_held[i as usize] && !is_held[j as usize]);
    let matrix = CsrMatrix::symmetric(&diagonal, couplings.into_iter());
    SymbolicCholesky::new(&matrix)?.cholesky(&matrix)?.solve(&mut [&mut side]);
    Ok(side)
}

/// Components of a mesh, and which have an edge at which the stream function is held.
struct Components {
    of: Vec<u32>,
    is_held: Vec<bool>,
}

impl Components {
    fn of(mesh: &IntrinsicMesh) -> Self {
        let mut of = vec![u32::MAX; mesh.vertex_count()];
        let mut count = 0;
        for start in mesh.vertices() {
            if of[start.index()] != u32::MAX {
                continue;
            }
            let mut stack = vec![start];
            while let Some(v) = stack.pop() {
                if std::mem::replace(&mut of[v.index()], count) == u32::MAX {
                    stack.extend(mesh.ring(v).filter(|w| of[w.index()] == u32::MAX));
                }
            }
            count += 1;
        }
        Self { of, is_held: vec![false; count as usize] }
    }

    /// Whether the component of a vertex had an edge that is held; from now on it has.
    fn is_held(&mut self, vertex: usize) -> bool {
        std::mem::replace(&mut self.is_held[self.of[vertex] as usize], true)
    }
}
