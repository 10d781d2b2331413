//! The error protocol beside an independent implementation in Python (`experiments/peers/protocol.py`).

use std::path::Path;

use ndf::evaluate::{
    Averaging, Candidate, DistanceErrors, DistanceProtocol, Errors, ProtocolOptions, SourceRule, Truth,
};
use ndf_core::{DVec3, NoProgress};
use ndf_mesh::{ManifoldMesh, shapes};
use ndf_meshing::{DecimationOptions, decimate};
use ndf_model::LengthFactors;
use serde_json::Value;

use crate::performance::process::{PythonPeer, Scratch};

/// Relative differences up to this are rounding: of eigensolvers, and of windows of distances.
const ALLOWED: f64 = 1e-6;

/// Compares all errors of two pairs of meshes, prints them as a table, and fails if any two differ.
#[expect(clippy::print_stdout, reason = "the table that was asked for")]
pub(super) fn run(python: &Path) -> Result<(), String> {
    let scratch = Scratch::new()?;
    let mut peer = PythonPeer::start(python, "protocol.py", &[scratch.path().display().to_string()])?;
    println!(
        "| mesh | error | here | libigl, pygeodesic, SciPy | relative difference |\n|---|---|--:|--:|--:|"
    );
    let mut largest = 0.0_f64;
    let averagings = [("vertices", Averaging::Vertices), ("area", Averaging::Area)];
    let runs = pairs()?.into_iter().flat_map(|pair| averagings.map(|averaging| (pair.clone(), averaging)));
    for ((name, truth, candidate), (over, averaging)) in runs {
        scratch.write_mesh("truth", &truth)?;
        scratch.write_mesh("candidate", &candidate)?;
        let theirs = peer.ask(over)?;
        let distances = DistanceProtocol { averaging, ..DistanceProtocol::default() };
        let options = ProtocolOptions { distances, ..ProtocolOptions::default() };
        let truth = Truth::new(truth, &options, &NoProgress).map_err(|e| e.to_string())?;
        let solved = truth.solve(&Candidate::of_mesh(&candidate), &SourceRule::ALL, &NoProgress);
        let errors = truth.errors(&solved.map_err(|e| e.to_string())?, LengthFactors::ONE);
        for (error, ours) in figures(&errors) {
            let theirs =
                theirs.get(error).and_then(Value::as_f64).ok_or(format!("protocol.py: no {error}"))?;
            let difference = (ours / theirs - 1.0).abs();
            largest = largest.max(difference);
            println!("| {name}, over {over} | {error} | {ours:.10e} | {theirs:.10e} | {difference:.1e} |");
        }
    }
    println!("\nlargest relative difference {largest:.1e}, allowed {ALLOWED:.0e}; {}", peer.greeting);
    if largest <= ALLOWED { Ok(()) } else { Err("the protocol and its peer differ".to_owned()) }
}

/// A fine mesh and a coarse one of the same surface, twice: made by code, without symmetry.
fn pairs() -> Result<Vec<(&'static str, ManifoldMesh, ManifoldMesh)>, String> {
    let bump = |p: DVec3| {
        let waves = (5.0 * p.x + 1.0).sin() * (4.0 * p.y).sin() + 0.5 * (9.0 * p.z + p.x).sin();
        7.0 * p * (1.0 + 0.1 * waves) * DVec3::new(1.0, 1.2, 1.5)
    };
    let skew = |p: DVec3| p + 0.1 * DVec3::new((3.0 * p.y).sin(), p.z * p.x, (2.0 * p.x + 1.0).cos());
    let fine = [
        ("bumpy sphere", shapes::icosphere(4).map_positions(bump), 1200),
        ("skew knot", shapes::trefoil_knot(120, 18, 0.24).map_positions(skew), 1500),
    ];
    let pair = |(name, fine, faces)| {
        let fine = ManifoldMesh::try_from(fine).map_err(|e: ndf_mesh::NotManifold| e.to_string())?;
        let coarse = decimate(&fine, &DecimationOptions::to_faces(faces), &NoProgress).mesh;
        Ok((name, fine, coarse))
    };
    fine.into_iter().map(pair).collect()
}

/// The errors by the names that the peer has for them.
fn figures(errors: &Errors) -> Vec<(&'static str, f64)> {
    let mut figures = vec![
        ("eigenvalues", errors.eigenvalues.mean),
        ("eigenvalues_max", errors.eigenvalues.max),
        ("modes", errors.modes.mean),
        ("modes_max", errors.modes.max),
    ];
    let mut add = |names: [&'static str; 3], found: Option<DistanceErrors>| {
        figures.extend(found.into_iter().flat_map(|e| names.into_iter().zip([e.mean(), e.share(), e.max()])));
    };
    add(["carried_mean", "carried_share", "carried_max"], errors.distances_carried);
    add(["own_mean", "own_share", "own_max"], errors.distances_own);
    figures
}
