//! Pictures of the paper's first figure: modes, distances and heat on representations that are no meshes.

use std::fs;
use std::path::Path;

use ndf::analysis::mode_scalars;
use ndf::{DistanceOptions, EdgeLength, Place, Triangulated, Vertex};
use ndf_cli::drawn::usual_up;
use ndf_cli::render::{ColourMap, View, upright};
use ndf_cli::report::{Figure, Shot};
use ndf_core::NoProgress;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::TriangleMesh;
use ndf_mesh::io::VertexScalars;
use ndf_spectral::{LaplaceBeltrami, ModeOptions, OperatorOptions, ScreenedPoisson};
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
const STRIPES: &str = "stripe patterns";

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
    for role in [Role::Density, Role::Network, Role::Cloud] {
        let most = match role {
            Role::Density if setup.scale.is_quick => 0,
            Role::Density => 2,
            _ => 1,
        };
        shapes.extend(all.iter().filter(|shape| shape.role == role).take(most));
    }
    for shape in shapes {
        let is_there = rows.all().iter().any(|p| p.shape == shape.name && p.scalar == STRIPES);
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
    let mut draw = |name: &str, seconds: f64, scalar: &VertexScalars| -> Result<(), String> {
        let file = format!("teaser/{}-{kind}-{}.png", shape.name, name.replace(' ', "-"));
        write_picture(mesh, scalar, view, &setup.out.join(&file))?;
        pictures.push(picture(name, file, seconds));
        Ok(())
    };
    let options = ModeOptions { count: MODES[2] + 1, ..ModeOptions::default() };
    let (seconds, modes) = timed(|| surface.modes(&options, &NoProgress));
    let modes = mode_scalars(&modes.map_err(|e| e.to_string())?);
    for mode in MODES {
        draw(&format!("mode {mode}"), seconds, &modes[mode])?;
    }
    let source = Vertex(0);
    let options = DistanceOptions::default();
    let (seconds, distances) = timed(|| surface.distances(&[Place::Vertex(source)], &options, &NoProgress));
    draw("distance", seconds, &distances.map_err(|e| e.to_string())?.scalars())?;
    let (seconds, heat) = timed(|| heat(&surface, source));
    draw("heat", seconds, &VertexScalars { name: "heat".to_owned(), values: heat? })?;
    let reason = "no crate of the workspace computes them".to_owned();
    pictures.push(Picture { left_out: reason, ..picture(STRIPES, String::new(), 0.0) });
    Ok(pictures)
}

/// Heat that began in one vertex, after some time.
fn heat(surface: &Triangulated, source: Vertex) -> Result<Vec<f32>, String> {
    let mesh = surface.manifold().map_err(ToString::to_string)?;
    let operator = LaplaceBeltrami::new(&IntrinsicMesh::from_mesh(mesh), OperatorOptions::default());
    let operator = operator.map_err(|e| e.to_string())?;
    let time = HEAT_TIME * mesh.bounds().diagonal().powi(2);
    let poisson = ScreenedPoisson::new(&operator, 1.0 / time).map_err(|e| e.to_string())?;
    let mut start = vec![0.0; mesh.vertex_count()];
    start[source.index()] = 1.0;
    let heat = poisson.heat_step(&start);
    let most = heat.iter().copied().fold(0.0, f64::max);
    Ok(heat.into_iter().map(|u| (u / most) as f32).collect())
}

fn write_picture(mesh: &TriangleMesh, scalar: &VertexScalars, view: View, file: &Path) -> Result<(), String> {
    let shot = Shot { view, width: PICTURE.0, height: PICTURE.1, ..Shot::default() };
    let map = ColourMap::of(&scalar.values);
    let figure =
        Figure::of_mesh(mesh, Some((scalar, map)), "", &shot, &NoProgress).map_err(|e| e.to_string())?;
    fs::write(file, figure.png).map_err(|e| format!("{}: {e}", file.display()))
}
