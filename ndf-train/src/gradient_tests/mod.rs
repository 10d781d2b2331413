//! The hand-derived gradients of a whole epoch against three independent truths: central differences of the objective
//! written down in f64, the tape on which that definition is differentiated, and dfdx's tape.

mod definition;
mod dfdx;
mod differences;
mod tape;

use std::sync::Arc;

use ndf_core::glam::Vec3;
use ndf_mesh::shapes;
use ndf_mesh::{Face, ManifoldMesh};
use ndf_model::file::BaseOrder;
use ndf_model::intrinsic_network::IntrinsicEncoding;
use ndf_model::{FieldShape, NetworkShape};
use ndf_network::{Activation, Mlp, MlpShape, Packed};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use crate::base::Base;
use crate::engine::{CornerGradients, Memory, Network};
use crate::objective::origin::Origin;
use crate::objective::{
    Block, Conformal, Cycle, Dirichlet, Epoch, Gradients, Needs, NormalAlignment, Place, PointTarget,
    ProjectionDistance, Target, Term,
};
use crate::settings::{ReverseMap, Settings};
use crate::step::{Active, Chunk, Shared, Step};

const SAMPLES: usize = 70;
const VERTICES: usize = 42;
const FEATURES: usize = 8;
const OCTAVES: usize = 2;
const REVERSE_OCTAVES: usize = 3;
const THETA_INPUTS: usize = FEATURES + 3 + 6 * OCTAVES;
const PHI_INPUTS: usize = 3 + 6 * REVERSE_OCTAVES;
const HIDDEN: usize = 32;
const LAMBDA_P: f32 = 3.0;
const LAMBDA_C: f32 = 0.7;

/// The weight of each term, in the order of [`terms`].
type Weights = [f32; 6];

fn terms() -> [Arc<dyn Term>; 6] {
    [
        Arc::new(ProjectionDistance),
        Arc::new(PointTarget),
        Arc::new(Dirichlet),
        Arc::new(NormalAlignment),
        Arc::new(Conformal),
        Arc::new(Small),
    ]
}

/// ‖z(x)‖²: the one term with gradients by features.
struct Small;

impl Term for Small {
    fn name(&self) -> &str {
        "small"
    }

    fn needs(&self) -> Needs {
        Needs { feature_gradients: true, ..Needs::default() }
    }

    fn accumulate(&self, block: &Block<'_>, weight: f32, gradients: &mut Gradients<'_>) -> f64 {
        let mut sum = 0.0;
        for (i, by_sample) in gradients.features.chunks_exact_mut(FEATURES).enumerate().take(block.len()) {
            for (by, z) in by_sample.iter_mut().zip(block.features(i)) {
                sum += z * z;
                *by += 2.0 * weight * z;
            }
        }
        f64::from(sum)
    }
}

/// Every term alone and all of them together, with all reverse maps and activations.
fn cases() -> Vec<(Weights, ReverseMap, Activation)> {
    let alone = |k: usize| std::array::from_fn(|i| if i == k { LAMBDA_P } else { 0.0 });
    let together = [3.0, 0.2, 0.1, 0.5, 2.0, 0.3];
    let (residual, relu) = (ReverseMap::Residual, Activation::Relu);
    let mut cases: Vec<_> = (0..6).map(|k| (alone(k), residual, relu)).collect();
    let maps =
        [ReverseMap::Plain, residual, ReverseMap::ClosestPoint, ReverseMap::Encoding, ReverseMap::Inverse];
    cases.extend(maps.map(|map| (together, map, relu)));
    cases.extend(Activation::ALL.map(|activation| (together, residual, activation)));
    cases
}

/// One epoch's inputs, chosen at random, and its gradients as the program derives them.
struct Case {
    base: Base,
    places: Vec<Place>,
    targets: Vec<Target>,
    origins: Vec<Origin>,
    reverse_map: ReverseMap,
    features: Vec<f32>,
    theta: Mlp,
    phi: Option<Mlp>,
    loss: f64,
    by_features: Vec<f32>,
    by_theta: Vec<f32>,
    by_phi: Vec<f32>,
}

impl Case {
    /// Features and the parameters of θ and φ.
    fn groups(&self) -> [Vec<f64>; 3] {
        let phi = self.phi.as_ref().map_or(&[][..], Mlp::parameters);
        [&self.features, self.theta.parameters(), phi]
            .map(|group| group.iter().map(|&x| f64::from(x)).collect())
    }
}

fn case(weights: Weights, reverse_map: ReverseMap, activation: Activation) -> Case {
    let mesh = ManifoldMesh::try_from(shapes::icosphere(1)).unwrap();
    assert_eq!(mesh.vertex_count(), VERTICES);
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    let features: Vec<f32> = (0..VERTICES * FEATURES).map(|_| rng.random_range(-1.0..1.0)).collect();
    let shape = |inputs| MlpShape { inputs, hidden: vec![HIDDEN; 2], outputs: 3, activation };
    let theta = Mlp::kaiming(shape(THETA_INPUTS), &mut rng);
    let phi_inputs = match reverse_map {
        ReverseMap::Plain | ReverseMap::Residual | ReverseMap::ClosestPoint => Some(PHI_INPUTS),
        ReverseMap::Encoding => Some(THETA_INPUTS + PHI_INPUTS),
        ReverseMap::Inverse => None,
    };
    let phi = phi_inputs.map(|inputs| Mlp::kaiming(shape(inputs), &mut rng));
    let (mut places, mut targets, mut origins) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..SAMPLES {
        let mut place = || {
            let (a, b) = (rng.random_range(0.0..0.5_f32), rng.random_range(0.0..0.5_f32));
            Place { face: Face(rng.random_range(0..80)), barycentric: [1.0 - a - b, a, b] }
        };
        places.push(place());
        let place = place();
        let mut point = || Vec3::from([0; 3].map(|_| rng.random_range(-1.0..1.0_f32)));
        let unit = |v: Vec3| v / v.length();
        targets.push(Target { foot: point(), normal: unit(point()), surface_normal: unit(point()) });
        origins.push(Origin { place, point: point(), image: point(), normal: unit(point()) });
    }
    let base = Base::new(&mesh, BaseOrder::identity(&mesh));
    let field = NetworkShape { features: FEATURES, octaves: OCTAVES, hidden: vec![HIDDEN; 2], activation };
    let settings = Settings {
        field: FieldShape::from(field.clone()),
        reverse_map,
        reverse_octaves: REVERSE_OCTAVES,
        lambda_c: LAMBDA_C,
        ..Settings::default()
    };
    let weighted = weights.into_iter().zip(terms()).filter(|(w, _)| *w > 0.0);
    let mut active: Vec<Active> = weighted.map(|(weight, term)| Active::new(weight, term)).collect();
    let mut cycle = Active::new(LAMBDA_C, Arc::new(Cycle::new(&settings)));
    let own = cycle.term.network(0).map(|mlp| mlp.shape().clone());
    assert_eq!(own.as_ref(), phi.as_ref().map(Mlp::shape));
    cycle.network = phi.as_ref().map(Packed::new);
    cycle.by_network = vec![0.0; phi.as_ref().map_or(0, |phi| phi.parameters().len())];
    cycle.prepared = Some(Box::new(origins.clone()));
    active.push(cycle);

    let packed = Packed::new(&theta);
    let mut chunk = Chunk::new(&packed, &active, FEATURES);
    let mut by_corner = vec![0.0; 3 * FEATURES * mesh.face_count()];
    let encoding = IntrinsicEncoding::new(&base.faces, &base.positions, &features, &field);
    pulp::Arch::new().dispatch(Step {
        shared: Shared {
            base: &base,
            residual: true,
            epoch: Epoch { number: 0, of: 1 },
            terms: &active,
            share: 1.0 / SAMPLES as f32,
        },
        network: Network { encoding, packed: &packed },
        chunk: &mut chunk,
        places: &places,
        targets: &targets,
        first: 0,
        corners: CornerGradients { first_face: 0, by_corner: &mut by_corner, encoding },
    });

    let mut by_theta = vec![0.0; theta.parameters().len()];
    chunk.gradients().add_to(&mut by_theta);
    let cycle = active.last_mut().unwrap();
    cycle.collect(chunk.networks.last().unwrap().as_ref());
    let by_phi = cycle.by_network.clone();
    let mut by_features = vec![0.0; features.len()];
    let vertices = base.faces.iter().flatten();
    for (&vertex, gradient) in vertices.zip(by_corner.chunks_exact(FEATURES)) {
        let of_vertex = &mut by_features[vertex as usize * FEATURES..][..FEATURES];
        of_vertex.iter_mut().zip(gradient).for_each(|(to, from)| *to += from);
    }
    let sums = active.iter().zip(&chunk.sums).map(|(active, sum)| f64::from(active.weight) * sum);
    let loss = sums.sum::<f64>() / SAMPLES as f64;
    Case {
        base,
        places,
        targets,
        origins,
        reverse_map,
        features,
        theta,
        phi,
        loss,
        by_features,
        by_theta,
        by_phi,
    }
}

/// Largest difference, relative to the largest entry of the truth.
fn relative_error(found: &[f32], truth: &[f64]) -> f64 {
    let largest = truth.iter().fold(0.0_f64, |m, t| m.max(t.abs()));
    let error = found.iter().zip(truth).fold(0.0_f64, |m, (f, t)| m.max((f64::from(*f) - t).abs()));
    if largest == 0.0 { error } else { error / largest }
}
