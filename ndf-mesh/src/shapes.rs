//! Meshes made by formula: fixtures of the tests and the built-in shapes of the program.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use ndf_core::DVec3;

use super::TriangleMesh;

/// A unit sphere: an icosahedron subdivided `levels` times; 20·4^levels faces, vertices on the sphere.
pub fn icosphere(levels: u32) -> TriangleMesh {
    let g = f64::midpoint(1.0, 5.0_f64.sqrt());
    let mut positions: Vec<DVec3> = [
        [-1.0, g, 0.0],
        [1.0, g, 0.0],
        [-1.0, -g, 0.0],
        [1.0, -g, 0.0],
        [0.0, -1.0, g],
        [0.0, 1.0, g],
        [0.0, -1.0, -g],
        [0.0, 1.0, -g],
        [g, 0.0, -1.0],
        [g, 0.0, 1.0],
        [-g, 0.0, -1.0],
        [-g, 0.0, 1.0],
    ]
    .map(|p| DVec3::from_array(p).normalize())
    .to_vec();
    let mut faces: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..levels {
        let mut midpoints = BTreeMap::new();
        let mut midpoint = |a: u32, b: u32| {
            *midpoints.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]).normalize());
                positions.len() as u32 - 1
            })
        };
        faces = faces
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (midpoint(a, b), midpoint(b, c), midpoint(c, a));
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    TriangleMesh::from_parts(positions, faces)
}

/// A torus around the z axis: `major` × `minor` quads split in two, radii `ring` and `tube`.
pub fn torus(major: u32, minor: u32, ring: f64, tube: f64) -> TriangleMesh {
    wrapped_grid(major, minor, |u, v| {
        let (a, b) = (TAU * u, TAU * v);
        let r = ring + tube * b.cos();
        DVec3::new(r * a.cos(), r * a.sin(), tube * b.sin())
    })
}

/// A closed tube of radius `tube` around the (2, 3) torus knot; `along` × `around` quads split in two.
pub fn trefoil_knot(along: u32, around: u32, tube: f64) -> TriangleMesh {
    tube_around_trefoil(along, around, 0.0, |_| tube)
}

/// A rope of three strands tied into the (2, 3) torus knot; largest radius `tube`, `along` × `around` quads split in
/// two. The strands go round sixteen times, and the quads with them.
pub fn rope_knot(along: u32, around: u32, tube: f64) -> TriangleMesh {
    tube_around_trefoil(along, around, 16.0, |v| tube * (1.0 - 0.3 * (1.5 * TAU * v).cos().powi(6)))
}

/// A closed tube around the (2, 3) torus knot that turns `turns` times around itself. Its radius depends on the
/// place around it, in [0, 1).
fn tube_around_trefoil(along: u32, around: u32, turns: f64, radius: impl Fn(f64) -> f64) -> TriangleMesh {
    let curve = |t: f64| {
        let (a, b) = (2.0 * TAU * t, 3.0 * TAU * t);
        let r = 1.0 + 0.45 * b.cos();
        DVec3::new(r * a.cos(), r * a.sin(), 0.45 * b.sin())
    };
    wrapped_grid(along, around, |u, v| {
        let h = 1e-5;
        let tangent = (curve(u + h) - curve(u - h)).normalize();
        // The direction away from the torus' core circle varies smoothly along the knot: a frame without twist jumps.
        let core = DVec3::new(curve(u).x, curve(u).y, 0.0).normalize_or_zero();
        let side = tangent.cross(curve(u) - core).normalize();
        let up = side.cross(tangent);
        let b = TAU * (v + turns * u);
        curve(u) + radius(v) * (side * b.cos() + up * b.sin())
    })
}

/// An axis-aligned cube `[-1, 1]³`, every side a grid of `n` × `n` quads split in two.
pub fn cube(n: u32) -> TriangleMesh {
    let mut positions = Vec::new();
    let mut index = BTreeMap::new();
    let mut faces = Vec::new();
    let mut vertex = |key: [u32; 3]| {
        *index.entry(key).or_insert_with(|| {
            positions.push(DVec3::from_array(key.map(|k| 2.0 * f64::from(k) / f64::from(n) - 1.0)));
            positions.len() as u32 - 1
        })
    };
    for axis in 0..3 {
        for side in [0, n] {
            for i in 0..n {
                for j in 0..n {
                    let mut corner = |di: u32, dj: u32| {
                        let mut key = [0; 3];
                        key[axis] = side;
                        key[(axis + 1) % 3] = i + di;
                        key[(axis + 2) % 3] = j + dj;
                        vertex(key)
                    };
                    let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                    let quad = if side == n { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
                    faces.extend(quad);
                }
            }
        }
    }
    TriangleMesh::from_parts(positions, faces)
}

/// A flat open rectangle `[0, 1]²` in the plane z = 0: `nx` × `ny` quads split in two, normals along +z.
pub fn grid(nx: u32, ny: u32) -> TriangleMesh {
    let positions = (0..=ny)
        .flat_map(|j| {
            (0..=nx).map(move |i| DVec3::new(f64::from(i) / f64::from(nx), f64::from(j) / f64::from(ny), 0.0))
        })
        .collect();
    let at = |i: u32, j: u32| j * (nx + 1) + i;
    let faces = (0..ny)
        .flat_map(|j| (0..nx).map(move |i| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    TriangleMesh::from_parts(positions, faces)
}

/// A Möbius strip of `2 · along · across` triangles around the z-axis, of radius 1 and width 0.6: it has one side and cannot
/// be oriented. Both counts must be positive, and `along` at least 3.
pub fn moebius_strip(along: u32, across: u32) -> TriangleMesh {
    let place = |i: u32, j: u32| {
        let (around, twist) = (TAU * f64::from(i) / f64::from(along), PI * f64::from(i) / f64::from(along));
        let offset = 0.6 * (f64::from(j) / f64::from(across) - 0.5);
        let radius = 1.0 + offset * twist.cos();
        DVec3::new(radius * around.cos(), radius * around.sin(), offset * twist.sin())
    };
    let positions = (0..along).flat_map(|i| (0..=across).map(move |j| place(i, j))).collect();
    // Once around, the strip meets itself upside down.
    let at = |i: u32, j: u32| if i < along { i * (across + 1) + j } else { across - j };
    let faces = (0..along)
        .flat_map(|i| (0..across).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    TriangleMesh::from_parts(positions, faces)
}

/// A grid of `nu` × `nv` quads, closed in both directions; `position` takes parameters in `[0, 1)²`.
fn wrapped_grid(nu: u32, nv: u32, position: impl Fn(f64, f64) -> DVec3) -> TriangleMesh {
    let mut positions = Vec::with_capacity((nu * nv) as usize);
    for i in 0..nu {
        for j in 0..nv {
            positions.push(position(f64::from(i) / f64::from(nu), f64::from(j) / f64::from(nv)));
        }
    }
    let at = |i: u32, j: u32| (i % nu) * nv + j % nv;
    let faces = (0..nu)
        .flat_map(|i| (0..nv).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    TriangleMesh::from_parts(positions, faces)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ManifoldMesh;

    #[test]
    fn closed_shapes_are_oriented_outward() {
        for mesh in [
            icosphere(2),
            torus(20, 10, 1.0, 0.3),
            cube(3),
            trefoil_knot(200, 16, 0.2),
            rope_knot(300, 30, 0.2),
        ] {
            assert!(mesh.signed_volume() > 0.0);
            assert!(ManifoldMesh::try_from(mesh).is_ok());
        }
    }

    #[test]
    fn areas_and_volumes_approach_the_formulas() {
        let sphere = icosphere(5);
        assert!((sphere.area() - 4.0 * PI).abs() < 2e-2);
        assert!((sphere.signed_volume() - 4.0 / 3.0 * PI).abs() < 2e-2);
        let torus = torus(400, 200, 1.0, 0.4);
        assert!((torus.area() - 4.0 * PI * PI * 0.4).abs() < 1e-2);
        assert!((cube(5).area() - 24.0).abs() < 1e-12);
    }
}
