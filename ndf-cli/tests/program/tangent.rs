//! Directions, stripes, transport, logarithmic maps, heat, signed distances and centres.

use ndf_mesh::io::read_mesh;

use super::{Folder, ndf};

/// A property of a mesh that was written.
fn column(folder: &Folder, file: &str, name: &str) -> Vec<f64> {
    let file = read_mesh(folder.0.join(file)).unwrap();
    let found = file.scalars.iter().find(|scalars| scalars.name == name);
    found.unwrap().values.iter().map(|&x| x.into()).collect()
}

fn vectors(folder: &Folder, file: &str, name: &str) -> Vec<[f64; 3]> {
    let [x, y, z] = ["x", "y", "z"].map(|axis| column(folder, file, &format!("{name}_{axis}")));
    (0..x.len()).map(|v| [x[v], y[v], z[v]]).collect()
}

/// A flat square with a vertex that no face uses.
fn square(folder: &Folder) {
    let n = 24;
    let mut text = String::from("v 9 9 9\n");
    for j in 0..=n {
        for i in 0..=n {
            text += &format!("v {} {} 0\n", f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
        }
    }
    for j in 0..n {
        for i in 0..n {
            let at = |i: i32, j: i32| j * (n + 1) + i + 2;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            text += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
        }
    }
    folder.write("square.obj", text);
}

#[test]
fn directions_of_closed_shapes_have_indices_that_sum_to_chi_and_stripes_follow_them() {
    let folder = Folder::new("directions");
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "torus.ply", "--json"]).json();
    ndf(&folder.0, &["sample", "mesh", "--shape", "sphere", "-o", "ball.ply", "--json"]).json();
    for (file, euler) in [("torus.ply", 0.0), ("ball.ply", 2.0)] {
        for symmetry in ["1", "2", "4"] {
            let run = ["directions", file, "-o", "d.ply", "--symmetry", symmetry, "--json", "--quiet"];
            let found = ndf(&folder.0, &run).json();
            assert_eq!(found["index_sum"], euler);
            assert_eq!(found["singularities"], found["singular_points"].as_array().unwrap().len());
            for [x, y, z] in vectors(&folder, "d.ply", "direction") {
                assert!((x * x + y * y + z * z - 1.0).abs() < 1e-5);
            }
        }
    }
    let curvature = ["directions", "torus.ply", "-o", "c.ply", "--align", "curvature", "--json"];
    assert!(ndf(&folder.0, &curvature).sentence().contains("--symmetry 2"));
    let found = ndf(&folder.0, &[&curvature[..], &["--symmetry", "2"]].concat()).json();
    assert_eq!(found["singularities"], 0);
    let away = ["directions", "ball.ply", "-o", "a.ply", "--source", "0,0,1", "--json"];
    ndf(&folder.0, &away).json();
    let stripes = ["stripes", "torus.ply", "-o", "s.ply", "--frequency", "2", "--json"];
    let found = ndf(&folder.0, &[&stripes[..], &["--directions", "c.ply"]].concat()).json();
    assert_eq!(found["stripe_ends"], 0, "lines around the tube close up where the frequency fits");
    let values = column(&folder, "s.ply", "stripes");
    assert!(values.iter().all(|x| (-1.0..=1.0).contains(x)) && values.iter().any(|x| *x > 0.9));
    let other = ndf(&folder.0, &[&stripes[..], &["--directions", "a.ply"]].concat());
    assert!(other.sentence().contains("vertices"));
    let none = ndf(&folder.0, &[&stripes[..], &["--directions", "torus.ply"]].concat());
    assert!(none.sentence().contains("no property direction_x"));
}

#[test]
fn a_flat_square_is_carried_mapped_and_heated_as_a_plane() {
    let folder = Folder::new("tangent");
    square(&folder);
    let transport =
        ["transport", "square.obj", "-o", "t.ply", "--source-vertex", "313", "--angle", "30", "--json"];
    let carried = ndf(&folder.0, &transport).json();
    let at_source: Vec<f64> =
        carried["vector"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
    let found = vectors(&folder, "t.ply", "transport");
    assert!(found[0][0].is_nan(), "no face uses it");
    for vector in &found[1..] {
        assert!((0..3).all(|k| (vector[k] - at_source[k]).abs() < 1e-5), "{vector:?} {at_source:?}");
    }

    let positions = read_mesh(folder.0.join("square.obj")).unwrap().mesh;
    let positions = positions.positions();
    for method in ["exact", "heat"] {
        let map =
            ["logmap", "square.obj", "-o", "l.ply", "--source-vertex", "313", "--method", method, "--json"];
        let mapped = ndf(&folder.0, &map).json();
        assert_eq!(mapped["unreached"], 0);
        let axes: Vec<Vec<f64>> = serde_json::from_value(mapped["axes"].clone()).unwrap();
        let (x, y) = (column(&folder, "l.ply", "log_x"), column(&folder, "l.ply", "log_y"));
        let tolerance = if method == "exact" { 1e-5 } else { 0.05 };
        for v in 1..positions.len() {
            for k in 0..3 {
                let there = positions[313].to_array()[k] + x[v] * axes[0][k] + y[v] * axes[1][k];
                assert!((there - positions[v].to_array()[k]).abs() < tolerance, "{method} {v}");
            }
        }
    }

    let heat = ["heat", "square.obj", "-o", "h.ply", "--source", "0.5,0.5,0", "--time", "0.05", "--json"];
    let found = ndf(&folder.0, &[&heat[..], &["--frames", "3"]].concat()).json();
    for total in found["totals"].as_array().unwrap() {
        assert!((total.as_f64().unwrap() - 1.0).abs() < 1e-9, "{total}");
    }
    assert_eq!(found["times"].as_array().unwrap().len(), 3);
    // The heat kernel of an insulated interval, from its middle.
    let interval = |x: f64| {
        let term = |k: i32| {
            let k = f64::from(k) * std::f64::consts::PI;
            2.0 * (-k * k * 0.05).exp() * (k * x).cos() * (0.5 * k).cos()
        };
        1.0 + (1..20).map(term).sum::<f64>()
    };
    for (p, u) in positions.iter().zip(column(&folder, "h.ply", "heat_02")).skip(1) {
        assert!((u - interval(p.x) * interval(p.y)).abs() < 0.012, "{p} {u}");
    }
    // Held at zero on the boundary it is lost; and it goes on from what was written.
    let on =
        ["heat", "h.ply", "-o", "on.ply", "--initial", "heat_02", "--time", "1", "--boundary", "dirichlet"];
    ndf(&folder.0, &[&on[..], &["--json"]].concat()).json();
    assert!(
        ndf(&folder.0, &["heat", "h.ply", "-o", "on.ply", "--initial", "cold", "--time", "1"])
            .sentence()
            .contains("it has heat_00, heat_01, heat_02")
    );
    let unused = ["transport", "square.obj", "-o", "t.ply", "--source-vertex", "0", "--angle", "0"];
    assert!(ndf(&folder.0, &unused).sentence().contains("vertex 0 is on no face"));
    assert_eq!(ndf(&folder.0, &["heat", "square.obj", "-o", "h.ply", "--time", "1"]).code, 2);
    assert_eq!(
        ndf(&folder.0, &["heat", "square.obj", "-o", "h.ply", "--source-vertex", "1", "--time", "-1"]).code,
        2
    );
}

#[test]
fn models_have_fields_and_what_is_no_manifold_says_so() {
    let folder = Folder::new("tangent-models");
    ndf(&folder.0, &["sample", "mesh", "--shape", "torus", "-o", "torus.ply", "--json"]).json();
    ndf(&folder.0, &["fit", "torus.ply", "-o", "m.ndf", "--base-faces", "300", "--size", "2000", "--json"])
        .json();
    let length = ["--relative-edge-length", "0.1", "--json"];
    let found = ndf(&folder.0, &[&["directions", "m.ndf", "-o", "d.ply"][..], &length].concat()).json();
    assert_eq!(found["index_sum"], 0.0);
    ndf(&folder.0, &[&["stripes", "m.ndf", "-o", "s.ply", "--frequency", "3"][..], &length].concat()).json();
    let vertex = ["logmap", "m.ndf", "-o", "l.ply", "--source-vertex", "3"];
    assert!(ndf(&folder.0, &[&vertex[..], &length].concat()).json()["target_edge_length"].is_f64());
    // Three faces at one edge.
    folder.write("book.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n");
    for run in [
        &["directions", "book.obj", "-o", "d.ply"][..],
        &["stripes", "book.obj", "-o", "d.ply", "--frequency", "1"],
        &["heat", "book.obj", "-o", "d.ply", "--source", "0,0,0", "--time", "1"],
    ] {
        let found = ndf(&folder.0, run);
        assert!(found.sentence().contains("ndf mesh"), "{}", found.stderr);
    }
}

#[test]
fn signed_distances_of_a_square_are_negative_on_the_left() {
    let folder = Folder::new("signed-distance");
    square(&folder);
    let positions = read_mesh(folder.0.join("square.obj")).unwrap().mesh;
    let positions = positions.positions();
    // Upwards through the middle: the left side is at smaller x.
    let signed = ["signed-distance", "square.obj", "-o", "d.ply", "--json"];
    let middle: Vec<String> = (0..=24).map(|j| (j * 25 + 13).to_string()).collect();
    let found = ndf(&folder.0, &[&signed[..], &["--curve-vertices", &middle.join(",")]].concat()).json();
    assert!((found["curve_length"].as_f64().unwrap() - 1.0).abs() < 1e-9);
    assert!((found["min"].as_f64().unwrap() + 0.5).abs() < 1e-3);
    assert!((found["max"].as_f64().unwrap() - 0.5).abs() < 1e-3);
    assert_eq!(found["unused_vertices"], serde_json::json!([0]));
    assert_eq!((&found["unreached"], &found["heat"]["out_of_reach"]), (&0.into(), &0.into()));
    let from_vertices = column(&folder, "d.ply", "signed_distance");
    for (p, d) in positions.iter().zip(&from_vertices).skip(1) {
        assert!((d - (p.x - 0.5)).abs() < 1e-3, "{p} {d}");
    }
    // The same as a file of lines, that of a path, and the other way.
    let path =
        ["path", "square.obj", "-o", "line.ply", "--through", "0.5,0,0", "--through", "0.5,1,0", "--json"];
    ndf(&folder.0, &path).json();
    ndf(&folder.0, &[&signed[..], &["--curve", "line.ply", "--zero", "mean"]].concat()).json();
    for (p, d) in positions.iter().zip(column(&folder, "d.ply", "signed_distance")).skip(1) {
        assert!((d - (p.x - 0.5)).abs() < 1e-3, "{p} {d}");
    }
    // Two vertices are joined by a shortest path, and a loop that runs counter-clockwise is negative inside.
    let [a, b, c, d] = [(4, 4), (20, 4), (20, 20), (4, 20)].map(|(i, j)| (j * 25 + i + 1).to_string());
    let corners = [a, b, c, d].join(",");
    let found = ndf(&folder.0, &[&signed[..], &["--curve-vertices", &corners, "--closed"]].concat()).json();
    assert!((found["curve_length"].as_f64().unwrap() - 64.0 / 24.0).abs() < 1e-9);
    let inside = column(&folder, "d.ply", "signed_distance")[12 * 25 + 13];
    assert!((inside + 8.0 / 24.0).abs() < 0.02, "{inside}");
    // A point has no sides.
    ndf(&folder.0, &[&signed[..], &["--source", "0,0,0"]].concat()).json();
    assert!(column(&folder, "d.ply", "signed_distance")[1..].iter().all(|d| *d >= -1e-6));
    assert_eq!(ndf(&folder.0, &signed).code, 2);
    assert_eq!(ndf(&folder.0, &[&signed[..], &["--curve-vertices", "4"]].concat()).code, 2);
    let none = ndf(&folder.0, &[&signed[..], &["--curve", "square.obj"]].concat());
    assert!(none.sentence().contains("no lines"), "{}", none.stderr);
}

#[test]
fn centres_of_a_square_are_those_of_the_plane() {
    let folder = Folder::new("centre");
    square(&folder);
    let position = |found: &serde_json::Value| -> Vec<f64> {
        serde_json::from_value(found["position"].clone()).unwrap()
    };
    let run =
        ["centre", "square.obj", "--json", "--source", "0,0,0", "--source", "1,0,0", "--source", "0,1,0"];
    let found = ndf(&folder.0, &run).json();
    assert!(position(&found).iter().zip([1.0 / 3.0, 1.0 / 3.0, 0.0]).all(|(x, y)| (x - y).abs() < 1e-6));
    assert!((found["variance"].as_f64().unwrap() - 4.0 / 9.0).abs() < 1e-6);
    assert_eq!((&found["converged"], &found["sources"]), (&true.into(), &3.into()));
    let weights = ["--weight", "2", "--weight", "1", "--weight", "1"];
    let found = ndf(&folder.0, &[&run[..], &weights].concat()).json();
    assert!(position(&found).iter().zip([0.25, 0.25, 0.0]).all(|(x, y)| (x - y).abs() < 1e-6));
    // Fermat's point of a right isosceles triangle.
    let median = ndf(&folder.0, &[&run[..], &["--kind", "median"]].concat()).json();
    let fermat = (3.0 - 3.0_f64.sqrt()) / 6.0;
    assert!(position(&median).iter().zip([fermat, fermat, 0.0]).all(|(x, y)| (x - y).abs() < 1e-5));
    assert_eq!(ndf(&folder.0, &["center", "square.obj", "--source-vertex", "7"]).code, 0);
    let wrong = ndf(&folder.0, &[&run[..], &["--weight", "1"]].concat());
    assert!(wrong.sentence().contains("1 weights for 3 sources"));
    folder.write("two.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf 1 2 3\nf 4 5 6\n");
    let apart = ndf(&folder.0, &["centre", "two.obj", "--source-vertex", "0", "--source-vertex", "3"]);
    assert!(apart.sentence().contains("on several components"), "{}", apart.stderr);
}

/// Heat decays by e an edge: a tube of a thousand diameters takes a larger time step, and says so.
#[test]
fn vectors_are_carried_to_the_end_of_a_long_tube() {
    let folder = Folder::new("tube");
    let (around, along) = (6, 2000);
    let mut text = String::new();
    for ring in 0..=along {
        for k in 0..around {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(around);
            text += &format!("v {} {} {}\n", 0.5 * angle.cos(), 0.5 * angle.sin(), 0.5 * f64::from(ring));
        }
    }
    for ring in 0..along {
        for k in 0..around {
            let at = |ring: i32, k: i32| ring * around + k % around + 1;
            let [a, b, c, d] = [at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)];
            text += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
        }
    }
    folder.write("tube.obj", text);
    let transport = ["transport", "tube.obj", "-o", "t.ply", "--source-vertex", "0", "--json"];
    let carried = ndf(&folder.0, &[&transport[..], &["--angle", "0"]].concat()).json();
    assert!(carried["heat"]["time_step"].as_f64().unwrap() > 1.0);
    assert_eq!(carried["heat"]["out_of_reach"], 0);
    let height = carried["vector"][2].as_f64().unwrap();
    for vector in vectors(&folder, "t.ply", "transport") {
        let norm = vector.iter().map(|x| x * x).sum::<f64>();
        // Planes at the ends lean a little against the others.
        assert!((norm - 1.0).abs() < 1e-5 && (vector[2] - height).abs() < 0.05, "{vector:?}");
    }
    let map = ["logmap", "tube.obj", "-o", "l.ply", "--source-vertex", "0", "--method", "heat", "--json"];
    let mapped = ndf(&folder.0, &map).json();
    assert!(mapped["heat"]["time_step"].as_f64().unwrap() > 1.0);
    assert!((mapped["max_distance"].as_f64().unwrap() - 1000.0).abs() < 20.0, "{mapped}");
}
