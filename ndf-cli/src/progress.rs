//! Progress on the error stream: a bar on a terminal, else one plain line every few seconds.

use std::io::{self, IsTerminal, Write};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use ndf_core::Progress;

use crate::interrupt;

/// Time between plain lines.
const INTERVAL: Duration = Duration::from_secs(3);

/// Stages at the end of which something is learned.
const LEARNING: [&str; 2] = ["training", "levels"];

/// Steps of a full bar.
const STEPS: u64 = 1000;

/// Shows what is reported. Nothing stays on the terminal when it is dropped.
#[derive(Debug)]
pub struct ShownProgress {
    mode: Mode,
    cancel: Option<&'static AtomicBool>,
}

#[derive(Debug)]
enum Mode {
    Hidden,
    Bar(ProgressBar),
    Lines(Mutex<Lines>),
}

#[derive(Debug)]
struct Lines {
    stage: String,
    detail: String,
    begun: Instant,
    last: Instant,
}

impl ShownProgress {
    /// Shows nothing.
    pub fn hidden() -> Self {
        Self { mode: Mode::Hidden, cancel: None }
    }

    /// Shows a bar if the error stream is a terminal, else plain lines.
    pub fn on_stderr() -> Self {
        let mode = if io::stderr().is_terminal() {
            let style = ProgressStyle::with_template(
                "{msg:20} {wide_bar:.cyan/dim} {percent:>3} % {eta:>5} left {prefix}",
            );
            let bar = ProgressBar::new(STEPS).with_style(style.expect("the template is valid"));
            Mode::Bar(bar)
        } else {
            let now = Instant::now();
            Mode::Lines(Mutex::new(Lines {
                stage: String::new(),
                detail: String::new(),
                begun: now,
                last: now,
            }))
        };
        Self { mode, cancel: None }
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
        let fraction = if fraction.is_finite() { fraction.clamp(0.0, 1.0) } else { 0.0 };
        match &self.mode {
            Mode::Hidden => {}
            Mode::Bar(bar) => {
                if bar.message() != stage {
                    bar.reset();
                    bar.set_message(stage.to_owned());
                    bar.set_prefix("");
                }
                bar.set_position((fraction * STEPS as f64) as u64);
            }
            Mode::Lines(lines) => {
                let Ok(mut lines) = lines.lock() else { return };
                let now = Instant::now();
                if lines.stage != stage {
                    stage.clone_into(&mut lines.stage);
                    lines.detail.clear();
                    lines.begun = now;
                }
                if now - lines.last >= INTERVAL {
                    lines.last = now;
                    let _ =
                        writeln!(io::stderr(), "{}", line(stage, fraction, now - lines.begun, &lines.detail));
                }
            }
        }
    }

    fn detail(&self, text: &str) {
        match &self.mode {
            Mode::Hidden => {}
            Mode::Bar(bar) => bar.set_prefix(text.to_owned()),
            Mode::Lines(lines) => {
                if let Ok(mut lines) = lines.lock() {
                    text.clone_into(&mut lines.detail);
                }
            }
        }
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
        if let Mode::Bar(bar) = &self.mode {
            bar.finish_and_clear();
        }
    }
}

fn line(stage: &str, fraction: f64, elapsed: Duration, detail: &str) -> String {
    let mut line = format!("{stage}: {:.0} %", 100.0 * fraction);
    if !detail.is_empty() {
        line += &format!(", {detail}");
    }
    if fraction > 0.0 && fraction < 1.0 {
        let left = elapsed.as_secs_f64() * (1.0 - fraction) / fraction;
        line += &format!(", about {left:.0} s left");
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_say_stage_and_time_left() {
        assert_eq!(line("training", 0.25, Duration::from_secs(10), ""), "training: 25 %, about 30 s left");
        assert_eq!(line("training", 1.0, Duration::from_secs(10), "loss 1"), "training: 100 %, loss 1");
    }

    #[test]
    fn any_fraction_is_survived_and_flags_cancel() {
        static FLAG: AtomicBool = AtomicBool::new(false);
        for progress in [ShownProgress::hidden(), ShownProgress::on_stderr().cancelled_by(&FLAG)] {
            [f64::NAN, -1.0, 0.5, 2.0].iter().for_each(|&f| progress.report("a stage", f));
            assert!(!progress.cancelled());
        }
        let progress = ShownProgress::hidden().cancelled_by(&FLAG);
        FLAG.store(true, Ordering::Relaxed);
        assert!(progress.cancelled());
    }
}
