//! Program and library agree: the same input and settings give the same bytes.

#![allow(clippy::unwrap_used, reason = "all of this file is test code")]

use std::path::PathBuf;
use std::process::Command;

use ndf::{
    DistanceMethod, DistanceOptions, EdgeLength, Field, Fit, FitError, LengthFactors, NoProgress, Note,
    OpenOptions, Place, Preset, Triangulated, Vertex,
};
use ndf_spectral::ModeOptions;
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

/// Levels are the default, of the same bytes as the program's; what only networks have makes a network, or is refused.
#[test]
fn what_is_asked_for_decides_what_is_learned() {
    let folder = Folder::new("levels");
    folder.run(&["sample", "mesh", "-o", "a.ply", "--shape", "torus"]);
    let opened = ndf::open(folder.0.join("a.ply"), &OpenOptions::default()).unwrap();
    let fit = || Fit::new(&opened).base_faces(300).seed(7);
    let fitted = fit().run().unwrap();
    assert!(fitted.model.field.levels().is_some() && fitted.notes.is_empty());
    folder.run(&["fit", "a.ply", "-o", "a.ndf", "--base-faces", "300", "--seed", "7", "--quiet"]);
    assert!(std::fs::read(folder.0.join("a.ndf")).unwrap() == fitted.model.to_bytes());

    let quick = || fit().epochs(3).samples(64);
    for (network, what) in [(quick(), "epochs"), (fit().features(8).epochs(3).samples(64), "features")] {
        let fitted = network.run().unwrap();
        assert!(fitted.model.field.network().is_some());
        assert_eq!(fitted.notes, [Note::NetworkNeeded { what }]);
    }
    assert_eq!(quick().field(Field::Network).run().unwrap().notes, []);
    for refused in [fit().epochs(30), fit().preset(Preset::Paper), fit().with(|_| ())] {
        let refused = refused.field(Field::Levels).run();
        assert!(matches!(refused, Err(FitError::NotOfLevels(_))));
    }
}

/// The metric of a mesh that was learned is its area. Distances and eigenvalues follow it, unless it is left aside.
#[test]
fn lengths_follow_the_metric() {
    let folder = Folder::new("metric");
    folder.run(&["sample", "mesh", "-o", "a.ply", "--shape", "torus"]);
    let opened = ndf::open(folder.0.join("a.ply"), &OpenOptions::default()).unwrap();
    let levels = LevelOptions { levels: Some(2), iterations: [4, 6], ..LevelOptions::default() };
    let model = Fit::new(&opened).base_faces(300).levels(levels).run().unwrap().model;
    let area = ndf::read_mesh(folder.0.join("a.ply")).unwrap().mesh.area();
    let measured = f64::from(model.metric.unwrap().area()) / model.similarity.scale().powi(2);
    assert!((measured / area - 1.0).abs() < 5e-4, "{measured} for {area}");

    let mut mesh = Triangulated::from_model(&model, EdgeLength::Relative(0.1), &NoProgress).unwrap();
    let LengthFactors { operators, distances } = mesh.factors.unwrap();
    assert!((mesh.mesh().area() * operators * operators / measured - 1.0).abs() < 1e-6);
    assert!(distances > 1.0 && distances < operators, "{distances} {operators}");
    let measure = |mesh: &Triangulated, method| {
        let options = DistanceOptions {
            method,
            paths_to: vec![Place::Vertex(Vertex::new(9))],
            ..DistanceOptions::default()
        };
        let found = mesh.distances(&[Place::Vertex(Vertex::new(0))], &options, &NoProgress).unwrap();
        (found.values.iter().sum::<f64>(), found.paths[0].as_ref().unwrap().length)
    };
    let options = ModeOptions { count: 5, ..ModeOptions::default() };
    let values = |mesh: &Triangulated| mesh.modes(&options, &NoProgress).unwrap().eigenvalues;
    let all = |mesh: &Triangulated| {
        ([DistanceMethod::Exact, DistanceMethod::Heat].map(|method| measure(mesh, method)), values(mesh))
    };
    let (with, eigenvalues_with) = all(&mesh);
    mesh.factors = None;
    let (without, eigenvalues_without) = all(&mesh);
    let is_near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-6;
    for (with, without) in with.into_iter().zip(without) {
        assert!(is_near(with.0, distances * without.0) && is_near(with.1, distances * without.1));
    }
    for (with, without) in eigenvalues_with.iter().zip(&eigenvalues_without).skip(1) {
        assert!(is_near(*with, without / operators.powi(2)), "{with} {without}");
    }
    // A factor of one changes nothing.
    mesh.factors = Some(LengthFactors::ONE);
    assert_eq!(all(&mesh), (without, eigenvalues_without));

    std::fs::write(folder.0.join("a.ndf"), model.to_bytes()).unwrap();
    let asked = [
        "geodesic",
        "a.ndf",
        "-o",
        "d.ply",
        "--source-vertex",
        "0",
        "--relative-edge-length",
        "0.1",
        "--json",
    ];
    let json = |more: &[&str]| -> serde_json::Value {
        let run =
            Command::new(env!("CARGO_BIN_EXE_ndf")).current_dir(&folder.0).args(asked).args(more).output();
        serde_json::from_slice(&run.unwrap().stdout).unwrap()
    };
    // A parser may be off by an ulp.
    let told = json(&[])["metric"]["distances"].as_f64().unwrap();
    assert!((told / distances - 1.0).abs() < 1e-15, "{told} {distances}");
    assert!(json(&["--no-metric"]).get("metric").is_none());
}
