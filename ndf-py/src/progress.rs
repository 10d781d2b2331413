//! Long work away from the interpreter: without its lock, with Ctrl-C and with progress.
//!
//! The work runs on threads of Rust. The calling thread waits, looks for signals and calls what observes the progress, so
//! that Python code runs where it would run without us and its exceptions come out where they should.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use ndf::Progress;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::errors::failure;

/// How often signals are looked for.
const PATIENCE: Duration = Duration::from_millis(50);

/// Progress of less than this share of a stage is not told.
const STEP: f64 = 0.005;

/// An exception that Python code raised on one of Rust's threads.
#[derive(Default)]
pub(crate) struct Raised {
    error: Mutex<Option<PyErr>>,
    is_raised: AtomicBool,
}

impl Raised {
    /// Keeps the first exception, which stops the work.
    pub(crate) fn raise(&self, error: PyErr) {
        self.error.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        self.is_raised.store(true, Ordering::Release);
    }

    /// Whether there is an exception.
    pub(crate) fn is_raised(&self) -> bool {
        self.is_raised.load(Ordering::Acquire)
    }

    fn take(&self) -> Option<PyErr> {
        self.error.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// What the work reports to.
struct Watched<'a> {
    raised: &'a Raised,
    /// Stages and fractions on their way to Python, if anyone observes them.
    told: Option<Sender<(String, f64)>>,
    last: Mutex<(String, f64)>,
}

impl Progress for Watched<'_> {
    fn report(&self, stage: &str, fraction: f64) {
        let Some(told) = &self.told else { return };
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if last.0 != stage || (fraction - last.1).abs() >= STEP || (fraction >= 1.0 && last.1 < 1.0) {
            *last = (stage.to_owned(), fraction);
            // The observer may be gone, since it raised an exception.
            let _ = told.send(last.clone());
        }
    }

    fn cancelled(&self) -> bool {
        self.raised.is_raised()
    }
}

/// Does long work and waits for it: on so many threads, or on one for each core. `observer(stage, fraction)` is called on this
/// thread. The work must end soon after its observer is cancelled.
///
/// Python code that Rust calls may call Rust again. Such work is done at once, on the thread that it comes from: were it
/// handed to another, all threads could come to wait for each other.
pub(crate) fn run<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    observer: Option<&Bound<'_, PyAny>>,
    raised: &Raised,
    work: impl FnOnce(&dyn Progress) -> T + Send,
) -> PyResult<T> {
    let observer = observer.map(|observer| observer.clone().unbind());
    if rayon::current_thread_index().is_some() {
        let watched = Watched { raised, told: None, last: Mutex::default() };
        let done = py.detach(|| work(&watched));
        return raised.take().map_or(Ok(done), Err);
    }
    let pool = pool(threads)?;
    let (sender, receiver) = channel();
    let (is_observed, (alive, ended)) = (observer.is_some(), channel::<()>());
    let done = py.detach(move || {
        std::thread::scope(|scope| {
            let worker = scope.spawn(move || {
                let told = is_observed.then_some(sender);
                let watched = Watched { raised, told, last: Mutex::default() };
                let done = pool.install(|| work(&watched));
                drop((watched, alive));
                done
            });
            let mut looked = Instant::now();
            loop {
                // Reports while there are any, then the end.
                let ends = match is_observed {
                    true => match receiver.recv_timeout(PATIENCE) {
                        Ok((stage, fraction)) => {
                            if let (false, Some(observer)) = (raised.is_raised(), &observer) {
                                let told =
                                    Python::attach(|py| observer.call1(py, (stage, fraction)).map(drop));
                                told.unwrap_or_else(|error| raised.raise(error));
                            }
                            false
                        }
                        Err(RecvTimeoutError::Timeout) => false,
                        Err(RecvTimeoutError::Disconnected) => true,
                    },
                    false => ended.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Disconnected),
                };
                if ends {
                    break;
                }
                if looked.elapsed() >= PATIENCE && !raised.is_raised() {
                    looked = Instant::now();
                    Python::attach(signals).unwrap_or_else(|error| raised.raise(error));
                }
            }
            worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        })
    });
    raised.take().map_or(Ok(done), Err)
}

/// Runs the handlers of signals that came in the meantime; an exception of theirs, such as that of Ctrl-C.
fn signals(py: Python<'_>) -> PyResult<()> {
    py.check_signals()
}

/// The pool of a process. A process that was forked has none of the threads of its parent, and makes its own.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

fn pool(threads: Option<usize>) -> PyResult<Arc<ThreadPool>> {
    let made = |threads| ThreadPoolBuilder::new().num_threads(threads).build().map(Arc::new).map_err(failure);
    match threads {
        Some(threads @ 1..=1024) => return made(threads),
        None | Some(0) => {}
        Some(threads) => {
            return Err(failure(format!("threads must be 0 (all cores) to 1024, not {threads}")));
        }
    }
    let process = std::process::id();
    let mut shared = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    match &*shared {
        Some((owner, pool)) if *owner == process => Ok(pool.clone()),
        _ => {
            let pool = made(0)?;
            // The parent's is left alone: to drop it would be to wait for threads that are not there.
            std::mem::forget(shared.replace((process, pool.clone())));
            Ok(pool)
        }
    }
}
