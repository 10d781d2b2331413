//! What a batch is told.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use clap::error::ErrorKind;

use super::flags;
use super::recipe::Recipe;
use super::shard::Shard;
use crate::arguments::seconds;
use crate::context::Options;

/// Arguments of `ndf batch COMMAND`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    /// Files, folders (all files below them), quoted patterns such as 'scans/**/*.stl', and lists: @FILE has a path on every
    /// line, or an id, a tab and a path; lines that begin with # are comments.
    #[arg(required = true, value_name = "INPUT")]
    pub inputs: Vec<String>,
    /// The folder of the batch: rows-1.jsonl has a row for every input, files/ what was written.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Do only the I-th of N parts, counted from 1, as one of N processes on any machines [default: the task of a Slurm array,
    /// else all].
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Inputs at a time; --threads are those of each [default: the cores divided by the threads of each, which are 1].
    #[arg(long, value_name = "J", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
    /// End an input that takes longer.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub timeout: Option<Duration>,
    /// End an input that takes more memory: bytes, or as 500M and 4G (powers of 1024; on Linux).
    #[arg(long, value_name = "BYTES", value_parser = bytes)]
    pub memory: Option<u64>,
    /// Go on with a batch that was interrupted: inputs with a row are left, and learning continues from its checkpoints.
    #[arg(long)]
    pub resume: bool,
    /// Do again what ended by timeout, memory or crash.
    #[arg(long, requires = "resume")]
    pub retry: bool,
    /// The ending of what is written, which sets its format [default: as the command has it].
    #[arg(long, value_name = "EXT", value_parser = extension)]
    extension: Option<String>,
    /// Options of the command, the same for every input.
    #[arg(last = true, value_name = "FLAGS")]
    flags: Vec<String>,
}

impl Arguments {
    /// Whether the command takes its options.
    ///
    /// # Errors
    /// As the command's own.
    pub fn check(&self, recipe: &Recipe, options: &Options) -> Result<(), clap::Error> {
        if let (Some(extension), None) = (&self.extension, recipe.extension) {
            let message = format!("`ndf {}` writes no file that could end in {extension}", recipe.name);
            return Err(recipe.command().error(ErrorKind::ArgumentConflict, message));
        }
        flags::check(recipe, &self.flags(options), self.extension(recipe))
    }

    /// The ending of outputs, if there are some.
    pub fn extension<'a>(&'a self, recipe: &'a Recipe) -> Option<&'a str> {
        self.extension.as_deref().or(recipe.extension)
    }

    /// The options of the items: those after `--`, and before them the common ones that were given to the batch.
    pub fn flags(&self, options: &Options) -> Vec<String> {
        let mut flags = options.of_results();
        flags.extend_from_slice(&self.flags);
        flags
    }
}

/// A number of bytes, such as `500M`.
fn bytes(text: &str) -> Result<u64, String> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit: u64 = match &text[digits.len()..].to_ascii_uppercase()[..] {
        "" => 1,
        "K" | "KIB" => 1 << 10,
        "M" | "MIB" => 1 << 20,
        "G" | "GIB" => 1 << 30,
        "T" | "TIB" => 1 << 40,
        _ => 0,
    };
    let bytes = digits.parse().map_or(0.0, |number: f64| number * unit as f64);
    if (1.0..1e18).contains(&bytes) {
        return Ok(bytes as u64);
    }
    Err("expected a number of bytes, such as 4000000000, 500M or 4G".to_owned())
}

/// An ending of names, with or without its dot.
fn extension(text: &str) -> Result<String, String> {
    let ending = text.trim_start_matches('.');
    let is_plain = (1..20).contains(&ending.len()) && ending.chars().all(|c| c.is_ascii_alphanumeric());
    if is_plain { Ok(ending.to_owned()) } else { Err("expected an ending such as ply".to_owned()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_have_units() {
        let read = [("4096", 4096), ("500M", 500 << 20), ("4G", 4 << 30), ("0.5g", 1 << 29), ("1KiB", 1024)];
        for (text, expected) in read {
            assert_eq!(bytes(text), Ok(expected));
        }
        for wrong in ["", "G", "0", "-1", "4X", "nan", "inf", "4 G", "9e99"] {
            assert!(bytes(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn endings_are_plain() {
        assert_eq!(extension(".obj").as_deref(), Ok("obj"));
        assert!(extension("a/b").is_err() && extension(".").is_err());
    }
}
