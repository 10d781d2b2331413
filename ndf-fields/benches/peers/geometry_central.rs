//! Fields beside those of geometry-central, on the same intrinsic Delaunay triangulation and in the same planes.
//!
//! Both find the smallest eigenvectors of the same connection Laplacian, geometry-central with the consistent mass matrix and a fixed
//! number of inverse iterations, this crate with lumped masses to a tolerance. The program therefore also runs its iteration
//! with lumped masses: energies are comparable then, ours being a minimum.

use std::f64::consts::TAU;
use std::path::Path;
use std::process::Command;

use ndf_core::{DVec3, NoProgress};
use ndf_fields::{
    Complex64, DirectionField, StripePattern, TangentBundle, connection_laplacian, principal_directions,
};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{Face, Halfedge, ManifoldMesh};

use crate::exchange::Exchange;

/// Mean edges between two stripes.
const EDGES_A_STRIPE: f64 = 8.0;

/// Values of one mesh, ours and theirs.
struct Comparison<'a> {
    name: &'a str,
    mesh: &'a ManifoldMesh,
    bundle: TangentBundle,
    exchange: Exchange,
    lines: DirectionField,
    frequency: f64,
}

pub(crate) fn print(meshes: &[(String, ManifoldMesh)], program: &Path) {
    let compared: Vec<Comparison<'_>> =
        meshes.iter().map(|(name, mesh)| Comparison::new(name, mesh, program)).collect();
    println!("\nSmoothest fields\n");
    println!(
        "| mesh | n | smallest eigenvalue | theirs, lumped masses | their vector in our energy | theirs, consistent masses | singular faces | theirs, lumped masses | theirs | farthest | 1 − agreement, lumped masses | theirs |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    for comparison in &compared {
        [1, 2, 4].iter().for_each(|n| comparison.print_smoothest(*n));
    }
    println!("\nFields along curvature\n");
    println!(
        "| mesh | n | difference of principal directions | singular faces | theirs | 1 − agreement | 1 − agreement, from their right-hand side | Delaunay as given |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|---|");
    for comparison in &compared {
        [2, 4].iter().for_each(|n| comparison.print_curvature(*n));
    }
    println!("\nStripes\n");
    println!(
        "| mesh | stripes a unit | faces in which stripes end | theirs | singular faces | theirs | energy | theirs | mean density / frequency | theirs | deviation | theirs |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    compared.iter().for_each(Comparison::print_stripes);
}

impl<'a> Comparison<'a> {
    fn new(name: &'a str, mesh: &'a ManifoldMesh, program: &Path) -> Self {
        let bundle = TangentBundle::new(&IntrinsicMesh::from_mesh(mesh));
        let lines = DirectionField::smoothest(&bundle, 2, &NoProgress).expect("meshes have area");
        let frequency = frequency(&bundle);
        let exchange = Exchange::new(name);
        exchange.write_mesh(mesh, &bundle);
        exchange.write_complex("lines", lines.powers());
        exchange.write("frequency", &[frequency]);
        exchange.run(Command::new(program).arg("fields"));
        Self { name, mesh, bundle, exchange, lines, frequency }
    }

    fn print_smoothest(&self, n: u32) {
        let (bundle, exchange) = (&self.bundle, &self.exchange);
        let ours = DirectionField::smoothest(bundle, n, &NoProgress).expect("meshes have area");
        let field = |name: &str| {
            DirectionField::from_powers(n, exchange.read_complex(&format!("{name}-{n}"))).expect("n is small")
        };
        let (lumped, consistent) = (field("lumped"), field("smoothest"));
        let energy = |name: &str| exchange.read(&format!("{name}-energy-{n}"))[0];
        let evaluated = self.energy(n, &exchange.read_complex(&format!("lumped-{n}")));
        let counted = |field: &DirectionField| counted(&field.singularities(bundle));
        // Their own count of the same field.
        let theirs = exchange.read_integers(&format!("smoothest-indices-{n}"));
        assert_eq!(indices(&consistent, bundle), theirs, "{}, n = {n}: indices of the same field", self.name);
        println!(
            "| {} | {n} | {:.6e} | {:+.1e} | {:+.1e} | {:+.1e} | {} | {} | {} | {:.1e} | {:.1e} | {:.1e} |",
            self.name,
            ours.energy,
            energy("lumped") / ours.energy - 1.0,
            evaluated / ours.energy - 1.0,
            energy("consistent") / ours.energy - 1.0,
            counted(&ours),
            counted(&lumped),
            counted(&consistent),
            self.farthest(&ours, &consistent),
            self.disagreement(&ours, &lumped),
            self.disagreement(&ours, &consistent),
        );
    }

    fn print_curvature(&self, n: u32) {
        let (bundle, exchange) = (&self.bundle, &self.exchange);
        let principal = principal_directions(self.mesh);
        let areas = vertex_areas(self.mesh);
        // Theirs are sums of quarters, ours means of halves.
        let theirs = exchange.read_complex("principal");
        let means = theirs.iter().zip(&areas).map(|(z, area)| 2.0 * z / area);
        let largest = principal.iter().map(|z| z.norm()).fold(0.0, f64::max);
        let difference =
            principal.iter().zip(means).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) / largest;
        let aligned = |bundle: &TangentBundle, powers: &[Complex64]| {
            DirectionField::aligned(bundle, n, powers, &NoProgress).expect("there is curvature")
        };
        let ours = aligned(bundle, &principal.iter().map(|z| z.powu(n / 2)).collect::<Vec<_>>());
        let given = TangentBundle::as_given(IntrinsicMesh::from_mesh(self.mesh));
        let load = exchange.read_complex(&format!("curvature-load-{n}"));
        let loaded = aligned(&given, &load.iter().zip(&areas).map(|(z, area)| z / area).collect::<Vec<_>>());
        let found = DirectionField::from_powers(n, exchange.read_complex(&format!("curvature-{n}")))
            .expect("n is small");
        let theirs = exchange.read_integers(&format!("curvature-indices-{n}"));
        assert_eq!(indices(&found, &given), theirs, "{}, n = {n}: indices of the same field", self.name);
        println!(
            "| {} | {n} | {difference:.1e} | {} | {} | {:.1e} | {:.1e} | {} |",
            self.name,
            counted(&ours.singularities(bundle)),
            counted(&found.singularities(&given)),
            self.disagreement(&ours, &found),
            self.disagreement(&loaded, &found),
            if given.mesh().is_delaunay() { "yes" } else { "no" },
        );
    }

    fn print_stripes(&self) {
        let exchange = &self.exchange;
        let ours = StripePattern::new(&self.bundle, &self.lines, self.frequency, &NoProgress)
            .expect("the field fits the mesh");
        let corners: Vec<[f64; 3]> =
            exchange.read("stripe-corners").chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        let theirs = exchange.read_integers("stripe-branches");
        let singular = exchange.read_integers("stripe-singular");
        let is_singular: Vec<bool> = singular.iter().map(|index| *index != 0).collect();
        let ends = ours.branches.iter().filter(|(_, count)| *count != 0).count();
        let their_ends = theirs.iter().zip(&is_singular).filter(|(count, is)| **count != 0 && !**is).count();
        let [mine, other] = [&ours.corners, &corners].map(|corners| self.spacing(corners, &is_singular));
        println!(
            "| {} | {:.3} | {ends} | {their_ends} | {} | {} | {:.4e} | {:.4e} | {:.3} | {:.3} | {:.3} | {:.3} |",
            self.name,
            self.frequency,
            ours.branches.len() - ends,
            is_singular.iter().filter(|is| **is).count(),
            mine.energy,
            other.energy,
            mine.mean,
            other.mean,
            mine.deviation,
            other.deviation,
        );
    }

    /// The Rayleigh quotient of a vector with lumped masses: what this crate minimises.
    fn energy(&self, n: u32, powers: &[Complex64]) -> f64 {
        let image = connection_laplacian(&self.bundle, n).multiply(powers);
        let energy: f64 = image.iter().zip(powers).map(|(image, z)| (z.conj() * image).re).sum();
        let norm: f64 = powers.iter().zip(self.areas()).map(|(z, area)| area * z.norm_sqr()).sum();
        energy / norm
    }

    /// A third of the area of its intrinsic faces for every vertex.
    fn areas(&self) -> Vec<f64> {
        let mesh = self.bundle.mesh();
        let mut areas = vec![0.0; mesh.vertex_count()];
        for face in mesh.faces() {
            mesh.face_vertices(face).iter().for_each(|v| areas[v.index()] += mesh.area(face) / 3.0);
        }
        areas
    }

    /// 1 − |mean of the cosines of the angles between nth powers|, after the rotation of all that fits best: 0 for equal fields.
    fn disagreement(&self, a: &DirectionField, b: &DirectionField) -> f64 {
        let areas = self.areas();
        let sum: Complex64 =
            a.powers().iter().zip(b.powers()).zip(&areas).map(|((a, b), area)| a.conj() * b * area).sum();
        1.0 - sum.norm() / areas.iter().sum::<f64>()
    }

    /// How far a singular face of one of two fields is from the nearest of the other at most, in parts of the bounding box's diagonal.
    fn farthest(&self, a: &DirectionField, b: &DirectionField) -> f64 {
        let mesh = self.bundle.mesh();
        let middle = |face: Face| {
            let corners = mesh.face_vertices(face).map(|v| self.mesh.positions()[v.index()]);
            corners.iter().sum::<DVec3>() / 3.0
        };
        let [a, b] = [a, b].map(|field| {
            field.singularities(&self.bundle).iter().map(|(face, _)| middle(*face)).collect::<Vec<_>>()
        });
        let nearest =
            |p: &DVec3, others: &[DVec3]| others.iter().map(|q| p.distance(*q)).fold(f64::INFINITY, f64::min);
        let from_a = a.iter().map(|p| nearest(p, &b));
        let farthest = from_a.chain(b.iter().map(|p| nearest(p, &a))).fold(0.0, f64::max);
        let corner = |f: fn(DVec3, DVec3) -> DVec3| self.mesh.positions().iter().copied().reduce(f);
        let diagonal = corner(DVec3::max).zip(corner(DVec3::min)).map_or(1.0, |(a, b)| a.distance(b));
        farthest / diagonal
    }

    /// How well phases at corners follow the lines, in all but singular faces.
    fn spacing(&self, corners: &[[f64; 3]], is_singular: &[bool]) -> Spacing {
        let mesh = self.bundle.mesh();
        let directions = self.lines.directions();
        let radians = TAU * self.frequency;
        let (mut energy, mut mean, mut square, mut area) = (0.0, 0.0, 0.0, 0.0);
        for (face, corners) in mesh.faces().zip(corners).filter(|(face, _)| !is_singular[face.index()]) {
            // By how much the phase should get on along the sides, in terms of the first corner's direction.
            let mut direction = directions[mesh.face_vertices(face)[0].index()];
            let advances = face.halfedges().map(|h| {
                let continued = self.bundle.transport(h) * direction;
                let next = directions[mesh.tip(h).index()];
                let next = if (continued.conj() * next).re < 0.0 { -next } else { next };
                let along = |direction: Complex64, edge: f64| (direction * Complex64::cis(-edge)).re;
                let slopes =
                    along(direction, self.bundle.direction(h)) + along(next, self.bundle.onward_direction(h));
                direction = next;
                0.5 * radians * mesh.halfedge_length(h) * slopes
            });
            let found = [0, 1, 2].map(|c| corners[(c + 1) % 3] - corners[c]);
            // Which of the two directions of the line a program takes is its choice.
            let misfit = |sign: f64| -> f64 {
                let side = |(c, h): (usize, Halfedge)| {
                    0.5 * mesh.cotangent(h) * 2.0 * (1.0 - (found[c] - sign * advances[c]).cos())
                };
                face.halfedges().into_iter().enumerate().map(side).sum()
            };
            energy += misfit(1.0).min(misfit(-1.0));
            let density = slope(mesh, face, corners) / radians;
            mean += mesh.area(face) * density;
            square += mesh.area(face) * (density - 1.0).powi(2);
            area += mesh.area(face);
        }
        Spacing { energy: energy / area, mean: mean / area, deviation: (square / area).sqrt() }
    }
}

struct Spacing {
    /// Of the unit numbers, by area, in inverse squared units of length.
    energy: f64,
    /// Stripes for a unit of length in parts of the frequency: the mean,
    mean: f64,
    /// and the root mean square of its difference from 1.
    deviation: f64,
}

/// Stripes for a unit of length.
pub(crate) fn frequency(bundle: &TangentBundle) -> f64 {
    let lengths = bundle.mesh().lengths();
    lengths.len() as f64 / (EDGES_A_STRIPE * lengths.iter().sum::<f64>())
}

/// The length of the gradient of the linear function with these values.
fn slope(mesh: &IntrinsicMesh, face: Face, values: &[f64; 3]) -> f64 {
    let [a, b, c] = values;
    // From the cotangents of the corners opposite to the sides: ∫|∇f|² = ½ Σ cot (f_i − f_j)².
    let differences = [b - a, c - b, a - c];
    let integral: f64 =
        face.halfedges().iter().zip(differences).map(|(h, d)| 0.5 * mesh.cotangent(*h) * d * d).sum();
    (integral / mesh.area(face)).max(0.0).sqrt()
}

/// A third of the area of its faces for every vertex of a mesh in space.
fn vertex_areas(mesh: &ManifoldMesh) -> Vec<f64> {
    let mut areas = vec![0.0; mesh.vertex_count()];
    for face in mesh.topology().faces() {
        mesh.topology()
            .face_vertices(face)
            .iter()
            .for_each(|v| areas[v.index()] += mesh.face_area(face) / 3.0);
    }
    areas
}

/// The number of singular faces and the sum of their indices.
fn counted(singularities: &[(Face, i32)]) -> String {
    format!("{} ({:+})", singularities.len(), singularities.iter().map(|(_, index)| index).sum::<i32>())
}

fn indices(field: &DirectionField, bundle: &TangentBundle) -> Vec<i32> {
    bundle.mesh().faces().map(|face| field.index(bundle, face)).collect()
}
