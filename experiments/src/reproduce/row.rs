//! A run of an experiment: what was computed, how far it is from the truth, and what it cost.

use ndf::evaluate::{DistanceErrors, Errors};
use serde::{Deserialize, Serialize};

use super::shapes::{Role, Shape};
use crate::rows::Row;

/// A line of an experiment's file. Lengths are in units of the shape, errors are shares of 1, seconds are wall seconds; what does not
/// apply is empty. A run that could not be had says why in `left_out`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Run {
    pub(crate) shape: String,
    /// What represents the shape.
    pub(crate) kind: String,
    pub(crate) method: String,
    /// What tells runs of the method apart: `h = 0.02`, or `2000 faces`.
    pub(crate) setting: String,
    /// What is sent to the client.
    pub(crate) bytes: Option<usize>,
    pub(crate) vertices: Option<usize>,
    pub(crate) faces: Option<usize>,
    /// Pairs of faces that pass through each other.
    pub(crate) self_intersections: Option<u64>,
    /// Points at which the field was asked on the client.
    pub(crate) evaluations: Option<u64>,
    /// L¹ error of geodesics from the truth's sources, carried over: its length, its share of the mean distance, the largest.
    pub(crate) geodesic: Option<f64>,
    pub(crate) geodesic_share: Option<f64>,
    pub(crate) geodesic_max: Option<f64>,
    /// The same from the mesh's own closest points to the corners of the box, the supplement's rule.
    pub(crate) own_geodesic: Option<f64>,
    pub(crate) own_geodesic_share: Option<f64>,
    pub(crate) own_geodesic_max: Option<f64>,
    /// Relative errors of the eigenvalues but the first.
    pub(crate) eigenvalues: Option<f64>,
    pub(crate) eigenvalues_max: Option<f64>,
    /// Errors of modes after matching.
    pub(crate) modes: Option<f64>,
    pub(crate) modes_max: Option<f64>,
    /// Of models with a metric, without it.
    pub(crate) geodesic_share_plain: Option<f64>,
    pub(crate) eigenvalues_plain: Option<f64>,
    /// Making of the file, not on the client.
    pub(crate) seconds_making: Option<f64>,
    /// On the client: asking the field, extracting or decoding the mesh, solving either task, values at the truth's vertices.
    pub(crate) seconds_queries: Option<f64>,
    pub(crate) seconds_extraction: Option<f64>,
    pub(crate) seconds_geodesics: Option<f64>,
    pub(crate) seconds_eigenvalues: Option<f64>,
    pub(crate) seconds_transfer: Option<f64>,
    /// How often the solves were timed; their medians count.
    pub(crate) repeats: Option<usize>,
    pub(crate) seed: Option<u64>,
    /// How the truth was made.
    pub(crate) truth: String,
    /// What else ran on the machine: mean number of runnable processes over a minute, this one's threads included.
    pub(crate) load: Option<f64>,
    /// Why there are no figures.
    pub(crate) left_out: String,
}

impl Row for Run {
    fn key(&self) -> String {
        key(&self.shape, Role::of_kind(&self.kind), &self.method, &self.setting)
    }
}

/// What stands for the method where an experiment failed as a whole.
pub(super) const ALL_METHODS: &str = "all methods";

/// What tells a run from others of its experiment: a mesh and the network that was made of it may have one name.
pub(super) fn key(shape: &str, role: Role, method: &str, setting: &str) -> String {
    format!("{shape}; {role:?}; {method}; {setting}")
}

/// What is computed on a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Task {
    Geodesics,
    Eigenvalues,
}

impl Task {
    pub(crate) const ALL: [Self; 2] = [Self::Geodesics, Self::Eigenvalues];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Geodesics => "geodesics",
            Self::Eigenvalues => "eigenvalues",
        }
    }
}

impl Run {
    /// A run that cannot be had.
    pub(super) fn left_out(shape: &Shape, method: &str, reason: &str) -> Self {
        Self {
            shape: shape.name.clone(),
            kind: format!("{:?}", shape.role).to_lowercase(),
            method: method.to_owned(),
            left_out: reason.to_owned(),
            load: load(),
            ..Self::default()
        }
    }

    /// The shape and its kind.
    pub(crate) fn subject(&self) -> String {
        format!("{} ({})", self.shape, self.kind)
    }

    /// The error by which methods are judged.
    pub(crate) fn error(&self, task: Task) -> Option<f64> {
        match task {
            Task::Geodesics => self.geodesic_share,
            Task::Eigenvalues => self.eigenvalues,
        }
    }

    /// Seconds on the client: queries, extraction, solve and transfer.
    pub(crate) fn client_seconds(&self, task: Task) -> Option<f64> {
        let solve = match task {
            Task::Geodesics => self.seconds_geodesics,
            Task::Eigenvalues => self.seconds_eigenvalues,
        };
        let of = |seconds: Option<f64>| seconds.unwrap_or(0.0);
        Some(of(self.seconds_queries) + self.seconds_extraction? + solve? + of(self.seconds_transfer))
    }

    pub(super) fn put_errors(&mut self, errors: &Errors, plain: &Errors) {
        let put = |found: Option<DistanceErrors>, into: [&mut Option<f64>; 3]| {
            let values = found.map(|e| [e.mean(), e.share(), e.max()]);
            into.into_iter().enumerate().for_each(|(k, place)| *place = values.map(|v| v[k]));
        };
        put(errors.distances_carried, [&mut self.geodesic, &mut self.geodesic_share, &mut self.geodesic_max]);
        put(
            errors.distances_own,
            [&mut self.own_geodesic, &mut self.own_geodesic_share, &mut self.own_geodesic_max],
        );
        self.eigenvalues = Some(errors.eigenvalues.mean);
        self.eigenvalues_max = Some(errors.eigenvalues.max);
        self.modes = Some(errors.modes.mean);
        self.modes_max = Some(errors.modes.max);
        if plain != errors {
            self.geodesic_share_plain = plain.distances_carried.map(|e| e.share());
            self.eigenvalues_plain = Some(plain.eigenvalues.mean);
        }
    }
}

/// The load of the machine; `None` where the system does not tell.
pub(super) fn load() -> Option<f64> {
    std::fs::read_to_string("/proc/loadavg").ok()?.split(' ').next()?.parse().ok()
}
