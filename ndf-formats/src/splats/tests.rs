//! Every format is read as it was written, and every defect told.

#![cfg(feature = "full")]

use ndf_core::{DVec3, Hint};
use ndf_mesh::{TriangleMesh, TriangleTree, shapes};
use ndf_testing::data_file;

use super::*;

fn real(name: &str) -> Option<(SplatFormat, Vec<Splat>)> {
    let bytes = data_file(&format!("splat/{name}"))?;
    Some(parse_splats(&bytes).unwrap_or_else(|e| panic!("{name}: {e}")))
}

/// Flat splats on an icosphere.
fn ball() -> Vec<Splat> {
    let mesh = shapes::icosphere(4);
    mesh.positions()
        .iter()
        .map(|&p| {
            let turn = ndf_core::glam::DQuat::from_rotation_arc(DVec3::Z, p.normalize());
            Splat {
                center: p.as_vec3().as_dvec3().to_array(),
                scales: [0.04, 0.04, 0.001],
                rotation: [turn.w as f32, turn.x as f32, turn.y as f32, turn.z as f32],
                opacity: 0.9,
            }
        })
        .collect()
}

#[test]
fn written_splats_are_read_again() {
    let mut bytes = Vec::new();
    write_splats(&mut bytes, &ball()).unwrap();
    let (format, splats) = parse_splats(&bytes).unwrap();
    assert_eq!((format, splats.len()), (SplatFormat::InriaPly, 2562));
    for (a, b) in ball().iter().zip(&splats) {
        assert_eq!(a.center, b.center);
        assert!((a.scales[2] - b.scales[2]).abs() < 1e-7 && (a.opacity - b.opacity).abs() < 1e-6);
    }
}

/// The same chair in four formats: centres, scales, axes and opacities agree with the .splat it was made from.
#[test]
fn formats_agree_with_one_another() {
    let Some((format, chair)) = real("chair_nerfsynth.splat") else { return };
    assert_eq!((format, chair.len()), (SplatFormat::Antimatter, 111_650));
    let tree = neighbours(&chair);
    for (name, format, place) in [
        ("chair_nerfsynth_conv.ply", SplatFormat::InriaPly, 1e-6),
        ("chair_nerfsynth_conv.compressed.ply", SplatFormat::CompressedPly, 1e-3),
        ("chair_nerfsynth_conv_v3.spz", SplatFormat::Spz, 5e-4),
    ] {
        let Some((found, splats)) = real(name) else { return };
        assert_eq!((found, splats.len()), (format, chair.len()), "{name}");
        let (mut close, mut alike, mut opaque, mut looked_at) = (0, 0, 0, 0);
        for splat in splats.iter().step_by(97) {
            let Some(i) = closest(&tree, splat) else { continue };
            let twin = &chair[i];
            looked_at += 1;
            let distance = (0..3).map(|k| (splat.center[k] - twin.center[k]).powi(2)).sum::<f64>().sqrt();
            close += usize::from(distance < place);
            alike += usize::from(covariances_agree(splat, twin));
            opaque += usize::from((splat.opacity - twin.opacity).abs() < 0.01);
        }
        // Splats that share a place may be taken for one another.
        assert!(looked_at > 1000);
        for good in [close, alike, opaque] {
            assert!(
                10 * good >= 9 * looked_at,
                "{name}: {close} close, {alike} alike, {opaque} of {looked_at}"
            );
        }
    }
}

#[test]
fn levels_of_ksplat_hold_the_same_splats() {
    for level in 0..3 {
        let (format, splats) = parse_splats(&samples::ksplat(level)).unwrap();
        let (_, twins) = parse_splats(&samples::antimatter()).unwrap();
        assert_eq!((format, splats.len()), (SplatFormat::Ksplat, 2));
        for (a, b) in splats.iter().zip(&twins) {
            assert!((0..3).all(|k| (a.center[k] - b.center[k]).abs() < 1e-4), "{a:?} instead of {b:?}");
            assert!(covariances_agree(a, b) && (a.opacity - b.opacity).abs() < 1e-6);
        }
    }
    // Buckets that hold fewer splats than are announced, and none.
    for (at, word) in [(4096 + 1024, 0), (4096 + 32, 0), (4096 + 8, 0), (4096 + 4, 3)] {
        let mut bytes = samples::ksplat(1);
        bytes[at..at + 4].copy_from_slice(&u32::to_le_bytes(word));
        assert!(matches!(parse_splats(&bytes), Err(SplatError::Damaged(_))), "{at}");
    }
    // Another number of splats than announced, and more than the sections.
    let mut bytes = samples::ksplat(1);
    bytes[16] = 7;
    assert!(parse_splats(&bytes).unwrap_err().to_string().contains("announces 7 splats"));
    let long = [samples::ksplat(1), vec![0; 5]].concat();
    assert!(parse_splats(&long).unwrap_err().to_string().contains("5 bytes"));
    let Some((format, splats)) = real("minimal.ksplat") else { return };
    let Some((_, twins)) = real("minimal.splat") else { return };
    assert_eq!(format, SplatFormat::Ksplat);
    assert!(splats.iter().zip(&twins).all(|(a, b)| a.center == b.center && a.scales == b.scales));
}

/// Degenerate triangles at the centres, to search.
fn neighbours(splats: &[Splat]) -> TriangleTree {
    let points: Vec<DVec3> = splats.iter().map(|s| DVec3::from_array(s.center.map(f64::from))).collect();
    let faces = (0..points.len() as u32).map(|i| [i; 3]).collect();
    TriangleTree::new(&TriangleMesh::new(points, faces).unwrap())
}

fn closest(tree: &TriangleTree, splat: &Splat) -> Option<usize> {
    let center = DVec3::from_array(splat.center.map(f64::from));
    tree.closest_point(center, Hint::NONE).map(|found| found.at.face.index())
}

fn covariances_agree(a: &Splat, b: &Splat) -> bool {
    let covariance = |splat: &Splat, k: usize, l: usize| -> f64 {
        let terms = splat.axes().into_iter().zip(splat.scales);
        terms.map(|(axis, s)| axis[k] * axis[l] * f64::from(s) * f64::from(s)).sum()
    };
    let size: f64 = (0..3).map(|k| covariance(b, k, k)).sum();
    (0..3).all(|k| (0..3).all(|l| (covariance(a, k, l) - covariance(b, k, l)).abs() < 0.12 * size))
}

#[test]
fn versions_of_spz_hold_the_same_splats() {
    // Bare and in gzip; smallest-three rotations in gzip and in Zstandard.
    for pair in [["minimal-v2.spz", "minimal-raw.spz"], ["minimal-v3.spz", "minimal-v4.spz"]] {
        let [Some((format, first)), Some((_, second))] = pair.map(real) else { return };
        assert_eq!((format, first.len()), (SplatFormat::Spz, 4), "{pair:?}");
        assert_eq!(first, second, "{pair:?}");
    }
    let [Some((_, ply)), Some((_, spz))] = ["3-points-from-train.ply", "3-points-from-train.spz"].map(real)
    else {
        return;
    };
    for (a, b) in ply.iter().zip(&spz) {
        assert!((0..3).all(|k| (a.center[k] - b.center[k]).abs() < 1e-3), "{a:?} {b:?}");
        assert!(covariances_agree(b, a) && (a.opacity - b.opacity).abs() < 0.01, "{a:?} {b:?}");
    }
}

#[test]
fn bad_files_are_refused() {
    let error = |bytes: &[u8]| parse_splats(bytes).unwrap_err();
    assert_eq!(error(b"hello"), SplatError::Unknown);
    assert_eq!(error(&[0xff; 64]), SplatError::Unknown);
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\n\
        property float opacity\nproperty float scale_0\nproperty float scale_1\nproperty float scale_2\nproperty float rot_0\nend_header\n";
    assert!(matches!(error(header.as_bytes()), SplatError::Damaged(_)));
    let missing = header.replace("4000000000", "0");
    assert_eq!(error(missing.as_bytes()), SplatError::MissingProperty("rot_1"));
    let packed = "ply\nformat binary_little_endian 1.0\nelement chunk 4000000000\nproperty float min_x\nelement vertex 1\nproperty uint packed_position\nend_header\n";
    assert!(matches!(error(packed.as_bytes()), SplatError::Damaged(_)));

    let spz = |version: u32, count: u32| {
        let words = [u32::from_le_bytes(*b"NGSP"), version, count, 12 << 8];
        words.iter().flat_map(|w| w.to_le_bytes()).collect::<Vec<u8>>()
    };
    assert_eq!(error(&spz(9, 1)), SplatError::Version(9));
    for version in 1..=4 {
        assert!(matches!(error(&spz(version, u32::MAX)), SplatError::Damaged(_)), "{version}");
    }
    assert_eq!(error(&spz(3, 0)), SplatError::Empty);
    // Gzip makes a few kilobytes of a hundred thousand splats of zeros, and of as many million.
    let packed = |count: u32, zeros: usize| {
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        std::io::Write::write_all(&mut gzip, &[spz(2, count), vec![0; zeros]].concat()).unwrap();
        gzip.finish().unwrap()
    };
    for count in [100_000, 100_000_000] {
        let SplatError::Damaged(defect) = error(&packed(count, 1_900_000)) else { panic!("{count}") };
        assert!(defect.to_string().contains("too many for the size of the file"), "{defect}");
    }
    assert!(matches!(error(b"NGSP"), SplatError::Damaged(_)));
}

#[test]
fn samples_of_every_format_are_read_and_survived_damaged() {
    for (name, whole) in samples::all() {
        let (_, splats) = parse_splats(&whole).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(splats.len() == 2 && splats.iter().all(Splat::is_sound), "{name}: {splats:?}");
        for end in 0..whole.len() {
            let _ = parse_splats(&whole[..end]);
        }
        for k in 0..8 * whole.len() {
            let mut changed = whole.clone();
            changed[k / 8] ^= 1 << (k % 8);
            let _ = parse_splats(&changed);
        }
    }
}

#[test]
fn damaged_real_files_are_survived() {
    for name in
        ["minimal-v2.spz", "minimal-v3.spz", "minimal-v4.spz", "3-points-from-train.ply", "minimal.splat"]
    {
        let Some(whole) = data_file(&format!("splat/{name}")) else { continue };
        for end in 0..whole.len() {
            let _ = parse_splats(&whole[..end]);
        }
        for k in 0..8 * whole.len() {
            let mut changed = whole.clone();
            changed[k / 8] ^= 1 << (k % 8);
            let _ = parse_splats(&changed);
        }
    }
}

#[test]
fn flat_splats_have_two_scales() {
    let mut bytes = Vec::new();
    write_splats(&mut bytes, &ball()).unwrap();
    let whole = parse_splats(&bytes).unwrap().1;
    // The header without the third scale, and the rows without its four bytes.
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let mut flat =
        String::from_utf8_lossy(&bytes[..end]).replace("property float scale_2\n", "").into_bytes();
    for row in bytes[end..].chunks_exact(68) {
        flat.extend([&row[..48], &row[52..]].concat());
    }
    let (format, found) = parse_splats(&flat).unwrap();
    assert_eq!((format, found.len()), (SplatFormat::InriaPly, whole.len()));
    for (a, b) in found.iter().zip(&whole) {
        assert_eq!(
            (a.center, a.rotation, a.scales[..2].to_vec(), a.scales[2]),
            (b.center, b.rotation, b.scales[..2].to_vec(), 0.0)
        );
        assert!(a.is_sound());
    }
}

#[test]
fn places_of_splats_are_double() {
    let header: String = ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]
        .iter()
        .map(|name| format!("property float {name}\n"))
        .collect();
    let text = format!(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty double x\nproperty double y\nproperty double z\n{header}end_header\n\
         500000.001 4000000.002 100.003 0 -1 -1 -1 1 0 0 0\n"
    );
    assert_eq!(parse_splats(text.as_bytes()).unwrap().1[0].center, [500_000.001, 4_000_000.002, 100.003]);
}

#[test]
fn checkpoints_of_training_hold_splats() {
    use crate::tensors::{Tensor, TensorFile, to_safetensors};
    let ball = ball();
    let tensor = |width: usize, numbers: &dyn Fn(&Splat) -> Vec<f32>| {
        Tensor::new(vec![ball.len(), width], ball.iter().flat_map(numbers).collect()).unwrap()
    };
    let logit = |p: f32| (p / (1.0 - p)).ln();
    let named = |prefix: &str, names: [&str; 4]| {
        let tensors = [
            tensor(3, &|s| s.center.map(|x| x as f32).to_vec()),
            tensor(3, &|s| s.scales.map(f32::ln).to_vec()),
            tensor(4, &|s| s.rotation.to_vec()),
            tensor(1, &|s| vec![logit(s.opacity)]),
        ];
        let named: Vec<(String, Tensor)> =
            names.iter().zip(tensors).map(|(name, tensor)| (format!("{prefix}{name}"), tensor)).collect();
        TensorFile::parse(&to_safetensors(&named).unwrap()).unwrap()
    };
    for (prefix, names) in [
        ("splats.", ["means", "scales", "quats", "opacities"]),
        ("pipeline._model.gauss_params.", ["means", "scales", "quats", "opacities"]),
        ("0.", ["1", "4", "5", "6"]),
    ] {
        let found = splats_of_tensors(&named(prefix, names)).unwrap();
        assert_eq!(found.len(), ball.len());
        for (a, b) in found.iter().zip(&ball) {
            assert_eq!((a.center, a.rotation), (b.center, b.rotation));
            assert!((a.scales[0] - b.scales[0]).abs() < 1e-6 && (a.opacity - b.opacity).abs() < 1e-6);
        }
    }
    assert!(splats_of_tensors(&named("", ["mean", "scales", "quats", "opacities"])).is_none());
}

/// A lossless image of pixels in rows of 64.
fn webp(pixels: &[[u8; 4]]) -> Vec<u8> {
    let mut pixels = pixels.to_vec();
    pixels.resize(pixels.len().next_multiple_of(64), [0; 4]);
    let mut bytes = Vec::new();
    let encoder = image_webp::WebPEncoder::new(&mut bytes);
    encoder.encode(&pixels.concat(), 64, pixels.len() as u32 / 64, image_webp::ColorType::Rgba8).unwrap();
    bytes
}

#[test]
fn sog_is_read() {
    let ball = ball();
    let log = |x: f64| x.abs().ln_1p().copysign(x);
    let words = |s: &Splat| s.center.map(|x| ((log(x) + 1.0) / 2.0 * 65535.0).round() as u16);
    let mut places = [Vec::new(), Vec::new()];
    let [mut scales, mut quats, mut colours] = [Vec::new(), Vec::new(), Vec::new()];
    for splat in &ball {
        for (byte, places) in places.iter_mut().enumerate() {
            let [x, y, z] = words(splat).map(|word| word.to_le_bytes()[byte]);
            places.push([x, y, z, 255]);
        }
        // The table has ln 0.04 at 7 and ln 0.001 at 200.
        scales.push([7, 7, 200, 255]);
        let q = splat.rotation;
        let largest = (0..4).max_by(|&a, &b| q[a].abs().total_cmp(&q[b].abs())).unwrap();
        let byte =
            |k: usize| ((q[k] * q[largest].signum() * std::f32::consts::SQRT_2 + 1.0) * 127.5).round() as u8;
        let others: Vec<u8> = (0..4).filter(|&k| k != largest).map(byte).collect();
        quats.push([others[0], others[1], others[2], 252 + largest as u8]);
        colours.push([1, 2, 3, (splat.opacity * 255.0).round() as u8]);
    }
    let mut table = [-3.0_f32; 256];
    (table[7], table[200]) = (0.04_f32.ln(), 0.001_f32.ln());
    let meta = format!(
        r#"{{"version":2,"count":{},"means":{{"mins":[-1,-1,-1],"maxs":[1,1,1],"files":["l.webp","u.webp"]}},
        "scales":{{"codebook":{table:?},"files":["s.webp"]}},"quats":{{"files":["q.webp"]}},"sh0":{{"files":["c.webp"]}}}}"#,
        ball.len()
    );
    let images = [&places[0], &places[1], &scales, &quats, &colours].map(|pixels| webp(pixels));
    let zip = |meta: &str| {
        let names = ["l.webp", "u.webp", "s.webp", "q.webp", "c.webp"];
        let mut entries: Vec<(&str, &[u8])> =
            names.into_iter().zip(images.iter().map(Vec::as_slice)).collect();
        entries.push(("meta.json", meta.as_bytes()));
        crate::tensors::samples::zip_of(&entries)
    };
    let (format, found) = parse_splats(&zip(&meta)).unwrap();
    assert_eq!((format, found.len()), (SplatFormat::Sog, ball.len()));
    for (a, b) in found.iter().zip(&ball) {
        assert!((0..3).all(|k| (a.center[k] - b.center[k]).abs() < 1e-4), "{a:?} {b:?}");
        assert!((0..3).all(|k| (a.scales[k] - b.scales[k]).abs() < 1e-6), "{a:?} {b:?}");
        assert!((a.opacity - b.opacity).abs() < 0.01);
        let along: f32 = a.rotation.iter().zip(b.rotation).map(|(x, y)| x * y).sum();
        assert!(along.abs() > 0.999, "{a:?} {b:?}");
    }
    let error = |meta: &str| parse_splats(&zip(meta)).unwrap_err().to_string();
    assert!(error(&meta.replace(r#""version":2,"#, "")).contains("version"));
    assert!(error(&meta.replacen("2562", "99999", 1)).contains("pixels for 99999 splats"));
    assert!(error("{}").contains("meta.json"));
}

#[test]
fn splats_of_glb_are_read() {
    let ball = ball();
    let columns: [(usize, Vec<f32>); 4] = [
        (3, ball.iter().flat_map(|s| s.center.map(|x| x as f32)).collect()),
        (4, ball.iter().flat_map(|s| [1, 2, 3, 0].map(|k| s.rotation[k])).collect()),
        (3, ball.iter().flat_map(|s| s.scales).collect()),
        (1, ball.iter().map(|s| s.opacity).collect()),
    ];
    let (mut buffer, mut views, mut accessors) = (Vec::new(), Vec::new(), Vec::new());
    for (i, (_, numbers)) in columns.iter().enumerate() {
        views.push(format!(
            r#"{{"buffer":0,"byteOffset":{},"byteLength":{}}}"#,
            buffer.len(),
            4 * numbers.len()
        ));
        accessors.push(format!(r#"{{"bufferView":{i},"componentType":5126,"count":{}}}"#, ball.len()));
        buffer.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
    }
    let glb = |nodes: &str| {
        let json = format!(
            r#"{{"asset":{{"version":"2.0"}},"nodes":[{nodes}],"bufferViews":[{}],"accessors":[{}],"meshes":[{{"primitives":[{{"mode":0,
            "attributes":{{"POSITION":0,"KHR_gaussian_splatting:ROTATION":1,"KHR_gaussian_splatting:SCALE":2,
            "KHR_gaussian_splatting:OPACITY":3}},"extensions":{{"KHR_gaussian_splatting":{{"kernel":"ellipse"}}}}}}]}},{{"primitives":[]}}]}}"#,
            views.join(","),
            accessors.join(",")
        );
        let chunk = |kind: &[u8], data: &[u8]| [&(data.len() as u32).to_le_bytes(), kind, data].concat();
        let chunks = [chunk(b"JSON", json.as_bytes()), chunk(b"BIN\0", &buffer)].concat();
        [&b"glTF"[..], &2_u32.to_le_bytes(), &(chunks.len() as u32 + 12).to_le_bytes(), &chunks].concat()
    };
    let bytes = glb(r#"{"mesh":0}"#);
    let (format, found) = parse_splats(&bytes).unwrap();
    assert_eq!((format, found.len()), (SplatFormat::Glb, ball.len()));
    for (a, b) in found.iter().zip(&ball) {
        assert_eq!((a.center, a.rotation, a.scales, a.opacity), (b.center, b.rotation, b.scales, b.opacity));
    }
    for end in (12..bytes.len()).step_by(997) {
        assert!(parse_splats(&bytes[..end]).is_err());
    }
    // Twice as large, turned by a quarter about z, moved; the parent comes after its child, and a camera has its own place.
    let placed = r#"{"mesh":0,"translation":[1,0,0],"scale":[2,2,2]},
        {"children":[0],"rotation":[0,0,0.70710678118654752,0.70710678118654752]},
        {"camera":0,"matrix":[1,0,0,0,0,3,0,0,0,0,1,0,4,5,6,1]}"#;
    let (_, found) = parse_splats(&glb(placed)).unwrap();
    for (a, b) in found.iter().zip(&ball) {
        let [x, y, z] = b.center;
        let expected = DVec3::new(-2.0 * y, 2.0 * x + 1.0, 2.0 * z);
        assert!(DVec3::from_array(a.center).distance(expected) < 1e-6, "{a:?} {b:?}");
        // Flat along the normal, which is turned.
        let normal = DVec3::new(-y, x, z).normalize();
        assert!((a.scales[2] - 0.002).abs() < 1e-8 && a.axes()[2].dot(normal).abs() > 0.99999, "{a:?}");
    }
    let error = |nodes: &str| parse_splats(&glb(nodes)).unwrap_err().to_string();
    assert!(error(r#"{"mesh":0,"scale":[1,1,2]}"#).contains("stretches or mirrors"));
    assert!(error(r#"{"mesh":0,"scale":[1,1,-1]}"#).contains("stretches or mirrors"));
    assert!(error(r#"{"mesh":0,"children":[1]},{"children":[0]}"#).contains("child of itself"));
    assert!(error(r#"{"mesh":0,"children":[7]}"#).contains("not there"));
    assert!(error(r#"{"children":[1,1]},{"mesh":0}"#).contains("two others"));
    // What is not in the scene is not shown, and other meshes may be of any shape.
    let scene = r#"{"mesh":0},{"mesh":0,"translation":[9,0,0]},{"mesh":1,"scale":[1,2,3]}],"scenes":[{"nodes":[0,2]}"#;
    assert_eq!(parse_splats(&glb(scene)).unwrap().1.len(), ball.len());
    let without = String::from_utf8_lossy(&bytes).replace("KHR_gaussian_splatting", "KHR_gaussian_splutting");
    assert_eq!(crate::sniff(without.as_bytes()), Some(crate::Format::Mesh(ndf_mesh::io::MeshFormat::Glb)));
}
