//! Pictures of meshes by ray casting: [`render`] takes a [`Scene`], a [`Camera`] and a [`Style`] to an
//! [`Image`] of linear colour with depth, normals and scalars, and touches nothing else.
//!
//! One ray a pixel finds the surface. Occlusion of the surroundings and soft shadows are gathered on every
//! fourth pixel and spread over neighbours on the same piece of surface; pixels across which the surface, its
//! normal or the light changes are cast again with many rays. Lines on the surface are as wide as they are on
//! the screen, by their distance in pixels. The same scene gives the same picture on any number of threads.

mod camera;
mod export;
mod legend;
mod lighting;
mod lines;
mod normals;
mod points;
mod shading;
mod tubes;
mod upright;

pub use camera::{Camera, Up, View};
pub use export::{exr_bytes, png_bytes};
pub use legend::{strip_width, with_legend};
pub use ndf_mesh::colour_map::{ColourMap, Legend};
pub use points::{MAX_POINTS, discs};
pub use tubes::{with_open_tubes, with_tubes};
pub use upright::upright;

use ndf_core::{DVec3, Progress};
use ndf_mesh::{Face, RayHit, TriangleMesh, TriangleTree};
use rayon::prelude::*;

use lighting::Lighting;
use normals::CornerNormals;

/// Side of the grid of rays in a pixel that is cast again.
const FINE: usize = 4;

/// A mesh ready to be seen, with values to be painted on it.
#[derive(Debug)]
pub struct Scene<'a> {
    mesh: &'a TriangleMesh,
    tree: TriangleTree,
    normals: CornerNormals,
    /// One value a vertex, and how they become colours.
    scalar: Option<(&'a [f32], ColourMap)>,
    /// The first face that is of lines and not of the surface.
    lines: usize,
}

impl<'a> Scene<'a> {
    /// A scene of a mesh. O(n log n).
    ///
    /// # Panics
    /// If the mesh has 2²⁸ faces or more.
    pub fn new(mesh: &'a TriangleMesh) -> Self {
        let (tree, normals) = (TriangleTree::new(mesh), CornerNormals::of(mesh));
        Self { mesh, tree, normals, scalar: None, lines: mesh.face_count() }
    }

    /// The scene, of whose mesh the faces from this one on are [of lines](with_tubes): they have a colour of their own.
    #[must_use]
    pub fn with_lines_from(self, lines: usize) -> Self {
        Self { lines, ..self }
    }

    /// The scene painted with a value for every vertex. Values that are not finite are grey.
    ///
    /// # Panics
    /// If the number of values is not that of the vertices.
    #[must_use]
    pub fn painted(self, values: &'a [f32], map: ColourMap) -> Self {
        assert_eq!(values.len(), self.mesh.vertex_count());
        Self { scalar: Some((values, map)), ..self }
    }

    /// Values at the corners of a face.
    fn corner_values(&self, face: Face) -> Option<[f64; 3]> {
        let (values, _) = self.scalar.as_ref()?;
        Some(self.mesh.faces()[face.index()].map(|v| f64::from(values[v as usize])))
    }
}

/// How a scene is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    /// Lines of equal value, evenly spaced between the least and the greatest.
    pub isolines: u32,
    /// Whether the edges of the mesh are drawn.
    pub wireframe: bool,
    /// Whether every face has one normal; otherwise normals are smooth across edges that are not sharp.
    pub flat: bool,
    /// Whether sides mean nothing; otherwise those of faces that are seen from inside have a colour that shows it.
    pub two_sided: bool,
    /// Reflectance of the surface where no scalar paints it, linear.
    pub colour: [f32; 3],
}

impl Default for Style {
    fn default() -> Self {
        Self { isolines: 0, wireframe: false, flat: false, two_sided: false, colour: [0.30, 0.43, 0.60] }
    }
}

/// A picture, row by row from the top.
#[derive(Clone, Debug)]
pub struct Image {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Linear red, green and blue times opacity, and opacity (0 where nothing is seen).
    pub colour: Vec<[f32; 4]>,
    /// Distance along the axis of the camera, in the mesh's units; infinite where nothing is seen.
    pub depth: Vec<f32>,
    /// Unit normal in the mesh's coordinates, towards the camera; zero where nothing is seen.
    pub normal: Vec<[f32; 3]>,
    /// Value of the scalar; NaN where there is none.
    pub scalar: Vec<f32>,
}

/// What a ray met, with all that shading needs.
struct Surfel {
    hit: RayHit,
    direction: DVec3,
    position: DVec3,
    /// Unit normal of the face, towards the camera.
    face_normal: DVec3,
    /// Unit normal for shading, towards the camera.
    normal: DVec3,
    /// Whether the face is seen from inside.
    is_back: bool,
}

/// Draws a scene. About 3 rays a pixel of the picture, and 6 more a pixel of the surface.
pub fn render(scene: &Scene<'_>, camera: &Camera, style: &Style, progress: &dyn Progress) -> Image {
    let (width, height) = camera.size();
    let pixels = width * height;
    progress.report("drawing", 0.0);
    let surfels: Vec<Option<Surfel>> = (0..pixels)
        .into_par_iter()
        .map(|i| cast(scene, style, camera, (i % width) as f64 + 0.5, (i / width) as f64 + 0.5))
        .collect();
    progress.report("drawing", 0.2);
    let lighting = Lighting::gather(scene, camera, &surfels);
    progress.report("drawing", 0.6);
    let centre: Vec<[f32; 4]> = (0..pixels)
        .into_par_iter()
        .map(|i| match &surfels[i] {
            Some(surfel) => shading::shade(scene, camera, style, &lighting, i, surfel),
            None => [0.0; 4],
        })
        .collect();
    progress.report("drawing", 0.8);
    let colour = (0..pixels)
        .into_par_iter()
        .map(|i| {
            if is_uniform(camera, &surfels, &centre, i) {
                return centre[i];
            }
            let mut sum = [0.0; 4];
            for k in 0..FINE * FINE {
                // Rows are shifted against each other, so that upright edges meet as many columns as rays.
                let (row, column) = (k / FINE, k % FINE);
                let shift = (row as f64 + 0.5) / (FINE * FINE) as f64;
                let x = (i % width) as f64 + column as f64 / FINE as f64 + shift;
                let y = (i / width) as f64 + (row as f64 + 0.5) / FINE as f64;
                if let Some(surfel) = cast(scene, style, camera, x, y) {
                    let sample = shading::shade(scene, camera, style, &lighting, i, &surfel);
                    sum.iter_mut().zip(sample).for_each(|(s, x)| *s += x / (FINE * FINE) as f32);
                }
            }
            sum
        })
        .collect();
    progress.report("drawing", 1.0);
    let depth = |s: &Surfel| (s.hit.t * s.direction.dot(camera.forward())) as f32;
    Image {
        width,
        height,
        colour,
        depth: surfels.iter().map(|s| s.as_ref().map_or(f32::INFINITY, depth)).collect(),
        normal: surfels
            .iter()
            .map(|s| s.as_ref().map_or([0.0; 3], |s| s.normal.as_vec3().to_array()))
            .collect(),
        scalar: surfels.iter().map(|s| s.as_ref().map_or(f32::NAN, |s| s.value(scene) as f32)).collect(),
    }
}

impl Surfel {
    /// The scalar here, NaN if there is none.
    fn value(&self, scene: &Scene<'_>) -> f64 {
        scene.corner_values(self.hit.at.face).map_or(f64::NAN, |values| self.hit.at.interpolate(values))
    }
}

/// What is seen at a place of the picture, in pixels from its upper left corner.
fn cast(scene: &Scene<'_>, style: &Style, camera: &Camera, x: f64, y: f64) -> Option<Surfel> {
    let direction = camera.direction(x, y);
    let hit = scene.tree.first_hit(camera.eye(), direction)?;
    let outward = scene.mesh.face_normal(hit.at.face);
    let is_back = outward.dot(direction) > 0.0;
    let face_normal = if is_back { -outward } else { outward };
    let smooth = scene.normals.at(&hit.at) * if is_back { -1.0 } else { 1.0 };
    // An interpolated normal may turn away from the camera near an outline, where the face does not.
    let is_usable = !style.flat && smooth.dot(direction) < 0.0;
    let normal = if is_usable { smooth } else { face_normal };
    let is_back = is_back && !style.two_sided;
    Some(Surfel { hit, direction, position: camera.eye() + hit.t * direction, face_normal, normal, is_back })
}

/// Whether one ray tells all about a pixel: its neighbours continue the same surface in the same light.
fn is_uniform(camera: &Camera, surfels: &[Option<Surfel>], centre: &[[f32; 4]], i: usize) -> bool {
    let (width, height) = camera.size();
    let (x, y) = (i % width, i / width);
    let mut neighbours = [
        (x > 0).then(|| i - 1),
        (x + 1 < width).then(|| i + 1),
        (y > 0).then(|| i - width),
        (y + 1 < height).then(|| i + width),
    ]
    .into_iter()
    .flatten();
    neighbours.all(|n| match (&surfels[i], &surfels[n]) {
        (None, None) => true,
        (Some(a), Some(b)) => {
            let step = 4.0 * camera.pixel_size(a.hit.t);
            let continues = a.face_normal.dot(b.position - a.position).abs() <= step
                || b.face_normal.dot(b.position - a.position).abs() <= step;
            let contrast = centre[i].iter().zip(centre[n]).map(|(p, q)| (p - q).abs()).fold(0.0, f32::max);
            continues && a.is_back == b.is_back && contrast < 0.06
        }
        _ => false,
    })
}

#[cfg(test)]
mod tests;
