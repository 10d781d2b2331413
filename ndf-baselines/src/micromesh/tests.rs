use super::*;
use ndf_core::NoProgress;
use ndf_core::analytic::Torus;
use ndf_mesh::metrics::{MeasureOptions, measure, vertex_distances};
use ndf_mesh::{TriangleTree, shapes};
use ndf_meshing::{MarchingCubesOptions, marching_cubes};

fn bumpy(levels: u32) -> ManifoldMesh {
    let bump = |p: DVec3| {
        let waves = (5.0 * p.x + 1.0).sin() * (4.0 * p.y).sin() + 0.5 * (9.0 * p.z + p.x).sin();
        p * (1.0 + 0.1 * waves)
    };
    ManifoldMesh::try_from(shapes::icosphere(levels).map_positions(bump)).unwrap()
}

fn made(mesh: &ManifoldMesh, faces: usize) -> Micromesh {
    micromesh(mesh, &MicromeshOptions::to_faces(faces), &NoProgress).unwrap()
}

#[test]
fn micro_vertices_lie_on_the_input_within_half_a_step_of_eleven_bits() {
    let mesh = bumpy(5);
    let baked = made(&mesh, 300);
    assert_eq!(baked.base_face_count(), 300);
    let fine = ManifoldMesh::try_from(baked.tessellated()).unwrap();
    assert_eq!(fine.topology().euler_characteristic(), 2);
    assert!(fine.face_count() > 10_000);
    let mut distances = vertex_distances(&fine, &TriangleTree::new(&mesh));
    distances.sort_unstable_by(f64::total_cmp);
    let longest = (0..baked.positions.len() as u32).map(|v| baked.direction(v).length()).fold(0.0, f64::max);
    let half_step = 0.5 * longest / f64::from(FULL);
    // All but a few whose ray met nothing.
    let within = distances.partition_point(|&d| d <= half_step * 1.001);
    assert!(within as f64 > 0.995 * distances.len() as f64, "{within} of {}", distances.len());
    assert!(distances[within / 2] > 0.01 * half_step, "displacements are not exact");

    let options = MeasureOptions { samples: 20_000, seed: 1 };
    let error = measure(&mesh, &fine, &options).unwrap();
    let base = decimation::decimated(&mesh, 300, &NoProgress).unwrap();
    let coarse = measure(&mesh, &base, &options).unwrap();
    assert!(error.reference_to_mesh.mean < 0.1 * coarse.reference_to_mesh.mean);
    assert!(error.hausdorff < 0.01 * error.diagonal && error.flipped_fraction < 1e-3, "{error:?}");
}

#[test]
fn levels_of_neighbours_differ_by_one_at_most_and_meshes_stay_closed() {
    // Small faces beside large ones.
    let stretched = bumpy(3).map_positions(|p| p * DVec3::new(1.0 + 4.0 * p.x.max(0.0).powi(2), 1.0, 1.0));
    let mesh = ManifoldMesh::try_from(stretched).unwrap();
    let levels = layout::levels(&mesh, 30_000);
    assert!(levels.contains(&MAX_LEVEL) || levels.iter().max() > levels.iter().min());
    let mut met = [false; 6];
    for edge in mesh.topology().edges() {
        let h = mesh.topology().edge_halfedge(edge);
        let [a, b] = [h, mesh.topology().raw_twin(h)].map(|h| levels[h.face().index()]);
        assert!(a.abs_diff(b) <= 1);
        met[usize::from(a.abs_diff(b))] = true;
    }
    assert!(met[1], "some neighbours differ");
    let baked = baking::bake(&mesh, &levels, &mesh);
    let fine = ManifoldMesh::try_from(baked.tessellated()).unwrap();
    assert_eq!(fine.topology().boundary_edge_count(), 0);
    assert_eq!(fine.topology().euler_characteristic(), 2);
    // Each finer side of an edge between levels has one micro-face less for each micro-vertex that it leaves out.
    let all: usize = levels.iter().map(|&l| 1 << (2 * l)).sum();
    assert!(fine.face_count() < all && fine.face_count() > all / 2);
    assert!((fine.area() - mesh.area()).abs() < 0.02 * mesh.area());
}

#[test]
fn any_levels_that_are_graded_make_a_closed_mesh() {
    let mesh = ManifoldMesh::try_from(shapes::icosphere(1)).unwrap();
    for pattern in 0..64_u64 {
        let level = |f: usize| (pattern.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> (f % 60) & 1) as u8;
        for low in 0..3 {
            let levels: Vec<u8> = (0..mesh.face_count()).map(|f| low + level(f)).collect();
            let layout = Layout::new(mesh.vertex_count(), mesh.faces(), &levels);
            let faces: Vec<[u32; 3]> =
                layout.grids.iter().zip(&levels).flat_map(|(g, &l)| layout::triangles(l, g)).collect();
            let positions = (0..layout.sites.len()).map(|i| DVec3::splat(i as f64)).collect();
            let fine = ManifoldMesh::try_from(TriangleMesh::new(positions, faces).unwrap()).unwrap();
            assert_eq!(fine.topology().boundary_edge_count(), 0);
            assert_eq!(fine.topology().euler_characteristic(), 2);
        }
    }
}

#[test]
fn bytes_are_those_that_are_counted_and_lead_back() {
    let mesh = bumpy(4);
    let baked = made(&mesh, 200);
    let bytes = baked.to_bytes();
    let vertices = baked.positions.len();
    assert!((65..=128).contains(&vertices), "7 bits name a corner");
    let places: usize = baked.levels.iter().map(|&l| ((1 << l) + 1) * ((1 << l) + 2) / 2).sum();
    assert_eq!(baked.displacement_count(), places);
    let bits = 200 * (3 * 7 + 3) + places * 11;
    assert_eq!(bytes.len(), 12 + vertices * (12 + 6) + bits.div_ceil(8));
    assert_eq!(Micromesh::from_bytes(&bytes).unwrap(), baked);
}

#[test]
fn damaged_bytes_are_refused_or_make_another_mesh() {
    let bytes = made(&bumpy(3), 80).to_bytes();
    for length in 0..bytes.len() {
        assert!(Micromesh::from_bytes(&bytes[..length]).is_err());
    }
    assert!(Micromesh::from_bytes(&[&bytes[..], &[0]].concat()).is_err());
    for place in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[place] ^= 1 << (place % 8);
        if let Ok(other) = Micromesh::from_bytes(&damaged) {
            other.tessellated();
        }
    }
    let unused = [[1_u32.to_le_bytes(), 0_u32.to_le_bytes(), 1.0_f32.to_le_bytes()].concat(), vec![0; 18]];
    assert_eq!(Micromesh::from_bytes(&unused.concat()), Err(MicromeshFileError::Vertex(0)));
}

#[test]
fn threads_change_nothing() {
    let mesh = bumpy(4);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| made(&mesh, 150))
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn slivers_of_isosurfaces_stop_no_decimation() {
    let torus = Torus { center: DVec3::ZERO, ring: 0.7, tube: 0.3 };
    let options = MarchingCubesOptions { grid: 100, ..MarchingCubesOptions::default() };
    let fine = marching_cubes(&torus, &options, &NoProgress).unwrap().mesh;
    let found = made(&fine, 300);
    assert!(found.base_face_count() <= 300, "{} faces", found.base_face_count());
}
