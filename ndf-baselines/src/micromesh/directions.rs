//! The direction in which a set of faces is seen best.

use ndf_core::DVec3;

/// The direction whose smallest cosine with unit normals is largest, and that cosine, to about `1 / rounds`. It is the
/// axis of the narrowest cone around the normals, found as the centre of their smallest ball (Bădoiu and Clarkson 2003).
/// Zero or less where no direction sees all faces from outside.
pub(crate) fn max_min_visibility(normals: &[DVec3], rounds: u32) -> (DVec3, f64) {
    let mut center: DVec3 = normals.iter().sum::<DVec3>() / normals.len().max(1) as f64;
    for round in 1..=rounds {
        let farthest =
            normals.iter().max_by(|a, b| a.distance_squared(center).total_cmp(&b.distance_squared(center)));
        if let Some(&farthest) = farthest {
            center += (farthest - center) / f64::from(round + 1);
        }
    }
    let direction = center.normalize_or_zero();
    let least = normals.iter().map(|n| n.dot(direction)).fold(f64::INFINITY, f64::min);
    (direction, if least.is_finite() { least } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axis_of_a_cone_sees_its_normals_alike() {
        // Many normals on one side of a cone of half-angle 0.9 do not pull its axis there.
        let normal = |turn: f64| {
            let (sine, cosine) = 0.9_f64.sin_cos();
            DVec3::new(sine * turn.cos(), sine * turn.sin(), cosine)
        };
        let normals: Vec<DVec3> =
            (0..20).map(|i| normal(0.01 * f64::from(i))).chain([2.0, 4.0].map(normal)).collect();
        let (direction, least) = max_min_visibility(&normals, 2000);
        assert!(direction.distance(DVec3::Z) < 0.01 && (least - 0.9_f64.cos()).abs() < 0.01, "{direction}");
        let (_, opposed) = max_min_visibility(&[DVec3::X, -DVec3::X, DVec3::Y], 100);
        assert!(opposed < 0.01);
    }
}
