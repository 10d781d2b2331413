//! `ndf info`: what a file is.

use std::path::PathBuf;

use clap::Args;
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::io::MeshFile;
use ndf_mesh::{ManifoldMesh, TriangleMesh, ValidationReport};
use ndf_model::Model;
use serde_json::json;

use crate::context::Context;
use crate::input::{self, Content, Kind, Reading};
use crate::output::{Failure, Outcome, grouped, readable, table};

/// Arguments of `ndf info`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The file to examine.
    file: PathBuf,
    #[command(flatten)]
    reading: Reading,
}

/// Examines a file.
///
/// # Errors
/// If it cannot be read.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let content = Content::read(&arguments.file)?;
    let name = content.name();
    if Model::is_model(&content.bytes) {
        let model = Model::from_bytes(&content.bytes)
            .map_err(|e| Failure::new(format!("cannot read {name}: {e}")))?;
        return Ok(describe_model(&name, &model));
    }
    input::describe(&content, &arguments.reading, context)
}

/// What is to be said of a mesh.
pub fn describe_mesh(name: &str, file: &MeshFile) -> Outcome {
    let mesh = &file.mesh;
    let report = ValidationReport::of(mesh);
    let bounds = mesh.bounds();
    let scalars: Vec<&str> = file.scalars.iter().map(|s| s.name.as_str()).collect();
    let corners =
        (!bounds.is_empty()).then(|| json!({"min": bounds.min.to_array(), "max": bounds.max.to_array()}));
    let volume = (report.faces > 0 && report.is_closed()).then(|| mesh.signed_volume());
    let delaunay = Delaunay::of(mesh, &report);
    let json = json!({
        "kind": Kind::Mesh.name(),
        "format": file.format.to_string(),
        "vertices": report.vertices,
        "faces": report.faces,
        "edges": report.edges,
        "components": report.components,
        "euler_characteristic": report.euler_characteristic,
        "genus": report.genus(),
        "boundary_edges": report.boundary_edges,
        "boundary_loops": report.boundary_loops,
        "nonmanifold_edges": report.nonmanifold_edges.count,
        "nonmanifold_vertices": report.nonmanifold_vertices.count,
        "inconsistent_edges": report.inconsistent_edges.count,
        "degenerate_faces": report.degenerate_faces.count,
        "duplicate_faces": report.duplicate_faces.count,
        "duplicate_vertices": report.duplicate_vertices.count,
        "unreferenced_vertices": report.unreferenced_vertices.count,
        "nonfinite_vertices": report.nonfinite_vertices.count,
        "manifold": report.is_manifold(),
        "oriented": report.inconsistent_edges.count == 0,
        "closed": report.faces > 0 && report.is_closed(),
        "delaunay_intrinsic": delaunay.as_ref().map(|d| d.flips == 0),
        "delaunay_fraction": delaunay.as_ref().map(|d| d.fraction),
        "delaunay_flips": delaunay.as_ref().map(|d| d.flips),
        "area": mesh.area(),
        "volume": volume,
        "bounds": corners,
        "diagonal": bounds.diagonal(),
        "scalars": scalars,
        "notes": file.notes,
    });
    let mut rows = vec![("vertices", grouped(report.vertices)), ("faces", grouped(report.faces))];
    if report.faces > 0 {
        rows.push(("components", grouped(report.components)));
        rows.push(("topology", topology(&report)));
        rows.push(("area", readable(mesh.area())));
        if let Some(delaunay) = &delaunay {
            rows.push(("intrinsic Delaunay", delaunay.to_string()));
        }
    }
    if let Some(volume) = volume {
        rows.push(("volume", readable(volume)));
    }
    if !bounds.is_empty() {
        let extent = bounds.extent().to_array().map(readable).join(" × ");
        rows.push(("box", format!("{extent}, diagonal {}", readable(bounds.diagonal()))));
    }
    if !scalars.is_empty() {
        rows.push(("scalars", scalars.join(", ")));
    }
    let mut text = format!("{name}: {} ({})\n{}", Kind::Mesh.name(), file.format, table(&rows));
    for defect in defects(&report, volume) {
        text += &format!("  ! {defect}\n");
    }
    Outcome::new(json, text)
}

/// How far the triangles of a manifold are from the intrinsic Delaunay triangulation of its surface.
struct Delaunay {
    /// Share of the inner edges that are locally Delaunay.
    fraction: f64,
    /// Flips of edges that lead there.
    flips: usize,
}

impl Delaunay {
    /// `None` if the mesh is not an oriented manifold.
    fn of(mesh: &TriangleMesh, report: &ValidationReport) -> Option<Self> {
        if !report.is_oriented_manifold() {
            return None;
        }
        let mut intrinsic = IntrinsicMesh::of_mesh(&ManifoldMesh::try_from(mesh.clone()).ok()?);
        let fraction = intrinsic.delaunay_fraction();
        Some(Self { fraction, flips: intrinsic.flip_to_delaunay().flips })
    }
}

impl std::fmt::Display for Delaunay {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.flips {
            0 => write!(f, "yes"),
            1 => write!(f, "but for 1 flip; {:.2} % of the edges are", 100.0 * self.fraction),
            n => write!(f, "but for {} flips; {:.2} % of the edges are", grouped(n), 100.0 * self.fraction),
        }
    }
}

fn describe_model(name: &str, model: &Model) -> Outcome {
    let field = &model.field;
    let base = ValidationReport::of(field.base());
    let sizes = model.section_sizes();
    let network = field.network();
    let names: Vec<&str> =
        model.scalars.iter().flat_map(ndf_model::SurfaceScalars::channels).map(|c| c.name.as_str()).collect();
    let (center, scale) = (model.similarity.center(), model.similarity.scale());
    let json = json!({
        "kind": "model",
        "vertices": base.vertices,
        "faces": base.faces,
        "components": base.components,
        "euler_characteristic": base.euler_characteristic,
        "boundary_edges": base.boundary_edges,
        "features": network.shape().features,
        "network_parameters": network.mlp().parameters().len(),
        "scalars": names,
        "center": center.to_array(),
        "scale": scale,
        "bytes": {
            "base": sizes.base, "features": sizes.features, "network": sizes.network,
            "scalars": sizes.scalars, "total": sizes.total,
        },
        "provenance": serde_json::from_str::<serde_json::Value>(&model.provenance).ok(),
    });
    let mut rows = vec![
        ("base mesh", format!("{} vertices, {} faces", grouped(base.vertices), grouped(base.faces))),
        ("topology", topology(&base)),
        ("features", format!("{} a vertex", network.shape().features)),
        ("network", format!("{} parameters", grouped(network.mlp().parameters().len()))),
        (
            "box",
            format!(
                "centre {}, 1 unit of the box is {}",
                center.to_array().map(readable).join(" "),
                readable(scale.recip())
            ),
        ),
        (
            "bytes",
            format!(
                "{} (base {}, features {}, network {}, scalars {})",
                grouped(sizes.total),
                grouped(sizes.base),
                grouped(sizes.features),
                grouped(sizes.network),
                grouped(sizes.scalars)
            ),
        ),
    ];
    if !names.is_empty() {
        rows.push(("scalars", names.join(", ")));
    }
    Outcome::new(json, format!("{name}: model\n{}", table(&rows)))
}

fn topology(report: &ValidationReport) -> String {
    let shape = match report.genus() {
        Some(genus) => format!("closed, genus {genus}"),
        None if report.is_closed() => "closed".to_owned(),
        None => format!("open, {} boundary edges", grouped(report.boundary_edges)),
    };
    format!("{shape}, Euler characteristic {}", report.euler_characteristic)
}

/// Everything wrong with the mesh, one line each.
fn defects(report: &ValidationReport, volume: Option<f64>) -> Vec<String> {
    let mut all: Vec<String> =
        report.manifold_defects().split(", ").filter(|d| !d.is_empty()).map(str::to_owned).collect();
    let mut note = |count: usize, one: &str, more: &str| match count {
        0 => {}
        1 => all.push(format!("1 {one}")),
        n => all.push(format!("{} {more}", grouped(n))),
    };
    note(
        report.degenerate_faces.count - report.repeated_corner_faces.count,
        "face without area",
        "faces without area",
    );
    note(
        report.duplicate_vertices.count,
        "vertex in the same place as another",
        "vertices in the same place as another",
    );
    if volume.is_some_and(|v| v < 0.0) {
        all.push("the faces are oriented inward".to_owned());
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_mesh::io::parse_mesh;
    use std::path::Path;

    fn outcome(text: &str) -> Outcome {
        describe_mesh("a", &parse_mesh(text.as_bytes(), Path::new("a")).unwrap())
    }

    #[test]
    fn every_defect_is_listed_at_once() {
        let o = outcome(
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\nv 0 0 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\nf 1 1 2\nf 2 3 2\n",
        );
        for said in ["1 edge with 3 faces", "names a vertex twice", "no face uses", "same place as another"] {
            assert!(
                o.text.contains(said) || o.text.contains("name a vertex twice"),
                "{} lacks {said}",
                o.text
            );
        }
        assert_eq!(o.json["nonmanifold_edges"], 1);
        assert_eq!(o.json["degenerate_faces"], 2);
        assert_eq!(o.json["kind"], "mesh");
    }

    #[test]
    fn flips_to_delaunay_are_counted() {
        // A flat square along its diagonal, and a flat rhombus along its longer one.
        let square = outcome("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n");
        assert_eq!(square.json["delaunay_intrinsic"], true);
        let rhombus = outcome("v -2 0 0\nv 0 -1 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n");
        assert_eq!(rhombus.json["delaunay_intrinsic"], false);
        assert_eq!(rhombus.json["delaunay_flips"], 1);
        assert!(rhombus.text.contains("1 flip"), "{}", rhombus.text);
        let soup = outcome("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n");
        assert!(soup.json["delaunay_intrinsic"].is_null());
    }
}
