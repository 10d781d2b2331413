//! Decimation, remeshing and repair.

use ndf_mesh::io::read_mesh;

use super::{Folder, ndf};

/// A cube of twelve by twelve squares a side, with its x as a scalar.
fn cube(folder: &Folder) {
    ndf(&folder.0, &["sample", "mesh", "--shape", "cube", "-o", "plain.ply", "--json"]).json();
    let mesh = read_mesh(folder.0.join("plain.ply")).unwrap().mesh;
    let n = mesh.vertex_count();
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {n}\nproperty double x\nproperty double y\nproperty double z\nproperty float level\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.face_count()
    );
    mesh.positions().iter().for_each(|p| text += &format!("{} {} {} {}\n", p.x, p.y, p.z, p.x));
    mesh.faces().iter().for_each(|[a, b, c]| text += &format!("3 {a} {b} {c}\n"));
    folder.write("cube.ply", text);
}

/// The scalar that was x is still x.
fn check_level(folder: &Folder, file: &str) {
    let file = read_mesh(folder.0.join(file)).unwrap();
    let level = file.scalars.iter().find(|scalars| scalars.name == "level").unwrap();
    for (p, &x) in file.mesh.positions().iter().zip(&level.values) {
        assert!((p.x - f64::from(x)).abs() < 1e-5, "{p} {x}");
    }
}

#[test]
fn cubes_stay_cubes_and_scalars_are_carried_over() {
    let folder = Folder::new("remeshed");
    cube(&folder);
    let creases = ["--creases", "30", "--json", "--quiet"];
    let runs: [&[&str]; 4] = [
        &["decimate", "cube.ply", "-o", "out.ply", "--faces", "60"],
        &["decimate", "cube.ply", "-o", "out.ply", "--error", "0.01%"],
        &["remesh", "cube.ply", "-o", "out.ply", "--edge-length", "0.2"],
        &["remesh", "cube.ply", "-o", "out.ply", "--error", "1%"],
    ];
    for run in runs {
        let found = ndf(&folder.0, &[run, &creases].concat()).json();
        assert_eq!((&found["euler_characteristic"], &found["self_intersections"]), (&2.into(), &0.into()));
        assert!(found["hausdorff"].as_f64().unwrap() < 1e-6, "{found}");
        assert_eq!(found["faces_before"], 12 * 32 * 32);
        assert!(found["faces"].as_i64().unwrap() < 12_000);
        check_level(&folder, "out.ply");
    }
    // What is told is what `ndf measure` finds.
    let run = ["decimate", "cube.ply", "-o", "out.ply", "--faces", "50", "--json"];
    let found = ndf(&folder.0, &run).json();
    let measured = ndf(&folder.0, &["measure", "cube.ply", "out.ply", "--json"]).json();
    let [told, seen] = [&found, &measured].map(|json| json["hausdorff"].as_f64().unwrap());
    assert!((told / seen - 1.0).abs() < 1e-3 || told < 1e-6, "{told} {seen}");
    for wrong in [&["--faces", "0"][..], &["--error", "2"], &["--faces", "9", "--error", "1%"], &[]] {
        assert_eq!(ndf(&folder.0, &[&["decimate", "cube.ply", "-o", "x.ply"], wrong].concat()).code, 2);
    }
    let long = ndf(&folder.0, &["remesh", "cube.ply", "-o", "x.ply", "--edge-length", "1e-9"]);
    assert!(long.sentence().contains("cube.ply") && long.sentence().contains("longer edges"));
}

/// Two squares that share an edge in two copies, one of them turned, beside a vertex of no face.
#[test]
fn repairs_say_which_vertices_are_which() {
    let folder = Folder::new("repaired");
    let corners = "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\n";
    folder.write("two.obj", format!("{corners}f 2 3 4\nf 2 4 5\nf 6 8 7\nf 6 9 8\n"));
    let run = ["repair", "two.obj", "-o", "one.ply", "--map", "map.csv", "--json"];
    let found = ndf(&folder.0, &run).json();
    assert_eq!((&found["vertices"], &found["vertices_before"]), (&6.into(), &9.into()));
    assert_eq!((&found["components"], &found["boundary_edges"]), (&1.into(), &6.into()));
    assert_eq!(found["notes"].as_array().unwrap().len(), 3, "{}", found["notes"]);
    let map = std::fs::read_to_string(folder.0.join("map.csv")).unwrap();
    let before = read_mesh(folder.0.join("two.obj")).unwrap().mesh;
    let after = read_mesh(folder.0.join("one.ply")).unwrap().mesh;
    let mut lines = map.lines();
    assert_eq!(lines.next(), Some("input_vertex,vertex"));
    let mut seen = Vec::new();
    for line in lines {
        let [v, w] = line.split(',').map(|word| word.parse::<usize>().unwrap()).collect::<Vec<_>>()[..]
        else {
            panic!("{line}")
        };
        assert_eq!(before.positions()[v], after.positions()[w]);
        seen.push(v);
    }
    assert_eq!(seen, (1..9).collect::<Vec<_>>());
    let twice = ["repair", "two.obj", "-o", "one.ply", "--map", "one.ply"];
    assert!(ndf(&folder.0, &twice).sentence().contains("two outputs"));
}

#[test]
fn intrinsic_remeshing_keeps_vertices_and_adds_others_on_the_surface() {
    let folder = Folder::new("intrinsically");
    cube(&folder);
    let arguments =
        ["remesh", "cube.ply", "-o", "out.ply", "--method", "intrinsic", "--edge-length", "0.04", "--json"];
    let told = ndf(&folder.0, &arguments).json();
    assert!(told["faces"].as_u64() > told["faces_before"].as_u64(), "{told}");
    let found = read_mesh(folder.0.join("out.ply")).unwrap().mesh;
    let side = found.bounds().extent().x;
    assert!(found.positions().iter().all(|p| (p.abs().max_element() - 0.5 * side).abs() < 1e-6));
    check_level(&folder, "out.ply");
    let refused =
        ndf(&folder.0, &["remesh", "cube.ply", "-o", "x.ply", "--method", "intrinsic", "--error", "1%"]);
    assert_eq!(refused.code, 1);
    assert!(refused.stderr.contains("--method intrinsic takes neither"), "{}", refused.stderr);
}
