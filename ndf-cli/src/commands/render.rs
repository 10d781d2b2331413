//! `ndf render`: a picture of a mesh.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use ndf_mesh::io::{MeshFile, atomic_write};
use ndf_mesh::repair::finite_part;
use serde_json::json;

use crate::context::Context;
use crate::files::read_faces;
use crate::output::{Failure, Outcome, readable};
use crate::render::{
    Camera, ColourMap, Scene, Style, Up, View, exr_bytes, png_bytes, render, strip_width, with_legend,
};

/// Arguments of `ndf render`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The mesh.
    mesh: PathBuf,
    /// The picture: .png (shaded) or .exr (float layers: colour, depth, normal, scalar).
    #[arg(short, long, value_name = "IMAGE")]
    output: PathBuf,
    /// Colour the surface by this vertex scalar of the PLY file.
    #[arg(long, value_name = "NAME")]
    scalar: Option<String>,
    /// Draw this many isolines of the scalar.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "scalar", value_parser = clap::value_parser!(u32).range(..=1000))]
    isolines: u32,
    /// Viewing direction in degrees: azimuth around the up axis, and elevation.
    #[arg(long, value_name = "YAW,PITCH", default_value = "30,20", allow_hyphen_values = true, value_parser = angles)]
    view: (f64, f64),
    /// The axis that points up.
    #[arg(long, value_enum, default_value_t)]
    up: Up,
    /// Size of the picture in pixels.
    #[arg(long, value_name = "W,H", default_value = "1200,900", value_parser = size)]
    size: (usize, usize),
    /// Draw the edges of the mesh.
    #[arg(long)]
    wireframe: bool,
    /// Shade every face by its own normal.
    #[arg(long)]
    flat: bool,
    /// Leave out the colour legend of a PNG.
    #[arg(long, requires = "scalar")]
    no_legend: bool,
    /// Leave the background of a PNG transparent instead of white.
    #[arg(long)]
    transparent: bool,
}

/// Draws a mesh.
///
/// # Errors
/// If the mesh cannot be read or has no faces, the scalar does not exist, or the picture cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let started = Instant::now();
    let extension = arguments.output.extension().map(std::ffi::OsStr::to_ascii_lowercase);
    let is_exr = match extension.as_ref().and_then(|e| e.to_str()) {
        Some("png") => false,
        Some("exr") => true,
        _ => {
            let path = arguments.output.display();
            return Err(Failure::new(format!(
                "cannot tell the format of {path} from its name; end it in .png or .exr"
            )));
        }
    };
    let file = read_faces(&arguments.mesh, context)?;
    let values = arguments.scalar.as_deref().map(|name| scalar(arguments, &file, name)).transpose()?;
    let style = Style {
        isolines: arguments.isolines,
        wireframe: arguments.wireframe,
        flat: arguments.flat,
        ..Style::default()
    };
    let view = View { yaw: arguments.view.0, pitch: arguments.view.1, up: arguments.up };
    let (width, height) = arguments.size;
    let map = values.map(ColourMap::of);
    let legend = map.filter(|_| !is_exr && !arguments.no_legend);
    let strip = if legend.is_some() { strip_width(width, height) } else { 0 };
    // Vertices that no face uses may be anywhere.
    let seen = finite_part(&file.mesh).0;
    let camera = Camera::framing(seen.positions(), view, width - strip, height);
    let mut scene = Scene::new(&file.mesh);
    if let (Some(values), Some(map)) = (values, map) {
        scene = scene.painted(values, map);
    }
    if scene.is_empty() {
        let failure = Failure::new(format!("{} has no face with finite corners", arguments.mesh.display()));
        return Err(failure.try_instead("ndf info lists what is wrong with it"));
    }
    let mut image = render(&scene, &camera, &style, &context.progress());
    if let Some(map) = legend {
        image = with_legend(&image, &map, strip);
    }
    let bytes = if is_exr {
        exr_bytes(&image, arguments.scalar.as_deref())?
    } else {
        png_bytes(&image, arguments.transparent)?
    };
    let path = arguments.output.display().to_string();
    atomic_write(&arguments.output, |out| out.write_all(&bytes))
        .map_err(|e| Failure::new(format!("cannot write {path}: {e}")))?;
    let seconds = started.elapsed().as_secs_f64();
    let range = map.map(|m| m.range());
    let covered = image.colour.iter().map(|p| f64::from(p[3])).sum::<f64>() / image.colour.len() as f64;
    let mut text = format!("{path}: {width} × {height} pixels, {seconds:.1} s\n");
    if let (Some((low, high)), Some(name)) = (range, &arguments.scalar) {
        text += &format!("  colours of {name} from {} to {}\n", readable(low), readable(high));
    }
    let json = json!({
        "output": path, "width": width, "height": height, "seconds": seconds,
        "scalar_range": range.map(|(low, high)| [low, high]), "covered": covered,
    });
    Ok(Outcome::new(json, text))
}

fn scalar<'a>(arguments: &Arguments, file: &'a MeshFile, name: &str) -> Result<&'a [f32], Failure> {
    if let Some(found) = file.scalars.iter().find(|s| s.name == name) {
        return Ok(&found.values);
    }
    let failure = Failure::new(format!("{} has no vertex scalar named {name}", arguments.mesh.display()));
    let names: Vec<&str> = file.scalars.iter().map(|s| s.name.as_str()).collect();
    Err(if names.is_empty() {
        failure.try_instead("it has none at all; only PLY files hold scalars")
    } else {
        failure.try_instead(&format!("it has {}", names.join(", ")))
    })
}

/// Two numbers with a comma between them.
fn pair<T: std::str::FromStr>(text: &str) -> Result<(T, T), String> {
    let parsed =
        text.split_once(',').and_then(|(a, b)| Some((a.trim().parse().ok()?, b.trim().parse().ok()?)));
    parsed.ok_or_else(|| "two numbers with a comma between them are expected".to_owned())
}

fn angles(text: &str) -> Result<(f64, f64), String> {
    let (yaw, pitch): (f64, f64) = pair(text)?;
    if yaw.is_finite() && pitch.is_finite() {
        Ok((yaw, pitch))
    } else {
        Err("two finite angles are expected".to_owned())
    }
}

fn size(text: &str) -> Result<(usize, usize), String> {
    let (width, height) = pair(text)?;
    let is_sensible = |n: usize| (1..=16384).contains(&n);
    if is_sensible(width) && is_sensible(height) && width * height <= 1 << 24 {
        Ok((width, height))
    } else {
        Err("a picture has 1 to 16384 pixels a side and at most 16 million in all".to_owned())
    }
}
