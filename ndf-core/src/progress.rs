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

/// Checks in a loop whose steps are too short for a check each.
pub struct Sparingly<'a> {
    progress: &'a dyn Progress,
    every: u32,
    steps: u32,
}

impl<'a> Sparingly<'a> {
    /// Asks `progress` once in `every` steps, the first time after so many.
    pub fn new(progress: &'a dyn Progress, every: u32) -> Self {
        Self { progress, every, steps: 0 }
    }

    /// One step: goes on unless it is time to ask and the work should stop.
    ///
    /// # Errors
    /// [`Cancelled`], if it should.
    #[inline]
    pub fn check(&mut self) -> Result<(), Cancelled> {
        self.steps += 1;
        if self.steps < self.every {
            return Ok(());
        }
        self.steps = 0;
        self.progress.check()
    }
}

/// A part of longer work, as its observer sees it: what is reported as 0 to 1 is from one fraction of the whole to another.
pub struct Part<'a> {
    whole: &'a dyn Progress,
    from: f64,
    to: f64,
}

impl<'a> Part<'a> {
    /// The part of the work that `whole` observes between two fractions of it.
    pub fn new(whole: &'a dyn Progress, from: f64, to: f64) -> Self {
        Self { whole, from, to }
    }
}

impl Progress for Part<'_> {
    fn report(&self, stage: &str, fraction: f64) {
        self.whole.report(stage, self.from + (self.to - self.from) * fraction);
    }

    fn detail(&self, text: &str) {
        self.whole.detail(text);
    }

    fn cancelled(&self) -> bool {
        self.whole.cancelled()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    struct Noted(Mutex<Vec<f64>>);

    impl Progress for Noted {
        fn report(&self, _stage: &str, fraction: f64) {
            self.0.lock().unwrap().push(fraction);
        }
        fn cancelled(&self) -> bool {
            true
        }
    }

    #[test]
    fn parts_report_to_the_whole() {
        let noted = Noted(Mutex::new(Vec::new()));
        let half = Part::new(&noted, 0.5, 1.0);
        Part::new(&half, 0.0, 0.5).report("a stage", 1.0);
        half.report("a stage", 1.0);
        assert!(half.cancelled());
        assert_eq!(*noted.0.lock().unwrap(), [0.75, 1.0]);
    }

    struct Stopped;

    impl Progress for Stopped {
        fn report(&self, _stage: &str, _fraction: f64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }

    #[test]
    fn short_steps_ask_once_in_so_many() {
        let mut steps = Sparingly::new(&Stopped, 3);
        let found: Vec<bool> = (0..6).map(|_| steps.check().is_err()).collect();
        assert_eq!(found, [false, false, true, false, false, true]);
        assert!((0..10).all(|_| Sparingly::new(&NoProgress, 1).check().is_ok()));
    }

    #[test]
    fn work_goes_on_unless_it_is_cancelled() {
        assert_eq!(NoProgress.check(), Ok(()));
        assert_eq!(Stopped.check(), Err(Cancelled));
    }
}
