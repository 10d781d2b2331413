//! The arrows between the crates: which crate may use which.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::circles;
use crate::shell::cargo;

/// The crates from the programs down to the foundation. A crate uses crates of lower lines or of its own.
const LINES: &[&[&str]] = &[
    &["xtask"],
    &["ndf-experiments"],
    &["ndf-py", "ndf-web"],
    &["ndf-cli"],
    &["ndf"],
    &["ndf-baselines"],
    &["ndf-geodesic", "ndf-spectral", "ndf-fields"],
    &["ndf-intrinsic"],
    &["ndf-train"],
    &["ndf-meshing"],
    &["ndf-surfaces"],
    &["ndf-formats"],
    &["ndf-model"],
    &["ndf-network"],
    &["ndf-mesh"],
    &["ndf-core", "ndf-testing", "ndf-viewer"],
];

/// Crates that do not know certain crates below them: training and everything that runs on triangulations work for any
/// representation.
const APART: &[(&[&str], &[&str])] = &[
    (&["ndf-train"], &["ndf-meshing", "ndf-surfaces", "ndf-formats"]),
    (
        &["ndf-intrinsic", "ndf-geodesic", "ndf-spectral", "ndf-fields"],
        &["ndf-train", "ndf-meshing", "ndf-surfaces", "ndf-formats"],
    ),
];

/// A crate of the workspace.
pub(crate) struct Package {
    pub(crate) name: String,
    /// Where it lies.
    pub(crate) folder: PathBuf,
    line: usize,
    is_published: bool,
    /// The crates of the workspace it uses, tests aside.
    uses: Vec<String>,
}

/// Prints the crates with their arrows and checks them.
#[expect(clippy::print_stdout, reason = "the list that was asked for")]
pub(crate) fn run() -> Result<(), String> {
    let packages = packages()?;
    for package in &packages {
        println!("{:16} → {}", package.name, package.uses.join(", "));
    }
    check_order(&packages)?;
    circles::check(packages.iter().map(|package| (&*package.name, &*package.folder)))
}

/// The crates that are published.
pub(crate) fn published() -> Result<Vec<Package>, String> {
    Ok(packages()?.into_iter().filter(|package| package.is_published).collect())
}

/// What `cargo metadata` tells, from the top down. Dependencies of tests are free.
fn packages() -> Result<Vec<Package>, String> {
    let output = cargo(&["metadata", "--format-version", "1", "--no-deps", "--locked"])
        .output()
        .map_err(|e| format!("cargo metadata: {e}"))?;
    let metadata: Value =
        serde_json::from_slice(&output.stdout).map_err(|e| format!("cargo metadata: {e}"))?;
    let list = |value: &Value, key: &str| value[key].as_array().cloned().unwrap_or_default();
    let name = |value: &Value| value["name"].as_str().unwrap_or_default().to_owned();
    let members = list(&metadata, "packages");
    let is_member = |name: &String| members.iter().any(|member| member["name"] == **name);
    let mut packages = Vec::new();
    for member in &members {
        let dependencies = list(member, "dependencies");
        let mut uses: Vec<String> =
            dependencies.iter().filter(|d| d["kind"] != "dev").map(name).filter(is_member).collect();
        uses.sort_by_key(|name| line(name));
        uses.dedup();
        let name = name(member);
        let line = line(&name).ok_or_else(|| format!("{name} has no place in the list of crates"))?;
        let is_published = member["publish"].is_null();
        let manifest = PathBuf::from(member["manifest_path"].as_str().unwrap_or_default());
        let folder = manifest.parent().map_or_else(PathBuf::new, Path::to_path_buf);
        packages.push(Package { name, folder, line, is_published, uses });
    }
    packages.sort_by_key(|package| package.line);
    Ok(packages)
}

fn line(name: &str) -> Option<usize> {
    LINES.iter().position(|line| line.contains(&name))
}

fn check_order(packages: &[Package]) -> Result<(), String> {
    for Package { name, line: from, uses, .. } in packages {
        for used in uses {
            let points_up = line(used).is_none_or(|to| to < *from);
            let is_apart = |(these, those): &(&[&str], &[&str])| {
                these.contains(&name.as_str()) && those.contains(&used.as_str())
            };
            if points_up || APART.iter().any(is_apart) {
                return Err(format!("{name} must not depend on {used}"));
            }
        }
    }
    Ok(())
}
