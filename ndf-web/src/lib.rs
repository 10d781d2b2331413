//! ndf in the browser: models and meshes, exact geodesics and spectra as WebAssembly.
//!
//! [`Surface`] does what the commands `extract`, `geodesic` and `spectrum` of the program do, from bytes to arrays. It knows
//! nothing of JavaScript; the module `bindings` is what the npm package `ndf-geometry` calls. Nothing here asks for the time
//! or for threads, which WebAssembly has not.
//!
//! ```
//! use ndf_web::Surface;
//!
//! let tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
//! let mut surface = Surface::open(tetrahedron.as_bytes(), "tetrahedron.obj")?;
//! assert_eq!(surface.distances(0)?, [0.0, 1.0, 1.0, 1.0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bindings;
mod description;
mod error;
mod surface;

pub use description::{Description, Range};
pub use error::SurfaceError;
pub use surface::{Path, Surface};
