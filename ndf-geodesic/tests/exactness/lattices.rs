//! Meshes with vertices on lattices, on which straight lines meet vertices exactly: surfaces of voxels, marching cubes
//! of masks, grids with holes.

use ndf_core::glam::{DQuat, EulerRot};
use ndf_core::{BoundingBox, DVec3, ImplicitField, Inside, NoProgress};
use ndf_mesh::{ManifoldMesh, TriangleMesh, repair, shapes};
use ndf_meshing::{MarchingCubesOptions, marching_cubes};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use crate::common::subdivided;

/// Whether a voxel is full, by its place.
pub(crate) type Solid = dyn Fn([i32; 3]) -> bool + Sync;

/// The surface of the full voxels of `[0, size)³`, in unit squares, each cut in two; `None` where voxels touch in an edge
/// or a corner only. `cut` says along which diagonal.
pub(crate) fn voxels(size: i32, solid: &Solid, mut cut: impl FnMut() -> bool) -> Option<TriangleMesh> {
    let full = |p: [i32; 3]| p.iter().all(|&x| (0..size).contains(&x)) && solid(p);
    let mut numbers = std::collections::BTreeMap::new();
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    let range = || (0..size).flat_map(|i| (0..size).map(move |j| (i, j)));
    for (p, axis) in
        range().flat_map(|(i, j)| (0..size).flat_map(move |k| (0..3).map(move |a| ([i, j, k], a))))
    {
        for side in [0, 1] {
            let mut neighbour = p;
            neighbour[axis] += 2 * side - 1;
            if !full(p) || full(neighbour) {
                continue;
            }
            let corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[a, b]| {
                let mut corner = p;
                corner[axis] += side;
                corner[(axis + 1) % 3] += a;
                corner[(axis + 2) % 3] += b;
                *numbers.entry(corner).or_insert_with(|| {
                    positions.push(DVec3::from_array(corner.map(f64::from)));
                    positions.len() as u32 - 1
                })
            });
            let [a, b, c, d] =
                if side == 1 { corners } else { [corners[0], corners[3], corners[2], corners[1]] };
            faces.extend(if cut() { [[a, b, c], [a, c, d]] } else { [[b, c, d], [b, d, a]] });
        }
    }
    let mesh = TriangleMesh::new(positions, faces).unwrap();
    ManifoldMesh::try_from(mesh.clone()).is_ok().then_some(mesh)
}

/// A mask of voxels as a field: ½ outside and −½ inside.
struct Mask<'a>(i32, &'a Solid);

impl ImplicitField for Mask<'_> {
    fn values(&self, points: &[DVec3], values: &mut [f64]) {
        for (value, p) in values.iter_mut().zip(points) {
            let p = p.to_array().map(|x| x.round() as i32);
            let inside = p.iter().all(|x| (0..self.0).contains(x)) && self.1(p);
            *value = if inside { -0.5 } else { 0.5 };
        }
    }

    fn bounds(&self) -> BoundingBox {
        BoundingBox { min: DVec3::ZERO, max: DVec3::splat(f64::from(self.0)) }
    }

    fn level(&self) -> f64 {
        0.0
    }

    fn inside(&self) -> Inside {
        Inside::Below
    }
}

/// Marching cubes of a mask of voxels in `[0, size)³`: vertices halfway between them.
pub(crate) fn masked(size: i32, solid: &Solid) -> TriangleMesh {
    let options =
        MarchingCubesOptions { grid: size as u32, refinement: 0, ..MarchingCubesOptions::default() };
    let surface = marching_cubes(&Mask(size, solid), &options, &NoProgress).unwrap();
    TriangleMesh::clone(&surface.mesh)
}

/// A flat grid without the quads that `hole` names, each other quad cut along a random diagonal.
pub(crate) fn grid(columns: u32, rows: u32, hole: impl Fn(u32, u32) -> bool, seed: u64) -> TriangleMesh {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let full = shapes::grid(columns, rows);
    let quads = full.faces().chunks_exact(2).zip(0..).filter(|(_, q)| !hole(q % columns, q / columns));
    let cut = |(quad, _): (&[[u32; 3]], u32)| {
        let [[a, b, c], [_, _, d]] = [quad[0], quad[1]];
        if rng.random() { [[a, b, c], [a, c, d]] } else { [[b, c, d], [b, d, a]] }
    };
    let faces = quads.flat_map(cut).collect();
    let size = DVec3::new(f64::from(columns), f64::from(rows), 1.0);
    let positions = full.positions().iter().map(|p| (*p * size).round()).collect();
    repair::without_unreferenced_vertices(&TriangleMesh::new(positions, faces).unwrap()).0
}

fn middle(x: i32) -> bool {
    (2..4).contains(&x)
}

/// Twenty meshes on lattices, each with its name.
pub(crate) fn all() -> Vec<(&'static str, TriangleMesh)> {
    let boxed = |size: [i32; 3]| move |p: [i32; 3]| p.iter().zip(size).all(|(&x, s)| x < s);
    let ball = |size: i32, radius: i32| {
        // In doubled coordinates around the middle.
        move |p: [i32; 3]| p.iter().map(|x| (2 * x + 1 - size).pow(2)).sum::<i32>() <= 4 * radius * radius
    };
    let straight = |size, solid: &Solid| voxels(size, solid, || true).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    let mut at_random = |size, solid: &Solid| voxels(size, solid, || rng.random()).unwrap();
    let stretched = |mesh: &TriangleMesh, by: [f64; 3]| mesh.map_positions(|p| p * DVec3::from_array(by));
    vec![
        ("a cube of 7", straight(7, &boxed([7, 7, 7]))),
        ("a cube of 7, slices thrice as thick", stretched(&straight(7, &boxed([7, 7, 7])), [1.0, 1.0, 3.0])),
        ("a cube of 6, cut at random", at_random(6, &boxed([6, 6, 6]))),
        ("a box", straight(9, &boxed([9, 3, 4]))),
        ("a plate", stretched(&straight(8, &boxed([8, 8, 1])), [1.0, 1.0, 0.01])),
        ("an angle", straight(6, &|p| p[2] < 2 && (p[0] < 2 || p[1] < 2))),
        ("a ring", straight(6, &|p| p[2] < 2 && !(middle(p[0]) && middle(p[1])))),
        (
            "a box with two tunnels",
            at_random(6, &|p| p[2] < 4 && !(middle(p[0]) && (middle(p[1]) || p[1] == 5))),
        ),
        ("stairs", straight(6, &|p| p[1] < 3 && p[0] + p[2] < 6)),
        ("stairs, steep", stretched(&straight(6, &|p| p[1] < 3 && p[0] + p[2] < 6), [1.0, 2.0, 5.0])),
        ("a cross", straight(6, &|p| p.iter().filter(|&&x| middle(x)).count() >= 2)),
        ("marching cubes of a ball", masked(6, &ball(6, 3))),
        ("marching cubes of a ball, thick slices", stretched(&masked(6, &ball(6, 3)), [1.0, 1.0, 2.5])),
        ("marching cubes of a box", masked(6, &boxed([6, 5, 3]))),
        ("marching cubes of a ring", masked(6, &|p| p[2] < 2 && !(middle(p[0]) && middle(p[1])))),
        ("marching cubes of an angle", masked(6, &|p| p[2] < 2 && (p[0] < 2 || p[1] < 2))),
        ("a cube of 3 subdivided", subdivided(&shapes::cube(3))),
        ("a box subdivided", subdivided(&straight(4, &boxed([4, 2, 1])))),
        ("a grid with a hole", grid(14, 12, |i, j| (4..9).contains(&i) && (5..7).contains(&j), 1)),
        ("a grid with three holes", grid(16, 9, |i, j| i % 5 == 2 && (3..6).contains(&j), 2)),
    ]
}

/// A lattice of any kind: a strip, or voxels or marching cubes of three boxes; stretched along the axes by up to 1,000,
/// and perhaps turned in space, so that no coordinate is exact.
pub(crate) fn random(rng: &mut ChaCha8Rng) -> TriangleMesh {
    let mesh = loop {
        let boxes: [[[i32; 2]; 3]; 3] = [0; 3].map(|_| {
            [0; 3].map(|_| {
                let low = rng.random_range(0..4);
                [low, rng.random_range(low..4)]
            })
        });
        let solid = move |p: [i32; 3]| {
            boxes.iter().any(|b| b.iter().zip(p).all(|(&[low, high], x)| (low..=high).contains(&x)))
        };
        match rng.random_range(0..3) {
            0 => break grid(rng.random_range(2..50), rng.random_range(1..4), |_, _| false, rng.random()),
            1 => break masked(4, &solid),
            _ => {
                if let Some(mesh) = voxels(4, &solid, || rng.random()) {
                    break mesh;
                }
            }
        }
    };
    let stretch = DVec3::from_array([0; 3].map(|_| [1.0, 1.0, 3.0, 0.1, 1e-2, 1e-3][rng.random_range(0..6)]));
    let turn = if rng.random() {
        DQuat::from_euler(EulerRot::XYZ, rng.random(), rng.random(), rng.random())
    } else {
        DQuat::IDENTITY
    };
    mesh.map_positions(|p| turn * (p * stretch))
}
