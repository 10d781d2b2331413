//! Distances of vertices and of points from a reference.

use std::fs;

use super::{Folder, ndf};

/// The last property of every vertex of a binary PLY of float properties.
fn last_scalars(bytes: &[u8]) -> (String, Vec<f32>) {
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let count: usize = header
        .lines()
        .find_map(|line| line.strip_prefix("element vertex "))
        .map(|count| count.trim().parse().unwrap())
        .unwrap();
    let names: Vec<&str> = header.lines().filter_map(|line| line.strip_prefix("property float ")).collect();
    let stride = 4 * names.len();
    let scalars = (0..count).map(|v| {
        let at = end + (v + 1) * stride - 4;
        f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
    });
    (names.last().unwrap().to_string(), scalars.collect())
}

#[test]
fn distances_of_vertices_and_points_are_written_and_have_signs() {
    let folder = Folder::new("deviations");
    let sample = |kind: &str, more: &[&str]| {
        ndf(&folder.0, &[&["sample", kind, "--shape", "sphere", "--json"], more].concat()).json();
    };
    sample("mesh", &["--faces", "5000", "-o", "ball.ply"]);
    // A smaller ball, of points.
    let mut text = String::new();
    for i in 0..2000 {
        let (turn, height) = (f64::from(i) * 2.399_963, 1.0 - f64::from(i) / 1000.0);
        let radius = 0.5 * (1.0 - height * height).max(0.0).sqrt();
        text += &format!("{} {} {}\n", radius * turn.cos(), radius * turn.sin(), 0.5 * height);
    }
    fs::write(folder.0.join("small.xyz"), text).unwrap();

    let arguments = ["measure", "ball.ply", "small.xyz", "-o", "small.ply", "--signed", "--json"];
    let told = ndf(&folder.0, &arguments).json();
    assert!(told["normal_deg_mean"].is_null() && told["flipped_fraction"].is_null());
    for key in ["mesh_to_reference", "reference_to_mesh"] {
        let mean = told[key]["mean"].as_f64().unwrap();
        assert!((mean - 0.5).abs() < 0.01, "{key}: {mean}");
    }
    let (name, values) = last_scalars(&fs::read(folder.0.join("small.ply")).unwrap());
    assert_eq!((name.as_str(), values.len()), ("signed_distance", 2000));
    assert!(values.iter().all(|value| (value + 0.5).abs() < 0.01));
    assert!((told["signed"]["max"].as_f64().unwrap() + 0.5).abs() < 0.01);

    let told = ndf(&folder.0, &["measure", "ball.ply", "ball.ply", "-o", "d.ply", "--json"]).json();
    assert!(told["normal_deg_mean"].is_f64() && told.get("signed").is_none());
    let (name, values) = last_scalars(&fs::read(folder.0.join("d.ply")).unwrap());
    assert!(name == "distance" && values.iter().all(|value| *value < 1e-6));

    let refused = ndf(&folder.0, &["measure", "small.xyz", "ball.ply"]);
    assert_eq!(refused.code, 1);
    assert!(refused.stderr.contains("small.xyz is"), "{}", refused.stderr);
    let refused = ndf(&folder.0, &["measure", "ball.ply", "ball.ply", "-o", "ball.ply"]);
    assert!(refused.code == 1 && refused.stderr.contains("would be overwritten"), "{}", refused.stderr);
}
