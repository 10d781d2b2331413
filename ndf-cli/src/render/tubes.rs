//! Lines in space as tubes, so that what draws meshes draws them with their light and shadows.

use ndf_mesh::io::Lines;
use ndf_mesh::{TriangleMesh, shapes};

/// Sides of a tube.
const SIDES: u32 = 8;

/// Radius of the balls at the ends of lines, in radii of tubes.
const BALL: f64 = 2.6;

/// A mesh with a tube for every segment and a ball at every end of a line, after its own vertices and faces.
pub fn with_tubes(mesh: TriangleMesh, lines: &Lines, radius: f64) -> TriangleMesh {
    let (mut positions, mut faces) = with_open_tubes(mesh, lines, radius).into_parts();
    let mut degrees = vec![0; lines.points.len()];
    lines.segments.iter().flatten().for_each(|&v| degrees[v as usize] += 1);
    let ball = shapes::icosphere(2);
    for (&center, _) in lines.points.iter().zip(&degrees).filter(|(_, degree)| **degree == 1) {
        let first = positions.len() as u32;
        positions.extend(ball.positions().iter().map(|&p| center + BALL * radius * p));
        faces.extend(ball.faces().iter().map(|face| face.map(|v| first + v)));
    }
    TriangleMesh::new(positions, faces).expect("corners are numbered as they come")
}

/// A mesh with a tube for every segment, after its own vertices and faces: for lines that are many and short.
pub fn with_open_tubes(mesh: TriangleMesh, lines: &Lines, radius: f64) -> TriangleMesh {
    let (mut positions, mut faces) = mesh.into_parts();
    for &[a, b] in &lines.segments {
        let [a, b] = [a, b].map(|v| lines.points[v as usize]);
        let Some(axis) = (b - a).try_normalize() else { continue };
        let (across, along) = axis.any_orthonormal_pair();
        let first = positions.len() as u32;
        for k in 0..SIDES {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(SIDES)).sin_cos();
            let out = radius * (cos * across + sin * along);
            // Neighbouring tubes reach into each other where the line bends.
            positions.extend([a - 0.5 * radius * axis + out, b + 0.5 * radius * axis + out]);
            let [here, next] = [k, (k + 1) % SIDES].map(|k| first + 2 * k);
            faces.extend([[here, next, next + 1], [here, next + 1, here + 1]]);
        }
    }
    TriangleMesh::new(positions, faces).expect("corners are numbered as they come")
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_core::DVec3;

    #[test]
    fn tubes_follow_their_line_outside_in() {
        let mesh = shapes::icosphere(1);
        let line: Vec<DVec3> =
            [[2.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 1.0, 0.0]].map(DVec3::from_array).into();
        let all = with_tubes(mesh.clone(), &Lines::from_polylines([&line[..]]), 0.01);
        assert_eq!(&all.faces()[..mesh.face_count()], mesh.faces());
        let balls = 2 * shapes::icosphere(2).face_count();
        assert_eq!(all.face_count(), mesh.face_count() + 2 * 16 + balls);
        // Two tubes of length 1 at least.
        let alone =
            TriangleMesh::new(all.positions().to_vec(), all.faces()[mesh.face_count()..].to_vec()).unwrap();
        assert!(alone.area() > 2.0 * 0.9 * std::f64::consts::TAU * 0.01);
        let corners = alone.face_indices().flat_map(|f| alone.corner_positions(f));
        let farthest = corners.fold(DVec3::NEG_INFINITY, DVec3::max);
        assert!(farthest.distance(DVec3::new(3.026, 1.026, 0.026)) < 1e-3, "{farthest}");
        for f in alone.face_indices().take(16) {
            let [p, _, _] = alone.corner_positions(f);
            assert!(alone.face_normal(f).dot(p - DVec3::new(p.x, 0.0, 0.0)) > 0.0);
        }
    }
}
