//! Agreement with SciPy's `eigsh`: always on meshes made by formulas, with the values of `peers/reference.json`, and on real
//! meshes where there are some. Without the folder `$NDF_DATA` (by default `../shared/data` beside the workspace) that
//! test says so and passes.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

#[path = "../../peers/meshes.rs"]
mod meshes;

use std::path::{Path, PathBuf};

use ndf_core::progress::NoProgress;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{ManifoldMesh, io};
use ndf_mesh::{TriangleMesh, repair};
use ndf_spectral::{LaplaceBeltrami, Mass, MetricTriangles, ModeOptions, Modes, OperatorOptions};

fn data() -> PathBuf {
    match std::env::var_os("NDF_DATA") {
        Some(folder) => PathBuf::from(folder),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"),
    }
}

/// The mesh of a file as the reference has it: STL welded by exact position.
fn read(path: &Path) -> TriangleMesh {
    let mesh = io::read_mesh(path).unwrap().mesh;
    let stl = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("stl"));
    if stl { repair::welded(&mesh, 0.0) } else { mesh }
}

/// The plain operator of a mesh, manifold or not, without mollification.
fn plain_operator(mesh: &TriangleMesh) -> LaplaceBeltrami {
    let triangles = match ManifoldMesh::try_from(mesh.clone()) {
        Ok(mesh) => MetricTriangles::from(&IntrinsicMesh::from_mesh(&mesh)),
        Err(_) => {
            let length = |a: u32, b: u32| mesh.positions()[a as usize].distance(mesh.positions()[b as usize]);
            let sides = mesh.faces().iter().map(|&[a, b, c]| [length(a, b), length(b, c), length(c, a)]);
            MetricTriangles::new(mesh.vertex_count(), mesh.faces().to_vec(), sides.collect())
        }
    };
    LaplaceBeltrami::from_lengths(&triangles, Mass::Barycentric).unwrap()
}

/// The difference of the first modes of an operator from expected eigenvalues, relative to each; the kernel is compared
/// on the scale of the first eigenvalue above it.
fn difference(operator: &LaplaceBeltrami, expected: &[f64]) -> (f64, Modes) {
    let options = ModeOptions { count: expected.len(), ..ModeOptions::default() };
    let modes = operator.modes(&options, &NoProgress).unwrap();
    let scale = modes.eigenvalues.iter().copied().find(|&x| x > 0.0).unwrap();
    let error = |(a, b): (&f64, &f64)| (a - b).abs() / b.abs().max(scale);
    (modes.eigenvalues.iter().zip(expected).map(error).fold(0.0, f64::max), modes)
}

#[test]
fn eigenvalues_agree_on_meshes_made_by_formulas() {
    let reference = meshes::reference();
    for (name, mesh) in [("torus", meshes::torus()), ("sheet", meshes::sheet()), ("comb", meshes::comb())] {
        let entry = &reference[name];
        assert_eq!(mesh.vertex_count() as u64, entry["vertices"].as_u64().unwrap(), "{name}");
        let options = OperatorOptions::default();
        let mut operators = vec![
            ("plain", plain_operator(&mesh)),
            ("tufted", LaplaceBeltrami::from_triangle_mesh(&mesh, options).unwrap()),
        ];
        if name == "torus" {
            // A closed manifold has the Delaunay triangulation of its cover.
            let mesh = IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(mesh).unwrap());
            operators.push(("tufted", LaplaceBeltrami::new(&mesh, options).unwrap()));
        }
        for (kind, operator) in operators {
            let (error, modes) = difference(&operator, &meshes::numbers(&entry[kind]));
            println!("{name} {kind}: differs by {error:.1e}");
            assert!(modes.verified && error <= 1e-10, "{name} {kind}: {error:e}");
        }
    }
}

#[test]
fn eigenvalues_agree_with_scipy() {
    let folder = data();
    let reference = folder.join("../peers/reference.json");
    let Ok(reference) = std::fs::read_to_string(&reference) else {
        println!("skipped: no reference values at {}", reference.display());
        return;
    };
    let reference: serde_json::Map<String, serde_json::Value> = serde_json::from_str(&reference).unwrap();
    let mut worst = Vec::new();
    for (name, values) in &reference {
        let path = folder.join("mesh").join(name);
        let Some(expected) = values["eigenvalues"].as_array() else { continue };
        if !path.exists() {
            println!("skipped: {} is missing", path.display());
            continue;
        }
        let expected: Vec<f64> = expected.iter().map(|x| x.as_f64().unwrap()).collect();
        let mesh = read(&path);
        assert_eq!(mesh.vertex_count() as u64, values["vertices"].as_u64().unwrap(), "{name}");
        let (error, modes) = difference(&plain_operator(&mesh), &expected);
        println!(
            "{name}: differs by {error:.1e}, residual {:.1e}, verified {}",
            modes.max_residual(),
            modes.verified
        );
        worst.push((error, modes.max_residual(), modes.verified, name));
    }
    for (error, residual, verified, name) in worst {
        assert!(error <= 1e-8, "{name}: {error:e}");
        assert!(residual <= 1e-8, "{name}: residual {residual:e}");
        assert!(verified, "{name}");
    }
}
