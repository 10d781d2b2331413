use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use ndf_core::DVec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use super::super::{MeshFile, MeshFormat, ReadNote, VertexScalars, parse_mesh, read_mesh, write_mesh};
use super::{Document, GlbOptions, NotGlb, container, to_glb};
use crate::{ManifoldMesh, TriangleMesh, ValidationReport, shapes};

fn single(mesh: &TriangleMesh) -> TriangleMesh {
    mesh.map_positions(|p| p.as_vec3().as_dvec3())
}

fn scalar(name: &str, values: impl IntoIterator<Item = f32>) -> VertexScalars {
    VertexScalars { name: name.to_owned(), values: values.into_iter().collect() }
}

fn parsed(bytes: &[u8]) -> MeshFile {
    parse_mesh(bytes, Path::new("a.glb")).unwrap_or_else(|e| panic!("{e}"))
}

fn refusal(bytes: &[u8]) -> String {
    parse_mesh(bytes, Path::new("a.glb")).map(|file| file.mesh).unwrap_err().to_string()
}

/// The JSON of a file.
fn document(glb: &[u8]) -> Value {
    serde_json::from_slice(container::chunks(glb).unwrap().0).unwrap()
}

/// A file of this JSON and buffer.
fn glb(json: &Value, buffer: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    container::write(&mut bytes, json.to_string().as_bytes(), buffer.len(), |out| out.write_all(buffer))
        .unwrap();
    bytes
}

/// What is written is read again: places to single precision, faces, scalars by their names, in order.
#[test]
fn meshes_come_back() {
    let meshes = [
        shapes::icosphere(2),
        shapes::trefoil_knot(60, 8, 0.2),
        shapes::grid(7, 5),
        shapes::moebius_strip(30, 3),
        // More vertices than 16 bits name.
        shapes::torus(300, 220, 1.0, 0.4),
    ];
    for mesh in meshes {
        let n = mesh.vertex_count();
        let values = |k: f32| (0..n).map(move |v| k * v as f32 - 1.0);
        let scalars = [
            scalar("zebra", values(0.1)),
            scalar("mode_00", values(-0.3)),
            scalar("Höhe/m", values(0.5)),
            scalar("HÖHE_M", values(0.7)),
        ];
        let file = parsed(&to_glb(&mesh, &scalars, &GlbOptions::default()).unwrap());
        assert_eq!((&file.mesh, &file.scalars[..]), (&single(&mesh), &scalars[..]));
        assert_eq!((file.format, file.notes), (MeshFormat::Glb, vec![]));
    }
}

/// Vertices in one place stay apart where the mesh is closed, because the file says how its faces meet. Where it is open they
/// are taken for a seam.
#[test]
fn manifolds_are_kept_and_seams_are_joined() {
    let ball = shapes::icosphere(1);
    let moved = ball.map_positions(|p| p + DVec3::new(2.0, 0.0, 0.0));
    let n = ball.vertex_count() as u32;
    let both = |faces: &[[u32; 3]]| {
        let positions = [ball.positions(), moved.positions()].concat();
        let faces = faces.iter().copied().chain(moved.faces().iter().map(|face| face.map(|v| v + n)));
        single(&TriangleMesh::new(positions, faces.collect()).unwrap())
    };
    let touching = both(ball.faces());
    let used = |mesh: &TriangleMesh| {
        document(&to_glb(mesh, &[], &GlbOptions::default()).unwrap())["extensionsUsed"].clone()
    };
    assert_eq!(used(&touching), json!(["EXT_mesh_manifold"]));
    let file = parsed(&to_glb(&touching, &[], &GlbOptions::default()).unwrap());
    assert_eq!(file.mesh, touching);
    assert_eq!(ValidationReport::of(&file.mesh).components, 2);
    let open = both(&ball.faces()[1..]);
    assert_eq!(used(&open), Value::Null);
    let file = parsed(&to_glb(&open, &[], &GlbOptions::default()).unwrap());
    assert_eq!(file.mesh.face_count(), open.face_count());
    let joined = open.vertex_count() - file.mesh.vertex_count();
    assert!(joined > 0);
    assert_eq!(file.notes, [ReadNote::SeamsJoined { vertices: joined }]);
}

/// Triangles with corners of their own, as flat shading has them, are sewn.
#[test]
fn flat_shading_is_sewn() {
    let cube = shapes::cube(3);
    let positions = cube.face_indices().flat_map(|f| cube.corner_positions(f)).collect();
    let faces = (0..cube.face_count() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
    let soup = TriangleMesh::new(positions, faces).unwrap();
    let height: Vec<f32> = soup.positions().iter().map(|p| p.z as f32).collect();
    let file = parsed(&to_glb(&soup, &[scalar("height", height)], &GlbOptions::default()).unwrap());
    let mesh = ManifoldMesh::try_from(file.mesh).unwrap();
    assert_eq!((mesh.vertex_count(), mesh.face_count()), (cube.vertex_count(), cube.face_count()));
    assert!(ValidationReport::of(&mesh).is_closed());
    assert!(mesh.positions().iter().zip(&file.scalars[0].values).all(|(p, &z)| p.z as f32 == z));
}

#[test]
fn places_far_from_the_origin_are_kept() {
    let near = shapes::icosphere(3);
    let far = near.map_positions(|p| p + DVec3::new(500_000.25, 4_000_000.5, 100.0));
    let bytes = to_glb(&far, &[], &GlbOptions::default()).unwrap();
    assert!(document(&bytes)["nodes"][0]["translation"].is_array());
    let read = parsed(&bytes).mesh;
    let moved = far.positions().iter().zip(read.positions()).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    assert!(moved < 1e-6, "{moved}");
    let path = std::env::temp_dir().join(format!("ndf-far-{}.glb", std::process::id()));
    let rounding = write_mesh(&path, &far, &[]).unwrap();
    assert!(rounding.moved <= 1e-6 && !rounding.is_coarse(), "{rounding:?}");
    assert_eq!(read_mesh(&path).unwrap().mesh, read);
    std::fs::remove_file(path).unwrap();
}

#[test]
fn values_that_are_not_finite_come_back() {
    let mesh = shapes::grid(1, 1);
    let values = scalar("distance", [0.5, f32::INFINITY, f32::NAN, -2.0]);
    let bytes = to_glb(&mesh, &[values], &GlbOptions::default()).unwrap();
    let read = &parsed(&bytes).scalars[0];
    assert_eq!((read.name.as_str(), read.values[0], read.values[3]), ("distance", 0.5, -2.0));
    assert!(read.values[1] == f32::INFINITY && read.values[2].is_nan());
    let buffer = container::chunks(&bytes).unwrap().1;
    let last = buffer.last_chunk::<16>().unwrap().as_chunks::<4>().0.iter().map(|&b| f32::from_le_bytes(b));
    assert_eq!(last.collect::<Vec<f32>>(), [0.5, 3.0, -4.5, -2.0], "glTF has no other numbers");
}

#[test]
fn what_glb_cannot_hold_is_said() {
    let mesh = shapes::grid(1, 1);
    let options = GlbOptions::default();
    let short = to_glb(&mesh, &[scalar("a", [1.0])], &options);
    assert_eq!(short, Err(NotGlb::ScalarLength { name: "a".to_owned(), values: 1, vertices: 4 }));
    for odd in [f64::NAN, f64::INFINITY, 1e300] {
        let mut positions = mesh.positions().to_vec();
        positions[2].y = odd;
        let mesh = TriangleMesh::new(positions, mesh.faces().to_vec()).unwrap();
        assert_eq!(to_glb(&mesh, &[], &options), Err(NotGlb::NotFinite { vertex: 2 }));
    }
    let points = TriangleMesh::new(mesh.positions().to_vec(), vec![]).unwrap();
    let points = to_glb(&points, &[], &options).unwrap();
    assert_eq!(document(&points)["meshes"][0]["primitives"][0]["mode"], 0);
    assert!(refusal(&points).contains("points or lines, but no triangles"));
    assert!(refusal(&to_glb(&TriangleMesh::default(), &[], &options).unwrap()).contains("no triangles"));
}

/// The colour of a scalar, and none where there is none or it is not wanted.
#[test]
fn one_scalar_colours_the_surface() {
    let mesh = shapes::grid(2, 2);
    let scalars = [scalar("a", (0..9).map(|v| v as f32)), scalar("b", [1.0; 9])];
    let coloured = |coloured_by| to_glb(&mesh, &scalars, &GlbOptions { coloured_by }).unwrap();
    let colour =
        |bytes: &[u8]| document(bytes)["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"].as_u64();
    assert_eq!((colour(&coloured(None)), colour(&coloured(Some(2)))), (None, None));
    let bytes = coloured(Some(0));
    let (document, buffer) = (document(&bytes), container::chunks(&bytes).unwrap().1);
    let accessor = &document["accessors"][colour(&bytes).unwrap() as usize];
    let view = &document["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let from = view["byteOffset"].as_u64().unwrap() as usize;
    let map = crate::ColourMap::of(&scalars[0].values);
    for v in [0, 4, 8] {
        let written: Vec<u16> =
            buffer[from + 8 * v..][..8].as_chunks::<2>().0.iter().map(|&b| u16::from_le_bytes(b)).collect();
        let expected = map.colour(v as f64);
        assert!((0..3).all(|k| (f32::from(written[k]) / 65535.0 - expected[k]).abs() < 1e-5));
        assert_eq!(written[3], u16::MAX);
    }
}

/// Corners and faces of a cube from −1 to 1 as a document of JSON with its buffer.
fn cube() -> (Value, Vec<u8>) {
    let corners: Vec<[f32; 3]> =
        (0..8_u8).map(|i| [0, 1, 2].map(|k| if i >> k & 1 == 1 { 1.0 } else { -1.0 })).collect();
    let faces: [[u8; 3]; 12] = [
        [0, 2, 3],
        [0, 3, 1],
        [4, 5, 7],
        [4, 7, 6],
        [0, 1, 5],
        [0, 5, 4],
        [2, 6, 7],
        [2, 7, 3],
        [0, 4, 6],
        [0, 6, 2],
        [1, 3, 7],
        [1, 7, 5],
    ];
    let mut buffer: Vec<u8> = corners.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    buffer.extend(faces.iter().flatten());
    let json = json!({
        "asset": { "version": "2.0" },
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5121, "count": 36, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": 96 },
            { "buffer": 0, "byteOffset": 96, "byteLength": 36 },
        ],
        "buffers": [{ "byteLength": 132 }],
    });
    (json, buffer)
}

/// The cube with other nodes.
fn cube_of(nodes: Value) -> Vec<u8> {
    let (mut json, buffer) = cube();
    json["nodes"] = nodes;
    glb(&json, &buffer)
}

fn is_closed(mesh: &TriangleMesh) -> bool {
    let report = ValidationReport::of(mesh);
    report.is_closed() && report.is_oriented_manifold()
}

#[test]
fn nodes_move_turn_stretch_and_mirror() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let cases = [
        (json!([{ "mesh": 0 }]), DVec3::ZERO, DVec3::splat(2.0)),
        // A parent after its child: twice as long in x, then a quarter turn about z, then moved.
        (
            json!([{ "mesh": 0, "scale": [2, 1, 1] },
                { "children": [0], "rotation": [0, 0, half, half], "translation": [5, 6, 7] }]),
            DVec3::new(5.0, 6.0, 7.0),
            DVec3::new(2.0, 4.0, 2.0),
        ),
        (
            json!([{ "mesh": 0, "matrix": [-3, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 1] }]),
            DVec3::X,
            DVec3::new(6.0, 2.0, 2.0),
        ),
    ];
    for (nodes, center, extent) in cases {
        let mesh = parsed(&cube_of(nodes)).mesh;
        let bounds = mesh.bounds();
        assert!(
            bounds.center().distance(center) < 1e-12 && bounds.extent().distance(extent) < 1e-12,
            "{bounds:?}"
        );
        let volume = extent.x * extent.y * extent.z;
        assert!((mesh.signed_volume() - volume).abs() < 1e-9 && is_closed(&mesh), "{}", mesh.signed_volume());
    }
    // Two cubes that touch are two.
    let two = parsed(&cube_of(json!([{ "mesh": 0 }, { "mesh": 0, "translation": [2, 0, 0] }]))).mesh;
    assert_eq!((two.vertex_count(), ValidationReport::of(&two).components), (16, 2));
}

/// A strip, a fan, a list without indices, quantised places and sparse ones: the same square.
#[test]
fn squares_of_all_kinds() {
    let (mut template, _) = cube();
    let corners: [[i8; 3]; 4] = [[0, 0, 0], [127, 0, 0], [0, 127, 0], [127, 127, 0]];
    let mut buffer: Vec<u8> = corners.iter().flat_map(|p| p.map(i8::cast_unsigned)).chain([0; 4]).collect();
    buffer.extend([0, 1, 2, 3, 0, 1, 3, 2, 2_u8]);
    buffer.extend([0; 3]);
    buffer.extend([1_f32, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0].iter().flat_map(|x| x.to_le_bytes()));
    template["bufferViews"] = json!([{ "buffer": 0 }]);
    template["buffers"] = json!([{ "byteLength": buffer.len() }]);
    let bytes =
        json!({ "bufferView": 0, "componentType": 5120, "normalized": true, "count": 4, "type": "VEC3" });
    let index = |from: usize, count: usize| json!({ "bufferView": 0, "byteOffset": 16 + from, "componentType": 5121, "count": count, "type": "SCALAR" });
    // Zeros but for corners 3, 2 and 1.
    let sparse = json!({ "componentType": 5126, "count": 4, "type": "VEC3", "sparse": {
        "count": 3,
        "indices": { "bufferView": 0, "byteOffset": 16, "componentType": 5121 },
        "values": { "bufferView": 0, "byteOffset": 28 },
    } });
    let area = |mode: u32, position: &Value, indices: Option<Value>| {
        let mut json = template.clone();
        let primitive = &mut json["meshes"][0]["primitives"][0];
        primitive["mode"] = mode.into();
        if indices.is_none() {
            primitive.as_object_mut().unwrap().remove("indices");
        }
        json["accessors"] = json!([position, indices.unwrap_or_else(|| index(0, 4))]);
        let file = parsed(&glb(&json, &buffer));
        let up = file.mesh.face_indices().all(|f| file.mesh.face_normal(f).z > 0.0);
        (file.mesh.face_count(), file.mesh.area(), up)
    };
    assert_eq!(area(5, &bytes, Some(index(0, 4))), (2, 1.0, true));
    assert_eq!(area(5, &bytes, None), (2, 1.0, true));
    assert_eq!(area(6, &bytes, Some(index(4, 4))), (2, 1.0, true));
    // Corners that repeat are no triangles of a strip.
    assert_eq!(area(5, &bytes, Some(index(4, 5))).0, 2);
    let mut turned = sparse.clone();
    turned["sparse"]["indices"]["byteOffset"] = 17.into();
    let (faces, found, _) = area(5, &turned, None);
    assert_eq!((faces, found), (2, 1.0));
}

#[test]
fn buffers_lie_in_text_and_beside() {
    let (mut json, buffer) = cube();
    json["buffers"][0]["uri"] =
        format!("data:application/octet-stream;base64,{}", STANDARD.encode(&buffer)).into();
    let file = parse_mesh(json.to_string().as_bytes(), Path::new("a.gltf")).unwrap();
    assert_eq!((file.format, file.mesh.face_count()), (MeshFormat::Gltf, 12));
    assert!((file.mesh.signed_volume() - 8.0).abs() < 1e-12);
    let folder = std::env::temp_dir().join(format!("ndf-gltf-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("the buffer.bin"), &buffer).unwrap();
    json["buffers"][0]["uri"] = "the%20buffer.bin".into();
    std::fs::write(folder.join("a.gltf"), format!("\u{feff} {json}")).unwrap();
    assert!((read_mesh(folder.join("a.gltf")).unwrap().mesh.signed_volume() - 8.0).abs() < 1e-12);
    for (uri, said) in [
        ("none.bin", "cannot be read"),
        ("..", "not a file beside it"),
        ("../a.bin", "not a file beside it"),
        ("/etc/passwd", "not a file beside it"),
        ("https://example.org/a.bin", "not a file beside it"),
        ("data:,a", "Base64"),
        ("data:;base64,&", "Base64"),
        ("data:;base64,AAAA", "announces 132 bytes and has 3"),
    ] {
        json["buffers"][0]["uri"] = uri.into();
        std::fs::write(folder.join("a.gltf"), json.to_string()).unwrap();
        let message = read_mesh(folder.join("a.gltf")).unwrap_err().to_string();
        assert!(message.contains(said), "{message}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn skins_and_lines_are_told() {
    let (mut json, buffer) = cube();
    json["nodes"] = json!([{ "mesh": 0, "skin": 0, "translation": [9, 0, 0] }]);
    json["meshes"][0]["primitives"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "attributes": { "POSITION": 0 }, "mode": 1 }));
    let file = parsed(&glb(&json, &buffer));
    assert_eq!(file.notes, [ReadNote::PartsLeftOut { parts: 1 }, ReadNote::BasePose { meshes: 1 }]);
    assert_eq!(file.mesh.bounds().center(), DVec3::ZERO);
}

/// Two parts with a scalar each: it is NaN on the other.
#[test]
fn scalars_of_parts() {
    let (mut json, buffer) = cube();
    json["accessors"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "bufferView": 1, "componentType": 5121, "count": 8, "type": "SCALAR" }));
    let with = |name: &str| json!({ "primitives": [{ "attributes": { "POSITION": 0, name: 2, "_VECTOR": 0 }, "indices": 1 }] });
    json["meshes"] = json!([with("_FIRST"), with("_Second")]);
    json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 1, "translation": [5, 0, 0] }]);
    let file = parsed(&glb(&json, &buffer));
    let names: Vec<&str> = file.scalars.iter().map(|s| s.name.as_str()).collect();
    assert_eq!((names, file.mesh.vertex_count()), (vec!["first", "second"], 16));
    for (scalar, has) in file.scalars.iter().zip([0..8, 8..16]) {
        assert!((0..16).all(|v| scalar.values[v].is_nan() != has.contains(&v)));
        assert_eq!(scalar.values[has][..3], [0.0, 2.0, 3.0]);
    }
}

#[test]
fn defects_are_named() {
    let (json, buffer) = cube();
    let changed = |change: &dyn Fn(&mut Value)| {
        let mut json = json.clone();
        change(&mut json);
        refusal(&glb(&json, &buffer))
    };
    let set = |pointer: &'static str, value: Value| {
        changed(&move |json: &mut Value| *json.pointer_mut(pointer).unwrap() = value.clone())
    };
    let requires =
        |name: &'static str| changed(&move |json: &mut Value| json["extensionsRequired"] = json!([name]));
    let nodes = |nodes: Value| refusal(&cube_of(nodes));
    let whole = glb(&json, &buffer);
    let patched = |at: usize, byte: u8| {
        let mut bytes = whole.clone();
        bytes[at] = byte;
        refusal(&bytes)
    };
    let mut not_a_number = buffer.clone();
    not_a_number[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let cases = [
        (requires("KHR_draco_mesh_compression"), "packed by KHR_draco_mesh_compression"),
        (requires("EXT_meshopt_compression"), "gltf-transform"),
        (requires("EXT_mesh_gpu_instancing"), "requires the extension EXT_mesh_gpu_instancing"),
        (nodes(json!([{ "mesh": 0, "children": [1] }, { "children": [0] }])), "child of itself"),
        (nodes(json!([{ "mesh": 0, "children": [0] }])), "child of itself"),
        (nodes(json!([{ "mesh": 0, "children": [7] }])), "node 7, which is not there"),
        (nodes(json!([{ "children": [1, 1] }, { "mesh": 0 }])), "two others"),
        (nodes(json!([{ "mesh": 3 }])), "mesh 3, which is not there"),
        (
            nodes(
                json!([{ "mesh": 0, "scale": [1e300, 1e300, 1e300], "children": [] , "translation": [1e308, 1e308, 1e308]}, { "children": [0], "scale": [1e300, 1, 1] }]),
            ),
            "not finite",
        ),
        (refusal(&glb(&json, &not_a_number)), "the place of a vertex is not finite"),
        (set("/accessors/0/count", json!(9)), "POSITION reaches beyond its buffer"),
        (set("/accessors/0/count", json!(u64::MAX)), "too many"),
        (set("/accessors/0/count", json!(-1)), "JSON"),
        (set("/accessors/0/bufferView", json!(5)), "buffer view 5, which is not there"),
        (set("/accessors/0/type", json!("VEC2")), "shape VEC2"),
        (set("/accessors/0/componentType", json!(1)), "unknown kind 1"),
        (set("/accessors/1/componentType", json!(5120)), "not unsigned integers"),
        (set("/accessors/1/count", json!(35)), "35 corners are no triangles"),
        (set("/bufferViews/1/byteOffset", json!(u64::MAX)), "beyond its buffer"),
        (set("/bufferViews/1/byteLength", json!(7)), "beyond its buffer"),
        (set("/bufferViews/1/buffer", json!(7)), "beyond its buffer"),
        (set("/bufferViews/0", json!({ "buffer": 0, "byteStride": 4 })), "overlap"),
        (set("/buffers/0/byteLength", json!(1000)), "announces 1000 bytes and has 132"),
        (set("/meshes/0/primitives/0/indices", json!(9)), "accessor 9, which is not there"),
        (changed(&|json| json["meshes"][0]["primitives"][0]["mode"] = 3.into()), "no triangles"),
        (
            set("/accessors/0", json!({ "componentType": 5126, "count": 1_u64 << 40, "type": "VEC3" })),
            "too many",
        ),
        (set("/asset/version", json!("1.0")), "version 1.0 of glTF is not read"),
        (set("/nodes", json!({})), "JSON"),
        (patched(100, 0), "JSON"),
        (patched(4, 1), "version 1 of binary glTF"),
        (patched(16, b'X'), "first chunk is not JSON"),
        (patched(15, 0x7f), "cut off"),
        (refusal(b"glTF"), "cut off"),
        (refusal(br#"{"asset":{"version":"1.0"},"meshes":{"a":{}}}"#), "version 1.0"),
    ];
    for (message, said) in cases {
        assert!(message.contains(said), "{message:?} does not say {said:?}");
        assert!(!message.contains('\n'), "{message:?}");
    }
    // One letter is a group of OBJ.
    for end in 2..whole.len() {
        assert!(parse_mesh(&whole[..end], Path::new("a.glb")).is_err(), "cut to {end}");
    }
    // A corner that is not there must not be that of another part.
    let mut two = json.clone();
    let mut primitives = vec![two["meshes"][0]["primitives"][0].clone(); 2];
    primitives[1]["attributes"]["_A"] = 2.into();
    two["meshes"][0]["primitives"] = primitives.into();
    let accessors = two["accessors"].as_array_mut().unwrap();
    accessors.push(json!({ "bufferView": 1, "componentType": 5121, "count": 8, "type": "SCALAR" }));
    let mut bad = buffer.clone();
    bad[96] = 8;
    assert!(refusal(&glb(&two, &bad)).contains("names vertex 8 of a part with 8"));
    // Parts that repeat the same data come to an end.
    let (mut many, _) = cube();
    many["meshes"][0]["primitives"] = vec![json["meshes"][0]["primitives"][0].clone(); 100].into();
    many["nodes"] = vec![json!({ "mesh": 0 }); 20_000].into();
    assert!(refusal(&glb(&many, &buffer)).contains("repeated very often"));
}

/// What names the same thing over and over is read once, or refused before it costs anything.
#[test]
fn repetitions_without_end_are_refused() {
    let placed = vec![json!({"mesh": 0}); 5000];
    let nodes: Vec<usize> = (0..placed.len()).collect();
    for primitive in [json!({"attributes": {}}), json!({"attributes": {}, "mode": 1})] {
        let json = json!({
            "asset": {"version": "2.0"},
            "meshes": [{"primitives": vec![primitive; 5000]}],
            "nodes": placed,
            "scenes": [{"nodes": nodes}],
        });
        assert!(refusal(&glb(&json, &[])).contains("too many"));
    }

    let (mut json, buffer) = cube();
    let folder = std::env::temp_dir().join(format!("ndf-gltf-repeated-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("a.bin"), &buffer).unwrap();
    // One file under many names, and one that is not there and not needed.
    let names = ["a.bin", "./a.bin", "././a.bin", "%61.bin"];
    let mut buffers: Vec<Value> =
        names.iter().map(|name| json!({"byteLength": buffer.len(), "uri": name})).collect();
    buffers.push(json!({"byteLength": 10, "uri": "nowhere.bin"}));
    json["buffers"] = buffers.into();
    for (k, view) in json["bufferViews"].as_array_mut().unwrap().iter_mut().enumerate() {
        view["buffer"] = (k % names.len()).into();
    }
    let text = json.to_string();
    let document = Document::parse(text.as_bytes(), &folder).unwrap();
    assert_eq!(document.bytes - text.len(), buffer.len());
    let found = parse_mesh(text.as_bytes(), &folder.join("a.gltf")).unwrap();
    assert!(is_closed(&found.mesh));
    std::fs::remove_dir_all(&folder).unwrap();

    let accessor =
        json["accessors"].as_array_mut().unwrap().iter_mut().find(|a| a["type"] == "VEC3").unwrap();
    accessor["sparse"] = json!({
        "count": 1_000_000,
        "indices": {"bufferView": 0, "componentType": 5121},
        "values": {"bufferView": 0},
    });
    json["buffers"] = json!([{"byteLength": buffer.len()}]);
    for view in json["bufferViews"].as_array_mut().unwrap() {
        view["buffer"] = 0.into();
    }
    assert!(refusal(&glb(&json, &buffer)).contains("replaces 1000000 of its"));
}

#[test]
fn changed_files_are_survived() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let (mut json, buffer) = cube();
    json["accessors"][0]["sparse"] = json!({
        "count": 2,
        "indices": { "bufferView": 1, "componentType": 5121 },
        "values": { "bufferView": 0 },
    });
    json["nodes"] = json!([{ "mesh": 0, "scale": [1, 2, 3] }, { "children": [0], "rotation": [0, 0, 0, 1] }]);
    let mut manifold = json.clone();
    let primitive = json["meshes"][0]["primitives"][0].clone();
    manifold["meshes"][0]["extensions"] = json!({ "EXT_mesh_manifold": { "manifoldPrimitive": primitive } });
    let height = scalar("height", [0.5; 12]);
    let written = to_glb(&shapes::icosphere(0), &[height], &GlbOptions::default()).unwrap();
    for bytes in [glb(&json, &buffer), glb(&manifold, &buffer), written] {
        parsed(&bytes);
        for _ in 0..4000 {
            let mut changed = bytes.clone();
            for _ in 0..rng.random_range(1..4) {
                let at = rng.random_range(0..changed.len());
                changed[at] = match rng.random_range(0..3) {
                    0 => rng.random(),
                    1 => changed[at] ^ (1 << rng.random_range(0..8)),
                    _ => *b"0123456789-.e[]{},: ".get(rng.random_range(0..20)).unwrap(),
                };
            }
            match parse_mesh(&changed, Path::new("a.glb")) {
                Ok(file) => assert!(file.scalars.iter().all(|s| s.values.len() == file.mesh.vertex_count())),
                Err(error) => assert!(!error.to_string().is_empty()),
            }
        }
    }
}
