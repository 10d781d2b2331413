//! Point clouds, with normals and without.
//!
//! - [`OrientedCloud`] is the level ½ of the winding number of points with normals.
//! - [`unoriented_cloud`] makes a surface of points alone: [`orient`] gives them normals that agree on what is outside,
//!   [`MovingSpheres`] is a smooth surface near them.

mod areas;
mod eigen;
mod local_planes;
mod moving_spheres;
mod neighbours;
mod orientation;
mod oriented_cloud;
mod outliers;
mod thinning;
mod unoriented;
mod winding_field;

pub use areas::areas;
pub use local_planes::{LocalPlanes, agreement_of_normals};
pub use moving_spheres::MovingSpheres;
pub use neighbours::{Neighbour, Neighbours};
pub use orientation::{Orientation, orient};
pub use oriented_cloud::OrientedCloud;
pub use outliers::without_outliers;
pub use thinning::evenly_picked;
pub use unoriented::{UnorientedCloud, unoriented_cloud};
pub use winding_field::{WindingField, WindingFieldOptions};
