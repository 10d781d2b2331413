//! What a term of the objective must satisfy, for any implementation: its gradients are those of its value.
//!
//! ```
//! # use ndf_train::objective::{Block, Gradients, Term};
//! /// ‖g(x)‖²: draws the surface together.
//! struct Shrink;
//!
//! impl Term for Shrink {
//!     fn name(&self) -> &str {
//!         "shrink"
//!     }
//!
//!     fn accumulate(&self, block: &Block<'_>, weight: f32, gradients: &mut Gradients<'_>) -> f64 {
//!         let images = block.images.iter().zip(gradients.images.iter_mut());
//!         let square = |(&y, dy): (&ndf_core::glam::Vec3, &mut ndf_core::glam::Vec3)| {
//!             *dy += 2.0 * weight * y;
//!             f64::from(y.length_squared())
//!         };
//!         images.map(square).sum()
//!     }
//! }
//!
//! // In a crate of your own, as a test: `ndf_train::loss_conformance!(shrink, Shrink);`
//! ndf_train::conformance::check(&Shrink);
//! ```

use ndf_core::glam::Vec3;
use ndf_mesh::shapes;
use ndf_mesh::{Face, ManifoldMesh};
use ndf_model::file::BaseOrder;
use ndf_model::intrinsic_network::{IntrinsicEncoding, single};
use ndf_model::{DisplacementField, FieldShape, NetworkShape};
use ndf_network::Packed;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use crate::base::Base;
use crate::objective::{Block, Epoch, Gradients, OwnNetwork, Place, Projecting, Target, Term};

/// Points at which a term is tried, one at a time.
const POINTS: usize = 50;
/// Features a vertex.
const FEATURES: usize = 4;
/// Step of the central differences, which balances rounding and curvature.
const STEP: f32 = 2e-3;

/// Makes the laws of a term a test: `loss_conformance!(name, TERM);` with the feature `conformance`. The base mesh is an
/// icosphere of 42 vertices.
#[macro_export]
macro_rules! loss_conformance {
    ($name:ident, $term:expr) => {
        #[test]
        fn $name() {
            $crate::conformance::check(&$term);
        }
    };
}

/// What a term is tried on: a block of one sample.
struct Sample {
    base: Vec3,
    /// Image, J u and J v.
    vectors: [Vec3; 3],
    target: Target,
    features: Vec<f32>,
    place: Place,
    number: usize,
}

/// Value and gradients of a term.
struct Found {
    value: f64,
    vectors: [Vec3; 3],
    features: Vec<f32>,
}

/// Checks that the gradients of a term by images, tangents and features are those of its value, that they are added in
/// proportion to the weight, and that a sample without a foot gives finite numbers.
///
/// # Panics
/// If they are not.
pub fn check(term: &dyn Term) {
    let mesh = ManifoldMesh::try_from(shapes::icosphere(1)).expect("an icosphere is a manifold");
    let base = Base::new(&mesh, BaseOrder::identity(&mesh));
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let mut number = || rng.random_range(-1.0_f32..1.0);
    let samples: Vec<Sample> = std::iter::from_fn(|| {
        let mut vector = || Vec3::new(number(), number(), number());
        let (place, [y, u, v]) = (vector(), [vector(), vector(), vector()]);
        let target =
            Target { foot: vector(), normal: vector().normalize(), surface_normal: vector().normalize() };
        let barycentric = [0.5 + 0.25 * (place.x + place.y), 0.25 - 0.25 * place.x, 0.25 - 0.25 * place.y];
        let face = Face::new(((0.5 + 0.5 * place.z) * 79.0) as usize);
        let features = (0..FEATURES).map(|_| number()).collect();
        let place = Place { face, barycentric };
        let base = place.on_face().position(&mesh).as_vec3();
        Some(Sample { base, vectors: [y, u, v], target, features, place, number: 0 })
    })
    // Nearly parallel tangents change their normal too fast for differences.
    .filter(|sample| sample.vectors[1].cross(sample.vectors[2]).length_squared() >= 0.05)
    .take(POINTS)
    .zip(0..)
    .map(|(sample, number)| Sample { number, ..sample })
    .collect();

    let shape = NetworkShape { features: FEATURES, ..NetworkShape::default() };
    let field = DisplacementField::untrained(mesh, FieldShape::from(shape.clone()), 0);
    let field = field.expect("an icosphere makes a field");
    let places: Vec<_> = samples.iter().map(|sample| sample.place.on_face()).collect();
    let images: Vec<_> = samples.iter().map(|sample| sample.vectors[0].as_dvec3()).collect();
    let prepared = term.prepare(&Projecting { field: &field, samples: &places, images: &images });
    let own = term.network(1).map(|mut mlp| {
        // A network may be 0 at birth.
        mlp.parameters_mut().iter_mut().for_each(|p| *p += 0.2 * rng.random_range(-1.0_f32..1.0));
        Packed::new(&mlp)
    });
    let positions = single(field.base().positions());
    let vertex_features = field.network().expect("an untrained field has a network").features();
    let encoding = IntrinsicEncoding::new(field.base().faces(), &positions, vertex_features, &shape);
    let evaluate = |sample: &Sample, weight: f32| -> Found {
        let [y, u, v] = sample.vectors;
        let block = Block {
            epoch: Epoch { number: 3, of: 7 },
            base: &[sample.base],
            images: &[y],
            tangents: [&[u], &[v]],
            targets: &[sample.target],
            network: own.as_ref(),
            places: &[sample.place],
            mesh: &base,
            encoding,
            rows: &sample.features,
            stride: FEATURES,
            prepared: prepared.as_deref(),
            first: sample.number,
        };
        let (mut dy, mut du, mut dv) = ([Vec3::ONE], [Vec3::ONE], [Vec3::ONE]);
        let mut features = vec![1.0; FEATURES];
        let mut network = own.as_ref().map(OwnNetwork::new);
        let mut gradients = Gradients {
            images: &mut dy,
            tangents: [&mut du, &mut dv],
            features: if term.needs().feature_gradients { &mut features } else { &mut [] },
            network: network.as_mut(),
        };
        let value = term.accumulate(&block, weight, &mut gradients);
        features.iter_mut().for_each(|f| *f -= 1.0);
        Found { value, vectors: [dy[0], du[0], dv[0]].map(|v| v - 1.0), features }
    };
    let name = term.name();
    for sample in &samples {
        let found = evaluate(sample, 1.0);
        let compare = |what: &str, gradient: f32, moved: &dyn Fn(f32) -> (f64, f64)| {
            let (up, down) = (moved(STEP), moved(-STEP));
            let slope = (up.0 - down.0) / (up.1 - down.1);
            let error = (slope - f64::from(gradient)).abs();
            assert!(error < 2e-3 * slope.abs().max(1.0), "{name}, by {what}: {gradient}, not {slope}");
        };
        for (k, c) in (0..9).map(|i| (i / 3, i % 3)) {
            let what = ["the image", "J u", "J v"][k];
            compare(what, found.vectors[k][c], &|h| {
                let mut vectors = sample.vectors;
                vectors[k][c] += h;
                let at = f64::from(vectors[k][c]);
                (evaluate(&Sample { vectors, ..sample.copy() }, 1.0).value, at)
            });
        }
        for k in 0..FEATURES {
            compare("the features", found.features[k], &|h| {
                let mut moved = sample.copy();
                moved.features[k] += h;
                (evaluate(&moved, 1.0).value, f64::from(moved.features[k]))
            });
        }
        let doubled = evaluate(sample, 2.0);
        assert_eq!(doubled.value, found.value, "{name}: its value knows the weight");
        for (once, twice) in found.vectors.iter().zip(&doubled.vectors) {
            let error = (2.0 * *once - *twice).abs().max_element();
            assert!(error < 1e-5 * twice.length().max(1.0), "{name}: gradients are not added by weight");
        }
        let missed = evaluate(&Sample { target: Target::NONE, ..sample.copy() }, 1.0);
        let is_finite = missed.value.is_finite() && missed.vectors.iter().all(|v| v.is_finite());
        assert!(is_finite, "{name}: a sample without a foot has no finite value");
    }
}

impl Sample {
    fn copy(&self) -> Self {
        Self { features: self.features.clone(), ..*self }
    }
}
