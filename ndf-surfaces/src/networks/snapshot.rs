//! Snapshots of instant-ngp (Müller et al. 2022): MessagePack, bare (`.msgpack`) or in zlib or gzip (`.ingp`).
//!
//! The network is read as tiny-cuda-nn lays it out: matrices without biases, sides padded to sixteen, then the
//! hash grid. What it gives is the logarithm of the density, or a distance.

use std::borrow::Cow;
use std::io::Read;

use flate2::read::{GzDecoder, ZlibDecoder};
use ndf_core::{BoundingBox, DVec3};
use ndf_mesh::io::FileDefect;
use rmpv::ValueRef;

use super::graph::{Dense, Graph};
use super::hash_grid::{HashGrid, HashGridShape};
use super::layouts::Recognised;
use super::{Activation, LayoutError, NetworkOptions, NeuralField, Quantity};

const LAYOUT: &str = "instant-ngp";
/// What packed contents may grow to, in sizes of the file.
const MAX_GROWTH: u64 = 64;
/// Maps in maps.
const DEEPEST: usize = 64;
/// Level of the logarithm of the density at which instant-ngp makes its own meshes.
const MESH_LEVEL: f64 = 2.5;

/// Where the name of the part that is read must stand: sizes of networks come before it, all weights after.
const BEGINNING: usize = 1 << 16;

/// Whether a file may be a snapshot: a map of MessagePack, bare or packed, that soon names a snapshot.
pub fn is_snapshot(bytes: &[u8]) -> bool {
    let names_one = |contents: &[u8]| {
        matches!(contents, [0x80..=0x8f | 0xde | 0xdf, ..])
            && contents[..contents.len().min(BEGINNING)].windows(8).any(|name| name == b"snapshot")
    };
    names_one(bytes) || unpacked(bytes, BEGINNING as u64).is_some_and(|contents| names_one(&contents))
}

/// Contents of a packed file, up to a limit; `None` if it is not packed or damaged.
fn unpacked(bytes: &[u8], limit: u64) -> Option<Vec<u8>> {
    let mut contents = Vec::new();
    match bytes {
        [0x1f, 0x8b, ..] => GzDecoder::new(bytes).take(limit).read_to_end(&mut contents).ok()?,
        [0x78, ..] => ZlibDecoder::new(bytes).take(limit).read_to_end(&mut contents).ok()?,
        _ => return None,
    };
    Some(contents)
}

fn broken(defect: FileDefect) -> LayoutError {
    LayoutError::Broken { layout: LAYOUT, defect }
}

fn missing(text: impl Into<Cow<'static, str>>) -> LayoutError {
    broken(FileDefect::missing(text))
}

fn out_of_range(text: impl Into<Cow<'static, str>>) -> LayoutError {
    broken(FileDefect::value(text))
}

fn unsupported(text: String) -> LayoutError {
    broken(FileDefect::unsupported(text))
}

fn undecodable(text: impl Into<Cow<'static, str>>) -> LayoutError {
    broken(FileDefect::undecodable(text))
}

impl NeuralField {
    /// The density or distance of a snapshot, in instant-ngp's own coordinates. Densities are logarithms, with their
    /// level at 2.5 as in instant-ngp.
    ///
    /// # Errors
    /// See [`LayoutError`].
    pub fn from_snapshot(bytes: &[u8], options: &NetworkOptions) -> Result<Self, LayoutError> {
        let contents = match bytes {
            [0x1f, 0x8b, ..] | [0x78, ..] => unpacked(bytes, MAX_GROWTH * bytes.len() as u64)
                .ok_or_else(|| undecodable("its compressed contents are damaged"))?,
            _ => bytes.to_vec(),
        };
        let root = rmpv::decode::read_value_ref_with_max_depth(&mut contents.as_slice(), DEEPEST)
            .map_err(|e| undecodable(format!("as MessagePack: {e}")))?;
        let found = read(&Map(&root))?;
        let is_density = found.quantity == Quantity::Density;
        let field = Self::from_recognised(found, options, None)?;
        Ok(if is_density { field.with_level(MESH_LEVEL) } else { field })
    }
}

/// A value that should be a map.
#[derive(Clone, Copy)]
struct Map<'a>(&'a ValueRef<'a>);

impl<'a> Map<'a> {
    fn entries(self) -> &'a [(ValueRef<'a>, ValueRef<'a>)] {
        match self.0 {
            ValueRef::Map(entries) => entries,
            _ => &[],
        }
    }

    fn get(self, key: &str) -> Option<&'a ValueRef<'a>> {
        self.entries().iter().find(|(k, _)| text(k) == Some(key)).map(|(_, value)| value)
    }

    fn map(self, key: &str) -> Result<Map<'a>, LayoutError> {
        self.get(key).map(Map).ok_or_else(|| {
            let found: Vec<&str> = self.entries().iter().filter_map(|(k, _)| text(k)).collect();
            missing(format!("it has no {key}, only {}", found.join(", ")))
        })
    }

    fn number(self, key: &str) -> Result<f64, LayoutError> {
        self.get(key).and_then(number).ok_or_else(|| missing(format!("it has no number {key}")))
    }

    fn size(self, key: &str) -> Result<usize, LayoutError> {
        let number = self.number(key)?;
        let size = (0.0..65536.0).contains(&number) && number.fract() == 0.0;
        size.then_some(number as usize).ok_or_else(|| out_of_range(format!("{key} is {number}")))
    }

    fn text(self, key: &str) -> &'a str {
        self.get(key).and_then(text).unwrap_or_default()
    }

    fn point(self, key: &str) -> Option<DVec3> {
        let numbers: Vec<f64> = self.get(key)?.as_array()?.iter().filter_map(number).collect();
        <[f64; 3]>::try_from(numbers).ok().map(DVec3::from_array)
    }
}

fn text<'a>(value: &'a ValueRef<'a>) -> Option<&'a str> {
    match value {
        ValueRef::String(text) => text.as_str(),
        _ => None,
    }
}

fn number(value: &ValueRef<'_>) -> Option<f64> {
    match value {
        ValueRef::Integer(number) => number.as_f64(),
        ValueRef::F32(number) => Some(f64::from(*number)),
        ValueRef::F64(number) => Some(*number),
        _ => None,
    }
}

fn read(root: &Map<'_>) -> Result<Recognised, LayoutError> {
    let snapshot = root.map("snapshot")?;
    let quantity = match snapshot.text("mode").to_ascii_lowercase().as_str() {
        "nerf" => Quantity::Density,
        "sdf" => Quantity::Distance,
        other => return Err(unsupported(format!("a snapshot of the mode {other:?} holds no surface"))),
    };
    let parameters = parameters(snapshot)?;
    let bounds = snapshot.map("aabb").ok().and_then(|aabb| {
        let (min, max) = (aabb.point("min")?, aabb.point("max")?);
        (min.is_finite() && max.is_finite()).then_some(BoundingBox { min, max })
    });
    let bounds = bounds.unwrap_or(BoundingBox { min: DVec3::ZERO, max: DVec3::ONE });

    let encoding = root.map("encoding")?;
    let features = encoding.size("n_features_per_level")?;
    let shape = HashGridShape {
        levels: encoding.size("n_levels")?,
        features,
        log2_entries: encoding.size("log2_hashmap_size")? as u32,
        coarsest: encoding.number("base_resolution")?,
        growth: encoding.number("per_level_scale")?,
        smooth: encoding.text("interpolation").eq_ignore_ascii_case("smoothstep"),
    };
    let grid_size =
        shape.parameters().ok_or_else(|| out_of_range("the sizes of its grid are out of range"))?;

    let network = root.map("network")?;
    let inputs = (shape.levels * features).next_multiple_of(16);
    let sizes = mlp_sizes(network, inputs, 16)?;
    let density_size: usize = sizes.iter().map(|(outputs, inputs)| outputs * inputs).sum();
    let colour_size: usize = match quantity {
        // The directions' harmonics and the features of the density make 32.
        Quantity::Density => {
            let sizes = mlp_sizes(root.map("rgb_network")?, 32, 16)?;
            sizes.iter().map(|(outputs, inputs)| outputs * inputs).sum()
        }
        Quantity::Distance => 0,
    };
    let needed = density_size + colour_size + grid_size;
    if parameters.len() < needed {
        let found = parameters.len();
        let text = format!("it has {found} parameters, its networks and grid need {needed}");
        return Err(broken(FileDefect::truncated(text)));
    }
    let grid = &parameters[density_size + colour_size..needed];
    let grid = HashGrid::new(shape, grid.to_vec(), bounds)
        .ok_or_else(|| out_of_range("the box of its grid is empty"))?;
    let graph = graph(grid, &sizes, &parameters, inputs - shape.levels * features)?;
    Ok(Recognised { graph, layout: LAYOUT, quantity, bounds, hidden: None })
}

/// Outputs and inputs of every matrix of a network, padded.
fn mlp_sizes(network: Map<'_>, inputs: usize, outputs: usize) -> Result<Vec<(usize, usize)>, LayoutError> {
    let (width, hidden) = (network.size("n_neurons")?, network.size("n_hidden_layers")?);
    if !(1..=1024).contains(&width) || !(1..=32).contains(&hidden) {
        return Err(out_of_range(format!("a network has {hidden} layers of {width} neurons")));
    }
    match network.text("activation").to_ascii_lowercase().as_str() {
        "relu" | "" => {}
        other => return Err(unsupported(format!("a network has the activation {other}; only ReLU is read"))),
    }
    let mut sizes = vec![(width, inputs)];
    sizes.extend(vec![(width, width); hidden - 1]);
    sizes.push((outputs, width));
    Ok(sizes)
}

fn parameters(snapshot: Map<'_>) -> Result<Vec<f32>, LayoutError> {
    let Some(ValueRef::Binary(bytes)) = snapshot.get("params_binary") else {
        return Err(missing("it has no params_binary"));
    };
    Ok(match snapshot.text("params_type") {
        "float" => bytes.as_chunks::<4>().0.iter().map(|&b| f32::from_le_bytes(b)).collect(),
        "__half" => bytes.as_chunks::<2>().0.iter().map(|&b| half::f16::from_le_bytes(b).to_f32()).collect(),
        other => {
            return Err(unsupported(format!(
                "its parameters are of the type {other:?}; __half and float are read"
            )));
        }
    })
}

/// The network on the grid. What pads its input is 0 in tiny-cuda-nn, so that the weights there do nothing.
fn graph(
    grid: HashGrid,
    sizes: &[(usize, usize)],
    parameters: &[f32],
    padding: usize,
) -> Result<Graph, LayoutError> {
    let mut graph = Graph::new();
    let mut h = graph.grid(grid);
    let mut rest = parameters;
    for (l, &(outputs, inputs)) in sizes.iter().enumerate() {
        let (weights, after) = rest.split_at(outputs * inputs);
        rest = after;
        let mut layer = Dense::new(weights.to_vec(), vec![0.0; outputs]);
        if l == 0 && padding > 0 {
            layer = layer.and_then(|layer| layer.with_inner_inputs(inputs - padding, &vec![0.0; padding]));
        }
        if l + 1 == sizes.len() {
            layer = layer.and_then(|layer| layer.only_output(0));
        }
        h = layer
            .and_then(|layer| graph.dense(layer, h))
            .ok_or_else(|| broken(FileDefect::mismatch("its layers do not fit")))?;
        if l + 1 < sizes.len() {
            h = graph.map(Activation::Relu, h);
        }
    }
    Ok(graph)
}
