//! `ndf batch report`: tables and a page of what became of all inputs.

mod page;
#[cfg(feature = "parquet")]
mod parquet;
mod pictures;
mod reasons;
mod table;

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::gathered::Gathered;
use super::plan::{Places, Plan};
use super::recipe::Recipe;
use super::rows::{by_status, counts, in_words};
use crate::context::Context;
use crate::output::{Failure, Outcome};
use table::Table;

/// Arguments of `ndf batch report`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The folder of the batch.
    folder: PathBuf,
    /// Leave out the pictures of the worst results.
    #[arg(long)]
    no_pictures: bool,
}

/// Writes `results.csv`, `index.html` and, with the feature `parquet`, `results.parquet` to the folder of a batch.
///
/// # Errors
/// If rows cannot be read or the files not be written. Rows that are missing are no error; the page says how many.
pub(super) fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let places = Places::in_folder(&arguments.folder);
    let plan = Plan::read(&places)?;
    let recipe = Recipe::named(&plan.command).ok_or_else(|| {
        let path = places.plan();
        Failure::new(format!("{}: this program has no command {}", path.display(), plan.command))
            .try_instead("use the version that the batch was made with")
    })?;
    let gathered = Gathered::read(&plan, &places)?;
    let table = Table::of(gathered.rows().map(|(_, line)| line), recipe, &places)?;
    let place = |name: &str| places.folder().join(name);
    let mut files = vec![table.write_csv(place("results.csv"))?];
    #[cfg(feature = "parquet")]
    files.push(parquet::write(&table, place("results.parquet"))?);
    let index = place("index.html");
    let batch = page::Batch { plan: &plan, places: &places, recipe, gathered: &gathered, table: &table };
    page::write(&index, &batch, !arguments.no_pictures, context)?;
    files.push(index.clone());
    let counts = counts(gathered.rows().map(|(head, _)| head));
    let missing = gathered.missing();
    let names: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
    let json = json!({
        "files": names,
        "items": plan.items,
        "missing": missing,
        "counts": by_status(&counts),
    });
    let lacking =
        if missing > 0 { format!("; missing: {}", gathered.missing_in_words()) } else { String::new() };
    let text = format!("{}: {}{lacking}\n  {}\n", index.display(), in_words(&counts), names.join("\n  "));
    Ok(Outcome::new(json, text))
}
