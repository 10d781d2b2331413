//! The terms of the paper: their gradients, and values at points where they are known.

use ndf_core::DVec3;
use ndf_core::glam::Vec3;
use ndf_mesh::shapes;
use ndf_mesh::{Face, ManifoldMesh};
use ndf_model::file::StoredBase;
use ndf_model::intrinsic_network::IntrinsicEncoding;
use ndf_model::{FieldShape, NetworkShape};
use ndf_network::Activation;

use super::*;
use crate::base::Base;
use crate::loss_conformance;
use crate::settings::{ReverseMap, Settings};

loss_conformance!(projection, ProjectionDistance);
loss_conformance!(point, PointTarget);
loss_conformance!(normal, NormalAlignment);
loss_conformance!(conformal, Conformal);
loss_conformance!(dirichlet, Dirichlet);
loss_conformance!(anchors, {
    let base = StoredBase::new(&ManifoldMesh::try_from(shapes::icosphere(1)).unwrap(), None, 0.0);
    Anchors::new(&base, &[(DVec3::X, DVec3::Y)])
});
loss_conformance!(cycle_plain, Cycle::new(&smooth(ReverseMap::Plain)));
loss_conformance!(cycle_residual, Cycle::new(&smooth(ReverseMap::Residual)));
loss_conformance!(cycle_closest_point, Cycle::new(&smooth(ReverseMap::ClosestPoint)));
loss_conformance!(cycle_encoding, Cycle::new(&smooth(ReverseMap::Encoding)));
loss_conformance!(cycle_inverse, Cycle::new(&smooth(ReverseMap::Inverse)));
loss_conformance!(cycle_of_base, Cycle::of_base(&smooth(ReverseMap::Plain)));

/// Settings whose reverse map has neither kinks nor high frequencies, for differences. Its network is fed the features
/// of the conformance suite.
fn smooth(reverse_map: ReverseMap) -> Settings {
    let activation = Activation::Tanh;
    let field = FieldShape::from(NetworkShape { features: 4, activation, ..NetworkShape::default() });
    Settings { field, reverse_map, reverse_octaves: 1, ..Settings::default() }
}

#[test]
#[should_panic(expected = "wrong, by the image")]
fn a_wrong_gradient_is_found() {
    struct Wrong;
    impl Term for Wrong {
        fn name(&self) -> &str {
            "wrong"
        }
        fn accumulate(&self, block: &Block<'_>, weight: f32, gradients: &mut Gradients<'_>) -> f64 {
            gradients.images[0] += weight * block.images[0];
            f64::from(block.images[0].length_squared())
        }
    }
    crate::conformance::check(&Wrong);
}

/// Value and gradients of a term for one sample at x = g(x) = (1, 0, 0).
fn value(term: &dyn Term, u: Vec3, v: Vec3, target: Target) -> (f64, [Vec3; 3]) {
    let mesh = ManifoldMesh::try_from(shapes::icosphere(0)).unwrap();
    let base = Base::new(&mesh, ndf_model::file::BaseOrder::identity(&mesh));
    let shape = NetworkShape { features: 0, ..NetworkShape::default() };
    let block = Block {
        epoch: Epoch { number: 0, of: 1 },
        base: &[Vec3::X],
        images: &[Vec3::X],
        tangents: [&[u], &[v]],
        targets: &[target],
        network: None,
        places: &[Place { face: Face(0), barycentric: [1.0, 0.0, 0.0] }],
        mesh: &base,
        encoding: IntrinsicEncoding::new(&base.faces, &base.positions, &[], &shape),
        rows: &[],
        stride: 0,
        prepared: None,
        first: 0,
    };
    let (mut dy, mut du, mut dv) = ([Vec3::ZERO], [Vec3::ZERO], [Vec3::ZERO]);
    let mut gradients =
        Gradients { images: &mut dy, tangents: [&mut du, &mut dv], features: &mut [], network: None };
    let value = term.accumulate(&block, 1.0, &mut gradients);
    (value, [dy[0], du[0], dv[0]])
}

#[test]
fn terms_are_zero_where_they_should_be_and_leave_missed_samples_alone() {
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    let there = Target { foot: x, normal: z, surface_normal: z };
    assert_eq!(value(&ProjectionDistance, x, y, there).0, 0.0);
    assert_eq!(value(&PointTarget, x, y, there).0, 0.0);
    assert_eq!(value(&NormalAlignment, x, y, there).0, 0.0);
    assert!((value(&NormalAlignment, y, x, there).0 - 4.0).abs() < 1e-6);
    // Conformal maps of any scale have the least value, log(1 + e⁻⁵)/10.
    let least = (1.0 + (-5.0_f64).exp()).ln() / 10.0;
    let conformal = |scale: f32| value(&Conformal, scale * x, scale * y, there).0;
    assert!((conformal(1.0) - least).abs() < 1e-7 && (conformal(30.0) - least).abs() < 1e-7);
    assert!(value(&Conformal, x, Vec3::new(0.3, 0.5, 0.0), there).0 > least);
    for term in [&ProjectionDistance as &dyn Term, &PointTarget, &NormalAlignment, &Conformal] {
        assert_eq!(value(term, x, y, Target::NONE), (0.0, [Vec3::ZERO; 3]), "{}", term.name());
    }
    // Tangents that vanish give no NaN.
    let flat = value(&NormalAlignment, Vec3::ZERO, y, there);
    assert!(flat.0.is_finite() && flat.1.iter().all(|g| g.is_finite()));
    assert!(value(&Conformal, Vec3::ZERO, Vec3::ZERO, there).1.iter().all(|g| g.is_finite()));
}
