//! Where images come from on the base mesh, as the reverse map begins there.

use ndf_core::glam::Vec3;
use ndf_core::{DVec3, Hint};
use ndf_mesh::FacePoint;
use ndf_mesh::{TriangleMesh, TriangleTree};
use ndf_model::DisplacementField;
use rayon::prelude::*;

use super::Place;

/// A point x₀ of the base mesh and the plane that stands for the base mesh around it until it is sought again.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Origin {
    pub(crate) place: Place,
    /// x₀.
    pub(crate) point: Vec3,
    /// What lies above x₀: its image g(x₀), or x₀ itself where g is not asked.
    pub(crate) image: Vec3,
    /// Unit normal of the plane.
    pub(crate) normal: Vec3,
}

/// Steps towards the inverse of g, the last of them in the plane. Where g does not fold, a step brings it several times
/// nearer (the test below).
const STEPS: usize = 2;

/// The closest points of the base mesh to the images of these samples; each with the plane across the shortest way.
pub(crate) fn closest_origins(
    base: &TriangleMesh,
    tree: &TriangleTree,
    images: &[DVec3],
    samples: &[FacePoint],
) -> Vec<Origin> {
    let origin = |(place, &y): (FacePoint, &DVec3)| {
        let point = place.position(base);
        let normal = (y - point).try_normalize().unwrap_or(base.face_normal(place.face));
        Origin::new(&place, point, point, normal)
    };
    closest(tree, images, samples).into_iter().zip(images).map(origin).collect()
}

/// The points of the base mesh that g takes to the images of these samples, or near them: from the closest point on,
/// x ← p(x + T (y − g(x))), where T leads into the plane of x' face and p to the closest point of the base mesh.
pub(crate) fn inverse_origins(
    field: &DisplacementField,
    tree: &TriangleTree,
    images: &[DVec3],
    samples: &[FacePoint],
) -> Vec<Origin> {
    let base = field.base();
    let mut places = closest(tree, images, samples);
    for _ in 1..STEPS {
        let step = |((place, mapped), &y): ((&FacePoint, DVec3), &DVec3)| {
            let (normal, away) = (base.face_normal(place.face), y - mapped);
            place.position(base) + away - normal * away.dot(normal)
        };
        let moved: Vec<DVec3> = places.iter().zip(field.map(&places)).zip(images).map(step).collect();
        places = closest(tree, &moved, &places);
    }
    let origin = |(place, image): (&FacePoint, DVec3)| {
        Origin::new(place, place.position(base), image, base.face_normal(place.face))
    };
    places.iter().zip(field.map(&places)).map(origin).collect()
}

/// The closest points of the base mesh, sought from these places on.
fn closest(tree: &TriangleTree, points: &[DVec3], near: &[FacePoint]) -> Vec<FacePoint> {
    let pairs = points.par_iter().zip(near).with_min_len(256);
    let find = |(&point, near): (&DVec3, &FacePoint)| {
        let found = tree.closest_point(point, Hint(near.face.0));
        found.map_or(*near, |c| c.at)
    };
    pairs.map(find).collect()
}

impl Origin {
    fn new(place: &FacePoint, point: DVec3, image: DVec3, normal: DVec3) -> Self {
        let (point, image, normal) = (point.as_vec3(), image.as_vec3(), normal.as_vec3());
        Self { place: Place::new(place), point, image, normal }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_mesh::ManifoldMesh;
    use ndf_mesh::sampling::AreaSampler;
    use ndf_mesh::shapes;
    use ndf_model::{FieldShape, NetworkShape};

    /// A smooth map that slides points along the sphere by up to a third of an edge.
    #[test]
    fn inverse_is_nearer_than_the_closest_point() {
        let base = ManifoldMesh::try_from(shapes::icosphere(3)).unwrap();
        let shape =
            FieldShape::from(NetworkShape { features: 3, hidden: vec![8], ..NetworkShape::default() });
        let field = DisplacementField::untrained(base, shape.clone(), 1).unwrap();
        // Features are displacements; a pair of ReLUs passes each on.
        let turned = |p: &DVec3| [-0.1 * p.y, 0.1 * p.x, 0.03 * (3.0 * p.x).sin()].map(|x| x as f32);
        let features = field.base().positions().iter().flat_map(turned).collect();
        let mut parameters = vec![0.0; shape.mlp().parameter_count()];
        for k in 0..3 {
            for (unit, sign) in [(2 * k, 1.0), (2 * k + 1, -1.0)] {
                parameters[unit * 6 + k] = sign;
                parameters[8 * 6 + 8 + k * 8 + unit] = sign;
            }
        }
        let field = field.with_parameters(features, parameters).unwrap();
        let samples = AreaSampler::new(field.base()).unwrap().sample(2000, 0, 0);
        let images = field.map(&samples);
        let base = field.base();
        let tree = TriangleTree::new(base);
        let rms = |origins: Vec<Origin>| {
            let distance = |((origin, sample), y): ((&Origin, &FacePoint), &DVec3)| {
                let (away, normal) = (*y - origin.image.as_dvec3(), origin.normal.as_dvec3());
                let start = origin.point.as_dvec3() + away - normal * away.dot(normal);
                start.distance_squared(sample.position(base))
            };
            let sum: f64 = origins.iter().zip(&samples).zip(&images).map(distance).sum();
            (sum / samples.len() as f64).sqrt()
        };
        let closest = rms(closest_origins(base, &tree, &images, &samples));
        let inverse = rms(inverse_origins(&field, &tree, &images, &samples));
        assert!(closest > 0.03 && inverse < 0.02 * closest, "{closest} {inverse}");
    }
}
