//! Matrices of the Laplacian, and modes that are held at boundaries.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use super::{Folder, ndf};

/// Entries of a matrix in Matrix Market's form, of which files hold the lower triangle.
fn matrix(path: &Path) -> (usize, HashMap<(usize, usize), f64>) {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("%%MatrixMarket matrix coordinate real symmetric"));
    let sizes: Vec<usize> = lines.next().unwrap().split(' ').map(|n| n.parse().unwrap()).collect();
    let entries = lines.map(|line| {
        let words: Vec<&str> = line.split(' ').collect();
        ((words[0].parse().unwrap(), words[1].parse().unwrap()), words[2].parse().unwrap())
    });
    let entries: HashMap<(usize, usize), f64> = entries.collect();
    assert_eq!((sizes[0], entries.len()), (sizes[1], sizes[2]));
    (sizes[0], entries)
}

#[test]
fn matrices_are_those_of_the_surface() {
    let folder = Folder::new("matrices");
    ndf(&folder.0, &["sample", "mesh", "--shape", "sphere", "--faces", "2000", "-o", "ball.ply", "--json"])
        .json();
    let told = ndf(
        &folder.0,
        &["laplacian", "ball.ply", "-o", "l.mtx", "--mass", "m.mtx", "--mesh", "b.ply", "--json"],
    )
    .json();
    let (rows, laplacian) = matrix(&folder.0.join("l.mtx"));
    let (_, mass) = matrix(&folder.0.join("m.mtx"));
    assert_eq!(told["vertices"], rows);
    assert_eq!(told["vertices_of_file"], true);
    let mut sums = vec![0.0; rows];
    for (&(i, j), value) in &laplacian {
        sums[i - 1] += value;
        if i != j {
            sums[j - 1] += value;
        }
    }
    assert!(sums.iter().all(|sum| sum.abs() < 1e-12));
    let area: f64 = mass.values().sum();
    assert!((area - told["area"].as_f64().unwrap()).abs() < 1e-9 * area, "{told}");
    // A zip archive, as SciPy expects it.
    ndf(&folder.0, &["laplacian", "ball.ply", "-o", "l.npz", "--masses", "consistent", "--json"]).json();
    assert_eq!(&fs::read(folder.0.join("l.npz")).unwrap()[..2], b"PK");

    let refused = ndf(&folder.0, &["laplacian", "ball.ply", "-o", "l.txt"]);
    assert_eq!(refused.code, 1);
    assert!(refused.stderr.contains("l.txt: matrices are written as .npz or .mtx"), "{}", refused.stderr);
    let refused = ndf(&folder.0, &["laplacian", "ball.ply", "-o", "l.npz", "--mass", "l.npz"]);
    assert_eq!(refused.code, 1);
}

#[test]
fn boundaries_are_held_where_that_is_asked() {
    let folder = Folder::new("held");
    // A unit square of 20 × 20 cells.
    let mut text = String::new();
    for i in 0..=20 {
        (0..=20).for_each(|j| text += &format!("v {} {} 0\n", f64::from(i) / 20.0, f64::from(j) / 20.0));
    }
    for i in 0..20 {
        for j in 0..20 {
            let v = 21 * i + j + 1;
            text += &format!("f {v} {} {}\nf {v} {} {}\n", v + 21, v + 22, v + 22, v + 1);
        }
    }
    fs::write(folder.0.join("square.obj"), text).unwrap();
    let first = |boundary: &str| {
        let arguments =
            ["spectrum", "square.obj", "-o", "m.ply", "--modes", "2", "--boundary", boundary, "--json"];
        let told = ndf(&folder.0, &arguments).json();
        [0, 1].map(|i| told["eigenvalues"][i].as_f64().unwrap() / std::f64::consts::PI.powi(2))
    };
    let ([zero, one], [two, five]) = (first("neumann"), first("dirichlet"));
    assert!(zero.abs() < 1e-9 && (one - 1.0).abs() < 0.01, "{zero} {one}");
    assert!((two - 2.0).abs() < 0.02 && (five - 5.0).abs() < 0.1, "{two} {five}");
    let arguments = ["spectrum", "square.obj", "-o", "m.ply", "--modes", "2", "--multigrid", "--json"];
    let told = ndf(&folder.0, &arguments).json();
    let again = told["eigenvalues"][1].as_f64().unwrap() / std::f64::consts::PI.powi(2);
    assert!((again / one - 1.0).abs() < 1e-9 && told["verified"] == false, "{again} {one}");
}
