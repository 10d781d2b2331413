//! Which way up a shape is, where nothing says so.
//!
//! Files do not tell: graphics and scans of single objects mostly have y up, CAD, captured scenes and surveys z. What is
//! upright stands: near its lowest points it touches the ground in several places, around its centre. So the shape
//! keeps the axis that is usual for its kind, unless it stands on the other and not on this one. (Fu et al. 2008 learn the
//! upright orientation of man-made objects from such supports; with two candidates none needs to be learned.)

use ndf_core::{BoundingBox, DVec3};
use ndf_mesh::TriangleMesh;

use super::Up;

/// The share of the height in which the lowest points are.
const GROUND: f64 = 0.02;

/// The least support, as a share of the footprint, of what stands.
const STANDING: f64 = 0.15;

/// How many times the support of the usual axis the other must have.
const CLEARLY: f64 = 2.0;

/// The y or the z axis: the usual one, unless the mesh stands on the other only. O(n log n).
pub fn upright(mesh: &TriangleMesh, usual: Up) -> Up {
    let (usual_axis, other_axis, other) = match usual {
        Up::Z => (2, 1, Up::Y),
        _ => (1, 2, Up::Z),
    };
    let support = |axis| support(mesh, axis);
    let is_clear = support(other_axis) > f64::max(STANDING, CLEARLY * support(usual_axis));
    if is_clear { other } else { usual }
}

/// The area of the convex hull of the lowest points along an axis, as a share of the box of the shape from above; 0 if the
/// centre of the surface is not above it.
fn support(mesh: &TriangleMesh, axis: usize) -> f64 {
    let used = mesh.faces().iter().flatten().map(|&v| mesh.positions()[v as usize]);
    let points: Vec<DVec3> = used.filter(|p| p.is_finite()).collect();
    let bounds = BoundingBox::of_points(&points);
    if points.is_empty() {
        return 0.0;
    }
    let from_above = |p: DVec3| [p[(axis + 1) % 3], p[(axis + 2) % 3]];
    let extent = bounds.extent();
    let ground = bounds.min[axis] + GROUND * extent[axis];
    let low = points.iter().filter(|p| p[axis] <= ground).map(|&p| from_above(p)).collect();
    let hull = convex_hull(low);
    let [width, depth] = from_above(extent);
    if !contains(&hull, from_above(center(mesh))) {
        return 0.0;
    }
    area(&hull) / (width * depth)
}

/// The centre of the surface by area.
fn center(mesh: &TriangleMesh) -> DVec3 {
    let (mut sum, mut total) = (DVec3::ZERO, 0.0);
    for f in mesh.face_indices() {
        let [a, b, c] = mesh.corner_positions(f);
        let area = mesh.face_cross(f).length();
        if area.is_finite() {
            sum += area * (a + b + c) / 3.0;
            total += area;
        }
    }
    sum / total
}

fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// The corners of the convex hull, counterclockwise (Andrew's monotone chain).
fn convex_hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..]
                && turn(a, b, p) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut hull = chain(&mut points.iter().copied());
    hull.extend(chain(&mut points.iter().rev().copied()));
    hull
}

fn edges(hull: &[[f64; 2]]) -> impl Iterator<Item = ([f64; 2], [f64; 2])> {
    hull.iter().copied().zip(hull.iter().copied().cycle().skip(1))
}

fn contains(hull: &[[f64; 2]], p: [f64; 2]) -> bool {
    hull.len() > 2 && edges(hull).all(|(a, b)| turn(a, b, p) >= 0.0)
}

fn area(hull: &[[f64; 2]]) -> f64 {
    0.5 * edges(hull).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_mesh::shapes;

    /// A cone on its base, along an axis.
    fn cone(axis: usize) -> TriangleMesh {
        let mesh = shapes::icosphere(4);
        let faces = mesh.faces().to_vec();
        let positions = mesh.positions().iter().map(|p| {
            let height = p.z.max(-0.5);
            let around = p.truncate() * (1.0 - height);
            let cone = DVec3::new(around.x, around.y, height);
            DVec3::from_array([0, 1, 2].map(|k| cone[(k + 5 - axis) % 3]))
        });
        TriangleMesh::new(positions.collect(), faces).unwrap()
    }

    #[test]
    fn what_stands_on_one_axis_alone_has_that_axis_up() {
        for usual in [Up::Y, Up::Z] {
            assert_eq!(upright(&cone(2), usual), Up::Z);
            assert_eq!(upright(&cone(1), usual), Up::Y);
            // Both axes are alike, or neither has a ground.
            assert_eq!(upright(&shapes::cube(3), usual), usual);
            assert_eq!(upright(&shapes::icosphere(3), usual), usual);
            let nothing = TriangleMesh::new(vec![DVec3::NAN; 3], vec![[0, 1, 2]]).unwrap();
            assert_eq!(upright(&nothing, usual), usual);
        }
    }
}
