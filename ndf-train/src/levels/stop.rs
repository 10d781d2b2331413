//! Whether learning is to stop.

use std::sync::atomic::{AtomicBool, Ordering};

use ndf_core::Progress;

/// What was asked for once stays so: what is left unfinished then is not to be used.
pub(super) struct Stop<'a> {
    progress: &'a dyn Progress,
    requested: AtomicBool,
}

impl<'a> Stop<'a> {
    pub(super) fn new(progress: &'a dyn Progress) -> Self {
        Self { progress, requested: AtomicBool::new(false) }
    }

    /// Whether the observer asks to stop, or has done so before.
    pub(super) fn is_requested(&self) -> bool {
        if self.progress.cancelled() {
            self.requested.store(true, Ordering::Relaxed);
        }
        self.requested.load(Ordering::Relaxed)
    }
}
