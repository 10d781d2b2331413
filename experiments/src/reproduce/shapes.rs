//! The shapes of the experiments: files where they are, and shapes made by code.

use std::fs;
use std::path::{Path, PathBuf};

use ndf::{Kind, OpenOptions, Opened};
use ndf_cli::commands::sample::Shape as Built;
use ndf_core::NoProgress;
use ndf_formats::point_cloud::{PointCloud, RawCloud};
use ndf_formats::tensors::{made, to_safetensors};
use ndf_mesh::sampling::AreaSampler;

/// Points of clouds that are made.
const POINTS: usize = 8_000;

/// What a shape stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    /// A network of distances.
    Network,
    /// A cloud with normals.
    Cloud,
    /// A closed mesh.
    Mesh,
    /// A radiance field or splats, of which there are pictures only.
    Density,
}

impl Role {
    /// The role of what was found to be of a kind.
    pub(crate) fn of_kind(kind: &str) -> Self {
        match kind {
            "mesh" => Self::Mesh,
            "cloud" | "oriented-cloud" => Self::Cloud,
            "density" | "nerf" | "splats" => Self::Density,
            _ => Self::Network,
        }
    }
}

/// A shape.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shape {
    pub(crate) name: String,
    pub(crate) role: Role,
    source: Source,
}

#[derive(Clone, Debug, PartialEq)]
enum Source {
    File(PathBuf),
    /// Made by code.
    Made,
}

/// Meshes of more than a megabyte and some smaller ones: files of the folder `mesh`. The first is smooth, so that coarse truths do it no
/// wrong.
const MESHES: [&str; 9] = [
    "fertility_9k.off",
    "armadillo_86k.obj",
    "skull_100k.obj",
    "thingi10k_58011.stl",
    "rocker-arm.obj",
    "rind_wide_g7.ply",
    "sword.obj",
    "casting.off",
    "bunny_7k.off",
];

/// Clouds: files of the folder `points_oriented`.
const CLOUDS: [&str; 2] = ["elephant.pwn", "bacon_ref_armadillo.xyz"];

/// Radiance fields and splats: files of the folders.
const DENSITIES: [&str; 2] =
    ["nerf/fertility_yenchenlin/network_fine.safetensors", "splat/donut_fused_inria.ply"];

/// Shapes that any machine has.
const MADE: [(Role, &str); 4] =
    [(Role::Network, "torus"), (Role::Cloud, "trefoil"), (Role::Mesh, "trefoil"), (Role::Density, "torus")];

/// The surface of networks that are made.
const TORUS: made::Torus = made::Torus { ring: 0.6, tube: 0.25 };

impl Shape {
    pub(super) fn of_file(role: Role, path: PathBuf) -> Self {
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        Self { name, role, source: Source::File(path) }
    }

    /// What is learned.
    pub(crate) fn open(&self) -> Result<Opened, String> {
        let say = |e: &dyn std::fmt::Display| format!("{}: {e}", self.name);
        let kind = match self.role {
            Role::Network | Role::Mesh | Role::Density => None,
            Role::Cloud => Some(Kind::OrientedCloud),
        };
        let options = OpenOptions { kind, ..OpenOptions::default() };
        match (&self.source, self.role) {
            (Source::File(path), _) => ndf::open(path, &options).map_err(|e| say(&e)),
            (Source::Made, Role::Network) => {
                let bytes = to_safetensors(&TORUS.as_neus()).map_err(|e| say(&e))?;
                ndf::open_bytes(bytes, "torus.safetensors", &options, &NoProgress).map_err(|e| say(&e))
            }
            (Source::Made, Role::Density) => {
                let bytes = to_safetensors(&TORUS.as_nerf()).map_err(|e| say(&e))?;
                ndf::open_bytes(bytes, "torus.safetensors", &options, &NoProgress).map_err(|e| say(&e))
            }
            (Source::Made, Role::Mesh) => ndf::open_mesh(Built::Trefoil.mesh(None)).map_err(|e| say(&e)),
            (Source::Made, Role::Cloud) => ndf::open_cloud(&cloud()?, kind, &NoProgress).map_err(|e| say(&e)),
        }
    }

    /// The bytes of the file that represents it, where there is one: what a client needs who extracts a mesh from it.
    pub(crate) fn bytes(&self) -> Option<usize> {
        match &self.source {
            Source::File(path) => fs::metadata(path).ok().map(|m| m.len() as usize),
            Source::Made => None,
        }
    }
}

/// Points with normals, evenly on a shape.
fn cloud() -> Result<PointCloud, String> {
    let mesh = Built::Trefoil.mesh(None);
    let sampler = AreaSampler::new(&mesh).ok_or("the shape has no area")?;
    let samples = sampler.sample(POINTS, 0, 0);
    let raw = RawCloud {
        positions: samples.iter().map(|s| s.position(&mesh)).collect(),
        normals: Some(samples.iter().map(|s| mesh.face_normal(s.face)).collect()),
        ..RawCloud::default()
    };
    Ok(PointCloud::cleaned(raw).map_err(|e| e.to_string())?.0)
}

/// All shapes: networks of a folder, files of the data folder, and those made by code, which come last.
pub(crate) fn usual(data: &Path, networks: &Path) -> Vec<Shape> {
    let mut shapes = Vec::new();
    let mut networks: Vec<PathBuf> =
        fs::read_dir(networks).map_or_else(|_| Vec::new(), |all| all.flatten().map(|e| e.path()).collect());
    networks.sort();
    let is_network = |path: &&PathBuf| path.extension().is_some_and(|e| e == "pth" || e == "safetensors");
    shapes.extend(networks.iter().filter(is_network).map(|path| Shape::of_file(Role::Network, path.clone())));
    let files = |role, folder: &str, names: &[&str]| -> Vec<Shape> {
        let paths = names.iter().map(|name| data.join(folder).join(name));
        paths.filter(|path| path.exists()).map(|path| Shape::of_file(role, path)).collect()
    };
    shapes.extend(files(Role::Cloud, "points_oriented", &CLOUDS));
    shapes.extend(files(Role::Mesh, "mesh", &MESHES));
    shapes.extend(files(Role::Density, "", &DENSITIES));
    shapes.extend(MADE.map(|(role, name)| Shape { name: name.to_owned(), role, source: Source::Made }));
    shapes
}

/// The shapes of a list: lines of `network`, `cloud`, `mesh` or `density` and a path, which is relative to the list; lines that begin with #
/// and empty ones are passed over.
pub(crate) fn listed(list: &Path) -> Result<Vec<Shape>, String> {
    let text = fs::read_to_string(list).map_err(|e| format!("{}: {e}", list.display()))?;
    let folder = list.parent().unwrap_or(Path::new(""));
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    let shape = |line: &str| {
        let (role, path) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let role = match role {
            "network" => Role::Network,
            "cloud" => Role::Cloud,
            "mesh" => Role::Mesh,
            "density" => Role::Density,
            _ => {
                return Err(format!(
                    "{}: {line:?} should be network, cloud, mesh or density, and a path",
                    list.display()
                ));
            }
        };
        let path = folder.join(path.trim());
        if path.is_file() {
            Ok(Shape::of_file(role, path))
        } else {
            Err(format!("{}: no such file", path.display()))
        }
    };
    lines.map(shape).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_any_file_there_is_a_shape_of_each_role() {
        let shapes = usual(Path::new("/nowhere"), Path::new("/nowhere"));
        for role in [Role::Network, Role::Cloud, Role::Mesh, Role::Density] {
            let shape = shapes.iter().find(|shape| shape.role == role).unwrap();
            assert!(shape.open().is_ok_and(|opened| opened.field_surface().is_some()), "{shape:?}");
        }
    }

    #[test]
    fn lists_are_read_and_what_is_wrong_with_them_is_said() {
        let folder = std::env::temp_dir().join(format!("ndf-shapes-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("a.obj"), "").unwrap();
        let listed = |text: &str| {
            fs::write(folder.join("list"), text).unwrap();
            super::listed(&folder.join("list"))
        };
        let found = listed("# mine\n\nmesh a.obj\ncloud  a.obj\n").unwrap();
        assert_eq!(
            found.iter().map(|s| (s.role, s.name.as_str())).collect::<Vec<_>>(),
            [(Role::Mesh, "a"), (Role::Cloud, "a")]
        );
        assert!(listed("splat a.obj").unwrap_err().contains("network, cloud, mesh or density"));
        assert!(listed("mesh b.obj").unwrap_err().contains("no such file"));
        fs::remove_dir_all(&folder).unwrap();
    }
}
