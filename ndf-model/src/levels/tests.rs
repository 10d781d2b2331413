use super::*;
use crate::{DisplacementField, Model, Similarity};
use ndf_mesh::sampling::AreaSampler;
use ndf_mesh::subdivision::{Creases, Refinement};
use ndf_mesh::{FacePoint, TriangleMesh, shapes};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

fn manifold(mesh: TriangleMesh) -> ManifoldMesh {
    ManifoldMesh::try_from(mesh).unwrap()
}

/// A model of levels above a mesh.
pub(crate) fn model(base: &ManifoldMesh, levels: Levels) -> Model {
    let field = DisplacementField::levelled(base, levels).unwrap();
    let similarity = Similarity::from_bounds(&base.bounds());
    Model { field, similarity, metric: None, scalars: vec![], provenance: "{}".to_owned() }
}

/// Levels above a mesh, with displacements of up to `largest` steps.
pub(crate) fn levels(base: &ManifoldMesh, count: usize, largest: i32) -> Levels {
    let spacing = 1.0 / 1024.0;
    let grid = |p: &DVec3| p.to_array().map(|x| (x / f64::from(spacing)).round() as i32);
    let creases = Creases::new(&Refinement::from_mesh(base), |e| e % 7 < 2, |v| v % 3 == 0);
    let hierarchy = Hierarchy::new(base, &creases, count);
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let level = |l: usize| Level {
        step: 0.01 / (1 << l) as f32,
        displacements: (0..hierarchy.level(l).edges().len())
            .map(|_| rng.random_range(-largest..=largest))
            .collect(),
    };
    Levels {
        spacing,
        control: base.positions().iter().map(grid).collect(),
        creases,
        levels: (0..count).map(level).collect(),
    }
}

fn bases() -> Vec<ManifoldMesh> {
    [shapes::icosphere(1), shapes::torus(9, 6, 1.0, 0.4), shapes::grid(5, 3)]
        .into_iter()
        .map(manifold)
        .collect()
}

#[test]
fn files_give_the_same_surface_in_whatever_order_the_base_mesh_was() {
    for (base, count) in bases().into_iter().zip([2, 0, 3, 6, 1]) {
        let model = model(&base, levels(&base, count, 3));
        let bytes = model.to_bytes();
        let again = Model::from_bytes(&bytes).unwrap();
        assert_eq!(again.to_bytes(), bytes);
        assert_eq!(Model::from_safetensors(&model.to_safetensors().unwrap()).unwrap().to_bytes(), bytes);
        // The same points of space, whichever faces they belong to.
        let points = |model: &Model| model.field.level_surface().unwrap().points().to_vec();
        let (ours, theirs) = (points(&model), points(&again));
        assert_eq!(ours.len(), theirs.len());
        for a in ours {
            assert!(theirs.iter().any(|b| (a - *b).length() < 1e-12), "{a}");
        }
    }
}

#[test]
fn displacements_that_cost_next_to_nothing_are_read_again() {
    let base = manifold(shapes::icosphere(5));
    let mut levels = levels(&base, 2, 0);
    levels.levels[1].displacements[7] = -MAX_DISPLACEMENT;
    let bytes = model(&base, levels).to_bytes();
    assert_eq!(Model::from_bytes(&bytes).unwrap().to_bytes(), bytes);
}

#[test]
fn numbers_that_are_no_levels_are_refused() {
    let base = manifold(shapes::icosphere(1));
    let with = |change: fn(&mut Levels)| {
        let mut levels = levels(&base, 2, 1);
        change(&mut levels);
        DisplacementField::levelled(&base, levels).map(|_| ()).unwrap_err()
    };
    assert_eq!(with(|l| l.spacing = 0.0), LevelsError::Spacing);
    assert_eq!(with(|l| l.levels[1].step = f32::NAN), LevelsError::Step(2));
    assert_eq!(with(|l| l.levels[0].displacements[3] = i32::MIN), LevelsError::Large(1));
    assert!(matches!(with(|l| l.control.truncate(4)), LevelsError::Control { found: 4, .. }));
    assert!(matches!(with(|l| l.levels.swap(0, 1)), LevelsError::Displacements { level: 1, .. }));
    assert_eq!(with(|l| l.levels = vec![l.levels[0].clone(); 7]), LevelsError::Count(7));
    assert_eq!(with(|l| l.control[0] = [i32::MIN; 3]), LevelsError::Position);
    assert_eq!(with(|l| (l.spacing, l.control[0]) = (f32::MAX, [9; 3])), LevelsError::NotFinite);
    let large = manifold(shapes::icosphere(7));
    assert_eq!(check_size(&large, 2), Ok(()));
    assert_eq!(check_size(&large, 4), Err(LevelsError::Faces));
}

#[test]
fn surface_is_continuous_and_its_tangents_are_the_derivatives() {
    for base in bases() {
        let surface = levels(&base, 2, 3).surface(&base).unwrap();
        let topology = base.topology();
        for h in topology.halfedges() {
            let Some(twin) = topology.twin(h) else { continue };
            for t in [0.0, 0.1, 0.5, 0.77] {
                let at = |h, t| surface.at(&FacePoint::on_halfedge(h, t)).point;
                assert!((at(h, t) - at(twin, 1.0 - t)).length() < 1e-13);
            }
        }
        let h = 1e-6;
        for sample in AreaSampler::new(&base).unwrap().sample(500, 0, 0) {
            let mapped = surface.at(&sample);
            for (k, to) in [1, 2].into_iter().enumerate() {
                let moved = |h: f64| {
                    let mut moved = sample;
                    moved.barycentric[0] -= h;
                    moved.barycentric[to] += h;
                    surface.at(&moved).point
                };
                let slope = (moved(h) - moved(-h)) / (2.0 * h);
                assert!((mapped.tangents[k] - slope).length() < 1e-5 * (1.0 + slope.length()));
            }
        }
    }
}

/// Along the normal, curved triangles differ from the limit surface by the third power of their size; along the surface,
/// where it only counts which point is which, by the second. This holds where there are no creases that end.
#[test]
fn evaluation_converges_to_the_limit_surface() {
    let base = manifold(shapes::icosphere(0));
    let smooth = |count| Levels { creases: Creases::default(), ..levels(&base, count, 0) };
    let at_depth = |count: usize| smooth(count).surface(&base).unwrap();
    let truth = at_depth(5);
    let samples = AreaSampler::new(&base).unwrap().sample(2000, 0, 0);
    let errors: Vec<f64> = (0..4)
        .map(|count| {
            let surface = at_depth(count);
            let square = |s: &FacePoint| {
                let truth = truth.at(s);
                (surface.at(s).point - truth.point).dot(truth.normal()).powi(2)
            };
            (samples.iter().map(square).sum::<f64>() / samples.len() as f64).sqrt()
        })
        .collect();
    let ratios: Vec<f64> = errors.windows(2).map(|e| e[0] / e[1]).collect();
    assert!(errors[2] < 1e-4 && ratios.iter().all(|r| *r > 6.0), "{errors:?} {ratios:?}");
}

/// The predictor is the parallelogram where a mesh is flat and regular, and its row is its prediction.
#[test]
fn rows_of_the_predictor_are_its_predictions() {
    for base in bases() {
        let levels = levels(&base, 0, 0);
        let predictor = Predictor::new(&base);
        for weights in [PARALLELOGRAM, [[12, 3], [20, -5]]] {
            for v in 0..base.vertex_count() {
                let predicted = predictor.predict(v, &weights, &levels.control[..v]);
                for c in 0..3 {
                    let row = predictor.row(v, &weights);
                    let sum: f64 =
                        row.iter().map(|&(u, w)| w * f64::from(levels.control[u as usize][c])).sum();
                    assert!((sum - f64::from(predicted[c])).abs() <= 0.5 + 1e-9);
                }
            }
        }
    }
}
