//! Commands take whatever a surface is represented by, and say what they make of it.

use super::{Folder, ndf};

/// A folder with a learned torus of radii 1 and 0.4, `torus.ndf`, and its mesh.
fn folder(test: &str) -> Folder {
    let folder = Folder::new(test);
    let run = |arguments: &[&str]| assert_eq!(ndf(&folder.0, arguments).code, 0, "{arguments:?}");
    run(&["sample", "mesh", "--shape", "torus", "-o", "torus.ply"]);
    let fit =
        ["fit", "torus.ply", "-o", "torus.ndf", "--epochs", "60", "--samples", "512", "--base-faces", "400"];
    run(&[&fit[..], &["--field", "network", "--quiet"]].concat());
    folder
}

/// Without an edge length a model's mesh has edges of a quarter of the base mesh's, and commands say so.
#[test]
fn models_have_a_default_edge_length() {
    let folder = folder("default-edges");
    let run = |arguments: &[&str]| ndf(&folder.0, &[arguments, &["--json", "--quiet"]].concat()).json();
    let extracted = run(&["extract", "torus.ndf", "-o", "e.ply"]);
    let length = extracted["target_edge_length"].as_f64().unwrap();
    run(&["convert", "torus.ndf", "-o", "base.ply"]);
    let base = ndf_mesh::io::read_mesh(folder.0.join("base.ply")).unwrap().mesh;
    let sides = base.face_indices().map(|f| {
        let [a, b, c] = base.corner_positions(f);
        a.distance(b) + b.distance(c) + c.distance(a)
    });
    let mean = sides.sum::<f64>() / (3 * base.face_count()) as f64;
    assert!((length - 0.25 * mean).abs() < 1e-6 * mean, "{length} {mean}");
    let faces = extracted["faces"].as_f64().unwrap() / 400.0;
    assert!((10.0..24.0).contains(&faces), "{faces} faces a base face");

    let same = run(&["extract", "torus.ndf", "-o", "s.ply", "--edge-length", &length.to_string()]);
    assert_eq!(extracted["faces"], same["faces"]);
    for arguments in [
        &["geodesic", "torus.ndf", "-o", "g.ply", "--source", "1.4,0,0"][..],
        &["spectrum", "torus.ndf", "-o", "m.ply", "--modes", "3"],
    ] {
        let found = run(arguments);
        assert_eq!(found["vertices"], extracted["vertices"]);
        assert_eq!(found["target_edge_length"], extracted["target_edge_length"]);
    }
    let text = ndf(&folder.0, &["geodesic", "torus.ndf", "-o", "g.ply", "--source", "1.4,0,0"]).stdout;
    assert!(text.contains("a quarter of the mean edge of the base mesh"), "{text}");
    for command in ["extract", "geodesic", "spectrum", "measure", "render"] {
        let help = ndf(&folder.0, &[command, "--help"]).stdout;
        assert!(
            help.split_whitespace()
                .collect::<Vec<_>>()
                .join(" ")
                .contains("a quarter of the mean edge length"),
            "{help}"
        );
    }
    let both = ["extract", "torus.ndf", "-o", "e.ply", "--edge-length", "1", "--relative-edge-length", "1"];
    assert_eq!(ndf(&folder.0, &both).code, 2);

    let learn = ["scalars", "fit", "torus.ndf", "g.ply", "-o", "s.ndf", "--epochs", "50"];
    run(&learn);
    let stored = run(&["scalars", "eval", "s.ndf", "-o", "v.ply"]);
    assert_eq!(stored["vertices"], extracted["vertices"]);
    // Scalars of models are painted like those of meshes.
    let painted = run(&["render", "s.ndf", "-o", "a.png", "--size", "60,40", "--scalar", "distance"]);
    assert_eq!(painted["drawn"], "model");
    assert!(painted["scalar_range"][1].as_f64().unwrap() > 3.0, "{painted}");
}

#[test]
fn models_are_measured_as_the_meshes_that_are_made_of_them() {
    let folder = folder("models-measured");
    let measure =
        |reference, mesh| ndf(&folder.0, &["measure", reference, mesh, "--json", "--samples", "20000"]);
    ndf(&folder.0, &["extract", "torus.ndf", "-o", "e.ply", "--json"]).json();
    let run = measure("torus.ply", "torus.ndf");
    let (model, mesh) = (run.json(), measure("torus.ply", "e.ply").json());
    assert_eq!(model["unit"], "input");
    let rms = |found: &serde_json::Value| found["reference_to_mesh"]["rms"].as_f64().unwrap();
    assert!((rms(&model) - rms(&mesh)).abs() < 1e-6, "{model} {mesh}");
    assert!(run.stderr.contains("torus.ndf is a model: its mesh of"), "{}", run.stderr);
    let turned = measure("torus.ndf", "torus.ply").json();
    assert!(turned["hausdorff"].as_f64().unwrap() < 0.1, "{turned}");
}

#[test]
fn points_and_fields_are_drawn_and_it_is_said_how() {
    let folder = Folder::new("kinds-drawn");
    for (kind, shape, file, drawn, said, up) in [
        ("cloud", "cube", "a.ply", "points", "a plane through its neighbours", "y"),
        ("oriented-cloud", "cube", "b.ply", "points", "along its normal", "y"),
        ("splats", "sphere", "c.ply", "isosurface", "a grid of 128 cells", "z"),
    ] {
        ndf(&folder.0, &["sample", kind, "--shape", shape, "-o", file, "--points", "3000", "--json"]).json();
        let run = ndf(&folder.0, &["render", file, "-o", "x.png", "--size", "80,60", "--json"]);
        let picture = run.json();
        assert_eq!((&picture["drawn"], &picture["up"]), (&drawn.into(), &up.into()), "{kind}");
        assert!(picture["covered"].as_f64().unwrap() > 0.25, "{kind}: {picture}");
        assert!(run.stderr.contains(said), "{}", run.stderr);
    }
    folder.write("a.xyz", "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 0\n1 0 1\n0 1 1\n1 1 1\n");
    assert_eq!(
        ndf(&folder.0, &["render", "a.xyz", "-o", "x.png", "--size", "80,60", "--json"]).json()["drawn"],
        "points"
    );
    // What is left out of a file is told here as elsewhere.
    folder.write("b.xyz", "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 0\n1 0 1\nnan 1 1\n");
    let run = ndf(&folder.0, &["render", "b.xyz", "-o", "x.png", "--size", "80,60", "--keep-flagged"]);
    assert!(run.stderr.contains("1 point not finite, left out"), "{}", run.stderr);
    assert!(run.stderr.contains("--keep-flagged): not used"), "{}", run.stderr);
}

/// Options of other kinds of input are named, whatever the command.
#[test]
fn options_of_other_kinds_are_named() {
    let folder = folder("other-options");
    for (command, said) in [
        ("render torus.ndf -o a.png --size 40,30 --columns x,y,z", "--columns): not used"),
        ("render torus.ply -o a.png --size 40,30 --iso 2", "--iso): not used"),
        ("info torus.ndf --omega 3", "--omega"),
        ("info torus.ply --keep-flagged", "--keep-flagged): not used"),
    ] {
        let run = ndf(&folder.0, &command.split(" ").collect::<Vec<_>>());
        assert!(run.code == 0 && run.stderr.contains(said), "{command}: {}", run.stderr);
    }
}

#[test]
fn lines_beside_the_surface_are_in_the_picture() {
    let folder = Folder::new("lines-framed");
    ndf(&folder.0, &["sample", "mesh", "--shape", "sphere", "-o", "s.ply"]);
    folder.write("l.obj", "v 0 0 0\nv 9 0 0\nv 9 0 9\nl 1 2 3\n");
    let covered = |more: &[&str]| {
        let render = ["render", "s.ply", "-o", "a.png", "--size", "80,60", "--json"];
        ndf(&folder.0, &[&render[..], more].concat()).json()["covered"].as_f64().unwrap()
    };
    assert!(covered(&["--paths", "l.obj"]) < 0.3 * covered(&[]));
}

/// A model is fitted first, which is said; vertices of a file that has no mesh are no sources.
#[test]
fn distances_over_a_cloud_are_those_of_a_model_of_it() {
    let folder = Folder::new("cloud-distances");
    ndf(
        &folder.0,
        &["sample", "oriented-cloud", "--shape", "sphere", "-o", "a.ply", "--points", "2000", "--json"],
    )
    .json();
    let run = ndf(
        &folder.0,
        &["geodesic", "a.ply", "-o", "d.ply", "--source", "0,0,1", "--json", "--relative-edge-length", "0.1"],
    );
    let found = run.json();
    let farthest = found["max_distance"].as_f64().unwrap();
    assert!((farthest - std::f64::consts::PI).abs() < 0.05, "{farthest}");
    assert!(run.stderr.contains("a.ply is a point cloud: a model is fitted first"), "{}", run.stderr);
    assert_eq!(found["fitted"]["kind"], "oriented-cloud");
    let vertex = ndf(&folder.0, &["geodesic", "a.ply", "-o", "d.ply", "--source-vertex", "0"]);
    assert!(vertex.sentence().contains("say where with --source X,Y,Z"), "{}", vertex.stderr);
}

/// Pictures show upright what stands on one of two axes, and obey those who know better.
#[test]
fn pictures_are_upright() {
    let folder = Folder::new("upright");
    // A pyramid on its base.
    let pyramid = |up: usize| {
        let corner = |[x, y, z]: [f64; 3]| {
            if up == 2 { format!("v {x} {y} {z}\n") } else { format!("v {y} {z} {x}\n") }
        };
        let corners =
            [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 2.0]];
        let corners: String = corners.map(corner).concat();
        format!("{corners}f 1 3 2\nf 1 4 3\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n")
    };
    folder.write("z.obj", pyramid(2));
    folder.write("y.obj", pyramid(1));
    let draw = |file, picture, more: &[&str]| {
        let render = ["render", file, "-o", picture, "--size", "80,60", "--quiet", "--json"];
        let drawn = ndf(&folder.0, &[&render[..], more].concat()).json();
        (drawn["up"].as_str().unwrap().to_owned(), std::fs::read(folder.0.join(picture)).unwrap())
    };
    let (z, y) = (draw("z.obj", "z.png", &[]), draw("y.obj", "y.png", &[]));
    assert_eq!((z.0.as_str(), y.0.as_str()), ("z", "y"));
    assert!(z.1 == y.1, "the same shape, the same picture");
    for up in ["x", "y", "-x", "-y", "-z"] {
        let (told, picture) = draw("z.obj", "other.png", &["--up", up]);
        assert!(told == up && picture != z.1, "{up}");
    }
    assert_eq!(ndf(&folder.0, &["render", "z.obj", "-o", "a.png", "--up", "w"]).code, 2);
}

/// A model does not take the place of a mesh by a wrong name.
#[test]
fn models_are_not_written_under_the_names_of_meshes() {
    let folder = Folder::new("wrong-names");
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "torus.ply"]);
    for name in ["a.obj", "a.PLY", "a.stl"] {
        let run = ndf(&folder.0, &["fit", "torus.ply", "-o", name]);
        assert!(run.sentence().contains("`ndf extract` makes a mesh of it"), "{}", run.stderr);
    }
    assert_eq!(folder.files(), ["torus.ply"]);
}
