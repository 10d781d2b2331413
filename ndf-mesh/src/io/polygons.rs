//! Polygons of a file to triangles of a mesh.

use ndf_core::DVec3;

use super::{Content, Parsed, ReadNote, VertexScalars};
use crate::TriangleMesh;

/// Collects polygons as fans of triangles and remembers what there is to say about them.
#[derive(Default)]
pub(super) struct Triangles {
    faces: Vec<[u32; 3]>,
    polygons: usize,
    too_small: usize,
}

impl Triangles {
    /// Adds a polygon, cut into a fan at its first corner. Fewer than three corners enclose nothing and are
    /// only counted.
    pub(super) fn add(&mut self, corners: &[u32]) {
        match corners {
            [] | [_] | [_, _] => self.too_small += 1,
            [first, rest @ ..] => {
                self.polygons += usize::from(corners.len() > 3);
                self.faces.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
            }
        }
    }

    /// Adds a strip of triangles: every corner after the second makes a triangle with the two before it.
    pub(super) fn add_strip(&mut self, corners: &[u32]) {
        for (i, three) in corners.windows(3).enumerate() {
            let [a, b, c] = [three[0], three[1], three[2]];
            self.faces.push(if i % 2 == 0 { [a, b, c] } else { [b, a, c] });
        }
    }

    /// The mesh of these triangles over `positions`.
    pub(super) fn into_content(self, positions: Vec<DVec3>, scalars: Vec<VertexScalars>) -> Parsed {
        let mesh = TriangleMesh::new(positions, self.faces)?;
        let mut notes = Vec::new();
        if self.polygons > 0 {
            notes.push(ReadNote::PolygonsCut { faces: self.polygons });
        }
        if self.too_small > 0 {
            notes.push(ReadNote::FacesTooSmall { faces: self.too_small });
        }
        Ok(Content { mesh, scalars, notes })
    }
}
