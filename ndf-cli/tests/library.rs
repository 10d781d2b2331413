//! Program and library agree: the same input and settings give the same bytes.

#![allow(clippy::unwrap_used, reason = "all of this file is test code")]

use std::path::PathBuf;
use std::process::Command;

use ndf::{Fit, FitError, OpenOptions, Preset};
use ndf_train::levels::LevelOptions;

/// A folder of its own, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("ndf-library-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn run(&self, arguments: &[&str]) {
        let run = Command::new(env!("CARGO_BIN_EXE_ndf")).current_dir(&self.0).args(arguments).output();
        let run = run.unwrap();
        assert!(run.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&run.stderr));
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Fits a built-in shape of this kind with the program, and with the library.
fn program_and_library_agree(kind: &str, file: &str) {
    let folder = Folder::new(kind);
    folder.run(&["sample", kind, "-o", file, "--shape", "torus", "--points", "3000"]);
    let settings = ["--epochs", "30", "--samples", "512", "--base-faces", "300", "--seed", "7", "--quiet"];
    folder.run(&[&["fit", file, "-o", "model.ndf"], &settings[..]].concat());
    let opened = ndf::open(folder.0.join(file), &OpenOptions::default()).unwrap();
    assert_eq!(opened.kind.name(), kind);
    let fit = Fit::new(&opened).epochs(30).samples(512).base_faces(300).seed(7);
    let fitted = fit.run().unwrap();
    let written = std::fs::read(folder.0.join("model.ndf")).unwrap();
    assert!(written == fitted.model.to_bytes(), "the models of a {kind} differ");
}

#[test]
fn meshes_give_the_same_model() {
    program_and_library_agree("mesh", "a.ply");
}

#[test]
fn clouds_give_the_same_model() {
    program_and_library_agree("cloud", "a.ply");
}

#[test]
fn clouds_with_normals_give_the_same_model() {
    program_and_library_agree("oriented-cloud", "a.ply");
}

#[test]
fn networks_give_the_same_model() {
    program_and_library_agree("neus", "a.safetensors");
}

#[test]
fn splats_give_the_same_model() {
    program_and_library_agree("splats", "a.ply");
}

#[test]
fn settings_of_networks_are_refused_with_levels() {
    let folder = Folder::new("levels");
    folder.run(&["sample", "mesh", "-o", "a.ply", "--shape", "torus"]);
    let opened = ndf::open(folder.0.join("a.ply"), &OpenOptions::default()).unwrap();
    let fit = || Fit::new(&opened).levels(LevelOptions::default()).seed(7);
    for refused in [fit().epochs(30), fit().preset(Preset::Paper)] {
        assert!(matches!(refused.run(), Err(FitError::NotOfLevels(what)) if what.starts_with("settings")));
    }
}
