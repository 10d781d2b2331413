//! Meshes of glTF: written by every command that writes meshes, and taken where meshes are.

use ndf_mesh::io::read_mesh;

use super::{Folder, ndf};

#[test]
fn glb_goes_where_ply_goes() {
    let folder = Folder::new("glb");
    for name in ["ball.glb", "ball.ply"] {
        ndf(&folder.0, &["sample", "mesh", "--shape", "sphere", "-o", name, "--json"]).json();
    }
    let info = |name: &str| ndf(&folder.0, &["info", name, "--json"]).json();
    let (glb, ply) = (info("ball.glb"), info("ball.ply"));
    assert_eq!((&glb["kind"], &glb["format"]), (&"mesh".into(), &"GLB".into()));
    for key in ["vertices", "faces", "euler_characteristic", "boundary_edges", "closed", "area", "volume"] {
        assert_eq!(glb[key], ply[key], "{key}");
    }
    let geodesic = ["geodesic", "ball.glb", "--source-vertex", "7", "--json", "-o"];
    for name in ["d.glb", "d.ply"] {
        ndf(&folder.0, &[&geodesic[..], &[name]].concat()).json();
    }
    let [glb, ply] = ["d.glb", "d.ply"].map(|name| read_mesh(folder.0.join(name)).unwrap());
    assert_eq!((glb.mesh, glb.scalars), (ply.mesh, ply.scalars));
    ndf(&folder.0, &["spectrum", "ball.glb", "--modes", "3", "-o", "m.glb", "--json"]).json();
    let names: Vec<String> =
        read_mesh(folder.0.join("m.glb")).unwrap().scalars.into_iter().map(|s| s.name).collect();
    assert_eq!(names, ["mode_00", "mode_01", "mode_02"]);
    let drawn = ["render", "d.glb", "--scalar", "distance", "--size", "64,64", "-o", "d.png", "--json"];
    ndf(&folder.0, &drawn).json();
    let measured = ndf(&folder.0, &["measure", "ball.ply", "d.glb", "--json"]).json();
    assert!(measured["hausdorff"].as_f64().unwrap() < 1e-12, "{measured}");
}

#[test]
fn what_is_no_mesh_of_gltf_is_refused() {
    let folder = Folder::new("glb-refused");
    folder.write("package.json", r#"{"name": "none"}"#);
    folder.write(
        "draco.gltf",
        r#"{"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_draco_mesh_compression"]}"#,
    );
    folder.write(
        "lost.gltf",
        r#"{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 4, "uri": "lost.bin"}],
            "bufferViews": [{"buffer": 0, "byteLength": 4}]}"#,
    );
    for (name, said) in [
        ("package.json", "no scene of glTF"),
        ("draco.gltf", "gltf-transform copy"),
        ("lost.gltf", "lost.bin cannot be read"),
    ] {
        let run = ndf(&folder.0, &["info", name]);
        assert!(run.sentence().contains(said), "{}", run.stderr);
    }
    let run = ndf(&folder.0, &["sample", "mesh", "-o", "a.gltf"]);
    assert!(run.sentence().contains(".ply, .glb, .obj or .stl"), "{}", run.stderr);
}
