//! Where outputs go: never over an input, and what was learned outlives what cannot be written.

use super::{Folder, ndf};

const QUICK: [&str; 6] = ["--field", "levels", "--size", "1000", "--quiet", "--base-faces"];

fn fit(folder: &Folder, more: &[&str]) -> super::Run {
    ndf(&folder.0, &[&["fit"], more, &QUICK[..], &["100"]].concat())
}

#[test]
fn inputs_and_outputs_are_different_files() {
    let folder = Folder::new("outputs");
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "a.ply"]);
    let before = std::fs::read(folder.0.join("a.ply")).unwrap();
    let overwriting: [&[&str]; 4] = [
        &["a.ply", "-o", "./a.ply"],
        &["a.ply", "-o", "a.ndf", "--log", "a.ply"],
        &["a.ply", "-o", "a.ndf", "--checkpoint", "a.ply"],
        &["a.ply", "-o", "a.ndf", "--log", "a.ndf"],
    ];
    for arguments in overwriting {
        let run = fit(&folder, arguments);
        assert_eq!(run.code, 1, "{arguments:?}");
        let sentence = run.sentence();
        assert!(sentence.contains("is an input") || sentence.contains("two outputs"), "{sentence}");
    }
    for command in ["geodesic", "spectrum", "mesh"] {
        let source: &[&str] = if command == "geodesic" { &["--source-vertex", "0"] } else { &[] };
        let run = ndf(&folder.0, &[&[command, "a.ply", "-o", "a.ply"], source].concat());
        assert!(run.sentence().contains("a.ply is an input"), "{}", run.stderr);
    }
    assert_eq!(std::fs::read(folder.0.join("a.ply")).unwrap(), before);
    assert_eq!(folder.files(), ["a.ply"]);
}

/// Lengths of what lies too far away are infinite, so that it is refused before the work.
#[test]
fn vertices_that_lengths_cannot_be_computed_of_are_refused() {
    let folder = Folder::new("far");
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "a.obj"]);
    let near = std::fs::read_to_string(folder.0.join("a.obj")).unwrap();
    let (first, rest) = near.split_once("\nv ").unwrap();
    let rest = rest.split_once('\n').unwrap().1;
    folder.write("far.obj", format!("{first}\nv 0 1e155 0\n{rest}"));
    for arguments in [["far.obj", "-o", "a.ndf"].as_slice(), &["a.obj", "-o", "a.ndf", "--base", "far.obj"]] {
        let arguments = [&["fit", "--quiet"], arguments].concat();
        let run = ndf(&folder.0, &arguments);
        assert!(run.sentence().contains("lies beyond 1e75"), "{}", run.stderr);
    }
    assert_eq!(ndf(&folder.0, &["info", "far.obj"]).code, 0);
}

/// A model that cannot be written is one more run of `--resume` away, and a log decides nothing.
#[cfg(target_os = "linux")]
#[test]
fn what_was_learned_outlives_what_cannot_be_written() {
    let folder = Folder::new("unwritten");
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "a.ply"]);
    assert_eq!(fit(&folder, &["a.ply", "-o", "a.ndf"]).code, 0);
    let model = std::fs::read(folder.0.join("a.ndf")).unwrap();

    let full = fit(&folder, &["a.ply", "-o", "/dev/full", "--checkpoint", "c"]);
    assert!(full.code == 1 && full.sentence().contains("--resume c"), "{}", full.stderr);
    let resumed = ndf(&folder.0, &["fit", "a.ply", "-o", "b.ndf", "--resume", "c", "--quiet"]);
    assert_eq!((resumed.code, std::fs::read(folder.0.join("b.ndf")).unwrap()), (0, model.clone()));

    // The model is written although the checkpoint of a run whose time is up is not.
    let timed = ["a.ply", "-o", "t.ndf", "--checkpoint", "/dev/full", "--time-limit", "0.001"];
    let timed = fit(&folder, &timed);
    assert!(timed.code == 0 && timed.stderr.contains("cannot write /dev/full"), "{}", timed.stderr);
    assert!(folder.0.join("t.ndf").exists());
    let logged = fit(&folder, &["a.ply", "-o", "l.ndf", "--log", "/dev/full"]);
    assert!(logged.code == 1 && logged.sentence().contains("cannot write /dev/full"), "{}", logged.stderr);
    assert_eq!(std::fs::read(folder.0.join("l.ndf")).unwrap(), model);
}

/// The log of a run that is resumed goes on where it was, and its checkpoint goes when the model is there.
/// Names of 255 bytes are the longest; that of a checkpoint has a few more than its model's.
#[cfg(target_os = "linux")]
#[test]
fn names_that_are_too_long_are_refused_before_the_work() {
    let folder = Folder::new("long-names");
    let mesh = format!("{}.ply", "a".repeat(240));
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", &mesh, "--json"]).json();
    let model = format!("{}.ndf", "b".repeat(245));
    let run = ndf(&folder.0, &["fit", &mesh, "-o", &model, "--epochs", "1000000"]);
    assert!(run.code == 1 && run.sentence().contains("name too long"), "{}", run.stderr);
    let written = fit(&folder, &[&mesh, "-o", &model, "--checkpoint", "c"]);
    assert_eq!(written.code, 0, "{}", written.stderr);
}

#[test]
fn a_resumed_run_goes_on_with_its_log() {
    let folder = Folder::new("relogged");
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "a.ply"]);
    let lines = || std::fs::read_to_string(folder.0.join("l")).unwrap().lines().count();
    let kept = ["--checkpoint", "a.ndf.checkpoint", "--time-limit", "0"];
    let halted = fit(&folder, &[&["a.ply", "-o", "a.ndf", "--log", "l"], &kept[..]].concat());
    assert_eq!(halted.code, 0, "{}", halted.stderr);
    let before = lines();
    let resumed = ["fit", "a.ply", "-o", "a.ndf", "--resume", "a.ndf.checkpoint", "--log", "l", "--quiet"];
    assert_eq!(ndf(&folder.0, &resumed).code, 0);
    assert!(lines() > before, "{} lines after {before}", lines());
    assert_eq!(folder.files(), ["a.ndf", "a.ply", "l"]);
}
