//! Meshes with every kind of defect: the program says what is wrong, or does its work, and never panics.

use std::path::PathBuf;
use std::time::Duration;

use super::{Folder, ndf};

/// A key of `info` and its value, for files that can be read.
type Figure = Option<(&'static str, i64)>;

/// What takes longer hangs, however busy the machine is.
const HANG: Duration = Duration::from_secs(900);

/// Small files, one for each kind of defect, and a figure of `info` if it can be read.
fn made(folder: &Folder) -> Vec<(&'static str, Figure)> {
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 1 1\n";
    let header = |vertices: usize, faces: usize| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
             element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
        )
    };
    let mut soup = vec![b' '; 80];
    soup.extend(3_u32.to_le_bytes());
    for k in 0..3_u8 {
        let x = f32::from(k);
        let corners = [x, 0.0, 0.0, x + 0.5, 0.0, 0.0, x, 1.0, 0.0];
        soup.extend([0.0, 0.0, 1.0].iter().chain(&corners).flat_map(|c: &f32| c.to_le_bytes()));
        soup.extend([0; 2]);
    }
    let cases: Vec<(&str, Vec<u8>, Figure)> = vec![
        ("fin.obj", format!("{corners}f 1 2 3\nf 1 2 4\nf 1 2 5\n").into(), Some(("nonmanifold_edges", 1))),
        (
            "fans.obj",
            format!("{corners}v -1 0 0\nf 1 2 3\nf 1 6 4\n").into(),
            Some(("nonmanifold_vertices", 1)),
        ),
        ("soup.stl", soup.clone(), Some(("components", 3))),
        ("open.obj", format!("{corners}f 1 2 3\nf 2 5 3\n").into(), Some(("boundary_edges", 4))),
        (
            "degenerate.obj",
            "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 0 0\nf 1 2 3\nf 1 4 1\n".into(),
            Some(("degenerate_faces", 2)),
        ),
        ("point.obj", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n".into(), Some(("duplicate_vertices", 2))),
        (
            "nan.obj",
            "v 0 0 nan\nv 1 0 0\nv 0 1 0\nv inf 0 0\nf 1 2 3\nf 2 3 4\n".into(),
            Some(("nonfinite_vertices", 2)),
        ),
        (
            "nan.ply",
            (header(3, 1) + "nan nan nan\n1 0 0\n0 1 0\n3 0 1 2\n").into(),
            Some(("nonfinite_vertices", 1)),
        ),
        (
            "all_nan.obj",
            "v nan nan nan\nv nan nan nan\nv nan nan nan\nf 1 2 3\n".into(),
            Some(("nonfinite_vertices", 3)),
        ),
        ("huge.obj", "v 1e308 0 0\nv -1e308 1e308 0\nv 0 1e308 1e308\nf 1 2 3\n".into(), Some(("faces", 1))),
        ("tiny.obj", "v 1e-310 0 0\nv 0 1e-310 0\nv 0 0 1e-310\nf 1 2 3\n".into(), Some(("faces", 1))),
        ("empty.obj", "# nothing\n".into(), Some(("vertices", 0))),
        ("empty.ply", header(0, 0).into(), Some(("vertices", 0))),
        ("empty.stl", "solid Empty\nendsolid Empty".into(), Some(("vertices", 0))),
        ("zero.obj", vec![], None),
        ("points.ply", (header(2, 0) + "0 0 0\n1 1 1\n").into(), Some(("vertices", 2))),
        ("negative.obj", format!("{corners}f -5 -4 -3\n").into(), Some(("faces", 1))),
        ("polygon.obj", format!("{corners}f 1 2 5 3 4\n").into(), Some(("faces", 3))),
        ("duplicates.obj", format!("{corners}f 1 2 3\nf 3 1 2\n").into(), Some(("duplicate_faces", 1))),
        ("winding.obj", format!("{corners}f 1 2 3\nf 2 3 5\n").into(), Some(("inconsistent_edges", 1))),
        ("unused.obj", format!("{corners}f 1 2 3\n").into(), Some(("unreferenced_vertices", 2))),
        ("range.obj", format!("{corners}f 1 2 9\n").into(), None),
        ("cut.ply", (header(3, 1) + "0 0 0\n1 0 0\n").into(), None),
        ("cut.stl", soup[..150].to_vec(), None),
        ("cut.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n".into(), None),
        ("lying.ply", (header(4_000_000_000, 1) + "0 0 0\n").into(), None),
        ("noise.ply", (0..=255).cycle().take(5000).collect(), None),
        ("letter.obj", "Dear reader,\nthis is no mesh.\n".into(), None),
    ];
    cases
        .into_iter()
        .map(|(name, content, expected)| {
            folder.write(name, content);
            (name, expected)
        })
        .collect()
}

#[test]
fn every_kind_of_defect_is_told() {
    let folder = Folder::new("bad");
    for (name, expected) in made(&folder) {
        let info = ndf(&folder.0, &["info", name, "--json"]);
        match expected {
            Some((key, value)) => assert_eq!(info.json()[key], value, "{name}: {key} in {}", info.stdout),
            None => assert!(info.sentence().contains(name), "{}", info.stderr),
        }
    }
}

#[test]
fn no_command_panics_or_leaves_half_a_file() {
    let folder = Folder::new("bad-commands");
    let names = made(&folder);
    ndf(&folder.0, &["sample", "mesh", "--shape", "cube", "-o", "cube.obj", "--json"]).json();
    for (name, _) in names {
        walk(&folder, name);
    }
}

/// Meshes of the optional data folder (`NDF_DATA`, else `shared/data` beside the workspace).
#[test]
fn real_bad_meshes_are_survived() {
    let Some(data) = ndf_testing::data_path("mesh_bad") else { return };
    let folder = Folder::new("bad-real");
    ndf(&folder.0, &["sample", "mesh", "--shape", "cube", "-o", "cube.obj", "--json"]).json();
    let mut paths: Vec<PathBuf> = std::fs::read_dir(data).unwrap().map(|e| e.unwrap().path()).collect();
    paths.sort();
    for path in paths {
        walk(&folder, path.canonicalize().unwrap().to_str().unwrap());
    }
}

/// Runs every command on a file: done, or one sentence; an output only if it is done.
fn walk(folder: &Folder, name: &str) {
    let before = folder.files();
    for arguments in [
        &["info", name][..],
        &["measure", "cube.obj", name, "--samples", "1000"],
        &["measure", name, "cube.obj", "--samples", "1000"],
        &["render", name, "-o", "out.png", "--size", "32,24", "--wireframe"],
        &["fit", name, "-o", "out.ndf", "--base-faces", "500", "--quiet"],
        &["mesh", name, "-o", "out.ply", "--grid", "24"],
        &["geodesic", name, "-o", "out.ply", "--source-vertex", "0"],
        &["spectrum", name, "-o", "out.ply", "--modes", "3"],
    ] {
        let run = ndf(&folder.0, arguments);
        assert!(run.elapsed < HANG, "{arguments:?} took {:?}", run.elapsed);
        match run.code {
            0 => assert!(!run.stdout.is_empty()),
            1 => assert!(run.sentence().len() < 600, "{}", run.stderr),
            code => panic!("{arguments:?} ended with {code}: {}", run.stderr),
        }
        let output = arguments.iter().find(|a| a.starts_with("out."));
        if let Some(output) = output {
            assert_eq!(folder.0.join(output).exists(), run.code == 0, "{arguments:?}");
            let _ = std::fs::remove_file(folder.0.join(output));
        }
        assert_eq!(folder.files(), before, "{arguments:?} left something");
    }
}
