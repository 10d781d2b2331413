use super::*;
use ndf_mesh::{repair, shapes};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// Squares of a lattice, each by its axis, its place along it, its cell across, and whether it is turned.
#[derive(Default)]
struct Squares(Vec<[DVec3; 4]>);

impl Squares {
    fn add(&mut self, axis: usize, place: usize, [i, j]: [usize; 2], turned: bool) {
        let corner = |u: usize, v: usize| {
            let mut p = [0.0; 3];
            (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (place as f64, (i + u) as f64, (j + v) as f64);
            DVec3::from_array(p)
        };
        let mut square = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
        if turned {
            square.reverse();
        }
        self.0.push(square);
    }

    /// A box of squares from one corner to another.
    fn add_box(&mut self, from: [usize; 3], to: [usize; 3], turned: bool) {
        for axis in 0..3 {
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            for place in [from[axis], to[axis]] {
                for (i, j) in (from[a]..to[a]).flat_map(|i| (from[b]..to[b]).map(move |j| (i, j))) {
                    self.add(axis, place, [i, j], (place == from[axis]) != turned);
                }
            }
        }
    }

    fn mesh(&self) -> TriangleMesh {
        let positions = self.0.as_flattened().to_vec();
        let faces = (0..self.0.len() as u32)
            .flat_map(|s| [[4 * s, 4 * s + 1, 4 * s + 2], [4 * s, 4 * s + 2, 4 * s + 3]]);
        repair::welded(&TriangleMesh::new(positions, faces.collect()).unwrap(), 0.0)
    }
}

fn walls(mesh: &TriangleMesh) -> Vec<bool> {
    let offset = 1e-6 * mesh.bounds().diagonal();
    inner_walls(mesh, &TriangleTree::new(mesh), &Pseudonormals::new(mesh), offset)
}

/// The walls of a mesh whose first faces are its outside and whose others are walls.
fn assert_walls_from(first: usize, mesh: &TriangleMesh) {
    let found = walls(mesh);
    let wrong: Vec<usize> = (0..found.len()).filter(|&f| found[f] != (f >= first)).collect();
    assert!(wrong.is_empty(), "{} of {} faces: {wrong:?}", wrong.len(), found.len());
}

#[test]
fn rooms_have_no_inner_walls_whichever_way_these_point() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for rooms in [[2, 1, 1], [1, 1, 9], [4, 3, 2], [5, 5, 5]] {
        for height in [1.0, 0.02] {
            let mut squares = Squares::default();
            squares.add_box([0; 3], rooms, false);
            let first = 2 * squares.0.len();
            for axis in 0..3 {
                let (a, b) = (rooms[(axis + 1) % 3], rooms[(axis + 2) % 3]);
                for place in 1..rooms[axis] {
                    let turned = rng.random();
                    (0..a)
                        .flat_map(|i| (0..b).map(move |j| [i, j]))
                        .for_each(|cell| squares.add(axis, place, cell, turned));
                }
            }
            assert_walls_from(first, &squares.mesh().map_positions(|p| DVec3::new(p.x, p.y, height * p.z)));
        }
    }
}

#[test]
fn shelves_that_touch_nothing_are_walls() {
    let mut squares = Squares::default();
    squares.add_box([0; 3], [8; 3], false);
    let first = 2 * squares.0.len();
    for place in 1..8 {
        (2..6).flat_map(|i| (2..6).map(move |j| [i, j])).for_each(|cell| squares.add(2, place, cell, false));
    }
    assert_walls_from(first, &squares.mesh());
}

#[test]
fn cavities_stay_and_their_struts_do_not() {
    let mut squares = Squares::default();
    squares.add_box([0; 3], [5; 3], false);
    squares.add_box([1; 3], [4; 3], true);
    let first = 2 * squares.0.len();
    assert_walls_from(first, &squares.mesh());
    squares.add(0, 2, [2, 0], false);
    assert_walls_from(first, &squares.mesh());
}

#[test]
fn solids_in_cavities_stay_and_their_struts_do_not() {
    let mut squares = Squares::default();
    squares.add_box([0; 3], [7; 3], false);
    squares.add_box([1; 3], [6; 3], true);
    squares.add_box([2; 3], [5; 3], false);
    let first = 2 * squares.0.len();
    squares.add(0, 3, [3, 0], false);
    squares.add(0, 3, [3, 1], true);
    assert_walls_from(first, &squares.mesh());
}

/// A channel whose walls are not sewn together, round three corners, is seen from outside only at its mouth.
#[test]
fn channels_are_no_walls() {
    let mut squares = Squares::default();
    let is_channel = |[x, y, z]: [usize; 3]| {
        (x == 2 && y == 2 && z >= 2)
            || (z == 2 && y == 2 && (2..=6).contains(&x))
            || (z == 2 && x == 6 && (2..=6).contains(&y))
    };
    let is_solid = |cell: [usize; 3]| cell.iter().all(|&c| (1..=8).contains(&c)) && !is_channel(cell);
    for (axis, place) in (0..3).flat_map(|axis| (1..10).map(move |place| (axis, place))) {
        for (i, j) in (0..10).flat_map(|i| (0..10).map(move |j| (i, j))) {
            let cell = |along: usize| {
                let mut cell = [0; 3];
                (cell[axis], cell[(axis + 1) % 3], cell[(axis + 2) % 3]) = (along, i, j);
                cell
            };
            let [behind, before] = [is_solid(cell(place - 1)), is_solid(cell(place))];
            if behind != before {
                squares.add(axis, place, [i, j], before);
            }
        }
    }
    let sewn = squares.mesh();
    assert!(walls(&sewn).iter().all(|is_wall| !is_wall));
    let apart: Vec<DVec3> = sewn
        .face_indices()
        .flat_map(|f| {
            let corners = sewn.corner_positions(f);
            let center = corners.iter().sum::<DVec3>() / 3.0;
            corners.map(|p| p + 1e-4 * (center - p))
        })
        .collect();
    let faces = (0..sewn.face_count() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
    let apart = TriangleMesh::new(apart, faces).unwrap();
    assert!(walls(&apart).iter().all(|is_wall| !is_wall));
}

/// Boxes of rooms whose sides point anywhere, and shells of faces that are not sewn together.
#[test]
fn sides_of_a_solid_face_out() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut squares = Squares::default();
    squares.add_box([0; 3], [3, 2, 4], false);
    let first = 2 * squares.0.len();
    (0..3).flat_map(|i| (0..2).map(move |j| [i, j])).for_each(|cell| squares.add(2, 1, cell, rng.random()));
    (0..2).flat_map(|i| (1..4).map(move |j| [i, j])).for_each(|cell| squares.add(0, 2, cell, false));
    let rooms = squares.mesh();
    let sphere = shapes::icosphere(2);
    let corners = sphere.face_indices().flat_map(|f| {
        let corners = sphere.corner_positions(f);
        let center = corners.iter().sum::<DVec3>() / 3.0;
        corners.map(|p| p + 1e-3 * (center - p))
    });
    let faces = (0..sphere.face_count() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
    let apart = TriangleMesh::new(corners.collect(), faces).unwrap();
    for (mesh, outside) in [(&rooms, first), (&apart, apart.face_count())] {
        let mut faces = mesh.faces().to_vec();
        faces.iter_mut().filter(|_| rng.random()).for_each(|face| face.swap(0, 1));
        let any = TriangleMesh::new(mesh.positions().to_vec(), faces).unwrap();
        let found = facing_out(&repair::oriented(&any));
        for f in mesh.face_indices().take(outside) {
            assert!(found.face_normal(f).dot(mesh.face_normal(f)) > 0.99, "{f}");
        }
    }
    // What is seen from both sides stays.
    let sheet = shapes::grid(4, 4);
    assert_eq!(facing_out(&sheet).faces(), sheet.faces());
}

#[test]
fn surfaces_without_walls_have_none() {
    for mesh in [shapes::icosphere(3), shapes::grid(4, 4), shapes::cube(2), TriangleMesh::default()] {
        assert!(walls(&mesh).iter().all(|is_wall| !is_wall));
    }
}
