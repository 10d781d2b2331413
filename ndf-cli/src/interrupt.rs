//! Signals: what is being learned ends well, everything else at once.

use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};

use ndf_mesh::io::remove_temporary_files;

/// Whether there is something that an interruption should save.
static LEARNING: AtomicBool = AtomicBool::new(false);
static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Listens to Ctrl-C and other requests to end, for the rest of the process. While something is [learned](learning), the
/// first sets the flag and the second ends the program; else the first does, and nothing half-written stays. Signals that
/// are ignored, as with `nohup`, stay ignored.
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
}

/// The flag that is set while something is learned and an interruption is to save it.
pub fn flag() -> &'static AtomicBool {
    &REQUESTED
}

/// Says whether there is something that an interruption should save.
pub fn learning(is_learning: bool) {
    LEARNING.store(is_learning, Ordering::Relaxed);
}

/// Whether an interruption was asked for.
pub fn is_requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

fn interrupted(code: i32) {
    let is_first = !REQUESTED.swap(true, Ordering::Relaxed);
    if is_first && LEARNING.load(Ordering::Relaxed) {
        return;
    }
    remove_temporary_files();
    let what = if is_first { "interrupted" } else { "interrupted twice; what was not written yet is lost" };
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
