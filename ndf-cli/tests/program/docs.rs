//! `docs/read_ndf.py`, the reader that keeps to `docs/format.md`, against what the program writes.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use ndf_core::Model;
use ndf_core::sampling::FaceSample;

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
    let fit = ["fit", "torus.ply", "--epochs", "20", "--samples", "512", "--base-faces", "200", "--quiet"];
    run(&[&fit[..], &["-o", "plain.ndf", "--lossless"]].concat());
    run(&[&fit[..], &["-o", "coded.ndf"]].concat());
    run(&["spectrum", "coded.ndf", "-o", "modes.ply", "--modes", "3", "--edge-length", "0.1"]);
    // One set with an output for every scalar, one that is told by an input which is meant.
    let scalars = ["--epochs", "20", "--quiet"];
    run(&[&["scalars", "fit", "coded.ndf", "modes.ply", "-o", "outputs.ndf"], &scalars[..]].concat());
    let paper = ["-o", "inputs.ndf", "--preset", "paper"];
    run(&[&["scalars", "fit", "coded.ndf", "modes.ply"], &paper[..], &scalars[..]].concat());

    for (name, arrays) in [("plain", 10), ("coded", 10), ("outputs", 17), ("inputs", 17)] {
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
    // It does see what is not the same, and damage.
    let other = read(&folder.0, &["plain.ndf", "--compare", "coded.safetensors"], "").unwrap();
    let said = String::from_utf8(other.stderr).unwrap();
    assert!(!other.status.success() && said.contains("network.0.weight"), "{said}");
    let mut bytes = std::fs::read(folder.0.join("coded.ndf")).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    folder.write("damaged.ndf", bytes);
    let damaged = read(&folder.0, &["damaged.ndf"], "").unwrap();
    let said = String::from_utf8(damaged.stderr).unwrap();
    assert!(!damaged.status.success() && said.contains("checksum of PROV"), "{said}");
}

/// The surface and the scalars at points inside faces, as the reader and as the library evaluate them.
fn check_evaluation(folder: &Path, file: &str) {
    let model = Model::read(&folder.join(file)).unwrap();
    let base = model.field.base();
    let points: Vec<FaceSample> = (0..base.face_count() as u32)
        .step_by(7)
        .map(|face| FaceSample { face, barycentric: [0.25, 0.125, 0.625] })
        .collect();
    let mut input = String::new();
    for FaceSample { face, barycentric: [a, b, c] } in &points {
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
