//! Pictures as in the paper's first figure: modes, distances, heat, stripes, directions and transport on all kinds of surfaces.

use std::fs;
use std::path::Path;

use ndf::analysis::mode_scalars;
use ndf::{
    Alignment, DVec3, DistanceOptions, EdgeLength, HeatOptions, InitialHeat, Place, Triangulated, Vertex,
};
use ndf_cli::drawn::usual_up;
use ndf_cli::render::{Camera, ColourMap, Scene, Style, View, png_bytes, render, upright, with_open_tubes};
use ndf_core::NoProgress;
use ndf_mesh::TriangleMesh;
use ndf_mesh::io::Lines;
use ndf_spectral::ModeOptions;
use serde::{Deserialize, Serialize};

use super::fits::{Learned, model, read};
use super::row::load;
use super::shapes::{Role, Shape};
use super::{Experiment, Setup};
use crate::performance::process::timed;
use crate::rows::{Row, Rows};

/// Modes that are drawn.
const MODES: [usize; 3] = [1, 25, 50];
/// Edge length of the meshes, in the box.
const EDGE_LENGTH: f64 = 0.025;
/// Time of heat, in squares of the diagonal.
const HEAT_TIME: f64 = 0.003;
/// Size of the pictures.
const PICTURE: (usize, usize) = (300, 240);
/// Stripes along the diagonal.
const STRIPES: f64 = 30.0;
/// Vectors that are drawn, their lengths and the radius of their lines, in shares of the diagonal.
const VECTORS: usize = 1500;
const VECTOR: (f64, f64) = (0.014, 0.002);
/// What is drawn last.
const LAST: &str = "transport";

/// A picture, or why there is none.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Picture {
    pub(super) shape: String,
    pub(super) kind: String,
    /// What it shows.
    pub(super) scalar: String,
    /// The file, within the folder of results.
    pub(super) file: String,
    faces: usize,
    bytes: usize,
    /// Of computing all modes, distances, or heat.
    seconds: f64,
    load: Option<f64>,
    pub(super) left_out: String,
}

impl Row for Picture {
    fn key(&self) -> String {
        format!("{}; {}; {}", self.shape, self.kind, self.scalar)
    }
}

/// The pictures that are there.
pub(super) fn pictures(setup: &Setup) -> Result<Rows<Picture>, String> {
    Rows::open(setup.out.join(Experiment::Teaser.name()).with_extension("csv"))
}

/// Draws what is wanted.
pub(super) fn run(setup: &Setup, all: &[Shape]) -> Result<(), String> {
    let mut rows = pictures(setup)?;
    let mut shapes: Vec<&Shape> = Vec::new();
    // In the quick subset, of what has a model already.
    for role in [Role::Cloud, Role::Density, Role::Network, Role::Mesh] {
        let most = match role {
            Role::Density if setup.scale.is_quick => 0,
            Role::Density => 2,
            _ => 1,
        };
        shapes.extend(all.iter().filter(|shape| shape.role == role).take(most));
    }
    for shape in shapes {
        let kind =
            |shape: &Shape| shape.open().map_or_else(|_| String::new(), |opened| opened.kind.to_string());
        let is_there =
            rows.all().iter().any(|p| p.shape == shape.name && p.kind == kind(shape) && p.scalar == LAST);
        if setup.is_over() || setup.missing && is_there {
            continue;
        }
        match drawn(setup, shape) {
            Ok(pictures) => pictures.into_iter().try_for_each(|picture| rows.put(picture))?,
            Err(reason) => rows.put(Picture {
                shape: shape.name.clone(),
                kind: format!("{:?}", shape.role).to_lowercase(),
                scalar: "all".to_owned(),
                left_out: reason,
                ..Picture::default()
            })?,
        }
    }
    Ok(())
}

fn drawn(setup: &Setup, shape: &Shape) -> Result<Vec<Picture>, String> {
    let (bytes, _) = model(shape, Learned::Levels(setup.scale.sizes[0]), setup)?;
    let surface = Triangulated::from_model(&read(&bytes)?, EdgeLength::Relative(EDGE_LENGTH), &NoProgress);
    let surface = surface.map_err(|e| e.to_string())?;
    let mesh = surface.mesh();
    let kind = shape.open()?.kind;
    let view = View { up: upright(mesh, usual_up(kind)), ..View::default() };
    let folder = setup.out.join("teaser");
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut pictures = Vec::new();
    let picture = |scalar: &str, file: String, seconds: f64| Picture {
        shape: shape.name.clone(),
        kind: kind.to_string(),
        scalar: scalar.to_owned(),
        file,
        faces: mesh.face_count(),
        bytes: bytes.len(),
        seconds,
        load: load(),
        left_out: String::new(),
    };
    let mut draw = |name: &str, seconds: f64, drawing: Drawing<'_>| -> Result<(), String> {
        let file = format!("teaser/{}-{kind}-{}.png", shape.name, name.replace(' ', "-"));
        drawing.write(mesh, view, &setup.out.join(&file))?;
        pictures.push(picture(name, file, seconds));
        Ok(())
    };
    let diagonal = mesh.bounds().diagonal();
    let options = ModeOptions { count: MODES[2] + 1, ..ModeOptions::default() };
    let (seconds, modes) = timed(|| surface.modes(&options, &NoProgress));
    let modes = mode_scalars(&modes.map_err(|e| e.to_string())?);
    for mode in MODES {
        draw(&format!("mode {mode}"), seconds, Drawing::Scalar(&modes[mode].values))?;
    }
    let source = nearest(mesh, Camera::framing(mesh.positions(), view, PICTURE.0, PICTURE.1).eye());
    let options = DistanceOptions::default();
    let (seconds, distances) = timed(|| surface.distances(&[Place::Vertex(source)], &options, &NoProgress));
    draw("distance", seconds, Drawing::Scalar(&distances.map_err(|e| e.to_string())?.scalars().values))?;
    let start = InitialHeat::Sources(vec![Place::Vertex(source)]);
    let options = HeatOptions { time: HEAT_TIME * diagonal * diagonal, frames: 1, is_boundary_held: false };
    let (seconds, heat) = timed(|| surface.heat(&start, &options, &NoProgress));
    let heat = heat.map_err(|e| e.to_string())?.frames.swap_remove(0);
    draw("heat", seconds, Drawing::Scalar(&heat.iter().map(|&u| u as f32).collect::<Vec<_>>()))?;
    let fields = surface.fields().map_err(|e| e.to_string())?;
    let (seconds, stripes) = timed(|| {
        let lines = fields.directions(2, &Alignment::Free, &NoProgress)?;
        fields.stripes(&lines.field, STRIPES / diagonal, &NoProgress)
    });
    let (stripes, _) = stripes.map_err(|e| e.to_string())?;
    draw("stripes", seconds, Drawing::Scalar(&stripes.iter().map(|&x| x as f32).collect::<Vec<_>>()))?;
    let (seconds, crosses) = timed(|| fields.directions(4, &Alignment::Curvature, &NoProgress));
    draw("directions", seconds, Drawing::Vectors(&crosses.map_err(|e| e.to_string())?.vectors, 4))?;
    let (seconds, carried) = timed(|| fields.transport(source, 0.0, &NoProgress));
    draw(LAST, seconds, Drawing::Vectors(&carried.map_err(|e| e.to_string())?.vectors, 1))?;
    Ok(pictures)
}

/// The vertex nearest to a point, as to the eye that looks at it.
fn nearest(mesh: &TriangleMesh, point: DVec3) -> Vertex {
    let distances = mesh.positions().iter().map(|p| p.distance(point)).enumerate();
    Vertex::new(distances.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(v, _)| v))
}

/// What a picture shows of a surface.
enum Drawing<'a> {
    /// A value at every vertex.
    Scalar(&'a [f32]),
    /// A vector at every vertex, of which a part is drawn, turned to all of so many sides.
    Vectors(&'a [DVec3], u32),
}

impl Drawing<'_> {
    fn write(self, mesh: &TriangleMesh, view: View, file: &Path) -> Result<(), String> {
        let camera = Camera::framing(mesh.positions(), view, PICTURE.0, PICTURE.1);
        let with_lines;
        let scene = match self {
            Self::Scalar(values) => Scene::new(mesh).painted(values, ColourMap::of(values)),
            Self::Vectors(vectors, sides) => {
                let radius = VECTOR.1 * mesh.bounds().diagonal();
                with_lines = with_open_tubes(mesh.clone(), &lines(mesh, vectors, sides), radius);
                Scene::new(&with_lines).with_lines_from(mesh.face_count())
            }
        };
        let image = render(&scene, &camera, &Style::default(), &NoProgress);
        let bytes = png_bytes(&image, false).map_err(|e| e.to_string())?;
        fs::write(file, bytes).map_err(|e| format!("{}: {e}", file.display()))
    }
}

/// Lines along some of the vectors, from their vertices, or through these where vectors have several sides.
fn lines(mesh: &TriangleMesh, vectors: &[DVec3], sides: u32) -> Lines {
    let length = VECTOR.0 * mesh.bounds().diagonal();
    let normals = mesh.vertex_normals();
    let mut drawn: Vec<[DVec3; 2]> = Vec::new();
    for v in (0..vectors.len()).step_by(vectors.len().div_ceil(VECTORS)) {
        let (place, normal) = (mesh.positions()[v], normals[v].normalize_or_zero());
        let Some(along) = vectors[v].try_normalize() else { continue };
        let across = normal.cross(along);
        match sides {
            1 => drawn.push([place, place + 2.0 * length * along]),
            2 => drawn.push([place - length * along, place + length * along]),
            _ => drawn.extend([along, across].map(|d| [place - length * d, place + length * d])),
        }
    }
    Lines::from_polylines(drawn.iter().map(<[DVec3; 2]>::as_slice))
}
