//! The vector heat method (Sharp, Soliman and Crane 2019): parallel transport of vectors along shortest paths, extension of
//! values from points, and the logarithmic map, each by a few linear solves.

use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{Face, Halfedge, Vertex};
use ndf_spectral::{Cholesky, Components, LaplaceBeltrami, Mass, MetricTriangles, SymbolicCholesky};
use num_complex::Complex64;

use crate::bundle::TangentBundle;
use crate::connection::{areas, connection_laplacian, plus_mass};
use crate::error::FieldError;
use crate::faces::{Layout, unit, weak_divergence};
use crate::reach::out_of_reach;

/// The factorised operators of a surface; they serve any number of sources.
#[derive(Clone, Debug)]
pub struct VectorHeatSolver {
    bundle: TangentBundle,
    /// For every half-edge the rotation that takes vectors at its tail into the layout of its face.
    into_faces: Vec<Complex64>,
    /// Of `M + t L`, scaled by 1/t.
    scalar: Cholesky,
    /// The same for vectors.
    vector: Cholesky<Complex64>,
    /// Of `L`, with one vertex of every component held.
    poisson: Cholesky,
    components: Components,
}

/// What heat brought to the vertices.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Diffused<T> {
    /// One for every vertex.
    pub values: Vec<T>,
    /// Vertices of components with a source that heat does not reach in double precision: it decays by e a mean edge. What they have is
    /// wrong; a larger time reaches farther, in proportion to its root.
    pub out_of_reach: usize,
}

impl VectorHeatSolver {
    /// Factorises for the authors' time step, the square of the mean edge length. O(n^1.5) for meshes of practice.
    ///
    /// # Errors
    /// If a vertex has no area around it, or the matrices are not positive definite to double precision.
    pub fn new(mesh: &IntrinsicMesh) -> Result<Self, FieldError> {
        Self::with_time(mesh, 1.0)
    }

    /// Factorises for `time` times the square of the mean edge length.
    ///
    /// # Errors
    /// As [`new`](Self::new), and if the time is not positive.
    pub fn with_time(mesh: &IntrinsicMesh, time: f64) -> Result<Self, FieldError> {
        let bundle = TangentBundle::new(mesh);
        let mesh = bundle.mesh();
        let mean = mesh.lengths().iter().sum::<f64>() / mesh.edge_count().max(1) as f64;
        let step = time * mean * mean;
        if !(step > 0.0 && step.is_finite()) {
            return Err(FieldError::NotPositive { name: "the time step", value: step });
        }
        let operator = LaplaceBeltrami::from_lengths(&MetricTriangles::from(mesh), Mass::Barycentric)?;
        let areas = areas(&bundle);
        let heat = operator.laplacian().plus(step.recip(), operator.mass());
        let symbolic = SymbolicCholesky::new(&heat)?;
        let poisson = symbolic.cholesky(&operator.grounded())?;
        let scalar = symbolic.cholesky(&heat)?;
        let heat = plus_mass(&connection_laplacian(&bundle, 1), step.recip(), areas);
        let vector = symbolic.cholesky(&heat)?;
        let components = operator.components().clone();
        let into_faces = into_faces(&bundle);
        Ok(Self { bundle, into_faces, scalar, vector, poisson, components })
    }

    /// The tangent planes in which vectors are given.
    pub fn bundle(&self) -> &TangentBundle {
        &self.bundle
    }

    /// The value of the nearest source at every vertex, smoothed where several are near. Zero on components without a source. Two solves.
    ///
    /// # Errors
    /// If there is no source, or one is no vertex of the mesh.
    pub fn extend(&self, sources: &[(Vertex, f64)]) -> Result<Diffused<f64>, FieldError> {
        self.check(sources.iter().map(|source| source.0))?;
        let mut values = vec![0.0; self.bundle.mesh().vertex_count()];
        let mut counts = values.clone();
        for &(v, value) in sources {
            values[v.index()] += value;
            counts[v.index()] += 1.0;
        }
        self.scalar.solve(&mut [&mut values, &mut counts]);
        let out_of_reach = out_of_reach(&counts, &self.components);
        values.iter_mut().zip(&counts).for_each(|(value, count)| *value = ratio(*value, *count));
        Ok(Diffused { values, out_of_reach })
    }

    /// The vector of the nearest source at every vertex, carried there parallel along a shortest path, and smoothed where several
    /// are near. Zero on components without a source. One solve for one source, three for several.
    ///
    /// # Errors
    /// If there is no source, or one is no vertex of the mesh.
    pub fn transport(&self, sources: &[(Vertex, Complex64)]) -> Result<Diffused<Complex64>, FieldError> {
        self.check(sources.iter().map(|source| source.0))?;
        let mut vectors = vec![Complex64::default(); self.bundle.mesh().vertex_count()];
        for &(v, vector) in sources {
            vectors[v.index()] += vector;
        }
        let [directions] = self.diffused([vectors]);
        // A single vector has the same length everywhere.
        if let [(_, vector)] = sources
            && *vector != Complex64::ZERO
        {
            let length = vector.norm();
            let out_of_reach = self.out_of_reach(&directions);
            let values = directions.iter().map(|z| unit(*z) * length).collect();
            return Ok(Diffused { values, out_of_reach });
        }
        let lengths: Vec<(Vertex, f64)> = sources.iter().map(|&(v, vector)| (v, vector.norm())).collect();
        let Diffused { values: lengths, out_of_reach } = self.extend(&lengths)?;
        let values = directions.iter().zip(lengths).map(|(z, length)| unit(*z) * length).collect();
        Ok(Diffused { values, out_of_reach })
    }

    /// The logarithmic map at a vertex: for every vertex the direction and the distance at which one has to leave the source to arrive
    /// there along a shortest path, as a vector of the source's plane. Approximate: some hundredths of the distance, more behind the cut
    /// locus. [`exact_log_map`](crate::exact_log_map) has the same of the shortest paths themselves. Zero on other components. Three
    /// solves.
    ///
    /// # Errors
    /// If the source is no vertex of the mesh.
    pub fn log_map(&self, source: Vertex) -> Result<Diffused<Complex64>, FieldError> {
        self.check([source].into_iter())?;
        let bundle = &self.bundle;
        let mesh = bundle.mesh();
        let mut horizontal = vec![Complex64::default(); mesh.vertex_count()];
        horizontal[source.index()] = Complex64::new(1.0, 0.0);
        let [outward, horizontal] = self.diffused([self.outward(source), horizontal]);
        let out_of_reach = self.out_of_reach(&horizontal);
        let radial: Vec<Complex64> = outward.iter().map(|z| unit(*z)).collect();
        let mut distances = self.divergence(&radial, source);
        self.poisson.solve(&mut [&mut distances]);
        let at_source = distances[source.index()];
        let label = self.components.labels()[source.index()];
        let log = |v: usize| {
            if v == source.index() || self.components.labels()[v] != label {
                return Complex64::default();
            }
            // The radial direction as seen in the source's frame, which was carried to the vertex.
            unit(radial[v] * unit(horizontal[v]).conj()) * (distances[v] - at_source).max(0.0)
        };
        Ok(Diffused { values: (0..mesh.vertex_count()).map(log).collect(), out_of_reach })
    }

    fn check(&self, mut sources: impl Iterator<Item = Vertex>) -> Result<(), FieldError> {
        let vertices = self.bundle.mesh().vertex_count();
        let mut any = false;
        let wrong = sources.by_ref().inspect(|_| any = true).find(|v| v.index() >= vertices);
        match wrong {
            Some(v) => Err(FieldError::NotOnMesh { point: ndf_mesh::SurfacePoint::Vertex(v) }),
            None if any => Ok(()),
            None => Err(FieldError::NoSource),
        }
    }

    /// Several fields at once, for one pass through the factor.
    fn diffused<const N: usize>(&self, mut fields: [Vec<Complex64>; N]) -> [Vec<Complex64>; N] {
        self.vector.solve(&mut fields.each_mut().map(Vec::as_mut_slice));
        fields
    }

    /// How many vertices diffused vectors do not reach.
    fn out_of_reach(&self, vectors: &[Complex64]) -> usize {
        let heat: Vec<f64> = vectors.iter().map(|z| z.re.abs().max(z.im.abs())).collect();
        out_of_reach(&heat, &self.components)
    }

    /// The unit vectors away from a vertex on a small circle around it, tested with hat functions and divided by the radius: what diffuses
    /// to directions away from it (§8.2 of the paper).
    fn outward(&self, source: Vertex) -> Vec<Complex64> {
        let bundle = &self.bundle;
        let mesh = bundle.mesh();
        let mut outward = vec![Complex64::default(); mesh.vertex_count()];
        for h in mesh.outgoing(source) {
            let last = h.previous();
            let from = bundle.direction(h);
            let to = bundle.direction_in_corner(h, mesh.corner_angle(h));
            let [length, _, other] = mesh.sides_from(h);
            let sine = (to - from).sin();
            if sine <= 0.0 || length <= 0.0 || other <= 0.0 {
                continue;
            }
            // The hat of the tip of h has the slope sin(to − θ) / (length · sine) in the direction θ, that of the other end
            // sin(θ − from) / (other · sine).
            let tip = sine_moment(to, [from, to]) / (length * sine);
            let end = -sine_moment(from, [from, to]) / (other * sine);
            outward[mesh.tip(h).index()] += tip * bundle.transport(h);
            outward[mesh.tail(last).index()] += end * bundle.transport(last).conj();
            outward[source.index()] -= tip + end;
        }
        outward
    }

    /// The weak divergence of a field, for a Poisson problem whose solution has it as its gradient: in every face the mean of the vectors
    /// at its corners, of unit length. In faces at the source, which has no direction away from itself, that of the other two.
    fn divergence(&self, field: &[Complex64], source: Vertex) -> Vec<f64> {
        let mesh = self.bundle.mesh();
        let mean = |face: Face| {
            let corners = face.halfedges().map(|h| (h, mesh.tail(h)));
            let away = corners.iter().filter(|(_, v)| *v != source);
            let turned = |&(h, v): &(Halfedge, Vertex)| self.into_faces[h.index()] * field[v.index()];
            unit(away.map(turned).sum())
        };
        weak_divergence(mesh, &mesh.faces().map(mean).collect::<Vec<_>>())
    }
}

/// For every half-edge the rotation that takes vectors at its tail into the [layout](Layout) of its face.
fn into_faces(bundle: &TangentBundle) -> Vec<Complex64> {
    let mesh = bundle.mesh();
    let of_face = |face: Face| {
        let sides = Layout::of(mesh, face).sides();
        [0, 1, 2].map(|c| bundle.in_face(face.halfedge(c), unit(sides[c])))
    };
    mesh.faces().flat_map(of_face).collect()
}

/// `∫ sin(angle − θ) e^{iθ} dθ` between two angles.
fn sine_moment(angle: f64, [from, to]: [f64; 2]) -> Complex64 {
    let (ahead, back) = (Complex64::cis(angle), Complex64::cis(-angle));
    let twice_i = Complex64::new(0.0, 2.0);
    let antiderivative =
        |theta: f64| (ahead * theta - back * Complex64::cis(2.0 * theta) / twice_i) / twice_i;
    antiderivative(to) - antiderivative(from)
}

/// The quotient; 0 where heat is zero to double precision.
fn ratio(value: f64, count: f64) -> f64 {
    if count > 0.0 { value / count } else { 0.0 }
}
