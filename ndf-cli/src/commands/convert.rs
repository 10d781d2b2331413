//! `ndf convert`: models in other forms.

use std::path::{Path, PathBuf};

use clap::Args;
use ndf::{Model, ModelExt};
use ndf_mesh::io::{atomic_write, format_to_write};
use ndf_model::file::{Precision, TensorsError};
use serde_json::json;

use crate::arguments::bits;
use crate::context::Context;
use crate::output::{Failure, Outcome, check_place, grouped};
use crate::streams::{input_file, output_file};

/// Arguments of `ndf convert`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// A model: `.ndf`, of this or an earlier version, or `.safetensors` exported from one.
    #[arg(value_parser = input_file())]
    model: PathBuf,
    /// The file to write: a model (`.ndf`), its arrays in single precision (`.safetensors`), or its base mesh in the
    /// units of the input (`.ply`, `.glb`, `.obj`, `.stl`); with levels, the control mesh around the surface.
    #[arg(short, long, value_name = "FILE", value_parser = output_file("ndf"))]
    output: PathBuf,
    /// Round features and weights, without training; `ndf fit --bits` trains with rounded numbers, which is better.
    #[arg(long, value_name = "N", value_parser = bits)]
    bits: Option<u32>,
}

/// What is to be written.
enum Form {
    Model,
    Tensors,
    Base,
}

impl Form {
    fn of(path: &Path) -> Result<Self, Failure> {
        match path.extension().and_then(|e| e.to_str()).map(str::to_lowercase).as_deref() {
            Some("ndf") => Ok(Self::Model),
            Some("safetensors") => Ok(Self::Tensors),
            _ => format_to_write(path).map(|_| Self::Base).map_err(|_| {
                Failure::new(format!("cannot tell from the name {} what to write", path.display())).try_instead(
                    "end it in .ndf for a model, .safetensors for its arrays, .ply, .glb, .obj or .stl for its base mesh",
                )
            }),
        }
    }
}

/// Reads a model and writes it in another form.
///
/// # Errors
/// If the input is no model, or the output cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    check_place(&arguments.output)?;
    let form = Form::of(&arguments.output)?;
    if arguments.bits.is_some() && matches!(form, Form::Base) {
        let name = arguments.output.display();
        let failure =
            Failure::new(format!("{name}: --bits rounds features and weights, and a base mesh has none"));
        return Err(failure.try_instead("leave it out"));
    }
    let (input, output) = (arguments.model.display().to_string(), arguments.output.display().to_string());
    let cannot_read = |e: &dyn std::fmt::Display| Failure::new(format!("cannot read {input}: {e}"));
    let content = std::fs::read(&arguments.model).map_err(|e| cannot_read(&e))?;
    let mut model = if Model::is_model(&content) {
        Model::from_bytes(&content).map_err(|e| cannot_read(&e))?
    } else {
        Model::from_safetensors(&content).map_err(|e| match e {
            TensorsError::File(_) => Failure::new(format!("{input} is no model, nor exported from one"))
                .try_instead("`ndf fit` makes models"),
            e => cannot_read(&e),
        })?
    };
    if let Some(bits) = arguments.bits {
        if model.field.network().is_none() && model.scalars.iter().all(|fields| fields.network().is_none()) {
            let failure = Failure::new(format!("{input}: nothing to round, since levels are integers"));
            return Err(
                failure.try_instead("leave --bits out, or learn a smaller model with `ndf fit --size`")
            );
        }
        model = model.rounded(Precision::from_bits(bits));
    }
    let cannot_write = |e: &dyn std::fmt::Display| Failure::new(format!("cannot write {output}: {e}"));
    let bytes = match form {
        Form::Model => model.to_bytes(),
        Form::Tensors => model.to_safetensors().map_err(|e| cannot_write(&e))?,
        Form::Base => {
            let base = model.base_in_world();
            context.write_mesh(&arguments.output, &base, &[]).map_err(|e| cannot_write(&e))?;
            let (vertices, faces) = (base.vertex_count(), base.face_count());
            let json = json!({"output": output, "vertices": vertices, "faces": faces});
            let text =
                format!("{output}: base mesh, {} vertices, {} faces\n", grouped(vertices), grouped(faces));
            return Ok(Outcome::new(json, text));
        }
    };
    atomic_write(&arguments.output, |out| out.write_all(&bytes)).map_err(|e| cannot_write(&e))?;
    let json = json!({"output": output, "bytes": bytes.len(), "bytes_before": content.len()});
    let text = format!("{output}: {} bytes, from {}\n", grouped(bytes.len()), grouped(content.len()));
    Ok(Outcome::new(json, text))
}
