//! Runs that are not finished, and their files.

use std::path::Path;
use std::time::{Duration, Instant};

use ndf_core::DVec3;
use ndf_mesh::io::{FileDefect, atomic_write};
use ndf_model::file::ModelError;
use serde::{Deserialize, Serialize};

use crate::levels::{LevelCheckpoint, LevelFitError, LevelHeader};
use crate::likeness::Likeness;
use crate::settings::SettingsError;
use crate::state::{Header as NetworkHeader, NetworkCheckpoint};

const MAGIC: &[u8; 8] = b"ndfchk1\n";

/// A run that is not finished: enough to go on exactly as if it had not been interrupted.
#[derive(Clone, Debug)]
pub struct Checkpoint {
    /// How to know the surface again that is learned, if that is to be compared.
    pub surface: Option<Likeness>,
    /// How far learning has come.
    pub learning: Learning,
}

/// Where the learning of a field is.
#[derive(Clone, Debug)]
pub enum Learning {
    /// The training of a network.
    Network(Box<NetworkCheckpoint>),
    /// The learning of levels.
    Levels(Box<LevelCheckpoint>),
}

impl From<NetworkCheckpoint> for Checkpoint {
    fn from(network: NetworkCheckpoint) -> Self {
        Self { surface: None, learning: Learning::Network(Box::new(network)) }
    }
}

impl From<LevelCheckpoint> for Checkpoint {
    fn from(levels: LevelCheckpoint) -> Self {
        Self { surface: None, learning: Learning::Levels(Box::new(levels)) }
    }
}

/// Why a file is no checkpoint.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The file cannot be read or written.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// Not a checkpoint.
    #[error("not a usable checkpoint: the magic number is wrong")]
    Magic,
    /// The file is damaged, or of another version.
    #[error("not a usable checkpoint: {0}")]
    Content(#[from] FileDefect),
    /// Its model is damaged.
    #[error("not a usable checkpoint: {0}")]
    Model(#[from] ModelError),
    /// Its settings are out of range.
    #[error("not a usable checkpoint: {0}")]
    Settings(#[from] SettingsError),
    /// Its levels are out of range.
    #[error("not a usable checkpoint: {0}")]
    Levels(#[from] LevelFitError),
}

/// The part of a checkpoint that is words and counts.
#[derive(Serialize, Deserialize)]
struct Header {
    #[serde(default)]
    surface: Option<Likeness>,
    #[serde(flatten)]
    learning: LearningHeader,
}

#[derive(Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
enum LearningHeader {
    Network(NetworkHeader),
    Levels(LevelHeader),
}

impl Checkpoint {
    /// Epochs or iterations that were made, and those to be made in all.
    pub fn rounds(&self) -> [usize; 2] {
        match &self.learning {
            Learning::Network(network) => {
                let settings = network.settings();
                [network.epoch(), settings.epochs + settings.identity_epochs]
            }
            Learning::Levels(levels) => levels.iterations(),
        }
    }

    /// The same, of this surface: only it will do to go on.
    #[must_use]
    pub fn of(self, surface: &Likeness) -> Self {
        Self { surface: Some(surface.clone()), ..self }
    }

    /// The same, to go on for at most so long, or to the end: the limit of the run before does not count.
    #[must_use]
    pub fn with_time_limit(self, limit: Option<Duration>) -> Self {
        let Self { surface, learning } = self;
        let limited: Self = match learning {
            Learning::Network(network) => network.with_time_limit(limit).into(),
            Learning::Levels(levels) => levels.with_time_limit(limit).into(),
        };
        Self { surface, ..limited }
    }

    /// Writes the checkpoint beside the path and renames it, so that an older one is replaced whole or not at all.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), CheckpointError> {
        let bytes = self.to_bytes();
        Ok(atomic_write(path, |out| out.write_all(&bytes))?)
    }

    /// Reads a checkpoint.
    ///
    /// # Errors
    /// If the file cannot be read, or is not a whole checkpoint.
    pub fn read(path: &Path) -> Result<Self, CheckpointError> {
        Self::from_bytes(&std::fs::read(path)?)
    }

    /// Whether a file is a checkpoint, told from its first eight bytes.
    pub fn is_checkpoint(beginning: &[u8]) -> bool {
        beginning.starts_with(MAGIC)
    }

    /// Layout: magic, CRC-32 of the rest, length of the header, header as JSON, and the numbers of the kind; all
    /// little-endian.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let (learning, numbers) = match &self.learning {
            Learning::Network(network) => {
                let (header, numbers) = network.to_parts();
                (LearningHeader::Network(header), numbers)
            }
            Learning::Levels(levels) => {
                let (header, numbers) = levels.to_parts();
                (LearningHeader::Levels(header), numbers)
            }
        };
        let header = Header { surface: self.surface.clone(), learning };
        let header = serde_json::to_vec(&header).expect("settings are finite numbers and have string keys");
        let mut rest = (header.len() as u64).to_le_bytes().to_vec();
        rest.extend(header);
        rest.extend(numbers);
        let mut bytes = MAGIC.to_vec();
        bytes.extend(crc32fast::hash(&rest).to_le_bytes());
        bytes.extend(rest);
        bytes
    }

    /// The checkpoint of a file's content.
    ///
    /// # Errors
    /// If it is not a whole checkpoint.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, CheckpointError> {
        let truncated = || FileDefect::truncated(TRUNCATED);
        let rest = bytes.strip_prefix(MAGIC).ok_or(CheckpointError::Magic)?;
        let (sum, rest) = rest.split_first_chunk::<4>().ok_or_else(truncated)?;
        if crc32fast::hash(rest) != u32::from_le_bytes(*sum) {
            return Err(FileDefect::Checksum("its checksum").into());
        }
        // The checksum holds: what follows was written by this program, of this or another version.
        let (length, rest) = rest.split_first_chunk().ok_or_else(truncated)?;
        let mut parts = Parts(rest);
        let length = usize::try_from(u64::from_le_bytes(*length)).unwrap_or(usize::MAX);
        let header: Header = serde_json::from_slice(parts.take(length)?)
            .map_err(|e| FileDefect::unsupported(format!("its header is of another version ({e})")))?;
        let read: Self = match header.learning {
            LearningHeader::Network(header) => NetworkCheckpoint::from_parts(header, parts)?.into(),
            LearningHeader::Levels(header) => LevelCheckpoint::from_parts(header, parts)?.into(),
        };
        Ok(Self { surface: header.surface, ..read })
    }
}

const TRUNCATED: &str = "it is truncated";

/// The numbers of a checkpoint that are not read yet.
pub(crate) struct Parts<'a>(&'a [u8]);

impl<'a> Parts<'a> {
    pub(crate) fn take(&mut self, bytes: usize) -> Result<&'a [u8], CheckpointError> {
        let (head, tail) = self.0.split_at_checked(bytes).ok_or_else(|| FileDefect::truncated(TRUNCATED))?;
        self.0 = tail;
        Ok(head)
    }

    fn words<const N: usize>(&mut self, count: usize) -> Result<&'a [[u8; N]], CheckpointError> {
        Ok(self.take(count.saturating_mul(N))?.as_chunks().0)
    }

    pub(crate) fn integers(&mut self, count: usize) -> Result<impl Iterator<Item = u32>, CheckpointError> {
        Ok(self.words(count)?.iter().map(|&word| u32::from_le_bytes(word)))
    }

    pub(crate) fn singles(&mut self, count: usize) -> Result<Vec<f32>, CheckpointError> {
        Ok(self.words(count)?.iter().map(|&word| f32::from_le_bytes(word)).collect())
    }

    pub(crate) fn doubles(&mut self, count: usize) -> Result<Vec<f64>, CheckpointError> {
        Ok(self.words(count)?.iter().map(|&word| f64::from_le_bytes(word)).collect())
    }

    pub(crate) fn double(&mut self) -> Result<f64, CheckpointError> {
        Ok(f64::from_le_bytes(self.words(1)?[0]))
    }

    pub(crate) fn points(&mut self, count: usize) -> Result<Vec<DVec3>, CheckpointError> {
        let numbers = self.doubles(count.saturating_mul(3))?;
        Ok(numbers.as_chunks().0.iter().map(|&p: &[f64; 3]| DVec3::from(p)).collect())
    }

    pub(crate) fn end(&self) -> Result<(), CheckpointError> {
        if self.0.is_empty() { Ok(()) } else { Err(FileDefect::TrailingBytes("its end").into()) }
    }
}

/// The time that a header says training took.
pub(crate) fn time_of(seconds: f64) -> Result<Duration, FileDefect> {
    Duration::try_from_secs_f64(seconds)
        .map_err(|e| FileDefect::value(format!("it says that training took {seconds} s ({e})")))
}

/// Passes checkpoints of a run on, now and then.
pub(crate) struct Keeper<'a, C> {
    every: Duration,
    last: Instant,
    keep: Box<dyn FnMut(C) + 'a>,
}

impl<'a, C> Keeper<'a, C> {
    /// Keeps one whenever so much time has passed since `last`.
    pub(crate) fn new(every: Duration, last: Instant, keep: impl FnMut(C) + 'a) -> Self {
        Self { every, last, keep: Box::new(keep) }
    }

    /// Passes one on, if it is time.
    pub(crate) fn offer<E>(&mut self, checkpoint: impl FnOnce() -> Result<C, E>) -> Result<(), E> {
        if self.last.elapsed() >= self.every {
            (self.keep)(checkpoint()?);
            self.last = Instant::now();
        }
        Ok(())
    }
}
