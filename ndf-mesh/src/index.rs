//! Indices of vertices, edges, faces and half-edges, each kind a type of its own: what asks for a half-edge takes no
//! face.
//!
//! ```compile_fail,E0308
//! use ndf_mesh::{Face, ManifoldMesh, shapes};
//!
//! let sphere = ManifoldMesh::try_from(shapes::icosphere(1)).unwrap();
//! sphere.topology().twin(Face(0));
//! ```
//!
//! Half-edges are implicit: half-edge `3 f + c` runs from corner `c` of face `f` to the next corner. So what is around a
//! face is known without a mesh:
//!
//! ```
//! use ndf_mesh::{Face, Halfedge};
//!
//! let [first, second, third] = Face(2).halfedges();
//! assert_eq!([first, second, third], [6, 7, 8].map(Halfedge));
//! assert_eq!((first.previous(), third.next()), (third, first));
//! assert_eq!((second.face(), second.corner()), (Face(2), 1));
//! ```

use std::fmt;

use serde::Serialize;

macro_rules! indices {
    ($($(#[$doc:meta])* $name:ident)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
        #[repr(transparent)]
        pub struct $name(pub u32);

        impl $name {
            /// The one with this place in an array of them all; the place must not exceed `u32::MAX`.
            #[inline]
            pub fn new(index: usize) -> Self {
                debug_assert!(index <= u32::MAX as usize);
                Self(index as u32)
            }

            /// Its place in an array of them all.
            #[inline]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }

        impl From<u32> for $name {
            #[inline]
            fn from(index: u32) -> Self {
                Self(index)
            }
        }

        impl From<$name> for u32 {
            #[inline]
            fn from(index: $name) -> Self {
                index.0
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }

        /// The number alone: fields and variants that hold it say what it counts.
        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }
    )*};
}

indices! {
    /// Index of a vertex.
    Vertex
    /// Index of an edge.
    Edge
    /// Index of a face.
    Face
    /// Index of a half-edge: a side of a face, from one of its corners to the next.
    Halfedge
}

impl Face {
    /// Its half-edges; the first leaves its first corner.
    #[inline]
    pub fn halfedges(self) -> [Halfedge; 3] {
        [0, 1, 2].map(|corner| self.halfedge(corner))
    }

    /// The half-edge that leaves a corner: 0, 1 or 2.
    #[inline]
    pub fn halfedge(self, corner: usize) -> Halfedge {
        Halfedge(3 * self.0 + corner as u32)
    }
}

impl Halfedge {
    /// Its face.
    #[inline]
    pub fn face(self) -> Face {
        Face(self.0 / 3)
    }

    /// The corner of its face that it leaves: 0, 1 or 2.
    #[inline]
    pub fn corner(self) -> usize {
        (self.0 % 3) as usize
    }

    /// The next half-edge around the same face.
    #[inline]
    pub fn next(self) -> Self {
        Self(if self.0 % 3 == 2 { self.0 - 2 } else { self.0 + 1 })
    }

    /// The previous half-edge around the same face.
    #[inline]
    pub fn previous(self) -> Self {
        Self(if self.0.is_multiple_of(3) { self.0 + 2 } else { self.0 - 1 })
    }
}
