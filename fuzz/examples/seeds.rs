//! Writes the seeds of all fuzzers: `cargo run --example seeds`, in this folder.

use std::fs;
use std::path::Path;

use ndf::{Field, Fit, Kind, Opened};
use ndf_core::NoProgress;
use ndf_core::analytic::Sphere;
use ndf_mesh::shapes;
use ndf_model::file::{Precision, StoredBase};
use ndf_mesh::{ManifoldMesh, TriangleMesh};
use ndf_mesh::io::VertexScalars;
use ndf_mesh::io::gltf::{GlbOptions, to_glb};
use ndf_model::{DisplacementField, FieldShape, Model, SurfaceScalars};
use ndf_train::scalars::{ScalarLevelOptions, fit_levels as fit_levels_of_scalars};
use ndf_train::levels::{LevelOptions, fit_levels};

fn main() -> std::io::Result<()> {
    let write = |target: &str, files: Vec<(&'static str, Vec<u8>)>| -> std::io::Result<()> {
        let folder = Path::new("corpus").join(target);
        fs::create_dir_all(&folder)?;
        files.iter().try_for_each(|(name, bytes)| fs::write(folder.join(name), bytes))
    };
    write("clouds", ndf_formats::point_cloud::samples::all())?;
    write("tensors", ndf_formats::tensors::samples::all())?;
    write("networks", ndf_surfaces::networks::samples::all())?;
    write("splats", ndf_formats::splats::samples::all())?;
    write("meshes", meshes())?;
    write("models", models())?;
    write("extraction", models().into_iter().filter(|(name, _)| *name != "tensors").collect())?;
    write("checkpoints", vec![("network", checkpoint(Field::Network)), ("levels", checkpoint(Field::Levels))])
}

/// The end of a short run.
fn checkpoint(field: Field) -> Vec<u8> {
    let sphere = Opened::from_surface(Box::new(Sphere::UNIT), Kind::Mesh);
    let base = ManifoldMesh::try_from(shapes::icosphere(1)).expect("an icosphere is a manifold");
    let fit = Fit::new(&sphere).base(&base).field(field);
    let fit = match field {
        Field::Network => fit.epochs(2).samples(64),
        _ => fit.levels(LevelOptions { iterations: [4, 4], ..LevelOptions::default() }),
    };
    let file = std::env::temp_dir().join(format!("ndf-seed-{}", std::process::id()));
    fit.run().expect("a sphere is learned").checkpoint.write(&file).expect("a temporary file");
    let bytes = fs::read(&file).expect("what was written");
    fs::remove_file(&file).expect("what was written");
    bytes
}

/// An untrained model of a sphere: plain, rounded, and as tensors; and one of levels.
fn models() -> Vec<(&'static str, Vec<u8>)> {
    let base = ManifoldMesh::try_from(shapes::icosphere(1)).expect("an icosphere is a manifold");
    let StoredBase { mesh: base, similarity, .. } = StoredBase::new(&base, Some(Precision::default()), 0.0);
    let field = DisplacementField::untrained(base, FieldShape::default(), 0).expect("the parts fit");
    let model = Model { field, similarity, metric: None, scalars: Vec::new(), provenance: "{}".to_owned() };
    let rounded = model.rounded(Precision::default());
    let tensors = model.to_safetensors().expect("its tensors have different names");
    let options = LevelOptions { iterations: [4, 4], ..LevelOptions::default() };
    let sphere = Sphere::UNIT;
    let levels = fit_levels(&sphere, &sphere, similarity, model.field.base(), &options, &NoProgress);
    let levels = Model { field: levels.expect("a sphere has levels").field, ..model.clone() };
    let on_levels = Model { scalars: vec![scalars(&model)], ..model.clone() };
    let scalars = ("scalars.ndf", on_levels.to_bytes());
    vec![scalars, ("plain.ndf", model.to_bytes()), ("rounded.ndf", rounded.to_bytes()), ("levels.ndf", levels.to_bytes()), ("tensors", tensors)]
}

/// Height on levels.
fn scalars(model: &Model) -> SurfaceScalars {
    let base = model.field.base();
    let positions = base.positions().iter().map(|&p| model.similarity.to_world(p)).collect();
    let mesh = TriangleMesh::new(positions, base.faces().to_vec()).expect("the vertices are the same");
    let values = mesh.positions().iter().map(|p| p.z as f32).collect();
    let height = [VertexScalars { name: "height".to_owned(), values }];
    let found = fit_levels_of_scalars(model, &mesh, &height, &ScalarLevelOptions::default(), &NoProgress);
    found.expect("a sphere has heights").fields
}

/// A square in quantised numbers, some of them sparse, as a strip under two nodes.
const GLTF: &str = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[1]}],
"nodes":[{"mesh":0,"scale":[2,1,-1]},{"children":[0],"rotation":[0,0,0.6,0.8],"translation":[1,2,3]}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0,"_HEIGHT":1},"indices":2,"mode":5}]}],
"accessors":[{"bufferView":0,"componentType":5120,"normalized":true,"count":4,"type":"VEC3","sparse":{"count":1,
"indices":{"bufferView":1,"componentType":5121},"values":{"bufferView":0,"byteOffset":4}}},
{"componentType":5126,"count":4,"type":"SCALAR"},{"bufferView":1,"componentType":5121,"count":4,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteLength":16,"byteStride":4},{"buffer":0,"byteOffset":16,"byteLength":4}],
"buffers":[{"byteLength":20,"uri":"data:;base64,AAAAAH8AAAAAfwAAf38AAAABAgM="}]}"#;

/// Makes its mesh one whose faces meet as the extension says.
const MANIFOLD: &str = r#""extensions":{"EXT_mesh_manifold":{"manifoldPrimitive":{"attributes":{"POSITION":0},"indices":2,"mode":5}}},"primitives""#;

/// A tetrahedron in every format but glTF, which has more to it.
fn meshes() -> Vec<(&'static str, Vec<u8>)> {
    let corners = ["0 0 0", "1 0 0", "0 1 0", "0 0 1"];
    let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let numbered = |first: u32, prefix: &str| -> String {
        faces
            .iter()
            .map(|face| format!("{prefix}{}\n", face.map(|v| (v + first).to_string()).join(" ")))
            .collect()
    };
    let vertices = corners.join("\n");
    let header = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        element face 4\nproperty list uchar int vertex_indices\nend_header\n";
    let binary_header = header.replace("ascii", "binary_little_endian");
    let point = |v: u32| corners[v as usize].split(' ').map(|x| x.parse().expect("corners are numbers"));
    let floats = |v: u32| point(v).flat_map(f32::to_le_bytes).collect::<Vec<u8>>();
    let mut binary_ply = binary_header.into_bytes();
    (0..4).for_each(|v| binary_ply.extend(floats(v)));
    for face in faces {
        binary_ply.push(3);
        binary_ply.extend(face.iter().flat_map(|v| v.to_le_bytes()));
    }
    let mut binary_stl = vec![0; 80];
    binary_stl.extend(4_u32.to_le_bytes());
    let mut text_stl = "solid s\n".to_owned();
    for face in faces {
        binary_stl.extend([0; 12]);
        face.iter().for_each(|&v| binary_stl.extend(floats(v)));
        binary_stl.extend([0; 2]);
        let corner = |&v: &u32| format!("vertex {}\n", corners[v as usize]);
        let loop_: String = face.iter().map(corner).collect();
        text_stl += &format!("facet normal 0 0 1\nouter loop\n{loop_}endloop\nendfacet\n");
    }
    let ball = shapes::icosphere(0);
    let values = ball.positions().iter().map(|p| p.z as f32).collect();
    let height = VertexScalars { name: "height".to_owned(), values };
    let obj = corners.map(|p| format!("v {p}\n")).concat() + &numbered(1, "f ");
    vec![
        ("obj", obj.into_bytes()),
        ("glb", to_glb(&ball, &[height], &GlbOptions::default()).expect("a ball is glTF")),
        ("gltf", GLTF.as_bytes().to_vec()),
        ("manifold.gltf", GLTF.replace("\"primitives\"", MANIFOLD).into_bytes()),
        ("off", format!("OFF\n4 4 0\n{vertices}\n{}", numbered(0, "3 ")).into_bytes()),
        ("ascii.ply", format!("{header}{vertices}\n{}", numbered(0, "3 ")).into_bytes()),
        ("binary.ply", binary_ply),
        ("text.stl", (text_stl + "endsolid s\n").into_bytes()),
        ("binary.stl", binary_stl),
    ]
}
