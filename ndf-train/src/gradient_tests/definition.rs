//! The objective of an epoch by its definition, for numbers of any kind: plain ones, and those on a tape.

use std::ops::{Add, Div, Mul, Sub};

use ndf_core::glam::Vec3;
use ndf_network::{Activation, MlpShape};

use super::{Case, FEATURES, LAMBDA_C, OCTAVES, REVERSE_OCTAVES, SAMPLES, Weights};
use crate::objective::Place;
use crate::objective::origin::Origin;
use crate::settings::ReverseMap;
use crate::tape::Var;
use ndf_mesh::Face;

/// What the definition computes with.
pub(super) trait Number:
    Copy + From<f64> + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    fn value(self) -> f64;
    /// A function, by its value and derivative at this number.
    fn map(self, value: f64, derivative: f64) -> Self;
}

impl Number for f64 {
    fn value(self) -> f64 {
        self
    }

    fn map(self, value: f64, _: f64) -> Self {
        value
    }
}

impl Number for Var<'_> {
    fn value(self) -> f64 {
        self.value()
    }

    fn map(self, value: f64, derivative: f64) -> Self {
        self.map(value, derivative)
    }
}

type Vector<T> = [T; 3];

fn dot<T: Number>(a: Vector<T>, b: Vector<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross<T: Number>(a: Vector<T>, b: Vector<T>) -> Vector<T> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn minus<T: Number>(a: Vector<T>, b: Vector<T>) -> Vector<T> {
    [0, 1, 2].map(|c| a[c] - b[c])
}

fn wide<T: Number>(v: [f32; 3]) -> Vector<T> {
    v.map(|x| f64::from(x).into())
}

/// Value, slope and second derivative of an activation.
fn jet(activation: Activation, x: f64) -> [f64; 3] {
    let below = if x > 0.0 { 1.0 } else { 0.01 };
    match activation {
        Activation::Relu => [x.max(0.0), f64::from(x > 0.0), 0.0],
        Activation::LeakyRelu => [below * x, below, 0.0],
        Activation::Silu => {
            let s = 1.0 / (1.0 + (-x).exp());
            let ds = s * (1.0 - s);
            [x * s, s + x * ds, ds * (2.0 + x * (1.0 - 2.0 * s))]
        }
        Activation::Sine => [x.sin(), x.cos(), -x.sin()],
        Activation::Tanh => {
            let slope = 1.0 - x.tanh().powi(2);
            [x.tanh(), slope, -2.0 * x.tanh() * slope]
        }
    }
}

/// Value and derivative in a direction of a network.
fn network<T: Number>(shape: &MlpShape, parameters: &[T], mut h: Vec<T>, mut t: Vec<T>) -> (Vec<T>, Vec<T>) {
    let zero = T::from(0.0);
    let mut rest = parameters;
    let layers = shape.layers();
    for (l, (inputs, outputs)) in layers.iter().enumerate() {
        let (weights, after) = rest.split_at(inputs * outputs);
        let (bias, after) = after.split_at(*outputs);
        rest = after;
        let row = |j: usize, x: &[T]| (0..*inputs).fold(zero, |sum, i| sum + weights[j * inputs + i] * x[i]);
        let mut y: Vec<T> = (0..*outputs).map(|j| row(j, &h) + bias[j]).collect();
        let mut s: Vec<T> = (0..*outputs).map(|j| row(j, &t)).collect();
        if l + 1 < layers.len() {
            for (y, s) in y.iter_mut().zip(&mut s) {
                let [value, slope, curvature] = jet(shape.activation, y.value());
                *s = y.map(slope, curvature) * *s;
                *y = y.map(value, slope);
            }
        }
        (h, t) = (y, s);
    }
    (h, t)
}

/// Positional encoding and its derivative in a direction.
fn encode<T: Number>(x: Vector<T>, dx: Vector<T>, octaves: usize) -> (Vec<T>, Vec<T>) {
    let angles = |scale: Vector<T>| {
        let frequency = |k: usize| T::from(std::f64::consts::PI * f64::from(1 << k));
        (0..octaves).flat_map(move |k| scale.map(|x| frequency(k) * x))
    };
    let sine = |x: T| x.map(x.value().sin(), x.value().cos());
    let cosine = |x: T| x.map(x.value().cos(), -x.value().sin());
    let by_sine = angles(x).zip(angles(dx)).map(|(a, d)| cosine(a) * d);
    let by_cosine = angles(x).zip(angles(dx)).map(|(a, d)| T::from(0.0) - sine(a) * d);
    let values = angles(x).map(sine).chain(angles(x).map(cosine)).collect();
    (values, by_sine.chain(by_cosine).collect())
}

/// What g is given at the point with these barycentric coordinates, and x at the same.
type Encoded<T> = (Vec<T>, Vector<T>);

/// The encoding of a point, and its derivative in the direction `along`.
fn encoding<T: Number>(
    e: &Case,
    features: &[T],
    face: Face,
    at: Vector<T>,
    along: Vector<T>,
) -> [Encoded<T>; 2] {
    let zero = T::from(0.0);
    let (mut z, mut dz) = (vec![zero; FEATURES], vec![zero; FEATURES]);
    let (mut x, mut dx) = ([zero; 3], [zero; 3]);
    for (c, v) in e.base.faces[face.index()].iter().enumerate() {
        for k in 0..FEATURES {
            let feature = features[*v as usize * FEATURES + k];
            z[k] = z[k] + at[c] * feature;
            dz[k] = dz[k] + along[c] * feature;
        }
        let position: Vector<T> = wide(e.base.positions[*v as usize]);
        for k in 0..3 {
            x[k] = x[k] + at[c] * position[k];
            dx[k] = dx[k] + along[c] * position[k];
        }
    }
    let (code, dcode) = encode(x, dx, OCTAVES);
    [([z, x.to_vec(), code].concat(), x), ([dz, dx.to_vec(), dcode].concat(), dx)]
}

/// What is known of a point: z, x, g(x) and the derivative of g.
struct Point<T> {
    z: Vec<T>,
    x: Vector<T>,
    y: Vector<T>,
    along: Vector<T>,
}

/// The point of a face with these barycentric coordinates, g derived in the direction `along` of the same.
fn g<T: Number>(
    e: &Case,
    features: &[T],
    theta: &[T],
    face: Face,
    at: Vector<T>,
    along: Vector<T>,
) -> Point<T> {
    let [(input, x), (dinput, dx)] = encoding(e, features, face, at, along);
    let z = input[..FEATURES].to_vec();
    let (out, dout) = network(e.theta.shape(), theta, input, dinput);
    let [y, along] = [(x, out), (dx, dout)].map(|(x, out)| [0, 1, 2].map(|c| x[c] + out[c]));
    Point { z, x, y, along }
}

/// g_φ(y); the features of the closest base point are those of the epoch, whatever is differentiated by.
fn reverse<T: Number>(e: &Case, phi: &[T], y: Vector<T>, origin: &Origin) -> Vector<T> {
    let of = |v: Vec3| wide::<T>(v.to_array());
    let (point, image, normal) = (of(origin.point), of(origin.image), of(origin.normal));
    let away = minus(y, image);
    let zero = T::from(0.0);
    let start = match e.reverse_map {
        ReverseMap::Plain => [zero; 3],
        ReverseMap::Residual => y,
        ReverseMap::ClosestPoint | ReverseMap::Encoding | ReverseMap::Inverse => {
            [0, 1, 2].map(|c| point[c] + away[c] - dot(normal, away) * normal[c])
        }
    };
    let Some(mlp) = &e.phi else { return start };
    let features: Vec<T> = e.features.iter().map(|&f| f64::from(f).into()).collect();
    let Place { face, barycentric } = origin.place;
    let [(of_place, _), _] = encoding(e, &features, face, wide(barycentric), [zero; 3]);
    let prefix = if e.reverse_map == ReverseMap::Encoding { of_place } else { Vec::new() };
    let (code, _) = encode(y, [zero; 3], REVERSE_OCTAVES);
    let input = [prefix, y.to_vec(), code].concat();
    let zeros = vec![zero; input.len()];
    let (out, _) = network(mlp.shape(), phi, input, zeros);
    [0, 1, 2].map(|c| start[c] + out[c])
}

/// The objective.
pub(super) fn loss<T: Number>(e: &Case, weights: Weights, features: &[T], theta: &[T], phi: &[T]) -> T {
    let of = |v: Vec3| wide::<T>(v.to_array());
    let square = |v: Vector<T>| dot(v, v);
    let mut total = T::from(0.0);
    for ((place, target), origin) in e.places.iter().zip(&e.targets).zip(&e.origins) {
        let [u, v] = e.base.frames[place.face.index()];
        let along = |d: [f32; 3]| g(e, features, theta, place.face, wide(place.barycentric), wide(d));
        let (Point { z, x, y, along: ju }, Point { along: jv, .. }) = (along(u), along(v));
        let cycle = square(minus(reverse(e, phi, y, origin), x));

        let away = minus(y, of(target.foot));
        let (normal, outward) = (of(target.normal), of(target.surface_normal));
        let height = dot(normal, away);
        let area = cross(ju, jv);
        let stretch = square(area);
        let root = stretch.value().sqrt();
        let length = stretch.map(root, 0.5 / root);
        let trace = square(ju) + square(jv);
        let t = T::from(-10.0) * dot(outward, area) / trace;
        let power = t.value().exp();
        let values = [
            height * height,
            square(away),
            trace,
            square(minus(area.map(|a| a / length), outward)),
            t.map(power.ln_1p() / 10.0, power / (1.0 + power) / 10.0),
            z.iter().fold(T::from(0.0), |sum, &z| sum + z * z),
        ];
        for (value, weight) in values.into_iter().zip(weights) {
            total = total + value * f64::from(weight).into();
        }
        total = total + cycle * f64::from(LAMBDA_C).into();
    }
    total / (SAMPLES as f64).into()
}
