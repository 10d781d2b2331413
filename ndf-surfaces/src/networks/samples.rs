//! Small snapshots, made by code: for tests, and as seeds of fuzzers.

use rmpv::Value;

use super::HashGridShape;

/// A snapshot whose grid holds the x coordinate and whose network passes it on as a logarithm of a density.
pub fn snapshot_of_a_half_space(hidden: usize, kind: &str) -> Vec<u8> {
    let shape = HashGridShape {
        levels: 1,
        features: 4,
        log2_entries: 14,
        coarsest: 16.0,
        growth: 1.5,
        smooth: false,
    };
    let mut grid = vec![0.0; shape.parameters().expect("the sizes are sound")];
    for i in 0..16 * 16 * 16 {
        // Entry x lies at (x − ½) / 15.
        grid[4 * i] = ((i % 16) as f32 - 0.5) / 15.0;
    }
    let identity = |rows: usize, columns: usize| {
        (0..rows * columns).map(move |i| if i % columns == i / columns { 1.0 } else { 0.0 })
    };
    let mut parameters: Vec<f32> = identity(16, 16).collect();
    for _ in 1..hidden {
        parameters.extend(identity(16, 16));
    }
    parameters.extend(identity(16, 16).map(|w| 8.0 * w));
    // Colours: 16 × 32 and 16 × 16.
    parameters.extend(vec![0.0; 16 * 32 + 16 * 16]);
    parameters.extend(grid);
    let bytes: Vec<u8> = match kind {
        "float" => parameters.iter().flat_map(|x| x.to_le_bytes()).collect(),
        _ => parameters.iter().flat_map(|&x| half::f16::from_f32(x).to_le_bytes()).collect(),
    };
    let map =
        |entries: Vec<(&str, Value)>| Value::Map(entries.into_iter().map(|(k, v)| (k.into(), v)).collect());
    let network = |hidden: usize| {
        map(vec![("n_neurons", 16.into()), ("n_hidden_layers", hidden.into()), ("activation", "ReLU".into())])
    };
    let corner = |x: f64| Value::Array(vec![x.into(), x.into(), x.into()]);
    let root = map(vec![
        (
            "encoding",
            map(vec![
                ("n_levels", 1.into()),
                ("n_features_per_level", 4.into()),
                ("log2_hashmap_size", 14.into()),
                ("base_resolution", 16.into()),
                ("per_level_scale", 1.5.into()),
            ]),
        ),
        ("network", network(hidden)),
        ("rgb_network", network(1)),
        (
            "snapshot",
            map(vec![
                ("mode", "Nerf".into()),
                ("params_type", kind.into()),
                ("params_binary", Value::Binary(bytes)),
                ("aabb", map(vec![("min", corner(0.0)), ("max", corner(1.0))])),
            ]),
        ),
    ]);
    let mut out = Vec::new();
    rmpv::encode::write_value(&mut out, &root).expect("the sizes are sound");
    out
}

/// A snapshot as instant-ngp packs it.
pub fn packed(snapshot: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = flate2::read::ZlibEncoder::new(snapshot, flate2::Compression::fast());
    std::io::Read::read_to_end(&mut encoder, &mut bytes).expect("memory can be written to");
    bytes
}

/// Snapshots in both precisions, bare and packed, and a SIREN of bare numbers.
pub fn all() -> Vec<(&'static str, Vec<u8>)> {
    let siren: Vec<u8> =
        (0..5 * 16 + 1 + 16 * 17).flat_map(|i| (0.01 * i as f32).sin().to_le_bytes()).collect();
    vec![
        ("float.msgpack", snapshot_of_a_half_space(1, "float")),
        ("half.msgpack", snapshot_of_a_half_space(2, "__half")),
        ("packed.ingp", packed(&snapshot_of_a_half_space(1, "__half"))),
        ("siren.bin", siren),
    ]
}
