//! Meshes of several parts, with seams, loose vertices, cracks and one side: nothing of them disappears silently, and the
//! vertices of a file keep their numbers.

use ndf_core::DVec3;
use ndf_mesh::io::{MeshFile, read_mesh, write_mesh};
use ndf_mesh::{TriangleMesh, shapes};

use super::{Folder, Run, ndf};

impl Folder {
    fn write_mesh(&self, name: &str, mesh: &TriangleMesh) {
        write_mesh(self.0.join(name), mesh, &[]).unwrap();
    }

    fn mesh(&self, name: &str) -> MeshFile {
        read_mesh(self.0.join(name)).unwrap()
    }

    fn run(&self, command: &str) -> Run {
        ndf(&self.0, &command.split_whitespace().collect::<Vec<_>>())
    }
}

/// Spheres: centre on the x-axis, radius, whether outward.
fn spheres(all: &[(f64, f64, bool)]) -> TriangleMesh {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for &(x, radius, outward) in all {
        let (p, f) = shapes::icosphere(3).into_parts();
        let first = positions.len() as u32;
        positions.extend(p.into_iter().map(|p| radius * p + x * DVec3::X));
        let face = |[a, b, c]: [u32; 3]| if outward { [a, b, c] } else { [a, c, b] };
        faces.extend(f.into_iter().map(|f| face(f).map(|v| v + first)));
    }
    TriangleMesh::new(positions, faces).unwrap()
}

/// The mesh after a vertex that no face uses.
fn after_a_loose_vertex(mesh: &TriangleMesh) -> TriangleMesh {
    let positions = [&[DVec3::splat(9.0)], mesh.positions()].concat();
    TriangleMesh::new(positions, mesh.faces().iter().map(|f| f.map(|v| v + 1)).collect()).unwrap()
}

/// Every face with vertices of its own.
fn soup(mesh: &TriangleMesh) -> TriangleMesh {
    let positions = mesh.face_indices().flat_map(|f| mesh.corner_positions(f)).collect();
    let faces = (0..mesh.face_count() as u32).map(|f| [0, 1, 2].map(|c| 3 * f + c)).collect();
    TriangleMesh::new(positions, faces).unwrap()
}

#[test]
fn loose_vertices_change_no_number() {
    let folder = Folder::new("loose");
    folder.write_mesh("a.obj", &after_a_loose_vertex(&shapes::grid(10, 1)));
    let found = folder.run("geodesic a.obj -o d.ply --source-vertex 1 --json").json();
    assert_eq!((&found["vertices"], &found["unreached"]), (&23.into(), &0.into()));
    assert_eq!(found["unused_vertices"], serde_json::json!([0]));
    let distances = &folder.mesh("d.ply").scalars[0].values;
    assert!(distances[0].is_infinite() && distances[1] == 0.0 && distances[22] > 1.0);
    assert_eq!(folder.run("geodesic a.obj -o d.ply --source-vertex 22 --json").json()["unreached"], 0);
    let refused = folder.run("geodesic a.obj -o e.ply --source-vertex 0");
    assert!(refused.sentence().contains("vertex 0 is on no face"), "{}", refused.stderr);
    assert!(!folder.0.join("e.ply").exists());

    // What is written can be learned on a model.
    folder.run("spectrum a.obj -o m.ply --modes 3 --json").json();
    let modes = &folder.mesh("m.ply").scalars;
    assert!(
        modes.iter().all(|mode| mode.values[0].is_nan() && mode.values[1..].iter().all(|x| x.is_finite()))
    );
    folder.run("fit a.obj -o a.ndf --time-limit 2 --json").json();
    folder.run("scalars fit a.ndf d.ply -o b.ndf --json").json();
}

#[test]
fn loose_vertices_change_no_component() {
    let folder = Folder::new("components");
    let two = spheres(&[(0.0, 1.0, true), (3.0, 0.5, true)]);
    folder.write_mesh("two.obj", &two);
    folder.write_mesh("loose.obj", &after_a_loose_vertex(&two));
    let figures = ["two.obj", "loose.obj"].map(|name| {
        let distances = folder.run(&format!("geodesic {name} -o o.ply --source 3.5,0,0 --json")).json();
        let modes = folder.run(&format!("spectrum {name} -o o.ply --modes 4 --json")).json();
        assert!(modes["eigenvalues"][1].as_f64().unwrap() < 1e-9, "two zeros");
        [distances["max_distance"].clone(), distances["unreached"].clone(), modes["eigenvalues"].clone()]
    });
    assert_eq!(figures[0], figures[1]);
    assert_eq!(figures[0][1], 642);
    // A source off the surface is named; nothing is said of one on it.
    let off = folder.run("geodesic two.obj -o o.ply --source 5,0,0");
    assert!(off.stderr.contains("(5, 0, 0) is 1.500 away"), "{}", off.stderr);
    assert_eq!(folder.run("geodesic two.obj -o o.ply --source 3.5,0,0").stderr, "");
    let no_path = folder.run("geodesic two.obj -o o.ply --source 3.5,0,0 --path-to -1,0,0");
    assert!(no_path.sentence().contains("another component"), "{}", no_path.stderr);
    let largest = folder.run("geodesic two.obj -o o.ply --source -1,0,0 --largest-component --json").json();
    assert!((largest["area_left_out"].as_f64().unwrap() - 0.2).abs() < 1e-9);
}

#[test]
fn seams_are_joined_unless_they_are_to_stay() {
    let folder = Folder::new("seams");
    folder.write_mesh("soup.obj", &soup(&shapes::icosphere(2)));
    let found = folder.run("geodesic soup.obj -o d.ply --source-vertex 0 --json");
    assert!(found.stderr.contains("--keep-seams"), "{}", found.stderr);
    let found = found.json();
    assert_eq!((&found["vertices"], &found["unreached"]), (&960.into(), &0.into()));
    let modes = folder.run("spectrum soup.obj -o d.ply --modes 4 --json").json();
    let values: Vec<f64> =
        modes["eigenvalues"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
    assert!(values[0] < 1e-9 && values[1..].iter().all(|x| (x - 2.0).abs() < 0.02), "{values:?}");
    let apart = folder.run("geodesic soup.obj -o d.ply --source-vertex 0 --keep-seams --json").json();
    assert_eq!(apart["unreached"], 957);
}

#[test]
fn meshes_of_one_side_are_measured_and_not_learned() {
    let folder = Folder::new("one-side");
    folder.write_mesh("m.obj", &shapes::moebius_strip(60, 4));
    assert_eq!(folder.run("geodesic m.obj -o d.ply --source-vertex 0 --json").json()["unreached"], 0);
    assert_eq!(folder.run("info m.obj --json").json()["orientable"], false);
    for command in ["fit m.obj -o m.ndf", "mesh m.obj -o m.ply"] {
        let refused = folder.run(command);
        assert!(refused.sentence().contains("cannot be oriented"), "{}", refused.stderr);
    }
}

#[test]
fn cavities_and_components_are_meshed_and_learned() {
    let folder = Folder::new("cavities");
    let ball = 4.0 / 3.0 * std::f64::consts::PI;
    for (name, all, volume) in [
        ("hollow", [(0.0, 1.0, true), (0.0, 0.8, false)], ball * (1.0 - 0.512)),
        ("two", [(0.0, 1.0, true), (3.0, 0.9, true)], ball * 1.729),
    ] {
        folder.write_mesh("in.obj", &spheres(&all));
        for command in [
            "mesh in.obj -o out.ply --grid 48 --json",
            "fit in.obj -o out.ndf --size 3000 --time-limit 5 --json",
            "extract out.ndf -o out.ply --relative-edge-length 0.1 --json",
        ] {
            let found = folder.run(command).json();
            assert_eq!(found["components"], 2, "{name}: {command}");
            if !command.starts_with("fit") {
                let found = folder.mesh("out.ply").mesh.signed_volume();
                assert!(
                    (found / volume - 1.0).abs() < 0.05,
                    "{name}: {command}: {found} instead of {volume}"
                );
            }
        }
    }
    let largest = folder.run("mesh in.obj -o out.ply --grid 24 --largest-component --json");
    assert!(largest.stderr.contains("44.8 % of the area"), "{}", largest.stderr);
    assert_eq!(largest.json()["components"], 1);
}

#[test]
fn inner_walls_do_not_depend_on_the_grid() {
    let folder = Folder::new("walls");
    for (name, walls) in
        [("one", [0.0].as_slice()), ("three", &[-0.5, 0.0, 0.5]), ("close", &[-0.02, 0.0, 0.03])]
    {
        let (mut positions, mut faces) = shapes::cube(1).into_parts();
        for x in walls {
            let first = positions.len() as u32;
            let wall = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            positions.extend(wall.map(|(y, z)| DVec3::new(*x, y, z)));
            faces.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
        folder.write_mesh("walls.obj", &TriangleMesh::new(positions, faces).unwrap());
        for grid in [15, 16, 31, 32] {
            let run = folder.run(&format!("mesh walls.obj -o o.ply --grid {grid} --json"));
            assert!(run.stderr.contains("inside of the solid that it bounds"), "{}", run.stderr);
            let found = run.json();
            let topology = (&found["components"], &found["euler_characteristic"]);
            assert_eq!(topology, (&1.into(), &2.into()), "{name}, {grid}");
            assert!((folder.mesh("o.ply").mesh.signed_volume() - 8.0).abs() < 0.3, "{name}, {grid}");
        }
    }
}

#[test]
fn what_a_coarse_grid_loses_is_an_error() {
    let folder = Folder::new("coarse");
    // A ball, and a plate that falls between the points of a coarse grid.
    let (mut positions, mut faces) = spheres(&[(0.0, 1.0, true)]).into_parts();
    let (plate, sides) = shapes::cube(4).into_parts();
    let first = positions.len() as u32;
    positions.extend(plate.into_iter().map(|p| DVec3::new(3.0 + p.x, p.y, 0.0131 + 0.004 * p.z)));
    faces.extend(sides.into_iter().map(|f| f.map(|v| v + first)));
    folder.write_mesh("in.obj", &TriangleMesh::new(positions, faces).unwrap());
    let refused = folder.run("mesh in.obj -o out.ply --grid 16");
    let sentence = refused.sentence();
    assert!(
        sentence.contains("of the area would be left out") && sentence.contains("finer grid"),
        "{sentence}"
    );
    let allowed = folder.run("mesh in.obj -o out.ply --grid 16 --largest-component --json").json();
    assert_eq!(allowed["components"], 1);
}

/// A plate that is thinner than the cells, and lies across them.
#[test]
fn what_falls_apart_on_a_grid_is_told() {
    let folder = Folder::new("apart");
    let (sine, cosine) = 0.3_f64.sin_cos();
    let plate = shapes::cube(8).map_positions(|p| {
        let p = DVec3::new(2.0 * p.x, p.y, 0.01 * p.z);
        DVec3::new(cosine * p.x - sine * p.z, p.y, sine * p.x + cosine * p.z)
    });
    folder.write_mesh("plate.obj", &plate);
    let coarse = folder.run("mesh plate.obj -o out.ply --grid 100 --json");
    assert!(
        coarse.json()["components"].as_u64().unwrap() > 1 && coarse.stderr.contains("falls apart"),
        "{}",
        coarse.stderr
    );
    let fine = folder.run("mesh plate.obj -o out.ply --grid 512 --json");
    assert!(fine.json()["components"] == 1 && !fine.stderr.contains("falls apart"), "{}", fine.stderr);
}

#[test]
fn points_far_from_all_others_are_left_out_with_a_note() {
    let folder = Folder::new("stray");
    let ball = shapes::icosphere(4);
    let row = |p: &DVec3| format!("{} {} {} {} {} {}\n", p.x, p.y, p.z, p.x, p.y, p.z);
    let points: String = ball.positions().iter().map(row).collect();
    std::fs::write(folder.0.join("scan.xyz"), points + "900 0 0 1 0 0\n").unwrap();
    let run = folder.run("mesh scan.xyz -o out.ply --grid 24 --json");
    assert!(run.stderr.contains("1 point is far from all others, and left out"), "{}", run.stderr);
    run.json();
    let volume = folder.mesh("out.ply").mesh.signed_volume();
    assert!((volume / (4.0 / 3.0 * std::f64::consts::PI) - 1.0).abs() < 0.03, "{volume}");
}

#[test]
fn sizes_beyond_double_precision_are_refused() {
    let folder = Folder::new("sizes");
    for scale in [1e-300, 1e-160, 1e-100, 1e100, 1e200] {
        folder.write_mesh("ball.obj", &shapes::icosphere(1).map_positions(|p| scale * p));
        for command in
            ["geodesic ball.obj -o o.ply --source-vertex 0", "spectrum ball.obj -o o.ply --modes 3"]
        {
            let refused = folder.run(command);
            assert!(refused.sentence().contains("scale them"), "{scale}: {}", refused.stderr);
        }
        let info = folder.run("info ball.obj --json");
        assert_eq!(info.stderr.contains("vertex 0 lies beyond 1e75"), scale > 1.0, "{}", info.stderr);
    }
    for scale in [1e-70, 1e70] {
        folder.write_mesh("ball.obj", &shapes::icosphere(1).map_positions(|p| scale * p));
        let found = folder.run("geodesic ball.obj -o o.ply --source-vertex 0 --json").json();
        let farthest = found["max_distance"].as_f64().unwrap() / scale;
        assert!((2.8..3.2).contains(&farthest), "{farthest}");
    }
}

#[test]
fn options_for_other_inputs_are_named() {
    let folder = Folder::new("options");
    folder.write_mesh("ball.obj", &shapes::icosphere(2));
    for (options, said) in [
        ("--columns x,y,z", "--columns"),
        ("--keep-flagged", "--keep-flagged"),
        ("--activation relu", "--activation"),
    ] {
        let run = folder.run(&format!("info ball.obj {options} --json"));
        assert!(run.stderr.contains(said) && run.stderr.contains("not used"), "{}", run.stderr);
        assert_eq!(run.json()["kind"], "mesh");
    }
}

/// Two half spheres whose rims have different corners.
fn cracked(upper: u32, lower: u32) -> TriangleMesh {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for (around, side) in [(upper, 1.0), (lower, -1.0)] {
        let (first, rings) = (positions.len() as u32, 9);
        for i in 0..rings {
            let latitude = std::f64::consts::FRAC_PI_2 * f64::from(i) / f64::from(rings);
            for j in 0..around {
                let longitude = std::f64::consts::TAU * f64::from(j) / f64::from(around);
                let ring = latitude.cos() * DVec3::new(longitude.cos(), side * longitude.sin(), 0.0);
                positions.push(ring + DVec3::Z * side * latitude.sin());
            }
        }
        positions.push(DVec3::Z * side);
        let at = |i: u32, j: u32| first + i * around + j % around;
        for j in 0..around {
            for i in 0..rings - 1 {
                faces.extend([
                    [at(i, j), at(i, j + 1), at(i + 1, j + 1)],
                    [at(i, j), at(i + 1, j + 1), at(i + 1, j)],
                ]);
            }
            faces.push([at(rings - 1, j), at(rings - 1, j + 1), first + rings * around]);
        }
    }
    TriangleMesh::new(positions, faces).unwrap()
}

#[test]
fn cracked_solids_are_learned_whole() {
    let folder = Folder::new("cracks");
    folder.write_mesh("cracked.obj", &cracked(36, 40));
    let meshed = folder.run("mesh cracked.obj -o o.ply --grid 32 --json").json();
    assert_eq!((&meshed["components"], &meshed["boundary_edges"]), (&1.into(), &0.into()));
    let fitted = folder.run("fit cracked.obj -o o.ndf --base-faces 500 --size 3000 --time-limit 5 --json");
    assert!(fitted.stderr.contains("2 pieces with borders side by side"), "{}", fitted.stderr);
    let fitted = fitted.json();
    assert_eq!(fitted["components"], 1);
    assert!(fitted["area_left_out"].as_f64().unwrap() < 0.01);
    folder.run("extract o.ndf -o o.ply --relative-edge-length 0.1 --json").json();
    let measured = folder.run("measure cracked.obj o.ply --json").json();
    assert!(measured["hausdorff"].as_f64().unwrap() < 0.05, "{}", measured["hausdorff"]);
}

#[test]
fn refusals_say_what_the_file_is_and_what_to_do() {
    let folder = Folder::new("refusals");
    let points: String =
        shapes::icosphere(2).positions().iter().map(|p| format!("{} {} {}\n", p.x, p.y, p.z)).collect();
    folder.write("cloud.xyz", points);
    folder.write_mesh("mesh.obj", &shapes::icosphere(0));
    folder.write_mesh("thin.obj", &shapes::cube(1).map_positions(|p| DVec3::new(p.x, p.y, 0.02 * p.z)));
    folder.write("point.obj", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n");
    for (command, words) in [
        (
            "measure cloud.xyz mesh.obj",
            "cloud.xyz is a point cloud, and a mesh is needed here; `ndf mesh` makes one of it",
        ),
        (
            "geodesic cloud.xyz -o x.ply --source-vertex 0",
            "is a point cloud, and --source-vertex counts the vertices",
        ),
        (
            "extract cloud.xyz -o x.ply --edge-length 1",
            "cloud.xyz is a point cloud, not an .ndf model; `ndf fit`",
        ),
        ("extract mesh.obj -o x.ply --edge-length 1", "mesh.obj is a mesh, not an .ndf model"),
        ("spectrum mesh.obj -o x.ply --modes 13", "ask for at most 12"),
        ("spectrum point.obj -o x.ply --modes 3", "has no area"),
        ("mesh thin.obj -o x.ply --grid 16", "--grid 64"),
    ] {
        let refused = folder.run(command);
        assert!(refused.sentence().contains(words), "{command}: {}", refused.stderr);
    }
}
