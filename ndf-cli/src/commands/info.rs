//! `ndf info`: what a file is.

use std::path::PathBuf;

use clap::Args;
use ndf::describe::{
    CheckpointDescription, CloudDescription, Corners, Delaunay, Description, MeshDescription,
    ModelDescription, NetworkDescription, SplatsDescription,
};
use ndf::{Note, describe};
use ndf_mesh::ValidationReport;

use crate::arguments::Reading;
use crate::context::Context;
use crate::files::not_opened;
use crate::output::{Failure, Outcome, grouped, passes, readable, table};
use crate::streams::input_file;

/// Arguments of `ndf info`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The file to examine.
    #[arg(value_parser = input_file())]
    file: PathBuf,
    #[command(flatten)]
    reading: Reading,
}

/// Examines a file.
///
/// # Errors
/// If it cannot be read.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let name = arguments.file.display();
    let described = describe(&arguments.file, &arguments.reading.options()?).map_err(|e| not_opened(&e))?;
    described.notes.iter().for_each(|note| context.warn_of(&name, note));
    let text = match &described.description {
        Description::Mesh(mesh) => of_mesh(mesh),
        Description::Cloud(cloud) => of_cloud(cloud, &described.notes),
        Description::Network(network) => of_network(network),
        Description::Splats(splats) => of_splats(splats),
        Description::Model(model) => of_model(model),
        Description::Checkpoint(checkpoint) => of_checkpoint(checkpoint),
        _ => String::new(),
    };
    Ok(Outcome::new(serde_json::to_value(&described.description)?, format!("{name}: {text}")))
}

fn of_mesh(mesh: &MeshDescription) -> String {
    let report = &mesh.report;
    let mut rows = vec![("vertices", grouped(report.vertices)), ("faces", grouped(report.faces))];
    if report.faces > 0 {
        rows.push(("components", grouped(report.components)));
        rows.push(("topology", topology(report)));
        rows.push(("self-intersections", passes(mesh.self_intersections)));
        rows.push(("area", readable(mesh.area)));
        if let Some(delaunay) = &mesh.delaunay {
            rows.push(("intrinsic Delaunay", flips(delaunay)));
        }
    }
    if let Some(volume) = mesh.volume {
        rows.push(("volume", readable(volume)));
    }
    if let Some(bounds) = &mesh.bounds {
        rows.push(("box", extent(bounds, mesh.diagonal)));
    }
    if !mesh.scalars.is_empty() {
        rows.push(("scalars", mesh.scalars.join(", ")));
    }
    let format = mesh.format.as_deref().unwrap_or_default();
    let mut text = format!("{} ({format})\n{}", mesh.kind, table(&rows));
    if mesh.orientable == Some(false) {
        text += "  ! it cannot be oriented: there is a Möbius strip in it\n";
    }
    for defect in defects(report, mesh.is_inward()) {
        text += &format!("  ! {defect}\n");
    }
    text
}

fn of_cloud(cloud: &CloudDescription, notes: &[Note]) -> String {
    let normals = match cloud.normals_agreeing {
        Some(share) => format!("{:.1} % of neighbouring ones point to the same side", 100.0 * share),
        None => "none".to_owned(),
    };
    let rows = [
        ("points", grouped(cloud.points)),
        ("normals", normals),
        ("box", extent(&cloud.bounds, cloud.diagonal)),
    ];
    let mut text = format!("{} ({})\n{}", cloud.kind, cloud.format, table(&rows));
    for note in notes.iter().filter(|note| !matches!(note, Note::NormalsDisagree { .. })) {
        text += &format!("  ! {note}\n");
    }
    text
}

fn of_network(network: &NetworkDescription) -> String {
    let level = readable(network.level);
    let name = network.activation.clone().unwrap_or_else(|| "none".to_owned());
    let frequency = network.omega.map_or_else(String::new, |omega| format!(" of {omega} x"));
    let octaves = network.octaves.map_or_else(String::new, |octaves| format!("; input in {octaves} octaves"));
    let assumed = match (network.activation_assumed, network.omega) {
        (true, Some(_)) => ", assumed: the file does not say (--omega, --activation)",
        (true, None) => ", assumed: the file does not say (--activation)",
        (false, _) => "",
    };
    let activation = format!("{name}{frequency}{assumed}{octaves}");
    let rows = [
        ("layout", network.layout.to_owned()),
        ("parameters", grouped(network.parameters)),
        ("widths", network.widths.iter().map(usize::to_string).collect::<Vec<_>>().join(" → ")),
        ("activation", activation),
        ("level", format!("{level}, {}; the inside is {} it", network.level_rule, network.inside)),
        ("box", extent(&network.bounds, network.diagonal)),
    ];
    format!("{} ({})\n{}", network.kind, network.format, table(&rows))
}

fn of_splats(splats: &SplatsDescription) -> String {
    let kept = format!(
        "{} of {} make the density; {} are faint, {} far or large, {} unsound",
        grouped(splats.splats_kept),
        grouped(splats.splats),
        grouped(splats.faint_splats),
        grouped(splats.floaters),
        grouped(splats.unsound_splats)
    );
    let rows = [
        ("splats", kept),
        ("level", format!("{}, {}", readable(splats.level), splats.level_rule)),
        ("offset", format!("about {} outside of the middle of the splats", readable(splats.offset))),
        ("box of the object", extent(&splats.bounds, splats.diagonal)),
    ];
    format!("{} ({})\n{}", splats.kind, splats.format, table(&rows))
}

fn of_model(model: &ModelDescription) -> String {
    let bytes = &model.bytes;
    let mut rows = vec![
        ("base mesh", format!("{} vertices, {} faces", grouped(model.vertices), grouped(model.faces))),
        ("topology", topology(&model.base)),
    ];
    if let Some(levels) = model.levels {
        rows.push(("levels of displacements", levels.to_string()));
    } else {
        rows.push(("features", format!("{} a vertex", model.features)));
        rows.push(("network", format!("{} parameters", grouped(model.network_parameters))));
    }
    let parts = [
        ("base", bytes.base),
        ("levels", bytes.levels),
        ("features", bytes.features),
        ("network", bytes.network),
        ("metric", bytes.metric),
        ("scalars", bytes.scalars),
    ];
    let parts = parts.into_iter().filter(|(_, bytes)| *bytes > 0);
    let parts: Vec<String> = parts.map(|(name, bytes)| format!("{name} {}", grouped(bytes))).collect();
    if let Some(metric) = &model.metric {
        let area = readable(metric.area);
        rows.push((
            "metric",
            format!("the true surface has an area of {area}; distances take its power {}", metric.exponent),
        ));
    }
    rows.extend([
        (
            "box",
            format!(
                "centre {}, 1 unit of the box is {}",
                model.center.map(readable).join(" "),
                readable(model.scale.recip())
            ),
        ),
        ("bytes", format!("{} ({})", grouped(bytes.total), parts.join(", "))),
    ]);
    if !model.scalars.is_empty() {
        rows.push(("scalars", model.scalars.join(", ")));
    }
    format!("{}\n{}", model.kind, table(&rows))
}

fn of_checkpoint(checkpoint: &CheckpointDescription) -> String {
    let made = format!("{} of {}", grouped(checkpoint.rounds), grouped(checkpoint.of));
    let mut rows = vec![
        ("field", checkpoint.field.to_owned()),
        ("rounds of training", made),
        (
            "base mesh",
            format!(
                "{} vertices, {} faces",
                grouped(checkpoint.base_vertices),
                grouped(checkpoint.base_faces)
            ),
        ),
    ];
    if let (Some(wanted), Some(attempts)) = (checkpoint.wanted, checkpoint.attempts) {
        let wanted = 100.0 * wanted;
        rows.push(("search", format!("for {wanted} % of the diagonal, after {attempts} attempts")));
    }
    format!("{}\n{}", checkpoint.kind, table(&rows))
}

fn extent(bounds: &Corners, diagonal: f64) -> String {
    let extent = [0, 1, 2].map(|k| readable(bounds.max[k] - bounds.min[k])).join(" × ");
    format!("{extent}, diagonal {}", readable(diagonal))
}

fn flips(delaunay: &Delaunay) -> String {
    let share = 100.0 * delaunay.fraction;
    match delaunay.flips {
        0 => "yes".to_owned(),
        1 => format!("but for 1 flip; {share:.2} % of the edges are"),
        n => format!("but for {} flips; {share:.2} % of the edges are", grouped(n)),
    }
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
fn defects(report: &ValidationReport, is_inward: bool) -> Vec<String> {
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
    if is_inward {
        all.push("the faces are oriented inward".to_owned());
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_mesh::io::parse_mesh;
    use std::path::Path;

    #[test]
    fn every_defect_is_listed_at_once() {
        let file = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\nv 0 0 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\nf 1 1 2\nf 2 3 2\n";
        let file = parse_mesh(file.as_bytes(), Path::new("a")).unwrap();
        let text = of_mesh(&MeshDescription::of(&file));
        for said in ["1 edge with 3 faces", "name a vertex twice", "no face uses", "same place as another"] {
            assert!(text.contains(said), "{text} lacks {said}");
        }
    }
}
