//! Learning between two iterations, and its part of checkpoint files.

use std::sync::Arc;
use std::time::Duration;

use ndf_core::{DVec3, Hint};
use ndf_mesh::io::FileDefect;
use ndf_mesh::{ManifoldMesh, TriangleMesh};
use ndf_model::Similarity;
use ndf_model::levels::{GateWeights, MAX_DISPLACEMENT, MAX_POSITION, check_size};
use serde::{Deserialize, Serialize};

use super::descent::{Kept, LevelState, State};
use super::options::{Budget, LevelOptions};
use super::plan::Plan;
use super::run::{KeptRun, Sharpness};
use crate::checkpoint::{CheckpointError, Parts, time_of};

/// The learning of levels at the start of an iteration: enough to go on exactly as if it had not been interrupted.
#[derive(Clone, Debug)]
pub struct LevelCheckpoint {
    pub(super) options: LevelOptions,
    pub(super) similarity: Similarity,
    /// In the box.
    pub(super) base: ManifoldMesh,
    pub(super) iteration: usize,
    pub(super) runs: Vec<KeptRun>,
    /// Wall time of learning.
    pub(super) time: Duration,
    /// Where the search for a distance is, if the run is part of one.
    pub search: Option<Search>,
}

/// Where a search for the fewest bytes of a distance is.
#[derive(Clone, Debug, PartialEq)]
pub struct Search {
    /// The mean distance that is wanted, as a share of the surface's diagonal.
    pub wanted: f64,
    /// Whether every size has a base mesh of its own.
    pub suits_base: bool,
    /// What was tried before this run. Their models are not kept: if the best of them is that of the whole search, it is
    /// learned again.
    pub attempts: Vec<Attempt>,
}

/// A size that was tried in a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attempt {
    /// Bytes that were asked for.
    pub asked: usize,
    /// Bytes of base mesh and levels that came out.
    pub bytes: usize,
    /// Their mean distance, as a share of the surface's diagonal.
    pub mean: f64,
}

/// The part of a checkpoint that is words and counts.
#[derive(Serialize, Deserialize)]
pub(crate) struct Header {
    levels: Option<usize>,
    budget: BudgetName,
    iterations: [usize; 2],
    seed: u64,
    iteration: usize,
    seconds: f64,
    /// Base vertices and faces.
    base: [usize; 2],
    runs: Vec<RunHeader>,
    search: Option<SearchHeader>,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum BudgetName {
    PerFace,
    Bytes,
    Price,
}

#[derive(Serialize, Deserialize)]
struct RunHeader {
    sharpness: Sharpness,
    bytes: [usize; 2],
    gate_weights: Option<GateWeights>,
    displacements: Vec<usize>,
    /// Points of the finest level, and after them those of its boundary.
    points: usize,
    /// Whether their feet are of the last iteration.
    is_fresh: bool,
}

#[derive(Serialize, Deserialize)]
struct SearchHeader {
    suits_base: bool,
    /// Bytes asked for, and what came out.
    attempts: Vec<[usize; 2]>,
}

impl LevelCheckpoint {
    /// What the run was asked for.
    pub fn options(&self) -> &LevelOptions {
        &self.options
    }

    /// The base mesh in the box.
    pub fn base(&self) -> &ManifoldMesh {
        &self.base
    }

    /// From the surface's coordinates to the box.
    pub fn similarity(&self) -> Similarity {
        self.similarity
    }

    /// Which runs are still tried.
    pub fn runs(&self) -> Vec<Sharpness> {
        self.runs.iter().map(|run| run.sharpness).collect()
    }

    /// Iterations made, and those to be made in all.
    pub fn iterations(&self) -> [usize; 2] {
        [self.iteration, Plan::new(&self.options, &self.base).all]
    }

    /// What is left of its time limit, if it has one.
    pub fn time_left(&self) -> Option<Duration> {
        self.options.time_limit.map(|limit| limit.saturating_sub(self.time))
    }

    /// The same, to go on for at most so long, or to the end: the limit of the run before does not count.
    #[must_use]
    pub fn with_time_limit(mut self, limit: Option<Duration>) -> Self {
        self.options.time_limit = limit.map(|limit| self.time.saturating_add(limit));
        self
    }

    /// Header and numbers: those of the budget, the similarity, the positions of the base mesh, its faces, and mean distances
    /// that were searched and tried; then of every run λ, proximity, spacing of the grid, control vertices, their
    /// integers on the grid, of every level step, integers and displacements; hints and feet. Integers and
    /// hints take 4 bytes, all others 8.
    pub(crate) fn to_parts(&self) -> (Header, Vec<u8>) {
        let (budget, asked) = match self.options.budget {
            Budget::PerFace(bytes) => (BudgetName::PerFace, bytes),
            Budget::Bytes(bytes) => (BudgetName::Bytes, bytes as f64),
            Budget::Price(price) => (BudgetName::Price, price),
        };
        let search = self.search.as_ref().map(|search| SearchHeader {
            suits_base: search.suits_base,
            attempts: search.attempts.iter().map(|a| [a.asked, a.bytes]).collect(),
        });
        let runs = self.runs.iter().map(|run| RunHeader {
            sharpness: run.sharpness,
            bytes: run.sizes,
            gate_weights: run.descent.grid.map(|(_, weights)| weights),
            displacements: run.descent.state.levels.iter().map(|(_, integers, _)| integers.len()).collect(),
            points: run.descent.feet.len(),
            is_fresh: run.descent.is_fresh,
        });
        let header = Header {
            levels: self.options.levels,
            budget,
            iterations: self.options.iterations,
            seed: self.options.seed,
            iteration: self.iteration,
            seconds: self.time.as_secs_f64(),
            base: [self.base.vertex_count(), self.base.face_count()],
            runs: runs.collect(),
            search,
        };
        let mut numbers = Numbers::default();
        numbers.double(asked);
        numbers.double(self.similarity.scale());
        numbers.points(&[self.similarity.center()]);
        numbers.points(self.base.positions());
        numbers.integers(self.base.faces().as_flattened().iter().copied());
        if let Some(search) = &self.search {
            numbers.double(search.wanted);
            search.attempts.iter().for_each(|attempt| numbers.double(attempt.mean));
        }
        for KeptRun { lambda, descent, .. } in &self.runs {
            numbers.double(*lambda);
            numbers.double(descent.proximity);
            descent.grid.iter().for_each(|(spacing, _)| numbers.double(*spacing));
            numbers.points(&descent.state.control);
            let gridded = descent.state.gridded.iter().flatten().flatten();
            numbers.integers(gridded.map(|q| q.cast_unsigned()));
            for (step, integers, values) in &descent.state.levels {
                numbers.double(*step);
                numbers.integers(integers.iter().map(|q| q.cast_unsigned()));
                values.iter().for_each(|&x| numbers.double(x));
            }
            numbers.integers(descent.hints.iter().map(|hint| hint.0));
            descent.feet.iter().for_each(|foot| numbers.points(&foot.unwrap_or([DVec3::NAN; 3])));
        }
        (header, numbers.0)
    }

    pub(crate) fn from_parts(header: Header, mut parts: Parts<'_>) -> Result<Self, CheckpointError> {
        let asked = parts.double()?;
        let budget = match header.budget {
            BudgetName::PerFace => Budget::PerFace(asked),
            BudgetName::Bytes => Budget::Bytes(asked as usize),
            BudgetName::Price => Budget::Price(asked),
        };
        let (levels, iterations, seed) = (header.levels, header.iterations, header.seed);
        let options = LevelOptions { levels, budget, iterations, seed, time_limit: None };
        budget.validate()?;
        let similarity = Similarity::new(parts.double()?, parts.points(1)?[0])
            .map_err(|e| FileDefect::value(e.to_string()))?;
        let [vertices, faces] = header.base;
        let positions = parts.points(vertices)?;
        let corners: Vec<u32> = parts.integers(faces.saturating_mul(3))?.collect();
        let faces = corners.as_chunks().0.to_vec();
        let is_in_box = positions.iter().all(|p| p.is_finite() && p.abs().max_element() <= 2.0);
        let mesh = TriangleMesh::new(positions, faces).ok().filter(|_| is_in_box);
        let base = mesh.and_then(|mesh| ManifoldMesh::try_from(mesh).ok());
        let base = base.ok_or_else(|| FileDefect::value("its base mesh is none"))?;
        check_size(&base, options.levels_above(&base)).map_err(super::LevelFitError::from)?;
        let search = match header.search {
            None => None,
            Some(search) => Some(Search {
                suits_base: search.suits_base,
                wanted: parts.double()?,
                attempts: search
                    .attempts
                    .into_iter()
                    .map(|[asked, bytes]| Ok(Attempt { asked, bytes, mean: parts.double()? }))
                    .collect::<Result<_, CheckpointError>>()?,
            }),
        };
        if search.as_ref().is_some_and(|search| !(search.wanted > 0.0 && search.wanted < 1.0)) {
            return Err(FileDefect::value("the distance it looks for is no share").into());
        }
        let plan = Plan::new(&options, &base);
        if header.runs.is_empty() || header.iteration > plan.all {
            return Err(FileDefect::mismatch("its iterations and runs do not fit").into());
        }
        let shape = RunShape::new(&base, &plan, header.iteration);
        let runs =
            header.runs.into_iter().map(|run| shape.read(run, &mut parts)).collect::<Result<_, _>>()?;
        parts.end()?;
        let time = time_of(header.seconds)?;
        Ok(Self { options, similarity, base, iteration: header.iteration, runs, time, search })
    }
}

/// The sizes of all parts of a run.
struct RunShape {
    vertices: usize,
    displacements: Vec<usize>,
    points: usize,
    is_gridded: bool,
}

impl RunShape {
    fn new(base: &ManifoldMesh, plan: &Plan, iteration: usize) -> Self {
        let [mut vertices, mut edges, mut faces] =
            [base.vertex_count(), base.topology().edge_count(), base.face_count()];
        let levels = plan.levels[usize::from(iteration > plan.refined)];
        let mut displacements = Vec::new();
        let mut boundary = base.topology().boundary_edge_count();
        for level in 0..=levels {
            if level < levels {
                displacements.push(edges);
            }
            [vertices, edges, faces] = [vertices + edges, 2 * edges + 3 * faces, 4 * faces];
            boundary *= 2;
        }
        Self {
            vertices: base.vertex_count(),
            displacements,
            points: vertices + boundary,
            is_gridded: iteration > plan.gridded,
        }
    }

    fn read(&self, header: RunHeader, parts: &mut Parts<'_>) -> Result<KeptRun, CheckpointError> {
        if header.displacements != self.displacements
            || header.points != self.points
            || header.gate_weights.is_some() != self.is_gridded
        {
            return Err(FileDefect::mismatch("its runs do not fit its base mesh").into());
        }
        let (lambda, proximity) = (parts.double()?, parts.double()?);
        let grid = match header.gate_weights {
            None => None,
            Some(weights) => Some((parts.double()?, weights)),
        };
        let control = parts.points(self.vertices)?;
        let gridded = match grid {
            None => None,
            Some(_) => {
                let integers: Vec<i32> = parts.integers(3 * self.vertices)?.map(u32::cast_signed).collect();
                Some(integers.as_chunks().0.to_vec())
            }
        };
        let mut levels: Vec<LevelState> = Vec::new();
        for &count in &self.displacements {
            let step = parts.double()?;
            let integers = parts.integers(count)?.map(u32::cast_signed).collect();
            levels.push((step, integers, parts.doubles(count)?));
        }
        let hints = parts.integers(self.points)?.map(Hint).collect();
        let places = parts.points(3 * self.points)?;
        let foot = |foot: &[DVec3; 3]| foot.iter().all(|p| p.is_finite()).then_some(*foot);
        let feet = Arc::new(places.as_chunks().0.iter().map(foot).collect());
        let is_positive = |x: f64| x.is_finite() && x > 0.0;
        let is_sound =
            [lambda, proximity].into_iter().chain(grid.map(|(spacing, _)| spacing)).all(is_positive)
                && control.iter().all(|p| p.is_finite())
                && gridded.iter().flatten().flatten().all(|q: &i32| q.unsigned_abs() <= MAX_POSITION as u32)
                && levels.iter().all(|(step, integers, values)| {
                    is_positive(*step)
                        && integers.iter().all(|q: &i32| q.unsigned_abs() <= MAX_DISPLACEMENT as u32)
                        && values.iter().all(|x| x.is_finite())
                });
        if !is_sound {
            return Err(FileDefect::value("a number of its runs is out of range").into());
        }
        let state = State { control, gridded, levels };
        let descent = Kept { state, grid, proximity, hints, feet, is_fresh: header.is_fresh };
        Ok(KeptRun { sharpness: header.sharpness, lambda, sizes: header.bytes, descent })
    }
}

#[derive(Default)]
struct Numbers(Vec<u8>);

impl Numbers {
    fn double(&mut self, x: f64) {
        self.0.extend(x.to_le_bytes());
    }

    fn points(&mut self, points: &[DVec3]) {
        points.iter().flat_map(DVec3::to_array).for_each(|x| self.double(x));
    }

    fn integers(&mut self, integers: impl Iterator<Item = u32>) {
        self.0.extend(integers.flat_map(u32::to_le_bytes));
    }
}
