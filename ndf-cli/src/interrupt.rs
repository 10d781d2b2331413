//! Signals: what is being learned ends well, everything else at once.

use std::io::{self, Read, Write};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use ndf_mesh::io::remove_temporary_files;

use crate::streams;

/// Set to 1 in the environment of a process that is to end when its standard input does, as on a first signal. Whoever holds
/// the other end of that pipe takes the process along, even if it is killed itself.
pub const TIED: &str = "NDF_ENDS_WITH_STDIN";

/// What a [tied](TIED) process ends with when it was asked to end, and no other does: as if by SIGTERM.
pub const TIED_CODE: u8 = 143;

/// Whether there is something that an interruption should save.
static LEARNING: AtomicBool = AtomicBool::new(false);
/// Whether there are processes that are to be ended in order.
static TENDING: AtomicBool = AtomicBool::new(false);
static REQUESTED: AtomicBool = AtomicBool::new(false);
/// Signals that came.
static SIGNALS: AtomicU32 = AtomicU32::new(0);

/// Listens to Ctrl-C and other requests to end, for the rest of the process. While something is [learned](learning), the
/// first sets the flag and the second ends the program; else the first does, and nothing half-written stays. Signals that
/// are ignored, as with `nohup`, stay ignored. A [tied](TIED) process listens to the end of its standard input, too.
pub fn listen() {
    // Without a handler, or a thread for it, an interruption ends the program as well, if less tidily.
    #[cfg(unix)]
    let _ = std::thread::Builder::new().spawn(|| {
        if let Ok(mut signals) = signal_hook::iterator::Signals::new(heeded()) {
            signals.forever().for_each(|signal| interrupted(128 + signal));
        }
    });
    #[cfg(not(unix))]
    let _ = ctrlc::set_handler(|| interrupted(130));
    if is_tied() {
        let _ = std::thread::Builder::new().spawn(|| {
            // What comes says nothing; that no more comes does.
            while io::stdin().lock().read(&mut [0; 64]).is_ok_and(|read| read > 0) {}
            abandoned();
        });
    }
}

/// Whether the process ends with its standard input.
pub fn is_tied() -> bool {
    std::env::var_os(TIED).is_some_and(|value| value == "1")
}

/// The flag that is set while something is learned and an interruption is to save it.
pub fn flag() -> &'static AtomicBool {
    &REQUESTED
}

/// Says whether there is something that an interruption should save.
pub fn learning(is_learning: bool) {
    LEARNING.store(is_learning, Ordering::Relaxed);
}

/// Leaves the first two signals to the caller, who ends what it has started, until the value is dropped.
#[must_use]
pub fn tend() -> Tending {
    TENDING.store(true, Ordering::Relaxed);
    Tending(())
}

/// As long as it lives, two signals do not end the program.
#[derive(Debug)]
pub struct Tending(());

impl Drop for Tending {
    fn drop(&mut self) {
        TENDING.store(false, Ordering::Relaxed);
    }
}

/// Whether an interruption was asked for.
pub fn is_requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

/// Whether it was asked for more than once: at once, then, and not in order.
pub fn is_insisted_on() -> bool {
    SIGNALS.load(Ordering::Relaxed) > 1
}

/// The other end of the standard input is gone: as a first signal, but never the second.
fn abandoned() {
    if !REQUESTED.swap(true, Ordering::Relaxed) && !LEARNING.load(Ordering::Relaxed) {
        end("interrupted", TIED_CODE.into());
    }
}

fn interrupted(code: i32) {
    let before = SIGNALS.fetch_add(1, Ordering::Relaxed);
    REQUESTED.store(true, Ordering::Relaxed);
    let is_first = before == 0;
    if is_first && LEARNING.load(Ordering::Relaxed) || before < 2 && TENDING.load(Ordering::Relaxed) {
        return;
    }
    let what = if is_first { "interrupted" } else { "interrupted twice; what was not written yet is lost" };
    end(what, code);
}

fn end(what: &str, code: i32) {
    remove_temporary_files();
    streams::close();
    let _ = writeln!(io::stderr(), "\nndf: {what}");
    std::process::exit(code);
}

/// The signals that ask to end, but for those that whoever started the program has it ignore.
#[cfg(unix)]
fn heeded() -> Vec<i32> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let ignored = ignored().unwrap_or(0);
    [SIGHUP, SIGINT, SIGTERM].into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0).collect()
}

/// A bit for every signal that is ignored, where the system tells.
#[cfg(unix)]
fn ignored() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
    u64::from_str_radix(mask.trim(), 16).ok()
}
