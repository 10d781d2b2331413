//! The arrows between the crates: who may depend on whom.

use serde_json::Value;

use crate::shell::cargo;

/// Every crate of the workspace and the workspace's crates it may use.
const ALLOWED: &[(&str, &[&str])] = &[
    ("ndf-core", &[]),
    ("ndf-mesh", &["ndf-core"]),
    ("ndf-network", &[]),
    ("ndf-model", &["ndf-core", "ndf-mesh", "ndf-network"]),
    ("ndf-surfaces", &["ndf-core", "ndf-mesh"]),
    ("ndf-meshing", &["ndf-core", "ndf-mesh"]),
    ("ndf-train", &["ndf-core", "ndf-mesh", "ndf-network", "ndf-model"]),
    ("ndf-intrinsic", &["ndf-core", "ndf-mesh", "ndf-model"]),
    ("ndf-spectral", &["ndf-core", "ndf-mesh", "ndf-intrinsic"]),
    ("ndf-geodesic", &["ndf-core", "ndf-mesh", "ndf-intrinsic"]),
    (
        "ndf-cli",
        &[
            "ndf-core",
            "ndf-mesh",
            "ndf-network",
            "ndf-model",
            "ndf-surfaces",
            "ndf-meshing",
            "ndf-train",
            "ndf-intrinsic",
            "ndf-spectral",
            "ndf-geodesic",
        ],
    ),
    (
        "xtask",
        &[
            "ndf-core",
            "ndf-mesh",
            "ndf-network",
            "ndf-model",
            "ndf-surfaces",
            "ndf-meshing",
            "ndf-train",
            "ndf-intrinsic",
            "ndf-spectral",
            "ndf-geodesic",
            "ndf-cli",
        ],
    ),
];

/// Compares the dependencies that `cargo metadata` tells with the arrows. Dependencies of tests are free.
pub(crate) fn check() -> Result<(), String> {
    let output = cargo(&["metadata", "--format-version", "1", "--no-deps", "--locked"])
        .output()
        .map_err(|e| format!("cargo metadata: {e}"))?;
    let metadata: Value =
        serde_json::from_slice(&output.stdout).map_err(|e| format!("cargo metadata: {e}"))?;
    let list = |value: &Value, key: &str| value[key].as_array().cloned().unwrap_or_default();
    let name = |value: &Value| value["name"].as_str().unwrap_or_default().to_owned();
    let packages = list(&metadata, "packages");
    let members: Vec<String> = packages.iter().map(name).collect();
    if members.is_empty() {
        return Err("cargo metadata names no packages".to_owned());
    }
    for package in &packages {
        let from = name(package);
        let (_, allowed) = ALLOWED
            .iter()
            .find(|(crate_name, _)| *crate_name == from)
            .ok_or_else(|| format!("the crate {from} has no place among the arrows"))?;
        for dependency in list(package, "dependencies") {
            let to = name(&dependency);
            let is_for_tests = dependency["kind"] == "dev";
            if members.contains(&to) && !is_for_tests && !allowed.contains(&to.as_str()) {
                return Err(format!("{from} must not depend on {to}"));
            }
        }
    }
    Ok(())
}
