//! `ndf view`: a page that shows a model or a mesh and computes on it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use clap::Args;
use ndf::text::readable;
use ndf::{DVec3, MAX_FACES_32_BIT, Model, ModelExt, begins_as_model};
use ndf_mesh::io::{Positions, VertexScalars, atomic_write, format_to_write, property_names, to_ply};
use ndf_viewer::Input;
use serde_json::json;

use crate::arguments::{EdgeLength, Reading, Sources, UpArgument, point};
use crate::context::Context;
use crate::drawn::read_drawn;
use crate::files::read_model;
use crate::output::{Failure, Outcome, check_output, grouped, table};
use crate::render::{Up, upright};
use crate::streams::{input_file, is_output, output_file};

/// Arguments of `ndf view`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// What is shown: a model, a mesh with or without scalars, or anything else that `ndf render` draws.
    #[arg(value_parser = input_file())]
    input: PathBuf,
    /// The page to write, one file that opens from the disk in any current browser (.html).
    #[arg(short, long, value_name = "PAGE", value_parser = output_file("html"))]
    output: PathBuf,
    /// Open the page in the browser.
    #[arg(long)]
    open: bool,
    /// Colour by this scalar at the beginning.
    #[arg(long, value_name = "NAME")]
    scalar: Option<String>,
    /// Show exact distances at the beginning, from the vertex closest to this point.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point, conflicts_with = "scalar")]
    source: Option<DVec3>,
    /// The same, from the vertex of the mesh file with this number, counted from 0.
    #[arg(long, value_name = "I", conflicts_with_all = ["scalar", "source"])]
    source_vertex: Option<u32>,
    #[command(flatten)]
    edge_length: EdgeLength,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    up: UpArgument,
}

/// What a page is made of.
struct Shown {
    what: &'static str,
    /// A model, or a mesh as PLY.
    bytes: Vec<u8>,
    scalars: Vec<String>,
    /// What the page calls them.
    in_page: Vec<String>,
    /// Where distances are shown from at the beginning.
    source: Option<DVec3>,
    up: Up,
    edge_length: Option<f64>,
}

/// Writes the page.
///
/// # Errors
/// If the input cannot be read or drawn, there is no such scalar, or the page cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let (input, output) = (&arguments.input, &arguments.output);
    if format_to_write(output).is_ok() {
        let failure =
            Failure::new(format!("{} is the name of a mesh, and a page is written", output.display()));
        return Err(failure.try_instead("end it in .html"));
    }
    check_output(output, &[input])?;
    if arguments.open && is_output(output) {
        let failure = Failure::new("--open needs a file, and the page goes to the standard output");
        return Err(failure.try_instead("give it a name"));
    }
    let shown = if begins_as_model(input) {
        Shown::of_model(arguments, context)?
    } else {
        Shown::of_drawn(arguments, context)?
    };
    if let Some(name) = arguments.scalar.as_ref().filter(|name| !shown.scalars.contains(name)) {
        let failure = Failure::new(format!("{} has no scalar {name}", input.display()));
        let names = shown.scalars.join(", ");
        return Err(if names.is_empty() { failure } else { failure.try_instead(&format!("it has {names}")) });
    }
    let name = input.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let page = Input {
        scalar: arguments.scalar.as_ref().and_then(|name| shown.name_in_page(name)),
        source: shown.source.map(|place| place.to_array()),
        edge_length: shown.edge_length,
        up: Some(arguments.up.up.unwrap_or(shown.up).name()),
        ..Input::new(&name, &shown.bytes)
    }
    .to_html();
    atomic_write(output, |out| out.write_all(page.as_bytes()))
        .map_err(|e| Failure::new(format!("cannot write {}: {e}", output.display())))?;
    if arguments.open {
        open(output, context);
    }
    let path = output.display().to_string();
    let json = json!({
        "output": path,
        "shows": shown.what,
        "bytes": page.len(),
        "input_bytes": shown.bytes.len(),
        "scalars": shown.scalars,
    });
    let rows = [
        ("shows", format!("{} of {} bytes", with_article(shown.what), grouped(shown.bytes.len()))),
        ("page", format!("{} bytes", grouped(page.len()))),
    ];
    Ok(Outcome::new(json, format!("{path}: open it in a browser\n{}", table(&rows))))
}

impl Shown {
    /// What the page calls a scalar.
    fn name_in_page(&self, name: &str) -> Option<&str> {
        let number = self.scalars.iter().position(|scalar| scalar == name)?;
        self.in_page.get(number).map(String::as_str)
    }

    fn of_model(arguments: &Arguments, context: &Context) -> Result<Self, Failure> {
        let path = &arguments.input;
        if arguments.source_vertex.is_some() {
            return Err(Failure::new(format!("{} is a model, and {}", path.display(), Sources::VERTICES)));
        }
        let model = read_model(path)?;
        let bytes =
            fs::read(path).map_err(|e| Failure::new(format!("cannot read {}: {e}", path.display())))?;
        fits_in_page(&model, arguments.edge_length, context)?;
        let channels = model.scalars.iter().flat_map(ndf_model::SurfaceScalars::channels);
        let scalars: Vec<String> = channels.map(|channel| channel.name.clone()).collect();
        Ok(Self {
            what: "model",
            bytes,
            in_page: scalars.clone(),
            scalars,
            source: arguments.source,
            up: upright(&model.base_in_world(), Up::Y),
            edge_length: arguments.edge_length.get().map(|length| length.world(&model)),
        })
    }

    /// What is drawn of anything else, with every vertex where it is.
    fn of_drawn(arguments: &Arguments, context: &Context) -> Result<Self, Failure> {
        let mut drawn = read_drawn(&arguments.input, &arguments.reading, arguments.edge_length, context)?;
        let names: Vec<String> =
            drawn.scalars.iter().map(|VertexScalars { name, .. }| name.clone()).collect();
        let in_page = property_names(&names.iter().map(String::as_str).collect::<Vec<_>>());
        for (scalar, name) in drawn.scalars.iter_mut().zip(&in_page) {
            scalar.name.clone_from(name);
        }
        let name = arguments.input.display();
        let source = match arguments.source_vertex {
            None => arguments.source,
            Some(_) if drawn.what != "mesh" => {
                return Err(Failure::new(format!("{name} is no mesh, and {}", Sources::VERTICES)));
            }
            Some(vertex) => {
                let positions = drawn.mesh.positions();
                let missing = || {
                    let last = positions.len().saturating_sub(1);
                    let failure = Failure::new(format!("{name} has no vertex {vertex}"));
                    failure.try_instead(&format!("its vertices are 0 to {last}"))
                };
                Some(*positions.get(vertex as usize).ok_or_else(missing)?)
            }
        };
        Ok(Self {
            what: drawn.what,
            bytes: to_ply(&drawn.mesh, &drawn.scalars, Positions::Exact)?,
            scalars: names,
            in_page,
            source,
            up: upright(&drawn.mesh, drawn.usual_up),
            edge_length: None,
        })
    }
}

/// Whether the page can extract a mesh with this edge length: WebAssembly holds fewer triangles than the program.
fn fits_in_page(model: &Model, wanted: EdgeLength, context: &Context) -> Result<(), Failure> {
    // Coarser than by default: that takes a moment, and is near enough.
    let coarse = model.extract_with(ndf::EdgeLength::OfBase(0.5), &context.progress())?;
    let length = wanted.get().unwrap_or_default().world(model);
    let faces = coarse.foretold_faces(length);
    if faces <= MAX_FACES_32_BIT as f64 {
        return Ok(());
    }
    // Two digits: it is an estimate.
    let unit = 10_f64.powf(faces.log10().floor() - 1.0);
    let about = if faces < 1e12 {
        grouped(((faces / unit).round() * unit).round() as usize)
    } else {
        format!("{faces:.0e}")
    };
    let failure = Failure::new(format!(
        "the edge length {} makes about {about} triangles, and a page in the browser holds {}",
        readable(length),
        grouped(MAX_FACES_32_BIT)
    ));
    // A little longer: the number of triangles is an estimate.
    let possible = readable(1.1 * coarse.min_edge_length(MAX_FACES_32_BIT));
    Err(failure
        .try_instead(&format!("pass --edge-length {possible} or more; `ndf extract` makes finer meshes")))
}

/// What is shown, in a sentence.
fn with_article(what: &str) -> String {
    match what {
        "points" => what.to_owned(),
        "isosurface" => format!("an {what}"),
        _ => format!("a {what}"),
    }
}

/// Opens a page with the program that opens pages. That there is none stops nothing: the page is written.
fn open(page: &Path, context: &Context) {
    let mut command = if cfg!(target_os = "macos") {
        Command::new("open")
    } else if cfg!(windows) {
        Command::new("explorer")
    } else {
        Command::new("xdg-open")
    };
    command.arg(page).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    if let Err(error) = command.spawn() {
        context.warn(&format!("{} is written, but no browser could be started: {error}", page.display()));
    }
}

#[cfg(test)]
mod tests {
    use super::with_article;

    #[test]
    fn what_is_shown_has_its_article() {
        let all = ["model", "mesh", "points", "isosurface"].map(with_article);
        assert_eq!(all, ["a model", "a mesh", "points", "an isosurface"]);
    }
}
