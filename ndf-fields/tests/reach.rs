//! Heat that comes to an end before the surface does.

#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;

use ndf_core::{DVec3, NoProgress};
use ndf_fields::{Complex64, SignedHeatOptions, VectorHeatSolver, signed_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{ManifoldMesh, SurfacePoint, TriangleMesh, Vertex};

const AROUND: u32 = 8;

/// A tube around the z axis of radius 1, 1 / 1.2 edges a unit long.
fn tube(length: u32) -> ManifoldMesh {
    let at = |ring: u32, k: u32| ring * AROUND + k % AROUND;
    let position = |v: u32| {
        let angle = TAU * f64::from(v % AROUND) / f64::from(AROUND);
        DVec3::new(angle.cos(), angle.sin(), 0.6 * f64::from(v / AROUND))
    };
    let positions = (0..(length + 1) * AROUND).map(position).collect();
    let mut faces = Vec::new();
    for ring in 0..length {
        for k in 0..AROUND {
            let [a, b, c, d] = [at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)];
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    ManifoldMesh::try_from(TriangleMesh::new(positions, faces).unwrap()).unwrap()
}

#[test]
fn vertices_that_heat_does_not_reach_are_counted_until_a_larger_time_reaches_them() {
    let mesh = IntrinsicMesh::from_mesh(&tube(1800));
    let source = (Vertex(3), Complex64::cis(0.4));
    let counts = [1.0, 16.0].map(|time| {
        let solver = VectorHeatSolver::with_time(&mesh, time).unwrap();
        let carried = solver.transport(&[source]).unwrap();
        let extended = solver.extend(&[(Vertex(3), 7.0)]).unwrap();
        assert_eq!(carried.out_of_reach, extended.out_of_reach);
        let map = solver.log_map(Vertex(3)).unwrap();
        if time > 1.0 {
            assert!(carried.values.iter().all(|z| (z.norm() - 1.0).abs() < 1e-6));
            assert!(extended.values.iter().all(|x| (x - 7.0).abs() < 1e-6));
        }
        [carried.out_of_reach, map.out_of_reach]
    });
    // What is lost is at the far end.
    assert!(counts[0].iter().all(|lost| (1000..mesh.vertex_count() * 2 / 3).contains(lost)), "{counts:?}");
    assert_eq!(counts[1], [0, 0]);
}

#[test]
fn normals_of_curves_reach_as_far_as_their_time() {
    let tube = tube(1800);
    let mesh = IntrinsicMesh::from_mesh(&tube);
    // Around the beginning, the tube on the right.
    let ring: Vec<SurfacePoint> =
        (0..=AROUND).rev().map(|k| SurfacePoint::Vertex(Vertex(k % AROUND))).collect();
    let found = [0.25, 16.0].map(|time| {
        let options = SignedHeatOptions { time, ..SignedHeatOptions::default() };
        signed_distances(&mesh, std::slice::from_ref(&ring), &[], &options, &NoProgress).unwrap()
    });
    assert!(found[0].out_of_reach > 1000, "{}", found[0].out_of_reach);
    assert_eq!(found[1].out_of_reach, 0);
    for (p, d) in tube.positions().iter().zip(&found[1].values) {
        assert!((d - p.z).abs() < 1e-3 * (1.0 + p.z), "{p} {d}");
    }
}
