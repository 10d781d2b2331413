//! The meshes of `reference.py`, by the same formulas. Tests of several crates include this file.

#![allow(dead_code, clippy::unwrap_used, reason = "tests, which need some of the meshes each")]

use std::f64::consts::TAU;

use ndf_core::DVec3;
use ndf_mesh::TriangleMesh;

/// What `reference.py` found.
pub(crate) fn reference() -> serde_json::Value {
    serde_json::from_str(include_str!("reference.json")).unwrap()
}

/// Numbers of an array of the reference.
pub(crate) fn numbers(value: &serde_json::Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// A closed surface with a wavy tube.
pub(crate) fn torus() -> TriangleMesh {
    let (m, n) = (48, 20);
    let positions = grid(m, n, |i, j| {
        let (u, v) = (TAU * i / f64::from(m), TAU * j / f64::from(n));
        let r = 0.4 * (1.0 + 0.3 * (3.0 * u + 2.0 * v).sin());
        DVec3::new((1.0 + r * v.cos()) * u.cos(), (1.0 + r * v.cos()) * u.sin(), r * v.sin())
    });
    TriangleMesh::new(positions, faces(m, n, |i, j| i % m + m * (j % n))).unwrap()
}

/// An open surface with long thin triangles.
pub(crate) fn sheet() -> TriangleMesh {
    let (m, n) = (40, 25);
    let positions = grid(m, n, |i, j| {
        let (x, y) = (i / f64::from(m - 1), j / f64::from(n - 1));
        DVec3::new(4.0 * x, y, 0.3 * (5.0 * x).sin() * (4.0 * y).cos())
    });
    TriangleMesh::new(positions, faces(m - 1, n - 1, |i, j| i + m * j)).unwrap()
}

/// The sheet with a fin along its middle, where three faces meet at every edge.
pub(crate) fn comb() -> TriangleMesh {
    let (mut positions, mut faces) = sheet().into_parts();
    let (m, n) = (40, 25);
    let (spine, fin) = (|i: u32| i + m * (n / 2), |i: u32| i + m * n);
    for i in 0..m {
        positions.push(positions[spine(i) as usize] + DVec3::new(0.0, 0.05, 0.3));
    }
    for i in 0..m - 1 {
        faces.push([spine(i), spine(i + 1), fin(i)]);
        faces.push([fin(i), spine(i + 1), fin(i + 1)]);
    }
    TriangleMesh::new(positions, faces).unwrap()
}

fn grid(m: u32, n: u32, point: impl Fn(f64, f64) -> DVec3) -> Vec<DVec3> {
    (0..m * n).map(|v| point(f64::from(v % m), f64::from(v / m))).collect()
}

fn faces(m: u32, n: u32, at: impl Fn(u32, u32) -> u32) -> Vec<[u32; 3]> {
    let quad = |q: u32| {
        let (i, j) = (q % m, q / m);
        [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
    };
    (0..m * n).flat_map(quad).collect()
}
