//! The runs of an experiment that are there, and which are wanted.

use std::time::Instant;

use clap::ValueEnum;

use super::row::{ALL_METHODS, Run, key};
use super::shapes::Shape;
use super::{Experiment, Setup};
use crate::rows::Rows;

/// What ends a reason that an option would remove: such runs are tried again.
const OPTION: &str = "(--";

/// The file of an experiment.
pub(crate) struct Runs {
    rows: Rows<Run>,
    missing: bool,
    deadline: Option<Instant>,
}

impl Runs {
    /// The file of an experiment, which may not be there yet.
    pub(super) fn open(setup: &Setup, experiment: Experiment) -> Result<Self, String> {
        let file = setup.out.join(experiment.name()).with_extension("csv");
        Ok(Self { rows: Rows::open(file)?, missing: setup.missing, deadline: setup.deadline })
    }

    /// Whether a run is to be made.
    pub(super) fn wants(&self, shape: &Shape, method: &str, setting: &str) -> bool {
        let key = key(&shape.name, shape.role, method, setting);
        let is_there = self.rows.find(&key).is_some_and(|run| !run.left_out.contains(OPTION));
        let is_over = self.deadline.is_some_and(|deadline| Instant::now() > deadline);
        !(is_over || self.missing && is_there)
    }

    /// Keeps a run.
    pub(super) fn put(&mut self, run: Run) -> Result<(), String> {
        let Run { shape, method, setting, left_out, .. } = &run;
        let figure =
            |share: Option<f64>| share.map_or_else(String::new, |share| format!("{:.4} %", 100.0 * share));
        let (geodesics, eigenvalues) = (figure(run.geodesic_share), figure(run.eigenvalues));
        eprintln!(
            "{shape}: {method}, {setting}: geodesics {geodesics}, eigenvalues {eigenvalues} {left_out}"
        );
        self.rows.put(run)
    }

    /// Forgets that no method could be run on a shape.
    pub(super) fn forget_failure(&mut self, shape: &Shape) -> Result<(), String> {
        self.rows.remove(&key(&shape.name, shape.role, ALL_METHODS, ""))
    }

    pub(super) fn all(&self) -> &[Run] {
        self.rows.all()
    }
}

impl Experiment {
    pub(super) fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::reproduce::shapes::Role;

    #[test]
    fn runs_that_are_there_are_not_wanted_again_when_only_missing_ones_are() {
        let file = std::env::temp_dir().join(format!("ndf-runs-{}.csv", std::process::id()));
        let _ = fs::remove_file(&file);
        let open = |missing| Runs { rows: Rows::open(file.clone()).unwrap(), missing, deadline: None };
        let shape = Shape::of_file(Role::Mesh, "a.obj".into());
        let run = |setting: &str, left_out: &str| Run {
            shape: "a".into(),
            kind: "mesh".into(),
            method: "MC".into(),
            setting: setting.into(),
            left_out: left_out.into(),
            eigenvalues: Some(0.25),
            bytes: Some(7),
            ..Run::default()
        };
        let mut runs = open(true);
        runs.put(run("h = 1", "")).unwrap();
        runs.put(run("h = 2", "no crossing")).unwrap();
        runs.put(run("h = 3", "no weights were given (--ndc-weights)")).unwrap();
        // What was written is read again, and a run takes the place of its earlier one.
        let mut again = open(true);
        assert_eq!(again.all(), runs.all());
        let wanted = |runs: &Runs| ["h = 1", "h = 2", "h = 3", "h = 4"].map(|h| runs.wants(&shape, "MC", h));
        assert_eq!(wanted(&again), [false, false, true, true]);
        assert_eq!(wanted(&open(false)), [true; 4]);
        assert_eq!(wanted(&Runs { deadline: Some(Instant::now()), ..open(true) }), [false; 4]);
        again.put(Run { bytes: Some(8), ..run("h = 1", "") }).unwrap();
        assert_eq!((again.all().len(), open(true).all()[0].bytes), (3, Some(8)));
        // A network of the same name is another shape.
        assert!(again.wants(&Shape::of_file(Role::Network, "a.pth".into()), "MC", "h = 1"));
        // What failed as a whole is forgotten when it goes.
        again.put(Run::left_out(&shape, ALL_METHODS, "no rival")).unwrap();
        assert_eq!(again.all().len(), 4);
        again.forget_failure(&shape).unwrap();
        again.forget_failure(&shape).unwrap();
        assert_eq!(open(true).all().len(), 3);
        fs::remove_file(&file).unwrap();
    }
}
