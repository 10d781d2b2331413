use ndf_core::{DVec3, NoProgress, Surface};
use ndf_mesh::shapes;
use ndf_mesh::{ManifoldMesh, ValidationReport};

use super::*;
use crate::decimation::{DecimationOptions, decimate};
use crate::triangle_shape::smallest_angles;
use ndf_core::analytic::{Sphere, Torus};

fn coarse(shape: ndf_mesh::TriangleMesh, faces: usize) -> ManifoldMesh {
    let fine = ManifoldMesh::try_from(shape).unwrap();
    decimate(&fine, &DecimationOptions::to_faces(faces), &NoProgress).mesh
}

fn check(mesh: &ManifoldMesh, surface: &dyn Surface) {
    let improved =
        improve(mesh, Some(&Target { surface, points: &[] }), &FinalPassOptions::default(), &NoProgress);
    let [before, after] = improved.distance.unwrap();
    assert!(after <= before, "{before} → {after}");
    let report = ValidationReport::of(&improved.mesh);
    assert_eq!(report.degenerate_faces.count, 0);
    assert_eq!(improved.mesh.face_count(), mesh.face_count());
    assert_eq!(improved.mesh.topology().euler_characteristic(), mesh.topology().euler_characteristic());
    assert_eq!(improved.mesh.topology().boundary_edge_count(), mesh.topology().boundary_edge_count());
    let (old, new) = (smallest_angles(mesh), smallest_angles(&improved.mesh));
    let low = |angles: &[f64]| angles[angles.len() / 50].to_degrees();
    assert!(low(&new) >= low(&old), "{} → {}", low(&old), low(&new));
}

#[test]
fn spheres_and_tori_get_better_shaped_and_closer() {
    check(&coarse(shapes::icosphere(5), 600), &Sphere::UNIT);
    check(
        &coarse(shapes::torus(120, 60, 1.0, 0.4), 700),
        &Torus { center: DVec3::ZERO, ring: 1.0, tube: 0.4 },
    );
}

#[test]
fn a_bad_triangulation_of_a_sphere_is_mended() {
    // Squeezed along a parameter: needles everywhere.
    let squeezed = shapes::icosphere(3).map_positions(|p| {
        let z = p.z.signum() * p.z.abs().powf(0.4);
        let r = (1.0 - z * z).max(0.0).sqrt() / p.truncate().length().max(1e-12);
        DVec3::new(p.x * r, p.y * r, z)
    });
    check(&ManifoldMesh::try_from(squeezed).unwrap(), &Sphere::UNIT);
}

#[test]
fn flat_flips_need_no_surface() {
    let sheared = shapes::grid(8, 8).map_positions(|p| p + DVec3::X * 2.0 * p.y);
    let mesh = ManifoldMesh::try_from(sheared).unwrap();
    let improved = improve(&mesh, None, &FinalPassOptions::default(), &NoProgress);
    assert!(improved.flips > 10);
    assert!(improved.distance.is_none());
    assert!((improved.mesh.area() - 1.0).abs() < 1e-12);
    let middle = |m: &ManifoldMesh| smallest_angles(m)[m.face_count() / 2];
    assert!(middle(&improved.mesh) > middle(&mesh));
}
