//! Laws of scalar fields.

use super::*;
use crate::intrinsic_network::NetworkError;
use ndf_mesh::sampling::AreaSampler;
use ndf_mesh::{FacePoint, shapes};

/// Three channels, one of them constant, with random parameters.
pub(crate) fn random(shape: ScalarShape, base_vertices: usize) -> SurfaceScalars {
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;
    let channel =
        |name: &str, range, mean, deviation| Channel { name: name.to_owned(), range, mean, deviation };
    let channels = vec![
        channel("distance", [0.0, 7.0], 3.0, 1.5),
        channel("constant", [0.1, 0.1], 0.1, 0.0),
        channel("mode_07", [-1e9, 1e9], 0.5, 2.0),
    ];
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut numbers = |n: usize| (0..n).map(|_| rng.random_range(-0.5..0.5)).collect::<Vec<f32>>();
    let features = numbers(base_vertices * shape.network.features);
    let parameters = numbers(shape.mlp(3).parameter_count());
    SurfaceScalars::new(channels, shape, base_vertices, features, parameters).unwrap()
}

#[test]
fn parts_that_do_not_fit_are_named() {
    use ScalarsError as Error;
    let good = random(ScalarShape::default(), 12);
    let make = |channels: Vec<Channel>, features: Vec<f32>, parameters: Vec<f32>| {
        SurfaceScalars::new(channels, good.shape().unwrap(), 12, features, parameters).map(|_| ())
    };
    let parts = || {
        let network = good.network().unwrap();
        (good.channels.clone(), network.features().to_vec(), network.mlp().parameters().to_vec())
    };
    let (c, f, p) = parts();
    assert_eq!(make(c, f, p), Ok(()));
    let (_, f, p) = parts();
    assert_eq!(make(Vec::new(), f, p), Err(Error::Empty));
    let (mut c, f, p) = parts();
    c[1].name = "distance".into();
    assert_eq!(make(c, f, p), Err(Error::Repeated("distance".into())));
    for name in ["", "two words", "x", "new\nline", "größe"] {
        let (mut c, f, p) = parts();
        c[2].name = name.into();
        assert_eq!(make(c, f, p), Err(Error::Name(name.into())));
    }
    for range in [[2.0, 1.0], [f32::NAN, 1.0], [0.0, f32::INFINITY]] {
        let (mut c, f, p) = parts();
        c[0].range = range;
        assert_eq!(make(c, f, p), Err(Error::Range("distance".into())));
    }
    let (c, mut f, p) = parts();
    f.pop();
    assert!(matches!(make(c, f, p), Err(Error::Network(NetworkError::Count { what: "features", .. }))));
    let (c, f, mut p) = parts();
    p.push(0.0);
    assert!(matches!(
        make(c, f, p),
        Err(Error::Network(NetworkError::Count { what: "network parameters", .. }))
    ));
    let (c, f, mut p) = parts();
    p[5] = f32::NAN;
    assert_eq!(make(c, f, p), Err(NetworkError::NotFinite("network").into()));
}

#[test]
fn outputs_and_values_are_inverse_and_stay_in_range() {
    let fields = random(ScalarShape::default(), 12);
    let [distance, constant, _] = fields.channels() else { panic!("three channels") };
    assert_eq!(distance.value(distance.output(4.25)), 4.25);
    assert_eq!([distance.value(-1e30), distance.value(1e30)], distance.range);
    for output in [0.0, 3.0, -1e38, f32::NAN, f32::INFINITY] {
        assert_eq!(constant.value(output), 0.1);
    }
    assert_eq!(constant.output(0.1), 0.0);
}

fn shapes() -> [ScalarShape; 4] {
    let default = ScalarShape::default();
    let with = |network, index| ScalarShape { network, index };
    [
        default.clone(),
        ScalarShape { index: ChannelIndex::Input, ..default.clone() },
        with(NetworkShape { features: 0, octaves: 8, ..default.network.clone() }, ChannelIndex::Input),
        with(NetworkShape { features: 9, octaves: 2, hidden: vec![20], ..default.network }, default.index),
    ]
}

/// The network written down in f64, for one point and channel.
fn truth(fields: &SurfaceScalars, base: &ManifoldMesh, point: &FacePoint, k: usize) -> f64 {
    let (network, channel) = (fields.network().unwrap(), &fields.channels[k]);
    let shape = network.shape();
    let corners = base.faces()[point.face.index()];
    let mut row = vec![0.0; shape.features];
    for (v, b) in corners.into_iter().zip(point.barycentric) {
        let features = &network.features()[v as usize * shape.features..];
        row.iter_mut().zip(features).for_each(|(to, f)| *to += b * f64::from(*f));
    }
    let x = point.position(base).to_array();
    row.extend(x);
    for turn in [f64::sin, f64::cos] {
        let octaves = (0..shape.octaves).map(|o| f64::from(1 << o) * std::f64::consts::PI);
        row.extend(octaves.flat_map(|frequency| x.map(|x| turn(frequency * x))));
    }
    let (count, mut output) = (fields.channels.len() as f64, k);
    if network.passes().index() == ChannelIndex::Input {
        row.push((2.0 * k as f64 + 1.0) / count - 1.0);
        output = 0;
    }
    let mut rest = network.mlp().parameters();
    let layers = network.mlp().shape().layers();
    for (l, &(inputs, outputs)) in layers.iter().enumerate() {
        let (weights, after) = rest.split_at(inputs * outputs);
        let (biases, after) = after.split_at(outputs);
        rest = after;
        let sum = |(w, b): (&[f32], &f32)| {
            let products = w.iter().zip(&row).map(|(w, x)| f64::from(*w) * x);
            let sum = products.sum::<f64>() + f64::from(*b);
            if l + 1 < layers.len() { sum / (1.0 + (-sum).exp()) } else { sum }
        };
        row = weights.chunks_exact(inputs).zip(biases).map(sum).collect();
    }
    let value = f64::from(channel.mean) + f64::from(channel.deviation) * row[output];
    value.clamp(channel.range[0].into(), channel.range[1].into())
}

#[test]
fn values_are_those_of_the_definition() {
    let base = ManifoldMesh::try_from(shapes::icosphere(1)).unwrap();
    let points = AreaSampler::new(&base).unwrap().sample(1001, 0, 0);
    for shape in shapes() {
        let fields = random(shape, base.vertex_count());
        let values = fields.evaluate(&base, &points);
        // The highest octave multiplies the rounding of coordinates.
        let tolerance = 1e-5 + 1e-6 * f64::from(1 << fields.network().unwrap().shape().octaves);
        for (point, values) in points.iter().zip(values.chunks_exact(3)).step_by(7) {
            for (k, value) in values.iter().enumerate() {
                let truth = truth(&fields, &base, point, k);
                assert!(
                    (f64::from(*value) - truth).abs() < tolerance,
                    "{:?} {value} {truth}",
                    fields.shape()
                );
            }
        }
        let columns = fields.columns(&base, &points);
        assert_eq!(columns[2].name, "mode_07");
        assert!(columns[2].values.iter().zip(values.chunks_exact(3)).all(|(a, b)| *a == b[2]));
        assert!(columns[1].values.iter().all(|value| *value == 0.1));
    }
}

#[test]
fn a_base_vertex_has_one_value_whichever_face_it_is_asked_in() {
    let base = ManifoldMesh::try_from(shapes::torus(9, 6, 1.0, 0.4)).unwrap();
    for shape in shapes() {
        let fields = random(shape, base.vertex_count());
        for v in base.topology().vertices() {
            let corners: Vec<FacePoint> = base.topology().outgoing(v).map(FacePoint::at_corner).collect();
            let values = fields.evaluate(&base, &corners);
            for other in values.chunks_exact(3) {
                assert!(other.iter().zip(&values).all(|(a, b)| (a - b).abs() < 1e-6));
            }
        }
    }
}
