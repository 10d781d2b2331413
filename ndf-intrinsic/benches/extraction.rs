//! Times and figures of extraction from a model: `cargo bench -p ndf-intrinsic --bench extraction -- MODEL.ndf H…`.

use std::path::Path;
use std::time::Instant;

use ndf_core::Model;
use ndf_intrinsic::{ExtractionOptions, extract};

fn main() {
    let mut arguments = std::env::args().skip(1).filter(|a| !a.starts_with("--"));
    let Some(path) = arguments.next() else {
        eprintln!("give a model and edge lengths");
        return;
    };
    let model = match Model::read(Path::new(&path)) {
        Ok(model) => model,
        Err(error) => {
            eprintln!("{path}: {error}");
            return;
        }
    };
    for h in arguments.filter_map(|a| a.parse::<f64>().ok()) {
        let start = Instant::now();
        match extract(&model.field, &ExtractionOptions::new(h)) {
            Ok(extraction) => {
                let seconds = start.elapsed().as_secs_f64();
                let r = extraction.report;
                eprintln!(
                    "h {h}: {} faces, {seconds:.3} s, {:.0} k faces/s, holds {}, embedded {:.5}, angles {:.1} {:.1} {:.1}, \
                     longest {:.2} h, rounds {}, splits {}, collapses {}, flips {} + {}, simplicial {}",
                    r.faces,
                    r.faces as f64 / seconds / 1e3,
                    r.holds(),
                    r.delaunay_embedded_fraction,
                    r.min_angle_deg.min,
                    r.min_angle_deg.p5,
                    r.min_angle_deg.median,
                    r.longest_in_h,
                    r.rounds,
                    r.splits,
                    r.collapses,
                    r.chord_flips,
                    r.intrinsic_flips,
                    r.embeds_intrinsic,
                );
            }
            Err(error) => eprintln!("h {h}: {error}"),
        }
    }
}
