//! Progress on the error stream: one for a command, which only grows.

use super::{Folder, ndf};

/// The per cents and stages that were told, and whether with a forecast.
fn told(stderr: &str) -> Vec<(u32, &str, bool)> {
    let part = |line| {
        let (percent, rest) = str::split_once(line, " %: ")?;
        Some((percent.parse().ok()?, rest.split(',').next()?, line.contains(" left")))
    };
    stderr.lines().filter_map(part).collect()
}

/// The field of splats is sampled in many passes.
#[test]
fn progress_only_grows_and_forecasts_are_of_the_longest_stage() {
    let folder = Folder::new("progress");
    ndf(&folder.0, &["sample", "splats", "--shape", "torus", "--points", "8000", "-o", "a.ply", "--json"])
        .json();
    let run = ndf(&folder.0, &["fit", "a.ply", "-o", "a.ndf", "--time-limit", "8"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let told = told(&run.stderr);
    assert!(told.len() > 2, "{}", run.stderr);
    assert!(told.windows(2).all(|pair| pair[0].0 <= pair[1].0), "{}", run.stderr);
    assert!(
        told.iter().all(|(percent, stage, forecast)| *percent <= 100 && (!forecast || *stage == "levels"))
    );
}
