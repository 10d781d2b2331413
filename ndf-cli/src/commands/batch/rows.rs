//! Rows: what became of every item, a line of JSON each.

use std::collections::HashMap;
use std::fs::{self, File, TryLockError};
use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use ndf_mesh::io::atomic_write;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::output::{Failure, grouped};

/// How an item ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Status {
    /// The work is done.
    Ok,
    /// The command said why not.
    Refused,
    /// It took too long.
    Timeout,
    /// It took too much memory.
    Memory,
    /// The process ended by a signal, or in a way that it should not.
    Crash,
}

impl Status {
    /// All of them.
    pub(super) const ALL: [Self; 5] = [Self::Ok, Self::Refused, Self::Timeout, Self::Memory, Self::Crash];

    /// Its name in rows.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Refused => "refused",
            Self::Timeout => "timeout",
            Self::Memory => "memory",
            Self::Crash => "crash",
        }
    }

    /// Whether another attempt may end otherwise.
    pub(super) fn is_worth_another(self) -> bool {
        matches!(self, Self::Timeout | Self::Memory | Self::Crash)
    }
}

/// What became of an item.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Row {
    /// Its name.
    pub id: String,
    /// The file, as it was given.
    pub input: String,
    /// The hash of the file; none if it cannot be read.
    pub input_sha256: Option<String>,
    /// How it ended.
    pub status: Status,
    /// Why it did not end well, in a sentence.
    pub message: Option<String>,
    /// The exit code, if it was not ended by a signal.
    pub exit_code: Option<i32>,
    /// Wall time.
    pub seconds: f64,
    /// Memory that it had at most, as the system tells.
    pub peak_bytes: Option<u64>,
    /// What the command warned of.
    pub warnings: Vec<String>,
    /// What was written, below the folder of the batch.
    pub output: Option<String>,
    /// What the command printed with `--json`.
    pub result: Option<Map<String, Value>>,
}

/// What tells one row from another.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
pub(super) struct Head {
    /// The name of the item.
    pub id: String,
    /// How it ended.
    pub status: Status,
}

/// The rows of a file, as the lines they are: there may be too many to have all of what they say at once.
#[derive(Debug, Default)]
pub(super) struct Lines {
    bytes: Vec<u8>,
    heads: Vec<(Head, Range<usize>)>,
}

impl Lines {
    /// Reads the rows of a file in the order in which they were written. A last line that is torn, as by a process that was
    /// killed, is not among them; a file that is not there has none.
    ///
    /// # Errors
    /// If it cannot be read, or a line is no row.
    pub(super) fn read(path: &Path) -> Result<Self, Failure> {
        match fs::read(path) {
            Err(e) if e.kind() == ErrorKind::NotFound => Ok(Self::default()),
            Err(e) => Err(Failure::new(format!("cannot read {}: {e}", path.display()))),
            Ok(bytes) => Self::parse(bytes, path),
        }
    }

    fn parse(bytes: Vec<u8>, path: &Path) -> Result<Self, Failure> {
        let mut heads = Vec::new();
        let mut at = 0;
        let lines = bytes.split_inclusive(|&byte| byte == b'\n').filter(|line| line.ends_with(b"\n"));
        for (number, line) in lines.enumerate() {
            let head = serde_json::from_slice(line).map_err(|e| {
                let what = format!("{}: line {} is no row of a batch: {e}", path.display(), number + 1);
                Failure::new(what).try_instead("remove the line, and --resume makes it again")
            })?;
            heads.push((head, at..at + line.len()));
            at += line.len();
        }
        Ok(Self { bytes, heads })
    }

    /// The bytes of whole lines.
    fn whole(&self) -> u64 {
        self.heads.last().map_or(0, |(_, range)| range.end as u64)
    }

    /// The line of a place.
    ///
    /// # Panics
    /// If there are not so many.
    pub(super) fn line(&self, place: usize) -> (&Head, &[u8]) {
        let (head, range) = &self.heads[place];
        (head, &self.bytes[range.clone()])
    }

    /// What tells each from the others, and its line.
    pub(super) fn iter(&self) -> impl Iterator<Item = (&Head, &[u8])> {
        self.heads.iter().map(|(head, range)| (head, &self.bytes[range.clone()]))
    }
}

/// Writes lines, all or none.
///
/// # Errors
/// If they cannot be written.
pub(super) fn write<'a>(path: &Path, lines: impl IntoIterator<Item = &'a [u8]>) -> Result<(), Failure> {
    let written = atomic_write(path, |out| lines.into_iter().try_for_each(|line| out.write_all(line)));
    written.map_err(|e| Failure::new(format!("cannot write {}: {e}", path.display())))
}

/// The file that the rows of a part are added to, while no other process does.
#[derive(Debug)]
pub(super) struct RowFile {
    file: File,
    path: PathBuf,
}

impl RowFile {
    /// The rows that are there, and the file to add more to.
    ///
    /// # Errors
    /// If the file cannot be read or written, or another process adds to it.
    pub(super) fn open(path: &Path) -> Result<(Lines, Self), Failure> {
        let cannot = |e: std::io::Error| Failure::new(format!("cannot write {}: {e}", path.display()));
        let mut options = File::options();
        let mut file =
            options.read(true).write(true).create(true).truncate(false).open(path).map_err(cannot)?;
        // Not all systems and folders can lock.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            let failure = Failure::new(format!("another process is at work on {}", path.display()));
            return Err(failure.try_instead("wait for it, or end it; or choose another --shard"));
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(cannot)?;
        let lines = Lines::parse(bytes, path)?;
        let whole = lines.whole();
        file.set_len(whole).and_then(|()| file.seek(SeekFrom::Start(whole))).map_err(cannot)?;
        Ok((lines, Self { file, path: path.to_owned() }))
    }

    /// Adds a row, by one write.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(super) fn add(&mut self, row: &Row) -> Result<(), Failure> {
        let mut line = serde_json::to_vec(row)?;
        line.push(b'\n');
        let written = self.file.write_all(&line);
        written.map_err(|e| Failure::new(format!("cannot write {}: {e}", self.path.display())))
    }

    /// The file with these lines in place of all others.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(super) fn replaced<'a>(self, lines: impl IntoIterator<Item = &'a [u8]>) -> Result<Self, Failure> {
        let Self { file, path } = self;
        // Not all systems replace a file that is open.
        drop(file);
        write(&path, lines)?;
        Ok(Self::open(&path)?.1)
    }

    /// Brings the rows into the order of these ranks, which ends the work on them.
    ///
    /// # Errors
    /// If the file cannot be read or written.
    pub(super) fn finish(self, ranks: &HashMap<&str, usize>) -> Result<Lines, Failure> {
        let Self { file, path } = self;
        drop(file);
        let mut lines = Lines::read(&path)?;
        let rank = |head: &Head| ranks.get(head.id.as_str());
        if !lines.heads.is_sorted_by_key(|(head, _)| rank(head)) {
            lines.heads.sort_by_key(|(head, _)| rank(head));
            write(&path, lines.iter().map(|(_, line)| line))?;
        }
        Ok(lines)
    }
}

/// How many rows there are of every status.
pub(super) fn counts<'a>(heads: impl IntoIterator<Item = &'a Head>) -> [(Status, usize); 5] {
    let mut counts: HashMap<Status, usize> = HashMap::new();
    heads.into_iter().for_each(|head| *counts.entry(head.status).or_default() += 1);
    Status::ALL.map(|status| (status, counts.get(&status).copied().unwrap_or(0)))
}

/// Counts by the names of statuses.
pub(super) fn by_status(counts: &[(Status, usize)]) -> Map<String, Value> {
    counts.iter().map(|&(status, count)| (status.name().to_owned(), count.into())).collect()
}

/// Counts as a list, without those that are 0.
pub(super) fn in_words(counts: &[(Status, usize)]) -> String {
    let said = counts.iter().filter(|(_, count)| *count > 0);
    let said: Vec<String> =
        said.map(|&(status, count)| format!("{} {}", grouped(count), status.name())).collect();
    if said.is_empty() { "none".to_owned() } else { said.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(id: &str) -> Row {
        Row {
            id: id.into(),
            input: format!("{id}.obj"),
            input_sha256: None,
            status: Status::Ok,
            message: None,
            exit_code: Some(0),
            seconds: 0.1 + 0.2,
            peak_bytes: Some(1),
            warnings: Vec::new(),
            output: None,
            result: None,
        }
    }

    fn ids(lines: &Lines) -> Vec<&str> {
        lines.iter().map(|(head, _)| head.id.as_str()).collect()
    }

    #[test]
    fn a_torn_line_is_dropped_and_a_wrong_one_refused() {
        let path = std::env::temp_dir().join(format!("ndf-rows-{}.jsonl", std::process::id()));
        let rows = ["a", "b", "c"].map(row);
        let (none, mut file) = RowFile::open(&path).unwrap();
        assert_eq!(none.iter().count(), 0);
        rows.iter().for_each(|row| file.add(row).unwrap());
        assert!(RowFile::open(&path).unwrap_err().to_string().contains("another process"));
        drop(file);
        let read = Lines::read(&path).unwrap();
        let parsed: Vec<Row> = read.iter().map(|(_, line)| serde_json::from_slice(line).unwrap()).collect();
        assert_eq!(parsed, rows);
        assert_eq!(counts(read.iter().map(|(head, _)| head))[0], (Status::Ok, 3));
        let whole = fs::read(&path).unwrap();
        // Wherever the last line is torn, the rows before it are there.
        let second = 2 * whole.len() / 3;
        for length in [second + 1, second + 20, whole.len() - 1] {
            fs::write(&path, &whole[..length]).unwrap();
            let (kept, mut file) = RowFile::open(&path).unwrap();
            assert_eq!(ids(&kept), ["a", "b"]);
            file.add(&rows[2]).unwrap();
            assert_eq!(fs::read(&path).unwrap(), whole);
        }
        let (lines, file) = RowFile::open(&path).unwrap();
        let mut file = file.replaced(lines.iter().skip(1).map(|(_, line)| line)).unwrap();
        file.add(&rows[0]).unwrap();
        assert_eq!(ids(&Lines::read(&path).unwrap()), ["b", "c", "a"]);
        let ranks = HashMap::from([("a", 0), ("b", 1), ("c", 2)]);
        assert_eq!(ids(&file.finish(&ranks).unwrap()), ["a", "b", "c"]);
        assert_eq!(fs::read(&path).unwrap(), whole);
        fs::write(&path, [b"{}\n", &whole[..]].concat()).unwrap();
        assert!(Lines::read(&path).unwrap_err().to_string().contains("line 1"));
        fs::remove_file(path).unwrap();
    }
}
