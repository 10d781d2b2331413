//! How long work tells what it is at, and is told to stop.

/// Watches long work. Libraries print nothing; a program shows what is reported here.
pub trait Progress: Sync {
    /// `stage` has come as far as `fraction`, from 0 to 1. Called from any thread, some hundred times a stage
    /// at most.
    fn report(&self, stage: &str, fraction: f64);

    /// Whether the work should end early. Asked between short pieces of work.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Watches nothing and never cancels.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProgress;

impl Progress for NoProgress {
    fn report(&self, _stage: &str, _fraction: f64) {}
}
