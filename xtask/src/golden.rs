//! What `ndf info` says of every file of some folders, one JSON object a line: a table that is looked through by eye, and
//! compared after changes.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};

use crate::shell::{self, cargo, root};

/// The table.
const TABLE: &str = "docs/info.jsonl";

/// How far numbers may differ between machines.
const TOLERANCE: f64 = 1e-9;

/// Writes the table of all files under `folders`, and names the lines that changed.
#[expect(clippy::print_stdout, reason = "the changes are what is asked for")]
pub(crate) fn run(folders: &[&str]) -> Result<(), String> {
    shell::run(&mut cargo(&["build", "--release", "--bin", "ndf"]))?;
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from);
    let program = target.join("release/ndf");
    let path = root().join(TABLE);
    let before = fs::read_to_string(&path).unwrap_or_default();
    let mut rows: Vec<(String, Value)> = parsed(&before)?;
    let (mut changed, mut seen) = (0, 0);
    for folder in folders {
        let folder = root().join(folder);
        let name = folder.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let mut files = Vec::new();
        collect(&folder, &mut files)?;
        files.sort();
        for file in files {
            let relative = file.strip_prefix(&folder).unwrap_or(&file);
            let key = format!("{name}/{}", relative.display());
            let said = info(&program, &folder, relative)?;
            let old = rows.iter().find(|(file, _)| *file == key).map(|(_, said)| said);
            if !old.is_some_and(|old| is_same(old, &said)) {
                changed += 1;
                println!("{key}\n  before {}\n  now    {said}", old.unwrap_or(&Value::Null));
                rows.retain(|(file, _)| *file != key);
                rows.push((key, said));
            }
            seen += 1;
        }
    }
    rows.sort_by(|a, b| a.0.cmp(&b.0));
    let lines = rows.iter().map(|(file, said)| format!("{}\n", json!({ "file": file, "info": said })));
    fs::write(&path, lines.collect::<String>()).map_err(|e| format!("{TABLE}: {e}"))?;
    println!("{seen} files, {changed} of them new or changed in {TABLE}");
    Ok(())
}

/// What the program says: its JSON, or its refusal.
fn info(program: &Path, folder: &Path, file: &Path) -> Result<Value, String> {
    let run = Command::new(program)
        .args(["info", "--json", "--quiet"])
        .arg(file)
        .current_dir(folder)
        .output()
        .map_err(|e| format!("{}: {e}", program.display()))?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    Ok(match serde_json::from_slice(&run.stdout) {
        Ok(said) => said,
        Err(_) => json!({ "exit": run.status.code(), "refused": text(&run.stderr) }),
    })
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), String> {
    let failed = |e: std::io::Error| format!("{}: {e}", folder.display());
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        // Folders can be inputs, too, but hold the files that are told one by one.
        if path.is_dir() {
            collect(&path, files)?;
        } else if path.extension().is_none_or(|end| end != "md" && end != "py" && end != "sh") {
            files.push(path);
        }
    }
    Ok(())
}

fn parsed(table: &str) -> Result<Vec<(String, Value)>, String> {
    let row = |line: &str| -> Result<(String, Value), String> {
        let mut row: Value = serde_json::from_str(line).map_err(|e| format!("{TABLE}: {e}"))?;
        let file = row["file"].as_str().ok_or(format!("{TABLE}: a line without a file"))?.to_owned();
        Ok((file, row["info"].take()))
    };
    table.lines().map(row).collect()
}

/// Whether two values are the same, but for rounding.
fn is_same(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => {
            let [a, b] = [a, b].map(|x| x.as_f64().unwrap_or(f64::NAN));
            a == b || (a - b).abs() <= TOLERANCE * a.abs().max(b.abs())
        }
        (Value::Array(a), Value::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_same(a, b))
        }
        (Value::Object(a), Value::Object(b)) => {
            a.len() == b.len() && a.iter().all(|(key, a)| b.get(key).is_some_and(|b| is_same(a, b)))
        }
        _ => a == b,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_no_change() {
        let a = json!({"kind": "mesh", "area": 1.5, "bounds": [[0.0, 1.0], [2, 3]]});
        let close = json!({"kind": "mesh", "area": 1.500_000_000_1, "bounds": [[0.0, 1.0], [2.0, 3.0]]});
        assert!(is_same(&a, &close));
        assert!(!is_same(&a, &json!({"kind": "mesh", "area": 1.5001, "bounds": [[0.0, 1.0], [2, 3]]})));
        assert!(!is_same(&a, &json!({"kind": "mesh", "area": 1.5})));
        assert_eq!(parsed("{\"file\": \"a/b\", \"info\": {\"x\": 1}}\n").unwrap()[0].1, json!({"x": 1}));
    }

    #[test]
    fn the_table_is_well_formed() {
        let table = fs::read_to_string(root().join(TABLE)).unwrap();
        let rows = parsed(&table).unwrap();
        assert!(rows.is_sorted_by(|a, b| a.0 < b.0) && rows.len() > 100);
    }
}
