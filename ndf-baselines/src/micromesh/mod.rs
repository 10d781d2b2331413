//! Micromeshes (Maggiordomo, Moreton and Tarini 2023): a coarse mesh whose faces are subdivided evenly, and whose
//! micro-vertices are moved along directions interpolated from its vertices, by amounts of 11 bits.
//!
//! Edges are collapsed at the cost of quadrics divided by measures of how well the result can be displaced. Each vertex gets
//! the direction that the faces around it see best. Each face gets a level, such that levels of neighbours differ by one at
//! most; on an edge between levels the finer side leaves out every other micro-vertex. Rays along the directions find the
//! input.
//!
//! What is ours: levels follow from the size of a face alone, for inputs of even density, in place of the input's local
//! density; boundaries are held by planes as in our decimation, and not baked; a ray that finds nothing takes the closest
//! point instead.
//!
//! Bytes are counted as the container of micromaps has them: values are not shared between faces. A file is what
//! [`Micromesh::to_bytes`] writes: the numbers of vertices and faces, positions in single and directions in half precision,
//! corners in as few bits as name a vertex, 3 bits of level and 11 bits a micro-vertex for each face.

mod baking;
mod decimation;
mod directions;
mod file;
mod layout;
#[cfg(test)]
mod tests;

use ndf_core::{Cancelled, DVec3, Progress};
use ndf_mesh::{ManifoldMesh, TriangleMesh};

pub use file::MicromeshFileError;
use layout::{Layout, Site};

/// The highest level: 4⁵ micro-faces a face.
pub const MAX_LEVEL: u8 = 5;
/// Bits of a displacement.
pub const DISPLACEMENT_BITS: u32 = 11;
/// The largest displacement: the whole direction of a place.
pub const FULL: u16 = (1 << DISPLACEMENT_BITS) - 1;

/// What to make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MicromeshOptions {
    /// Faces of the coarse mesh.
    pub base_faces: usize,
    /// Micro-faces wished for; as many as the input has faces if not given.
    pub micro_faces: Option<usize>,
}

impl MicromeshOptions {
    /// A coarse mesh of so many faces, and as many micro-faces as the input has faces.
    pub fn to_faces(base_faces: usize) -> Self {
        Self { base_faces, micro_faces: None }
    }
}

/// A micromesh. Made by [`micromesh`] or read by [`Micromesh::from_bytes`], which check that everything fits.
#[derive(Clone, Debug, PartialEq)]
pub struct Micromesh {
    positions: Vec<[f32; 3]>,
    /// In units of `scale`.
    directions: Vec<[half::f16; 3]>,
    scale: f32,
    faces: Vec<[u32; 3]>,
    levels: Vec<u8>,
    /// For each face, the displacements of its micro-vertices in the order of [`Layout`].
    displacements: Vec<Vec<u16>>,
}

/// Makes a micromesh of a mesh. Deterministic, over all threads; about 0.1 ms a collapse, and three rays a micro-vertex.
///
/// # Errors
/// [`Cancelled`], if the observer asks to stop.
pub fn micromesh(
    mesh: &ManifoldMesh,
    options: &MicromeshOptions,
    progress: &dyn Progress,
) -> Result<Micromesh, Cancelled> {
    let base = decimation::decimated(mesh, options.base_faces, progress)?;
    let levels = layout::levels(&base, options.micro_faces.unwrap_or(mesh.face_count()));
    progress.report("displacements", 0.0);
    let baked = baking::bake(&base, &levels, mesh);
    progress.check()?;
    progress.report("displacements", 1.0);
    Ok(baked)
}

impl Micromesh {
    /// Number of faces of the coarse mesh.
    pub fn base_face_count(&self) -> usize {
        self.faces.len()
    }

    /// The level of each face: it has 4 to that power micro-faces, less those that coarser neighbours take.
    pub fn levels(&self) -> &[u8] {
        &self.levels
    }

    /// Number of displacements, those on common edges once for each face.
    pub fn displacement_count(&self) -> usize {
        self.displacements.iter().map(Vec::len).sum()
    }

    /// The place of a vertex at the bottom of the layer within which displacements lie.
    pub(crate) fn position(&self, v: u32) -> DVec3 {
        DVec3::from_array(self.positions[v as usize].map(f64::from))
    }

    /// The way from the bottom to the top of the layer at a vertex.
    pub(crate) fn direction(&self, v: u32) -> DVec3 {
        DVec3::from_array(self.directions[v as usize].map(f64::from)) * f64::from(self.scale)
    }

    /// The bottom of the layer at a point of a face, and the way to the top.
    pub(crate) fn layer(&self, face: usize, barycentric: [f64; 3]) -> [DVec3; 2] {
        let mix = |of: &dyn Fn(u32) -> DVec3| {
            self.faces[face].iter().zip(barycentric).map(|(&v, share)| share * of(v)).sum()
        };
        [mix(&|v| self.position(v)), mix(&|v| self.direction(v))]
    }

    /// The mesh of all micro-faces, closed where the coarse mesh is.
    pub fn tessellated(&self) -> TriangleMesh {
        let layout = Layout::new(self.positions.len(), &self.faces, &self.levels);
        let place = |site: &Site| {
            let [bottom, way] = self.layer(site.face, site.barycentric);
            let value = self.displacements[site.face][site.place];
            bottom + f64::from(value) / f64::from(FULL) * way
        };
        let positions = layout.sites.iter().map(place).collect();
        let triangles = |(grid, &level): (&Vec<u32>, &u8)| layout::triangles(level, grid);
        let faces = layout.grids.iter().zip(&self.levels).flat_map(triangles).collect();
        TriangleMesh::new(positions, faces).expect("grids name micro-vertices")
    }
}
