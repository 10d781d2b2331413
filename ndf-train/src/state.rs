//! What the training of a network has learned so far, and its part of checkpoint files.

use std::time::Duration;

use ndf_core::Hint;
use ndf_mesh::io::FileDefect;
use ndf_model::Model;
use ndf_model::file::{BaseOrder, Grids};
use ndf_network::Mlp;
use serde::{Deserialize, Serialize};

use crate::checkpoint::{CheckpointError, Parts, time_of};
use crate::engine::Learned;
use crate::engine::optimiser::Moments;
use crate::error::TrainError;
use crate::objective::Cycle;
use crate::plan::TermRecord;
use crate::settings::Settings;

/// Everything that changes from epoch to epoch.
#[derive(Clone, Debug)]
pub(crate) struct State {
    /// Features and g_θ.
    pub(crate) learned: Learned,
    /// The networks that terms brought along.
    pub(crate) companions: Vec<Companion>,
    /// Epochs made, those of the identity stage first.
    pub(crate) epoch: usize,
    /// Factor on the learning rate: halved when training diverges.
    pub(crate) rate_factor: f32,
}

/// A network that a term brought along.
#[derive(Clone, Debug)]
pub(crate) struct Companion {
    /// Name of the term.
    pub(crate) name: String,
    pub(crate) parameters: Vec<f32>,
    pub(crate) moments: Moments,
}

impl State {
    /// The network of the term of this name.
    pub(crate) fn companion(&mut self, name: &str) -> Option<&mut Companion> {
        self.companions.iter_mut().find(|companion| companion.name == name)
    }

    /// Takes a term's network in, unless it is there already.
    ///
    /// # Errors
    /// If it is there with another shape.
    pub(crate) fn join(&mut self, name: &str, network: &Mlp) -> Result<(), TrainError> {
        let count = network.parameters().len();
        match self.companion(name) {
            Some(companion) if companion.parameters.len() != count => {
                return Err(TrainError::OtherTerm(name.to_owned()));
            }
            Some(_) => {}
            None => self.companions.push(Companion {
                name: name.to_owned(),
                parameters: network.parameters().to_vec(),
                moments: Moments::new(count),
            }),
        }
        Ok(())
    }

    /// Lets the optimiser begin anew.
    pub(crate) fn forget_moments(&mut self) {
        let of_companions = self.companions.iter_mut().map(|companion| &mut companion.moments);
        of_companions.chain(&mut self.learned.moments).for_each(Moments::clear);
    }
}

/// The training of a network at the end of a batch: enough to go on exactly as if it had not been interrupted.
#[derive(Clone, Debug)]
pub struct NetworkCheckpoint {
    pub(crate) settings: Settings,
    pub(crate) state: State,
    pub(crate) hints: Vec<Hint>,
    /// Base mesh, field and similarity as learned so far.
    pub(crate) model: Model,
    /// Where the parts of the base mesh are in the mesh that training was given.
    pub(crate) order: BaseOrder,
    /// The terms of the objective.
    pub(crate) terms: Vec<TermRecord>,
    /// Wall time of training.
    pub(crate) time: Duration,
}

/// The part of a checkpoint that is words and counts.
#[derive(Serialize, Deserialize)]
pub(crate) struct Header {
    settings: Settings,
    epoch: usize,
    rate_factor: f32,
    #[serde(default)]
    grids: Option<Grids>,
    seconds: f64,
    hints: usize,
    /// Floats of features and θ.
    counts: [usize; 2],
    /// Names and floats of the networks of terms.
    networks: Vec<(String, usize)>,
    terms: Vec<TermRecord>,
    model_bytes: usize,
}

impl NetworkCheckpoint {
    /// The settings of the run.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Epochs made, the identity stage included.
    pub fn epoch(&self) -> usize {
        self.state.epoch
    }

    /// The model as learned so far.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The same, to go on for at most so long, or to the end: the limit of the run before does not count.
    #[must_use]
    pub fn with_time_limit(mut self, limit: Option<Duration>) -> Self {
        self.settings.time_limit = limit.map(|limit| self.time.saturating_add(limit));
        self
    }

    /// Header and numbers: the model file, hints and the order of base faces and vertices as u32, then for features, θ and
    /// the networks of terms the values, first and second moments as f32.
    pub(crate) fn to_parts(&self) -> (Header, Vec<u8>) {
        let model = self.model.to_bytes();
        let State { learned, companions, epoch, rate_factor } = &self.state;
        let Learned { features, mlp, moments, grids } = learned;
        let own = [features.as_slice(), mlp.parameters()];
        let header = Header {
            settings: self.settings.clone(),
            epoch: *epoch,
            rate_factor: *rate_factor,
            grids: grids.clone(),
            seconds: self.time.as_secs_f64(),
            hints: self.hints.len(),
            counts: own.map(<[f32]>::len),
            networks: companions.iter().map(|c| (c.name.clone(), c.parameters.len())).collect(),
            terms: self.terms.clone(),
            model_bytes: model.len(),
        };
        let mut numbers = model;
        let words =
            self.hints.iter().map(|hint| &hint.0).chain(&self.order.faces).chain(&self.order.vertices);
        numbers.extend(words.flat_map(|word| word.to_le_bytes()));
        let own = own.into_iter().zip(moments);
        let groups = own.chain(companions.iter().map(|c| (c.parameters.as_slice(), &c.moments)));
        for (values, moments) in groups {
            let [first, second] = moments.parts();
            numbers.extend([values, first, second].into_iter().flatten().flat_map(|x| x.to_le_bytes()));
        }
        (header, numbers)
    }

    pub(crate) fn from_parts(header: Header, mut parts: Parts<'_>) -> Result<Self, CheckpointError> {
        let settings = header.settings;
        settings.validate()?;
        let model = Model::from_bytes(parts.take(header.model_bytes)?)?;
        let hints: Vec<Hint> = parts.integers(header.hints)?.map(Hint).collect();
        let base = model.field.base();
        let faces = parts.integers(base.face_count())?.collect();
        let order = BaseOrder { faces, vertices: parts.integers(base.vertex_count())?.collect() };
        let mut group = |count: usize| -> Result<(Vec<f32>, Moments), CheckpointError> {
            Ok((parts.singles(count)?, Moments::of_parts(parts.singles(count)?, parts.singles(count)?)))
        };
        let (features, of_features) = group(header.counts[0])?;
        let (theta, of_theta) = group(header.counts[1])?;
        let mut companions = Vec::new();
        for (name, count) in header.networks {
            let (parameters, moments) = group(count)?;
            companions.push(Companion { name, parameters, moments });
        }
        parts.end()?;
        let mlp = Mlp::new(settings.field.mlp(), theta);
        let mlp = mlp.map_err(|_| FileDefect::mismatch("its network has another shape"))?;
        let reverse = companions.iter().find(|c| c.name == Cycle::NAME).map(|c| c.parameters.len());
        let expected = settings.reverse_network().map(|shape| shape.parameter_count());
        let not_begun = header.epoch == 0 && reverse.is_none();
        if reverse != expected && !not_begun {
            return Err(FileDefect::mismatch("its reverse map has another shape").into());
        }
        if Some(features.len()) != model.field.network().map(|network| network.features().len()) {
            return Err(FileDefect::mismatch("its features do not fit its base mesh").into());
        }
        if hints.len() != settings.samples || model.field.shape().as_ref() != Some(&settings.field) {
            return Err(FileDefect::mismatch("its parts have different sizes").into());
        }
        let learned = Learned { features, mlp, moments: [of_features, of_theta], grids: header.grids };
        let state = State { learned, companions, epoch: header.epoch, rate_factor: header.rate_factor };
        let time = time_of(header.seconds)?;
        Ok(Self { settings, state, hints, model, order, terms: header.terms, time })
    }
}
