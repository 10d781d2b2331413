//! The base mesh of a run as its model will keep it, and what training needs of its faces.

use ndf_core::projected;
use ndf_core::{DVec3, Query, Surface};
use ndf_mesh::FacePoint;
use ndf_mesh::ManifoldMesh;
use ndf_mesh::sampling::AreaSampler;
use ndf_model::file::{BaseOrder, StoredBase};
use ndf_model::intrinsic_network::single;

use crate::error::TrainError;
use crate::settings::Settings;

/// Samples of the base mesh whose distances from the surface are measured.
const SAMPLES: usize = 4_096;

/// Stream of random numbers of these samples; batches count up from 0.
const STREAM: u64 = u64::MAX - 2;

/// The base mesh (in the surface's coordinates) as a model of these settings keeps it: where they ask for rounded numbers,
/// the less precisely, the farther it is from the surface. Costs some thousand projections there.
///
/// # Errors
/// If the settings are not usable.
pub fn stored_base(
    surface: &dyn Surface,
    base: &ManifoldMesh,
    settings: &Settings,
) -> Result<StoredBase, TrainError> {
    settings.validate()?;
    let distance = settings.precision.map_or(0.0, |_| distance(surface, base, settings.seed));
    Ok(StoredBase::new(base, settings.precision, distance))
}

/// Root of the mean squared distance of the base mesh from the surface, in the surface's units; 0 where it finds none.
fn distance(surface: &dyn Surface, base: &ManifoldMesh, seed: u64) -> f64 {
    let Some(sampler) = AreaSampler::new(base) else { return 0.0 };
    let mesh = base;
    let query = |sample: &FacePoint| {
        let normal = Some(mesh.face_normal(sample.face)).filter(|&n| n != DVec3::ZERO);
        Query { normal, ..Query::at(sample.position(mesh)) }
    };
    let queries: Vec<Query> = sampler.sample(SAMPLES, seed, STREAM).iter().map(query).collect();
    let feet = projected(surface, &queries);
    let squares =
        queries.iter().zip(&feet).filter_map(|(q, foot)| Some(q.point.distance_squared(foot.ok()?.point)));
    let (sum, count) = squares.fold((0.0, 0), |(sum, count), square| (sum + square, count + 1));
    (sum / f64::from(count.max(1))).sqrt()
}

/// What training needs of the faces of a stored base mesh.
pub(crate) struct Base {
    pub(crate) faces: Vec<[u32; 3]>,
    /// Rounded.
    pub(crate) positions: Vec<[f32; 3]>,
    /// Derivatives of the barycentric coordinates of every face along its orthonormal frame.
    pub(crate) frames: Vec<[[f32; 3]; 2]>,
    /// Where the parts are in the mesh that training was given.
    pub(crate) order: BaseOrder,
}

impl Base {
    pub(crate) fn new(mesh: &ManifoldMesh, order: BaseOrder) -> Self {
        Self {
            faces: mesh.faces().to_vec(),
            positions: single(mesh.positions()),
            frames: mesh.face_indices().map(|f| frame(mesh.corner_positions(f))).collect(),
            order,
        }
    }
}

/// Derivatives of the barycentric coordinates along an orthonormal frame of a triangle whose first vector is along
/// the side from corner 0 to corner 1; zero where the triangle has no area.
fn frame([a, b, c]: [DVec3; 3]) -> [[f32; 3]; 2] {
    let (p, q) = (b - a, c - a);
    let length = p.length();
    let along = q.dot(p) / length;
    let height = p.cross(q).length() / length;
    if !(height > 0.0 && length > 0.0) {
        return [[0.0; 3]; 2];
    }
    let (u1, v1, v2) = (1.0 / length, -along / (height * length), 1.0 / height);
    [[-u1, u1, 0.0], [-v1 - v2, v1, v2]].map(|w| w.map(|x| x as f32))
}
