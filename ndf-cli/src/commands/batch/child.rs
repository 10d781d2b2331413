//! One process for one item: its limits, and what it said.
//!
//! The process is this program again. It is [tied](interrupt::TIED) to the batch by its standard input: when that is closed,
//! or the batch is killed, it ends as on SIGTERM. It is in a process group of its own, so that Ctrl-C reaches the batch alone,
//! and what it learns is not interrupted twice.

use std::io::{self, Read};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::interrupt;
use crate::output::printable;

/// Bytes of the result that are kept; more is no result.
const MAX_RESULT: usize = 64 << 20;

/// Bytes from the end of the error stream that are kept.
const MAX_SAID: usize = 256 << 10;

/// Warnings that are kept.
const MAX_WARNINGS: usize = 50;

/// Time between looks at a process, at first and at most.
const LOOKS: [Duration; 2] = [Duration::from_millis(1), Duration::from_millis(20)];

/// What a process may take.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Limits {
    /// Wall time.
    pub time: Option<Duration>,
    /// Bytes of memory.
    pub memory: Option<u64>,
}

/// Why a process ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// By itself, with this code.
    Exit(i32),
    /// By this signal.
    #[cfg_attr(not(unix), expect(dead_code, reason = "other systems have no signals"))]
    Signal(i32),
    /// It was killed at the limit of its time.
    Timeout,
    /// It was killed at the limit of its memory.
    Memory,
    /// It was asked to end, by the batch or by a signal.
    Interrupted,
}

/// What a process left.
#[derive(Debug)]
pub(super) struct Ended {
    /// Why it ended.
    pub end: End,
    /// What it printed; none if that was too much.
    pub printed: Option<Vec<u8>>,
    /// The end of what it said on its error stream.
    pub said: String,
    /// Wall time.
    pub elapsed: Duration,
    /// Memory that it had at most, where the system tells.
    pub peak_bytes: Option<u64>,
}

impl Ended {
    /// The last line of its error stream that is no warning and no hint.
    pub(super) fn sentence(&self) -> Option<String> {
        let is_beside = |line: &&str| {
            line.is_empty()
                || ["ndf: warning: ", "ndf: note: ", "note: "]
                    .iter()
                    .any(|beginning| line.starts_with(beginning))
        };
        let line = self.said.lines().map(str::trim).rfind(|line| !is_beside(line))?;
        Some(printable(line.strip_prefix("ndf: ").unwrap_or(line)).to_string())
    }

    /// What it warned of.
    pub(super) fn warnings(&self) -> Vec<String> {
        let warnings = self.said.lines().filter_map(|line| line.strip_prefix("ndf: warning: "));
        warnings.take(MAX_WARNINGS).map(str::to_owned).collect()
    }
}

/// Whether memory can be limited here.
pub(super) fn can_limit_memory() -> bool {
    cfg!(target_os = "linux")
}

/// Runs a process within limits and waits for its end.
///
/// # Errors
/// If it cannot be started.
pub(super) fn run(command: &mut Command, limits: Limits) -> io::Result<Ended> {
    let started = Instant::now();
    command.env(interrupt::TIED, "1");
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(command, 0);
    let mut child = command.spawn()?;
    let (stdout, stderr) = (child.stdout.take(), child.stderr.take());
    thread::scope(|scope| {
        let printed = scope.spawn(move || stdout.map_or_else(|| Some(Vec::new()), head));
        let said = scope.spawn(move || stderr.map_or_else(Vec::new, tail));
        let reason = watch(&mut child, limits, started);
        let (status, peak_bytes) = reaped(&mut child)?;
        let elapsed = started.elapsed();
        let said = said.join().unwrap_or_default();
        Ok(Ended {
            end: reason.unwrap_or_else(|| end_of(status)),
            printed: printed.join().unwrap_or_default(),
            said: String::from_utf8_lossy(&said).into_owned(),
            elapsed,
            peak_bytes,
        })
    })
}

/// Waits until a process has ended, without taking note of how, and kills it at its limits, when the reason is given.
fn watch(child: &mut Child, limits: Limits, started: Instant) -> Option<End> {
    let [mut pause, longest] = LOOKS;
    let mut reason = None;
    while !has_ended(child) {
        if interrupt::is_requested() {
            // It leaves what it has learned.
            child.stdin = None;
        }
        let limit = if interrupt::is_insisted_on() {
            Some(End::Interrupted)
        } else if limits.time.is_some_and(|limit| started.elapsed() >= limit) {
            Some(End::Timeout)
        } else if limits.memory.is_some_and(|limit| resident(child.id()) > Some(limit)) {
            Some(End::Memory)
        } else {
            None
        };
        if reason.is_none() && limit.is_some() && child.kill().is_ok() {
            reason = limit;
        }
        thread::sleep(pause);
        pause = longest.min(pause * 2);
    }
    reason
}

fn end_of(status: ExitStatus) -> End {
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        return End::Signal(signal);
    }
    match status.code() {
        // As the program ends on SIGHUP, SIGINT and SIGTERM, and when it is asked to by the batch.
        Some(129 | 130 | 143) => End::Interrupted,
        code => End::Exit(code.unwrap_or(-1)),
    }
}

/// Whether a process has ended; its number stays its own until it is [reaped].
#[cfg(unix)]
fn has_ended(child: &Child) -> bool {
    use rustix::process::{Pid, WaitId, WaitIdOptions, waitid};
    let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
    !matches!(waitid(WaitId::Pid(Pid::from_child(child)), options), Ok(None))
}

#[cfg(not(unix))]
fn has_ended(child: &mut Child) -> bool {
    !matches!(child.try_wait(), Ok(None))
}

/// How a process that has ended did, and the memory that it had at most.
#[cfg(unix)]
fn reaped(child: &mut Child) -> io::Result<(ExitStatus, Option<u64>)> {
    let used = wait4::Wait4::wait4(child)?;
    Ok((used.status, Some(used.rusage.maxrss)))
}

#[cfg(not(unix))]
fn reaped(child: &mut Child) -> io::Result<(ExitStatus, Option<u64>)> {
    Ok((child.wait()?, None))
}

/// The bytes of a process that are in memory now, where the system tells.
fn resident(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes << 10)
}

/// All of a stream; none if it is too much, although all is read.
fn head(mut stream: impl Read) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    let whole = stream.by_ref().take(MAX_RESULT as u64 + 1).read_to_end(&mut bytes);
    let _ = io::copy(&mut stream, &mut io::sink());
    (whole.is_ok() && bytes.len() <= MAX_RESULT).then_some(bytes)
}

/// The last bytes of a stream.
fn tail(mut stream: impl Read) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut part = [0; 8192];
    while let Ok(read @ 1..) = stream.read(&mut part) {
        bytes.extend_from_slice(&part[..read]);
        if bytes.len() > 2 * MAX_SAID {
            bytes.drain(..bytes.len() - MAX_SAID);
        }
    }
    bytes
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    fn sh(script: &str, limits: Limits) -> Ended {
        run(Command::new("sh").args(["-c", script]), limits).expect("there is a shell")
    }

    #[test]
    fn ends_are_told_apart() {
        let none = Limits::default();
        let ended = sh("echo out; echo err >&2; exit 3", none);
        assert_eq!(
            (ended.end, ended.printed.as_deref(), ended.said.as_str()),
            (End::Exit(3), Some(&b"out\n"[..]), "err\n")
        );
        assert!(ended.peak_bytes.unwrap() > 100_000);
        assert_eq!(sh("kill -SEGV $$", none).end, End::Signal(11));
        let soon = Limits { time: Some(Duration::from_millis(50)), ..none };
        let ended = sh("exec sleep 600", soon);
        assert_eq!(ended.end, End::Timeout);
        assert!(ended.elapsed < Duration::from_secs(300));
        assert_eq!(sh("exit 143", none).end, End::Interrupted);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn memory_is_limited() {
        let little = Limits { memory: Some(1 << 16), ..Limits::default() };
        assert_eq!(sh("exec sleep 600", little).end, End::Memory);
        assert!(resident(std::process::id()).unwrap() > 1 << 16);
    }

    #[test]
    fn streams_are_read_to_their_ends_and_kept_in_part() {
        let long = vec![b'a'; 3 * MAX_SAID + 5];
        let kept = tail(&long[..]);
        assert!((MAX_SAID..=2 * MAX_SAID).contains(&kept.len()));
        assert_eq!(head(&long[..]).unwrap().len(), long.len());
        assert!(head(io::repeat(b'a').take(MAX_RESULT as u64 + 1)).is_none());
    }
}
