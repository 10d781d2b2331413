//! Agreement with central differences, in f64.

use ndf_network::{Activation, Mlp, MlpShape};
use rayon::prelude::*;

use crate::batch::Sample;
use crate::origin::Origin;
use crate::settings::ReverseMap;

use super::{
    Epoch, FEATURES, LAMBDA_C, LAMBDA_P, OCTAVES, REVERSE_OCTAVES, SAMPLES, Weights, epoch, relative_error,
};

type Vector = [f64; 3];

fn dot(a: Vector, b: Vector) -> f64 {
    (0..3).map(|c| a[c] * b[c]).sum()
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Value and slope of an activation, by the definition.
fn activate(activation: Activation, x: f64) -> (f64, f64) {
    let below = if x > 0.0 { 1.0 } else { 0.01 };
    match activation {
        Activation::Relu => (x.max(0.0), f64::from(x > 0.0)),
        Activation::LeakyRelu => (below * x, below),
        Activation::Silu => {
            let s = 1.0 / (1.0 + (-x).exp());
            (x * s, s + x * s * (1.0 - s))
        }
        Activation::Sine => (x.sin(), x.cos()),
        Activation::Tanh => (x.tanh(), 1.0 - x.tanh().powi(2)),
    }
}

/// Value and derivative in a direction of a network, by the definition.
fn network(shape: &MlpShape, parameters: &[f64], mut h: Vec<f64>, mut t: Vec<f64>) -> (Vec<f64>, Vec<f64>) {
    let mut rest = parameters;
    let layers = shape.layers();
    for (l, (inputs, outputs)) in layers.iter().enumerate() {
        let (weights, after) = rest.split_at(inputs * outputs);
        let (bias, after) = after.split_at(*outputs);
        rest = after;
        let row = |j: usize, x: &[f64]| (0..*inputs).map(|i| weights[j * inputs + i] * x[i]).sum::<f64>();
        let mut y: Vec<f64> = (0..*outputs).map(|j| row(j, &h) + bias[j]).collect();
        let mut s: Vec<f64> = (0..*outputs).map(|j| row(j, &t)).collect();
        if l + 1 < layers.len() {
            for (y, s) in y.iter_mut().zip(&mut s) {
                let (value, slope) = activate(shape.activation, *y);
                (*y, *s) = (value, slope * *s);
            }
        }
        (h, t) = (y, s);
    }
    (h, t)
}

/// Positional encoding and its derivative in a direction, by the definition.
fn encode(x: Vector, dx: Vector, octaves: usize) -> (Vec<f64>, Vec<f64>) {
    let angles = |scale: Vector| {
        (0..octaves).flat_map(move |k| scale.map(|x| std::f64::consts::PI * f64::from(1 << k) * x))
    };
    let sines = angles(x).map(f64::sin);
    let cosines = angles(x).map(f64::cos);
    let by_sine = angles(x).zip(angles(dx)).map(|(a, d)| a.cos() * d);
    let by_cosine = angles(x).zip(angles(dx)).map(|(a, d)| -a.sin() * d);
    (sines.chain(cosines).collect(), by_sine.chain(by_cosine).collect())
}

/// What g is given at the point with these barycentric coordinates, x at the same, and the derivatives of both in the
/// direction `along`.
fn encoding(e: &Epoch, features: &[f64], face: u32, at: Vector, along: Vector) -> [(Vec<f64>, Vector); 2] {
    let (mut z, mut dz) = (vec![0.0; FEATURES], vec![0.0; FEATURES]);
    let (mut x, mut dx) = ([0.0; 3], [0.0; 3]);
    for (c, v) in e.faces[face as usize].iter().enumerate() {
        for k in 0..FEATURES {
            z[k] += at[c] * features[*v as usize * FEATURES + k];
            dz[k] += along[c] * features[*v as usize * FEATURES + k];
        }
        for k in 0..3 {
            x[k] += at[c] * f64::from(e.positions[*v as usize][k]);
            dx[k] += along[c] * f64::from(e.positions[*v as usize][k]);
        }
    }
    let (code, dcode) = encode(x, dx, OCTAVES);
    [([z, x.to_vec(), code].concat(), x), ([dz, dx.to_vec(), dcode].concat(), dx)]
}

/// x, g(x) and the derivative of g, at the point with these barycentric coordinates, in the direction `along` of the
/// same.
fn g(e: &Epoch, features: &[f64], theta: &[f64], face: u32, at: Vector, along: Vector) -> [Vector; 3] {
    let [(input, x), (dinput, dx)] = encoding(e, features, face, at, along);
    let (out, dout) = network(e.theta.shape(), theta, input, dinput);
    [x, [0, 1, 2].map(|c| x[c] + out[c]), [0, 1, 2].map(|c| dx[c] + dout[c])]
}

/// g_φ(y); the features of the closest base point are those of the epoch, whatever is differentiated by.
fn reverse(e: &Epoch, phi: &[f64], y: Vector, origin: &Origin) -> Vector {
    let wide = |v: [f32; 3]| v.map(f64::from);
    let (point, image, normal) = (wide(origin.point), wide(origin.image), wide(origin.normal));
    let away = [0, 1, 2].map(|c| y[c] - image[c]);
    let start = match e.reverse_map {
        ReverseMap::Plain => [0.0; 3],
        ReverseMap::Residual => y,
        ReverseMap::ClosestPoint | ReverseMap::Encoding | ReverseMap::Inverse => {
            [0, 1, 2].map(|c| point[c] + away[c] - dot(normal, away) * normal[c])
        }
    };
    let Some(mlp) = &e.phi else { return start };
    let features: Vec<f64> = e.features.iter().map(|&f| f64::from(f)).collect();
    let Sample { face, barycentric } = origin.place;
    let [(of_place, _), _] = encoding(e, &features, face, wide(barycentric), [0.0; 3]);
    let prefix = if e.reverse_map == ReverseMap::Encoding { of_place } else { Vec::new() };
    let (code, _) = encode(y, [0.0; 3], REVERSE_OCTAVES);
    let input = [prefix, y.to_vec(), code].concat();
    let zeros = vec![0.0; input.len()];
    let (out, _) = network(mlp.shape(), phi, input, zeros);
    [0, 1, 2].map(|c| start[c] + out[c])
}

/// The objective by its definition.
fn loss(e: &Epoch, weights: Weights, features: &[f64], theta: &[f64], phi: &[f64]) -> f64 {
    let wide = |v: [f32; 3]| v.map(f64::from);
    let mut total = 0.0;
    for ((sample, target), origin) in e.samples.iter().zip(&e.targets).zip(&e.origins) {
        let [u, v] = e.frames[sample.face as usize];
        let along = |d: [f32; 3]| g(e, features, theta, sample.face, wide(sample.barycentric), wide(d));
        let ([x, y, ju], [_, _, jv]) = (along(u), along(v));
        let back = reverse(e, phi, y, origin);
        let cycle: f64 = (0..3).map(|c| (back[c] - x[c]).powi(2)).sum();

        let away = [0, 1, 2].map(|c| y[c] - f64::from(target.foot[c]));
        let (normal, outward) = (wide(target.normal), wide(target.surface_normal));
        let area = cross(ju, jv);
        let n = area.map(|a| a / dot(area, area).sqrt());
        let trace = dot(ju, ju) + dot(jv, jv);
        let t = -dot(outward, area) / trace;
        let values = [
            dot(normal, away).powi(2),
            dot(away, away),
            trace,
            (0..3).map(|c| (n[c] - outward[c]).powi(2)).sum(),
            (10.0 * t).exp().ln_1p() / 10.0,
        ];
        total += values.iter().zip(weights).map(|(v, w)| v * f64::from(w)).sum::<f64>();
        total += f64::from(LAMBDA_C) * cycle;
    }
    total / SAMPLES as f64
}

/// Every term alone and all of them together, by every group of parameters.
#[test]
fn gradients_agree_with_central_differences() {
    let alone = |k: usize| std::array::from_fn(|i| if i == k { LAMBDA_P } else { 0.0 });
    let together = [3.0, 0.2, 0.1, 0.5, 2.0];
    let (residual, relu) = (ReverseMap::Residual, Activation::Relu);
    let mut cases: Vec<_> = (0..5).map(|k| (alone(k), residual, relu)).collect();
    let maps =
        [ReverseMap::Plain, residual, ReverseMap::ClosestPoint, ReverseMap::Encoding, ReverseMap::Inverse];
    cases.extend(maps.map(|map| (together, map, relu)));
    cases.extend(Activation::ALL.map(|activation| (together, residual, activation)));
    for (weights, reverse_map, activation) in cases {
        let e = epoch(weights, reverse_map, activation);
        let wide = |x: &[f32]| x.iter().map(|&v| f64::from(v)).collect::<Vec<_>>();
        let phi = e.phi.as_ref().map_or(&[][..], Mlp::parameters);
        let groups = [wide(&e.features), wide(e.theta.parameters()), wide(phi)];
        let value = loss(&e, weights, &groups[0], &groups[1], &groups[2]);
        let case = format!("{weights:?}, {reverse_map:?}, {activation:?}");
        assert!((value - e.loss).abs() < 1e-6 * value, "{case}: {value} {}", e.loss);
        let h = 1e-7;
        for (group, found) in [&e.by_features, &e.by_theta, &e.by_phi].into_iter().enumerate() {
            let picks: Vec<usize> = (0..found.len()).step_by(11).collect();
            let slope = |&i: &usize| {
                let at = |h: f64| {
                    let mut moved = groups.clone();
                    moved[group][i] += h;
                    loss(&e, weights, &moved[0], &moved[1], &moved[2])
                };
                (at(h) - at(-h)) / (2.0 * h)
            };
            let truth: Vec<f64> = picks.par_iter().map(slope).collect();
            let found: Vec<f32> = picks.iter().map(|&i| found[i]).collect();
            let error = relative_error(&found, &truth);
            assert!(error < 1e-5, "{case}, group {group}: {error:.1e}");
        }
    }
}
