//! Scalars stored in models.

use ndf_mesh::io::read_mesh;
use serde_json::Value;

use super::{Folder, Run, ndf};

/// A folder with a learned torus, `torus.ndf`, and distances and modes on a mesh of it, `values.ply` and `modes.ply`.
fn folder(test: &str) -> Folder {
    let folder = Folder::new(test);
    let run = |arguments: &[&str]| assert_eq!(ndf(&folder.0, arguments).code, 0, "{arguments:?}");
    run(&["sample", "mesh", "--shape", "torus", "-o", "torus.ply"]);
    let fit =
        ["fit", "torus.ply", "-o", "torus.ndf", "--epochs", "60", "--samples", "512", "--base-faces", "400"];
    run(&[&fit[..], &["--field", "network", "--quiet"]].concat());
    let length = ["--edge-length", "0.06"];
    run(&[&["geodesic", "torus.ndf", "-o", "distance.ply", "--source", "1.4,0,0"], &length[..]].concat());
    run(&[&["spectrum", "torus.ndf", "-o", "modes.ply", "--modes", "4"], &length[..]].concat());
    folder
}

fn learn(folder: &Folder, model: &str, values: &str, output: &str, more: &[&str]) -> Run {
    let arguments = [&["scalars", "fit", model, values, "-o", output, "--quiet"], more].concat();
    ndf(&folder.0, &arguments)
}

const QUICK: [&str; 3] = ["--epochs", "300", "--json"];

#[test]
fn distances_and_modes_are_stored_and_come_back() {
    let folder = folder("scalars");
    let fit = learn(&folder, "torus.ndf", "modes.ply", "modes.ndf", &QUICK).json();
    for key in ["seconds", "epochs", "rms_error", "max_error", "bytes", "model_bytes", "distance_rms"] {
        assert!(fit[key].is_number(), "{key}: {fit}");
    }
    assert_eq!((fit["epochs"].as_u64(), fit["features"].as_u64()), (Some(300), Some(4)));
    assert!(fit["rms_error"].as_f64().unwrap() < 0.03, "{fit}");
    // The first mode is constant.
    assert_eq!(fit["scalars"][0]["max_error"].as_f64(), Some(0.0), "{fit}");

    // A second set beside the first.
    let more = [&QUICK[..], &["--features", "2"]].concat();
    let both = learn(&folder, "modes.ndf", "distance.ply", "both.ndf", &more).json();
    assert_eq!(both["features"], 2);
    let info = ndf(&folder.0, &["info", "both.ndf", "--json"]).json();
    let names = ["mode_00", "mode_01", "mode_02", "mode_03", "distance"];
    assert_eq!(info["scalars"], Value::from(names.to_vec()));
    let bytes = |v: &Value| v["bytes"].as_u64().unwrap();
    assert_eq!(info["bytes"]["scalars"].as_u64(), Some(bytes(&fit) + bytes(&both)));
    assert_eq!(info["bytes"]["total"], both["model_bytes"]);
    assert_eq!(info["provenance"]["scalars"].as_array().map(Vec::len), Some(2));
    // Learned again, a set takes the place of the one before; more is not told of it than before.
    learn(&folder, "both.ndf", "distance.ply", "again.ndf", &more);
    let read = |name: &str| std::fs::read(folder.0.join(name)).unwrap();
    assert!(read("again.ndf") == read("both.ndf"));
    let text = ndf(&folder.0, &["info", "both.ndf"]).stdout;
    assert!(text.contains("mode_03, distance"), "{text}");

    let eval = ["scalars", "eval", "both.ndf", "-o", "out.ply", "--edge-length", "0.06", "--json"];
    let eval = ndf(&folder.0, &eval).json();
    let (out, truth) =
        (read_mesh(folder.0.join("out.ply")).unwrap(), read_mesh(folder.0.join("distance.ply")).unwrap());
    assert_eq!(eval["vertices"].as_u64(), Some(out.mesh.vertex_count() as u64));
    assert!(out.scalars.iter().map(|s| s.name.as_str()).eq(names));
    // Both meshes are that of the model at the same edge length.
    assert_eq!(out.mesh, truth.mesh);
    let range = f64::from(truth.scalars[0].values.iter().fold(0.0_f32, |m, x| m.max(*x)));
    let errors = out.scalars[4].values.iter().zip(&truth.scalars[0].values);
    let squares: f64 = errors.map(|(a, b)| f64::from(a - b).powi(2)).sum();
    let rms = (squares / out.mesh.vertex_count() as f64).sqrt() / range;
    let claimed = both["rms_error"].as_f64().unwrap();
    assert!(rms < 0.04 && rms < 1.5 * claimed && claimed < 1.5 * rms, "{rms} {claimed}");
    let drawn = ["render", "out.ply", "-o", "out.png", "--scalar", "distance", "--size", "80,60"];
    assert_eq!(ndf(&folder.0, &drawn).code, 0);
    // The surface is as it was, and relative lengths are understood.
    let extract = |model: &str, output: &str| {
        ndf(&folder.0, &["extract", model, "-o", output, "--relative-edge-length", "0.1"]);
        std::fs::read(folder.0.join(output)).unwrap()
    };
    assert!(extract("torus.ndf", "a.ply") == extract("both.ndf", "b.ply"));
    let relative = ["scalars", "eval", "both.ndf", "-o", "r.ply", "--relative-edge-length", "0.1"];
    assert!(ndf(&folder.0, &relative).stdout.contains("distance"));
}

/// On levels, which is what is done where no network is asked for: fewer bytes and less error, and budgets are kept.
#[test]
fn levels_keep_to_size_and_error_and_go_through_every_command() {
    let folder = folder("scalar-levels");
    let levels = learn(&folder, "torus.ndf", "modes.ply", "levels.ndf", &["--json"]).json();
    let network = learn(&folder, "torus.ndf", "modes.ply", "network.ndf", &QUICK).json();
    let number = |v: &Value, key: &str| v[key].as_f64().unwrap();
    assert!(number(&levels, "bytes") < 0.3 * number(&network, "bytes"), "{levels}");
    assert!(number(&levels, "rms_error") < number(&network, "rms_error"), "{levels}");
    assert_eq!((&levels["features"], levels["nodes"].as_u64().unwrap() > 400), (&Value::from(0), true));
    let info = ndf(&folder.0, &["info", "levels.ndf", "--json"]).json();
    assert_eq!(info["bytes"]["scalars"], levels["bytes"]);

    let small = learn(&folder, "torus.ndf", "modes.ply", "small.ndf", &["--size", "300", "--json"]).json();
    assert!(number(&small, "bytes") <= 300.0 && number(&small, "rms_error") > number(&levels, "rms_error"));
    let coarse = learn(&folder, "torus.ndf", "modes.ply", "coarse.ndf", &["--error", "1%", "--json"]).json();
    assert!(number(&coarse, "rms_error") <= 0.0105, "{coarse}");

    let eval = ["scalars", "eval", "levels.ndf", "-o", "out.ply", "--edge-length", "0.06"];
    assert_eq!(ndf(&folder.0, &eval).code, 0);
    let read = |name: &str| read_mesh(folder.0.join(name)).unwrap().scalars;
    for (found, truth) in read("out.ply").iter().zip(read("modes.ply")).skip(1) {
        let worst = found.values.iter().zip(&truth.values).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        let most = truth.values.iter().fold(0.0_f32, |m, x| m.max(x.abs()));
        assert!(found.name == truth.name && worst < 0.05 * most, "{} {worst} {most}", found.name);
    }
    for (from, to) in [("levels.ndf", "t.safetensors"), ("t.safetensors", "again.ndf")] {
        assert_eq!(ndf(&folder.0, &["convert", from, "-o", to]).code, 0);
    }
    let bytes = |name: &str| std::fs::read(folder.0.join(name)).unwrap();
    assert!(bytes("again.ndf") == bytes("levels.ndf"));
    for (arguments, said) in [
        (&["--field", "levels", "--epochs", "5"][..], "--field network"),
        (&["--field", "network", "--size", "1000"], "--features"),
        (&["--error", "1%", "--features", "2"], "for scalars on levels"),
    ] {
        let run = learn(&folder, "torus.ndf", "modes.ply", "none.ndf", arguments);
        assert!(run.stderr.contains(said), "{arguments:?} {}", run.stderr);
    }
}

#[test]
fn the_seed_decides_every_byte_of_scalars_and_the_threads_none() {
    let folder = folder("scalar-seeds");
    let run = |output: &str, more: &[&str]| {
        let quick = ["--epochs", "40", "--scalar", "mode_01", "--scalar", "mode_03"];
        let run = learn(&folder, "torus.ndf", "modes.ply", output, &[&quick[..], more].concat());
        assert_eq!(run.code, 0, "{}", run.stderr);
        assert!(run.stdout.contains("mode_01") && !run.stdout.contains("mode_02"), "{}", run.stdout);
        std::fs::read(folder.0.join(output)).unwrap()
    };
    let first = run("a.ndf", &["--threads", "1"]);
    assert!(first == run("b.ndf", &["--threads", "2"]));
    assert!(first != run("c.ndf", &["--seed", "1"]));
    assert!(first != run("d.ndf", &["--preset", "paper"]));
}

#[test]
fn scalars_that_cannot_be_stored_are_refused() {
    let folder = folder("scalar-errors");
    let failed = |model: &str, values: &str, more: &[&str]| {
        let run = learn(&folder, model, values, "out.ndf", more);
        assert!(!folder.0.join("out.ndf").exists());
        run.sentence().to_owned()
    };
    assert!(failed("torus.ndf", "torus.ply", &[]).contains("no scalars"));
    assert!(failed("torus.ndf", "missing.ply", &[]).contains("missing.ply"));
    assert!(failed("torus.ply", "modes.ply", &[]).contains("not an .ndf model"));
    let model = failed("torus.ndf", "torus.ndf", &[]);
    assert!(model.contains("torus.ndf is a model") && model.contains("ndf spectrum"), "{model}");
    let unknown = failed("torus.ndf", "modes.ply", &["--scalar", "mode_99"]);
    assert!(unknown.contains("mode_99") && unknown.contains("mode_03"), "{unknown}");
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                  property float u\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
    folder.write("nan.ply", format!("{header}0 0 0 1\n1 0 0 nan\n0 1 0 2\n3 0 1 2\n"));
    let nan = failed("torus.ndf", "nan.ply", &[]);
    assert!(nan.contains("nan.ply") && nan.contains("1 of the 3 values") && nan.contains(" u "), "{nan}");
    folder.write("far.ply", format!("{header}50 0 0 1\n51 0 0 3\n50 1 0 2\n3 0 1 2\n"));
    assert!(failed("torus.ndf", "far.ply", &[]).contains("away"));
    folder.write("flat.ply", format!("{header}0 0 0 1\n0 0 0 3\n0 0 0 2\n3 0 1 2\n"));
    assert!(failed("torus.ndf", "flat.ply", &[]).contains("no area"));
    assert_eq!(learn(&folder, "torus.ndf", "modes.ply", "out.ndf", &["--epochs", "0"]).code, 2);
    assert!(learn(&folder, "torus.ndf", "modes.ply", "no/out.ndf", &[]).sentence().contains("no folder"));

    let without = ["scalars", "eval", "torus.ndf", "-o", "out.ply", "--edge-length", "0.1"];
    assert!(ndf(&folder.0, &without).sentence().contains("ndf scalars fit"));

    // Fields that were learned together are replaced together.
    let quick = ["--epochs", "2"];
    assert_eq!(learn(&folder, "torus.ndf", "modes.ply", "m.ndf", &quick).code, 0);
    let one = failed("m.ndf", "modes.ply", &["--epochs", "2", "--scalar", "mode_02"]);
    assert!(one.contains("mode_02") && one.contains("mode_00"), "{one}");
    assert_eq!(learn(&folder, "m.ndf", "modes.ply", "n.ndf", &quick).code, 0);
    let info = ndf(&folder.0, &["info", "n.ndf", "--json"]).json();
    assert_eq!(info["scalars"].as_array().map(Vec::len), Some(4));
}
