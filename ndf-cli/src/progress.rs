//! Progress on the error stream: a bar on a terminal, else one plain line every few seconds.
//!
//! A command is one job, whose stages come in the order of `STAGES`: the share that is done is of all of them and never falls.
//! How long is left is said in the longest stage alone, which makes itself known by its own pace; what comes before tells too
//! little of it.

use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use ndf_core::Progress;

use crate::interrupt;

/// Time between plain lines.
const INTERVAL: Duration = Duration::from_secs(3);

/// How much of a stage is to be done, and for how long it is to run, before it tells how long it will take.
const TELLING: (f64, Duration) = (0.05, Duration::from_secs(4));

/// All stages in the order in which jobs have them, and about how long each takes beside the others. Of those in one row a
/// job has one.
const STAGES: [(&[&str], f64); 14] = [
    (&["orienting"], 10.0),
    (&["marching cubes"], 10.0),
    (&["decimation"], 5.0),
    (&["final pass"], 5.0),
    (&["sampling the field"], 15.0),
    (&["training", "levels"], 100.0),
    (&["scalars", "learning scalar fields"], 100.0),
    (&["extraction"], 10.0),
    (&["measuring"], 5.0),
    (&["geodesic distances"], 30.0),
    (&["factoring"], 5.0),
    (&["modes"], 20.0),
    (&["drawing"], 10.0),
    (&["items"], 100.0),
];

/// Stages at the end of which something is learned.
const LEARNING: [&str; 2] = ["training", "levels"];

/// Steps of a full bar.
const STEPS: f64 = 1000.0;

/// The progress of one command, on the error stream or nowhere.
#[derive(Clone, Debug)]
pub struct Job(Arc<Mutex<State>>);

#[derive(Debug)]
struct State {
    /// Which of the stages are expected.
    expected: [bool; STAGES.len()],
    /// The stages up to the last that began.
    reached: usize,
    stage: String,
    detail: String,
    /// When the stage began, and how much of it is done.
    begun: Instant,
    part: f64,
    /// How much is done of all.
    done: f64,
    shown: Shown,
}

#[derive(Debug)]
enum Shown {
    Nowhere,
    Bar(ProgressBar),
    Lines {
        /// When the last one was written.
        last: Instant,
    },
}

impl Job {
    /// A job that shows nothing.
    pub fn hidden() -> Self {
        Self::new(Shown::Nowhere)
    }

    /// A job with a bar if the error stream is a terminal, else plain lines.
    pub fn on_stderr() -> Self {
        Self::new(if io::stderr().is_terminal() {
            let style = ProgressStyle::with_template("{msg:20} {wide_bar:.cyan/dim} {percent:>3} %{prefix}");
            Shown::Bar(ProgressBar::new(STEPS as u64).with_style(style.expect("the template is valid")))
        } else {
            Shown::Lines { last: Instant::now() }
        })
    }

    fn new(shown: Shown) -> Self {
        let (stage, detail, expected) = (String::new(), String::new(), [false; STAGES.len()]);
        let state =
            State { expected, reached: 0, stage, detail, begun: Instant::now(), part: 0.0, done: 0.0, shown };
        Self(Arc::new(Mutex::new(state)))
    }

    /// Adds stages to those that are to come.
    pub fn expect(&self, stages: &[&str]) {
        self.with(|state| {
            for (expected, (names, _)) in state.expected.iter_mut().zip(STAGES) {
                *expected |= names.iter().any(|name| stages.contains(name));
            }
        });
    }

    /// Writes a line to the error stream, beside the bar.
    pub fn say(&self, line: &str) {
        let write = || {
            let _ = writeln!(io::stderr(), "{line}");
        };
        match self.0.lock() {
            Ok(state) => match &state.shown {
                Shown::Bar(bar) => bar.suspend(write),
                _ => write(),
            },
            Err(_) => write(),
        }
    }

    fn with(&self, change: impl FnOnce(&mut State)) {
        if let Ok(mut state) = self.0.lock() {
            change(&mut state);
        }
    }
}

impl State {
    fn report(&mut self, stage: &str, fraction: f64) {
        let now = Instant::now();
        if self.stage != stage {
            stage.clone_into(&mut self.stage);
            self.detail.clear();
            (self.begun, self.part) = (now, 0.0);
            if let Some(at) = self.at() {
                // What did not begin by now is not needed.
                (self.reached..at).for_each(|k| self.expected[k] = false);
                self.reached = self.reached.max(at + 1);
            }
        }
        // A stage that begins anew, as of a base mesh that is made again, goes on where it was.
        self.part = self.part.max(if fraction.is_finite() { fraction.clamp(0.0, 1.0) } else { 0.0 });
        self.done = self.done.max(self.whole());
        let text = self.text(now);
        match &mut self.shown {
            Shown::Nowhere => {}
            Shown::Bar(bar) => {
                bar.set_message(stage.to_owned());
                bar.set_prefix(text);
                bar.set_position((self.done * STEPS) as u64);
            }
            Shown::Lines { last } if now - *last >= INTERVAL => {
                *last = now;
                let _ = writeln!(io::stderr(), "{:.0} %: {stage}{text}", 100.0 * self.done);
            }
            Shown::Lines { .. } => {}
        }
    }

    /// Which stage it is.
    fn at(&self) -> Option<usize> {
        STAGES.iter().position(|(names, _)| names.contains(&self.stage.as_str()))
    }

    /// The weights of the stages before this one, of itself and of those after it; `None` if it was not expected.
    fn weights(&self) -> Option<[f64; 3]> {
        let at = self.at()?;
        let weight = |k: usize| if self.expected[k] { STAGES[k].1 } else { 0.0 };
        let sum = |range: std::ops::Range<usize>| range.map(weight).sum::<f64>();
        self.expected[at].then(|| [sum(0..at), weight(at), sum(at + 1..STAGES.len())])
    }

    /// How much of all stages is done; a stage that was not expected changes nothing.
    fn whole(&self) -> f64 {
        let part = |[before, own, after]: [f64; 3]| (before + own * self.part) / (before + own + after);
        self.weights().map_or(0.0, part)
    }

    /// The figure of the stage, and how long is left.
    fn text(&self, now: Instant) -> String {
        let mut text = String::new();
        if !self.detail.is_empty() {
            text += &format!(", {}", self.detail);
        }
        if let Some(left) = self.left(now - self.begun) {
            text += &format!(", about {} left", spelt(left));
        }
        text
    }

    /// The seconds that are left, by the pace of the longest stage.
    fn left(&self, elapsed: Duration) -> Option<f64> {
        let [_, own, after] = self.weights()?;
        let expected = STAGES.iter().zip(self.expected).filter(|(_, expected)| *expected);
        let is_longest = expected.into_iter().all(|((_, weight), _)| *weight <= own);
        if !is_longest || self.part < TELLING.0 || self.part >= 1.0 || elapsed < TELLING.1 {
            return None;
        }
        Some(elapsed.as_secs_f64() * (1.0 - self.part + after / own) / self.part)
    }
}

/// A time, no more exactly than it is known.
fn spelt(seconds: f64) -> String {
    match seconds {
        ..55.0 => format!("{:.0} s", (seconds / 5.0).ceil() * 5.0),
        ..5400.0 => format!("{:.0} min", (seconds / 60.0).ceil()),
        _ => format!("{:.0} h", (seconds / 3600.0).ceil()),
    }
}

/// Reports to the job. Nothing stays on a terminal when it is dropped.
#[derive(Debug)]
pub struct ShownProgress {
    job: Job,
    cancel: Option<&'static AtomicBool>,
}

impl ShownProgress {
    /// Reports to this job.
    pub fn of(job: &Job) -> Self {
        Self { job: job.clone(), cancel: None }
    }

    /// Asks the work to stop once `cancel` is set, by the handler of a signal for instance, which should spare the program
    /// from the first report of a stage that learns something on.
    #[must_use]
    pub fn cancelled_by(mut self, cancel: &'static AtomicBool) -> Self {
        self.cancel = Some(cancel);
        self
    }
}

impl Progress for ShownProgress {
    fn report(&self, stage: &str, fraction: f64) {
        if self.cancel.is_some() && LEARNING.contains(&stage) {
            interrupt::learning(true);
        }
        self.job.with(|state| state.report(stage, fraction));
    }

    fn detail(&self, text: &str) {
        self.job.with(|state| text.clone_into(&mut state.detail));
    }

    fn cancelled(&self) -> bool {
        self.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}

impl Drop for ShownProgress {
    fn drop(&mut self) {
        if self.cancel.is_some() {
            interrupt::learning(false);
        }
        self.job.with(|state| {
            if let Shown::Bar(bar) = &state.shown {
                bar.set_draw_target(indicatif::ProgressDrawTarget::hidden());
                bar.set_draw_target(indicatif::ProgressDrawTarget::stderr());
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(stages: &[&str]) -> State {
        let job = Job::hidden();
        job.expect(stages);
        let Job(state) = job;
        Arc::into_inner(state).unwrap().into_inner().unwrap()
    }

    #[test]
    fn what_is_done_never_falls_and_ends_with_the_last_stage() {
        let mut state = state(&["marching cubes", "sampling the field", "levels"]);
        let mut last = 0.0;
        let passes = (0..7).flat_map(|_| [("sampling the field", 0.0), ("sampling the field", 1.0)]);
        let first = [("marching cubes", 0.5), ("marching cubes", f64::NAN), ("a stage of another job", 1.0)];
        for (stage, fraction) in
            first.into_iter().chain(passes).chain([("levels", 0.4), ("marching cubes", 0.2)])
        {
            state.report(stage, fraction);
            assert!(state.done >= last, "{stage} {fraction}");
            last = state.done;
        }
        assert!((0.3..0.9).contains(&last), "{last}");
        // What is left out does not count as done.
        let mut late = self::state(&["orienting", "marching cubes", "levels"]);
        late.report("levels", 0.1);
        assert_eq!(late.done, 0.1);
        state.report("levels", 2.0);
        assert_eq!(state.done, 1.0);
    }

    #[test]
    fn the_longest_stage_alone_tells_how_long_is_left() {
        let mut state = state(&["sampling the field", "levels"]);
        let later = |state: &State, seconds| state.left(Duration::from_secs(seconds));
        state.report("sampling the field", 0.5);
        assert_eq!(later(&state, 100), None);
        state.report("levels", 0.02);
        assert_eq!(later(&state, 100), None);
        state.report("levels", 0.25);
        assert_eq!(later(&state, 1), None);
        assert_eq!(later(&state, 10), Some(30.0));
        state.report("levels", 1.0);
        assert_eq!(later(&state, 10), None);
        assert_eq!([3.0, 52.0, 61.0, 7300.0].map(spelt), ["5 s", "55 s", "2 min", "3 h"]);
    }

    #[test]
    fn flags_cancel() {
        static FLAG: AtomicBool = AtomicBool::new(false);
        let progress = ShownProgress::of(&Job::on_stderr()).cancelled_by(&FLAG);
        progress.report("levels", 0.5);
        assert!(!progress.cancelled());
        FLAG.store(true, Ordering::Relaxed);
        assert!(progress.cancelled());
    }
}
