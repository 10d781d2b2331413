//! What stands in place of the renderer: distances of tessellated faces from the input, in place and normal, and a
//! Laplacian.

use ndf_core::glam::Vec3;
use ndf_core::{DVec3, Hint};
use ndf_mesh::{ManifoldMesh, TriangleTree};
use rayon::prelude::*;

/// Weights of the distance of centres, of that of normals, and of the Laplacian, in the normalised box.
const DISTANCE: f64 = 20.0;
const NORMAL: f64 = 1.0;
const LAPLACIAN: f64 = 20.0;

/// The input, to be asked for closest points.
pub(crate) struct Target<'a> {
    mesh: &'a ManifoldMesh,
    tree: TriangleTree,
}

/// The closest point to the centre of a face, and its normal.
#[derive(Clone, Copy)]
struct Foot {
    point: DVec3,
    normal: DVec3,
}

impl<'a> Target<'a> {
    pub(crate) fn new(mesh: &'a ManifoldMesh) -> Self {
        Self { mesh, tree: TriangleTree::new(mesh) }
    }

    fn foot(&self, at: DVec3) -> Option<Foot> {
        let closest = self.tree.closest_point(at, Hint::NONE)?;
        Some(Foot { point: closest.point, normal: self.mesh.face_normal(closest.at.face) })
    }

    /// The loss of a tessellation with these places, and its gradient.
    pub(crate) fn loss(&self, places: &[Vec3], faces: &[[u32; 3]]) -> (f64, Vec<DVec3>) {
        let share = 1.0 / faces.len() as f64;
        let of_faces: Vec<(f64, [DVec3; 3])> =
            faces.par_iter().map(|f| self.of_face(f.map(|v| places[v as usize].as_dvec3()))).collect();
        let mut gradient = vec![DVec3::ZERO; places.len()];
        let mut loss = 0.0;
        for (corners, (of_face, by_corner)) in faces.iter().zip(of_faces) {
            loss += share * of_face;
            for (&v, g) in corners.iter().zip(by_corner) {
                gradient[v as usize] += share * g;
            }
        }
        loss += laplacian(places, faces, &mut gradient);
        (loss, gradient)
    }

    /// The loss of a face, and its gradient by the corners.
    fn of_face(&self, [a, b, c]: [DVec3; 3]) -> (f64, [DVec3; 3]) {
        let center = (a + b + c) / 3.0;
        let Some(foot) = self.foot(center) else { return (0.0, [DVec3::ZERO; 3]) };
        let signs =
            |v: DVec3| DVec3::from_array(v.to_array().map(|x| if x == 0.0 { 0.0 } else { x.signum() }));
        let away = center - foot.point;
        let mut loss = DISTANCE * away.abs().element_sum();
        let mut by_corner = [DISTANCE / 3.0 * signs(away); 3];
        let cross = (b - a).cross(c - a);
        if let Some(normal) = cross.try_normalize() {
            let other = normal - foot.normal;
            loss += NORMAL * other.abs().element_sum();
            let by_normal = NORMAL * signs(other);
            let by_cross = (by_normal - normal * normal.dot(by_normal)) / cross.length();
            let (by_b, by_c) = ((c - a).cross(by_cross), by_cross.cross(b - a));
            by_corner[0] -= by_b + by_c;
            by_corner[1] += by_b;
            by_corner[2] += by_c;
        }
        (loss, by_corner)
    }
}

/// Adds the gradient of the mean square of uniform Laplacians, over corners of faces, and returns it.
fn laplacian(places: &[Vec3], faces: &[[u32; 3]], gradient: &mut [DVec3]) -> f64 {
    let mut sums = vec![DVec3::ZERO; places.len()];
    let mut counts = vec![0.0; places.len()];
    for corners in faces {
        for k in 0..3 {
            let (v, next, last) = (corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]);
            sums[v as usize] += (places[next as usize] + places[last as usize]).as_dvec3();
            counts[v as usize] += 2.0;
        }
    }
    let share = LAPLACIAN / places.len() as f64;
    let mut loss = 0.0;
    // Differences from the mean of the neighbours.
    let differences: Vec<DVec3> =
        (0..places.len()).map(|v| places[v].as_dvec3() - sums[v] / counts[v]).collect();
    for (v, d) in differences.iter().enumerate() {
        loss += share * d.length_squared();
        gradient[v] += 2.0 * share * *d;
    }
    for corners in faces {
        for k in 0..3 {
            let v = corners[k] as usize;
            let back = 2.0 * share / counts[v] * differences[v];
            gradient[corners[(k + 1) % 3] as usize] -= back;
            gradient[corners[(k + 2) % 3] as usize] -= back;
        }
    }
    loss
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_mesh::shapes;

    /// The target is flat: feet are held while the gradient is taken, which L¹ distances from a curved one would show.
    #[test]
    fn gradients_agree_with_differences() {
        let flat = ManifoldMesh::try_from(shapes::grid(2, 2).map_positions(|p| 100.0 * (p - 0.5))).unwrap();
        let target = Target::new(&flat);
        let mesh = shapes::torus(7, 5, 0.8, 0.3);
        let places: Vec<Vec3> = mesh.positions().iter().map(|p| p.as_vec3()).collect();
        let (_, gradient) = target.loss(&places, mesh.faces());
        let h = 1e-3_f32;
        for v in (0..places.len()).step_by(3) {
            for k in 0..3 {
                let at = |h: f32| {
                    let mut moved = places.clone();
                    moved[v][k] += h;
                    target.loss(&moved, mesh.faces()).0
                };
                let slope = (at(h) - at(-h)) / (2.0 * f64::from(h));
                let found = gradient[v][k];
                assert!((slope - found).abs() < 0.02 * slope.abs().max(0.5), "{v} {k}: {slope} {found}");
            }
        }
    }
}
