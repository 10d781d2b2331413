//! Scalar fields learned on a model's base mesh: `u_ξ(z(x), k)` of the method (supplement, §2.6).
//!
//! A [`StoredScalars`] holds K fields that are known together, its *channels*: eigenfunctions, distances, anything with a
//! value at every point of the surface. It has features of its own at the base vertices, interpolated as those of the
//! displacement field are, and a network `MLP([z(x), x, PE(x)])`. The network is told which channel is wanted in one of
//! [two ways](ChannelIndex). What it gives is a value in units of the channel's deviation from its mean, and is
//! clamped to the range of the values that were learned: a constant field comes back exactly.

mod evaluation;
mod payload;

use serde::{Deserialize, Serialize};

pub use payload::TAG;

use ndf_mesh::io::is_property_name;
use ndf_network::{Activation, Mlp, MlpShape, Packed, encoding};

/// More channels than this are refused.
pub const MOST_CHANNELS: usize = 4096;
/// Longer names are refused.
const LONGEST_NAME: usize = 255;

/// How the network is told which channel is wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChannelIndex {
    /// It has an output for every channel: one pass gives all of them.
    #[default]
    Output,
    /// It has one output, and as a further input a code between −1 and 1 for the channel, as the supplement writes
    /// u_ξ(z, k): a pass for every channel.
    Input,
}

/// The sizes of the parts.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ScalarShape {
    /// Features per base vertex: d of the method. With 0 the network knows a point by its coordinates alone.
    pub features: usize,
    /// Octaves of positional encoding of x; 0 for none.
    pub octaves: usize,
    /// Widths of the hidden layers.
    pub hidden: Vec<usize>,
    /// What hidden layers do to their sums.
    pub activation: Activation,
    /// How the network is told which channel is wanted.
    pub index: ChannelIndex,
}

impl Default for ScalarShape {
    /// d = 4, two octaves and two hidden layers of 32 with SiLU, an output for every channel.
    fn default() -> Self {
        Self {
            features: 4,
            octaves: 2,
            hidden: vec![32, 32],
            activation: Activation::Silu,
            index: ChannelIndex::Output,
        }
    }
}

impl ScalarShape {
    /// Shape of the network for this many channels.
    pub fn network(&self, channels: usize) -> MlpShape {
        let passes = self.passes(channels);
        MlpShape {
            inputs: self.encoded() + usize::from(passes.code_at.is_some()),
            hidden: self.hidden.clone(),
            outputs: passes.outputs,
            activation: self.activation,
        }
    }

    /// How this many channels come out of the network.
    pub fn passes(&self, channels: usize) -> Passes {
        match self.index {
            ChannelIndex::Output => Passes { count: 1, outputs: channels, code_at: None },
            ChannelIndex::Input => Passes { count: channels, outputs: 1, code_at: Some(self.encoded()) },
        }
    }

    /// What is wrong with these sizes, if anything.
    pub fn defect(&self) -> Option<&'static str> {
        encoding::defect(self.features, self.octaves, &self.hidden)
    }

    /// Width of the encoding of a point.
    fn encoded(&self) -> usize {
        self.features + 3 + encoding::width(self.octaves)
    }
}

/// The passes through the network that give all channels of a block of points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Passes {
    /// How many there are.
    pub count: usize,
    /// Channels that come out of each.
    pub outputs: usize,
    /// The input that holds the code of the channel, where there is one.
    code_at: Option<usize>,
}

impl Passes {
    /// The first channel that comes out of a pass.
    pub fn first_channel(&self, pass: usize) -> usize {
        pass * self.outputs
    }

    /// Writes the code of the channel of a pass into rows of input: codes are evenly spaced in −1 … 1.
    #[inline(always)]
    pub fn set_code(&self, pass: usize, rows: &mut [f32], stride: usize) {
        if let Some(at) = self.code_at {
            let code = (2 * pass + 1) as f32 / self.count as f32 - 1.0;
            rows.iter_mut().skip(at).step_by(stride).for_each(|to| *to = code);
        }
    }
}

/// One of the fields.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Channel {
    /// Its name, which can name a [PLY property](is_property_name).
    pub name: String,
    /// Its smallest and largest value.
    pub range: [f32; 2],
    /// Value where the network gives 0.
    pub mean: f32,
    /// What a unit of the network's output stands for; 0 where the field is constant.
    pub deviation: f32,
}

impl Channel {
    /// The value that an output of the network stands for, always within the range.
    #[inline(always)]
    pub fn value(&self, output: f32) -> f32 {
        (self.mean + self.deviation * output).max(self.range[0]).min(self.range[1])
    }

    /// The output of the network that stands for a value; 0 where the field is constant.
    pub fn output(&self, value: f32) -> f32 {
        if self.deviation > 0.0 { (value - self.mean) / self.deviation } else { 0.0 }
    }

    fn is_usable(&self) -> bool {
        let [least, most] = self.range;
        let finite = [least, most, self.mean, self.deviation].into_iter().all(f32::is_finite);
        finite && least <= most && self.deviation >= 0.0
    }
}

/// Why parts do not make scalar fields.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StoredScalarsError {
    /// There is no channel.
    #[error("there are no scalar fields")]
    Empty,
    /// There are too many channels.
    #[error("{0} scalar fields are more than {MOST_CHANNELS}")]
    TooMany(usize),
    /// The sizes of the network make no sense.
    #[error("{0}")]
    Shape(&'static str),
    /// A name that cannot stand in a file.
    #[error(
        "{0:?} cannot name a scalar field: it must be one word of up to 255 characters of ASCII other than x, y, z"
    )]
    Name(String),
    /// Two channels of one name.
    #[error("two scalar fields are named {0}")]
    Repeated(String),
    /// The range, mean or deviation of a channel make no sense.
    #[error("the range of the scalar field {0} makes no sense")]
    Range(String),
    /// Number of features or parameters.
    #[error("{what}: {found} values, {expected} expected")]
    Count {
        /// Features or network parameters.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many the shape asks for.
        expected: usize,
    },
    /// A feature or parameter is NaN or infinite.
    #[error("{0}: a value is not finite")]
    NotFinite(&'static str),
}

/// Scalar fields over a base mesh that a network knows together.
#[derive(Clone, Debug)]
pub struct StoredScalars {
    channels: Vec<Channel>,
    shape: ScalarShape,
    /// Vertex-major: `features[v · d + k]`.
    features: Vec<f32>,
    network: Mlp,
    packed: Packed,
}

impl StoredScalars {
    /// The same fields with the base vertices in another order: `order[v]` is the old number of vertex v.
    pub(crate) fn reordered(&self, order: &[u32]) -> Self {
        let d = self.shape.features;
        let of_vertex = |&v: &u32| &self.features[v as usize * d..][..d];
        Self { features: order.iter().flat_map(of_vertex).copied().collect(), ..self.clone() }
    }

    /// The same fields with other numbers, as many as before.
    pub(crate) fn with_parameters(&self, features: Vec<f32>, parameters: Vec<f32>) -> Self {
        let network = Mlp::new(self.network.shape().clone(), parameters).expect("as many as before");
        let packed = Packed::new(&network);
        Self { channels: self.channels.clone(), shape: self.shape.clone(), features, network, packed }
    }

    /// Scalar fields of these parts: features vertex by vertex, parameters in the order of [`Mlp::parameters`].
    ///
    /// # Errors
    /// If names are not usable or repeated, or numbers do not fit together or are not finite.
    pub fn new(
        channels: Vec<Channel>,
        shape: ScalarShape,
        base_vertices: usize,
        features: Vec<f32>,
        parameters: Vec<f32>,
    ) -> Result<Self, StoredScalarsError> {
        use StoredScalarsError as Error;
        if channels.is_empty() {
            return Err(Error::Empty);
        }
        if channels.len() > MOST_CHANNELS {
            return Err(Error::TooMany(channels.len()));
        }
        if let Some(defect) = shape.defect() {
            return Err(Error::Shape(defect));
        }
        let mut names: Vec<&str> = channels.iter().map(|c| c.name.as_str()).collect();
        names.sort_unstable();
        if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(Error::Repeated(pair[0].to_owned()));
        }
        for channel in &channels {
            if !is_property_name(&channel.name) || channel.name.len() > LONGEST_NAME {
                return Err(Error::Name(channel.name.clone()));
            }
            if !channel.is_usable() {
                return Err(Error::Range(channel.name.clone()));
            }
        }
        let expected = base_vertices * shape.features;
        if features.len() != expected {
            return Err(Error::Count { what: "features", found: features.len(), expected });
        }
        for (what, values) in [("features", &features), ("network", &parameters)] {
            if !values.iter().all(|x| x.is_finite()) {
                return Err(Error::NotFinite(what));
            }
        }
        let layers = shape.network(channels.len());
        let (found, expected) = (parameters.len(), layers.parameter_count());
        let count = Error::Count { what: "network parameters", found, expected };
        let network = Mlp::new(layers, parameters).ok_or(count)?;
        let packed = Packed::new(&network);
        Ok(Self { channels, shape, features, network, packed })
    }

    /// The fields, in order.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// Sizes of the parts.
    pub fn shape(&self) -> &ScalarShape {
        &self.shape
    }

    /// Features, vertex by vertex.
    pub fn features(&self) -> &[f32] {
        &self.features
    }

    /// The network.
    pub fn network(&self) -> &Mlp {
        &self.network
    }

    /// How the channels come out of the network.
    pub fn passes(&self) -> Passes {
        self.shape.passes(self.channels.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three channels, one of them constant, with random parameters.
    pub(super) fn random(shape: ScalarShape, base_vertices: usize) -> StoredScalars {
        use rand::RngExt;
        use rand_chacha::ChaCha8Rng;
        use rand_chacha::rand_core::SeedableRng;
        let channel =
            |name: &str, range, mean, deviation| Channel { name: name.to_owned(), range, mean, deviation };
        let channels = vec![
            channel("distance", [0.0, 7.0], 3.0, 1.5),
            channel("constant", [0.1, 0.1], 0.1, 0.0),
            channel("mode_07", [-1e9, 1e9], 0.5, 2.0),
        ];
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let mut numbers = |n: usize| (0..n).map(|_| rng.random_range(-0.5..0.5)).collect::<Vec<f32>>();
        let features = numbers(base_vertices * shape.features);
        let parameters = numbers(shape.network(3).parameter_count());
        StoredScalars::new(channels, shape, base_vertices, features, parameters).unwrap()
    }

    #[test]
    fn parts_that_do_not_fit_are_named() {
        use StoredScalarsError as Error;
        let good = random(ScalarShape::default(), 12);
        let make = |channels: Vec<Channel>, features: Vec<f32>, parameters: Vec<f32>| {
            StoredScalars::new(channels, good.shape.clone(), 12, features, parameters).map(|_| ())
        };
        let parts = || (good.channels.clone(), good.features.clone(), good.network.parameters().to_vec());
        let (c, f, p) = parts();
        assert_eq!(make(c, f, p), Ok(()));
        let (_, f, p) = parts();
        assert_eq!(make(Vec::new(), f, p), Err(Error::Empty));
        let (mut c, f, p) = parts();
        c[1].name = "distance".into();
        assert_eq!(make(c, f, p), Err(Error::Repeated("distance".into())));
        for name in ["", "two words", "x", "new\nline", "größe"] {
            let (mut c, f, p) = parts();
            c[2].name = name.into();
            assert_eq!(make(c, f, p), Err(Error::Name(name.into())));
        }
        for range in [[2.0, 1.0], [f32::NAN, 1.0], [0.0, f32::INFINITY]] {
            let (mut c, f, p) = parts();
            c[0].range = range;
            assert_eq!(make(c, f, p), Err(Error::Range("distance".into())));
        }
        let (c, mut f, p) = parts();
        f.pop();
        assert!(matches!(make(c, f, p), Err(Error::Count { what: "features", .. })));
        let (c, f, mut p) = parts();
        p.push(0.0);
        assert!(matches!(make(c, f, p), Err(Error::Count { what: "network parameters", .. })));
        let (c, f, mut p) = parts();
        p[5] = f32::NAN;
        assert_eq!(make(c, f, p), Err(Error::NotFinite("network")));
    }

    #[test]
    fn outputs_and_values_are_inverse_and_stay_in_range() {
        let fields = random(ScalarShape::default(), 12);
        let [distance, constant, _] = fields.channels() else { panic!("three channels") };
        assert_eq!(distance.value(distance.output(4.25)), 4.25);
        assert_eq!([distance.value(-1e30), distance.value(1e30)], distance.range);
        for output in [0.0, 3.0, -1e38, f32::NAN, f32::INFINITY] {
            assert_eq!(constant.value(output), 0.1);
        }
        assert_eq!(constant.output(0.1), 0.0);
    }
}
