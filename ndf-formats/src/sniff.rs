//! What a file is: one answer for all readers.
//!
//! They are asked in a fixed order, from what says most to what says least: magic numbers; structure, such as the header of
//! safetensors or PCD; the words of text formats; and last, for binary STL and records of splats, which have none of
//! these, sizes and what the numbers look like.

use ndf_mesh::io::{self, MeshFormat, Signature, ply_elements};

use crate::point_cloud::{self, CloudFormat};
use crate::splats::{self, SplatFormat};
use crate::tensors::{self, Container};

/// What a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// A mesh, with faces.
    Mesh(MeshFormat),
    /// Points.
    Cloud(CloudFormat),
    /// Gaussian splats.
    Splats(SplatFormat),
    /// Named arrays of numbers.
    Tensors(Container),
    /// A format that is not read, or what stands in the place of a file, in words that complete "the file is …".
    Foreign(&'static str),
}

/// What a file is, told from its content; `None` if it is of no known format.
pub fn sniff(bytes: &[u8]) -> Option<Format> {
    match Signature::of(bytes) {
        Some(Signature::Foreign(what)) => return Some(Format::Foreign(what)),
        Some(Signature::Ply) => return Some(ply(bytes)),
        Some(Signature::Glb) => return Some(glb(bytes)),
        Some(Signature::Gltf) => return Some(Format::Mesh(MeshFormat::Gltf)),
        _ => {}
    }
    if let Some(container) = tensors::container_of(bytes) {
        return Some(Format::Tensors(container));
    }
    if let Some(packed @ (Signature::Zip | Signature::Gzip)) = Signature::of(bytes) {
        let what = match packed {
            Signature::Zip => tensors::other_archive(bytes),
            _ => "packed by gzip; unpack it first",
        };
        return Some(splats::splat_format(bytes).map_or(Format::Foreign(what), Format::Splats));
    }
    match point_cloud::sniff(bytes) {
        Some(CloudFormat::Vertices(format)) if io::has_faces(bytes, format) => Some(Format::Mesh(format)),
        Some(format) => Some(Format::Cloud(format)),
        None => splats::splat_format(bytes).map(Format::Splats),
    }
}

/// A PLY file is a mesh if it announces faces, else splats if its vertices have what splats have, else points.
fn ply(bytes: &[u8]) -> Format {
    let is_mesh = ply_elements(bytes).is_none() || io::has_faces(bytes, MeshFormat::Ply);
    match splats::splat_format(bytes) {
        _ if is_mesh => Format::Mesh(MeshFormat::Ply),
        Some(format) => Format::Splats(format),
        None => Format::Cloud(CloudFormat::Vertices(MeshFormat::Ply)),
    }
}

/// Binary glTF holds splats if it names their extension, else a mesh.
fn glb(bytes: &[u8]) -> Format {
    splats::splat_format(bytes).map_or(Format::Mesh(MeshFormat::Glb), Format::Splats)
}

#[cfg(all(test, feature = "full"))]
mod tests {
    use super::*;
    use crate::{point_cloud, splats, tensors};
    use ndf_mesh::io::gltf::{GlbOptions, to_glb};
    use ndf_mesh::shapes;

    /// Text meshes and a binary one.
    fn meshes() -> Vec<(&'static str, Vec<u8>)> {
        let mesh = shapes::icosphere(0);
        let vertices: String =
            mesh.positions().iter().map(|p| format!("{} {} {}\n", p.x, p.y, p.z)).collect();
        let faces: String = mesh.faces().iter().map(|[a, b, c]| format!("3 {a} {b} {c}\n")).collect();
        let obj: String = vertices.lines().map(|line| format!("v {line}\n")).collect();
        let mut stl = vec![b' '; 80];
        stl.extend(20_u32.to_le_bytes());
        for f in mesh.face_indices() {
            let [a, b, c] = mesh.corner_positions(f);
            let numbers = [mesh.face_normal(f), a, b, c].map(|p| p.as_vec3().to_array()).concat();
            stl.extend(numbers.iter().flat_map(|x| x.to_le_bytes()).chain([0, 0]));
        }
        let cut = stl[..stl.len() - 70].to_vec();
        let solid = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";
        let ply = "ply\nformat ascii 1.0\nelement vertex 12\nproperty float x\nproperty float y\nproperty float z\n\
            element face 20\nproperty list uchar int vertex_indices\nend_header\n";
        vec![
            ("a.obj", format!("{obj}f 1 2 3\n").into_bytes()),
            ("a.ply", format!("{ply}{vertices}{faces}").into_bytes()),
            ("a.off", format!("OFF\n12 20 0\n{vertices}{faces}").into_bytes()),
            ("bare.off", format!("12 20 0\n{vertices}{faces}").into_bytes()),
            ("text.stl", solid.into()),
            ("binary.stl", stl),
            ("cut.stl", cut),
            ("a.glb", to_glb(&mesh, &[], &GlbOptions::default()).expect("it is finite")),
        ]
    }

    /// Every small file of every format, with the family that it is of.
    fn files() -> Vec<(&'static str, &'static str, Vec<u8>)> {
        let of = |family: &'static str, files: Vec<(&'static str, Vec<u8>)>| {
            files.into_iter().map(move |(name, bytes)| (family, name, bytes))
        };
        let clouds = [
            (
                "ptx",
                b"4\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n0 0 1 1\n".to_vec(),
            ),
            ("pts", b"2\n0 0 1 5\n0 1 1 7\n".to_vec()),
            ("points.obj", b"v 0 0 1\nv 0 1 0\n".to_vec()),
            ("points.off", b"OFF\n2 0 0\n0 0 1\n0 1 0\n".to_vec()),
        ];
        of("mesh", meshes())
            .chain(of("cloud", point_cloud::samples::all()))
            .chain(of("cloud", clouds.to_vec()))
            .chain(of("splats", splats::samples::all()))
            .chain(of("tensors", tensors::samples::all()))
            .collect()
    }

    #[test]
    fn every_file_is_of_one_family() {
        for (family, name, bytes) in files() {
            let found = match sniff(&bytes) {
                Some(Format::Mesh(_)) => "mesh",
                Some(Format::Cloud(_)) => "cloud",
                Some(Format::Splats(_)) => "splats",
                Some(Format::Tensors(_)) => "tensors",
                Some(Format::Foreign(what)) => what,
                None => "nothing",
            };
            assert_eq!(found, family, "{name}");
            // Readers of other families refuse it, but that points are in meshes and splats, too.
            let path = std::path::Path::new("file");
            let is_ply = Signature::of(&bytes) == Some(Signature::Ply);
            let vertices = matches!(point_cloud::sniff(&bytes), Some(CloudFormat::Vertices(_)));
            if family != "mesh" && !is_ply && !vertices {
                assert!(io::parse_mesh(&bytes, path).is_err(), "{name} as a mesh");
                assert_eq!(io::sniff(&bytes), None, "{name} as a mesh");
            }
            if family != "tensors" {
                assert!(tensors::TensorFile::parse(&bytes).is_err(), "{name} as tensors");
            }
            if family != "splats" {
                assert!(splats::parse_splats(&bytes).is_err(), "{name} as splats");
            }
            if matches!(family, "tensors" | "splats") && !is_ply {
                assert_eq!(point_cloud::sniff(&bytes), None, "{name} as points");
            }
        }
    }

    #[test]
    fn magic_numbers_come_before_sizes() {
        // Formats with a magic number, lengthened and with a count where binary STL has it, so that the size fits.
        for (family, name, mut bytes) in files().into_iter().filter(|(_, _, b)| Signature::of(b).is_some()) {
            if bytes.len() < 84 || family == "mesh" || bytes.starts_with(b"ply") {
                continue;
            }
            let triangles = (bytes.len() - 84).div_ceil(50);
            bytes.resize(84 + 50 * triangles, 0);
            bytes[80..84].copy_from_slice(&(triangles as u32).to_le_bytes());
            assert!(!matches!(sniff(&bytes), Some(Format::Mesh(_)) | None), "{name} of {family}");
            assert_eq!(io::sniff(&bytes), None, "{name} of {family}");
        }
    }

    #[test]
    fn packed_files_and_archives_are_named() {
        let ply = splats::samples::all().swap_remove(0).1;
        let zip = |names: &[&str]| {
            let entries: Vec<(&str, &[u8])> = names.iter().map(|&name| (name, &b"{}"[..])).collect();
            tensors::samples::zip_of(&entries)
        };
        for (bytes, said) in [
            (splats::samples::gzip(&ply), "gzip"),
            (zip(&["3D/3dmodel.model"]), "3MF"),
            (zip(&["scene.usdc"]), "USD"),
            (zip(&["model.weights.h5", "config.json"]), "Keras 3"),
            (zip(&["bunny.ply"]), "unpack it"),
        ] {
            match sniff(&bytes) {
                Some(Format::Foreign(what)) => assert!(what.contains(said), "{what}"),
                other => panic!("{other:?} instead of {said}"),
            }
        }
    }
}
