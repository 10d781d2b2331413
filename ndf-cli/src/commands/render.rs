//! `ndf render`: a picture of a mesh, or of what stands for it.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use ndf_core::{BoundingBox, DVec3};
use ndf_mesh::io::{Lines, atomic_write, read_lines};
use ndf_mesh::repair::finite_part;
use serde_json::json;

use crate::arguments::{EdgeLength, Reading, UpArgument};
use crate::context::Context;
use crate::drawn::{Drawn, read_drawn};
use crate::output::{Failure, Outcome, check_output, grouped, readable};
use crate::render::{
    Camera, ColourMap, Scene, Style, View, exr_bytes, png_bytes, render, strip_width, upright, with_legend,
    with_tubes,
};
use crate::streams::{input_file, output_file};

/// Radius of drawn lines, as a share of the shorter side of the picture, and in pixels at least.
const LINE_RADIUS: (f64, f64) = (0.0018, 1.0);

/// Segments of lines that are drawn at most of a file.
const MAX_SEGMENTS: usize = 1_000_000;

/// Arguments of `ndf render`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// A mesh; a model, of which a mesh is made; points, which are drawn as discs; or a network or splats, of which the
    /// isosurface is drawn.
    #[arg(value_parser = input_file())]
    input: PathBuf,
    /// The picture: .png (shaded) or .exr (float layers: colour, depth, normal, scalar).
    #[arg(short, long, value_name = "IMAGE", value_parser = output_file("png"))]
    output: PathBuf,
    #[command(flatten)]
    edge_length: EdgeLength,
    /// Colour the surface by this vertex scalar of the PLY or glTF file, or of the model.
    #[arg(long, value_name = "NAME")]
    scalar: Option<String>,
    /// Draw the lines of this file, such as the paths of `ndf geodesic` (.ply with an element `edge`, .obj, .glb); may be given
    /// several times.
    #[arg(long, value_name = "FILE")]
    paths: Vec<PathBuf>,
    /// Draw this many isolines of the scalar.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "scalar", value_parser = clap::value_parser!(u32).range(..=1000))]
    isolines: u32,
    /// Viewing direction in degrees: azimuth around the up axis, and elevation.
    #[arg(long, value_name = "YAW,PITCH", default_value = "30,20", allow_hyphen_values = true, value_parser = angles)]
    view: (f64, f64),
    #[command(flatten)]
    up: UpArgument,
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
    #[command(flatten)]
    reading: Reading,
}

/// Draws a mesh.
///
/// # Errors
/// If the input cannot be read or has nothing to be drawn, the scalar does not exist, or the picture cannot be written.
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
    let inputs: Vec<&Path> = arguments.paths.iter().chain([&arguments.input]).map(PathBuf::as_path).collect();
    check_output(&arguments.output, &inputs)?;
    context.expect(&["orienting", "marching cubes", "extraction", "drawing"]);
    let lines = arguments.paths.iter().map(|path| drawn_lines(path)).collect::<Result<Vec<Lines>, _>>()?;
    let mut drawn = read_drawn(&arguments.input, &arguments.reading, arguments.edge_length, context)?;
    let mut values =
        arguments.scalar.as_deref().map(|name| scalar(arguments, &mut drawn, name)).transpose()?;
    let style = Style {
        isolines: arguments.isolines,
        wireframe: arguments.wireframe,
        flat: arguments.flat,
        two_sided: drawn.two_sided,
        ..Style::default()
    };
    let up = arguments.up.up.unwrap_or_else(|| upright(&drawn.mesh, drawn.usual_up));
    let why = match arguments.up.up {
        Some(_) => "",
        None if up == drawn.usual_up => " as usual (--up)",
        None => ", on which it stands (--up)",
    };
    let view = View { yaw: arguments.view.0, pitch: arguments.view.1, up };
    let (width, height) = arguments.size;
    let map = values.as_deref().map(ColourMap::of);
    let legend = map.filter(|_| !is_exr && !arguments.no_legend);
    let strip = if legend.is_some() { strip_width(width, height) } else { 0 };
    // Vertices that no face uses may be anywhere.
    let seen = finite_part(&drawn.mesh).0;
    let framed: Vec<DVec3> =
        seen.positions().iter().chain(lines.iter().flat_map(|l| &l.points)).copied().collect();
    let camera = Camera::framing(&framed, view, width - strip, height);
    let center = BoundingBox::of_points(seen.positions()).center();
    let radius = (LINE_RADIUS.0 * width.min(height) as f64).max(LINE_RADIUS.1)
        * camera.pixel_size(camera.eye().distance(center));
    let faces = drawn.mesh.face_count();
    let mesh = lines.iter().fold(drawn.mesh, |mesh, lines| with_tubes(mesh, lines, radius));
    let mut scene = Scene::new(&mesh).with_lines_from(faces);
    if let (Some(values), Some(map)) = (&mut values, map) {
        values.resize(mesh.vertex_count(), f32::NAN);
        scene = scene.painted(values, map);
    }
    if seen.face_count() == 0 {
        let failure = Failure::new(format!("{} has no face with finite corners", arguments.input.display()));
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
    let mut text = format!("{path}: {width} × {height} pixels, {up} up{why}, {seconds:.1} s\n");
    if let (Some((low, high)), Some(name)) = (range, &arguments.scalar) {
        text += &format!("  colours of {name} from {} to {}\n", readable(low), readable(high));
    }
    let json = json!({
        "output": path, "width": width, "height": height, "seconds": seconds,
        "scalar_range": range.map(|(low, high)| [low, high]), "covered": covered,
        "drawn": drawn.what, "up": up.to_string(),
    });
    Ok(Outcome::new(json, text))
}

/// Lines that are to be drawn.
fn drawn_lines(path: &Path) -> Result<Lines, Failure> {
    let lines = read_lines(path)?;
    if lines.segments.len() > MAX_SEGMENTS {
        let (name, segments) = (path.display(), grouped(lines.segments.len()));
        let failure = Failure::new(format!("{name} has {segments} segments of lines"));
        return Err(failure.try_instead(&format!("{} are drawn at most", grouped(MAX_SEGMENTS))));
    }
    Ok(lines)
}

/// The values to paint.
fn scalar(arguments: &Arguments, drawn: &mut Drawn, name: &str) -> Result<Vec<f32>, Failure> {
    if let Some(found) = drawn.scalars.iter_mut().find(|s| s.name == name) {
        return Ok(std::mem::take(&mut found.values));
    }
    let failure = Failure::new(format!("{} has no vertex scalar named {name}", arguments.input.display()));
    let names: Vec<&str> = drawn.scalars.iter().map(|s| s.name.as_str()).collect();
    Err(if names.is_empty() {
        failure.try_instead("it has none at all; PLY and glTF files and models hold scalars")
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
