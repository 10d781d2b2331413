//! Measuring a process: its memory, its clock, and rivals that run beside it.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Instant;

use ndf_core::DVec3;
use ndf_mesh::TriangleMesh;
use serde_json::Value;

use crate::root;

/// Variables that say how many threads libraries take.
const THREADS: &[&str] = &["RAYON_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"];

/// How many threads a process and the rivals it starts may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Threads {
    One,
    /// As many as each takes of its own accord.
    Default,
}

/// Runs this program once more with other arguments and reads the JSON of the last line it prints: a process of its own for every mesh,
/// so that memory is that mesh's.
pub(crate) fn in_own_process(arguments: &[String], threads: Threads) -> Result<Value, String> {
    let program = std::env::current_exe().map_err(|e| format!("own path: {e}"))?;
    let mut command = Command::new(program);
    for variable in THREADS {
        match threads {
            Threads::One => command.env(variable, "1"),
            Threads::Default => command.env_remove(variable),
        };
    }
    let output = command
        .args(arguments)
        .stderr(Stdio::inherit())
        .output()
        .map_err(|e| format!("{arguments:?}: {e}"))?;
    if !output.status.success() {
        return Err(format!("{arguments:?}: {}", output.status));
    }
    let last = output.stdout.trim_ascii().rsplit(|&byte| byte == b'\n').next().unwrap_or_default();
    serde_json::from_slice(last).map_err(|e| format!("{arguments:?}: {e}"))
}

/// Wall seconds of some work, and its result.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let result = work();
    (start.elapsed().as_secs_f64(), result)
}

/// The median of some numbers.
pub(crate) fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    let middle = numbers.len() / 2;
    match numbers[..] {
        [] => f64::NAN,
        _ if numbers.len() % 2 == 1 => numbers[middle],
        _ => 0.5 * (numbers[middle - 1] + numbers[middle]),
    }
}

/// Megabytes this process holds, and the most it has held since the last [`forget_peak`]; `None` where the system does
/// not tell (it does on Linux).
pub(crate) fn memory() -> Option<(f64, f64)> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let field = |name: &str| -> Option<f64> {
        let line = status.lines().find_map(|line| line.strip_prefix(name))?;
        Some(line.split_whitespace().next()?.parse::<f64>().ok()? * 1024.0 / 1e6)
    };
    Some((field("VmRSS:")?, field("VmHWM:")?))
}

/// Makes the memory held now the most that was held. Without effect where the system has no such thing.
pub(crate) fn forget_peak() {
    // Linux, since 4.0: see proc(5) on clear_refs.
    let _ = fs::write("/proc/self/clear_refs", "5");
}

/// A folder for files that rivals read; gone with this value.
pub(crate) struct Scratch(PathBuf);

impl Scratch {
    pub(crate) fn new() -> Result<Self, String> {
        let folder = std::env::temp_dir().join(format!("ndf-experiments-{}", std::process::id()));
        fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        Ok(Self(folder))
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0
    }

    /// Writes numbers as they lie in memory, little-endian.
    pub(crate) fn write<const N: usize>(
        &self,
        name: &str,
        numbers: impl Iterator<Item = [u8; N]>,
    ) -> Result<(), String> {
        let bytes: Vec<u8> = numbers.flatten().collect();
        fs::write(self.0.join(name), bytes).map_err(|e| format!("{name}: {e}"))
    }
}

impl Scratch {
    pub(crate) fn write_mesh(&self, name: &str, mesh: &TriangleMesh) -> Result<(), String> {
        write_mesh(&self.0, name, mesh)
    }

    pub(crate) fn read_mesh(&self, name: &str) -> Result<TriangleMesh, String> {
        read_mesh(&self.0, name)
    }
}

/// Writes a mesh as raw little-endian arrays: positions NAME.f64 and, when these are complete, faces NAME.u32.
pub(crate) fn write_mesh(folder: &Path, name: &str, mesh: &TriangleMesh) -> Result<(), String> {
    let write = |end: &str, bytes: Vec<u8>| {
        let file = folder.join(format!("{name}.{end}"));
        fs::write(&file, bytes).map_err(|e| format!("{}: {e}", file.display()))
    };
    let numbers = mesh.positions().iter().flat_map(DVec3::to_array);
    write("f64", numbers.flat_map(f64::to_le_bytes).collect())?;
    write("u32", mesh.faces().iter().flatten().flat_map(|v| v.to_le_bytes()).collect())
}

/// Reads what [`write_mesh`] wrote.
pub(crate) fn read_mesh(folder: &Path, name: &str) -> Result<TriangleMesh, String> {
    let read = |end: &str| {
        let file = folder.join(format!("{name}.{end}"));
        fs::read(&file).map_err(|e| format!("{}: {e}", file.display()))
    };
    let (positions, faces) = (read("f64")?, read("u32")?);
    let positions: Vec<f64> = positions.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
    let faces: Vec<u32> = faces.as_chunks().0.iter().map(|b| u32::from_le_bytes(*b)).collect();
    let positions = positions.as_chunks().0.iter().map(|p: &[f64; 3]| DVec3::from_array(*p)).collect();
    TriangleMesh::new(positions, faces.as_chunks().0.to_vec()).map_err(|e| e.to_string())
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A rival in Python that answers every line with a line of JSON.
pub(crate) struct PythonPeer {
    process: Child,
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
    /// What it said of itself at the start.
    pub(crate) greeting: Value,
}

impl PythonPeer {
    /// Starts a script of `experiments/peers`.
    pub(crate) fn start(python: &Path, script: &str, arguments: &[String]) -> Result<Self, String> {
        let mut process = Command::new(python)
            .arg(root().join("experiments/peers").join(script))
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|e| format!("{}: {e}", python.display()))?;
        let input = process.stdin.take();
        let output = process.stdout.take().ok_or("no output")?;
        let mut peer = Self { process, input, output: BufReader::new(output), greeting: Value::Null };
        peer.greeting = peer.answer()?;
        Ok(peer)
    }

    /// Asks for something and waits for the answer.
    pub(crate) fn ask(&mut self, question: &str) -> Result<Value, String> {
        let input = self.input.as_mut().ok_or("no input")?;
        writeln!(input, "{question}").and_then(|()| input.flush()).map_err(|e| format!("{question}: {e}"))?;
        self.answer()
    }

    fn answer(&mut self) -> Result<Value, String> {
        let mut line = String::new();
        self.output.read_line(&mut line).map_err(|e| e.to_string())?;
        serde_json::from_str(&line).map_err(|e| format!("the rival said {line:?}: {e}"))
    }
}

impl Drop for PythonPeer {
    fn drop(&mut self) {
        // Without input it ends.
        self.input = None;
        let _ = self.process.wait();
    }
}
