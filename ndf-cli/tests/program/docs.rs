//! `docs/read_ndf.py`, the reader that keeps to `docs/format.md`, against what the program writes.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use ndf_mesh::FacePoint;
use ndf_model::Model;

use super::{Folder, ndf};

/// Runs the reader in a folder; `None` where there is no Python.
fn read(folder: &Path, arguments: &[&str], input: &str) -> Option<Output> {
    let reader = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/read_ndf.py");
    let child = Command::new("python3")
        .current_dir(folder)
        .arg(reader)
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let mut child = match child {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return None,
        child => child.unwrap(),
    };
    child.stdin.take().unwrap().write_all(input.as_bytes()).unwrap();
    Some(child.wait_with_output().unwrap())
}

/// What a run of the reader that succeeded printed.
fn printed(output: Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn docs_reader_reads_what_is_written() {
    let folder = Folder::new("docs-reader");
    let run = |arguments: &[&str]| assert_eq!(ndf(&folder.0, arguments).code, 0, "{arguments:?}");
    run(&["sample", "mesh", "--shape", "torus", "-o", "torus.ply"]);
    let fit = [
        "fit",
        "torus.ply",
        "--epochs",
        "20",
        "--samples",
        "512",
        "--base-faces",
        "200",
        "--field",
        "network",
        "--quiet",
    ];
    run(&[&fit[..], &["-o", "plain.ndf", "--lossless"]].concat());
    run(&[&fit[..], &["-o", "coded.ndf"]].concat());
    run(&["spectrum", "coded.ndf", "-o", "modes.ply", "--modes", "3", "--edge-length", "0.1"]);
    // One set with an output for every scalar, one that is told by an input which is meant.
    let scalars = ["--epochs", "20", "--quiet"];
    run(&[&["scalars", "fit", "coded.ndf", "modes.ply", "-o", "outputs.ndf"], &scalars[..]].concat());
    let paper = ["-o", "inputs.ndf", "--preset", "paper"];
    run(&[&["scalars", "fit", "coded.ndf", "modes.ply"], &paper[..], &scalars[..]].concat());
    // Integers on levels, of a base mesh that plain Python has elements enough for.
    let few =
        ["fit", "torus.ply", "-o", "few.ndf", "--epochs", "20", "--samples", "512", "--base-faces", "60"];
    run(&[&few[..], &["--quiet"]].concat());
    run(&["spectrum", "few.ndf", "-o", "few.ply", "--modes", "3", "--edge-length", "0.1"]);
    run(&["scalars", "fit", "few.ndf", "few.ply", "-o", "integers.ndf", "--quiet"]);

    for (name, arrays) in [("plain", 10), ("coded", 10), ("outputs", 17), ("inputs", 17), ("integers", 13)] {
        let (model, tensors) = (format!("{name}.ndf"), format!("{name}.safetensors"));
        run(&["convert", &model, "-o", &tensors]);
        let Some(compared) = read(&folder.0, &[&model, "--compare", &tensors], "") else {
            eprintln!("skipped: there is no python3 to run docs/read_ndf.py with");
            return;
        };
        let compared = printed(compared);
        assert!(compared.starts_with(&format!("{arrays} arrays of ")), "{compared}");
        check_evaluation(&folder.0, &model);
    }
    refuses_what_is_wrong(&folder);
}

/// Arrays that are not the same, damage, files of other kinds and points that are none: a line for each.
fn refuses_what_is_wrong(folder: &Folder) {
    let coded = std::fs::read(folder.0.join("coded.ndf")).unwrap();
    let mut damaged = coded.clone();
    *damaged.last_mut().unwrap() ^= 1;
    folder.write("damaged.ndf", damaged);
    let siml = |scale: f64| [scale, 0.0, 0.0, 0.0].map(f64::to_le_bytes).concat();
    folder.write("flat.ndf", with_section(&coded, *b"SIML", &siml(0.0)));
    folder.write("endless.ndf", with_section(&coded, *b"SIML", &siml(f64::INFINITY)));
    folder.write("far.ndf", with_section(&coded, *b"SIML", &siml(6e-309)));
    folder.write("faceless.ndf", with_section(&coded, *b"BASE", &plain_base(&folder.0.join("coded.ndf"))));
    for (arguments, input, said) in [
        (&["plain.ndf", "--compare", "coded.safetensors"][..], "", "network.0.weight"),
        (&["plain.ndf", "--compare", "torus.ply"], "", "torus.ply: no .safetensors file"),
        (&["plain.ndf", "--compare", "plain.ndf"], "", "plain.ndf: no .safetensors file"),
        (&["plain.ndf", "--compare", "none.safetensors"], "", "none.safetensors: No such file"),
        (&["none.ndf"], "", "none.ndf: No such file"),
        (&["torus.ply"], "", "torus.ply: no .ndf model"),
        (&["damaged.ndf"], "", "checksum of PROV"),
        (&["flat.ndf"], "", "the scale of the box is out of range"),
        (&["endless.ndf"], "", "not finite"),
        (&["far.ndf"], "", "the scale of the box is out of range"),
        (&["faceless.ndf"], "", "a face has a vertex that is not there"),
        (&["plain.ndf", "--evaluate"], "0 1 0 0\n200 1 0 0\n", "line 2 of the points: there is no face 200"),
        (&["plain.ndf", "--evaluate"], "-1 1 0 0\n", "there is no face -1"),
        (&["plain.ndf", "--evaluate"], "0 1 0\n", "a face and three numbers"),
        (&["plain.ndf", "--evaluate"], "0 1 0 x\n", "a face and three numbers"),
        (&["plain.ndf", "--evaluate"], "0 nan 0 0\n", "add up to 1"),
    ] {
        let output = read(&folder.0, arguments, input).unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), stderr.lines().count()), (Some(1), 1), "{arguments:?}: {stderr}");
        assert!(stderr.contains(said), "{arguments:?}: {stderr}");
    }
    // The program refuses the same models.
    for model in ["damaged.ndf", "flat.ndf", "endless.ndf", "far.ndf", "faceless.ndf"] {
        let extract = ["extract", model, "-o", "out.ply", "--relative-edge-length", "0.5"];
        assert!(ndf(&folder.0, &extract).sentence().contains(model));
    }
}

/// A model file with another payload for a section, all checksums right.
fn with_section(bytes: &[u8], tag: [u8; 4], payload: &[u8]) -> Vec<u8> {
    let word = |at: usize| u32::from_le_bytes(*bytes[at..].first_chunk().unwrap());
    let entries: Vec<usize> = (0..word(12) as usize).map(|i| 16 + 16 * i).collect();
    let mut header = bytes[..16].to_vec();
    let mut payloads = Vec::new();
    let mut at = 16 + 16 * entries.len() + 4;
    for entry in entries {
        let length = word(entry + 8) as usize;
        let kept = &bytes[at..at + length];
        at += length;
        let new = if bytes[entry..entry + 4] == tag { payload } else { kept };
        header.extend(&bytes[entry..entry + 4]);
        header.extend(crc32fast::hash(new).to_le_bytes());
        header.extend((new.len() as u64).to_le_bytes());
        payloads.extend(new);
    }
    let sum = crc32fast::hash(&header).to_le_bytes();
    [&header[..], &sum, &payloads].concat()
}

/// The base mesh of a model as plain numbers, but for a vertex of the last face, which is one more than there are.
fn plain_base(file: &Path) -> Vec<u8> {
    let model = Model::read(file).unwrap();
    let base = model.field.base();
    let (vertices, faces) = (base.vertex_count(), base.face_count());
    let mut bytes = vec![0];
    bytes.extend([vertices, faces].map(|n| (n as u32).to_le_bytes()).concat());
    let coordinates = base.positions().iter().flat_map(|p| p.as_vec3().to_array());
    bytes.extend(coordinates.flat_map(f32::to_le_bytes));
    let mut indices: Vec<u16> = base.faces().iter().flatten().map(|&i| i as u16).collect();
    *indices.last_mut().unwrap() = vertices as u16;
    bytes.extend(indices.into_iter().flat_map(u16::to_le_bytes));
    bytes
}

/// The surface and the scalars at points inside faces, as the reader and as the library evaluate them.
fn check_evaluation(folder: &Path, file: &str) {
    let model = Model::read(&folder.join(file)).unwrap();
    let base = model.field.base();
    let points: Vec<FacePoint> = base
        .face_indices()
        .step_by(7)
        .map(|face| FacePoint { face, barycentric: [0.25, 0.125, 0.625] })
        .collect();
    let mut input = String::new();
    for FacePoint { face, barycentric: [a, b, c] } in &points {
        writeln!(input, "{face} {a} {b} {c}").unwrap();
    }
    let printed = printed(read(folder, &[file, "--evaluate"], &input).unwrap());
    let scalars: Vec<Vec<f32>> = model.scalars.iter().map(|s| s.evaluate(base, &points)).collect();
    let mapped = model.field.map(&points);
    assert_eq!(printed.lines().count(), points.len());
    for (i, line) in printed.lines().enumerate() {
        let found: Vec<f64> = line.split(' ').map(|x| x.parse().unwrap()).collect();
        let mut expected = model.similarity.to_world(mapped[i]).to_array().to_vec();
        for values in &scalars {
            let channels = values.len() / points.len();
            expected.extend(values[i * channels..][..channels].iter().map(|&x| f64::from(x)));
        }
        let close = found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-5);
        assert!(found.len() == expected.len() && close, "{file}: {found:?} {expected:?}");
    }
}
