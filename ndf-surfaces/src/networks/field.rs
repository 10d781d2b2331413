//! A network as a scalar field.

use ndf_core::{BoundingBox, DVec3, ImplicitField, Inside};

use super::activation::Activation;
use super::graph::Graph;
use super::layouts::{
    LayoutError, NetworkOptions, Quantity, Recognised, recognise, siren_of_flat_file, told_by_modules,
};
use crate::level_set::LevelSearch;
use crate::levels::{DensityRule, density_level};
use ndf_formats::tensors::TensorFile;

/// A scalar field that is a network.
#[derive(Clone, Debug)]
pub struct NeuralField {
    graph: Graph,
    layout: &'static str,
    quantity: Quantity,
    bounds: BoundingBox,
    level: f64,
    rule: Option<DensityRule>,
    inside: Inside,
    is_activation_assumed: bool,
}

/// Points along the sides of the box that tell which sign is outside.
const BORDER: usize = 12;

/// Tolerance of feet, in diagonals: what single precision leaves of the values.
const TOLERANCE: f64 = 1e-6;

impl NeuralField {
    /// The network in a checkpoint, with what the caller says of it. The level of a
    /// density is [found by rule](crate::levels::density_level), which costs 64³ evaluations of the network.
    ///
    /// # Errors
    /// See [`LayoutError`].
    pub fn from_tensors(file: &TensorFile, options: &NetworkOptions) -> Result<Self, LayoutError> {
        let found = recognise(file, options.latent.as_ref())?;
        Self::from_recognised(found, options, told_by_modules(file))
    }

    /// With what the caller says, or what is `told` of the activation.
    pub(super) fn from_recognised(
        found: Recognised,
        options: &NetworkOptions,
        told: Option<Activation>,
    ) -> Result<Self, LayoutError> {
        let is_said = options.activation.is_some() || options.omega.is_some() || told.is_some();
        let is_activation_assumed = found.hidden.is_some() && !is_said;
        let Recognised { graph, layout, quantity, bounds, .. } = found.with_options(options, told)?;
        if !graph.is_finite() {
            return Err(LayoutError::NotFinite);
        }
        let field = Self {
            graph,
            layout,
            quantity,
            bounds,
            level: 0.0,
            rule: None,
            inside: Inside::Above,
            is_activation_assumed,
        };
        Ok(match quantity {
            Quantity::Density => {
                let (level, rule) = density_level(&field);
                Self { level, rule: Some(rule), ..field }
            }
            Quantity::Distance => {
                let inside = if field.is_mostly_positive_outside() { Inside::Below } else { Inside::Above };
                Self { inside, ..field }
            }
        })
    }

    /// A network of one's own: its values, the box its surface is in, and the level.
    pub fn new(graph: Graph, quantity: Quantity, bounds: BoundingBox, level: f64, inside: Inside) -> Self {
        Self {
            graph,
            layout: "network",
            quantity,
            bounds,
            level,
            rule: None,
            inside,
            is_activation_assumed: false,
        }
    }

    /// A SIREN as a file of bare numbers, weights and bias of each layer; `None` if it cannot be one.
    pub fn from_flat_file(bytes: &[u8], options: &NetworkOptions) -> Option<Result<Self, LayoutError>> {
        siren_of_flat_file(bytes).map(|found| Self::from_recognised(found, options, None))
    }

    /// Its graph: widths, octaves, activations.
    pub fn graph(&self) -> &Graph {
        &self.graph
    }

    /// Whether its activation is the one of its layout, and neither the file nor the caller says so.
    pub fn is_activation_assumed(&self) -> bool {
        self.is_activation_assumed
    }

    /// The same field with another level.
    #[must_use]
    pub fn with_level(self, level: f64) -> Self {
        Self { level, rule: None, ..self }
    }

    /// The rule by which the level of a density was chosen, unless it was set.
    pub fn level_rule(&self) -> Option<DensityRule> {
        self.rule
    }

    /// The layout it was read from.
    pub fn layout(&self) -> &'static str {
        self.layout
    }

    /// What its values mean.
    pub fn quantity(&self) -> Quantity {
        self.quantity
    }

    /// Number of weights and biases.
    pub fn parameters(&self) -> usize {
        self.graph.parameters()
    }

    /// A search for its level that minds single precision.
    pub fn search(&self) -> LevelSearch {
        let usual = LevelSearch::within(&self.bounds);
        LevelSearch { tolerance: TOLERANCE * self.bounds.diagonal(), ..usual }
    }

    /// Whether the values on the faces of the box are positive at most places: distances are, whether occupancies are
    /// differs.
    fn is_mostly_positive_outside(&self) -> bool {
        let step = |i: usize| (i as f64 + 0.5) / BORDER as f64;
        let points: Vec<DVec3> = (0..3 * 2 * BORDER * BORDER)
            .map(|k| {
                let (axis, side, i, j) = (k % 3, k / 3 % 2, k / 6 % BORDER, k / 6 / BORDER);
                let mut t = DVec3::ZERO;
                (t[axis], t[(axis + 1) % 3], t[(axis + 2) % 3]) = (side as f64, step(i), step(j));
                self.bounds.min + t * self.bounds.extent()
            })
            .collect();
        let mut values = vec![0.0; points.len()];
        self.graph.evaluate(&points, &mut values, None);
        2 * values.iter().filter(|&&v| v > 0.0).count() >= values.len()
    }
}

impl ImplicitField for NeuralField {
    fn values(&self, points: &[DVec3], values: &mut [f64]) {
        self.graph.evaluate(points, values, None);
    }

    fn gradients(&self, points: &[DVec3], gradients: &mut [DVec3]) {
        self.values_and_gradients(points, &mut vec![0.0; points.len()], gradients);
    }

    fn values_and_gradients(&self, points: &[DVec3], values: &mut [f64], gradients: &mut [DVec3]) {
        self.graph.evaluate(points, values, Some(gradients));
    }

    fn bounds(&self) -> BoundingBox {
        self.bounds
    }

    fn level(&self) -> f64 {
        self.level
    }

    fn inside(&self) -> Inside {
        self.inside
    }

    /// Wide enough that single precision does not drown the difference.
    fn difference_step(&self) -> f64 {
        2e-4 * self.bounds.diagonal()
    }
}
