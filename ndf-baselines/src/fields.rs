//! Fields for tests: functions, counted looks, and shapes made at random.

use std::sync::atomic::{AtomicU64, Ordering};

use ndf_core::glam::{DQuat, EulerRot};
use ndf_core::{BoundingBox, DVec3, ImplicitField, Inside};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

type Function = Box<dyn Fn(DVec3) -> f64 + Send + Sync>;

/// A function that is negative inside, in the box [-1.2, 1.2]³.
pub(crate) struct Field(Function);

impl Field {
    pub(crate) fn new(function: impl Fn(DVec3) -> f64 + Send + Sync + 'static) -> Self {
        Self(Box::new(function))
    }
}

impl ImplicitField for Field {
    fn values(&self, points: &[DVec3], values: &mut [f64]) {
        points.iter().zip(values).for_each(|(&p, value)| *value = self.0(p));
    }

    fn bounds(&self) -> BoundingBox {
        BoundingBox { min: DVec3::splat(-1.2), max: DVec3::splat(1.2) }
    }

    fn level(&self) -> f64 {
        0.0
    }

    fn inside(&self) -> Inside {
        Inside::Below
    }
}

/// A field that counts the points it is asked at.
pub(crate) struct CountingField<'a> {
    pub(crate) field: &'a dyn ImplicitField,
    pub(crate) count: &'a AtomicU64,
}

impl ImplicitField for CountingField<'_> {
    fn values(&self, points: &[DVec3], values: &mut [f64]) {
        self.count.fetch_add(points.len() as u64, Ordering::Relaxed);
        self.field.values(points, values);
    }

    fn bounds(&self) -> BoundingBox {
        self.field.bounds()
    }

    fn level(&self) -> f64 {
        self.field.level()
    }

    fn inside(&self) -> Inside {
        self.field.inside()
    }
}

/// A sphere, box or torus anywhere, turned at will.
fn random_part(rng: &mut ChaCha8Rng) -> Function {
    let mut between = |a: f64, b: f64| rng.random_range(a..b);
    let center = DVec3::from_array(std::array::from_fn(|_| between(-0.5, 0.5)));
    let angles: [f64; 3] = std::array::from_fn(|_| between(-3.0, 3.0));
    let size = DVec3::from_array(std::array::from_fn(|_| between(0.15, 0.5)));
    let turn = DQuat::from_euler(EulerRot::XYZ, angles[0], angles[1], angles[2]);
    let kind = rng.random_range(0..3);
    Box::new(move |p| {
        let p = turn * (p - center);
        match kind {
            0 => p.length() - size.x,
            1 => (p.abs() - size).max_element(),
            _ => (p.truncate().length() - size.x).hypot(p.z) - 0.4 * size.y,
        }
    })
}

/// Several parts united, intersected or cut from each other; blobs; or waves, by the seed.
pub(crate) fn random_field(seed: u64) -> Field {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    match seed % 3 {
        0 => {
            let parts: Vec<(Function, bool)> =
                (0..8).map(|i| (random_part(&mut rng), i > 3 && rng.random())).collect();
            Field::new(move |p| {
                parts.iter().fold(
                    f64::INFINITY,
                    |d, (part, is_cut)| {
                        if *is_cut { d.max(-part(p)) } else { d.min(part(p)) }
                    },
                )
            })
        }
        1 => {
            let centers: Vec<DVec3> = (0..9)
                .map(|_| DVec3::from_array(std::array::from_fn(|_| rng.random_range(-0.8..0.8))))
                .collect();
            Field::new(move |p| {
                0.9 - centers.iter().map(|&c| (-p.distance_squared(c) / 0.06).exp()).sum::<f64>()
            })
        }
        _ => {
            let waves: Vec<(DVec3, f64)> = (0..6)
                .map(|_| {
                    let way = DVec3::from_array(std::array::from_fn(|_| rng.random_range(-9.0..9.0)));
                    (way, rng.random_range(0.0..6.0))
                })
                .collect();
            Field::new(move |p| {
                let waves = waves.iter().map(|(way, phase)| (way.dot(p) + phase).sin()).sum::<f64>();
                (waves - 0.3).max(p.length() - 1.05)
            })
        }
    }
}
