//! What a run takes.

use std::time::{Duration, Instant};

/// The wall time of a run.
pub(crate) struct Clock {
    started: Instant,
    /// What the run had taken before it was resumed.
    before: Duration,
    /// Time spent on projecting, since the last resumption.
    pub(crate) projecting: Duration,
}

impl Clock {
    /// A clock that starts now, of a run that has taken so long before.
    pub(crate) fn resumed_after(before: Duration) -> Self {
        Self { started: Instant::now(), before, projecting: Duration::ZERO }
    }

    /// Wall time of training, that before a resumed checkpoint included.
    pub(crate) fn elapsed(&self) -> Duration {
        self.before.saturating_add(self.started.elapsed())
    }
}
