//! Ctrl-C and SIGTERM ask long work to end well.

use std::io::{self, Write};
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);
static HANDLER: Once = Once::new();

/// A flag that is set by the first interruption from now on. The second ends the program at once, and says so.
pub fn flag() -> &'static AtomicBool {
    HANDLER.call_once(|| {
        // Without a handler an interruption ends the program, as it would anyway.
        let _ = ctrlc::set_handler(|| {
            if REQUESTED.swap(true, Ordering::Relaxed) {
                let _ = writeln!(io::stderr(), "\nndf: interrupted twice; what was not written yet is lost");
                std::process::exit(130);
            }
        });
    });
    &REQUESTED
}

/// Whether an interruption was asked for.
pub fn is_requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}
