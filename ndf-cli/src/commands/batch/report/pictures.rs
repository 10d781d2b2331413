//! Pictures of results beside their inputs, by `ndf render` in processes of their own, so that what cannot be drawn costs its
//! picture alone.

use std::fs;
use std::path::Path;
use std::time::Duration;

use serde_json::Value;

use super::super::child::{self, End, Limits};
use super::super::flags;
use super::super::recipe::{self, Recipe};
use crate::itself;
use crate::output::Failure;

/// Time that a picture may take.
const TIME: Duration = Duration::from_secs(60);

/// Columns and rows of a picture.
pub(super) const SIZE: [usize; 2] = [480, 360];

/// A picture as a PNG file, or why there is none.
pub(super) type Picture = Result<Vec<u8>, String>;

/// Draws an input, read as its item was, and beside it the output.
///
/// # Errors
/// If a process cannot be started.
pub(super) fn pair(
    recipe: &Recipe,
    flags: &[String],
    input: &Path,
    output: &Path,
) -> Result<[Picture; 2], Failure> {
    let reading = flags::shared_with(recipe, flags, &recipe::RENDER.command());
    let (before, up) = draw(input, &reading)?;
    let upright: Vec<String> = up.into_iter().map(|up| format!("--up={up}")).collect();
    Ok([before, draw(output, &upright)?.0])
}

/// A picture of a file, and what points up in it.
fn draw(path: &Path, flags: &[String]) -> Result<(Picture, Option<String>), Failure> {
    let cannot = |e: std::io::Error| Failure::new(format!("cannot draw {}: {e}", path.display()));
    let file = tempfile::Builder::new().suffix(".png").tempfile().map_err(cannot)?;
    let [width, height] = SIZE;
    let flags = [flags, &[format!("--size={width},{height}")]].concat();
    let (input, output) = (path.to_string_lossy(), file.path().to_string_lossy());
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let words = flags::command_line(&recipe::RENDER, &input, Some(&output), threads, &flags);
    let limits = Limits { time: Some(TIME), memory: None };
    let ended = child::run(itself::command().map_err(cannot)?.args(words), limits).map_err(cannot)?;
    let printed: Option<Value> =
        ended.printed.as_deref().and_then(|printed| serde_json::from_slice(printed).ok());
    let up = printed.and_then(|printed| printed["up"].as_str().map(str::to_owned));
    let picture = match ended.end {
        End::Exit(0) => fs::read(file.path()).map_err(|e| e.to_string()),
        End::Timeout => Err(format!("it takes longer than {} s to draw", TIME.as_secs())),
        _ => Err(ended.sentence().unwrap_or_else(|| "it cannot be drawn".to_owned())),
    };
    Ok((picture, up))
}
