//! The page of a batch: how many ended how, how times, memory, errors and sizes are spread, the worst results with pictures,
//! why items failed, and all items where they are not too many.

use std::path::Path;

use indicatif::HumanBytes;
use ndf_core::Progress;
use ndf_mesh::io::atomic_write;

use super::super::gathered::Gathered;
use super::super::plan::{Places, Plan};
use super::super::recipe::Recipe;
use super::super::rows::{Status, counts};
use super::pictures::{self, SIZE};
use super::reasons::reasons;
use super::table::{Record, Table};
use crate::chart::Spread;
use crate::context::Context;
use crate::output::{Failure, grouped, readable};
use crate::report::{Pair, Report};

/// Results that are shown as the worst.
const WORST: usize = 20;

/// Items up to which all are listed.
const MAX_LISTED: usize = 2000;

/// Reasons that are shown; those that are left out have few items.
const MAX_REASONS: usize = 40;

/// A batch and its rows.
pub(super) struct Batch<'a> {
    /// What it is.
    pub plan: &'a Plan,
    /// Where it is.
    pub places: &'a Places,
    /// Its command.
    pub recipe: &'a Recipe,
    /// Its rows.
    pub gathered: &'a Gathered,
    /// The same as a table.
    pub table: &'a Table,
}

/// Writes the page.
///
/// # Errors
/// If it cannot be written, or pictures cannot be made at all.
pub(super) fn write(
    path: &Path,
    batch: &Batch<'_>,
    has_pictures: bool,
    context: &Context,
) -> Result<(), Failure> {
    let folder =
        batch.places.folder().file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let title = format!("ndf {} of {} inputs", batch.plan.command, grouped(batch.plan.items));
    let mut page = Report::new(&title).code(&batch.command_line(&folder)).shares(&batch.shares());
    let missing = batch.gathered.missing();
    if missing > 0 {
        let parts = if batch.plan.shards > 1 {
            format!(": {}", batch.gathered.missing_in_words())
        } else {
            String::new()
        };
        page = page.paragraph(&format!("Inputs without a row yet: {}{parts}.", grouped(missing)));
    }
    page = page.spreads(&batch.spreads());
    page = batch.with_worst(page, has_pictures, context)?;
    page = batch.with_reasons(page);
    page = batch.with_all(page);
    let html = page.to_html();
    let written = atomic_write(path, |out| out.write_all(html.as_bytes()));
    written.map_err(|e| Failure::new(format!("cannot write {}: {e}", path.display())))
}

impl Batch<'_> {
    fn command_line(&self, folder: &str) -> String {
        let Plan { command, flags, shards, version, .. } = self.plan;
        let parts = if *shards > 1 { format!(" --shard I/{shards}") } else { String::new() };
        let flags = if flags.is_empty() { String::new() } else { format!(" -- {}", flags.join(" ")) };
        format!("ndf batch {command} @items.txt -o {folder}{parts}{flags}    # ndf {version}")
    }

    fn shares(&self) -> Vec<(&'static str, &'static str, usize)> {
        let class = |status| match status {
            Status::Ok => "good",
            Status::Refused => "odd",
            Status::Timeout => "slow",
            Status::Memory => "worse",
            Status::Crash => "bad",
        };
        let mut shares: Vec<_> = counts(self.gathered.rows().map(|(head, _)| head))
            .into_iter()
            .map(|(status, count)| (status.name(), class(status), count))
            .collect();
        if self.gathered.missing() > 0 {
            shares.push(("missing", "none", self.gathered.missing()));
        }
        shares
    }

    fn done(&self) -> impl Iterator<Item = &Record> {
        self.table.records.iter().filter(|record| record.is_ok())
    }

    fn spreads(&self) -> Vec<Spread> {
        let seconds = |x: f64| format!("{} s", readable(x));
        let bytes = |x: f64| HumanBytes(x as u64).to_string();
        let peaks = self.table.records.iter().filter_map(|record| record.row.peak_bytes);
        let all = [
            Spread::new("Seconds", self.done().map(|record| record.row.seconds), seconds),
            Spread::new("Memory at most", peaks.map(|peak| peak as f64), bytes),
            Spread::new("Error", self.done().filter_map(|record| record.error), readable),
            Spread::new(
                "Bytes of what was written",
                self.done().filter_map(|r| r.bytes).map(|b| b as f64),
                bytes,
            ),
        ];
        all.into_iter().flatten().collect()
    }

    /// The results with the largest errors, the worst first.
    fn worst(&self) -> Vec<&Record> {
        let mut all: Vec<&Record> = self.done().filter(|record| record.error.is_some()).collect();
        all.sort_by(|a, b| b.error.unwrap_or_default().total_cmp(&a.error.unwrap_or_default()));
        all.truncate(WORST);
        all
    }

    fn with_worst(&self, page: Report, has_pictures: bool, context: &Context) -> Result<Report, Failure> {
        let worst = self.worst();
        let Some((_, what)) = self.recipe.error.filter(|_| !worst.is_empty()) else { return Ok(page) };
        let page = page.heading("The worst by error").paragraph(&format!("The error is the {what}."));
        let is_drawn = has_pictures && self.recipe.extension == Some("ndf");
        if !is_drawn {
            let rows = worst.iter().map(|record| self.row(record)).collect::<Vec<_>>();
            return Ok(page.table("", &self.header(), &rows));
        }
        context.expect(&["drawing"]);
        let progress = context.progress();
        let mut pairs = Vec::new();
        for (k, record) in worst.iter().enumerate() {
            progress.report("drawing", k as f64 / worst.len() as f64);
            let output = self.places.folder().join(record.row.output.as_deref().unwrap_or_default());
            let input = self.plan.found(&record.row.input);
            let pictures = pictures::pair(self.recipe, &self.plan.flags, &input, &output)?;
            let error = record.error.map_or_else(String::new, readable);
            let bytes = record.bytes.map_or_else(String::new, |bytes| format!(", {}", HumanBytes(bytes)));
            pairs.push(Pair { pictures, caption: format!("{}: {error}{bytes}", record.row.id) });
        }
        Ok(page.paragraph("On the left the input, on the right what was learned of it.").pairs(SIZE, &pairs))
    }

    fn with_reasons(&self, page: Report) -> Report {
        let reasons = reasons(self.table.records.iter().map(|record| &record.row));
        if reasons.is_empty() {
            return page;
        }
        let shown = reasons.iter().take(MAX_REASONS).map(|reason| {
            let examples = reason.examples.join(", ");
            let more = if reason.count > reason.examples.len() { " …" } else { "" };
            (
                reason.count,
                format!("{}: {}", reason.status.name(), reason.message),
                format!("{examples}{more}"),
            )
        });
        let page = page.heading("Why inputs failed").counted(&shown.collect::<Vec<_>>());
        match reasons.len().saturating_sub(MAX_REASONS) {
            0 => page,
            more => page.paragraph(&format!("{more} more reasons are in results.csv.")),
        }
    }

    fn with_all(&self, page: Report) -> Report {
        let page = page.heading("All inputs");
        let records = &self.table.records;
        if records.len() > MAX_LISTED {
            return page.paragraph(&format!("All {} rows are in results.csv.", grouped(records.len())));
        }
        let rows = records.iter().map(|record| self.row(record)).collect::<Vec<_>>();
        page.table("results.csv has these and all figures of the results.", &self.header(), &rows)
    }

    fn header(&self) -> Vec<&'static str> {
        let mut header = vec!["id", "status", "seconds", "memory"];
        header.extend(self.recipe.extension.map(|_| "bytes"));
        header.extend(self.recipe.error.map(|_| "error"));
        header
    }

    fn row(&self, record: &Record) -> Vec<String> {
        let row = &record.row;
        let mut cells = vec![
            row.id.clone(),
            row.status.name().to_owned(),
            readable(row.seconds),
            row.peak_bytes.map_or_else(String::new, |bytes| HumanBytes(bytes).to_string()),
        ];
        cells.extend(
            self.recipe.extension.map(|_| record.bytes.map_or_else(String::new, |b| grouped(b as usize))),
        );
        cells.extend(self.recipe.error.map(|_| record.error.map_or_else(String::new, readable)));
        cells
    }
}
