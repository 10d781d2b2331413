//! `ndf batch merge`: the rows of all parts in one file.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::gathered::Gathered;
use super::plan::{Places, Plan};
use super::rows::{by_status, counts, in_words, write};
use crate::output::{Failure, Outcome, grouped};

/// Arguments of `ndf batch merge`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The folder of the batch.
    folder: PathBuf,
    /// Put together what is there, although rows are missing.
    #[arg(long)]
    partial: bool,
}

/// Writes the rows of all parts to `rows.jsonl`, in the order of the items.
///
/// # Errors
/// If rows are missing, unless that is allowed, or files cannot be read or written.
pub(super) fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let places = Places::in_folder(&arguments.folder);
    let plan = Plan::read(&places)?;
    let gathered = Gathered::read(&plan, &places)?;
    let missing = gathered.missing();
    if missing > 0 && !arguments.partial {
        let what = format!("{} rows are missing: {}", grouped(missing), gathered.missing_in_words());
        return Err(Failure::new(what)
            .try_instead("run these parts with --resume; --partial puts together what is there"));
    }
    let path = places.folder().join("rows.jsonl");
    write(&path, gathered.rows().map(|(_, line)| line))?;
    let counts = counts(gathered.rows().map(|(head, _)| head));
    let (name, rows) = (path.display().to_string(), plan.items - missing);
    let json = json!({
        "output": name,
        "items": plan.items,
        "rows": rows,
        "missing": missing,
        "shards": plan.shards,
        "counts": by_status(&counts),
    });
    let lacking =
        if missing > 0 { format!("; missing: {}", gathered.missing_in_words()) } else { String::new() };
    let text = format!("{name}: {} rows, {}{lacking}\n", grouped(rows), in_words(&counts));
    Ok(Outcome::new(json, text))
}
