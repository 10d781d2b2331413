//! What a batch is: its command, options, parts and items, kept in its folder so that all who work on it do the same.

use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use ndf_mesh::io::atomic_write;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::items::Item;
use crate::output::Failure;

/// What a batch is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Plan {
    /// The version of the program.
    pub version: String,
    /// The command that every item is given to.
    pub command: String,
    /// Its options, the same for all.
    pub flags: Vec<String>,
    /// The ending of the outputs, where there are some.
    pub extension: Option<String>,
    /// How many parts it is done in.
    pub shards: usize,
    /// How many items it has.
    pub items: usize,
    /// Hash of their list.
    pub list_sha256: String,
    /// The folder it was begun in, where paths of inputs lead from. It may be another when the batch goes on, as on machines that
    /// have the same files elsewhere.
    #[serde(default)]
    pub begun_in: Option<PathBuf>,
}

/// The places in the folder of a batch.
#[derive(Clone, Debug)]
pub(super) struct Places(PathBuf);

impl Places {
    /// Those in this folder.
    pub(super) fn in_folder(folder: &Path) -> Self {
        Self(folder.to_owned())
    }

    /// The folder itself.
    pub(super) fn folder(&self) -> &Path {
        &self.0
    }

    /// The plan.
    pub(super) fn plan(&self) -> PathBuf {
        self.0.join("plan.json")
    }

    /// The list of all items, as `@FILE` takes it.
    pub(super) fn list(&self) -> PathBuf {
        self.0.join("items.txt")
    }

    /// The rows of a part.
    pub(super) fn rows(&self, shard: usize) -> PathBuf {
        self.0.join(format!("rows-{shard}.jsonl"))
    }

    /// The folder of outputs.
    pub(super) fn outputs(&self) -> PathBuf {
        self.0.join("files")
    }

    /// The folder of the checkpoints of what is being learned.
    pub(super) fn checkpoints(&self) -> PathBuf {
        self.0.join("checkpoints")
    }
}

/// Items as the lines of a list.
pub(super) fn listed(items: &[Item]) -> String {
    items.iter().map(|Item { id, input }| format!("{id}\t{input}\n")).collect()
}

/// The hash of bytes, in hexadecimal digits.
pub(super) fn sha256(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

/// Bytes in hexadecimal digits.
pub(super) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Plan {
    /// Writes the plan and its list if the folder has none, else compares them.
    ///
    /// # Errors
    /// If the folder has another plan, or cannot be written.
    pub(super) fn settle(&self, items: &[Item], places: &Places) -> Result<(), Failure> {
        let cannot =
            |path: &Path, e: &std::io::Error| Failure::new(format!("cannot write {}: {e}", path.display()));
        let folder = places.folder();
        fs::create_dir_all(folder).map_err(|e| cannot(folder, &e))?;
        if let Some(settled) = Self::read_if_there(places)? {
            return self.compare(&settled, folder);
        }
        // Before the plan: where that is, the list is.
        let list = places.list();
        atomic_write(&list, |out| out.write_all(listed(items).as_bytes())).map_err(|e| cannot(&list, &e))?;
        let path = places.plan();
        let mut text = serde_json::to_string_pretty(self)?;
        text.push('\n');
        let mut file = tempfile::NamedTempFile::new_in(folder).map_err(|e| cannot(&path, &e))?;
        #[cfg(unix)]
        readable_by_all(file.as_file()).map_err(|e| cannot(&path, &e))?;
        file.write_all(text.as_bytes()).map_err(|e| cannot(&path, &e))?;
        match file.persist_noclobber(&path) {
            Ok(_) => Ok(()),
            // Another part was first.
            Err(e) if e.error.kind() == ErrorKind::AlreadyExists => {
                self.compare(&Self::read(places)?, folder)
            }
            Err(e) => Err(cannot(&path, &e.error)),
        }
    }

    /// The plan of a folder.
    ///
    /// # Errors
    /// If there is none, or it cannot be read.
    pub(super) fn read(places: &Places) -> Result<Self, Failure> {
        Self::read_if_there(places)?.ok_or_else(|| {
            let folder = places.folder().display();
            Failure::new(format!("{folder} is no folder of a batch: it has no plan.json"))
                .try_instead("`ndf batch COMMAND INPUTS -o DIR` makes one")
        })
    }

    /// Where an input is: from here, or from where the batch was begun.
    pub(super) fn found(&self, input: &str) -> PathBuf {
        let there = self.begun_in.as_ref().map(|folder| folder.join(input));
        there.filter(|there| there.exists() && !Path::new(input).exists()).unwrap_or_else(|| input.into())
    }

    fn read_if_there(places: &Places) -> Result<Option<Self>, Failure> {
        let path = places.plan();
        let text = match fs::read_to_string(&path) {
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
            text => text.map_err(|e| Failure::new(format!("cannot read {}: {e}", path.display())))?,
        };
        let plan = serde_json::from_str(&text);
        plan.map(Some).map_err(|e| Failure::new(format!("{} is no plan of a batch: {e}", path.display())))
    }

    fn compare(&self, settled: &Self, folder: &Path) -> Result<(), Failure> {
        let differences = self.differences(settled);
        if differences.is_empty() {
            return Ok(());
        }
        let what = format!("{} is of another batch: {}", folder.display(), differences.join("; "));
        Err(Failure::new(what)
            .try_instead("choose another folder, or go on with what that one was begun with"))
    }

    /// What is not as in a plan that was settled before.
    fn differences(&self, settled: &Self) -> Vec<String> {
        let fields = |plan: &Self| match serde_json::to_value(plan) {
            Ok(Value::Object(fields)) => fields,
            _ => serde_json::Map::new(),
        };
        let shown = |value: &Value| match value {
            Value::Array(words) if words.is_empty() => "none".to_owned(),
            Value::Array(words) => words.iter().filter_map(Value::as_str).collect::<Vec<_>>().join(" "),
            Value::Null => "none".to_owned(),
            Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        let settled = fields(settled);
        let may_differ = |key: &str| key == "begun_in";
        let different =
            fields(self).into_iter().filter(|(key, now)| settled.get(key) != Some(now) && !may_differ(key));
        different
            .map(|(key, now)| match key.as_str() {
                "list_sha256" => "its list of inputs is another".to_owned(),
                key => format!(
                    "{key}: {}, now {}",
                    settled.get(key).map_or_else(String::new, shown),
                    shown(&now)
                ),
            })
            .collect()
    }
}

/// As other files are made, not only for their owner as temporary ones.
#[cfg(unix)]
fn readable_by_all(file: &fs::File) -> std::io::Result<()> {
    file.set_permissions(std::os::unix::fs::PermissionsExt::from_mode(0o644))
}

/// The items of the list in the folder of a batch.
///
/// # Errors
/// If it cannot be read or is not the list of the plan.
pub(super) fn read_list(plan: &Plan, places: &Places) -> Result<Vec<Item>, Failure> {
    let path = places.list();
    let text = fs::read_to_string(&path)
        .map_err(|e| Failure::new(format!("cannot read {}: {e}", path.display())))?;
    if sha256(text.as_bytes()) != plan.list_sha256 {
        let what = format!("{} is not the list that the batch was begun with", path.display());
        return Err(
            Failure::new(what).try_instead("`ndf batch` with --resume and the same inputs says what differs")
        );
    }
    let item = |line: &str| {
        let (id, input) = line.split_once('\t')?;
        Some(Item { id: id.to_owned(), input: input.to_owned() })
    };
    Ok(text.lines().filter_map(item).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(items: &[Item]) -> Plan {
        Plan {
            version: "0.1.0".to_owned(),
            command: "fit".to_owned(),
            flags: vec!["--size".to_owned(), "9000".to_owned()],
            extension: Some("ndf".to_owned()),
            shards: 2,
            items: items.len(),
            list_sha256: sha256(listed(items).as_bytes()),
            begun_in: None,
        }
    }

    #[test]
    fn the_first_plan_stays_and_others_hear_what_differs() {
        let folder = std::env::temp_dir().join(format!("ndf-plan-{}", std::process::id()));
        let places = Places::in_folder(&folder);
        let items =
            [("a", "x/a"), ("b/c", "x/b")].map(|(id, input)| Item { id: id.into(), input: input.into() });
        assert!(Plan::read(&places).unwrap_err().to_string().contains("no plan.json"));
        let first = plan(&items);
        first.settle(&items, &places).unwrap();
        first.settle(&items, &places).unwrap();
        assert_eq!(Plan::read(&places).unwrap(), first);
        assert_eq!(read_list(&first, &places).unwrap(), items);
        let elsewhere = Plan { begun_in: Some("/elsewhere".into()), ..first.clone() };
        elsewhere.settle(&items, &places).unwrap();
        let other = Plan { flags: Vec::new(), shards: 3, ..plan(&items[..1]) };
        let said = other.settle(&items[..1], &places).unwrap_err().to_string();
        for difference in
            ["flags: --size 9000, now none", "items: 2, now 1", "shards: 2, now 3", "list of inputs"]
        {
            assert!(said.contains(difference), "{said} lacks {difference}");
        }
        assert!(!said.contains("version"), "{said}");
        fs::write(places.list(), "c\tc\n").unwrap();
        assert!(read_list(&first, &places).is_err());
        fs::remove_dir_all(folder).unwrap();
    }
}
