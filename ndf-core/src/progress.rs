//! Watching and stopping long work. Libraries print nothing; they report here.

/// An observer of long work.
pub trait Progress: Sync {
    /// `stage` is under way and `fraction` of it, in `[0, 1]`, is done.
    fn report(&self, stage: &str, fraction: f64);

    /// A figure to be shown beside the stage, the loss for instance.
    fn detail(&self, _text: &str) {}

    /// Whether the work should stop as soon as it can.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Watches nothing, stops nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProgress;

impl Progress for NoProgress {
    fn report(&self, _stage: &str, _fraction: f64) {}
}
