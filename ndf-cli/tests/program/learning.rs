//! From a mesh to a model and back.

use super::{Folder, ndf};

const QUICK: [&str; 8] = ["--field", "network", "--epochs", "60", "--samples", "512", "--base-faces", "400"];

fn fitted(folder: &Folder, model: &str, more: &[&str]) -> serde_json::Value {
    let arguments = [&["fit", "torus.ply", "-o", model, "--json", "--quiet"], &QUICK[..], more].concat();
    ndf(&folder.0, &arguments).json()
}

#[test]
fn a_mesh_is_learned_extracted_and_measured() {
    let folder = Folder::new("learning");
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "torus.ply"]);
    let fit = fitted(&folder, "torus.ndf", &[]);
    for key in [
        "seconds",
        "epochs",
        "projection_rms",
        "projection_max",
        "cycle_loss",
        "flipped_fraction",
        "base_vertices",
        "base_faces",
        "model_bytes",
        "seconds_projecting",
    ] {
        assert!(fit[key].is_number(), "{key}: {fit}");
    }
    assert_eq!((fit["epochs"].as_u64(), fit["base_faces"].as_u64()), (Some(60), Some(400)));
    let bytes = std::fs::read(folder.0.join("torus.ndf")).unwrap();
    assert_eq!(fit["model_bytes"].as_u64(), Some(bytes.len() as u64));

    let info = ndf(&folder.0, &["info", "torus.ndf", "--json"]).json();
    assert_eq!(info["kind"], "model");
    assert_eq!(info["bytes"]["total"].as_u64(), Some(bytes.len() as u64));

    let length = "0.1";
    let arguments =
        ["extract", "torus.ndf", "-o", "out.ply", "--edge-length", length, "--json", "--no-refine"];
    let extract = ndf(&folder.0, &arguments).json();
    assert_eq!(extract["euler_characteristic"], 0);
    assert_eq!((&extract["manifold"], &extract["oriented"]), (&true.into(), &true.into()));
    assert!(extract["edge_length"]["max"].as_f64().unwrap() <= 0.1 + 1e-12);
    let counts = ["vertices", "faces", "components", "boundary_edges", "self_intersections"];
    for key in [&counts[..], &["seconds", "delaunay_embedded_fraction"]].concat() {
        assert!(extract[key].is_number(), "{key}: {extract}");
    }
    assert!(extract["delaunay_intrinsic"].is_boolean() && extract["min_angle_deg"]["p5"].is_number());
    let info = ndf(&folder.0, &["info", "out.ply", "--json"]).json();
    assert_eq!((&info["vertices"], &info["faces"]), (&extract["vertices"], &extract["faces"]));

    // The torus has radii 1 and 0.4; 400 base faces and 60 epochs come within a fiftieth of the tube.
    let measure = ndf(&folder.0, &["measure", "torus.ply", "out.ply", "--json"]).json();
    let mean = measure["mesh_to_reference"]["mean"].as_f64().unwrap();
    assert!(mean < 0.008, "{measure}");
}

#[test]
fn the_seed_decides_every_byte_and_the_threads_none() {
    let folder = Folder::new("seeds");
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "torus.ply"]);
    fitted(&folder, "a.ndf", &["--threads", "1"]);
    fitted(&folder, "b.ndf", &["--threads", "2"]);
    fitted(&folder, "c.ndf", &["--seed", "1"]);
    let read = |name: &str| std::fs::read(folder.0.join(name)).unwrap();
    assert!(read("a.ndf") == read("b.ndf"));
    assert!(read("a.ndf") != read("c.ndf"));
}

#[test]
fn a_base_mesh_of_ones_own_is_used() {
    let folder = Folder::new("own-base");
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "torus.ply"]);
    let mesh =
        ndf(&folder.0, &["mesh", "torus.ply", "-o", "base.obj", "--grid", "24", "--faces", "300", "--json"])
            .json();
    assert_eq!((&mesh["faces"], &mesh["euler_characteristic"]), (&300.into(), &0.into()));
    let arguments = [
        "fit",
        "torus.ply",
        "-o",
        "m.ndf",
        "--base",
        "base.obj",
        "--field",
        "network",
        "--epochs",
        "5",
        "--samples",
        "99",
        "--json",
    ];
    assert_eq!(ndf(&folder.0, &arguments).json()["base_faces"], 300);
    let limited = |field: &str| {
        let limited = ["--time-limit", "0", "--json", "--quiet"];
        ndf(&folder.0, &[&["fit", "torus.ply", "-o", "n.ndf", "--field", field], &limited[..]].concat())
            .json()
    };
    let levels = limited("levels");
    assert_eq!((&levels["interrupted"], &levels["epochs"]), (&true.into(), &0.into()));
    assert!(levels["projection_rms"].as_f64().unwrap() < 0.01, "{levels}");
    let limited = limited("network");
    assert_eq!(limited["interrupted"], true);
    // There is no loss of no epoch.
    assert!(limited["cycle_loss"].is_null(), "{limited}");
}

#[test]
fn damaged_models_and_absurd_lengths_are_refused() {
    let folder = Folder::new("damaged");
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "torus.ply"]);
    fitted(&folder, "good.ndf", &[]);
    let mut bytes = std::fs::read(folder.0.join("good.ndf")).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    folder.write("bad.ndf", &bytes);
    let extract = |model: &str, length: &str| {
        let run = ndf(&folder.0, &["extract", model, "-o", "out.ply", "--relative-edge-length", length]);
        assert!(!folder.0.join("out.ply").exists());
        run
    };
    assert!(extract("bad.ndf", "0.1").sentence().contains("checksum"));
    assert!(extract("torus.ply", "0.1").sentence().contains("not an .ndf model"));
    assert!(extract("missing.ndf", "0.1").sentence().contains("missing.ndf"));
    assert!(extract("good.ndf", "1e-7").sentence().contains("triangles"));
    assert_eq!(extract("good.ndf", "-1").code, 2);
    assert!(ndf(&folder.0, &["fit", "good.ndf", "-o", "out.ndf"]).sentence().contains("extract"));
}

#[test]
fn the_demo_writes_all_it_promises() {
    let folder = Folder::new("demo");
    let demo = ndf(&folder.0, &["demo", "--json", "--quiet"]).json();
    assert!(demo["seconds"].is_number());
    for name in ["model.ndf", "surface.ply", "geodesic.ply", "modes.ply", "report.html"] {
        assert!(folder.0.join("ndf-demo").join(name).metadata().unwrap().len() > 1000, "{name}");
    }
    let page = std::fs::read_to_string(folder.0.join("ndf-demo/report.html")).unwrap();
    assert!(page.matches("data:image/png;base64,").count() >= 8);
    assert!(!page.contains("http://") && !page.contains("https://"));
}

/// An interrupted run leaves a checkpoint and no model; resumed, it ends as if nothing had happened.
#[cfg(unix)]
#[test]
fn an_interrupted_run_is_resumed_without_a_trace() {
    use std::process::{Command, Stdio};
    let folder = Folder::new("resumed");
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "torus.ply"]);
    let run =
        ["--field", "network", "--epochs", "2500", "--samples", "512", "--base-faces", "400", "--quiet"];
    let unbroken = [&["fit", "torus.ply", "-o", "unbroken.ndf"], &run[..]].concat();
    assert_eq!(ndf(&folder.0, &unbroken).code, 0);

    let mut broken = Command::new(env!("CARGO_BIN_EXE_ndf"))
        .current_dir(&folder.0)
        .args(["fit", "torus.ply", "-o", "broken.ndf", "--log", "log.jsonl"])
        .args(run)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // The log appears when training begins.
    while !folder.0.join("log.jsonl").exists() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    std::thread::sleep(std::time::Duration::from_millis(100));
    Command::new("kill").args(["-TERM", &broken.id().to_string()]).status().unwrap();
    let code = broken.wait().unwrap().code();
    if code == Some(0) {
        eprintln!("skipped: the run ended before it could be interrupted");
        return;
    }
    assert_eq!(code, Some(1));
    assert!(!folder.0.join("broken.ndf").exists());
    let resumed = ["fit", "torus.ply", "-o", "broken.ndf", "--resume", "broken.ndf.checkpoint", "--quiet"];
    let info = ndf(&folder.0, &["info", "broken.ndf.checkpoint", "--json"]).json();
    assert_eq!((&info["kind"], &info["field"]), (&"checkpoint".into(), &"network".into()));
    // No time at all leaves everything as it was.
    let again = ["--time-limit", "0", "--checkpoint", "again.checkpoint", "--json"];
    let halted = ndf(&folder.0, &[&resumed[..], &again].concat()).json();
    assert_eq!(halted["interrupted"], true);
    let resumed = ["fit", "torus.ply", "-o", "broken.ndf", "--resume", "again.checkpoint", "--quiet"];
    assert_eq!(ndf(&folder.0, &resumed).code, 0);
    let read = |name: &str| std::fs::read(folder.0.join(name)).unwrap();
    assert!(read("broken.ndf") == read("unbroken.ndf"));

    let log = String::from_utf8(read("log.jsonl")).unwrap();
    for line in log.lines() {
        let record: serde_json::Value = serde_json::from_str(line).unwrap();
        for key in
            ["epoch", "rate", "projection", "cycle", "flipped_fraction", "seconds", "seconds_projecting"]
        {
            assert!(record[key].is_number(), "{key}: {line}");
        }
    }
    assert!(
        ndf(&folder.0, &["fit", "torus.ply", "-o", "x.ndf", "--resume", "torus.ply"])
            .sentence()
            .contains("torus.ply is not a usable checkpoint")
    );
    // A checkpoint that is not there is said before the input is looked at.
    let missing = ndf(&folder.0, &["fit", "none.ply", "-o", "x.ndf", "--resume", "nope"]);
    assert!(missing.sentence().contains("cannot read the checkpoint nope: "), "{}", missing.stderr);
    assert_eq!(
        ndf(&folder.0, &["fit", "torus.ply", "-o", "x.ndf", "--resume", "c", "--epochs", "5"]).code,
        2
    );
}

/// An interruption before training has begun ends the run at once, and leaves nothing behind; one that is ignored does not.
#[cfg(unix)]
#[test]
fn an_interruption_while_the_base_mesh_is_made_leaves_nothing() {
    use std::io::Write as _;
    use std::process::{Command, Stdio};
    let folder = Folder::new("early");
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "torus.ply"]);
    // A pipe that holds the mesh back until the signal has come.
    assert!(Command::new("mkfifo").arg(folder.0.join("pipe.ply")).status().unwrap().success());
    let fit = "exec \"$0\" fit pipe.ply -o m.ndf --base-faces 300 --quiet";
    let interrupted = |script: &str, signal: &str| {
        let run = Command::new("sh")
            .current_dir(&folder.0)
            .args(["-c", script, env!("CARGO_BIN_EXE_ndf")])
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut pipe = std::fs::OpenOptions::new().write(true).open(folder.0.join("pipe.ply")).unwrap();
        Command::new("kill").args([signal, &run.id().to_string()]).status().unwrap();
        std::thread::sleep(std::time::Duration::from_millis(200));
        // The reader may have gone.
        let _ = pipe.write_all(&std::fs::read(folder.0.join("torus.ply")).unwrap());
        drop(pipe);
        let output = run.wait_with_output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (code, message) = interrupted(fit, "-TERM");
    assert_eq!((code, message.trim()), (Some(143), "ndf: interrupted"));
    assert_eq!(folder.files(), ["pipe.ply", "torus.ply"]);
    let (code, message) = interrupted(&format!("trap '' HUP; {fit}"), "-HUP");
    assert_eq!((code, message.as_str()), (Some(0), ""));
    assert_eq!(folder.files(), ["m.ndf", "pipe.ply", "torus.ply"]);
}

#[test]
fn anchors_and_all_losses_are_accepted_and_nonsense_refused() {
    let folder = Folder::new("anchors");
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "torus.ply"]);
    folder.write("anchors.txt", "# base, then target\n1.4 0 0  1.4 0 0\n\n-1.4 0 0 -1.4 0.01 0\n");
    let more = [
        "--anchors",
        "anchors.txt",
        "--lambda-d",
        "1",
        "--lambda-n",
        "10",
        "--lambda-f",
        "1",
        "--lambda-p",
        "1e3",
    ];
    assert_eq!(fitted(&folder, "a.ndf", &more)["epochs"], 60);
    assert_eq!(fitted(&folder, "p.ndf", &["--preset", "paper"])["epochs"], 1060);
    folder.write("bad.txt", "1 2 3 4 5\n");
    let bad = ndf(&folder.0, &["fit", "torus.ply", "-o", "b.ndf", "--anchors", "bad.txt"]);
    assert!(bad.sentence().contains("line 1"));
    assert!(!folder.0.join("b.ndf").exists());
}

#[test]
fn distances_and_modes_of_meshes_and_models() {
    let folder = Folder::new("analysis");
    ndf(&folder.0, &["sample", "mesh", "--shape", "sphere", "-o", "sphere.ply"]);
    let arguments =
        ["geodesic", "sphere.ply", "-o", "d.ply", "--source", "0,0,1", "--path-to", "0,0,-1", "--json"];
    let geodesic = ndf(&folder.0, &arguments).json();
    assert!((geodesic["max_distance"].as_f64().unwrap() - std::f64::consts::PI).abs() < 0.01, "{geodesic}");
    assert_eq!(geodesic["unreached"], 0);
    let heat =
        ["geodesic", "sphere.ply", "-o", "h.ply", "--source-vertex", "0", "--method", "heat", "--json"];
    assert!(
        (ndf(&folder.0, &heat).json()["max_distance"].as_f64().unwrap() - std::f64::consts::PI).abs() < 0.1
    );
    let spectrum =
        ndf(&folder.0, &["spectrum", "sphere.ply", "-o", "m.ply", "--modes", "9", "--json"]).json();
    for (k, expected) in [0.0, 2.0, 2.0, 2.0, 6.0, 6.0, 6.0, 6.0, 6.0].into_iter().enumerate() {
        assert!((spectrum["eigenvalues"][k].as_f64().unwrap() - expected).abs() < 0.02, "{spectrum}");
    }
    assert!(spectrum["residual_max"].as_f64().unwrap() < 1e-8);
    let info = ndf(&folder.0, &["info", "m.ply", "--json"]).json();
    assert_eq!(info["scalars"].as_array().unwrap().len(), 9);
    let plain = ["spectrum", "sphere.ply", "-o", "p.ply", "--modes", "9", "--no-flips", "--json"];
    assert!((ndf(&folder.0, &plain).json()["eigenvalues"][1].as_f64().unwrap() - 2.0).abs() < 0.02);

    // Three sheets that meet along an edge are no manifold: modes come through the tufted cover, distances do not.
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 -1\n";
    folder.write("fin.obj", format!("{corners}f 1 2 3\nf 1 2 4\nf 1 2 5\n"));
    let fin = ndf(&folder.0, &["spectrum", "fin.obj", "-o", "f.ply", "--modes", "3", "--json"]);
    assert!(fin.stderr.contains("tufted cover"), "{}", fin.stderr);
    assert!(fin.json()["eigenvalues"][1].as_f64().unwrap() > 0.1);
    let distances = ndf(&folder.0, &["geodesic", "fin.obj", "-o", "f2.ply", "--source-vertex", "0"]);
    assert!(distances.sentence().contains("manifold"));

    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "torus.ply"]);
    fitted(&folder, "torus.ndf", &[]);
    for command in [
        &["geodesic", "torus.ndf", "-o", "g.ply", "--source-vertex", "0"][..],
        &["spectrum", "torus.ndf", "-o", "g.ply"],
    ] {
        assert_eq!(ndf(&folder.0, &[command, &["--edge-length", "0.1"]].concat()).code, 0);
        std::fs::remove_file(folder.0.join("g.ply")).unwrap();
    }
    assert_eq!(ndf(&folder.0, &["geodesic", "sphere.ply", "-o", "x.ply"]).code, 2);
    assert!(
        ndf(&folder.0, &["geodesic", "sphere.ply", "-o", "x.ply", "--source-vertex", "99999999"])
            .sentence()
            .contains("no vertex")
    );
}

/// What is asked for decides: levels, unless it is something that only networks have, which is said.
#[test]
fn the_default_is_levels_unless_networks_are_asked_for() {
    let folder = Folder::new("default-field");
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "torus.ply"]);
    let fit = |more: &[&str]| {
        let arguments = ["fit", "torus.ply", "-o", "m.ndf", "--base-faces", "200", "--quiet"];
        let run = ndf(&folder.0, &[&arguments[..], more].concat());
        assert_eq!(run.code, 0, "{}", run.stderr);
        (ndf(&folder.0, &["info", "m.ndf", "--json"]).json()["features"].clone(), run.stderr)
    };
    assert_eq!(fit(&[]), (0.into(), String::new()));
    let (features, said) = fit(&["--features", "4", "--epochs", "3", "--samples", "64"]);
    assert!(features == 4 && said.contains("since levels have no settings of a network"), "{said}");
    let quick = ["--field", "network", "--epochs", "3", "--samples", "64"];
    assert_eq!(fit(&quick), (8.into(), String::new()));
    folder.write("anchors.txt", "1.4 0 0  1.4 0 0\n");
    let arguments = ["fit", "torus.ply", "-o", "x.ndf", "--field", "levels", "--anchors", "anchors.txt"];
    assert!(ndf(&folder.0, &arguments).sentence().contains("levels has no anchors"));
}

/// Levels, too: an interrupted run leaves a checkpoint and no model, a running one its last checkpoint and a log.
#[cfg(unix)]
#[test]
fn interrupted_levels_are_resumed_without_a_trace() {
    use std::process::{Command, Stdio};
    let folder = Folder::new("resumed-levels");
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "torus.ply"]);
    let fit = ["fit", "torus.ply", "--error", "0.02%", "--quiet"];
    let unbroken = ndf(&folder.0, &[&fit[..], &["-o", "unbroken.ndf", "--json"]].concat()).json();
    let mut broken = Command::new(env!("CARGO_BIN_EXE_ndf"))
        .current_dir(&folder.0)
        .args(fit)
        .args(["-o", "broken.ndf", "--checkpoint-every", "0", "--log", "log.jsonl"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let checkpoint = folder.0.join("broken.ndf.checkpoint");
    let info = || ndf(&folder.0, &["info", "broken.ndf.checkpoint", "--json"]).json();
    // Until the second size is tried.
    while !checkpoint.exists() || info()["attempts"] == 0 {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    // Nothing can be done about this signal.
    broken.kill().unwrap();
    broken.wait().unwrap();
    let info = info();
    assert_eq!(
        (&info["kind"], &info["field"], &info["of"]),
        (&"checkpoint".into(), &"levels".into(), &60.into())
    );
    let text = ndf(&folder.0, &["info", "broken.ndf.checkpoint"]);
    assert!(text.stdout.contains("for 0.02 % of the diagonal, after 1 attempt"), "{}", text.stdout);
    let mut damaged = std::fs::read(&checkpoint).unwrap();
    // Only the surface that the run began with will do, and nothing that the checkpoint has may be given again.
    ndf(&folder.0, &["sample", "mesh", "--shape", "sphere", "-o", "sphere.ply"]);
    let other = ["fit", "sphere.ply", "-o", "x.ndf", "--resume", "broken.ndf.checkpoint"];
    assert!(ndf(&folder.0, &other).sentence().contains("learned another surface"));
    let over = ["fit", "torus.ply", "-o", "broken.ndf.checkpoint", "--resume", "broken.ndf.checkpoint"];
    assert!(ndf(&folder.0, &over).sentence().contains("is an input and would be overwritten"));
    let seeded = ["fit", "torus.ply", "-o", "x.ndf", "--resume", "broken.ndf.checkpoint", "--seed", "1"];
    assert!(ndf(&folder.0, &seeded).stderr.contains("--seed"));
    let extracted = ["extract", "broken.ndf.checkpoint", "-o", "x.ply", "--edge-length", "0.1"];
    assert!(ndf(&folder.0, &extracted).sentence().contains("is a checkpoint, not"));
    let resumed = ["fit", "torus.ply", "-o", "broken.ndf", "--resume", "broken.ndf.checkpoint", "--quiet"];
    let resumed = ndf(&folder.0, &[&resumed[..], &["--json"]].concat()).json();
    assert!(!checkpoint.exists());
    assert_eq!(resumed["projection_rms"], unbroken["projection_rms"]);
    let read = |name: &str| std::fs::read(folder.0.join(name)).unwrap();
    assert!(read("broken.ndf") == read("unbroken.ndf"));

    let log = String::from_utf8(read("log.jsonl")).unwrap();
    // The last line may be cut off by the signal.
    for line in log.lines().rev().skip(1) {
        let record: serde_json::Value = serde_json::from_str(line).unwrap();
        assert!(record["run"].is_string());
        for key in ["iteration", "distance_mean", "distance_rms", "bytes", "price", "seconds"] {
            assert!(record[key].is_number(), "{key}: {line}");
        }
    }
    damaged[300] ^= 1;
    folder.write("damaged", &damaged);
    assert!(ndf(&folder.0, &["info", "damaged"]).sentence().contains("not a usable checkpoint"));
    let resumed = ["fit", "torus.ply", "-o", "x.ndf", "--resume", "damaged"];
    assert!(ndf(&folder.0, &resumed).sentence().contains("not a usable checkpoint"));
}

#[test]
fn levels_are_learned_kept_and_used_like_networks() {
    let folder = Folder::new("fields-of-levels");
    let done = |arguments: &[&str]| {
        let run = ndf(&folder.0, arguments);
        assert_eq!(run.code, 0, "{}", run.stderr);
    };
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "torus.ply"]);
    let arguments = ["fit", "torus.ply", "-o", "levels.ndf", "--size", "2000", "--json"];
    let fit = ndf(&folder.0, &arguments).json();
    let bytes = std::fs::metadata(folder.0.join("levels.ndf")).unwrap().len();
    assert_eq!(fit["model_bytes"].as_u64(), Some(bytes));
    assert_eq!((&fit["components"], &fit["area_left_out"]), (&1.into(), &0.0.into()));
    assert!(bytes.abs_diff(2000) < 200, "{bytes}");
    assert!(fit["projection_rms"].as_f64().unwrap() < 2e-3, "{fit}");

    let info = ndf(&folder.0, &["info", "levels.ndf", "--json"]).json();
    assert_eq!((&info["kind"], &info["levels"], &info["features"]), (&"model".into(), &3.into(), &0.into()));
    assert_eq!(info["bytes"]["total"].as_u64(), Some(bytes));
    assert_eq!(info["bytes"], fit["bytes"]);

    let extract = ["extract", "levels.ndf", "-o", "out.ply", "--relative-edge-length", "0.1", "--json"];
    let extract = ndf(&folder.0, &extract).json();
    assert_eq!((&extract["manifold"], &extract["euler_characteristic"]), (&true.into(), &0.into()));
    done(&["convert", "levels.ndf", "-o", "levels.safetensors"]);
    done(&["convert", "levels.safetensors", "-o", "again.ndf"]);
    let read = |name: &str| std::fs::read(folder.0.join(name)).unwrap();
    assert_eq!(read("levels.ndf"), read("again.ndf"));

    let geodesic =
        ["geodesic", "levels.ndf", "-o", "g.ply", "--relative-edge-length", "0.1", "--source-vertex", "0"];
    done(&geodesic);
    done(&["scalars", "fit", "levels.ndf", "g.ply", "-o", "with.ndf", "--epochs", "40"]);
    let eval = ["scalars", "eval", "with.ndf", "-o", "e.ply", "--relative-edge-length", "0.1"];
    done(&eval);

    // The points of the finest level are as close as was asked for, and the surface nearly so, seen from both sides.
    let near = ["fit", "torus.ply", "-o", "near.ndf", "--error", "0.02%", "--json"];
    assert!(ndf(&folder.0, &near).json()["model_bytes"].as_u64().unwrap() < 2000);
    done(&["extract", "near.ndf", "-o", "near.ply", "--relative-edge-length", "0.05"]);
    let measured = ndf(&folder.0, &["measure", "torus.ply", "near.ply", "--json"]).json();
    for direction in ["reference_to_mesh", "mesh_to_reference"] {
        let share = measured[direction]["mean"].as_f64().unwrap() / measured["diagonal"].as_f64().unwrap();
        assert!((1e-4..2.4e-4).contains(&share), "{measured}");
    }

    let refused = ["fit", "torus.ply", "-o", "x.ndf", "--field", "levels", "--epochs", "10"];
    assert!(ndf(&folder.0, &refused).sentence().contains("levels are learned without --preset"));
    let refused = ["fit", "torus.ply", "-o", "x.ndf", "--field", "network", "--size", "5000"];
    assert!(ndf(&folder.0, &refused).sentence().contains("--size and --error are for levels"));
    assert!(!folder.0.join("x.ndf").exists());
}
