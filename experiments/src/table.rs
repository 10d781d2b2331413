//! The table of the README: what the default preset makes of real meshes.

use std::fmt::Write as _;
use std::path::Path;

use ndf::{BaseSource, EdgeLength, Field, Fit, ModelExt, OpenOptions};
use ndf_mesh::metrics::{MeasureOptions, measure};

use crate::document::replace_table;
use crate::root;

const MESHES: &[&str] =
    &["spot.obj", "armadillo_86k.obj", "fertility_9k.off", "skull_100k.obj", "rocker-arm.obj"];
const BASE_FACES: usize = 4000;
const EDGE_LENGTH: f64 = 0.01;

/// Fits every mesh that is there and rewrites the table.
pub(crate) fn run(data: &Path) -> Result<(), String> {
    let folder = root().join(data);
    let mut table = String::from(
        "| mesh | faces | base mesh, mean distance | learned surface | ratio | largest distance | flipped | training | model |\n\
         |---|--:|--:|--:|--:|--:|--:|--:|--:|\n",
    );
    for file in MESHES {
        let path = folder.join(file);
        if !path.exists() {
            return Err(format!("{} is not there; --data names the folder of the meshes", path.display()));
        }
        let row = row(file, &path)?;
        eprint!("{row}");
        table += &row;
    }
    replace_table(&root().join("README.md"), "cargo xtask table", &table)
}

fn row(name: &str, path: &Path) -> Result<String, String> {
    let say = |e: &dyn std::fmt::Display| format!("{name}: {e}");
    let opened = ndf::open(path, &OpenOptions::default()).map_err(|e| say(&e))?;
    let fitted = Fit::new(&opened).field(Field::Network).base_faces(BASE_FACES).run().map_err(|e| say(&e))?;
    let surface = fitted.model.extract(EdgeLength::Relative(EDGE_LENGTH)).map_err(|e| say(&e))?.mesh;
    let BaseSource::Manifold(reference) = &opened.base else {
        return Err(say(&"it is no clean manifold"));
    };
    let reference = &reference;
    let options = MeasureOptions::default();
    let base = measure(reference, &fitted.base, &options).map_err(|e| say(&e))?;
    let learned = measure(reference, &surface, &options).map_err(|e| say(&e))?;
    let share = |x: f64| 100.0 * x / learned.diagonal;
    let (before, after) = (base.mesh_to_reference.mean, learned.mesh_to_reference.mean);
    let (before_back, after_back) = (base.reference_to_mesh.mean, learned.reference_to_mesh.mean);
    let mut row = String::new();
    writeln!(
        row,
        "| {name} | {} | {:.4} / {:.4} % | {:.4} / {:.4} % | {:.3} / {:.3} | {:.2} → {:.2} % | {:.3} % | {:.0} s | {:.0} kB |",
        reference.face_count(),
        share(before),
        share(before_back),
        share(after),
        share(after_back),
        after / before,
        after_back / before_back,
        share(base.hausdorff),
        share(learned.hausdorff),
        100.0 * learned.flipped_fraction,
        fitted.report.seconds,
        fitted.model.section_sizes().total as f64 / 1000.0,
    )
    .expect("writing to a string does not fail");
    Ok(row)
}
