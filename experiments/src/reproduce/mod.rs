//! The experiments of the paper's supplement: `cargo xtask reproduce`.
//!
//! Each experiment has a CSV file, a line a run. A run that is made again takes the place of the earlier one, a run that cannot be
//! had says why, and files are written after every run: one that is stopped loses no more than the run it was at. Plots and the
//! page are made from these files alone.

mod check;
mod compression;
mod fits;
mod isosurfacing;
mod joined;
mod measuring;
mod page;
mod pareto;
mod row;
mod runs;
mod scale;
mod shapes;
mod teaser;
mod truth;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};

use crate::root;
use fits::{Learned, model};
use row::{ALL_METHODS, Run};
use runs::Runs;
use scale::Scale;
use shapes::{Role, Shape};
use truth::Subject;

/// An experiment of the supplement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Experiment {
    /// Meshes extracted from networks of distances (§2.2, Fig. 8)
    Isosurfacing,
    /// The same from winding numbers of clouds (§2.2.1)
    Winding,
    /// Compressed meshes (§2.3, Fig. 10)
    Compression,
    /// Decimated meshes, compressed by Draco (§2.5, Fig. 19)
    Draco,
    /// All of these in one plot (§2.4)
    Plot3d,
    /// Scalar fields (§2.6, Fig. 21), joined from docs/scalars
    Scalars,
    /// Ablations (§3.1 and §3.3, Figs. 1 and 2), joined from docs/ablation
    Ablations,
    /// Cycle consistency of closed meshes (§3.2)
    Cycle,
    /// Run times of training (§3.4, Table 1)
    Runtimes,
    /// Pictures of modes, distances and heat on other representations (the paper's first figure)
    Teaser,
}

/// What to run.
#[derive(Args)]
pub(crate) struct Options {
    /// A subset, meant for ten minutes on two cores: no run begins after seven; it is written to target/experiments-quick
    #[arg(long)]
    quick: bool,
    /// Experiments to run [default: all]
    #[arg(long, value_enum, num_args = 1..)]
    only: Vec<Experiment>,
    /// Make only the runs that are not there yet
    #[arg(long)]
    missing: bool,
    /// A list of shapes: lines of network, cloud, mesh or density and a path [default: those of the folders, and some made by code]
    #[arg(long)]
    shapes: Option<PathBuf>,
    /// The folder with mesh/, points_oriented/, splat/ and nerf/
    #[arg(long, default_value = "../shared/data")]
    data: PathBuf,
    /// The folder with networks of experiments/neus/train.py
    #[arg(long, default_value = "target/neus")]
    networks: PathBuf,
    /// Where results go [default: docs/experiments, or target/experiments-quick]
    #[arg(long)]
    out: Option<PathBuf>,
    /// Weights of NDCx, which experiments/ndc/train.py makes; without, its runs are left out
    #[arg(long)]
    ndc_weights: Option<PathBuf>,
    /// A Python interpreter with DracoPy (experiments/peers); without, runs of Draco are left out
    #[arg(long)]
    python: Option<PathBuf>,
    /// Start no run after so many minutes [default: no limit; 7 for --quick]
    #[arg(long)]
    minutes: Option<f64>,
    /// The folder with plotly-gl3d.min.js and its LICENSE; without, npm fetches them
    #[arg(long)]
    plotly: Option<PathBuf>,
    /// Only make plots and page again from the results
    #[arg(long)]
    page: bool,
    /// Compare the error protocol with its independent implementation in Python, and do nothing else
    #[arg(long, requires = "python")]
    check_protocol: bool,
}

/// What runs need to know.
pub(crate) struct Setup {
    scale: Scale,
    /// Where results go.
    out: PathBuf,
    /// Where models and truths are kept.
    cache: PathBuf,
    data: PathBuf,
    missing: bool,
    ndc_weights: Option<PathBuf>,
    python: Option<PathBuf>,
    deadline: Option<Instant>,
}

impl Setup {
    /// Whether no further run is to be started.
    fn is_over(&self) -> bool {
        self.deadline.is_some_and(|deadline| Instant::now() > deadline)
    }
}

/// Minutes after which the quick subset starts no run: the last one, and the page, have some more.
const QUICK_MINUTES: f64 = 7.0;

/// Runs what is asked for.
pub(crate) fn run(options: &Options) -> Result<(), String> {
    if let (true, Some(python)) = (options.check_protocol, &options.python) {
        return check::run(python);
    }
    let usual_out = if options.quick { "target/experiments-quick" } else { "docs/experiments" };
    let minutes = options.minutes.or(options.quick.then_some(QUICK_MINUTES));
    let setup = Setup {
        scale: if options.quick { Scale::QUICK } else { Scale::FULL },
        out: root().join(options.out.as_deref().unwrap_or(Path::new(usual_out))),
        cache: root().join("target/experiments/reproduce"),
        data: root().join(&options.data),
        missing: options.missing,
        ndc_weights: options.ndc_weights.clone(),
        python: options.python.clone(),
        deadline: minutes.map(|minutes| Instant::now() + Duration::from_secs_f64(60.0 * minutes)),
    };
    std::fs::create_dir_all(&setup.out).map_err(|e| format!("{}: {e}", setup.out.display()))?;
    if !options.page {
        let all = match &options.shapes {
            Some(list) => shapes::listed(list)?,
            None => shapes::usual(&setup.data, &root().join(&options.networks)),
        };
        let wanted = |experiment| options.only.is_empty() || options.only.contains(&experiment);
        if let Some(text) = setup.scale.left_out() {
            eprintln!("{text}");
        }
        make(&setup, &all, &wanted)?;
    }
    page::write(&setup, options.plotly.as_deref())
}

/// Makes runs: of the first shape of each role in all experiments, then of the second, and so on, so that a run that is stopped has
/// some of each experiment.
fn make(setup: &Setup, all: &[Shape], wanted: &dyn Fn(Experiment) -> bool) -> Result<(), String> {
    let of_role = |role| all.iter().filter(move |shape| shape.role == role).take(setup.scale.shapes);
    let mut roles = [Role::Mesh, Role::Network, Role::Cloud].map(|role| of_role(role).collect::<Vec<_>>());
    let longest = roles.iter().map(Vec::len).max().unwrap_or_default();
    for turn in 0..longest {
        for shapes in &mut roles {
            let Some(shape) = shapes.get(turn) else { continue };
            of_shape(shape, setup, wanted)?;
        }
    }
    let meshes: Vec<&Shape> = of_role(Role::Mesh).collect();
    if wanted(Experiment::Runtimes) {
        of_models(setup, roles.iter().filter_map(|shapes| shapes.first().copied()))?;
    }
    if wanted(Experiment::Cycle) {
        of_models(setup, meshes.iter().copied())?;
    }
    if wanted(Experiment::Teaser) {
        teaser::run(setup, all)?;
    }
    if setup.scale.is_quick && wanted(Experiment::Ablations) && !setup.is_over() {
        joined::quick_ablations(setup)?;
    }
    if setup.scale.is_quick && wanted(Experiment::Scalars) && !setup.is_over() {
        joined::quick_scalars(setup)?;
    }
    if setup.is_over() {
        eprintln!("time is up: what was not begun is left out (--missing goes on, --minutes sets the time)");
    }
    joined::write(setup)
}

/// What is run of a shape.
type RunAll = fn(&Subject<'_>, &Setup, &mut Runs) -> Result<(), String>;

/// Isosurfacing, compression and Draco, as a shape's role has it. Compressed meshes of networks are there for the plot of everything.
/// What ends an experiment on this shape is kept as the reason of a run.
fn of_shape(shape: &Shape, setup: &Setup, wanted: &dyn Fn(Experiment) -> bool) -> Result<(), String> {
    let subject = Subject::new(shape, setup);
    let experiments: &[(Experiment, RunAll)] = match shape.role {
        Role::Network if setup.scale.is_quick => &[(Experiment::Isosurfacing, isosurfacing::run)],
        Role::Network => {
            &[(Experiment::Isosurfacing, isosurfacing::run), (Experiment::Compression, compression::rivals)]
        }
        Role::Cloud => &[(Experiment::Winding, isosurfacing::run)],
        Role::Mesh => &[(Experiment::Compression, compression::run), (Experiment::Draco, compression::draco)],
        Role::Density => &[],
    };
    for &(experiment, run) in experiments.iter().filter(|(experiment, _)| wanted(*experiment)) {
        let mut runs = Runs::open(setup, experiment)?;
        match run(&subject, setup, &mut runs) {
            Ok(()) => runs.forget_failure(shape)?,
            Err(reason) => runs.put(Run::left_out(shape, ALL_METHODS, &reason))?,
        }
    }
    Ok(())
}

/// Models of shapes: levels of a middle size, a network, and one with the preset of the paper.
fn of_models<'a>(setup: &Setup, shapes: impl Iterator<Item = &'a Shape>) -> Result<(), String> {
    for shape in shapes {
        for learned in [Learned::Levels(setup.scale.sizes[0]), Learned::Network, Learned::Paper] {
            if setup.is_over() {
                return Ok(());
            }
            if let Err(reason) = model(shape, learned, setup) {
                fits::put_left_out(shape, learned, setup, reason)?;
            }
        }
    }
    Ok(())
}
