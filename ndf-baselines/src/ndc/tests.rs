use std::collections::HashMap;

use super::*;
use ndf_core::NoProgress;
use ndf_core::analytic::{Sphere, Torus};
use ndf_formats::tensors::{Tensor, TensorFile, to_safetensors};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// The layers of both variants: name, channels before and after, side.
fn layers(is_deep: bool) -> Vec<(String, [usize; 2], usize)> {
    let mut all = vec![("conv_0".to_owned(), [1, 64], 3)];
    for i in 1..=2 {
        all.push((format!("conv_{i}"), [64, 64], 3));
    }
    for i in 3..=4 {
        all.push((format!("conv_{i}"), [64, 64], 1));
    }
    all.push(("conv_out_float".to_owned(), [64, 3], 1));
    if is_deep {
        for i in 1..=8 {
            all.extend([1, 2].map(|k| (format!("res_{i}.conv_{k}"), [64, 64], 1)));
        }
    }
    all
}

/// A state with weights by a function.
fn state(is_deep: bool, mut weight: impl FnMut(usize) -> f32) -> TensorFile {
    let mut tensors = Vec::new();
    for (name, [before, after], side) in layers(is_deep) {
        let inputs = before * side * side * side;
        let values = (0..after * inputs).map(|_| weight(inputs)).collect();
        let shape = vec![after, before, side, side, side];
        tensors.push((format!("{name}.weight"), Tensor::new(shape, values).unwrap()));
        let bias = (0..after).map(|_| weight(inputs)).collect();
        tensors.push((format!("{name}.bias"), Tensor::new(vec![after], bias).unwrap()));
    }
    TensorFile::parse(&to_safetensors(&tensors).unwrap()).unwrap()
}

fn random_state(is_deep: bool) -> TensorFile {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    state(is_deep, |inputs| rng.random_range(-1.0_f32..1.0) * (3.0 / inputs as f32).sqrt())
}

/// The network by its definition, one number after another.
struct Plain<'a> {
    tensors: &'a TensorFile,
    is_deep: bool,
    distances: &'a dyn Fn([i32; 3]) -> f32,
    known: HashMap<(usize, [i32; 3]), Vec<f32>>,
}

impl Plain<'_> {
    fn layer(&self, name: &str, inputs: &[Vec<f32>]) -> Vec<f32> {
        let [weight, bias] =
            ["weight", "bias"].map(|part| self.tensors.get(&format!("{name}.{part}")).unwrap());
        let (before, taps) = (weight.shape()[1], inputs.len());
        let row = |o: usize| {
            let products = (0..before).flat_map(|c| (0..taps).map(move |t| (c, t)));
            let sum: f32 =
                products.map(|(c, t)| weight.values()[(o * before + c) * taps + t] * inputs[t][c]).sum();
            sum + bias.values()[o]
        };
        (0..weight.shape()[0]).map(row).collect()
    }

    fn residual(&self, i: usize, x: Vec<f32>) -> Vec<f32> {
        let inner = leaky(self.layer(&format!("res_{i}.conv_1"), std::slice::from_ref(&x)));
        let out = self.layer(&format!("res_{i}.conv_2"), &[inner]);
        leaky(out.iter().zip(x).map(|(a, b)| a + b).collect())
    }

    /// Channels after so many of the wide layers.
    fn after(&mut self, depth: usize, at: [i32; 3]) -> Vec<f32> {
        if depth == 0 {
            return vec![(self.distances)(at)];
        }
        if let Some(known) = self.known.get(&(depth, at)) {
            return known.clone();
        }
        let mut inputs = Vec::new();
        for x in -1..=1 {
            for y in -1..=1 {
                for z in -1..=1 {
                    inputs.push(self.after(depth - 1, [at[0] + x, at[1] + y, at[2] + z]));
                }
            }
        }
        let mut out = leaky(self.layer(&format!("conv_{}", depth - 1), &inputs));
        if self.is_deep {
            let blocks = if depth == 3 { 3..=8 } else { depth..=depth };
            for i in blocks {
                out = self.residual(i, out);
            }
        }
        self.known.insert((depth, at), out.clone());
        out
    }

    fn offset(&mut self, at: [i32; 3]) -> Vec<f32> {
        let mut x = self.after(3, at);
        for name in ["conv_3", "conv_4"] {
            x = leaky(self.layer(name, &[x]));
        }
        self.layer("conv_out_float", &[x])
    }
}

fn leaky(values: Vec<f32>) -> Vec<f32> {
    values.into_iter().map(|x| if x < 0.0 { 0.01 * x } else { x }).collect()
}

#[test]
fn offsets_are_those_of_the_network_by_its_definition() {
    let lattice = Lattice::new([9, 8, 10]);
    let distance =
        |at: [i32; 3]| (0.7 * at[0] as f32 - 0.4 * at[1] as f32 + 0.3 * (at[2] as f32).sin() - 1.0) / 3.0;
    let all = (0..lattice.len() as u32).map(|place| distance(lattice.coordinates(place).map(|x| x as i32)));
    let distances: Vec<f32> = all.collect();
    let cells: Vec<u32> = (0..lattice.len() as u32)
        .filter(|&p| {
            let at = lattice.coordinates(p);
            (0..3).all(|k| (3..lattice.sides()[k] - 3).contains(&at[k]))
        })
        .step_by(7)
        .collect();
    for is_deep in [false, true] {
        let tensors = random_state(is_deep);
        let network = NeuralDualContouring::from_tensors(&tensors).unwrap();
        assert_eq!(network.is_deep(), is_deep);
        let found = network.offsets(lattice, &distances, &cells, &|_| Ok(())).unwrap();
        let mut plain = Plain { tensors: &tensors, is_deep, distances: &distance, known: HashMap::new() };
        for (&cell, found) in cells.iter().zip(&found) {
            let exact = plain.offset(lattice.coordinates(cell).map(|x| x as i32));
            for (f, e) in found.iter().zip(exact) {
                assert!((f - e).abs() < 1e-4 * (1.0 + e.abs()), "{f} {e}");
            }
        }
        // It is no constant.
        assert!(found.iter().any(|f| (f[0] - found[0][0]).abs() > 1e-3));
    }
}

/// A network that puts every vertex in the middle of its cell.
fn middles() -> NeuralDualContouring {
    let tensors = state(false, |_| 0.0);
    let tensors: Vec<(String, Tensor)> = tensors
        .iter()
        .map(|(name, tensor)| {
            let is_last = name == "conv_out_float.bias";
            let values = if is_last { vec![0.5; 3] } else { tensor.values().to_vec() };
            (name.to_owned(), Tensor::new(tensor.shape().to_vec(), values).unwrap())
        })
        .collect();
    let file = TensorFile::parse(&to_safetensors(&tensors).unwrap()).unwrap();
    NeuralDualContouring::from_tensors(&file).unwrap()
}

#[test]
fn quadrilaterals_close_the_surface_and_look_outward() {
    for field in [
        &Sphere::UNIT as &dyn ImplicitField,
        &Torus { center: DVec3::new(0.1, 0.2, 0.3), ring: 1.0, tube: 0.4 },
    ] {
        let options = NdcOptions { grid: 24, ..NdcOptions::default() };
        let surface = middles().contour(field, &options, &NoProgress).unwrap();
        let mesh = &surface.mesh;
        let mut sides: HashMap<(u32, u32), i32> = HashMap::new();
        for [a, b, c] in mesh.faces() {
            for (p, q) in [(a, b), (b, c), (c, a)] {
                *sides.entry((*p, *q)).or_default() += 1;
            }
        }
        assert!(sides.iter().all(|(&(p, q), &n)| sides.get(&(q, p)) == Some(&n)));
        let mut distances = vec![0.0; mesh.vertex_count()];
        field.values(mesh.positions(), &mut distances);
        assert!(distances.iter().all(|d| d.abs() < surface.cell), "vertices are in crossed cells");
        assert!(mesh.signed_volume() > 0.0);
        assert!(surface.evaluations > surface.cells.iter().map(|&n| u64::from(n)).product());
    }
}

#[test]
fn weights_that_do_not_fit_are_named() {
    let tensors = random_state(true);
    let all: Vec<(String, Tensor)> = tensors.iter().map(|(n, t)| (n.to_owned(), t.clone())).collect();
    for i in 0..all.len() {
        let mut fewer = all.clone();
        let (name, tensor) = fewer.remove(i);
        let file =
            |tensors: &[(String, Tensor)]| TensorFile::parse(&to_safetensors(tensors).unwrap()).unwrap();
        // Without its first residual layer it is taken for the plain variant.
        if name != "res_1.conv_1.weight" {
            let error = NeuralDualContouring::from_tensors(&file(&fewer)).unwrap_err();
            assert_eq!(error, NdcWeightsError::Missing(name.clone()));
        }
        let other = Tensor::new(vec![tensor.values().len(), 1], tensor.values().to_vec()).unwrap();
        fewer.push((name.clone(), other));
        let error = NeuralDualContouring::from_tensors(&file(&fewer)).unwrap_err();
        assert!(matches!(error, NdcWeightsError::Shape { name: n, .. } if n == name));
    }
}

#[test]
fn a_field_without_a_surface_is_said_and_work_can_be_cancelled() {
    struct Stop;
    impl Progress for Stop {
        fn report(&self, _: &str, _: f64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    let far = BoundingBox { min: DVec3::splat(3.0), max: DVec3::splat(4.0) };
    let options = NdcOptions { grid: 8, bounds: Some(far) };
    let missed = middles().contour(&Sphere::UNIT, &options, &NoProgress);
    assert!(matches!(missed, Err(IsosurfaceError::NoCrossing { .. })));
    let stopped = middles().contour(&Sphere::UNIT, &NdcOptions::default(), &Stop);
    assert!(matches!(stopped, Err(IsosurfaceError::Cancelled)));
}
