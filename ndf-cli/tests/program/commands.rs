//! Every command on good input, and on arguments that are wrong.

use std::io::Read;
use std::process::{Command, Stdio};

use ndf_mesh::io::read_mesh;

use super::{Folder, ndf};

#[test]
fn a_shape_is_written_examined_measured_and_drawn() {
    let folder = Folder::new("tour");
    for shape in ["trefoil", "torus", "sphere", "cube"] {
        let name = format!("{shape}.ply");
        let written = ndf(&folder.0, &["sample", "mesh", "-o", &name, "--shape", shape, "--json"]).json();
        let info = ndf(&folder.0, &["info", &name, "--json"]).json();
        assert_eq!(info["kind"], "mesh");
        assert_eq!((&info["vertices"], &info["faces"]), (&written["vertices"], &written["faces"]));
        let genus = if ["trefoil", "torus"].contains(&shape) { 1 } else { 0 };
        assert_eq!(
            (info["genus"].as_i64(), info["euler_characteristic"].as_i64()),
            (Some(genus), Some(2 - 2 * genus))
        );
        for none in [
            "boundary_edges",
            "nonmanifold_edges",
            "nonmanifold_vertices",
            "degenerate_faces",
            "duplicate_vertices",
            "self_intersections",
        ] {
            assert_eq!(info[none], 0, "{none}");
        }
        assert_eq!(info["components"], 1);
    }
    let measured =
        ndf(&folder.0, &["--json", "measure", "cube.ply", "sphere.ply", "--samples", "20000"]).json();
    let corner = 3.0_f64.sqrt() - 1.0;
    assert!((measured["reference_to_mesh"]["max"].as_f64().unwrap() - corner).abs() < 1e-2);
    assert!((measured["diagonal"].as_f64().unwrap() - 12.0_f64.sqrt()).abs() < 1e-6);
    for key in ["mesh_to_reference", "reference_to_mesh"] {
        assert!(["mean", "rms", "max"].iter().all(|k| measured[key][k].is_f64()), "{measured}");
    }
    assert!(measured["normal_deg_mean"].is_f64() && measured["hausdorff"].is_f64());
    let same = ndf(&folder.0, &["measure", "cube.ply", "cube.ply", "--json"]).json();
    assert!(same["hausdorff"].as_f64().unwrap() < 1e-6);

    let drawn =
        ndf(&folder.0, &["render", "cube.ply", "-o", "cube.png", "--size", "80,60", "--wireframe", "--json"])
            .json();
    assert_eq!((drawn["width"].as_i64(), drawn["height"].as_i64()), (Some(80), Some(60)));
    let decoder =
        png::Decoder::new(std::io::BufReader::new(std::fs::File::open(folder.0.join("cube.png")).unwrap()));
    assert_eq!(decoder.read_info().unwrap().info().size(), (80, 60));
    let text = ndf(
        &folder.0,
        &["render", "cube.ply", "-o", "cube.exr", "--size", "80,60", "--view", "-20,-10", "--quiet"],
    );
    assert_eq!((text.code, text.stderr.as_str()), (0, ""));
    assert!(std::fs::read(folder.0.join("cube.exr")).unwrap().starts_with(&[0x76, 0x2f, 0x31, 0x01]));
    assert_eq!(folder.files().len(), 6, "{:?}", folder.files());
}

#[test]
fn shapes_have_about_as_many_faces_as_asked_for() {
    let folder = Folder::new("faces");
    for shape in ["rope", "trefoil", "torus", "cube", "sphere"] {
        for faces in ["800", "20480"] {
            let arguments = ["sample", "mesh", "-o", "a.ply", "--shape", shape, "--faces", faces, "--json"];
            let found = ndf(&folder.0, &arguments).json()["faces"].as_f64().unwrap();
            let share = found / faces.parse::<f64>().unwrap();
            // Those of a sphere are 20 times a power of four.
            let most = if shape == "sphere" { 2.0 } else { 1.1 };
            assert!((1.0 / most..=most).contains(&share), "{shape}: {found} of {faces}");
            let info = ndf(&folder.0, &["info", "a.ply", "--json"]).json();
            assert_eq!((&info["components"], &info["boundary_edges"]), (&1.into(), &0.into()));
        }
    }
}

#[test]
fn scalars_of_clouds_and_summaries() {
    let folder = Folder::new("clouds");
    let text = ndf(&folder.0, &["sample", "oriented-cloud", "-o", "a.ply", "--points", "500"]);
    assert!(text.code == 0 && text.stdout.contains("500 vertices"), "{}", text.stdout);
    let info = ndf(&folder.0, &["info", "a.ply", "--json"]).json();
    assert_eq!(info["kind"], "oriented-cloud");
    assert_eq!((info["points"].as_u64(), info["normals"].as_bool()), (Some(500), Some(true)));
    ndf(&folder.0, &["sample", "cloud", "-o", "b.ply", "--points", "500", "--seed", "1", "--json"]).json();
    ndf(
        &folder.0,
        &["sample", "cloud", "-o", "c.ply", "--points", "500", "--seed", "1", "--threads", "1", "--json"],
    )
    .json();
    let bytes = |name: &str| std::fs::read(folder.0.join(name)).unwrap();
    assert_eq!(bytes("b.ply"), bytes("c.ply"), "the same seed gives the same bytes");
    assert_eq!(ndf(&folder.0, &["info", "b.ply", "--json"]).json()["kind"], "cloud");
    assert!(ndf(&folder.0, &["measure", "a.ply", "b.ply"]).sentence().contains("a.ply is a point cloud"));
    assert!(ndf(&folder.0, &["sample", "cloud", "-o", "c.obj"]).sentence().contains("c.obj"));
}

#[test]
fn a_painted_mesh_is_drawn_with_lines() {
    let folder = Folder::new("paint");
    let mesh = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property float height\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0 -1\n1 0 0 nan\n0 1 0 0.5\n1 1 0 1\n3 0 1 2\n3 1 3 2\n";
    folder.write("a.ply", mesh);
    for name in ["a.png", "a.exr"] {
        let drawn = ndf(
            &folder.0,
            &[
                "render",
                "a.ply",
                "-o",
                name,
                "--scalar",
                "height",
                "--isolines",
                "5",
                "--size",
                "40,30",
                "--json",
            ],
        );
        assert_eq!(drawn.json()["scalar_range"], serde_json::json!([-1.0, 1.0]));
    }
    let failed = ndf(&folder.0, &["render", "a.ply", "-o", "b.png", "--scalar", "depth"]);
    assert!(
        failed.sentence().ends_with("a.ply has no vertex scalar named depth; it has height"),
        "{}",
        failed.stderr
    );
    assert_eq!(folder.files(), ["a.exr", "a.ply", "a.png"]);
}

#[test]
fn wrong_usage_is_told_apart_from_failure() {
    let folder = Folder::new("usage");
    folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    for arguments in [
        &["frobnicate"][..],
        &[],
        &["info"],
        &["info", "a.obj", "--threads", "0"],
        &["info", "a.obj", "--threads", "60000"],
        &["info", "a.obj", "--seed", "x"],
        &["render", "a.obj"],
        &["render", "a.obj", "-o", "a.png", "--size", "0,10"],
        &["render", "a.obj", "-o", "a.png", "--size", "100000,100000"],
        &["render", "a.obj", "-o", "a.png", "--view", "sideways"],
        &["render", "a.obj", "-o", "a.png", "--view", "nan,0"],
        &["render", "a.obj", "-o", "a.png", "--isolines", "3"],
        &["sample", "teapot", "-o", "a.ply"],
        &["measure", "a.obj"],
    ] {
        let run = ndf(&folder.0, arguments);
        assert_eq!((run.code, run.stdout.as_str()), (2, ""), "{arguments:?}: {}", run.stderr);
        assert!(!run.stderr.is_empty());
    }
    for arguments in [
        &["fit", "a.obj", "-o", "a.ndf", "--lr", "-1"][..],
        &["extract", "a.ndf", "-o", "a.ply", "--edge-length", "-1"],
        &["mesh", "a.obj", "-o", "a.ply", "--edge-length", "-0.5"],
    ] {
        let run = ndf(&folder.0, arguments);
        assert!(run.code == 2 && run.stderr.contains("a positive number is expected"), "{}", run.stderr);
    }
    for arguments in [["--help", "--json"], ["--version", "--json"], ["render", "--help"]] {
        assert_eq!(ndf(&folder.0, &arguments).code, 0);
    }
    for arguments in [
        &["info", "none.obj"][..],
        &["info", "."],
        &["info", "none.obj", "--json"],
        &["render", "a.obj", "-o", "a.gif"],
        &["render", "a.obj", "-o", "none/a.png", "--size", "8,8", "--quiet"],
        &["sample", "mesh", "-o", "a.xyz"],
        &["sample", "mesh", "-o", "none/a.ply"],
        &["sample", "mesh", "-o", "."],
        &["measure", "a.obj", "none.obj"],
        &["extract", "none.ndf", "-o", "b.ply", "--edge-length", "1"],
    ] {
        ndf(&folder.0, arguments).sentence();
    }
    // Where the result cannot be written is said before the work, which would fail otherwise.
    for (arguments, expected) in [
        (&["fit", "none.obj", "-o", "none/a.ndf"][..], "there is no folder none"),
        (&["fit", "none.obj", "-o", "."], "it is a folder"),
        (&["mesh", "none.obj", "-o", "none/a.ply"], "there is no folder none"),
        (&["mesh", "none.obj", "-o", "a.xyz"], "a.xyz"),
        (&["extract", "none.ndf", "-o", "none/a.ply", "--edge-length", "1"], "there is no folder none"),
        (&["extract", "none.ndf", "-o", "a.off", "--edge-length", "1"], "a.off"),
    ] {
        let run = ndf(&folder.0, arguments);
        assert!(run.sentence().contains(expected), "{}", run.stderr);
    }
    assert_eq!(folder.files(), ["a.obj"]);
}

#[test]
fn readers_that_go_away_are_no_panic() {
    let folder = Folder::new("pipe");
    folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    for arguments in [&["info", "a.obj"][..], &["--help"], &["info", "a.obj", "--json"]] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_ndf"))
            .current_dir(&folder.0)
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let mut stderr = String::new();
        child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
        assert_eq!((child.wait().unwrap().code(), stderr.as_str()), (Some(0), ""), "{arguments:?}");
    }
}

#[test]
fn models_become_tensors_and_come_back() {
    let folder = Folder::new("convert");
    let run = |arguments: &[&str]| ndf(&folder.0, arguments).json();
    run(&["sample", "mesh", "--shape", "torus", "-o", "torus.ply", "--json"]);
    let fit = ["fit", "torus.ply", "-o", "torus.ndf", "--epochs", "40", "--samples", "256", "--json"];
    run(&[&fit[..], &["--base-faces", "300", "--lossless", "--field", "network"]].concat());
    run(&["convert", "torus.ndf", "-o", "torus.safetensors", "--json"]);
    run(&["convert", "torus.safetensors", "-o", "again.ndf", "--json"]);
    let read = |name: &str| std::fs::read(folder.0.join(name)).unwrap();
    assert!(read("again.ndf") == read("torus.ndf"));
    let small = run(&["convert", "torus.ndf", "-o", "small.ndf", "--bits", "6", "--json"]);
    assert!(small["bytes"].as_u64().unwrap() * 3 < 2 * read("torus.ndf").len() as u64, "{small}");
    let base = run(&["convert", "torus.ndf", "-o", "base.ply", "--json"]);
    assert_eq!(base["faces"], run(&["info", "base.ply", "--json"])["faces"]);
    assert!(
        ndf(&folder.0, &["convert", "torus.ply", "-o", "x.ndf"]).sentence().contains("torus.ply is no model")
    );
    let unknown = ndf(&folder.0, &["convert", "torus.ndf", "-o", "x.png"]);
    assert!(unknown.sentence().contains("x.png") && unknown.sentence().contains(".safetensors"));
    let base = ndf(&folder.0, &["fit", "torus.ply", "-o", "x.ndf", "--base", "torus.ndf"]);
    assert!(base.sentence().contains("torus.ndf is a model, not a mesh"));
}

/// A loop around the tube of a torus and one through its hole, and the regions of two sources.
#[test]
fn paths_wind_as_they_are_told_and_sources_have_regions() {
    let folder = Folder::new("winding");
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "torus.ply", "--json"]).json();
    let tube =
        ["--through", "1.4,0,0", "--through", "1,0,0.4", "--through", "0.6,0,0", "--through", "1,0,-0.4"];
    let run = [&["path", "torus.ply", "-o", "loop.ply", "--closed", "--json"][..], &tube].concat();
    let found = ndf(&folder.0, &run).json();
    let length = found["length"].as_f64().unwrap();
    assert!(
        (length / (0.4 * std::f64::consts::TAU) - 1.0).abs() < 2e-3 && found["geodesic"] == true,
        "{found}"
    );
    let points = found["points"].as_array().unwrap();
    assert_eq!(points.first().unwrap()["position"], points.last().unwrap()["position"]);
    // Two vertices have one shortest way.
    let ends = ["--through-vertex", "0", "--through-vertex", "90"];
    let straight =
        ndf(&folder.0, &[&["path", "torus.ply", "-o", "p.obj", "--json"][..], &ends].concat()).json();
    let measured = ["geodesic", "torus.ply", "-o", "d.ply", "--source-vertex", "0", "--json"];
    ndf(&folder.0, &measured).json();
    let distances = read_mesh(folder.0.join("d.ply")).unwrap();
    let distance = f64::from(distances.scalars[0].values[90]);
    assert!((straight["length"].as_f64().unwrap() / distance - 1.0).abs() < 1e-6);
    let one = ndf(&folder.0, &["path", "torus.ply", "-o", "p.ply", "--through", "1,0,0"]);
    assert!(one.sentence().contains("more than once"));
    let regions = ["geodesic", "torus.ply", "-o", "n.ply", "--source-vertex", "0", "--source", "-1.4,0,0"];
    let limits = ["--nearest", "--max-distance", "1", "--json"];
    let found = ndf(&folder.0, &[&regions[..], &limits].concat()).json();
    assert!(found["max_distance"].as_f64().unwrap() <= 1.0 && found["unreached"].as_u64().unwrap() > 0);
    let file = read_mesh(folder.0.join("n.ply")).unwrap();
    let of = |name: &str| &file.scalars.iter().find(|scalars| scalars.name == name).unwrap().values;
    for ((p, d), source) in file.mesh.positions().iter().zip(of("distance")).zip(of("nearest")) {
        let expected = if d.is_infinite() {
            -1.0
        } else if p.x > 0.0 {
            0.0
        } else {
            1.0
        };
        assert!(*source == expected, "{p}: {d} {source}");
    }
    let heat = ndf(&folder.0, &[&regions[..], &["--nearest", "--method", "heat"]].concat());
    assert!(heat.sentence().contains("--method exact"));
}
