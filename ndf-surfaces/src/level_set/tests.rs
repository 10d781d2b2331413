use super::*;
use ndf_core::Inside;
use ndf_core::projected;

/// A torus around the z axis as a field: `shape` of the signed distance.
#[derive(Clone, Copy)]
struct Torus {
    ring: f64,
    tube: f64,
    shape: fn(f64) -> f64,
    level: f64,
    inside: Inside,
}

impl Torus {
    fn signed_distance(&self, p: DVec3) -> f64 {
        DVec3::new(p.truncate().length() - self.ring, 0.0, p.z).length() - self.tube
    }

    fn closest(&self, p: DVec3) -> DVec3 {
        let core = self.ring * DVec3::new(p.x, p.y, 0.0).normalize();
        core + self.tube * (p - core).normalize()
    }
}

impl ImplicitField for Torus {
    fn values(&self, points: &[DVec3], values: &mut [f64]) {
        points.iter().zip(values).for_each(|(&p, v)| *v = (self.shape)(self.signed_distance(p)));
    }
    fn bounds(&self) -> BoundingBox {
        let tube = self.tube + 0.05;
        let corner = DVec3::new(self.ring + tube, self.ring + tube, tube);
        BoundingBox { min: -corner, max: corner }
    }
    fn level(&self) -> f64 {
        self.level
    }
    fn inside(&self) -> Inside {
        self.inside
    }
}

/// A field linear in the distance.
fn distance() -> LevelSetSurface<Torus> {
    LevelSetSurface::new(Torus { ring: 1.0, tube: 0.4, shape: |d| d, level: 0.0, inside: Inside::Below })
}

/// A density that saturates within 3 % of the size.
fn density() -> LevelSetSurface<Torus> {
    let shape = |d: f64| 40.0 / (1.0 + (60.0 * d).exp());
    LevelSetSurface::new(Torus { ring: 1.0, tube: 0.4, shape, level: 12.0, inside: Inside::Above })
}

/// An occupancy, which has no gradient at all.
fn occupancy() -> LevelSetSurface<Torus> {
    let shape = |d: f64| f64::from(u8::from(d < 0.0));
    LevelSetSurface::new(Torus { ring: 1.0, tube: 0.4, shape, level: 0.5, inside: Inside::Above })
}

ndf_core::surface_conformance!(signed_distance, distance());
ndf_core::surface_conformance!(steep_density, density());
ndf_core::surface_conformance!(
    boxed_field,
    LevelSetSurface::new(Box::new(*distance().field()) as Box<dyn ImplicitField>)
);

/// Points at most `away` off the torus, with guides up to some 25° from the normals.
fn queries(away: f64) -> Vec<Query> {
    let torus = distance();
    ndf_core::conformance::cloud(&torus, 2000)
        .into_iter()
        .filter(|p| p.truncate().length() > 0.1)
        .map(|p| {
            let foot = torus.field().closest(p);
            let core = torus.field().ring * DVec3::new(p.x, p.y, 0.0).normalize();
            let normal = (foot - core).normalize();
            let guide = (normal + 0.4 * (7.0 * p).map(f64::sin)).normalize();
            let point = foot + away * (31.0 * p.x).sin() * normal;
            Query { point, normal: Some(guide), hint: Hint::NONE }
        })
        .collect()
}

#[test]
fn feet_are_the_closest_points() {
    for surface in [distance(), density()] {
        let level_distance =
            if surface.field().level == 0.0 { 0.0 } else { (40.0_f64 / 12.0 - 1.0).ln() / 60.0 };
        let torus = Torus { tube: 0.4 + level_distance, ..*surface.field() };
        let queries = queries(0.05);
        for (query, foot) in queries.iter().zip(projected(&surface, &queries)) {
            let foot = foot.unwrap();
            let error = foot.point.distance(torus.closest(query.point));
            assert!(error < 1e-5, "{query:?} → {foot:?}, off by {error}");
        }
    }
}

#[test]
fn fields_without_gradients_are_crossed_along_guides() {
    let surface = occupancy();
    let queries = queries(0.05);
    for (query, foot) in queries.iter().zip(projected(&surface, &queries)) {
        let foot = foot.unwrap();
        assert!(
            surface.field().signed_distance(foot.point).abs() <= surface.tolerance(),
            "{query:?} → {foot:?}"
        );
        let off = (foot.point - query.point).reject_from(query.normal.unwrap()).length();
        assert!(off < 1e-12, "{query:?} → {foot:?} is off its line by {off}");
        assert!(foot.normal.dot(query.normal.unwrap()) > 0.0);
    }
    assert_eq!(projected(&surface, &[Query::at(DVec3::ZERO)])[0], Err(Miss::NoCrossing));
}

#[test]
fn guides_tell_the_sides_of_a_wall_apart() {
    /// The slab |z| < 0.01.
    struct Slab;
    impl ImplicitField for Slab {
        fn values(&self, points: &[DVec3], values: &mut [f64]) {
            points.iter().zip(values).for_each(|(p, v)| *v = p.z.abs() - 0.01);
        }
        fn bounds(&self) -> BoundingBox {
            BoundingBox { min: DVec3::new(-1.0, -1.0, -0.01), max: DVec3::new(1.0, 1.0, 0.01) }
        }
        fn level(&self) -> f64 {
            0.0
        }
        fn inside(&self) -> Inside {
            Inside::Below
        }
    }
    let slab = LevelSetSurface::new(Slab);
    let below_the_middle = Query { normal: Some(DVec3::Z), ..Query::at(DVec3::new(0.2, 0.1, -0.004)) };
    let foot = projected(&slab, &[below_the_middle])[0].unwrap();
    assert!(foot.point.distance(DVec3::new(0.2, 0.1, 0.01)) < 1e-6, "{foot:?}");
    assert!(foot.normal.dot(DVec3::Z) > 0.999);
    // A point that has strayed through the wall finds back, unless the wall is too thick for that.
    let beyond = Query { normal: Some(DVec3::Z), ..Query::at(DVec3::new(0.2, 0.1, -0.013)) };
    let foot = projected(&slab, &[beyond])[0].unwrap();
    assert!(foot.point.distance(DVec3::new(0.2, 0.1, 0.01)) < 1e-6, "{foot:?}");
    let search = LevelSearch { guide_reach: 0.001, ..*slab.search() };
    let foot = projected(&slab.with_search(search), &[beyond])[0].unwrap();
    assert!(foot.point.distance(DVec3::new(0.2, 0.1, -0.01)) < 1e-6, "{foot:?}");
}

#[test]
fn levels_far_along_the_guide_yield_to_nearer_ones() {
    /// A floor and a wall: z < 0 and x > 0.05 are inside.
    struct Corner;
    impl ImplicitField for Corner {
        fn values(&self, points: &[DVec3], values: &mut [f64]) {
            points.iter().zip(values).for_each(|(p, v)| *v = p.z.min(0.05 - p.x));
        }
        fn bounds(&self) -> BoundingBox {
            BoundingBox { min: DVec3::splat(-1.0), max: DVec3::splat(1.0) }
        }
        fn level(&self) -> f64 {
            0.0
        }
        fn inside(&self) -> Inside {
            Inside::Below
        }
    }
    let corner = LevelSetSurface::new(Corner);
    assert!(corner.search().guide_reach > 0.05 && NEAR * corner.search().step < 0.05);
    // The guide is that of the wall, the floor is fifty times nearer.
    let query = Query { normal: Some(-DVec3::X), ..Query::at(DVec3::new(0.0, 0.2, 0.001)) };
    let foot = projected(&corner, &[query])[0].unwrap();
    assert!(foot.point.distance(DVec3::new(0.0, 0.2, 0.0)) < 1e-6, "{foot:?}");
    // Where both are near the guide decides.
    let query = Query { normal: Some(-DVec3::X), ..Query::at(DVec3::new(0.04, 0.2, 0.005)) };
    let foot = projected(&corner, &[query])[0].unwrap();
    assert!(foot.point.distance(DVec3::new(0.05, 0.2, 0.005)) < 1e-6, "{foot:?}");
}

#[test]
fn what_is_out_of_reach_misses() {
    let surface = distance();
    let far = Query { normal: Some(DVec3::Z), ..Query::at(DVec3::new(1.0, 0.0, 5.0)) };
    assert_eq!(projected(&surface, &[far])[0], Err(Miss::NoCrossing));
    let search = LevelSearch { reach: 10.0, ..*surface.search() };
    assert!(projected(&surface.with_search(search), &[far])[0].is_ok());
}
