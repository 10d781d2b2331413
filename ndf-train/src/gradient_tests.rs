//! The hand-derived gradients of a whole epoch against two independent truths: dfdx's tape, and central
//! differences of the losses written down in f64.

use dfdx::prelude::*;
use ndf_core::ManifoldMesh;
use ndf_core::field::{SampleEncoding, sample_encoding};
use ndf_core::mesh::shapes;
use ndf_core::network::{Mlp, MlpShape, Packed};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use crate::batch::{Sample, Target};
use crate::step::{Chunk, Model, Step};

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

/// One epoch's inputs, chosen at random, and its gradients as the program derives them.
struct Epoch {
    faces: Vec<[u32; 3]>,
    positions: Vec<[f32; 3]>,
    samples: Vec<Sample>,
    targets: Vec<Target>,
    features: Vec<f32>,
    theta: Mlp,
    phi: Mlp,
    loss: f64,
    by_features: Vec<f32>,
    by_theta: Vec<f32>,
    by_phi: Vec<f32>,
}

fn epoch() -> Epoch {
    let base = ManifoldMesh::try_from(shapes::icosphere(1)).unwrap();
    assert_eq!(base.vertex_count(), VERTICES);
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    let features: Vec<f32> = (0..VERTICES * FEATURES).map(|_| rng.random_range(-1.0..1.0)).collect();
    let shape = |inputs| MlpShape { inputs, hidden: vec![HIDDEN; 2], outputs: 3 };
    let theta = Mlp::kaiming(shape(THETA_INPUTS), &mut rng);
    let phi = Mlp::kaiming(shape(PHI_INPUTS), &mut rng);
    let mut samples = Vec::new();
    let mut targets = Vec::new();
    for _ in 0..SAMPLES {
        let (a, b) = (rng.random_range(0.0..0.5_f32), rng.random_range(0.0..0.5_f32));
        samples.push(Sample { face: rng.random_range(0..80), barycentric: [1.0 - a - b, a, b] });
        let mut point = || [0; 3].map(|_| rng.random_range(-1.0..1.0_f32));
        let (foot, n) = (point(), point());
        let length = n.iter().map(|x| x * x).sum::<f32>().sqrt();
        targets.push(Target { foot, normal: n.map(|x| x / length) });
    }
    let positions = sample_encoding::single(base.positions());
    let packed = (Packed::new(&theta), Packed::new(&phi));
    let mut chunk = Chunk::new(&packed.0, &packed.1);
    let mut dz = vec![0.0; SAMPLES * FEATURES];
    let model = Model {
        encoding: SampleEncoding {
            faces: base.faces(),
            positions: &positions,
            features: &features,
            dimension: FEATURES,
            octaves: OCTAVES,
        },
        theta: &packed.0,
        phi: &packed.1,
        reverse_octaves: REVERSE_OCTAVES,
        residual: true,
        projection_weight: LAMBDA_P / SAMPLES as f32,
        cycle_weight: LAMBDA_C / SAMPLES as f32,
    };
    let step =
        Step { model, chunk: &mut chunk, samples: &samples, targets: &targets, encoding_gradients: &mut dz };
    pulp::Arch::new().dispatch(step);

    let mut by_theta = vec![0.0; theta.parameters().len()];
    let mut by_phi = vec![0.0; phi.parameters().len()];
    chunk.theta_gradients.add_to(&mut by_theta);
    chunk.phi_gradients.add_to(&mut by_phi);
    let mut by_features = vec![0.0; features.len()];
    for (sample, dz) in samples.iter().zip(dz.chunks_exact(FEATURES)) {
        for (c, v) in base.faces()[sample.face as usize].iter().enumerate() {
            for (k, dz) in dz.iter().enumerate() {
                by_features[*v as usize * FEATURES + k] += sample.barycentric[c] * dz;
            }
        }
    }
    let weighted = f64::from(LAMBDA_P) * chunk.losses.projection + f64::from(LAMBDA_C) * chunk.losses.cycle;
    Epoch {
        faces: base.faces().to_vec(),
        positions,
        samples,
        targets,
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
    error / largest
}

/// The losses by their definition, in f64.
fn loss(e: &Epoch, features: &[f64], theta: &[f64], phi: &[f64]) -> f64 {
    let encode = |x: [f64; 3], octaves: usize| -> Vec<f64> {
        let octave = |k: usize| {
            let t = x.map(|x| std::f64::consts::PI * f64::from(1 << k) * x);
            [t.map(f64::sin), t.map(f64::cos)].concat()
        };
        (0..octaves).flat_map(octave).collect()
    };
    let mlp = |shape: &MlpShape, parameters: &[f64], mut h: Vec<f64>| {
        let mut rest = parameters;
        let layers = shape.layers();
        for (l, (inputs, outputs)) in layers.iter().enumerate() {
            let (weights, after) = rest.split_at(inputs * outputs);
            let (bias, after) = after.split_at(*outputs);
            rest = after;
            let row = |j: usize| (0..*inputs).map(|i| weights[j * inputs + i] * h[i]).sum::<f64>() + bias[j];
            let y = (0..*outputs).map(row);
            h = if l + 1 < layers.len() { y.map(|y| y.max(0.0)).collect() } else { y.collect() };
        }
        h
    };
    let mut total = 0.0;
    for (sample, target) in e.samples.iter().zip(&e.targets) {
        let mut z = vec![0.0; FEATURES];
        let mut x = [0.0; 3];
        for (c, v) in e.faces[sample.face as usize].iter().enumerate() {
            let b = f64::from(sample.barycentric[c]);
            for k in 0..FEATURES {
                z[k] += b * features[*v as usize * FEATURES + k];
            }
            for k in 0..3 {
                x[k] += b * f64::from(e.positions[*v as usize][k]);
            }
        }
        let out = mlp(e.theta.shape(), theta, [z, x.to_vec(), encode(x, OCTAVES)].concat());
        let y = [0, 1, 2].map(|c| x[c] + out[c]);
        let back = mlp(e.phi.shape(), phi, [y.to_vec(), encode(y, REVERSE_OCTAVES)].concat());
        let height: f64 =
            (0..3).map(|c| f64::from(target.normal[c]) * (y[c] - f64::from(target.foot[c]))).sum();
        let cycle: f64 = (0..3).map(|c| (y[c] + back[c] - x[c]).powi(2)).sum();
        total += f64::from(LAMBDA_P) * height * height + f64::from(LAMBDA_C) * cycle;
    }
    total / SAMPLES as f64
}

#[test]
fn gradients_agree_with_central_differences() {
    let e = epoch();
    let wide = |x: &[f32]| x.iter().map(|&v| f64::from(v)).collect::<Vec<_>>();
    let groups = [wide(&e.features), wide(e.theta.parameters()), wide(e.phi.parameters())];
    let value = loss(&e, &groups[0], &groups[1], &groups[2]);
    assert!((value - e.loss).abs() < 1e-6 * value, "{value} {}", e.loss);
    let h = 1e-7;
    for (g, found) in [&e.by_features, &e.by_theta, &e.by_phi].into_iter().enumerate() {
        let picks: Vec<usize> = (0..found.len()).step_by(5).collect();
        let slope = |&i: &usize| {
            let at = |h: f64| {
                let mut moved = groups.clone();
                moved[g][i] += h;
                loss(&e, &moved[0], &moved[1], &moved[2])
            };
            (at(h) - at(-h)) / (2.0 * h)
        };
        let truth: Vec<f64> = picks.iter().map(slope).collect();
        let found: Vec<f32> = picks.iter().map(|&i| found[i]).collect();
        let error = relative_error(&found, &truth);
        assert!(error < 1e-5, "group {g}: {error:.1e}");
    }
}

type Matrix<const M: usize, const N: usize, T = NoneTape> = Tensor<Rank2<M, N>, f32, Cpu, T>;
type Taped = OwnedTape<f32, Cpu>;

/// A network as dfdx's tensors: the first layer's weights in blocks of columns, as its inputs are blocks.
struct Network<const INPUTS: usize> {
    first: Matrix<INPUTS, HIDDEN>,
    second: Matrix<HIDDEN, HIDDEN>,
    third: Matrix<HIDDEN, 3>,
    biases: (Matrix<1, HIDDEN>, Matrix<1, HIDDEN>, Matrix<1, 3>),
}

/// Rows become columns.
fn transposed(a: &[f32], columns: usize) -> Vec<f32> {
    (0..columns).flat_map(|j| a.iter().skip(j).step_by(columns).copied()).collect()
}

impl<const INPUTS: usize> Network<INPUTS> {
    fn new(device: &Cpu, mlp: &Mlp) -> Self {
        let mut rest = mlp.parameters();
        let mut take = |n: usize| {
            let (head, tail) = rest.split_at(n);
            rest = tail;
            head.to_vec()
        };
        let (w1, b1) = (take(HIDDEN * INPUTS), take(HIDDEN));
        let (w2, b2) = (take(HIDDEN * HIDDEN), take(HIDDEN));
        let (w3, b3) = (take(3 * HIDDEN), take(3));
        Self {
            first: device.tensor(transposed(&w1, INPUTS)),
            second: device.tensor(transposed(&w2, HIDDEN)),
            third: device.tensor(transposed(&w3, HIDDEN)),
            biases: (device.tensor(b1), device.tensor(b2), device.tensor(b3)),
        }
    }

    /// The network of inputs that come in blocks of columns, each with the first of its rows of weights.
    fn apply(
        &self,
        ones: &Matrix<SAMPLES, 1>,
        first: Matrix<SAMPLES, HIDDEN, Taped>,
    ) -> Matrix<SAMPLES, 3, Taped> {
        let h = (first + ones.leaky_trace().matmul(self.biases.0.leaky_trace())).relu();
        let h = h.matmul(self.second.leaky_trace()) + ones.leaky_trace().matmul(self.biases.1.leaky_trace());
        h.relu().matmul(self.third.leaky_trace()) + ones.leaky_trace().matmul(self.biases.2.leaky_trace())
    }

    /// Gradients in the order of the parameters.
    fn gradients(&self, g: &Gradients<f32, Cpu>) -> Vec<f64> {
        let parts = [
            transposed(&g.get(&self.first).as_vec(), HIDDEN),
            g.get(&self.biases.0).as_vec(),
            transposed(&g.get(&self.second).as_vec(), HIDDEN),
            g.get(&self.biases.1).as_vec(),
            transposed(&g.get(&self.third).as_vec(), 3),
            g.get(&self.biases.2).as_vec(),
        ];
        parts.concat().into_iter().map(f64::from).collect()
    }
}

/// The encoding of `x` as dfdx writes it, times the rows of `weights` from `row` on.
fn encoded<const INPUTS: usize>(
    x: &Matrix<SAMPLES, 3, Taped>,
    octaves: usize,
    weights: &Matrix<INPUTS, HIDDEN>,
    row: usize,
) -> Matrix<SAMPLES, HIDDEN, Taped> {
    let device = x.device().clone();
    let rows = |first: usize| -> Matrix<3, HIDDEN, Taped> {
        weights.leaky_trace().gather(device.tensor([first, first + 1, first + 2]))
    };
    let mut sum = x.with_empty_tape().matmul(rows(row));
    for k in 0..octaves {
        let t = x.with_empty_tape() * (std::f32::consts::PI * (1 << k) as f32);
        let (sin, cos) = (t.with_empty_tape().sin(), t.cos());
        sum = sum + sin.matmul(rows(row + 3 + 6 * k));
        sum = sum + cos.matmul(rows(row + 6 + 6 * k));
    }
    sum
}

#[test]
fn gradients_agree_with_the_tape_of_dfdx() {
    let e = epoch();
    let device: Cpu = Cpu::default();
    let theta = Network::<THETA_INPUTS>::new(&device, &e.theta);
    let phi = Network::<PHI_INPUTS>::new(&device, &e.phi);
    let features: Matrix<VERTICES, FEATURES> = device.tensor(e.features.clone());
    let ones: Matrix<SAMPLES, 1> = device.ones();

    let mut z: Option<Matrix<SAMPLES, FEATURES, Taped>> = None;
    let mut x = vec![0.0; 3 * SAMPLES];
    for c in 0..3 {
        let corner = |s: &Sample| e.faces[s.face as usize][c] as usize;
        let indices: [usize; SAMPLES] = std::array::from_fn(|s| corner(&e.samples[s]));
        let barycentric: Vec<f32> = e.samples.iter().map(|s| s.barycentric[c]).collect();
        let b = barycentric.iter().flat_map(|&b| [b; FEATURES]).collect::<Vec<_>>();
        let b: Matrix<SAMPLES, FEATURES> = device.tensor(b);
        let corner_features: Matrix<SAMPLES, FEATURES, Taped> =
            features.leaky_trace().gather(device.tensor(indices));
        let part = corner_features * b;
        z = Some(match z {
            None => part,
            Some(sum) => sum + part,
        });
        for (s, v) in indices.iter().enumerate() {
            for k in 0..3 {
                x[3 * s + k] += barycentric[s] * e.positions[*v][k];
            }
        }
    }
    let z = z.expect("a face has corners");
    let x: Matrix<SAMPLES, 3> = device.tensor(x);

    let first_rows: [usize; FEATURES] = std::array::from_fn(|k| k);
    let of_z: Matrix<FEATURES, HIDDEN, Taped> = theta.first.leaky_trace().gather(device.tensor(first_rows));
    let first = z.matmul(of_z) + encoded(&x.leaky_trace(), OCTAVES, &theta.first, FEATURES);
    let y = theta.apply(&ones, first) + x.clone();
    let first = encoded(&y, REVERSE_OCTAVES, &phi.first, 0);
    let back = phi.apply(&ones, first) + y.with_empty_tape();

    let foot: Matrix<SAMPLES, 3> = device.tensor(e.targets.iter().flat_map(|t| t.foot).collect::<Vec<_>>());
    let normal: Matrix<SAMPLES, 3> =
        device.tensor(e.targets.iter().flat_map(|t| t.normal).collect::<Vec<_>>());
    let height = ((y - foot) * normal).sum::<Rank1<SAMPLES>, _>();
    let projection = height.square().sum::<Rank0, _>() * (LAMBDA_P / SAMPLES as f32);
    let cycle = (back - x).square().sum::<Rank0, _>() * (LAMBDA_C / SAMPLES as f32);
    let total = projection + cycle;
    assert!((f64::from(total.array()) - e.loss).abs() < 1e-5 * e.loss);
    let g = total.backward();

    let by_features: Vec<f64> = g.get(&features).as_vec().into_iter().map(f64::from).collect();
    for (name, found, truth) in [
        ("features", &e.by_features, by_features),
        ("theta", &e.by_theta, theta.gradients(&g)),
        ("phi", &e.by_phi, phi.gradients(&g)),
    ] {
        let error = relative_error(found, &truth);
        assert!(error < 1e-4, "{name}: {error:.1e}");
    }
}
