//! The base mesh of a run as its model will keep it.

use ndf_core::model::StoredBase;
use ndf_core::projection::projected;
use ndf_core::sampling::{AreaSampler, FaceSample};
use ndf_core::{DVec3, ManifoldMesh, Query, Surface};

use crate::settings::Settings;

/// Samples of the base mesh whose distances from the surface are measured.
const SAMPLES: usize = 4_096;

/// Stream of random numbers of these samples; batches count up from 0.
const STREAM: u64 = u64::MAX - 2;

/// The base mesh (in the surface's coordinates) as a model of these settings keeps it: where they ask for rounded numbers,
/// the less precisely, the farther it is from the surface. Costs some thousand projections there.
pub fn stored_base(surface: &dyn Surface, base: &ManifoldMesh, settings: &Settings) -> StoredBase {
    let distance = settings.precision.map_or(0.0, |_| distance(surface, base, settings.seed));
    StoredBase::new(base, settings.precision, distance)
}

/// Root of the mean squared distance of the base mesh from the surface, in the surface's units; 0 where it finds none.
fn distance(surface: &dyn Surface, base: &ManifoldMesh, seed: u64) -> f64 {
    let Some(sampler) = AreaSampler::of_manifold(base) else { return 0.0 };
    let mesh = base.as_triangle_mesh();
    let query = |sample: &FaceSample| {
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
