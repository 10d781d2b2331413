//! Files that are either there as a whole or not at all.

use std::collections::HashSet;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use tempfile::NamedTempFile;

/// Writes a file beside `path` and renames it to `path` when it is complete. If `write` fails or the program
/// is stopped, what `path` held before is still there. A link is followed, to a file that is not there yet, too; what is
/// no file (a pipe, a device) is written as it comes. A file that is replaced keeps its permissions.
///
/// # Errors
/// What `write` or the system says; nothing is left behind then.
///
/// ```
/// # fn main() -> std::io::Result<()> {
/// # let path = std::env::temp_dir().join(format!("ndf-doc-{}", std::process::id()));
/// ndf_mesh::io::atomic_write(&path, |out| out.write_all(b"whole"))?;
/// assert_eq!(std::fs::read(&path)?, b"whole");
/// # std::fs::remove_file(path)
/// # }
/// ```
pub fn atomic_write(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let path = path.as_ref();
    let before = path.metadata().ok();
    if before.as_ref().is_some_and(|m| !m.is_file() && !m.is_dir()) {
        let mut out = BufWriter::new(File::options().write(true).open(path)?);
        write(&mut out)?;
        return out.flush();
    }
    let path = resolved(path)?;
    let temporary = beside(&path)?;
    let _listed = Listed::new(temporary.path());
    if let Some(before) = before {
        temporary.as_file().set_permissions(before.permissions())?;
    }
    let mut out = BufWriter::new(temporary);
    write(&mut out)?;
    let temporary = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    temporary.as_file().sync_all()?;
    temporary.persist(&path)?;
    // That the name is there after a power cut. Not all systems and folders can.
    #[cfg(unix)]
    let _ = File::open(folder(&path)).and_then(|folder| folder.sync_all());
    Ok(())
}

/// Removes the files that other threads are writing: for programs that are about to end without ending these.
pub fn remove_temporary_files() {
    for path in TEMPORARY.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
        // It is in its place already, or somebody has tidied up.
        let _ = fs::remove_file(path);
    }
}

/// Removes what [`atomic_write`] was writing to these paths in processes that were killed. Nobody else may be writing there.
///
/// Every folder is listed once. What cannot be listed or removed stays.
pub fn remove_unfinished(paths: &HashSet<PathBuf>) {
    let folders: HashSet<&Path> = paths.iter().map(|path| folder(path)).collect();
    for folder in folders {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let name = entry.file_name();
            if name.to_str().and_then(written).is_some_and(|written| paths.contains(&folder.join(written))) {
                let _ = fs::remove_file(entry.path());
            }
        }
    }
}

/// The name under which a file with a name of [`beside`] is to appear; none for other names.
fn written(hidden: &str) -> Option<&str> {
    let name = hidden.strip_prefix('.')?.strip_suffix(SUFFIX)?;
    name.rsplit_once('.').map(|(name, _)| name)
}

/// How the names of files end that are being written.
const SUFFIX: &str = ".tmp";

/// Files that are being written.
static TEMPORARY: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Has a file among [`TEMPORARY`] as long as it lives.
struct Listed(PathBuf);

impl Listed {
    fn new(path: &Path) -> Self {
        TEMPORARY.lock().unwrap_or_else(PoisonError::into_inner).push(path.to_owned());
        Self(path.to_owned())
    }
}

impl Drop for Listed {
    fn drop(&mut self) {
        TEMPORARY.lock().unwrap_or_else(PoisonError::into_inner).retain(|path| *path != self.0);
    }
}

/// Longest name of which a hidden one is made, with room for what tells it from others.
const LONGEST_HIDDEN: usize = 200;

/// As many links are followed as Linux does.
const MAX_LINKS: usize = 40;

/// Where a chain of links ends, whether or not something is there.
fn resolved(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..MAX_LINKS {
        match fs::read_link(&path) {
            Ok(target) => path = folder(&path).join(target),
            // It is no link, or not there.
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::other("its links lead in a circle"))
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A file in the same folder under a name that no other writer has, which goes with the value.
fn beside(path: &Path) -> io::Result<NamedTempFile> {
    if path.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder"));
    }
    let name =
        path.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "it names no file"))?;
    let mut hidden = std::ffi::OsString::from(".");
    // Names have at most 255 bytes; the file itself may need all of them.
    if name.len() <= LONGEST_HIDDEN {
        hidden.push(name);
        hidden.push(".");
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(&hidden).suffix(SUFFIX);
    // As other files are made: what the mask of the process leaves of it.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    check_exists(folder(path))?;
    builder.tempfile_in(folder(path)).map_err(of_system)
}

/// Refuses a folder that is not there by its name.
fn check_exists(folder: &Path) -> io::Result<()> {
    match fs::metadata(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            Err(io::Error::new(error.kind(), format!("there is no folder {}", folder.display())))
        }
        _ => Ok(()),
    }
}

/// What the system says alone: the name of a temporary file would only puzzle.
fn of_system(error: io::Error) -> io::Error {
    match error.to_string().split_once(" at path \"") {
        Some((sentence, _)) => io::Error::new(error.kind(), sentence.to_owned()),
        None => error,
    }
}

/// Whether a file can be made under the name of `path`: whether its folder takes files, tried with one that has no name, and
/// whether the system takes the name.
///
/// # Errors
/// What the system says.
pub fn check_folder(path: impl AsRef<Path>) -> io::Result<()> {
    let path = resolved(path.as_ref())?;
    if let Err(error) = path.symlink_metadata()
        && error.kind() == io::ErrorKind::InvalidFilename
    {
        return Err(error);
    }
    check_exists(folder(&path))?;
    tempfile::tempfile_in(folder(&path)).map(drop).map_err(of_system)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn links_are_followed_and_devices_kept() {
        let folder = std::env::temp_dir().join(format!("ndf-atomic-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let (file, link) = (folder.join("file"), folder.join("link"));
        fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        atomic_write(&link, |out| out.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert!(link.symlink_metadata().unwrap().is_symlink());
        // A link to what is not there yet, and links in a circle.
        let (new, circle) = (folder.join("new"), folder.join("circle"));
        fs::remove_file(&link).unwrap();
        std::os::unix::fs::symlink("new", &link).unwrap();
        atomic_write(&link, |out| out.write_all(b"newer")).unwrap();
        assert!(link.symlink_metadata().unwrap().is_symlink() && fs::read(&new).unwrap() == b"newer");
        std::os::unix::fs::symlink("circle", &circle).unwrap();
        assert!(atomic_write(&circle, |_| Ok(())).unwrap_err().to_string().contains("circle"));
        fs::remove_dir_all(folder).unwrap();
        atomic_write("/dev/null", |out| out.write_all(b"nothing")).unwrap();
        assert!(!Path::new("/dev/null").metadata().unwrap().is_file());
    }

    /// Neither a folder that is not there nor one that takes no files is told by the name of a temporary file.
    #[test]
    fn errors_name_what_the_user_knows() {
        let folder = std::env::temp_dir().join(format!("ndf-atomic-errors-{}", std::process::id()));
        let missing = folder.join("none").join("a.ply");
        for error in [atomic_write(&missing, |_| Ok(())).unwrap_err(), check_folder(&missing).unwrap_err()] {
            assert_eq!(error.kind(), io::ErrorKind::NotFound);
            let sentence = format!("there is no folder {}", folder.join("none").display());
            assert_eq!(error.to_string(), sentence);
        }
        // Not even root may make files here.
        if Path::new("/proc/self").is_dir() {
            let error = atomic_write("/proc/self/a.ply", |_| Ok(())).unwrap_err().to_string();
            assert!(!error.contains("tmp") && !error.contains("path"), "{error}");
        }
    }

    #[test]
    fn what_was_never_finished_is_told_by_its_name() {
        let folder = std::env::temp_dir().join(format!("ndf-atomic-unfinished-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let killed = beside(&folder.join("a.b.ply")).unwrap().keep().unwrap().1;
        let other = beside(&folder.join("b.ply")).unwrap().keep().unwrap().1;
        fs::write(folder.join("a.b.ply"), "").unwrap();
        remove_unfinished(&HashSet::from([
            folder.join("a.b.ply"),
            folder.join("none"),
            "no/such/folder".into(),
        ]));
        assert!(!killed.exists() && other.exists() && folder.join("a.b.ply").exists());
        fs::remove_dir_all(folder).unwrap();
    }

    /// A file keeps its permissions, a new one has those of all new files, and a failure leaves nothing.
    #[test]
    fn permissions_are_kept_and_failures_leave_nothing() {
        use std::os::unix::fs::PermissionsExt;
        let folder = std::env::temp_dir().join(format!("ndf-atomic-modes-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let mode = |path: &Path| path.metadata().unwrap().permissions().mode() & 0o777;
        let (file, plain) = (folder.join("file"), folder.join("plain"));
        fs::write(&plain, "").unwrap();
        atomic_write(&file, |out| out.write_all(b"old")).unwrap();
        assert_eq!(mode(&file), mode(&plain));
        fs::set_permissions(&file, fs::Permissions::from_mode(0o600)).unwrap();
        atomic_write(&file, |out| out.write_all(b"new")).unwrap();
        assert_eq!(mode(&file), 0o600);
        assert!(atomic_write(&file, |_| Err(io::Error::other("no"))).is_err());
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
        fs::remove_dir_all(folder).unwrap();
    }
}
