//! A part of a batch: every item a process, every end a row.

use std::collections::{HashMap, HashSet};
use std::num::NonZero;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};
use std::sync::mpsc;
use std::thread;
use std::time::Instant;

use ndf_core::Progress;
use serde_json::json;

use super::arguments::Arguments;
use super::child::{self, Limits};
use super::items::{Item, items};
use super::plan::{Places, Plan, listed, sha256};
use super::recipe::Recipe;
use super::rows::{RowFile, Status, by_status, counts, in_words};
use super::shard::Shard;
use super::work::Work;
use crate::context::Context;
use crate::interrupt;
use crate::output::{Failure, Outcome, grouped};

/// Does a part of a batch.
///
/// # Errors
/// If there is nothing to do, the folder is of another batch, or it cannot be written; or if it is interrupted.
pub(super) fn run(recipe: &Recipe, arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let started = Instant::now();
    let shard = check(arguments)?;
    let places = Places::in_folder(&arguments.output);
    let items = items(&arguments.inputs, &arguments.output)?;
    let flags = arguments.flags(context.options());
    let extension = arguments.extension(recipe);
    let plan = Plan {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        command: recipe.name.to_owned(),
        flags: flags.clone(),
        extension: extension.map(str::to_owned),
        shards: shard.count,
        items: items.len(),
        list_sha256: sha256(listed(&items).as_bytes()),
        begun_in: std::env::current_dir().ok(),
    };
    plan.settle(&items, &places)?;
    let own: Vec<&Item> = shard.of(items.len()).map(|place| &items[place]).collect();
    let (mut file, done) = begun(arguments, shard, &places)?;
    let pending: Vec<&Item> = own.iter().copied().filter(|item| !done.contains(&item.id)).collect();
    let (jobs, threads) = shared_out(arguments.jobs, context.options().threads, pending.len());
    let limits = Limits { time: arguments.timeout, memory: arguments.memory };
    let work = Work { recipe, flags, extension, places: &places, limits, threads };
    work.remove_unfinished(&pending);
    let made = all(&work, &pending, jobs, own.len(), &mut file, context)?;
    if made < pending.len() {
        let (left, all) = (grouped(pending.len() - made), grouped(own.len()));
        return Err(Failure::new(format!("interrupted with {left} of {all} items to go"))
            .try_instead("the same command with --resume goes on"));
    }
    let ranks: HashMap<&str, usize> = own.iter().enumerate().map(|(k, item)| (item.id.as_str(), k)).collect();
    let lines = file.finish(&ranks)?;
    let counts = counts(lines.iter().map(|(head, _)| head));
    let mut json = json!({
        "command": recipe.name,
        "output": arguments.output.display().to_string(),
        "rows": places.rows(shard.index).display().to_string(),
        "shard": shard.index,
        "shards": shard.count,
        "items": own.len(),
        "items_made": made,
        "seconds": started.elapsed().as_secs_f64(),
    });
    json["counts"] = by_status(&counts).into();
    let part = if shard == Shard::WHOLE { String::new() } else { format!(" of part {shard}") };
    let rows = places.rows(shard.index);
    let text = format!("{}: {} rows{part}, {}\n", rows.display(), grouped(own.len()), in_words(&counts));
    Ok(Outcome::new(json, text))
}

/// The part that is asked for, if all can be had here.
fn check(arguments: &Arguments) -> Result<Shard, Failure> {
    if arguments.memory.is_some() && !child::can_limit_memory() {
        return Err(Failure::new("--memory needs Linux, which tells how much memory a process has")
            .try_instead("leave it out"));
    }
    if arguments.output.to_str().is_none() {
        let what = format!("the name {} is not in UTF-8", arguments.output.display());
        return Err(Failure::new(what).try_instead("choose another folder"));
    }
    match arguments.shard {
        Some(shard) => Ok(shard),
        None => Ok(Shard::of_slurm(|name| std::env::var(name).ok())?.unwrap_or(Shard::WHOLE)),
    }
}

/// The file of the part's rows, and the items that have one.
fn begun(
    arguments: &Arguments,
    shard: Shard,
    places: &Places,
) -> Result<(RowFile, HashSet<String>), Failure> {
    let (lines, file) = RowFile::open(&places.rows(shard.index))?;
    if lines.iter().next().is_some() && !arguments.resume {
        let rows = places.rows(shard.index);
        return Err(Failure::new(format!("{} has rows of an earlier run", rows.display()))
            .try_instead("--resume goes on with it; or choose another folder"));
    }
    let is_kept = |status: Status| !(arguments.retry && status.is_worth_another());
    let kept = || lines.iter().filter(|(head, _)| is_kept(head.status));
    let done: HashSet<String> = kept().map(|(head, _)| head.id.clone()).collect();
    let file =
        if done.len() < lines.iter().count() { file.replaced(kept().map(|(_, line)| line))? } else { file };
    Ok((file, done))
}

/// How many items at a time and how many threads each, on the cores of this machine.
fn shared_out(jobs: Option<u16>, threads: Option<u16>, items: usize) -> (usize, usize) {
    let cores = thread::available_parallelism().map_or(1, NonZero::get);
    let jobs = jobs.map(usize::from);
    let threads = threads.map(usize::from);
    let jobs = jobs.unwrap_or_else(|| (cores / threads.unwrap_or(1)).max(1)).min(items.max(1));
    (jobs, threads.unwrap_or_else(|| (cores / jobs).max(1)))
}

/// Does all items, so many at a time, and adds their rows in the order in which they end. How many have ended; fewer than all
/// where the batch is interrupted.
fn all(
    work: &Work<'_>,
    items: &[&Item],
    jobs: usize,
    of: usize,
    file: &mut RowFile,
    context: &Context,
) -> Result<usize, Failure> {
    let _tending = interrupt::tend();
    let progress = context.progress();
    context.expect(&["items"]);
    let (sender, rows) = mpsc::channel();
    let next = AtomicUsize::new(0);
    let has_failed = AtomicBool::new(false);
    thread::scope(|scope| {
        for _ in 0..jobs {
            let (sender, next, has_failed) = (sender.clone(), &next, &has_failed);
            scope.spawn(move || {
                while let Some(item) = items.get(next.fetch_add(1, Relaxed))
                    && !interrupt::is_requested()
                    && !has_failed.load(Relaxed)
                    && sender.send(work.item(item)).is_ok()
                {}
            });
        }
        drop(sender);
        let mut made = 0;
        let mut counts = [0; Status::ALL.len()];
        let mut failure = None;
        progress.report("items", (of - items.len()) as f64 / of.max(1) as f64);
        for row in rows {
            let added = row.and_then(|row| match row {
                Some(row) => file.add(&row).map(|()| Some(row.status)),
                None => Ok(None),
            });
            match added {
                Ok(Some(status)) => {
                    made += 1;
                    counts[status as usize] += 1;
                }
                Ok(None) => {}
                Err(error) => {
                    // What runs is done, and nothing new begins.
                    has_failed.store(true, Relaxed);
                    failure.get_or_insert(error);
                }
            }
            let counted: Vec<_> = Status::ALL.into_iter().zip(counts).collect();
            progress.detail(&in_words(&counted));
            progress.report("items", (of - items.len() + made) as f64 / of.max(1) as f64);
        }
        failure.map_or(Ok(made), Err)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cores_are_shared_out() {
        let cores = thread::available_parallelism().map_or(1, NonZero::get);
        assert_eq!(shared_out(None, None, 1000), (cores, 1));
        assert_eq!(shared_out(None, None, 1), (1, cores));
        assert_eq!(shared_out(Some(1), None, 1000), (1, cores));
        assert_eq!(shared_out(None, Some(1024), 1000), (1, 1024));
        assert_eq!(shared_out(Some(3), Some(5), 1000), (3, 5));
        assert_eq!(shared_out(Some(3), None, 0).0, 1);
    }
}
