//! Neural fields and splats, from the files that `ndf sample` writes to meshes.

use super::{Folder, ndf};

/// Kinds, files and arguments of `ndf sample`, and the level that `ndf info` is to find.
const MADE: [(&str, &str, &[&str]); 3] = [
    ("neus", "torus.safetensors", &["--shape", "torus"]),
    ("nerf", "ball.safetensors", &["--shape", "sphere"]),
    ("splats", "ball.ply", &["--shape", "sphere", "--points", "3000"]),
];

#[test]
fn every_kind_is_sampled_told_learned_and_extracted() {
    for (kind, file, more) in MADE {
        let folder = Folder::new(kind);
        let sample = [&["sample", kind, "-o", file, "--json"], more].concat();
        ndf(&folder.0, &sample).json();
        let told = ndf(&folder.0, &["info", file, "--json"]).json();
        assert_eq!(told["kind"], kind);
        assert!(told["level"].is_f64() && told["diagonal"].as_f64().unwrap() > 1.0, "{told}");

        let fit = [
            "fit",
            file,
            "-o",
            "m.ndf",
            "--base-faces",
            "500",
            "--field",
            "network",
            "--epochs",
            "200",
            "--samples",
            "500",
            "--json",
        ];
        let fitted = ndf(&folder.0, &fit).json();
        assert_eq!(fitted["kind"], kind);
        assert!(fitted["projection_rms"].as_f64().unwrap() < 0.02, "{fitted}");
        assert!(fitted["cache"]["projection_error_rms"].as_f64().unwrap() < 1e-3, "{fitted}");
        assert_eq!(fitted["missed_fraction"], 0.0);
        let extract = ["extract", "m.ndf", "-o", "m.ply", "--relative-edge-length", "0.1", "--json"];
        let extracted = ndf(&folder.0, &extract).json();
        let euler = if kind == "neus" { 0 } else { 2 };
        assert_eq!(
            (&extracted["euler_characteristic"], &extracted["manifold"]),
            (&euler.into(), &true.into())
        );
    }
}

#[test]
fn threads_change_no_byte_of_what_is_learned_from_a_cached_field() {
    let folder = Folder::new("threads-field");
    ndf(&folder.0, &["sample", "neus", "-o", "a.safetensors", "--shape", "torus", "--json"]).json();
    let fit = |output: &str, more: &[&str]| {
        let fit = ["fit", "a.safetensors", "-o", output, "--base-faces", "300", "--samples", "300", "--json"];
        ndf(&folder.0, &[&fit, more].concat()).json();
        std::fs::read(folder.0.join(output)).unwrap()
    };
    let network = ["--field", "network", "--epochs", "150"];
    assert_eq!(fit("a.ndf", &network), fit("b.ndf", &[&network[..], &["--threads", "1"]].concat()));
}

#[test]
fn levels_are_chosen_by_rule_or_asked_for() {
    let folder = Folder::new("levels");
    ndf(&folder.0, &["sample", "nerf", "-o", "a.safetensors", "--shape", "torus", "--json"]).json();
    let chosen = ndf(&folder.0, &["info", "a.safetensors", "--json"]).json();
    assert!(chosen["level_rule"].as_str().unwrap().contains("light"), "{chosen}");
    let asked = ndf(&folder.0, &["info", "a.safetensors", "--iso", "50", "--json"]).json();
    assert_eq!((&asked["level"], &asked["level_rule"]), (&50.0.into(), &"as asked for".into()));
    // At 50 the density has the tube of the shape: the volume of a torus of 0.6 and 0.25.
    let mesh = ["mesh", "a.safetensors", "-o", "a.ply", "--iso", "50", "--grid", "60", "--json"];
    ndf(&folder.0, &mesh).json();
    let volume = ndf(&folder.0, &["info", "a.ply", "--json"]).json()["volume"].as_f64().unwrap();
    let expected = 2.0 * std::f64::consts::PI.powi(2) * 0.6 * 0.25_f64.powi(2);
    assert!((volume - expected).abs() < 0.02 * expected, "{volume} {expected}");

    let empty =
        ndf(&folder.0, &["mesh", "a.safetensors", "-o", "b.ply", "--iso", "1e9", "--grid", "20", "--quiet"]);
    assert!(empty.sentence().contains("does not cross its level"));
    assert_eq!(ndf(&folder.0, &["info", "a.safetensors", "--iso", "nan"]).code, 2);
}

#[test]
fn bad_fields_are_refused_with_a_sentence() {
    let folder = Folder::new("bad-fields");
    let pickle = b"\x80\x02cos\nsystem\nX\x04\x00\x00\x00true\x85R.";
    folder.write("cut.npy", b"\x93NUMPY\x01\x00\x10\x00{'descr'");
    folder.write(
        "legacy.pth",
        [&b"\x80\x02\x8a\nl\xfc\x9cF\xf9 j\xa8P\x19.\x80\x02K\x01.\x80\x02}."[..], pickle, b"\x80\x02]."]
            .concat(),
    );
    folder.write("unknown.safetensors", [&[8, 0, 0, 0, 0, 0, 0, 0][..], b"{}      "].concat());
    folder.write("cut.spz", b"NGSP\x03\x00\x00\x00\xff\xff\xff\xff\x00\x0c\x00\x00");
    folder.write("cut.h5", b"\x89HDF\r\n\x1a\n\x00");
    folder.write("no-items.laz", laz_without_items());
    folder.write("a.ksplat", [0x00, 0x01, 0x00, 0xff].repeat(99));
    for (file, said) in [
        ("cut.npy", "header"),
        ("legacy.pth", "os.system"),
        ("unknown.safetensors", "no tensors"),
        ("cut.spz", "4294967295 splats"),
        ("cut.h5", "HDF5"),
        ("no-items.laz", "compressed data is damaged"),
        ("a.ksplat", "splats from PLY, SPZ, SOG, GLB, PyTorch, .splat and .ksplat"),
    ] {
        for (command, output) in [("info", ""), ("fit", "out.ndf"), ("mesh", "out.ply")] {
            let all = [command, file, "-o", output];
            let run = ndf(&folder.0, if command == "info" { &all[..2] } else { &all });
            let sentence = run.sentence();
            assert!(sentence.contains(said) && sentence.contains(file), "{sentence}");
        }
    }
    // The codes of a decoder in the place of the decoder.
    let mut codes = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    codes.extend(format!("{:<117}\n", "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }").bytes());
    codes.extend([0; 24]);
    folder.write("codes.npy", codes);
    assert!(ndf(&folder.0, &["info", "codes.npy"]).sentence().contains("--latent"));
    // What is meant for a mesh is compared with meshes alone.
    folder.write("letter", "Dear reader,\n");
    let unknown = ndf(&folder.0, &["fit", "letter", "-o", "a.ndf"]);
    assert!(unknown.sentence().contains("of no known kind") && unknown.sentence().contains("E57"));
    let mesh = ndf(&folder.0, &["fit", "letter", "-o", "a.ndf", "--as", "mesh"]);
    assert!(mesh.sentence().contains("is not a mesh file") && !mesh.sentence().contains("E57"));
    // Three sheets that meet along an edge enclose nothing.
    folder.write("fin.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 -1\nf 1 2 3\nf 1 2 4\nf 1 2 5\n");
    for command in ["fit", "demo"] {
        assert!(ndf(&folder.0, &[command, "fin.obj", "-o", "a"]).sentence().contains("`ndf fit --base`"));
    }
    ndf(&folder.0, &["sample", "nerf", "-o", "a.safetensors", "--json"]).json();
    let wrong = ndf(&folder.0, &["info", "a.safetensors", "--as", "neus"]);
    assert!(wrong.sentence().contains("of the kind nerf"));
    let none = ndf(&folder.0, &["sample", "neus", "--shape", "cube", "-o", "b.safetensors"]);
    assert!(none.sentence().contains("torus"));
}

/// A LAZ file that says of nothing how it is packed, which its decoder asserts.
fn laz_without_items() -> Vec<u8> {
    let mut bytes = vec![0; 227 + 54 + 34 + 16];
    let mut put = |at: usize, with: &[u8]| bytes[at..at + with.len()].copy_from_slice(with);
    // The header: version 1.2, its size, the place of the points, one record, packed points of 20 bytes, one of them.
    put(0, b"LASF");
    put(24, &[1, 2]);
    put(94, &227_u16.to_le_bytes());
    put(96, &315_u32.to_le_bytes());
    put(100, &1_u32.to_le_bytes());
    put(104, &[0x80, 20, 0, 1]);
    (0..3).for_each(|axis| put(131 + 8 * axis, &0.001_f64.to_le_bytes()));
    // The record: whose it is, its number and size; how points are packed, in chunks of 50,000.
    put(227 + 2, b"laszip encoded");
    put(227 + 18, &22204_u16.to_le_bytes());
    put(227 + 20, &34_u16.to_le_bytes());
    put(281, &[2, 0, 0, 0, 2, 2]);
    put(281 + 12, &50_000_u32.to_le_bytes());
    put(281 + 16, &[0xff; 16]);
    // The place of the table of chunks, of which there are none.
    put(315, &323_u64.to_le_bytes());
    bytes
}
