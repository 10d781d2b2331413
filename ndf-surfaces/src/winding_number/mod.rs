//! Generalized winding numbers, hierarchical.
//!
//! `w(q)` is the sum of the signed solid angles of all triangles seen from `q`, over 4π (Jacobson, Kavan and
//! Sorkine-Hornung 2013): the integer number of times a closed mesh winds around `q`, and a smooth
//! interpolation of it where there are holes. Unlike the side of the closest face, a majority of the whole mesh
//! decides about inside and outside: a wrong, missing or doubled triangle harms only its own surroundings, and
//! self-intersecting pieces unite.
//!
//! Far triangles are replaced by the Taylor expansion of their common field to second order about
//! their area-weighted centroid (Barill, Dickson, Schmidt, Levin and Jacobson 2018, "Fast winding numbers for
//! soups and clouds"), where the query is more than β = 2 radii away; near ones are summed exactly
//! (Van Oosterom and Strackee 1983).
//!
//! A cloud of points with normals and areas has a winding number as well, a sum of dipoles: [`PointWindingNumber`].

mod arc_tangent;
mod expansion;
mod points;
mod tree;
mod triangles;

pub use points::PointWindingNumber;
pub use triangles::WindingNumber;
