use std::path::Path;

use ndf_core::DVec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::shapes;
use crate::{Face, ManifoldMesh, ValidationReport};

fn parse(name: &str, bytes: &[u8]) -> Result<MeshFile, ReadError> {
    parse_mesh(bytes, Path::new(name))
}

fn read(name: &str, bytes: &[u8]) -> MeshFile {
    parse(name, bytes).unwrap_or_else(|e| panic!("{e}"))
}

fn refusal(name: &str, bytes: &[u8]) -> String {
    parse(name, bytes).map(|f| f.mesh).unwrap_err().to_string()
}

/// A folder of its own for every test.
fn folder(test: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("ndf-io-{test}-{}", std::process::id()));
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// A small file of every format and encoding.
fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let mesh = shapes::icosphere(0).map_positions(|p| p.as_vec3().as_dvec3());
    let written = |write: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = Vec::new();
        write(&mut bytes);
        bytes
    };
    let quality = VertexScalars { name: "quality".into(), values: (0..12).map(|v| v as f32).collect() };
    vec![
        ("a.obj", written(&|out| obj::write(out, &mesh).unwrap())),
        ("a.ply", written(&|out| ply::write(out, &mesh, std::slice::from_ref(&quality), false).unwrap())),
        ("a.stl", written(&|out| stl::write(out, &mesh).unwrap())),
        ("text.ply", TEXT_PLY.into()),
        ("text.stl", TEXT_STL.into()),
        ("text.off", TEXT_OFF.into()),
    ]
}

const TEXT_PLY: &str = "ply\nformat ascii 1.0\ncomment a square\nobj_info made by hand\nelement face 1\nproperty uchar red\n\
    property list uchar int vertex_index\nelement vertex 4\nproperty double z\nproperty float label\n\
    property float x\nproperty list uchar float weights\nproperty int y\nelement edge 1\nproperty int vertex1\n\
    property int vertex2\nend_header\n255 4 0 1 2 3\n0.5 -7 0 2 0.1 0.2 0\n.5 8 1 0 0\n5e-1 9 1. 0 1\n0.5 nan 0 1 3 1\n0 1";
const TEXT_STL: &str = "solid one\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 1 0\n  endloop\n \
    endfacet\nendsolid one\nsolid two\nfacet normal 0 0 1\nOUTER LOOP\nvertex 1 0 -0.0\nvertex 1 1 0\nvertex 0 1 0\nendloop\n\
    endfacet\nendsolid two\n";
const TEXT_OFF: &str = "# a square\nCOFF\n4 1 0 # counts\n\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1\n1 1 0\n0 1 0 # last\n4 0 1 2 3 0.5 0.5 0.5\n";

#[test]
fn round_trips_keep_vertices_faces_and_scalars() {
    let folder = folder("round-trip");
    let exact = shapes::trefoil_knot(60, 8, 0.2);
    let single = exact.map_positions(|p| p.as_vec3().as_dvec3());
    let values: Vec<f32> = (0..exact.vertex_count()).map(|v| v as f32 * 0.1).collect();
    let scalars = [
        VertexScalars { name: "distance".into(), values: values.clone() },
        VertexScalars { name: "mode_00".into(), values },
    ];
    for (name, truth) in [("a.ply", &single), ("a.obj", &exact)] {
        let path = folder.join(name);
        write_mesh(&path, &exact, &scalars).unwrap();
        let file = read_mesh(&path).unwrap();
        assert_eq!(&file.mesh, truth, "{name}");
        assert_eq!(file.scalars, if name == "a.ply" { scalars.to_vec() } else { vec![] });
        assert!(file.notes.is_empty());
    }
    let path = folder.join("a.STL");
    write_mesh(&path, &exact, &[]).unwrap();
    let file = read_mesh(&path).unwrap();
    assert_eq!(file.mesh.vertex_count(), exact.vertex_count());
    assert_eq!(file.mesh.corner_positions(Face(17)), single.corner_positions(Face(17)));
    assert!(ManifoldMesh::try_from(file.mesh).is_ok());
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 3, "no temporary files are left");
    std::fs::remove_dir_all(folder).unwrap();
}

/// Far from the origin, as georeferenced meshes are, every format keeps vertices to a millionth of the diagonal or says what
/// it did to them.
#[test]
fn rounding_is_told_and_avoided_where_it_can_be() {
    let folder = folder("far");
    let near = shapes::icosphere(2);
    let far = near.map_positions(|p| p + DVec3::new(500_000.25, 4_000_000.5, 100.0));
    let read = |name: &str| read_mesh(folder.join(name)).unwrap().mesh;
    for (name, mesh) in [("far.ply", &far), ("far.obj", &far), ("near.obj", &near)] {
        assert_eq!(write_mesh(folder.join(name), mesh, &[]).unwrap(), Rounding::default(), "{name}");
        assert_eq!(&read(name), mesh, "{name}");
    }
    let rounding = write_mesh(folder.join("near.ply"), &near, &[]).unwrap();
    assert!(rounding.moved > 0.0 && rounding.share < 1e-7);
    let header =
        |name: &str| String::from_utf8_lossy(&std::fs::read(folder.join(name)).unwrap()).into_owned();
    assert!(
        header("near.ply").contains("property float x") && header("far.ply").contains("property double x")
    );
    write_mesh_with(folder.join("double.ply"), &near, &[], Positions::Double).unwrap();
    assert_eq!(read("double.ply"), near);
    let rounding = write_mesh(folder.join("far.stl"), &far, &[]).unwrap();
    assert!(rounding.is_coarse() && rounding.moved > 0.01);
    let stl = read("far.stl");
    let errors = far
        .positions()
        .iter()
        .map(|p| stl.positions().iter().map(|q| q.distance(*p)).fold(f64::INFINITY, f64::min));
    assert!(errors.fold(0.0, f64::max) <= rounding.moved);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn what_cannot_be_written_leaves_nothing() {
    let folder = folder("refused");
    let mesh = shapes::icosphere(0);
    let scalar = |name: &str, n: usize| [VertexScalars { name: name.into(), values: vec![0.0; n] }];
    assert!(matches!(
        write_mesh(folder.join("a.gltf"), &mesh, &[]),
        Err(WriteError::UnknownExtension { .. })
    ));
    assert!(matches!(write_mesh(folder.join("a.off"), &mesh, &[]), Err(WriteError::UnknownExtension { .. })));
    assert!(matches!(
        write_mesh(folder.join("a.ply"), &mesh, &scalar("a", 3)),
        Err(WriteError::ScalarLength { .. })
    ));
    assert!(matches!(
        write_mesh(folder.join("a.ply"), &mesh, &scalar("a b", 12)),
        Err(WriteError::ScalarName { .. })
    ));
    let twice = [scalar("a", 12), scalar("a", 12)].concat();
    assert!(matches!(write_mesh(folder.join("a.ply"), &mesh, &twice), Err(WriteError::ScalarTwice { .. })));
    assert!(matches!(write_mesh(folder.join("none/a.ply"), &mesh, &[]), Err(WriteError::Io { .. })));
    let failed = atomic_write(folder.join("b"), |out| {
        out.write_all(b"half")?;
        Err(std::io::Error::other("stopped"))
    });
    assert!(failed.is_err());
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn text_ply_with_any_types_and_order() {
    let file = read("a", TEXT_PLY.as_bytes());
    assert_eq!(file.format, MeshFormat::Ply);
    assert_eq!(file.mesh.positions()[2], DVec3::new(1.0, 1.0, 0.5));
    assert_eq!(file.mesh.faces(), [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(file.scalars.len(), 1);
    assert_eq!(file.scalars[0].values[..3], [-7.0, 8.0, 9.0]);
    assert_eq!(file.notes.len(), 1);
    let carriage_returns = TEXT_PLY.replace('\n', "\r\n");
    assert_eq!(read("a", carriage_returns.as_bytes()).mesh, file.mesh);
}

#[test]
fn big_endian_ply_and_strips() {
    let mut bytes = b"ply\nformat binary_big_endian 1.0\ncomment by M\xfcller\nelement vertex 4\nproperty float x\nproperty float y\n\
        property double z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n"
        .to_vec();
    for p in [[0.0_f32, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
        p.iter().for_each(|x| bytes.extend(x.to_be_bytes()));
        bytes.extend(2.0_f64.to_be_bytes());
    }
    for i in [7_i32, 0, 1, 2, 3, -1, 2, 1] {
        bytes.extend(i.to_be_bytes());
    }
    let file = read("a", &bytes);
    assert_eq!(file.mesh.positions()[3], DVec3::new(1.0, 1.0, 2.0));
    assert_eq!(file.mesh.faces(), [[0, 1, 2], [2, 1, 3]]);
}

#[test]
fn obj_is_read_as_it_stands() {
    let text = "# seams, groups, polygons, negative indices, an unused vertex, a weight\nmtllib none.mtl\no first\n\
        v 9 9 9\nv 0 0 0 nan nan nan\nvt 0 0\nvn 0 0 1\nv 1 0 0 0.5 0.5 0.5\nv 2 2 0 2\nusemtl red\n\
        f 2/1/1 3/1/1 4//1\nvt 1 1\ng second\nv 0 1 0\nl 1 2 3\np 1\nf -4/2 -2/2 \\\n -1/2\nf 2 3 4 5 # twice\nf 2 3\n";
    let file = read("a", text.as_bytes());
    assert_eq!(file.format, MeshFormat::Obj);
    assert_eq!(file.mesh.vertex_count(), 5);
    assert_eq!(file.mesh.positions()[3], DVec3::new(1.0, 1.0, 0.0));
    assert_eq!(file.mesh.faces(), [[1, 2, 3], [1, 3, 4], [1, 2, 3], [1, 3, 4]]);
    assert_eq!(file.notes.len(), 2, "{:?}", file.notes);
    for n in 1..7 {
        let vertices: String = (0..n).map(|i| format!("v {i} 0 0\n")).collect();
        assert_eq!(read("a", vertices.as_bytes()).mesh.vertex_count(), n);
        assert_eq!(
            read("a", format!("{vertices}f 1 {n} 1\n").as_bytes()).mesh.faces(),
            [[0, n as u32 - 1, 0]]
        );
    }
}

#[test]
fn stl_and_off_variants() {
    let file = read("a", TEXT_STL.as_bytes());
    assert_eq!((file.format, file.mesh.faces()), (MeshFormat::Stl, &[[0, 1, 2], [1, 3, 2]][..]));
    let file = read("a", TEXT_OFF.as_bytes());
    assert_eq!((file.format, file.mesh.faces()), (MeshFormat::Off, &[[0, 1, 2], [0, 2, 3]][..]));
    assert_eq!(read("a", b"OFF3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2").mesh.face_count(), 1);

    let (_, mut bytes) = samples().swap_remove(2);
    bytes[..6].copy_from_slice(b"solid ");
    assert_eq!(read("a", &bytes).mesh.face_count(), 20, "a binary file that calls itself solid");
    bytes[80..84].copy_from_slice(&21_u32.to_le_bytes());
    assert!(refusal("a", &bytes).contains("announces 21 triangles but ends after 20"));
    bytes[80..84].copy_from_slice(&19_u32.to_le_bytes());
    let file = read("a", &bytes);
    assert_eq!((file.mesh.face_count(), file.notes.len()), (19, 1));
}

#[test]
fn empty_meshes_are_meshes_and_empty_files_are_not() {
    assert_eq!(read("a.obj", b"# nothing\n").mesh, TriangleMesh::default());
    assert_eq!(read("a", b"solid Empty\nendsolid Empty").mesh, TriangleMesh::default());
    let header = "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\n\
        element face 0\nproperty list uchar int vertex_indices\nend_header\n";
    assert_eq!(read("a", header.as_bytes()).mesh, TriangleMesh::default());
    assert!(refusal("a.obj", b"").ends_with("it is empty; OBJ, PLY, STL, OFF and glTF can be read"));
    assert!(refusal("a.txt", b"Dear reader,\n").contains("a.txt is not a mesh file"));
    assert!(
        refusal("a.obj", b"# a letter\nDear reader,\n").contains("no vertex, and line 2 is no OBJ statement")
    );
    assert!(refusal("a.obj", b"\0\x01\x02").contains("no known format"));
    assert!(matches!(read_mesh("/nowhere/a.obj"), Err(ReadError::Io { .. })));
}

#[test]
fn defects_are_named_with_their_place() {
    let head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let ply = |body: &str| refusal("a", format!("{head}{body}").as_bytes());
    let cases = [
        (refusal("a", b"v 0 0 0\nv 1 0\n"), "line 2: a vertex needs three numbers"),
        (refusal("a", b"v 0 0 0\n\nf 1 1 x\n"), "line 3: the indices of a face must be integers"),
        (
            refusal("a", b"v 0 0 0\nv 1 1 1\nf 1 2 2\nf 1 2 3\n"),
            "line 4: a face names vertex 3, but there are 2 vertices",
        ),
        (
            refusal("a", b"v 0 0 0\nf 1 1 -2\nv 1 1 1\n"),
            "line 2: a face names vertex -2, but there are 2 vertices",
        ),
        (refusal("a", b"v 0 0 0\nf 0 1 1\n"), "line 2: a face names vertex 0"),
        (refusal("a", b"v 0 0 0\nf 1 //1 1\n"), "line 2: the indices of a face must be integers"),
        (
            refusal("a", b"v 0 0 0\nvt 0 0\nf 9223372036854775807/9223372036854775807 1 1\n"),
            "line 3: a face names vertex 9",
        ),
        (ply("0 0 0 1 0 0 0 1 0"), "it ends within row 0 of the 1 of element face"),
        (ply("0 0 0 1 0 0 0 1 zero 3 0 1 2"), "row 2 of element vertex"),
        (ply("0 0 0 1 0 0 0 1 0 3 0 1 3"), "face 0 names vertex 3, but there are 3 vertices"),
        (ply("0 0 0 1 0 0 0 1 0 3 0 1 -5"), "row 0 of element face: -5 is not a vertex index"),
        (refusal("a", b"ply\nformat ascii 1.0\nelement vertex 1\n"), "the header ends without end_header"),
        (refusal("a", head.replace("float y", "half y").as_bytes()), "header: Unknown scalar type: half"),
        (
            refusal("a", format!("{}0 0 0 0 0 0 0 0 0 0 0 0 0", head.replace(" y", " v")).as_bytes()),
            "element vertex has no property y",
        ),
        (
            refusal("a", b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nendloop\n"),
            "line 5: a facet has 1 vertices",
        ),
        (refusal("a", b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"), "it ends before endsolid"),
        (refusal("a", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"), "line 6: a face names vertex 3"),
        (refusal("a", b"OFF\n3 1 0\n0 0 0\n1 0 0\n"), "it ends after 2 of 3 vertices"),
        (refusal("a", b"OFF\n3 one 0\n"), "line 2: the counts of vertices and faces"),
        (refusal("a", b"4OFF\n3 1 0\n"), "the variant 4OFF is not supported"),
    ];
    for (message, expected) in cases {
        assert!(message.contains(expected), "{message:?} does not say {expected:?}");
        assert!(!message.contains('\n'), "{message:?}");
    }
}

#[test]
fn lying_counts_are_refused_at_once() {
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for (vertices, faces) in
            [("18446744073709551615", "0"), ("4000000000", "0"), ("0", "9223372036854775807"), ("-1", "0")]
        {
            let file = format!(
                "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
                 element face {faces}\nproperty list uint int vertex_indices\nend_header\n\u{ff}\u{ff}\u{ff}\u{ff}"
            );
            refusal("a.ply", file.as_bytes());
        }
        let no_rows = format!("ply\nformat {format} 1.0\nelement nothing 18446744073709551615\nend_header\n");
        assert!(refusal("a.ply", no_rows.as_bytes()).contains("rows without properties"));
    }
    refusal("a.off", b"OFF\n4294967295 4294967295 0\n0 0 0\n");
    refusal("a.off", b"OFF\n1 1 0\n0 0 0\n4294967295 0 0\n");
}

#[test]
fn every_truncation_and_many_changes_are_survived() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for (name, bytes) in samples() {
        let whole = read(name, &bytes);
        for length in 0..bytes.len() {
            // Text may be cut in its last number and stay valid; a mesh is never larger than the whole.
            if let Ok(file) = parse(name, &bytes[..length]) {
                assert!(file.mesh.face_count() <= whole.mesh.face_count(), "{name} cut to {length}");
                let is_text = name == "a.obj" || name.starts_with("text");
                assert!(is_text, "{name} cut to {length} was accepted");
            }
        }
        for _ in 0..4000 {
            let mut changed = bytes.clone();
            for _ in 0..rng.random_range(1..6) {
                let at = rng.random_range(0..changed.len());
                changed[at] = match rng.random_range(0..3) {
                    0 => rng.random(),
                    1 => changed[at] ^ (1 << rng.random_range(0..8)),
                    _ => *b"0123456789-.e/# \n\\\0\xff".get(rng.random_range(0..20)).unwrap(),
                };
            }
            if let Ok(file) = parse(name, &changed) {
                assert!(file.mesh.vertex_count() <= bytes.len());
                let _ = ValidationReport::of(&file.mesh);
            } else if let Err(e) = parse(name, &changed) {
                let _ = e.to_string();
            }
        }
    }
}

/// Reads all meshes of the optional data folder (`NDF_DATA`, else `shared/data` beside the workspace).
#[test]
fn real_files_are_read() {
    let mut met = 0;
    for folder in ["mesh", "mesh_bad"] {
        let Some(path) = ndf_testing::data_path(folder) else { continue };
        let mut paths: Vec<PathBuf> = std::fs::read_dir(path).unwrap().map(|e| e.unwrap().path()).collect();
        paths.sort();
        for path in paths {
            let file = read_mesh(&path).unwrap_or_else(|e| panic!("{e}"));
            let report = ValidationReport::of(&file.mesh);
            eprintln!("{}: {report}", path.display());
            if folder == "mesh" {
                assert!(report.is_oriented_manifold() && report.is_closed(), "{}: {report}", path.display());
            }
            met += 1;
        }
    }
    eprintln!("{met} files");
}

/// Twelve triangles around a box of 1 × 2 × 3, the faces as OFF has them.
const BOX: [[f64; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 2.0, 0.0],
    [0.0, 2.0, 0.0],
    [0.0, 0.0, 3.0],
    [1.0, 0.0, 3.0],
    [1.0, 2.0, 3.0],
    [0.0, 2.0, 3.0],
];
const SIDES: [[u32; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

fn volume(mesh: &TriangleMesh) -> f64 {
    let of_face = |f: Face| {
        let [a, b, c] = mesh.corner_positions(f);
        a.cross(b).dot(c) / 6.0
    };
    mesh.face_indices().map(of_face).sum()
}

fn is_the_box(file: &MeshFile) {
    let mesh = ManifoldMesh::try_from(file.mesh.clone()).unwrap();
    assert_eq!((mesh.vertex_count(), mesh.face_count()), (8, 12));
    assert!((volume(&mesh) - 6.0).abs() < 1e-12 && ValidationReport::of(&mesh).is_closed());
}

#[test]
fn off_is_read_in_all_its_ways() {
    let rows = |row: &dyn Fn(&[f64; 3]) -> String, end: &str| -> String {
        let vertices: String = BOX.iter().map(|p| row(p) + "\n").collect();
        let faces: String = SIDES.iter().map(|[a, b, c, d]| format!("4 {a} {b} {c} {d}{end}\n")).collect();
        vertices + &faces
    };
    let plain = |p: &[f64; 3]| format!("{} {} {}", p[0], p[1], p[2]);
    let body = rows(&plain, "");
    for text in [
        format!("OFF\n8 6 0\n{body}"),
        format!("off\n8 6 0\n{body}"),
        format!("{}OFF\r8 6 0\r\n{body}", "# said first\n".repeat(1000)),
        format!("coff\n8 6 0\n{}", rows(&|p| plain(p) + " 1 0 0 1", " 255 0 0")),
        format!("8 6 0\n{body}"),
        format!("\u{feff}OFF 8 6 12\n{body}"),
        format!("# a box\n8 6 0\n\n{body}"),
        format!("OFF 8 6 0 {}", body.replace('\n', " ")),
        format!("OFF\n8\n6\n0\n{}", body.replace(' ', "\n")),
        format!("COFF\n8 6 0\n{}", rows(&|p| plain(p) + " 1 0 0 1", " 255 0 0")),
        format!("NCOFF\n8 6 0\n{}", rows(&|p| plain(p) + " 0 0 1 1 0 0 1", "").replace('\n', "  ")),
    ] {
        let file = read("a", text.as_bytes());
        assert_eq!(file.format, MeshFormat::Off, "{text}");
        is_the_box(&file);
    }
    let mut binary = b"OFF BINARY\n".to_vec();
    binary.extend([8, 6, 0_u32].map(u32::to_be_bytes).concat());
    binary.extend(BOX.concat().iter().flat_map(|&x| (x as f32).to_be_bytes()));
    for side in SIDES {
        binary.extend([[4].as_slice(), &side, &[1, 0]].concat().iter().flat_map(|&x: &u32| x.to_be_bytes()));
    }
    is_the_box(&read("a", &binary));
    assert!(refusal("a", &binary[..binary.len() - 4]).contains("it ends after 5 of 6 faces"));
    // Points: counts that no face follows are counts of a cloud.
    let cloud = format!(
        "NOFF\n8 0 0\n{}",
        rows(&|p| plain(p) + " 0 0 2", "").lines().take(8).collect::<Vec<_>>().join("\n")
    );
    let file = read("a", cloud.as_bytes());
    assert_eq!((file.mesh.vertex_count(), file.scalars.len(), file.scalars[2].values[7]), (8, 3, 2.0));
    assert!(!has_faces(cloud.as_bytes(), MeshFormat::Off));
    assert_eq!(sniff(b"8 6 0\n1 2 3\n4 5 6\n"), None);
}

#[test]
fn stl_is_read_in_all_its_ways() {
    let mesh = read(
        "a",
        format!("OFF\n8 6 0\n{}", {
            let vertices: String = BOX.iter().map(|p| format!("{} {} {}\n", p[0], p[1], p[2])).collect();
            vertices + &SIDES.iter().map(|[a, b, c, d]| format!("4 {a} {b} {c} {d}\n")).collect::<String>()
        })
        .as_bytes(),
    )
    .mesh;
    let corner = |p: DVec3| format!("vertex {} {} {}\n", p.x, p.y, p.z);
    let facets: String = mesh
        .face_indices()
        .map(|f| {
            let corners: String = mesh.corner_positions(f).into_iter().map(corner).collect();
            format!("facet normal 0 nan 1\nouter loop\n{corners}endloop\nendfacet\n")
        })
        .collect();
    let text = format!("solid a facet of vertex a\n{facets}endsolid a facet of vertex a\n");
    for text in [
        text.clone(),
        format!("\u{feff}{text}"),
        text.replace("endsolid", "end solid"),
        format!("solid box {facets} endsolid box").replace('\n', " "),
        format!("solid {facets} end solid").replace('\n', "\t"),
        format!("SOLID\n{}ENDSOLID", facets.to_uppercase()),
    ] {
        let file = read("a", text.as_bytes());
        assert_eq!(file.format, MeshFormat::Stl);
        is_the_box(&file);
    }
    assert!(refusal("a", &text.as_bytes()[..text.len() - 29]).contains("cut off"));
    let mut binary = Vec::new();
    stl::write(&mut binary, &mesh).unwrap();
    for unknown in [0, u32::MAX] {
        binary[80..84].copy_from_slice(&unknown.to_le_bytes());
        let file = read("a", &binary);
        is_the_box(&file);
        assert_eq!(file.notes, [ReadNote::CountBySize { announced: unknown, triangles: 12 }]);
    }
    binary[80..84].copy_from_slice(&1_000_000_u32.to_le_bytes());
    assert!(refusal("a", &binary).contains("announces 1000000 triangles but ends after 12"));
}

#[test]
fn points_of_obj_have_their_normals() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    let cloud = format!("\u{feff}{vertices}{}", "vn 0 0 2\n".repeat(4));
    let file = read("a", cloud.as_bytes());
    assert_eq!((file.mesh.vertex_count(), file.scalars.len()), (4, 3));
    assert_eq!((file.scalars[2].name.as_str(), &file.scalars[2].values[..]), ("nz", &[2.0; 4][..]));
    assert!(!has_faces(cloud.as_bytes(), MeshFormat::Obj));
    for other in ["vn 0 0 1\n".to_owned(), "vn 0 0 1\n".repeat(4) + "f 1 2 3\n"] {
        assert!(read("a", (vertices.to_owned() + &other).as_bytes()).scalars.is_empty());
    }
}

/// A prism over an outline in the plane z = 0, moved into the plane of two vectors.
fn prism(outline: &[[f64; 2]], to: impl Fn(f64, f64, f64) -> DVec3) -> String {
    let n = outline.len();
    let mut text = String::new();
    for height in [0.0, 1.0] {
        for &[x, y] in outline {
            let p = to(x, y, height);
            text += &format!("v {} {} {}\n", p.x, p.y, p.z);
        }
    }
    let face = |corners: &mut dyn Iterator<Item = usize>| -> String {
        "f".to_owned() + &corners.map(|v| format!(" {}", v + 1)).collect::<String>() + "\n"
    };
    text += &face(&mut (0..n).rev());
    text += &face(&mut (n..2 * n));
    for i in 0..n {
        let j = (i + 1) % n;
        text += &face(&mut [i, j, n + j, n + i].into_iter());
    }
    text
}

#[test]
fn polygons_are_cut_within_their_outlines() {
    let star: Vec<[f64; 2]> = (0..40)
        .map(|i| {
            let (s, c) = (0.15 * f64::from(i) * std::f64::consts::PI / 3.0 + 0.05).sin_cos();
            let r = if i % 2 == 0 { 2.0 } else { 0.7 };
            [r * c, r * s]
        })
        .collect();
    // An L whose first corner sees all but not the notch, and one with corners in a line.
    let l = vec![[3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 4.0], [0.0, 4.0], [0.0, 0.0]];
    let lined =
        vec![[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0], [0.0, 1.0]];
    let area = |outline: &[[f64; 2]]| {
        let next = outline.iter().cycle().skip(1);
        0.5 * outline.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()
    };
    let length = |outline: &[[f64; 2]]| {
        let next = outline.iter().cycle().skip(1);
        outline.iter().zip(next).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).sum::<f64>()
    };
    let (u, v) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.48, 0.8, -0.36));
    for outline in [star, l, lined] {
        for turn in 0..outline.len() {
            let mut outline = outline.clone();
            outline.rotate_left(turn);
            let text = prism(&outline, |x, y, z| 1e3 * DVec3::ONE + x * u + y * v + z * u.cross(v));
            let file = read("a.obj", text.as_bytes());
            let n = outline.len();
            assert_eq!(file.mesh.face_count(), 2 * (n - 2) + 2 * n);
            let mesh = ManifoldMesh::try_from(file.mesh).unwrap();
            assert!(ValidationReport::of(&mesh).is_closed());
            assert!((mesh.area() - 2.0 * area(&outline) - length(&outline)).abs() < 1e-9, "{}", mesh.area());
            assert!((volume(&mesh) - area(&outline)).abs() < 1e-5);
        }
    }
}

#[test]
fn holes_on_bridges_stay_holes() {
    // A square of 4 around one of 2, the bridge from corner 0 to corner 4 and back.
    let text =
        "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\nv 3 3 0\nv 3 1 0\nf 1 2 3 4 1 5 6 7 8 5\n";
    let file = read("a", text.as_bytes());
    assert!((file.mesh.area() - 12.0).abs() < 1e-12);
    let report = ValidationReport::of(&file.mesh);
    assert_eq!((file.mesh.face_count(), report.is_oriented_manifold()), (8, true));
    assert_eq!(file.notes[1], ReadNote::PolygonsNotConvex { faces: 1 });
}

#[test]
fn what_no_cut_can_flatten_is_said() {
    let notes = |text: &str| read("a", text.as_bytes()).notes;
    // A bow tie, a quadrilateral that is bent, and one without area.
    let bow = notes("v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 1 0\nf 1 2 3 4\n");
    assert!(bow.contains(&ReadNote::PolygonsCrossed { faces: 1 }), "{bow:?}");
    let bent = notes("v 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 0\nf 1 2 3 4\n");
    assert!(bent.contains(&ReadNote::PolygonsNotFlat { faces: 1 }), "{bent:?}");
    for degenerate in [
        "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nf 1 2 3 4\n",
        "v 0 0 0\nf 1 1 1 1\n",
        "v nan 0 0\nv 1e300 0 0\nf 1 2 1 2\n",
    ] {
        assert_eq!(notes(degenerate).len(), 1);
    }
    // A triangle that names a corner twice is one triangle.
    let file = read("a", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 3\n");
    assert_eq!(file.mesh.face_count(), 1);
}

#[test]
fn rows_of_ply_end_with_their_lines() {
    let header = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        element face 2\nproperty list uchar int vertex_indices\nproperty uchar red\nend_header\n";
    let vertices = "0 0 0\n1 0 0\n1 1 0\n\n0 1 0 7\n";
    let file = read("a", format!("{header}{vertices}3 0 1 2 9 1 1 1 1\n3 0 2 3 9 1 1\n").as_bytes());
    assert_eq!(file.mesh.faces(), [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(file.notes, [ReadNote::LongRows { rows: 3 }]);
    // Rows over several lines, and rows as announced, are none of these.
    let spread = read("a", format!("{header}0 0\n0 1 0 0 1 1 0 0 1 0 3 0\n1 2 9 3 0 2 3 9\n").as_bytes());
    assert_eq!((spread.mesh.face_count(), spread.notes.len()), (2, 0));
}

#[test]
fn any_names_become_different_ones_of_ply() {
    let names = ["heat", "heat flow", "heat_flow", "Höhe", "", "x", "x_", "heat\n"];
    let found = property_names(&names);
    let expected = ["heat", "heat_flow", "heat_flow_2", "H_he", "_", "x_", "x__2", "heat_"];
    assert_eq!(found, expected);
    let mesh = shapes::icosphere(0);
    let scalars: Vec<VertexScalars> = found
        .into_iter()
        .map(|name| VertexScalars { name, values: vec![0.0; mesh.vertex_count()] })
        .collect();
    assert!(to_ply(&mesh, &scalars, Positions::Exact).is_ok());
}
