//! Networks against the authors' values, and gradients against differences.

#![cfg(feature = "instant-ngp")]

use ndf_core::{BoundingBox, DVec3, ImplicitField, Inside, Query};

use super::samples::snapshot_of_a_half_space;
use super::*;
use ndf_formats::tensors::made::Torus;
use ndf_formats::tensors::{Tensor, TensorFile, to_safetensors};
use ndf_testing::data_file;

fn tensors(name: &str) -> Option<TensorFile> {
    let bytes = data_file(name)?;
    Some(TensorFile::parse(&bytes).unwrap_or_else(|e| panic!("{name}: {e}")))
}

fn points(tensor: &Tensor) -> Vec<DVec3> {
    tensor.values().chunks_exact(3).map(|p| DVec3::new(p[0].into(), p[1].into(), p[2].into())).collect()
}

/// Values agree with golden ones to 1e-5, relative to the largest.
fn agrees(field: &NeuralField, golden: &str, values: &str) {
    let Some(golden_file) = tensors(golden) else { return };
    let points = points(golden_file.get("points").unwrap());
    let expected = golden_file.get(values).unwrap();
    let stride = expected.values().len() / points.len();
    let mut found = vec![0.0; points.len()];
    field.values(&points, &mut found);
    let largest = expected.values().iter().fold(1.0_f32, |m, v| m.max(v.abs()));
    let error = found
        .iter()
        .zip(expected.values().chunks_exact(stride))
        .map(|(f, e)| (f - f64::from(e[stride - 1])).abs())
        .fold(0.0, f64::max);
    assert!(error <= 1e-5 * f64::from(largest), "{golden}: off by {error} of {largest}");
    if let Some(gradients) = golden_file.get("grad") {
        let mut found = vec![DVec3::ZERO; points.len()];
        field.gradients(&points, &mut found);
        let expected = self::points(gradients);
        let error = found.iter().zip(&expected).map(|(f, e)| f.distance(*e)).fold(0.0, f64::max);
        assert!(error < 1e-4, "{golden}: gradients off by {error}");
    }
}

fn field(name: &str) -> Option<NeuralField> {
    let file = tensors(name)?;
    Some(
        NeuralField::from_tensors(&file, &NetworkOptions::default())
            .unwrap_or_else(|e| panic!("{name}: {e}")),
    )
}

#[test]
fn networks_agree_with_their_authors() {
    let files = [
        ("neus/rocker-arm/ckpt_000616.pth", "neus/rocker-arm/golden.npz", "sdf"),
        ("neus/rocker-arm/sdf_network_fine.safetensors", "neus/rocker-arm/golden.npz", "sdf"),
        ("nerf/fertility_yenchenlin/000862.tar", "nerf/fertility_yenchenlin/golden.npz", "raw"),
        ("nerf/fertility_yenchenlin/network_fine.safetensors", "nerf/fertility_yenchenlin/golden.npz", "raw"),
        ("nerf/fertility_yenchenlin/model_fine_000862.npy", "nerf/fertility_yenchenlin/golden.npz", "raw"),
        (
            "nerf/krrish94_chair-lowres_155000.ckpt",
            "golden/krrish94_chair-lowres_155000_fine_rawalpha.npz",
            "value",
        ),
        (
            "nerf/krrish94_ship-lowres_125000.ckpt",
            "golden/krrish94_ship-lowres_125000_fine_rawalpha.npz",
            "value",
        ),
        ("nsdf/bacon_armadillo.pth", "golden/bacon_armadillo.npz", "value"),
        ("nsdf/nmwsharp_bunny.npz", "golden/nmwsharp_bunny.npz", "value"),
        ("nsdf/nmwsharp_hammer.npz", "golden/nmwsharp_hammer.npz", "value"),
        ("nsdf/nmwsharp_birdcage_occ.npz", "golden/nmwsharp_birdcage_occ.npz", "value"),
    ];
    for (name, golden, values) in files {
        if let Some(field) = field(name) {
            agrees(&field, golden, values);
        }
    }
}

#[test]
fn weight_encoded_shapes_agree() {
    for id in ["112932", "40509", "88566", "1706459"] {
        if let Some(field) = field(&format!("nsdf/thingi10k_h5/{id}_sf.h5")) {
            agrees(&field, &format!("golden/thingi10k_{id}.npz"), "value");
            assert_eq!(field.inside(), Inside::Below);
        }
    }
}

fn of_code(latent: Latent) -> NetworkOptions {
    NetworkOptions { latent: Some(latent), ..NetworkOptions::default() }
}

#[test]
fn decoders_agree_for_every_code() {
    let names = ["nsdf/maurock_deepsdf_weights.pt", "nsdf/maurock_deepsdf_results.npy"];
    let [Some(weights), Some(codes)] = names.map(tensors) else { return };
    for row in 0..3 {
        let latent = Latent::from_tensors(&codes, row).unwrap();
        let field = NeuralField::from_tensors(&weights, &of_code(latent)).unwrap();
        agrees(&field, &format!("golden/maurock_latent{row}.npz"), "value");
    }
    assert_eq!(Latent::from_tensors(&codes, 3), None);
    let short = NeuralField::from_tensors(&weights, &of_code(Latent(vec![0.0; 3])));
    assert!(matches!(short, Err(LayoutError::Latent { .. })));
}

#[test]
fn flat_sirens_agree() {
    let names = ["nsdf/siren_sdf1_weights.bin", "nsdf/siren_sdf1_test.bin"];
    let [Some(weights), Some(test)] = names.map(data_file) else { return };
    let field = NeuralField::from_flat_file(&weights, &NetworkOptions::default()).unwrap().unwrap();
    let numbers: Vec<f32> = test[4..].as_chunks::<4>().0.iter().map(|&b| f32::from_le_bytes(b)).collect();
    let count = numbers.len() / 4;
    let points: Vec<DVec3> = numbers[..3 * count]
        .chunks_exact(3)
        .map(|p| DVec3::new(p[0].into(), p[1].into(), p[2].into()))
        .collect();
    let mut values = vec![0.0; count];
    field.values(&points, &mut values);
    let error =
        values.iter().zip(&numbers[3 * count..]).map(|(v, e)| (v - f64::from(*e)).abs()).fold(0.0, f64::max);
    assert!(error < 1e-5, "{error}");
    assert!(NeuralField::from_flat_file(&test, &NetworkOptions::default()).is_none() && !is_snapshot(&test));
}

/// Deterministic numbers in [−1, 1].
fn noise(count: usize, seed: u32) -> Vec<f32> {
    let mut state = seed.wrapping_mul(747_796_405).wrapping_add(1);
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 8_388_608.0 - 1.0
    };
    (0..count).map(|_| next()).collect()
}

fn layer(inputs: usize, outputs: usize, seed: u32) -> Dense {
    let scale = (3.0 / inputs as f32).sqrt();
    let weights = noise(inputs * outputs, seed).iter().map(|w| scale * w).collect();
    Dense::new(weights, noise(outputs, seed + 1)).unwrap()
}

fn grid_shape(log2_entries: u32, smooth: bool) -> HashGridShape {
    HashGridShape { levels: 3, features: 2, log2_entries, coarsest: 4.0, growth: 2.0, smooth }
}

/// A graph with every kind of node.
fn everything() -> Graph {
    let mut graph = Graph::new();
    let position = graph.position();
    let a = graph.encoding(Encoding::ByOctave { octaves: 3 });
    let b = graph.encoding(Encoding::ByCoordinate { octaves: 2 });
    // Few entries, so that some levels are hashed.
    let shape = grid_shape(7, true);
    let box_ = BoundingBox { min: DVec3::splat(-1.5), max: DVec3::splat(1.5) };
    let grid = HashGrid::new(shape, noise(shape.parameters().unwrap(), 5), box_).unwrap();
    let c = graph.grid(grid);
    let all = graph.joined(&[a, b, c, position]);
    let mut h = graph.dense(layer(graph.width(all), 20, 7), all).unwrap();
    for (k, activation) in [
        Activation::Softplus { beta: 10.0 },
        Activation::Elu { alpha: 1.0 },
        Activation::Tanh,
        Activation::Cosine,
    ]
    .into_iter()
    .enumerate()
    {
        let mapped = graph.map(activation, h);
        let filter = graph.dense(layer(3, 20, 50 + k as u32), position).unwrap();
        let filter = graph.map(Activation::Sine { frequency: 2.0 }, filter);
        let product = graph.product(mapped, filter).unwrap();
        h = graph.dense(layer(20, 20, 90 + k as u32), product).unwrap();
    }
    graph.dense(layer(20, 1, 200), h).unwrap();
    graph
}

#[test]
fn gradients_agree_with_differences() {
    let graph = everything();
    let points: Vec<DVec3> = noise(3 * 300, 9)
        .chunks_exact(3)
        .map(|p| DVec3::new(p[0].into(), p[1].into(), p[2].into()))
        .collect();
    let (mut values, mut gradients) = (vec![0.0; points.len()], vec![DVec3::ZERO; points.len()]);
    graph.evaluate(&points, &mut values, Some(&mut gradients));
    let h = 2e-3;
    for axis in 0..3 {
        let moved = |sign: f64| {
            let moved: Vec<DVec3> = points.iter().map(|&p| p + sign * h * DVec3::AXES[axis]).collect();
            let mut values = vec![0.0; points.len()];
            graph.evaluate(&moved, &mut values, None);
            values
        };
        let mut errors: Vec<f64> = moved(1.0)
            .iter()
            .zip(moved(-1.0))
            .zip(&gradients)
            .map(|((a, b), g)| ((a - b) / (2.0 * h) - g[axis]).abs())
            .collect();
        errors.sort_by(f64::total_cmp);
        let typical = gradients.iter().map(|g| g[axis].abs()).sum::<f64>() / points.len() as f64;
        assert!(errors[270] < 0.01 * typical, "{axis}: {} of {typical}", errors[270]);
    }
}

#[test]
fn blocks_change_nothing() {
    let graph = everything();
    let points: Vec<DVec3> =
        (0..300).map(|i| DVec3::new(0.003 * f64::from(i) - 0.4, 0.2, 0.001 * f64::from(i))).collect();
    let mut together = vec![0.0; points.len()];
    graph.evaluate(&points, &mut together, None);
    for (p, expected) in points.iter().zip(&together).step_by(37) {
        let mut alone = [0.0];
        graph.evaluate(&[*p], &mut alone, None);
        assert!((alone[0] - expected).abs() < 1e-5, "{alone:?} {expected}");
    }
    graph.evaluate(&[], &mut [], None);
    let mut of_nan = [0.0];
    graph.evaluate(&[DVec3::NAN], &mut of_nan, None);
}

#[test]
fn grids_interpolate_their_entries() {
    let shape = HashGridShape { levels: 1, ..grid_shape(19, false) };
    let box_ = BoundingBox { min: DVec3::ZERO, max: DVec3::ONE };
    let features = noise(shape.parameters().unwrap(), 1);
    // Resolution 4, scale 3: entry (x, y, z) lies at ((x, y, z) − ½) / 3.
    assert_eq!(features.len(), 2 * 64);
    let mut graph = Graph::new();
    let grid = graph.grid(HashGrid::new(shape, features.clone(), box_).unwrap());
    graph.dense(Dense::new(vec![1.0, 0.0], vec![0.0]).unwrap(), grid).unwrap();
    let entry = |x: usize, y: usize, z: usize| f64::from(features[2 * (x + 4 * (y + 4 * z))]);
    let at = |x: f64, y: f64, z: f64| (DVec3::new(x, y, z) - 0.5) / 3.0;
    let mut values = [0.0; 2];
    graph.evaluate(&[at(2.0, 1.0, 3.0), at(1.5, 2.0, 1.0)], &mut values, None);
    assert!((values[0] - entry(2, 1, 3)).abs() < 1e-6);
    assert!((values[1] - 0.5 * (entry(1, 2, 1) + entry(2, 2, 1))).abs() < 1e-6);
    assert!(HashGrid::new(shape, vec![0.0; 3], box_).is_none());
    assert_eq!(HashGridShape { levels: 10_000, ..shape }.parameters(), None);
}

/// |x| + |y| + |z| − ½ as a ReLU network: an octahedron.
fn octahedron() -> NeuralField {
    let mut graph = Graph::new();
    let position = graph.position();
    let rows = [1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0];
    let h = graph.dense(Dense::new(rows.to_vec(), vec![0.0; 6]).unwrap(), position).unwrap();
    let h = graph.map(Activation::Relu, h);
    graph.dense(Dense::new(vec![1.0; 6], vec![-0.5]).unwrap(), h).unwrap();
    let bounds = BoundingBox { min: DVec3::splat(-0.5), max: DVec3::splat(0.5) };
    NeuralField::new(graph, Quantity::Distance, bounds, 0.0, Inside::Below)
}

fn surface(field: NeuralField) -> crate::LevelSetSurface<NeuralField> {
    let search = field.search();
    crate::LevelSetSurface::new(field).with_search(search)
}

ndf_core::surface_conformance!(octahedral_network, surface(octahedron()));

#[test]
fn feet_on_a_network_are_the_closest_points() {
    let query = Query { normal: Some(DVec3::ONE.normalize()), ..Query::at(DVec3::new(0.2, 0.2, 0.2)) };
    let foot = ndf_core::projected(&surface(octahedron()), &[query])[0].unwrap();
    assert!(foot.point.distance(DVec3::splat(0.5 / 3.0)) < 1e-5, "{foot:?}");
}

/// A file of safetensors with these tensors.
fn safetensors_of(tensors: &[(&str, Vec<usize>, Vec<f32>)]) -> Vec<u8> {
    let tensors: Vec<(String, Tensor)> = tensors
        .iter()
        .map(|(name, shape, values)| {
            ((*name).to_owned(), Tensor::new(shape.clone(), values.clone()).unwrap())
        })
        .collect();
    to_safetensors(&tensors).unwrap()
}

fn layout_error(tensors: &[(&str, Vec<usize>, Vec<f32>)]) -> String {
    let file = TensorFile::parse(&safetensors_of(tensors)).unwrap();
    NeuralField::from_tensors(&file, &NetworkOptions::default()).unwrap_err().to_string()
}

#[test]
fn unknown_and_broken_layouts_are_told_apart() {
    let unknown = layout_error(&[("conv1.kernel", vec![2], vec![0.0; 2])]);
    assert!(unknown.contains("conv1.kernel") && unknown.contains("pts_linears"), "{unknown}");
    let missing = layout_error(&[("lin0.weight_v", vec![4, 39], vec![0.1; 156])]);
    assert!(missing.contains("NeuS") && missing.contains("lin0"), "{missing}");
    let wide = layout_error(&[
        ("lin0.weight", vec![4, 39], vec![0.1; 156]),
        ("lin0.bias", vec![4], vec![0.0; 4]),
        ("lin1.weight", vec![1, 9], vec![0.1; 9]),
    ]);
    assert!(wide.contains("9 inputs"), "{wide}");
    let nan = layout_error(&[("net.0.weight", vec![1, 3], vec![f32::NAN; 3])]);
    assert!(nan.contains("not finite"), "{nan}");
    let flat = layout_error(&[("net.0.weight", vec![3], vec![0.0; 3])]);
    assert!(flat.contains("not a matrix"), "{flat}");
}

#[test]
fn sdfstudio_without_and_with_a_grid() {
    let weights =
        |inputs: usize, outputs: usize, seed: u32| (vec![outputs, inputs], noise(inputs * outputs, seed));
    let ((s0, w0), (s1, w1)) = (weights(39 + 4, 8, 3), weights(8, 5, 4));
    let mut tensors = vec![
        ("pipeline._model.field.glin0.weight", s0, w0.clone()),
        ("pipeline._model.field.glin0.bias", vec![8], noise(8, 8)),
        ("pipeline._model.field.glin1.weight", s1, w1),
        ("pipeline._model.field.glin1.bias", vec![5], noise(5, 9)),
    ];
    let value = |tensors: &[(&str, Vec<usize>, Vec<f32>)]| {
        let file = TensorFile::parse(&safetensors_of(tensors)).unwrap();
        let field = NeuralField::from_tensors(&file, &NetworkOptions::default()).unwrap();
        assert_eq!(field.layout(), "SDFStudio");
        let mut value = [0.0];
        field.values(&[DVec3::new(0.3, -0.2, 0.1)], &mut value);
        value[0]
    };
    let without = value(&tensors);
    let shape = HashGridShape {
        levels: 2,
        features: 2,
        log2_entries: 19,
        coarsest: 16.0,
        growth: 128.0,
        smooth: true,
    };
    let count = shape.parameters().unwrap();
    tensors.push(("pipeline._model.field.encoding.params", vec![count], vec![0.0; count]));
    assert!((value(&tensors) - without).abs() < 1e-6);
    tensors[4].2 = noise(count, 11);
    assert!((value(&tensors) - without).abs() > 1e-4);
}

#[test]
fn snapshots_are_read_packed_and_bare_in_both_precisions() {
    let bare = snapshot_of_a_half_space(2, "float");
    let packed = samples::packed(&bare);
    for bytes in [bare, packed, snapshot_of_a_half_space(1, "__half")] {
        assert!(is_snapshot(&bytes));
        let field = NeuralField::from_snapshot(&bytes, &NetworkOptions::default()).unwrap();
        assert_eq!((field.layout(), field.inside(), field.level()), ("instant-ngp", Inside::Above, 2.5));
        let (mut values, mut gradients) = ([0.0], [DVec3::ZERO]);
        field.values_and_gradients(&[DVec3::new(0.3, 0.7, 0.5)], &mut values, &mut gradients);
        assert!(
            (values[0] - 2.4).abs() < 2e-2 && (gradients[0].x - 8.0).abs() < 1e-1,
            "{values:?} {gradients:?}"
        );
    }
}

#[test]
fn damaged_snapshots_are_refused() {
    let whole = snapshot_of_a_half_space(2, "float");
    for end in (0..whole.len()).step_by(997) {
        assert!(NeuralField::from_snapshot(&whole[..end], &NetworkOptions::default()).is_err());
    }
    let error =
        |bytes: &[u8]| NeuralField::from_snapshot(bytes, &NetworkOptions::default()).unwrap_err().to_string();
    assert!(error(&[0x80]).contains("no snapshot"));
    assert!(error(&[0x78, 0x9c, 1, 2, 3]).contains("damaged"));
    // A map that announces 2³² entries, and nests of arrays.
    assert!(error(&[0xdf, 0xff, 0xff, 0xff, 0xff]).contains("MessagePack"));
    let nested = [vec![0x81, 0xa1, b'a'], vec![0x91; 100_000]].concat();
    assert!(error(&nested).contains("MessagePack"));
}

fn made(checkpoint: &[(String, Tensor)]) -> NeuralField {
    let file = TensorFile::parse(&to_safetensors(checkpoint).unwrap()).unwrap();
    NeuralField::from_tensors(&file, &NetworkOptions::default()).unwrap()
}

const TORUS: Torus = Torus { ring: 0.6, tube: 0.25 };

ndf_core::surface_conformance!(torus_of_neus, surface(made(&TORUS.as_neus())));
ndf_core::surface_conformance!(torus_of_nerf, surface(made(&TORUS.as_nerf()).with_level(50.0)));

#[test]
fn made_networks_are_a_torus() {
    let (neus, nerf) = (made(&TORUS.as_neus()), made(&TORUS.as_nerf()));
    assert_eq!((neus.layout(), neus.inside()), ("NeuS", Inside::Below));
    assert_eq!((nerf.layout(), nerf.inside(), nerf.quantity()), ("NeRF", Inside::Above, Quantity::Density));
    let points: Vec<DVec3> = (0..500)
        .map(|i| {
            let (u, v) = (0.31 * f64::from(i), 0.77 * f64::from(i));
            let r = TORUS.ring + (TORUS.tube + 0.1 * u.sin()) * v.cos();
            DVec3::new(r * u.cos(), r * u.sin(), (TORUS.tube + 0.1 * u.sin()) * v.sin())
        })
        .collect();
    let (mut distances, mut densities) = (vec![0.0; 500], vec![0.0; 500]);
    neus.values(&points, &mut distances);
    nerf.values(&points, &mut densities);
    for ((i, d), sigma) in distances.iter().enumerate().zip(&densities) {
        let truth = 0.1 * (0.31 * i as f64).sin();
        assert!((d - truth).abs() < 2e-3, "{d} {truth}");
        assert!(((50.0 - sigma) / 500.0 - truth).abs() < 2e-3, "{sigma} {truth}");
    }
}

/// A decoder of ellipsoids would take training; what matters here is that the same weights are found under other names.
fn perceptron(sizes: &[usize]) -> Vec<Weights> {
    let pair = |(k, pair): (usize, &[usize])| {
        let scale = (3.0 / pair[0] as f32).sqrt();
        let weights = noise(pair[0] * pair[1], 3 * k as u32 + 1).iter().map(|w| scale * w).collect();
        (vec![pair[1], pair[0]], weights, noise(pair[1], 3 * k as u32 + 2))
    };
    sizes.windows(2).enumerate().map(pair).collect()
}

/// Tensors by name, with their shapes.
type Named = Vec<(String, Vec<usize>, Vec<f32>)>;

/// Shape and weights of a layer, and its bias.
type Weights = (Vec<usize>, Vec<f32>, Vec<f32>);

fn named(layers: &[Weights], name: impl Fn(usize) -> String) -> Named {
    let both = |(l, (shape, weights, bias)): (usize, &Weights)| {
        [
            (format!("{}.weight", name(l)), shape.clone(), weights.clone()),
            (format!("{}.bias", name(l)), vec![bias.len()], bias.clone()),
        ]
    };
    layers.iter().enumerate().flat_map(both).collect()
}

fn opened(tensors: &Named, options: &NetworkOptions) -> Result<NeuralField, LayoutError> {
    let tensors: Vec<(&str, Vec<usize>, Vec<f32>)> =
        tensors.iter().map(|(name, shape, values)| (name.as_str(), shape.clone(), values.clone())).collect();
    let file = TensorFile::parse(&safetensors_of(&tensors)).unwrap();
    NeuralField::from_tensors(&file, options)
}

fn values_of(field: &NeuralField) -> Vec<f64> {
    let points: Vec<DVec3> = (0..40).map(|i| DVec3::new(0.02 * f64::from(i) - 0.4, 0.3, -0.1)).collect();
    let mut values = vec![0.0; points.len()];
    field.values(&points, &mut values);
    values
}

#[test]
fn weight_normalisation_has_two_names() {
    let layers = perceptron(&[39, 16, 16, 17]);
    let plain = named(&layers, |l| format!("lin{l}"));
    let expected = values_of(&opened(&plain, &NetworkOptions::default()).unwrap());
    for [g, v] in
        [["weight_g", "weight_v"], ["parametrizations.weight.original0", "parametrizations.weight.original1"]]
    {
        let normalised: Named = plain
            .iter()
            .flat_map(|(name, shape, values)| match name.strip_suffix(".weight") {
                None => vec![(name.clone(), shape.clone(), values.clone())],
                Some(layer) => {
                    let rows = values.chunks_exact(shape[1]);
                    let norms = rows.map(|row| row.iter().map(|x| x * x).sum::<f32>().sqrt()).collect();
                    let doubled = values.iter().map(|x| 2.0 * x).collect();
                    vec![
                        (format!("{layer}.{g}"), vec![shape[0], 1], norms),
                        (format!("{layer}.{v}"), shape.clone(), doubled),
                    ]
                }
            })
            .collect();
        let field = opened(&normalised, &NetworkOptions::default()).unwrap();
        assert_eq!(field.layout(), "NeuS");
        for (a, b) in values_of(&field).iter().zip(&expected) {
            assert!((a - b).abs() < 1e-5, "{a} {b}");
        }
    }
}

#[test]
fn deepsdf_is_known_by_its_shapes() {
    // A code of 13 numbers; after the skip the input comes again.
    let mut layers = perceptron(&[16, 32, 16, 32, 1]);
    layers[2] = perceptron(&[32, 32]).remove(0);
    let code = Latent(noise(13, 77));
    let value = |prefix: &str| {
        let tensors = named(&layers, |l| format!("{prefix}lin{l}"));
        let field = opened(&tensors, &of_code(code.clone())).unwrap();
        assert_eq!(field.layout(), "DeepSDF", "{prefix}");
        values_of(&field)
    };
    let expected = value("decoder.");
    assert_eq!(value("model_state_dict.module."), expected);
    assert_eq!(value(""), expected);
    // One code in a table of one, and without a table.
    for shape in [vec![1, 1, 13], vec![1, 13], vec![13]] {
        let bytes = safetensors_of(&[("latent", shape, code.0.clone())]);
        let file = TensorFile::parse(&bytes).unwrap();
        assert_eq!(Latent::from_tensors(&file, 0).as_ref(), Some(&code));
        assert_eq!(Latent::from_tensors(&file, 1), None);
    }
}

#[test]
fn parts_of_networks_are_refused() {
    let options = NetworkOptions::default();
    let mut layers = perceptron(&[39, 64, 64, 25, 64, 64, 65]);
    layers[3] = perceptron(&[64, 64]).remove(0);
    let whole = named(&layers, |l| format!("lin{l}"));
    assert!(opened(&whole, &options).is_ok());
    for (from, to, said) in [
        (0, 6, "it ends with layer 2 of 25 outputs"),
        (0, 4, "it ends with layer 1 of 64 outputs"),
        (6, 12, "it holds lin3, but not the layers before"),
    ] {
        let error = opened(&whole[from..to].to_vec(), &options).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
    let gap: Named = whole.iter().filter(|(name, ..)| !name.starts_with("lin1")).cloned().collect();
    let error = opened(&gap, &options).unwrap_err().to_string();
    assert!(error.contains("lin1 is missing before lin2"), "{error}");
}

#[test]
fn activations_frequencies_and_boxes_can_be_set() {
    let layers = perceptron(&[3, 16, 16, 1]);
    let relu = named(&layers, |l| format!("net.{}", 2 * l));
    let siren = named(&layers, |l| format!("net.net.{l}.0"));
    let plain = opened(&relu, &NetworkOptions::default()).unwrap();
    assert!(plain.is_activation_assumed());
    assert_eq!(plain.graph().activation(), Some(Activation::Relu));
    assert_eq!((plain.graph().widths(), plain.graph().octaves()), (vec![3, 16, 16, 1], None));
    // What the network of the authors' layout is, is also said of the other one.
    let sine = NetworkOptions {
        activation: Some(Activation::Sine { frequency: 30.0 }),
        ..NetworkOptions::default()
    };
    let as_siren = opened(&siren, &NetworkOptions::default()).unwrap();
    assert_eq!(values_of(&opened(&relu, &sine).unwrap()), values_of(&as_siren));
    let omega = NetworkOptions { omega: Some(15.0), ..NetworkOptions::default() };
    let slower = opened(&siren, &omega).unwrap();
    assert_eq!(slower.graph().activation(), Some(Activation::Sine { frequency: 15.0 }));
    assert!(!slower.is_activation_assumed());
    assert!(matches!(opened(&relu, &omega), Err(LayoutError::NoSines { .. })));
    let bounds = BoundingBox { min: DVec3::splat(-2.0), max: DVec3::splat(3.0) };
    let boxed = NetworkOptions { bounds: Some(bounds), ..NetworkOptions::default() };
    assert_eq!(opened(&relu, &boxed).unwrap().bounds(), bounds);
    let steps = vec![
        ("0000.dense.A".to_owned(), vec![3, 1], vec![1.0; 3]),
        ("0000.dense.b".to_owned(), vec![1], vec![0.0]),
        ("0001.tanh.x".to_owned(), vec![1], vec![0.0]),
    ];
    assert!(matches!(opened(&steps, &sine), Err(LayoutError::ActivationStated)));
}

#[test]
fn other_layouts_are_read_or_named() {
    let options = NetworkOptions::default();
    // siren-pytorch: sine of 30 x, then of x.
    let layers = perceptron(&[3, 8, 8, 1]);
    let tensors = named(&layers, |l| if l < 2 { format!("layers.{l}") } else { "last_layer".to_owned() });
    let field = opened(&tensors, &options).unwrap();
    let mut graph = Graph::new();
    let mut h = graph.position();
    for (l, (_, weights, bias)) in layers.iter().enumerate() {
        h = graph.dense(Dense::new(weights.clone(), bias.clone()).unwrap(), h).unwrap();
        if l < 2 {
            h = graph.map(Activation::Sine { frequency: [30.0, 1.0][l] }, h);
        }
    }
    let by_hand = NeuralField::new(graph, Quantity::Distance, field.bounds(), 0.0, Inside::Below);
    assert_eq!(values_of(&field), values_of(&by_hand));
    // nerf_pl is NeRF by other names.
    let layers = perceptron(&[63, 16, 16, 1]);
    let nerf = |names: [&str; 3]| {
        let mut tensors = named(&layers[..2], |l| names[l].to_owned());
        tensors.extend(named(&layers[2..], |_| names[2].to_owned()));
        values_of(&opened(&tensors, &options).unwrap())
    };
    assert_eq!(
        nerf(["nerf_fine.xyz_encoding_1.0", "nerf_fine.xyz_encoding_2.0", "nerf_fine.sigma"]),
        nerf(["pts_linears.0", "pts_linears.1", "alpha_linear"])
    );
    for (name, said) in [
        ("state_dict.model.geometry.encoding.encoding.params", "instant-nsr-pl"),
        ("pipeline._model.field.mlp_base.tcnn_encoding.params", "nerfstudio"),
        ("model.encoder.embeddings", "torch-ngp"),
        ("density_plane.0", "TensoRF"),
    ] {
        let mut tensors = named(&perceptron(&[35, 8, 1]), |l| format!("network.layers.{l}"));
        tensors.push((name.to_owned(), vec![2], vec![0.0; 2]));
        let error = opened(&tensors, &options).unwrap_err().to_string();
        assert!(error.contains(said) && error.contains("not read"), "{error}");
    }
}
