//! The items of a batch: an input each, with a name that its output and its row have.

use std::collections::HashSet;
use std::fs;
use std::path::{Component, Path, PathBuf};

use crate::output::{Failure, grouped};

/// Bytes that a part of a name may have, so that the names of outputs and of what is being written stay within 255.
const LONGEST_NAME: usize = 180;

/// Inputs that are named where there are more that something is wrong with.
const NAMED: usize = 5;

/// An input of a batch.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct Item {
    /// Its name: a path with `/` between its parts, safe to be one below the folder of outputs.
    pub id: String,
    /// The file, as it was given.
    pub input: String,
}

/// The items that these arguments stand for, in their order and each once: files; all files below folders, but for hidden ones
/// and those below `excluded`; patterns with `*`, `?` and `[`; and `@FILE`, a list. Those without a name in a list are named by
/// their path below the folder that has all of them.
///
/// # Errors
/// If an argument stands for nothing, or a name is not usable or not unique.
pub(super) fn items(arguments: &[String], excluded: &Path) -> Result<Vec<Item>, Failure> {
    let mut found = Found { excluded: absolute(excluded), ..Found::default() };
    for argument in arguments {
        found.add(argument)?;
    }
    if !found.missing.is_empty() {
        let what = format!("no such input: {}", named(&found.missing));
        return Err(Failure::new(what)
            .try_instead("give files, folders, quoted patterns such as 'data/**/*.stl', or @LIST"));
    }
    let items = found.named()?;
    check_unique(&items)?;
    Ok(items)
}

/// What arguments stand for, while they are gone through.
#[derive(Default)]
struct Found {
    excluded: PathBuf,
    /// Inputs with the names that lists give them.
    inputs: Vec<(Option<String>, String)>,
    seen: HashSet<String>,
    missing: Vec<String>,
}

impl Found {
    fn add(&mut self, argument: &str) -> Result<(), Failure> {
        if let Some(list) = argument.strip_prefix('@') {
            return self.add_list(Path::new(list));
        }
        let path = Path::new(argument);
        let before = (self.inputs.len(), self.seen.len());
        let repeated = if path.is_dir() {
            self.add_folder(path)?
        } else if path.symlink_metadata().is_ok() {
            self.add_file(path)?
        } else if argument.contains(['*', '?', '[']) {
            self.add_pattern(argument)?
        } else {
            false
        };
        if before == (self.inputs.len(), self.seen.len()) && !repeated {
            self.missing.push(argument.to_owned());
        }
        Ok(())
    }

    /// Whether it was there already.
    fn add_file(&mut self, path: &Path) -> Result<bool, Failure> {
        let input = text(path)?;
        let is_new = self.seen.insert(input.clone());
        if is_new {
            self.inputs.push((None, input));
        }
        Ok(!is_new)
    }

    /// All files below, in the order of their names. Links to folders are not followed.
    fn add_folder(&mut self, folder: &Path) -> Result<bool, Failure> {
        if absolute(folder).starts_with(&self.excluded) {
            return Ok(false);
        }
        let unread = |e: std::io::Error| Failure::new(format!("cannot list {}: {e}", folder.display()));
        let entries = fs::read_dir(folder).map_err(unread)?.collect::<Result<Vec<_>, _>>().map_err(unread)?;
        let mut entries: Vec<_> = entries.into_iter().map(|entry| (entry.file_name(), entry)).collect();
        entries.sort_by(|(a, _), (b, _)| a.cmp(b));
        let mut repeated = false;
        for (name, entry) in entries {
            if name.as_encoded_bytes().starts_with(b".") {
                continue;
            }
            let path = entry.path();
            let kind = entry.file_type().map_err(unread)?;
            if kind.is_dir() {
                repeated |= self.add_folder(&path)?;
            } else if !(kind.is_symlink() && path.is_dir()) {
                repeated |= self.add_file(&path)?;
            }
        }
        Ok(repeated)
    }

    fn add_pattern(&mut self, pattern: &str) -> Result<bool, Failure> {
        let wrong = |e: &dyn std::fmt::Display| Failure::new(format!("{pattern}: {e}"));
        let options = glob::MatchOptions {
            // As shells do.
            require_literal_separator: true,
            require_literal_leading_dot: true,
            ..glob::MatchOptions::default()
        };
        let mut repeated = false;
        for path in glob::glob_with(pattern, options).map_err(|e| wrong(&e))? {
            let path = path.map_err(|e| wrong(&e))?;
            if !path.is_dir() && !absolute(&path).starts_with(&self.excluded) {
                repeated |= self.add_file(&path)?;
            }
        }
        Ok(repeated)
    }

    fn add_list(&mut self, path: &Path) -> Result<(), Failure> {
        let name = path.display();
        let list = fs::read_to_string(path)
            .map_err(|e| Failure::new(format!("cannot read the list {name}: {e}")))?;
        let before = self.inputs.len();
        for (number, line) in list.lines().enumerate() {
            let line = line.trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let (id, input) = match line.split_once('\t') {
                Some((id, input)) => (Some(id.trim().to_owned()), input.trim()),
                None => (None, line),
            };
            if let Some(why) = id.as_deref().and_then(unsafe_name) {
                let failure = Failure::new(format!("{name}: line {}: the id {why}", number + 1));
                return Err(failure.try_instead("ids become names of files, with / between folders"));
            }
            // One input may be there under several names.
            if id.is_some() || self.seen.insert(input.to_owned()) {
                self.inputs.push((id, text(Path::new(input))?));
            }
        }
        if self.inputs.len() == before {
            self.missing.push(format!("@{name}"));
        }
        Ok(())
    }

    /// The items, where those without a name get one.
    fn named(self) -> Result<Vec<Item>, Failure> {
        let unnamed = self.inputs.iter().filter(|(id, _)| id.is_none());
        let paths: Vec<PathBuf> = unnamed.map(|(_, input)| absolute(Path::new(input))).collect();
        let common = common_folder(&paths);
        let mut paths = paths.iter();
        let mut name = |input: String| {
            let path = paths.next().map_or_else(|| Path::new(&input), PathBuf::as_path);
            let below = path.strip_prefix(&common).unwrap_or(path);
            let parts: Vec<String> = below
                .components()
                .filter_map(|part| match part {
                    Component::Normal(name) => Some(name.to_string_lossy().into_owned()),
                    _ => None,
                })
                .collect();
            let id = parts.join("/");
            match unsafe_name(&id) {
                None => Ok(Item { id, input }),
                Some(why) => Err(Failure::new(format!("{input} gives no name to its output: {id} {why}"))
                    .try_instead("give it another in a list, as a line of an id, a tab and the path")),
            }
        };
        let all = self.inputs.into_iter();
        all.map(|(id, input)| match id {
            Some(id) => Ok(Item { id, input }),
            None => name(input),
        })
        .collect()
    }
}

/// A path as text.
fn text(path: &Path) -> Result<String, Failure> {
    let text = path.to_str().filter(|text| !text.contains(char::is_control)).map(str::to_owned);
    text.ok_or_else(|| {
        let what = format!("the name of {} cannot stand in a list", path.display());
        Failure::new(what).try_instead("rename it: without control characters, in UTF-8")
    })
}

/// A path from the root, with `.` and `..` resolved by name.
fn absolute(path: &Path) -> PathBuf {
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    whole.components().fold(PathBuf::new(), |mut path, part| {
        match part {
            Component::ParentDir => {
                path.pop();
            }
            Component::CurDir => {}
            other => path.push(other),
        }
        path
    })
}

/// The deepest folder that has all of these files.
fn common_folder(paths: &[PathBuf]) -> PathBuf {
    let mut folders = paths.iter().map(|path| path.parent().unwrap_or(path));
    let Some(first) = folders.next() else { return PathBuf::new() };
    folders.fold(first.to_owned(), |common, folder| {
        common.components().zip(folder.components()).take_while(|(a, b)| a == b).map(|(a, _)| a).collect()
    })
}

/// What makes an id no name for a file.
fn unsafe_name(id: &str) -> Option<String> {
    let of_part = |part: &str| {
        if part.is_empty() || part == "." || part == ".." {
            Some(format!("{id:?} has a part that names no file"))
        } else if part.len() > LONGEST_NAME {
            Some(format!("{id:?} is too long; {LONGEST_NAME} bytes are possible between two /"))
        } else if part.ends_with([' ', '.']) || part.starts_with(' ') {
            Some(format!("{id:?} begins or ends with a space, or ends with a dot"))
        } else {
            None
        }
    };
    if let Some(c) = id.chars().find(|c| c.is_control() || "\\:*?\"<>|".contains(*c)) {
        return Some(format!("{id:?} has the character {c:?}"));
    }
    if id.starts_with('#') {
        return Some(format!("{id:?} begins with #, as comments do"));
    }
    id.split('/').find_map(of_part)
}

/// Whether all ids are different, also where files that differ in capitals alone are one.
fn check_unique(items: &[Item]) -> Result<(), Failure> {
    let key =
        |id: &str| if cfg!(any(windows, target_os = "macos")) { id.to_lowercase() } else { id.to_owned() };
    let mut seen = HashSet::new();
    let repeated: Vec<String> =
        items.iter().filter(|item| !seen.insert(key(&item.id))).map(|item| item.id.clone()).collect();
    if repeated.is_empty() {
        return Ok(());
    }
    let what = format!("several inputs have the id {}", named(&repeated));
    Err(Failure::new(what).try_instead("give each its own in a list, as a line of an id, a tab and the path"))
}

/// The first of several names, and how many more there are.
fn named(names: &[String]) -> String {
    let first = names[..names.len().min(NAMED)].join(", ");
    match names.len().saturating_sub(NAMED) {
        0 => first,
        more => format!("{first} and {} more", grouped(more)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder with these files, which goes with the value.
    struct Folder(PathBuf);

    impl Folder {
        fn new(test: &str, files: &[&str]) -> Self {
            let path = std::env::temp_dir().join(format!("ndf-items-{test}-{}", std::process::id()));
            for file in files {
                fs::create_dir_all(path.join(file).parent().unwrap()).unwrap();
                fs::write(path.join(file), "").unwrap();
            }
            Self(path)
        }

        fn items(&self, arguments: &[&str]) -> Result<Vec<Item>, Failure> {
            let within = |argument: &&str| match argument.strip_prefix('@') {
                Some(list) => format!("@{}", self.0.join(list).display()),
                None => self.0.join(argument).display().to_string(),
            };
            items(&arguments.iter().map(within).collect::<Vec<_>>(), &self.0.join("out"))
        }

        fn ids(&self, arguments: &[&str]) -> Vec<String> {
            self.items(arguments).unwrap().into_iter().map(|item| item.id).collect()
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn files_folders_and_patterns_give_items_once_and_in_order() {
        let files =
            ["d/b.obj", "d/a.stl", "d/a.obj", "d/e/a.obj", "d/.hidden", "out/files/a.obj.ndf", "[1].obj"];
        let folder = Folder::new("kinds", &files);
        assert_eq!(folder.ids(&["d"]), ["a.obj", "a.stl", "b.obj", "e/a.obj"]);
        assert_eq!(folder.ids(&["d/e/a.obj", "d"])[0], "e/a.obj");
        assert_eq!(folder.ids(&["d/**/*.obj"]), ["a.obj", "b.obj", "e/a.obj"]);
        assert_eq!(folder.ids(&["d/*.obj", "d/a.*"]), ["a.obj", "b.obj", "a.stl"]);
        assert_eq!(folder.ids(&["d/e"]), ["a.obj"]);
        assert_eq!(folder.ids(&["[1].obj", "d/../d/e"]), ["[1].obj", "d/e/a.obj"]);
        // What the batch writes is none of its inputs.
        assert_eq!(folder.ids(&["."]).len(), 5);
        let missing = folder.items(&["none.obj", "d/*.ply", "d/a.obj"]).unwrap_err().to_string();
        assert!(missing.contains("none.obj") && missing.contains("*.ply") && !missing.contains("a.obj"));
    }

    #[test]
    fn lists_name_their_items() {
        let folder = Folder::new("lists", &["d/a.obj"]);
        let list = |text: &str| {
            fs::write(folder.0.join("list"), text).unwrap();
            folder.items(&["@list"])
        };
        let found = list("# shapes\n\nbunny\td/a.obj\r\nlow/bunny\td/a.obj\nd/a.obj\nd/b.obj\n").unwrap();
        let ids: Vec<&str> = found.iter().map(|item| item.id.as_str()).collect();
        assert_eq!(ids, ["bunny", "low/bunny", "a.obj", "b.obj"]);
        assert_eq!(found[1].input, "d/a.obj");
        let refused = |text: &str| list(text).unwrap_err().to_string();
        assert!(refused("a\tx\na\ty\n").contains("several inputs have the id a"));
        for id in ["../a", "/a", "a//b", "a\\b", "a:b", ".", "a.", "a|b"] {
            assert!(refused(&format!("x\tx\n{id}\ty\n")).contains("line 2"), "{id}");
        }
        assert!(refused(&format!("{}\tx\n", "a".repeat(181))).contains("too long"));
        assert!(refused("# nothing\n").contains("no such input"));
    }
}
