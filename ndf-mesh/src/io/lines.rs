//! Lines in space, as paths over surfaces are: PLY with an element `edge`, of which trimesh makes paths and MeshLab shows
//! lines, OBJ with statements `l`, for pyvista and ParaView, which read no edges of PLY, and binary glTF.

use std::path::Path;

use ndf_core::DVec3;

use super::{
    FileDefect, MeshFormat, Positions, ReadError, Rounding, Signature, WriteError, atomic_write,
    format_to_write, gltf, obj, ply,
};

/// Segments between points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lines {
    /// The points.
    pub points: Vec<DVec3>,
    /// The two ends of every segment.
    pub segments: Vec<[u32; 2]>,
}

impl Lines {
    /// Polylines, each through its points in order. No two of them share a point.
    ///
    /// # Panics
    /// If there are 2³² points or more.
    pub fn from_polylines<'a>(polylines: impl IntoIterator<Item = &'a [DVec3]>) -> Self {
        let mut lines = Self::default();
        for polyline in polylines {
            let number = |k: usize| u32::try_from(k).expect("there are fewer than 2³² points");
            let first = lines.points.len();
            let ends = (first + 1..first + polyline.len()).map(|k| [number(k - 1), number(k)]);
            lines.segments.extend(ends);
            lines.points.extend_from_slice(polyline);
        }
        lines
    }
}

/// Reads the lines of a file: of PLY the element `edge` with `vertex1` and `vertex2`, of OBJ the statements `l`, of glTF the
/// primitives of lines.
///
/// # Errors
/// As [`read_mesh`](super::read_mesh), and if the file has no line.
pub fn read_lines(path: impl AsRef<Path>) -> Result<Lines, ReadError> {
    let path = path.as_ref();
    let bytes = std::fs::read(path).map_err(|source| ReadError::Io { path: path.to_owned(), source })?;
    let malformed = |format, defect| ReadError::Malformed { path: path.to_owned(), format, defect };
    let (format, lines) = match Signature::of(&bytes) {
        Some(Signature::Glb) => (MeshFormat::Glb, gltf::lines(&bytes, path)),
        Some(Signature::Gltf) => (MeshFormat::Gltf, gltf::lines(&bytes, path)),
        _ => {
            let file = super::parse_mesh(&bytes, path)?;
            let bytes = super::text::without_mark(&bytes);
            let segments = match file.format {
                MeshFormat::Ply => ply::edges(bytes),
                MeshFormat::Obj => obj::lines(bytes),
                _ => Ok(Vec::new()),
            };
            (file.format, segments.map(|segments| (file.mesh.into_parts().0, segments)))
        }
    };
    let malformed = |defect| malformed(format, defect);
    let (points, segments) = lines.map_err(malformed)?;
    if let Some(&[a, b]) = segments.iter().find(|ends| ends.iter().any(|&v| v as usize >= points.len())) {
        let (vertex, vertices) = (a.max(b), points.len());
        let text = format!("a line ends at vertex {vertex}, but there are {vertices} vertices");
        return Err(malformed(FileDefect::mismatch(text)));
    }
    if segments.is_empty() {
        return Err(malformed(FileDefect::missing("it has no lines (an element edge in PLY, l in OBJ)")));
    }
    Ok(Lines { points, segments })
}

/// Writes lines in the format the extension names: `.ply`, `.glb` or `.obj`, positions as [`write_mesh`](super::write_mesh) does.
///
/// # Errors
/// If the extension is another, or the file cannot be written.
pub fn write_lines(path: impl AsRef<Path>, lines: &Lines, positions: Positions) -> Result<(), WriteError> {
    let path = path.as_ref();
    let format = format_of_lines(path)?;
    let is_double = positions.is_double(Rounding::to_single(&lines.points));
    let written = atomic_write(path, |out| match format {
        MeshFormat::Obj => obj::write_lines(out, &lines.points, &lines.segments),
        MeshFormat::Glb => gltf::write_lines(out, &lines.points, &lines.segments),
        _ => ply::write_lines(out, &lines.points, &lines.segments, is_double),
    });
    written.map_err(|source| WriteError::Io { path: path.to_owned(), source })
}

/// The format in which lines will be written to `path`: `.ply`, `.glb` or `.obj`, in either case.
///
/// # Errors
/// If the extension is another.
pub fn format_of_lines(path: &Path) -> Result<MeshFormat, WriteError> {
    match format_to_write(path) {
        Ok(format @ (MeshFormat::Ply | MeshFormat::Glb | MeshFormat::Obj)) => Ok(format),
        _ => Err(WriteError::NoLines { path: path.to_owned() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(name: &str) -> std::path::PathBuf {
        std::env::temp_dir().join(format!("ndf-lines-{}-{name}", std::process::id()))
    }

    #[test]
    fn lines_come_back_in_both_formats_also_far_from_the_origin() {
        let near: Vec<DVec3> = (0..5).map(|k| DVec3::new(f64::from(k), 0.5, -0.25)).collect();
        let far: Vec<DVec3> = near.iter().map(|p| *p + DVec3::new(5e5, 5e6, 0.0)).collect();
        for points in [near, far] {
            let lines = Lines::from_polylines([&points[..3], &points[3..]]);
            assert_eq!(lines.segments, [[0, 1], [1, 2], [3, 4]]);
            for name in ["a.ply", "a.obj", "a.glb"] {
                let path = place(name);
                write_lines(&path, &lines, Positions::Suited).unwrap();
                assert_eq!(read_lines(&path).unwrap(), lines, "{name}");
                std::fs::remove_file(path).unwrap();
            }
        }
        assert!(matches!(
            write_lines("a.stl", &Lines::default(), Positions::Suited),
            Err(WriteError::NoLines { .. })
        ));
    }

    #[test]
    fn files_without_lines_and_lines_without_ends_are_refused() {
        let header =
            "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n";
        let points = "0 0 0\n1 0 0\n";
        let edges = "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n";
        for (name, content, said) in [
            ("b.ply", format!("{header}end_header\n{points}"), "no lines"),
            ("c.ply", format!("{header}{edges}{points}0 7\n"), "vertex 7"),
            ("d.ply", format!("{header}{edges}{points}0 -1\n"), "-1"),
            ("e.obj", "v 0 0 0\nv 1 0 0\nl 1 3\n".to_owned(), "3"),
            ("f.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n".to_owned(), "no lines"),
        ] {
            let path = place(name);
            std::fs::write(&path, content).unwrap();
            let message = read_lines(&path).unwrap_err().to_string();
            assert!(message.contains(said), "{message}");
            std::fs::remove_file(path).unwrap();
        }
    }
}
