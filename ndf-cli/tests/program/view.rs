//! `ndf view`: what is in the page, and what is refused. What the page does is tested in a browser (`cargo xtask web test`).

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;

use super::{Folder, ndf};

/// What a page was made with, and the file in it.
fn input(page: &str) -> (Value, Vec<u8>) {
    let (_, rest) = page.split_once("id=\"input\">").unwrap();
    let read: Value = serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap();
    let data = STANDARD.decode(read["data"].as_str().unwrap()).unwrap();
    if read["packed"] == false {
        return (read, data);
    }
    let mut decoder = flate2::write::DeflateDecoder::new(Vec::new());
    decoder.write_all(&data).unwrap();
    (read, decoder.finish().unwrap())
}

fn page(folder: &Folder, name: &str) -> String {
    std::fs::read_to_string(folder.0.join(name)).unwrap()
}

#[test]
fn a_page_holds_the_model_byte_for_byte() {
    let folder = Folder::new("view-model");
    let model = include_bytes!("../../../ndf-model/tests/golden/scalars_version_3.ndf");
    std::fs::write(folder.0.join("a.ndf"), model).unwrap();
    let written = ndf(&folder.0, &["view", "a.ndf", "-o", "a.html", "--json"]).json();
    assert_eq!(written["shows"], "model");
    let (read, bytes) = input(&page(&folder, "a.html"));
    assert_eq!(bytes, model);
    assert_eq!((&read["name"], &read["edge_length"]), (&"a.ndf".into(), &Value::Null));
    // Lengths are in the units of the model, whatever they were given in.
    let scalar = written["scalars"][0].as_str().unwrap();
    let asked = ["view", "a.ndf", "-o", "b.html", "--scalar", scalar, "--edge-length", "0.125", "--up", "-z"];
    assert_eq!(ndf(&folder.0, &asked).code, 0);
    let (read, _) = input(&page(&folder, "b.html"));
    assert_eq!(
        (&read["scalar"], &read["edge_length"], &read["up"]),
        (&scalar.into(), &0.125.into(), &"-z".into())
    );
}

#[test]
fn a_mesh_keeps_its_vertices_and_scalars() {
    let folder = Folder::new("view-mesh");
    // A third is not exact in single precision.
    folder.write(
        "a.obj",
        "v 0 0 0\nv 0.3333333333333333 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n",
    );
    assert_eq!(
        ndf(&folder.0, &["geodesic", "a.obj", "-o", "a.ply", "--source-vertex", "0", "--double"]).code,
        0
    );
    let asked = ["view", "a.ply", "-o", "a.html", "--source", "0,0,0", "--json"];
    let written = ndf(&folder.0, &asked).json();
    assert_eq!((&written["shows"], &written["scalars"]), (&"mesh".into(), &serde_json::json!(["distance"])));
    let (read, bytes) = input(&page(&folder, "a.html"));
    assert_eq!(read["source"], serde_json::json!([0.0, 0.0, 0.0]));
    let vertex = |number: &str| ndf(&folder.0, &["view", "a.ply", "-o", "v.html", "--source-vertex", number]);
    assert_eq!(vertex("1").code, 0);
    let (read, _) = input(&page(&folder, "v.html"));
    assert!(read["source"].as_array().is_some_and(|place| place.len() == 3));
    assert!(vertex("99999").sentence().contains("its vertices are 0 to"));
    std::fs::write(folder.0.join("inside.ply"), bytes).unwrap();
    let [before, inside] =
        ["a.ply", "inside.ply"].map(|name| ndf_mesh::io::read_mesh(folder.0.join(name)).unwrap());
    assert_eq!((before.mesh, before.scalars), (inside.mesh, inside.scalars));
}

#[test]
fn an_edge_length_that_no_page_can_show_is_refused() {
    let folder = Folder::new("view-too-fine");
    let model = include_bytes!("../../../ndf-model/tests/golden/levels_version_3.ndf");
    std::fs::write(folder.0.join("a.ndf"), model).unwrap();
    let view = |length: &str| ndf(&folder.0, &["view", "a.ndf", "-o", "a.html", "--edge-length", length]);
    let refused = view("1e-6");
    let told = refused.sentence();
    assert!(told.contains("triangles, and a page in the browser holds 4,000,000"), "{told}");
    assert_eq!(folder.files().len(), 1, "{:?}", folder.files());
    let (_, possible) = told.split_once("--edge-length ").unwrap();
    assert_eq!(view(possible.split_whitespace().next().unwrap()).code, 0);
}

#[test]
fn what_is_shown_is_said() {
    let folder = Folder::new("view-shows");
    folder.write("a.xyz", "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n1 1 0\n0 1 1\n1 0 1\n");
    let told = ndf(&folder.0, &["view", "a.xyz", "-o", "a.html"]);
    assert_eq!(told.code, 0, "{}", told.stderr);
    assert!(told.stdout.contains(" points of "), "{}", told.stdout);
}

#[test]
fn what_cannot_be_shown_is_said() {
    let folder = Folder::new("view-errors");
    folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    for (arguments, said) in [
        (&["view", "a.obj", "-o", "a.ply"][..], "end it in .html"),
        (&["view", "a.obj", "-o", "a.html", "--scalar", "heat"], "a.obj has no scalar heat"),
        (&["view", "none.ndf", "-o", "a.html"], "none.ndf"),
        (&["view", "a.obj", "-o", "no/a.html"], "there is no folder no"),
    ] {
        let run = ndf(&folder.0, arguments);
        assert_eq!(run.code, 1, "{arguments:?}");
        assert!(run.stderr.contains(said), "{}", run.stderr);
    }
    assert_eq!(folder.files().len(), 1, "{:?}", folder.files());
}
