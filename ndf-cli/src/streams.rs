//! Standard input and output in place of files: the name `-`.
//!
//! Inputs are read more than once and names tell the formats of outputs, so that a stream is a file in a temporary folder
//! here: what comes is written there first, and what is to go is sent when the command is done.

use std::borrow::Cow;
use std::fs::File;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use clap::builder::{PathBufValueParser, TypedValueParser};
use tempfile::TempDir;

/// The streams of this process that are in use.
static STREAMS: Mutex<Streams> = Mutex::new(Streams { folder: None, is_read: false, output: None });

#[derive(Debug)]
struct Streams {
    folder: Option<TempDir>,
    is_read: bool,
    output: Option<PathBuf>,
}

const INPUT: &str = "standard input";
const OUTPUT: &str = "standard output";

/// A file that is read, or `-` for the standard input.
pub fn input_file() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| if is_dash(&path) { receive() } else { Ok(path) })
}

/// A file that is written, or `-` for the standard output, which then has the format of this extension.
pub fn output_file(extension: &'static str) -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(move |path| if is_dash(&path) { open(extension) } else { Ok(path) })
}

/// Whether this is the standard output.
pub fn is_output(path: &Path) -> bool {
    streams().output.as_deref() == Some(path)
}

/// Whether the result goes to the standard output.
pub fn has_output() -> bool {
    streams().output.is_some()
}

/// Sends what was written, if anything was to be, to the standard output. A reader that has gone away is no error.
///
/// # Errors
/// If the stream cannot be written for another reason.
pub fn send() -> io::Result<()> {
    let Some(path) = streams().output.clone() else { return Ok(()) };
    let sent = File::open(path).and_then(|mut file| io::copy(&mut file, &mut io::stdout().lock()));
    match sent {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
}

/// Removes the temporary files.
pub fn close() {
    streams().folder = None;
}

/// A text in which the streams have their names, and not those of the files that stand for them.
pub fn named(text: &str) -> Cow<'_, str> {
    let streams = streams();
    let Some(folder) = &streams.folder else { return Cow::Borrowed(text) };
    let mut text = Cow::Borrowed(text);
    let output = streams.output.as_deref().map(|path| (path.display().to_string(), OUTPUT));
    let input = folder.path().join(INPUT).display().to_string();
    for (path, name) in output.into_iter().chain([(input, INPUT)]) {
        if text.contains(&path) {
            text = Cow::Owned(text.replace(&path, name));
        }
    }
    text
}

fn is_dash(path: &Path) -> bool {
    path.as_os_str() == "-"
}

fn streams() -> MutexGuard<'static, Streams> {
    STREAMS.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Streams {
    fn folder(&mut self) -> Result<&Path, String> {
        if self.folder.is_none() {
            let made = tempfile::Builder::new().prefix("ndf-").tempdir();
            self.folder = Some(made.map_err(|e| format!("there is no place for temporary files: {e}"))?);
        }
        Ok(self.folder.as_ref().expect("it was made").path())
    }
}

/// The file with all that comes from the standard input. No lock is held while it comes, which may be long.
fn receive() -> Result<PathBuf, String> {
    let path = {
        let mut streams = streams();
        if std::mem::replace(&mut streams.is_read, true) {
            return Err("the standard input can be read once".to_owned());
        }
        streams.folder()?.join(INPUT)
    };
    let received = File::create(&path).and_then(|mut file| io::copy(&mut io::stdin().lock(), &mut file));
    match received {
        Ok(0) => Err("nothing came from the standard input".to_owned()),
        Ok(_) => Ok(path),
        Err(error) => Err(format!("the standard input cannot be read: {error}")),
    }
}

/// The file that will go to the standard output.
fn open(extension: &str) -> Result<PathBuf, String> {
    if io::stdout().is_terminal() {
        return Err("the standard output is a terminal; lead it to a file or another program".to_owned());
    }
    let mut streams = streams();
    if streams.output.is_some() {
        return Err("the standard output can take one file".to_owned());
    }
    let path = streams.folder()?.join(OUTPUT).with_extension(extension);
    streams.output = Some(path.clone());
    Ok(path)
}
