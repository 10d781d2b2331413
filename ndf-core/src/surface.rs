//! What a surface must answer to be learned: projection, and optionally a scalar field.
//!
//! [`Surface`] is the plug-in point of the project: a new representation implements its two required
//! methods and passes [the conformance suite](crate::conformance). Abilities that only some
//! representations have are offered through `as_…` methods, not by more required ones.

use crate::{BoundingBox, DVec3};

/// What a surface remembers of an earlier answer to make the next one near it cheap (the last triangle, the
/// last leaf). Opaque to everyone but the surface that made it; never changes an answer beyond its tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Hint(pub u32);

impl Hint {
    /// Nothing is known.
    pub const NONE: Self = Self(u32::MAX);

    /// The remembered value, if there is one.
    pub fn get(self) -> Option<u32> {
        (self != Self::NONE).then_some(self.0)
    }
}

impl Default for Hint {
    fn default() -> Self {
        Self::NONE
    }
}

/// A point to be projected: `P(p, n)` of the method.
#[derive(Clone, Copy, Debug)]
pub struct Query {
    /// The point, in the surface's own coordinates.
    pub point: DVec3,
    /// Unit normal of the learned surface at that point. A surface may use it to tell the near side of a thin
    /// wall from the far one, or as the direction of a search. `None`: no guidance.
    pub normal: Option<DVec3>,
    /// The hint of the last foot of a nearby point, or [`Hint::NONE`].
    pub hint: Hint,
}

impl Query {
    /// A query without guidance.
    pub fn at(point: DVec3) -> Self {
        Self { point, normal: None, hint: Hint::NONE }
    }
}

/// Where a point came down on the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot {
    /// The point of the surface.
    pub point: DVec3,
    /// Unit outward normal of the surface there.
    pub normal: DVec3,
    /// To be given with the next query near this one.
    pub hint: Hint,
}

/// Why a point has no foot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Miss {
    /// The query has a NaN or infinite coordinate.
    #[error("the query is not finite")]
    NotFinite,
    /// The search along the normal found no crossing of the level.
    #[error("no crossing of the level along the normal")]
    NoCrossing,
    /// The surface has nothing within its search radius.
    #[error("no part of the surface is within reach")]
    OutOfReach,
}

/// The answer to one [`Query`]. One stray query never fails a batch.
pub type Answer = Result<Foot, Miss>;

/// A surface of any representation, seen through its projection operator.
///
/// Implementations answer for a slice of queries on the calling thread; callers split large batches over
/// threads with [`project_all`](crate::project::project_all). The trait is object-safe; the trainer sees
/// `&dyn Surface` only.
///
/// Contract (checked by [`conformance`](crate::conformance)):
/// - a foot lies on the surface within [`tolerance`](Surface::tolerance);
/// - projecting a foot moves it by no more than twice the tolerance;
/// - normals are unit and outward;
/// - an answer depends on its query alone, not on the rest of the batch, the hint or the thread (up to the
///   tolerance);
/// - a query that is not finite is a [`Miss::NotFinite`].
pub trait Surface: Send + Sync {
    /// A finite box that contains the surface.
    fn bounds(&self) -> BoundingBox;

    /// Projects every query; `feet[i]` answers `queries[i]`. The slices have the same length.
    fn project(&self, queries: &[Query], feet: &mut [Answer]);

    /// How many queries a call should have, where there are so many: enough to hide what a call costs, few enough to share them
    /// among threads.
    fn batch(&self) -> usize {
        256
    }

    /// How far a foot may be from the surface.
    fn tolerance(&self) -> f64 {
        1e-9 * self.bounds().diagonal()
    }

    /// Its area, where that is known exactly.
    fn area(&self) -> Option<f64> {
        None
    }

    /// The scalar field whose level set this surface is, where it has one. Base meshes are made from it.
    fn as_field(&self) -> Option<&dyn ImplicitField> {
        None
    }
}

/// Which side of the level is the inside of the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inside {
    /// Values below the level, as for signed distances.
    Below,
    /// Values above the level, as for densities, occupancies and winding numbers.
    Above,
}

/// A scalar function on space and the level whose isosurface is meant.
pub trait ImplicitField: Send + Sync {
    /// Values at `points`: `values[i]` for `points[i]`. On the calling thread. A point where the field has no
    /// value gets NaN.
    fn values(&self, points: &[DVec3], values: &mut [f64]);

    /// Gradients at `points`. The default takes central differences of [`values`](Self::values) with a step of
    /// [`difference_step`](Self::difference_step); its error is second order in that step.
    fn gradients(&self, points: &[DVec3], gradients: &mut [DVec3]) {
        let h = self.difference_step();
        let stencil: Vec<DVec3> = points
            .iter()
            .flat_map(|&p| DVec3::AXES.into_iter().flat_map(move |axis| [p + axis * h, p - axis * h]))
            .collect();
        let mut values = vec![0.0; stencil.len()];
        self.values(&stencil, &mut values);
        for (gradient, v) in gradients.iter_mut().zip(values.chunks_exact(6)) {
            *gradient = DVec3::new(v[0] - v[1], v[2] - v[3], v[4] - v[5]) / (2.0 * h);
        }
    }

    /// Values and gradients at once, for fields where one comes cheap with the other.
    fn values_and_gradients(&self, points: &[DVec3], values: &mut [f64], gradients: &mut [DVec3]) {
        self.values(points, values);
        self.gradients(points, gradients);
    }

    /// A finite box that contains the isosurface.
    fn bounds(&self) -> BoundingBox;

    /// The value of the isosurface.
    fn level(&self) -> f64;

    /// The side of the level that is inside.
    fn inside(&self) -> Inside;

    /// A bound on the change of the value per unit of length, if the field has one (1 for a distance). It lets
    /// a mesher skip space that cannot contain the surface.
    fn lipschitz(&self) -> Option<f64> {
        None
    }

    /// How many points a call should have, where there are so many: as that of a [`Surface`].
    fn batch(&self) -> usize {
        512
    }

    /// Step of the default gradient, in units of length.
    fn difference_step(&self) -> f64 {
        1e-5 * self.bounds().diagonal()
    }
}

/// Fields behind pointers are fields: what is generic over a field also takes `&dyn ImplicitField` and boxes.
macro_rules! forward_field {
    ($($pointer:ty),*) => {$(
        impl<F: ImplicitField + ?Sized> ImplicitField for $pointer {
            fn values(&self, points: &[DVec3], values: &mut [f64]) {
                (**self).values(points, values);
            }
            fn gradients(&self, points: &[DVec3], gradients: &mut [DVec3]) {
                (**self).gradients(points, gradients);
            }
            fn values_and_gradients(&self, points: &[DVec3], values: &mut [f64], gradients: &mut [DVec3]) {
                (**self).values_and_gradients(points, values, gradients);
            }
            fn bounds(&self) -> BoundingBox {
                (**self).bounds()
            }
            fn level(&self) -> f64 {
                (**self).level()
            }
            fn inside(&self) -> Inside {
                (**self).inside()
            }
            fn lipschitz(&self) -> Option<f64> {
                (**self).lipschitz()
            }
            fn batch(&self) -> usize {
                (**self).batch()
            }
            fn difference_step(&self) -> f64 {
                (**self).difference_step()
            }
        }
    )*};
}

forward_field!(&F, Box<F>);
