//! The hand-derived gradients of a whole epoch against two independent truths: dfdx's tape, and central
//! differences of the objective written down in f64.

mod differences;
mod tape;

use std::sync::Arc;

use ndf_mesh::ManifoldMesh;
use ndf_mesh::shapes;
use ndf_model::NetworkShape;
use ndf_model::intrinsic_network::{IntrinsicEncoding, single};
use ndf_network::{Activation, Mlp, MlpShape, Packed};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use crate::base::frame;
use crate::batch::Sample;
use crate::objective::Objective;
use crate::origin::Origin;
use crate::settings::ReverseMap;
use crate::step::{Chunk, Model, Step};
use crate::terms::{
    Conformal, Dirichlet, LossTerm, NormalAlignment, PointTarget, ProjectionDistance, Target,
};

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
type Weights = [f32; 5];

fn terms() -> [Arc<dyn LossTerm>; 5] {
    [
        Arc::new(ProjectionDistance),
        Arc::new(PointTarget),
        Arc::new(Dirichlet),
        Arc::new(NormalAlignment),
        Arc::new(Conformal),
    ]
}

/// One epoch's inputs, chosen at random, and its gradients as the program derives them.
struct Epoch {
    faces: Vec<[u32; 3]>,
    positions: Vec<[f32; 3]>,
    frames: Vec<[[f32; 3]; 2]>,
    samples: Vec<Sample>,
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

fn epoch(weights: Weights, reverse_map: ReverseMap, activation: Activation) -> Epoch {
    let base = ManifoldMesh::try_from(shapes::icosphere(1)).unwrap();
    assert_eq!(base.vertex_count(), VERTICES);
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
    let mut samples = Vec::new();
    let (mut targets, mut origins) = (Vec::new(), Vec::new());
    for _ in 0..SAMPLES {
        let mut place = || {
            let (a, b) = (rng.random_range(0.0..0.5_f32), rng.random_range(0.0..0.5_f32));
            Sample { face: rng.random_range(0..80), barycentric: [1.0 - a - b, a, b] }
        };
        samples.push(place());
        let place = place();
        let mut point = || [0; 3].map(|_| rng.random_range(-1.0..1.0_f32));
        let unit = |v: [f32; 3]| v.map(|x| x / v.iter().map(|x| x * x).sum::<f32>().sqrt());
        targets.push(Target { foot: point(), normal: unit(point()), surface_normal: unit(point()) });
        origins.push(Origin { place, point: point(), image: point(), normal: unit(point()) });
    }
    let positions = single(base.positions());
    let frames: Vec<[[f32; 3]; 2]> =
        (0..base.face_count() as u32).map(|f| frame(base.corner_positions(f))).collect();
    let packed = (Packed::new(&theta), phi.as_ref().map(Packed::new));
    let weighted_terms = weights.into_iter().zip(terms()).filter(|(w, _)| *w > 0.0).collect();
    let objective = Objective { terms: weighted_terms, lambda_c: LAMBDA_C, is_identity: false };
    let mut chunk = Chunk::new(&packed.0, packed.1.as_ref(), &objective);
    let mut corners = vec![0.0; 3 * FEATURES * base.face_count()];
    let shape = NetworkShape { features: FEATURES, octaves: OCTAVES, ..NetworkShape::default() };
    let encoding = IntrinsicEncoding::new(base.faces(), &positions, &features, &shape);
    let model = Model {
        encoding,
        frames: &frames,
        theta: &packed.0,
        phi: packed.1.as_ref(),
        reverse_map,
        reverse_octaves: REVERSE_OCTAVES,
        residual: true,
    };
    pulp::Arch::new().dispatch(Step {
        model,
        objective: &objective,
        share: 1.0 / SAMPLES as f32,
        chunk: &mut chunk,
        samples: &samples,
        targets: &targets,
        origins: &origins,
        first_face: 0,
        corner_gradients: &mut corners,
    });

    let mut by_theta = vec![0.0; theta.parameters().len()];
    chunk.theta_gradients.add_to(&mut by_theta);
    let mut by_phi = vec![0.0; phi.as_ref().map_or(0, |phi| phi.parameters().len())];
    if let Some(network) = &chunk.phi {
        network.gradients.add_to(&mut by_phi);
    }
    let mut by_features = vec![0.0; features.len()];
    let vertices = base.faces().iter().flatten();
    for (&vertex, gradient) in vertices.zip(corners.chunks_exact(FEATURES)) {
        let of_vertex = &mut by_features[vertex as usize * FEATURES..][..FEATURES];
        of_vertex.iter_mut().zip(gradient).for_each(|(to, from)| *to += from);
    }
    let sums = objective.terms.iter().zip(&chunk.terms).map(|((w, _), sum)| f64::from(*w) * sum);
    let weighted = sums.sum::<f64>() + f64::from(LAMBDA_C) * chunk.cycle;
    Epoch {
        faces: base.faces().to_vec(),
        positions,
        frames,
        samples,
        targets,
        origins,
        reverse_map,
        features,
        theta,
        phi,
        loss: weighted / SAMPLES as f64,
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
