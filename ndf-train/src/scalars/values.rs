//! What is to be learned: values at the vertices of a mesh, and where samples of the base mesh find theirs.

use ndf_core::Hint;
use ndf_mesh::FacePoint;
use ndf_mesh::io::VertexScalars;
use ndf_mesh::{TriangleMesh, TriangleTree};
use ndf_model::Model;
use ndf_model::scalars::Channel;
use rayon::prelude::*;

use super::error::ScalarError;

/// Samples whose feet are found one after the other, each from the last.
const CHUNK: usize = 512;

/// Fields that vary by less than this share of their largest value are taken as constant: what is left is rounding.
const CONSTANT: f64 = 1e-6;

/// Fields on a mesh.
pub(super) struct Values {
    tree: TriangleTree,
    faces: Vec<[u32; 3]>,
    /// Names, ranges and units.
    pub(super) channels: Vec<Channel>,
    /// What the network is to give at the vertices: vertex by vertex, a value for every channel.
    outputs: Vec<f32>,
}

/// A point of the mesh of the values.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    corners: [u32; 3],
    weights: [f32; 3],
}

/// Samples of the base mesh, and the points of the mesh of the values closest to their images.
pub(super) struct Drawn {
    pub(super) points: Vec<FacePoint>,
    pub(super) feet: Vec<Foot>,
    /// Squared distances between images and feet, in the user's units.
    distances_squared: Vec<f64>,
}

impl Drawn {
    pub(super) fn distance_rms(&self) -> f64 {
        let sum: f64 = self.distances_squared.iter().sum();
        (sum / self.distances_squared.len() as f64).sqrt()
    }

    pub(super) fn distance_max(&self) -> f64 {
        self.distances_squared.iter().fold(0.0_f64, |max, d| max.max(*d)).sqrt()
    }
}

impl Values {
    pub(super) fn new(mesh: &TriangleMesh, scalars: &[VertexScalars]) -> Result<Self, ScalarError> {
        let vertices = mesh.vertex_count();
        let used = used_vertices(mesh);
        for VertexScalars { name, values } in scalars {
            if values.len() != vertices {
                return Err(ScalarError::Length { name: name.clone(), values: values.len(), vertices });
            }
            let count = values.iter().zip(&used).filter(|(x, used)| **used && !x.is_finite()).count();
            if count > 0 {
                return Err(ScalarError::NotFinite { name: name.clone(), count, vertices });
            }
        }
        let areas = vertex_areas(mesh);
        let total: f64 = areas.iter().sum();
        if !(total.is_finite() && total > 0.0) {
            return Err(ScalarError::NoArea);
        }
        // What no face uses has no value; any will do.
        let filled = |scalar: &VertexScalars| {
            let any = scalar.values.iter().zip(&used).find_map(|(x, used)| used.then_some(*x));
            let value = |(x, used): (&f32, &bool)| if *used { *x } else { any.unwrap_or(0.0) };
            let values = scalar.values.iter().zip(&used).map(value).collect();
            VertexScalars { name: scalar.name.clone(), values }
        };
        let scalars: Vec<VertexScalars> = scalars.iter().map(filled).collect();
        let channels: Vec<Channel> = scalars.iter().map(|s| channel(s, &areas, total)).collect();
        let mut outputs = vec![0.0; vertices * channels.len()];
        for (k, (channel, scalar)) in channels.iter().zip(&scalars).enumerate() {
            let column = outputs.iter_mut().skip(k).step_by(channels.len());
            column.zip(&scalar.values).for_each(|(to, value)| *to = channel.output(*value));
        }
        Ok(Self { tree: TriangleTree::new(mesh), faces: mesh.faces().to_vec(), channels, outputs })
    }

    /// The same values where the unit of a channel is its range.
    pub(super) fn in_ranges(mut self) -> Self {
        let count = self.channels.len();
        for (k, channel) in self.channels.iter_mut().enumerate().filter(|(_, c)| c.deviation > 0.0) {
            let range = (f64::from(channel.range[1]) - f64::from(channel.range[0])) as f32;
            let share = channel.deviation / range;
            self.outputs.iter_mut().skip(k).step_by(count).for_each(|x| *x *= share);
            channel.deviation = range;
        }
        self
    }

    /// What the network is to give at a foot.
    #[inline(always)]
    pub(super) fn outputs_at(&self, foot: &Foot, to: &mut [f32]) {
        let channels = self.channels.len();
        let [a, b, c] = foot.corners.map(|v| &self.outputs[v as usize * channels..][..channels]);
        let [u, v, w] = foot.weights;
        for (to, ((a, b), c)) in to.iter_mut().zip(a.iter().zip(b).zip(c)) {
            *to = u * a + v * b + w * c;
        }
    }

    /// Maps points of the base mesh to the surface and finds their feet.
    pub(super) fn draw(&self, model: &Model, points: &[FacePoint]) -> Result<Drawn, ScalarError> {
        let images = model.field.map(points);
        if let Some(i) = images.iter().position(|p| !p.is_finite()) {
            return Err(ScalarError::FieldNotFinite(points[i].face));
        }
        // Chunks of a fixed size, since which of several closest points is found may depend on the hint.
        let found = images.par_chunks(CHUNK).flat_map_iter(|images| {
            let mut hint = Hint::NONE;
            images.iter().map(move |&image| {
                let p = model.similarity.to_world(image);
                let closest =
                    self.tree.closest_point(p, hint).expect("the tree has faces, and the point is finite");
                hint = closest.hint();
                let weights = closest.at.barycentric.map(|b| b as f32);
                (Foot { corners: self.faces[closest.at.face.index()], weights }, closest.distance_squared)
            })
        });
        let (feet, distances_squared) = found.collect::<Vec<_>>().into_iter().unzip();
        Ok(Drawn { points: points.to_vec(), feet, distances_squared })
    }
}

/// A third of the area of the faces around every vertex; faces that are not finite count for nothing.
fn vertex_areas(mesh: &TriangleMesh) -> Vec<f64> {
    let mut areas = vec![0.0; mesh.vertex_count()];
    for (face, corners) in mesh.face_indices().zip(mesh.faces()) {
        let area = mesh.face_area(face);
        if area.is_finite() {
            corners.iter().for_each(|&v| areas[v as usize] += area / 3.0);
        }
    }
    areas
}

/// Which vertices have a face whose corners are finite.
fn used_vertices(mesh: &TriangleMesh) -> Vec<bool> {
    let mut used = vec![false; mesh.vertex_count()];
    for face in mesh.faces() {
        if face.iter().all(|&v| mesh.positions()[v as usize].is_finite()) {
            face.iter().for_each(|&v| used[v as usize] = true);
        }
    }
    used
}

/// Range, mean and deviation of a field.
fn channel(scalars: &VertexScalars, areas: &[f64], total: f64) -> Channel {
    let values = &scalars.values;
    let least = values.iter().fold(f32::INFINITY, |m, x| m.min(*x));
    let most = values.iter().fold(f32::NEG_INFINITY, |m, x| m.max(*x));
    let integral = |f: &dyn Fn(f64) -> f64| {
        values.iter().zip(areas).map(|(x, area)| area * f(f64::from(*x))).sum::<f64>() / total
    };
    let mean = integral(&|x| x);
    let deviation = integral(&|x| (x - mean) * (x - mean)).sqrt();
    let extent = f64::from(most) - f64::from(least);
    let is_constant = extent <= CONSTANT * f64::from(least.abs().max(most.abs()));
    let deviation = if is_constant {
        0.0
    } else {
        // A field that only varies where there is no area still has a unit.
        deviation.max(1e-6 * extent).max(f64::from(f32::MIN_POSITIVE))
    };
    Channel {
        name: scalars.name.clone(),
        range: [least, most],
        mean: mean as f32,
        deviation: deviation as f32,
    }
}
