//! What all commands share: the common options, the streams and the way progress is shown.

use std::error::Error;
use std::fmt::Display;
use std::io;
use std::num::NonZero;
use std::path::Path;

use clap::Args;
use ndf::{HeatReport, Note, TriangleMesh};
use ndf_mesh::io::{Lines, Positions, VertexScalars, WriteError, write_lines, write_mesh_with};
use ndf_mesh::repair::RepairNote;

use crate::output::{Failure, Outcome, grouped, printable, readable};
use crate::progress::{Job, ShownProgress};
use crate::streams;

/// Options every command takes.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Common options")]
pub struct Options {
    /// Print one JSON object instead of a summary.
    #[arg(long, global = true)]
    pub json: bool,
    /// Show no progress.
    #[arg(long, global = true)]
    pub quiet: bool,
    /// Write positions in PLY files in double precision, also where single precision would do.
    #[arg(long, global = true)]
    pub double: bool,
    /// Number of threads [default: all cores].
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Seed of everything random: the same seed gives the same bytes, whatever the number of threads.
    #[arg(long, global = true, value_name = "N", default_value_t = 0)]
    pub seed: u64,
}

impl Options {
    /// Those that results depend on, as words of a command line.
    pub fn of_results(&self) -> Vec<String> {
        let mut words = Vec::new();
        if self.double {
            words.push("--double".to_owned());
        }
        if self.seed != 0 {
            words.push(format!("--seed={}", self.seed));
        }
        words
    }
}

/// More threads than this take over a machine without being of use to it.
const MAX_THREADS: usize = 1024;

/// The options and streams of one run.
#[derive(Debug)]
pub struct Context {
    options: Options,
    job: Job,
}

impl Context {
    /// A context with these options; starts the threads of the process, as many as are asked for, by `--threads` or
    /// `RAYON_NUM_THREADS`, but at most 1024.
    ///
    /// # Errors
    /// If they cannot be started.
    pub fn new(options: Options) -> Result<Self, Failure> {
        let of_environment = || std::env::var("RAYON_NUM_THREADS").ok()?.parse().ok().filter(|&n| n > 0);
        let threads = options.threads.map(usize::from).or_else(of_environment);
        let all_cores = || std::thread::available_parallelism().map_or(1, NonZero::get);
        let threads = threads.unwrap_or_else(all_cores).min(MAX_THREADS);
        let mut pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        if threads == 1 {
            // Where no thread can be started, one is there all the same.
            pool = pool.use_current_thread();
        }
        match pool.build_global() {
            // Without a source it is that the pool exists already, which then stays as it is.
            Err(error) if error.source().is_some() => Err(Failure::new(format!(
                "cannot start {threads} threads: {error}; try fewer with --threads"
            ))),
            _ => {
                let job = if options.quiet { Job::hidden() } else { Job::on_stderr() };
                Ok(Self { options, job })
            }
        }
    }

    /// The options.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Seed of everything random.
    pub fn seed(&self) -> u64 {
        self.options.seed
    }

    /// Says which stages are to come, before the first of them begins.
    pub fn expect(&self, stages: &[&str]) {
        self.job.expect(stages);
    }

    /// An observer that shows the progress of the job on the error stream, or nothing with `--quiet`.
    pub fn progress(&self) -> ShownProgress {
        ShownProgress::of(&self.job)
    }

    /// Tells the user, on the error stream, what is done where it was left open; not with `--quiet`.
    pub fn tell(&self, message: &str) {
        if !self.options.quiet {
            self.job.say(&format!("ndf: note: {}", printable(&streams::named(message))));
        }
    }

    /// Tells the user, on the error stream, something that did not stop the work.
    pub fn warn(&self, message: &str) {
        self.job.say(&format!("ndf: warning: {}", printable(&streams::named(message))));
    }

    /// Tells the user a note of the library on what is named, with the option that has to do with it.
    pub fn warn_of(&self, name: &dyn Display, note: &Note) {
        let advice = match note {
            Note::NormalsDisagree { .. } => " (--as oriented-cloud uses them)",
            Note::NoCode => " (--latent gives one)",
            Note::Repair(RepairNote::VerticesMerged { .. }) => " (--keep-seams leaves them apart)",
            Note::Diverged { .. } => "; try a smaller --lr",
            _ => "",
        };
        self.warn(&format!("{name}: {note}{advice}"));
    }

    /// Warns of vertices that heat does not reach: what of theirs is wrong, and what helps.
    pub fn warn_of_reach(&self, name: &dyn Display, heat: &HeatReport, what: &str, advice: &str) {
        if heat.out_of_reach > 0 {
            let vertices = grouped(heat.out_of_reach);
            self.warn(&format!(
                "{name}: heat does not reach {vertices} vertices, whose {what} are wrong; {advice}"
            ));
        }
    }

    /// Writes a mesh with scalars in the format that its name says. Warns where the format rounds its vertices visibly.
    ///
    /// # Errors
    /// If the name or a scalar is not usable, or the file cannot be written.
    pub fn write_mesh(
        &self,
        path: &Path,
        mesh: &TriangleMesh,
        scalars: &[VertexScalars],
    ) -> Result<(), WriteError> {
        let rounding = write_mesh_with(path, mesh, scalars, self.positions())?;
        if rounding.is_coarse() {
            self.warn(&format!(
                "{}: this format has single precision, which moved vertices by up to {}, far from the origin as they are; \
                 .ply, .glb and .obj keep them",
                path.display(),
                readable(rounding.moved)
            ));
        }
        Ok(())
    }

    /// Writes lines in the format that the name says.
    ///
    /// # Errors
    /// If the name is not usable, or the file cannot be written.
    pub fn write_lines(&self, path: &Path, lines: &Lines) -> Result<(), WriteError> {
        write_lines(path, lines, self.positions())
    }

    fn positions(&self) -> Positions {
        if self.options.double { Positions::Double } else { Positions::Suited }
    }

    /// Prints the outcome of the command to the standard output, as the options ask; or, if that has taken a file, the
    /// summary to the error stream.
    ///
    /// # Errors
    /// If it cannot be written for another reason than that its reader has gone.
    pub fn print(&self, outcome: &Outcome) -> Result<(), Failure> {
        let text = streams::named(&outcome.text);
        if streams::has_output() {
            text.lines().for_each(|line| self.job.say(&printable(line)));
            return Ok(());
        }
        let outcome = Outcome { json: outcome.json.clone(), text: text.into_owned() };
        let written = outcome.write(self.options.json, &mut io::stdout().lock());
        written.map_err(|e| Failure::new(format!("cannot write to the standard output: {e}")))
    }
}
