//! An item: its process, what that leaves, and its row.

use std::collections::HashSet;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use ndf_mesh::io::remove_unfinished;
use serde_json::{Map, Value};
use sha2::{Digest, Sha256};

use super::child::{self, End, Ended, Limits};
use super::flags;
use super::items::Item;
use super::plan::{Places, hexadecimal};
use super::recipe::Recipe;
use super::rows::{Row, Status};
use crate::interrupt;
use crate::itself;
use crate::output::{Failure, grouped};

/// How long the batch may take to hear of a signal that its process has heard of already.
const HEARING: Duration = Duration::from_secs(1);

/// What is done with every item.
#[derive(Debug)]
pub(super) struct Work<'a> {
    /// The command.
    pub recipe: &'a Recipe,
    /// Its options.
    pub flags: Vec<String>,
    /// The ending of outputs, if there are some.
    pub extension: Option<&'a str>,
    /// The folder of the batch.
    pub places: &'a Places,
    /// What an item may take.
    pub limits: Limits,
    /// The threads that it has.
    pub threads: usize,
}

impl Work<'_> {
    /// Does an item and says what became of it; `None` if it was interrupted.
    ///
    /// # Errors
    /// If its process cannot be started, or the folder of the batch cannot be written.
    pub(super) fn item(&self, item: &Item) -> Result<Option<Row>, Failure> {
        let (output, checkpoint) = (self.output(item), self.checkpoint(item));
        for place in output.iter().chain(&checkpoint).filter_map(|path| path.parent()) {
            fs::create_dir_all(place)
                .map_err(|e| Failure::new(format!("cannot make {}: {e}", place.display())))?;
        }
        let input_sha256 = hash(Path::new(&item.input));
        let begun = checkpoint.as_deref().filter(|path| path.is_file());
        let mut ended = self.process(item, begun)?;
        if begun.is_some() && ended.end == End::Exit(1) && !interrupt::is_requested() {
            // The checkpoint may be of another version, or the input has changed.
            self.remove(&checkpoint);
            ended = self.process(item, None)?;
        }
        if is_interrupted(ended.end) {
            remove_unfinished(&self.places_of(item));
            return Ok(None);
        }
        let (status, message, result) = judged(&ended, self.limits);
        self.remove(&checkpoint);
        if status != Status::Ok {
            self.remove(&output);
            self.remove(&self.beside(item));
            remove_unfinished(&self.places_of(item));
        }
        let is_written = output.as_deref().is_some_and(Path::exists);
        Ok(Some(Row {
            id: item.id.clone(),
            input: item.input.clone(),
            input_sha256,
            status,
            message,
            exit_code: match ended.end {
                End::Exit(code) => Some(code),
                _ => None,
            },
            seconds: ended.elapsed.as_secs_f64(),
            peak_bytes: ended.peak_bytes,
            warnings: ended.warnings(),
            output: is_written.then(|| format!("files/{}", self.output_name(item))),
            result,
        }))
    }

    /// Removes what processes that were killed were writing for these items.
    pub(super) fn remove_unfinished(&self, items: &[&Item]) {
        remove_unfinished(&items.iter().flat_map(|item| self.places_of(item)).collect());
    }

    fn process(&self, item: &Item, begun: Option<&Path>) -> Result<Ended, Failure> {
        let cannot = |e: io::Error| Failure::new(format!("cannot start a process for {}: {e}", item.id));
        let text = |path: Option<PathBuf>| path.map(|path| path.to_string_lossy().into_owned());
        let mut flags = match begun {
            Some(_) => flags::beside_resume(self.recipe, &self.flags),
            None => self.flags.clone(),
        };
        if let Some(checkpoint) = text(self.checkpoint(item)) {
            if begun.is_some() {
                flags.push(format!("--resume={checkpoint}"));
            }
            flags.push(format!("--checkpoint={checkpoint}"));
        }
        let output = text(self.output(item));
        let words = flags::command_line(self.recipe, &item.input, output.as_deref(), self.threads, &flags);
        child::run(itself::command().map_err(cannot)?.args(words), self.limits).map_err(cannot)
    }

    fn output_name(&self, item: &Item) -> String {
        format!("{}.{}", item.id, self.extension.unwrap_or_default())
    }

    fn output(&self, item: &Item) -> Option<PathBuf> {
        self.extension.map(|_| self.places.outputs().join(self.output_name(item)))
    }

    fn checkpoint(&self, item: &Item) -> Option<PathBuf> {
        let name = || self.places.checkpoints().join(format!("{}.checkpoint", item.id));
        self.recipe.has_checkpoints().then(name)
    }

    fn beside(&self, item: &Item) -> Vec<PathBuf> {
        let name = |ending: &&str| self.places.outputs().join(format!("{}.{ending}", item.id));
        self.recipe.beside.iter().map(name).collect()
    }

    /// All that it may write.
    fn places_of(&self, item: &Item) -> HashSet<PathBuf> {
        self.output(item).into_iter().chain(self.checkpoint(item)).chain(self.beside(item)).collect()
    }

    /// Removes files, whether or not they are there.
    fn remove<'p>(&self, paths: impl IntoIterator<Item = &'p PathBuf>) {
        paths.into_iter().for_each(|path| drop(fs::remove_file(path)));
    }
}

/// Whether a process ended because the batch is to. It may have heard of a signal before the batch has.
fn is_interrupted(end: End) -> bool {
    let heard = Instant::now();
    while end == End::Interrupted && !interrupt::is_requested() && heard.elapsed() < HEARING {
        thread::sleep(Duration::from_millis(10));
    }
    interrupt::is_requested() && end != End::Exit(0)
}

/// What a process that ended says of its item.
fn judged(ended: &Ended, limits: Limits) -> (Status, Option<String>, Option<Map<String, Value>>) {
    let last = ended.sentence();
    let because = |what: String| match &last {
        Some(said) => format!("{what}; {said}"),
        None => what,
    };
    let printed = || serde_json::from_slice(ended.printed.as_deref()?).ok();
    let (status, message) = match ended.end {
        End::Exit(0) => match printed() {
            Some(result) => return (Status::Ok, None, Some(result)),
            None => (Status::Crash, because("it printed no result".to_owned())),
        },
        End::Exit(code @ (1 | 2)) => {
            (Status::Refused, last.unwrap_or_else(|| format!("ended with code {code}")))
        }
        End::Exit(code) => (Status::Crash, because(format!("ended with code {code}"))),
        End::Signal(number) => (Status::Crash, because(format!("ended by {}", signal(number)))),
        End::Interrupted => (Status::Crash, "interrupted by a signal that was not for the batch".to_owned()),
        End::Timeout => {
            let seconds = limits.time.unwrap_or_default().as_secs_f64();
            (Status::Timeout, format!("took longer than {seconds} s (--timeout)"))
        }
        End::Memory => {
            let bytes = grouped(limits.memory.unwrap_or_default() as usize);
            (Status::Memory, format!("took more than {bytes} bytes of memory (--memory)"))
        }
    };
    (status, Some(message), None)
}

#[cfg(unix)]
fn signal(number: i32) -> String {
    let name = signal_hook::low_level::signal_name(number);
    let advice = if number == signal_hook::consts::SIGKILL { ", perhaps for want of memory" } else { "" };
    format!("signal {number}{}{advice}", name.map_or_else(String::new, |name| format!(" ({name})")))
}

#[cfg(not(unix))]
fn signal(number: i32) -> String {
    format!("signal {number}")
}

/// The hash of a file; none where there is none, or it cannot be read.
fn hash(path: &Path) -> Option<String> {
    if !path.is_file() {
        return None;
    }
    let mut hash = Sha256::new();
    io::copy(&mut File::open(path).ok()?, &mut hash).ok()?;
    Some(hexadecimal(&hash.finalize()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ended(end: End, printed: &str, said: &str) -> Ended {
        let (printed, said) = (Some(printed.as_bytes().to_vec()), said.to_owned());
        Ended { end, printed, said, elapsed: Duration::from_secs(1), peak_bytes: None }
    }

    #[test]
    fn ends_are_judged() {
        let judge = |end, printed: &str, said: &str| {
            let limits = Limits { time: Some(Duration::from_millis(1500)), memory: Some(1 << 20) };
            let (status, message, result) = judged(&ended(end, printed, said), limits);
            (status, message.unwrap_or_default(), result.is_some())
        };
        let nothing = String::new;
        assert_eq!(judge(End::Exit(0), "{\"a\":1}\n", "ndf: warning: b\n"), (Status::Ok, nothing(), true));
        assert_eq!(judge(End::Exit(0), "{\"a\":", "").0, Status::Crash);
        let said = "ndf: warning: w\nndf: a.obj: no faces; try more\n\nndf: note: n\n";
        assert_eq!(
            judge(End::Exit(1), "", said),
            (Status::Refused, "a.obj: no faces; try more".into(), false)
        );
        let panic = "thread 'main' panicked at x.rs:1:\nno\nnote: run with `RUST_BACKTRACE=1`\n";
        assert_eq!(
            judge(End::Exit(101), "", panic),
            (Status::Crash, "ended with code 101; no".into(), false)
        );
        assert_eq!(
            judge(End::Timeout, "", said),
            (Status::Timeout, "took longer than 1.5 s (--timeout)".into(), false)
        );
        assert!(judge(End::Memory, "", "").1.contains("1,048,576 bytes"));
        #[cfg(unix)]
        assert_eq!(judge(End::Signal(11), "", "").1, "ended by signal 11 (SIGSEGV)");
        assert_eq!(judge(End::Interrupted, "", "").0, Status::Crash);
        assert_eq!(ended(End::Exit(1), "", said).warnings(), ["w"]);
    }
}
