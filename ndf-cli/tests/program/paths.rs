//! Shortest paths: in JSON, as lines in files, and in pictures.

use ndf_mesh::io::{read_lines, read_mesh};
use serde_json::Value;

use super::{Folder, ndf};

/// Lines of a file in pieces from an end to an end, as the lengths of these.
fn lengths(folder: &Folder, name: &str) -> Vec<f64> {
    let lines = read_lines(folder.0.join(name)).unwrap();
    let mut lengths = Vec::new();
    let mut last = None;
    for [a, b] in lines.segments {
        if last != Some(a) {
            lengths.push(0.0);
        }
        *lengths.last_mut().unwrap() += lines.points[a as usize].distance(lines.points[b as usize]);
        last = Some(b);
    }
    lengths
}

#[test]
fn several_paths_are_told_and_written_as_lines() {
    let folder = Folder::new("paths");
    ndf(&folder.0, &["sample", "mesh", "--shape", "cube", "-o", "cube.ply"]);
    let geodesic = ["geodesic", "cube.ply", "-o", "d.ply", "--source", "1,0,0", "--json", "--quiet"];
    let to = ["--path-to", "-1,0,0", "--path-to", "1,0.5,0", "--path-to=0,0,1"];
    for (paths, place) in [
        (&[][..], "d.paths.ply"),
        (&["--paths", "lines.obj"], "lines.obj"),
        (&["--paths", "lines.glb"], "lines.glb"),
    ] {
        let found = ndf(&folder.0, &[&geodesic[..], &to, paths].concat()).json();
        let told: Vec<f64> =
            found["paths"].as_array().unwrap().iter().map(|p| p["length"].as_f64().unwrap()).collect();
        assert!(
            told.iter().zip([4.0, 0.5, 2.0]).all(|(told, truth)| (told - truth).abs() < 1e-9),
            "{told:?}"
        );
        assert!(found.get("path").is_none());
        let written = lengths(&folder, place);
        assert!(
            written.len() == 3 && written.iter().zip(told).all(|(a, b)| (a - b).abs() < 1e-5),
            "{written:?}"
        );
    }
    // The mesh has the vertices of the file, whatever paths there are.
    let vertices = |name| read_mesh(folder.0.join(name)).unwrap().mesh.vertex_count();
    assert_eq!(vertices("d.ply"), vertices("cube.ply"));
    let one = ndf(&folder.0, &[&geodesic[..], &["--path-to", "1,0.5,0"]].concat()).json();
    assert_eq!(one["path"], one["paths"][0]);
    let none = ndf(&folder.0, &geodesic).json();
    assert_eq!(none["paths"], Value::Array(Vec::new()));
    let text =
        ndf(&folder.0, &["geodesic", "cube.ply", "-o", "d.ply", "--source", "1,0,0", "--path-to", "1,0.5,0"]);
    assert!(text.stdout.contains("d.paths.ply: 0.5000 long"), "{}", text.stdout);
    assert!(ndf(&folder.0, &["geodesic", "--help"]).stdout.contains(".paths.ply"));

    for (arguments, said) in [
        (&["--paths", "x.stl"][..], "x.stl"),
        (&["--paths", "d.ply"], "d.ply is the name of two outputs"),
        (&["--paths", "cube.ply"], "cube.ply is an input"),
    ] {
        let run = ndf(&folder.0, &[&geodesic[..7], &["--path-to", "1,0.5,0"], arguments].concat());
        assert!(run.sentence().contains(said), "{}", run.stderr);
    }
    assert_eq!(ndf(&folder.0, &[&geodesic[..], &["--paths", "x.ply"]].concat()).code, 2);
}

/// What was found is there, although the path to another component is not.
#[test]
fn a_path_that_does_not_exist_costs_no_other() {
    let folder = Folder::new("paths-apart");
    folder.write("two.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf 1 2 3\nf 4 5 6\n");
    let geodesic = ["geodesic", "two.obj", "-o", "d.ply", "--source-vertex", "0", "--json"];
    let run = ndf(&folder.0, &[&geodesic[..], &["--path-to", "5,0,0", "--path-to", "1,0,0"]].concat());
    assert!(run.sentence().contains("no path to (5, 0, 0)"), "{}", run.stderr);
    assert_eq!(lengths(&folder, "d.paths.ply"), [1.0]);
    assert_eq!(folder.files(), ["d.paths.ply", "d.ply", "two.obj"]);
}

#[test]
fn distances_that_a_format_loses_are_warned_of() {
    let folder = Folder::new("lost-distances");
    ndf(&folder.0, &["sample", "mesh", "--shape", "cube", "-o", "cube.ply"]);
    let lost = ndf(&folder.0, &["geodesic", "cube.ply", "-o", "d.obj", "--source-vertex", "0", "--json"]);
    lost.json();
    assert!(
        lost.stderr.contains("d.obj: this format holds no scalars; .ply and .glb have the distances"),
        "{}",
        lost.stderr
    );
}

#[test]
fn paths_are_drawn() {
    let folder = Folder::new("paths-drawn");
    ndf(&folder.0, &["sample", "mesh", "--shape", "sphere", "-o", "ball.ply"]);
    let geodesic = ["geodesic", "ball.ply", "-o", "d.ply", "--source", "0,0,1", "--path-to", "1,0,0"];
    assert_eq!(ndf(&folder.0, &[&geodesic[..], &["--path-to", "0,1,0"]].concat()).code, 0);
    let pixels = |more: &[&str]| {
        let render =
            ["render", "d.ply", "-o", "a.png", "--size", "160,120", "--scalar", "distance", "--quiet"];
        assert_eq!(ndf(&folder.0, &[&render[..], more].concat()).code, 0);
        let file = std::io::BufReader::new(std::fs::File::open(folder.0.join("a.png")).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        pixels
    };
    // Orange is nothing else.
    let orange = |pixels: &[u8]| pixels.chunks(3).filter(|p| p[0] > 150 && p[1] < 140 && p[2] < 90).count();
    let (without, with) = (pixels(&[]), pixels(&["--paths", "d.paths.ply"]));
    assert!(orange(&without) == 0 && orange(&with) > 60, "{} {}", orange(&without), orange(&with));
    let none = ndf(&folder.0, &["render", "d.ply", "-o", "b.png", "--paths", "ball.ply"]);
    assert!(none.sentence().contains("ball.ply") && none.stderr.contains("no lines"), "{}", none.stderr);
}
