//! Meshes to measure with: files, refined or not, and shapes made by code.

use std::collections::HashMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use ndf_mesh::io::read_mesh;
use ndf_mesh::repair::{self, RepairOptions};
use ndf_mesh::{ManifoldMesh, TriangleMesh, shapes};

/// A mesh by name: a file of the data folder or `rope-ALONGxAROUND`, and how often it is refined, as in
/// `skull_100k.obj+2`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct MeshName {
    base: Base,
    refinements: u32,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Base {
    File(PathBuf),
    Rope { along: u32, around: u32 },
}

impl FromStr for MeshName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (base, refinements) = match text.rsplit_once('+') {
            Some((base, times)) => (base, times.parse().map_err(|e| format!("{text}: {e}"))?),
            None => (text, 0),
        };
        let base = match base.strip_prefix("rope-").and_then(|size| size.split_once('x')) {
            Some((along, around)) => {
                let number = |word: &str| word.parse().map_err(|e| format!("{text}: {e}"));
                Base::Rope { along: number(along)?, around: number(around)? }
            }
            None => Base::File(base.into()),
        };
        Ok(Self { base, refinements })
    }
}

impl fmt::Display for MeshName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.base {
            Base::File(path) => path.display().fmt(f)?,
            Base::Rope { along, around } => write!(f, "rope-{along}x{around}")?,
        }
        if self.refinements > 0 { write!(f, "+{}", self.refinements) } else { Ok(()) }
    }
}

impl MeshName {
    /// The mesh, repaired where the file is no manifold.
    pub(crate) fn build(&self, data: &Path) -> Result<ManifoldMesh, String> {
        let say = |e: &dyn fmt::Display| format!("{self}: {e}");
        let mut mesh = match &self.base {
            Base::File(path) => read_mesh(data.join(path)).map_err(|e| say(&e))?.mesh,
            Base::Rope { along, around } => shapes::rope_knot(*along, *around, 0.24),
        };
        for _ in 0..self.refinements {
            mesh = refined(&mesh);
        }
        match ManifoldMesh::try_from(mesh.clone()) {
            Ok(mesh) => Ok(mesh),
            Err(_) => Ok(repair::repaired(&mesh, &RepairOptions::LARGEST).map_err(|e| say(&e))?.mesh),
        }
    }
}

/// Every face split into four, with new vertices where Loop's subdivision (1987) has them and old ones unmoved: flat
/// midpoints would make all new vertices flat, which no scanned mesh is.
fn refined(mesh: &TriangleMesh) -> TriangleMesh {
    let key = |a: u32, b: u32| (a.min(b), a.max(b));
    let mut opposite: HashMap<(u32, u32), Vec<u32>> = HashMap::new();
    for &[a, b, c] in mesh.faces() {
        for (a, b, c) in [(a, b, c), (b, c, a), (c, a, b)] {
            opposite.entry(key(a, b)).or_default().push(c);
        }
    }
    let mut positions = mesh.positions().to_vec();
    let mut added = HashMap::new();
    let mut point = |a: u32, b: u32| {
        *added.entry(key(a, b)).or_insert_with(|| {
            let at = |v: u32| mesh.positions()[v as usize];
            let middle = at(a).midpoint(at(b));
            positions.push(match opposite[&key(a, b)][..] {
                [c, d] => middle.lerp(at(c).midpoint(at(d)), 0.25),
                _ => middle,
            });
            positions.len() as u32 - 1
        })
    };
    let mut faces = Vec::with_capacity(4 * mesh.face_count());
    for &[a, b, c] in mesh.faces() {
        let (ab, bc, ca) = (point(a, b), point(b, c), point(c, a));
        faces.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
    }
    TriangleMesh::new(positions, faces).expect("all vertices exist")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_written() {
        for name in ["spot.obj", "a/skull_100k.obj+2", "rope-100x20", "rope-100x20+1"] {
            assert_eq!(name.parse::<MeshName>().map(|n| n.to_string()), Ok(name.to_owned()));
        }
        assert!("spot.obj+x".parse::<MeshName>().is_err());
        assert!("rope-ax2".parse::<MeshName>().is_err());
    }

    #[test]
    fn refining_keeps_the_topology() {
        let mesh =
            "rope-30x12+1".parse::<MeshName>().and_then(|name| name.build(Path::new(""))).expect("built");
        assert_eq!(mesh.face_count(), 4 * 2 * 30 * 12);
        assert_eq!(mesh.vertex_count(), 4 * 30 * 12);
    }
}
