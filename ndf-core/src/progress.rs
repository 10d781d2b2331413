//! Watching and stopping long work. Libraries print nothing; they report here.

/// An observer of long work.
///
/// Work that can be stopped calls [`check`](Progress::check) where it can stop, and passes [`Cancelled`] on: every
/// error of such work has a variant for it, made by `From<Cancelled>`.
pub trait Progress: Sync {
    /// `stage` is under way and `fraction` of it, in `[0, 1]`, is done.
    fn report(&self, stage: &str, fraction: f64);

    /// A figure to be shown beside the stage, the loss for instance.
    fn detail(&self, _text: &str) {}

    /// Whether the work should stop as soon as it can.
    fn cancelled(&self) -> bool {
        false
    }

    /// Goes on unless the work should stop.
    ///
    /// # Errors
    /// [`Cancelled`], if it should.
    fn check(&self) -> Result<(), Cancelled> {
        if self.cancelled() { Err(Cancelled) } else { Ok(()) }
    }
}

/// The work was stopped by its [`Progress`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// Watches nothing, stops nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProgress;

impl Progress for NoProgress {
    fn report(&self, _stage: &str, _fraction: f64) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Stopped;

    impl Progress for Stopped {
        fn report(&self, _stage: &str, _fraction: f64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }

    #[test]
    fn work_goes_on_unless_it_is_cancelled() {
        assert_eq!(NoProgress.check(), Ok(()));
        assert_eq!(Stopped.check(), Err(Cancelled));
    }
}
