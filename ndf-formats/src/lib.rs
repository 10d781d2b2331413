//! Readers of the files in which surfaces come that are no meshes: scans ([`point_cloud`]), Gaussian [`splats`], and the
//! [`tensors`] of networks. And a writer of sparse matrices, for those who compute elsewhere ([`sparse`]).
//!
//! What a file is, its content decides ([`sniff()`]). No reader trusts it: nothing in a file is executed, counts reserve no memory before
//! the data is there, and every malformed file ends in an error of one sentence. Formats that need large libraries are
//! features of this crate, all on by default; files of a format that was left out are still recognised, and refused with
//! the name of the feature.
//!
//! ```
//! use ndf_formats::point_cloud::{CloudOptions, parse_cloud};
//!
//! let text = b"0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 1\n";
//! let file = parse_cloud(text, "corner.xyz".as_ref(), &CloudOptions::default())?;
//! assert_eq!((file.cloud.positions().len(), file.report.duplicates), (4, 1));
//! # Ok::<(), ndf_formats::point_cloud::ReadError>(())
//! ```

pub mod point_cloud;
mod sniff;
#[cfg(feature = "zip")]
pub mod sparse;
pub mod splats;
pub mod tensors;

pub use sniff::{Format, sniff};
