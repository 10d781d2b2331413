//! The program as its users meet it: exit codes, streams, files.

#![allow(clippy::unwrap_used, reason = "all of this file is test code")]

mod bad_meshes;
mod batch;
mod commands;
mod docs;
mod fields;
mod gltf;
mod json;
mod kinds;
mod learning;
mod measured;
mod operators;
mod outputs;
mod parts;
mod paths;
mod progress;
mod remeshed;
mod scalars;
mod streams;
mod tangent;
mod view;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

/// What a run of the program left behind.
struct Run {
    arguments: Vec<String>,
    code: i32,
    stdout: String,
    stderr: String,
    elapsed: Duration,
}

/// Runs the program in `folder`.
fn ndf(folder: &Path, arguments: &[&str]) -> Run {
    let started = Instant::now();
    let output: Output =
        Command::new(env!("CARGO_BIN_EXE_ndf")).current_dir(folder).args(arguments).output().unwrap();
    Run {
        arguments: arguments.iter().map(|&word| word.to_owned()).collect(),
        code: output.status.code().unwrap_or(-1),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        elapsed: started.elapsed(),
    }
}

impl Run {
    /// The object on stdout of a run that succeeded, as the schema says.
    fn json(&self) -> serde_json::Value {
        assert_eq!(self.code, 0, "{}", self.stderr);
        let value: serde_json::Value = serde_json::from_str(&self.stdout).unwrap();
        assert!(value.is_object() && self.stdout.trim_end().lines().count() == 1, "{}", self.stdout);
        json::check(&self.arguments.iter().map(String::as_str).collect::<Vec<_>>(), &value);
        value
    }

    /// The sentence of a run that failed: one line, nothing on stdout, and no panic.
    fn sentence(&self) -> &str {
        assert_eq!(self.code, 1, "{}{}", self.stdout, self.stderr);
        assert_eq!(self.stdout, "");
        let is_beside = |l: &&str| !l.starts_with("ndf: warning: ") && !l.starts_with("ndf: note: ");
        let said: Vec<&str> = self.stderr.lines().filter(is_beside).collect();
        assert!(matches!(said[..], [line] if line.starts_with("ndf: ")), "{}", self.stderr);
        said[0]
    }
}

/// A folder of its own for a test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Self {
        let path = std::env::temp_dir().join(format!("ndf-program-{test}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.0.join(name), content).unwrap();
    }

    /// Names of the files in it, in order.
    fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.0).unwrap();
        let mut names: Vec<String> =
            entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
