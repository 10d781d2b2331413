//! Models as `.safetensors`: plain arrays of single precision, for programs in other languages.
//!
//! | tensor | shape | what |
//! |---|---|---|
//! | `similarity` | F64 \[4\] | scale, then the centre: box = scale · (world − centre) |
//! | `base.positions` | F32 \[V, 3\] | base vertices, in the box; with levels, what `levels.control` says counts |
//! | `base.faces` | U32 \[F, 3\] | |
//! | `features` | F32 \[V, d\] | of a field with a network |
//! | `network.0.weight`, `network.0.bias`, … | F32 \[outputs, inputs\], \[outputs\] | layers from input to output |
//! | `levels.control`, `levels.spacing` | I32 \[V, 3\], F32 \[1\] | of a field with levels: control vertices, and what an integer counts |
//! | `levels.creases`, `levels.corners` | I32 \[any\] | numbers of the edges and vertices at which the base mesh is sharp |
//! | `levels.1.displacements`, `levels.1.step`, … | I32 \[edges below\], F32 \[1\] | levels from the coarsest on |
//! | `metric` | F32 \[2\] | where there is one: area of the true surface in the box, exponent of distances |
//! | `scalars.0.features`, `scalars.0.network.0.weight`, … | | the same of every set of scalar fields of a network |
//! | `scalars.0.integers`, `scalars.0.step`, `scalars.0.rises` | I32 \[nodes, K\], F32 \[1\], U8 \[levels\] | of a set on levels, in the order of the file |
//!
//! The metadata `ndf` is a JSON object: `shape` of the field's network or the number of its `levels`, `scalars`
//! (`shape` or `splits`, and `channels` of every set) and `provenance`.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};

use safetensors::tensor::{Dtype, SafeTensors, View};
use serde::{Deserialize, Serialize};

use super::error::{PartDefect, TensorsError};
use super::scalar_levels::Nodes;
use crate::displacement_field::{DisplacementField, FieldShape};
use crate::intrinsic_network::{IntrinsicNetwork, NetworkShape};
use crate::levels::{Level, Levels, MAX_LEVELS};
use crate::metric::Metric;
use crate::model::Model;
use crate::scalars::{Channel, Form, ScalarNumbers, ScalarShape, SurfaceScalars};
use crate::similarity::Similarity;
use ndf_core::DVec3;
use ndf_mesh::io::FileDefect;
use ndf_mesh::subdivision::{Creases, Refinement};
use ndf_mesh::{ManifoldMesh, TriangleMesh};
use ndf_network::MlpShape;

const KEY: &str = "ndf";
const METRIC: &str = "metric";

#[derive(Serialize, Deserialize)]
struct Metadata {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    shape: Option<FieldShape>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    levels: Option<usize>,
    #[serde(default)]
    scalars: Vec<Fields>,
    #[serde(default)]
    provenance: String,
}

#[derive(Serialize, Deserialize)]
struct Fields {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    shape: Option<ScalarShape>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    splits: Option<u32>,
    channels: Vec<Channel>,
}

/// An array to be written.
struct Array {
    dtype: Dtype,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

impl View for &Array {
    fn dtype(&self) -> Dtype {
        self.dtype
    }

    fn shape(&self) -> &[usize] {
        &self.shape
    }

    fn data(&self) -> Cow<'_, [u8]> {
        Cow::Borrowed(&self.bytes)
    }

    fn data_len(&self) -> usize {
        self.bytes.len()
    }
}

impl Model {
    /// The model as the bytes of a `.safetensors` file.
    ///
    /// # Errors
    /// If the library refuses them.
    pub fn to_safetensors(&self) -> Result<Vec<u8>, TensorsError> {
        let base = self.field.base();
        let vertices = base.vertex_count();
        let positions: Vec<f32> = base.positions().iter().flat_map(|p| p.as_vec3().to_array()).collect();
        let faces = Array {
            dtype: Dtype::U32,
            shape: vec![base.face_count(), 3],
            bytes: base.faces().iter().flatten().flat_map(|v| v.to_le_bytes()).collect(),
        };
        let (scale, [x, y, z]) = (self.similarity.scale(), self.similarity.center().to_array());
        let similarity = Array {
            dtype: Dtype::F64,
            shape: vec![4],
            bytes: [scale, x, y, z].into_iter().flat_map(f64::to_le_bytes).collect(),
        };
        let mut arrays = vec![
            ("similarity".to_owned(), similarity),
            ("base.positions".to_owned(), floats(vec![vertices, 3], &positions)),
            ("base.faces".to_owned(), faces),
        ];
        if let Some(network) = self.field.network() {
            push_network(&mut arrays, "", vertices, network);
        }
        if let Some(levels) = self.field.levels() {
            push_levels(&mut arrays, levels);
        }
        if let Some(metric) = self.metric {
            arrays.push((METRIC.to_owned(), floats(vec![2], &[metric.area(), metric.exponent()])));
        }
        for (s, fields) in self.scalars.iter().enumerate() {
            let prefix = format!("scalars.{s}.");
            match fields.form() {
                Form::Network(network) => push_network(&mut arrays, &prefix, vertices, network),
                Form::Levels(levels) => {
                    push_numbers(&mut arrays, &prefix, fields.channels().len(), levels.numbers());
                }
            }
        }
        let metadata = Metadata {
            shape: self.field.shape(),
            levels: self.field.levels().map(|levels| levels.levels.len()),
            scalars: self
                .scalars
                .iter()
                .map(|fields| Fields {
                    shape: fields.shape(),
                    splits: fields.levels().map(|levels| levels.mesh().splits()),
                    channels: fields.channels().to_vec(),
                })
                .collect(),
            provenance: self.provenance.clone(),
        };
        let metadata = HashMap::from([(KEY.to_owned(), serde_json::to_string(&metadata)?)]);
        let arrays = arrays.iter().map(|(name, array)| (name, array));
        Ok(safetensors::serialize(arrays, Some(metadata))?)
    }

    /// The model in the bytes of a `.safetensors` file as [`to_safetensors`](Self::to_safetensors) writes it.
    ///
    /// # Errors
    /// If they are not such a file, or its arrays do not make a model.
    pub fn from_safetensors(bytes: &[u8]) -> Result<Self, TensorsError> {
        let (_, header) = SafeTensors::read_metadata(bytes)?;
        let text = header.metadata().as_ref().and_then(|entries| entries.get(KEY));
        let metadata: Metadata = serde_json::from_str(text.ok_or(TensorsError::NotAModel)?)?;
        let tensors = SafeTensors::deserialize(bytes)?;
        fn parts<E: Into<PartDefect>>(error: E) -> TensorsError {
            TensorsError::Parts(error.into())
        }
        let positions = read_floats(&tensors, "base.positions", &[None, Some(3)])?;
        let positions: Vec<DVec3> = positions
            .as_chunks()
            .0
            .iter()
            .map(|&p: &[f32; 3]| ndf_core::glam::Vec3::from(p).as_dvec3())
            .collect();
        let faces = read(&tensors, "base.faces", Dtype::U32, &[None, Some(3)])?;
        let faces: Vec<u32> = faces.as_chunks().0.iter().map(|b| u32::from_le_bytes(*b)).collect();
        let vertices = positions.len();
        let mesh = TriangleMesh::new(positions, faces.as_chunks().0.to_vec());
        let mesh = mesh.map_err(|e| parts(FileDefect::from(e)))?;
        let base = ManifoldMesh::try_from(mesh).map_err(|e| parts(FileDefect::from(e)))?;
        let field = match (metadata.shape, metadata.levels) {
            (Some(shape), None) => {
                let mlp = || shape.mlp();
                let [features, parameters] = read_network(&tensors, "", vertices, &shape.network, mlp)?;
                DisplacementField::new(base, shape, features, parameters).map_err(parts)?
            }
            (None, Some(count)) => {
                let levels = read_levels(&tensors, &base, count)?;
                DisplacementField::levelled(&base, levels).map_err(parts)?
            }
            _ => return Err(TensorsError::NotAModel),
        };
        let similarity = read(&tensors, "similarity", Dtype::F64, &[Some(4)])?;
        let similarity: Vec<f64> = similarity.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
        let similarity =
            Similarity::new(similarity[0], DVec3::from_slice(&similarity[1..])).map_err(parts)?;
        let metric = match tensors.tensor(METRIC) {
            Ok(_) => {
                let numbers = read_floats(&tensors, METRIC, &[Some(2)])?;
                Some(Metric::new(numbers[0], numbers[1]).map_err(parts)?)
            }
            Err(_) => None,
        };
        let (mut scalars, mut nodes) = (Vec::new(), Nodes::of(&field));
        for (s, Fields { shape, splits, channels }) in metadata.scalars.into_iter().enumerate() {
            let name = format!("scalars.{s}.");
            let fields = match (shape, splits) {
                (Some(shape), None) => {
                    let mlp = || shape.mlp(channels.len());
                    let [features, parameters] =
                        read_network(&tensors, &name, vertices, &shape.network, mlp)?;
                    SurfaceScalars::new(channels, shape, vertices, features, parameters)
                }
                (None, Some(splits)) => {
                    let numbers = read_numbers(&tensors, &name, channels.len())?;
                    nodes.fields(splits, channels, numbers)
                }
                _ => return Err(TensorsError::NotAModel),
            };
            scalars.push(fields.map_err(parts)?);
        }
        Ok(Self { field, similarity, metric, scalars, provenance: metadata.provenance })
    }
}

fn floats(shape: Vec<usize>, values: &[f32]) -> Array {
    Array { dtype: Dtype::F32, shape, bytes: values.iter().flat_map(|x| x.to_le_bytes()).collect() }
}

fn push_network(
    arrays: &mut Vec<(String, Array)>,
    prefix: &str,
    vertices: usize,
    network: &IntrinsicNetwork,
) {
    let shape = vec![vertices, network.shape().features];
    arrays.push((format!("{prefix}features"), floats(shape, network.features())));
    let mut rest = network.mlp().parameters();
    for (l, (inputs, outputs)) in network.mlp().shape().layers().into_iter().enumerate() {
        let (weights, after) = rest.split_at(inputs * outputs);
        let (biases, after) = after.split_at(outputs);
        rest = after;
        arrays.push((format!("{prefix}network.{l}.weight"), floats(vec![outputs, inputs], weights)));
        arrays.push((format!("{prefix}network.{l}.bias"), floats(vec![outputs], biases)));
    }
}

fn integers(shape: Vec<usize>, values: &[i32]) -> Array {
    Array { dtype: Dtype::I32, shape, bytes: values.iter().flat_map(|q| q.to_le_bytes()).collect() }
}

fn read_integers(
    tensors: &SafeTensors<'_>,
    name: &str,
    shape: &[Option<usize>],
) -> Result<Vec<i32>, TensorsError> {
    let bytes = read(tensors, name, Dtype::I32, shape)?;
    Ok(bytes.as_chunks().0.iter().map(|b| i32::from_le_bytes(*b)).collect())
}

fn push_numbers(arrays: &mut Vec<(String, Array)>, prefix: &str, channels: usize, numbers: &ScalarNumbers) {
    let ScalarNumbers { step, rises, integers: all } = numbers;
    let rises = Array { dtype: Dtype::U8, shape: vec![rises.len()], bytes: rises.clone() };
    arrays.extend([
        (format!("{prefix}integers"), integers(vec![all.len() / channels, channels], all)),
        (format!("{prefix}step"), floats(vec![1], &[*step])),
        (format!("{prefix}rises"), rises),
    ]);
}

fn read_numbers(
    tensors: &SafeTensors<'_>,
    prefix: &str,
    channels: usize,
) -> Result<ScalarNumbers, TensorsError> {
    Ok(ScalarNumbers {
        step: read_floats(tensors, &format!("{prefix}step"), &[Some(1)])?[0],
        rises: read(tensors, &format!("{prefix}rises"), Dtype::U8, &[None])?.to_vec(),
        integers: read_integers(tensors, &format!("{prefix}integers"), &[None, Some(channels)])?,
    })
}

fn push_levels(arrays: &mut Vec<(String, Array)>, levels: &Levels) {
    let control = levels.control.as_flattened();
    arrays.push(("levels.control".to_owned(), integers(vec![levels.control.len(), 3], control)));
    arrays.push(("levels.spacing".to_owned(), floats(vec![1], &[levels.spacing])));
    let sharp: [(&str, Vec<i32>); 2] = [
        ("levels.creases", levels.creases.edges().map(|e| e as i32).collect()),
        ("levels.corners", levels.creases.corners().map(|v| v as i32).collect()),
    ];
    arrays.extend(sharp.map(|(name, numbers)| (name.to_owned(), integers(vec![numbers.len()], &numbers))));
    for (l, Level { step, displacements }) in (1..).zip(&levels.levels) {
        let shape = vec![displacements.len()];
        arrays.push((format!("levels.{l}.displacements"), integers(shape, displacements)));
        arrays.push((format!("levels.{l}.step"), floats(vec![1], &[*step])));
    }
}

fn read_levels(tensors: &SafeTensors<'_>, base: &ManifoldMesh, count: usize) -> Result<Levels, TensorsError> {
    let integers = |name: &str, shape: &[Option<usize>]| read_integers(tensors, name, shape);
    let number = |name: &str| Ok::<_, TensorsError>(read_floats(tensors, name, &[Some(1)])?[0]);
    let control = integers("levels.control", &[Some(base.vertex_count()), Some(3)])?;
    let numbers = |name: &str| -> Result<HashSet<usize>, TensorsError> {
        Ok(integers(name, &[None])?.into_iter().filter_map(|q| usize::try_from(q).ok()).collect())
    };
    let (creases, corners) = (numbers("levels.creases")?, numbers("levels.corners")?);
    let mesh = Refinement::from_mesh(base);
    let levels = (1..=count.min(MAX_LEVELS + 1)).map(|l| {
        Ok(Level {
            step: number(&format!("levels.{l}.step"))?,
            displacements: integers(&format!("levels.{l}.displacements"), &[None])?,
        })
    });
    Ok(Levels {
        spacing: number("levels.spacing")?,
        control: control.as_chunks().0.to_vec(),
        creases: Creases::new(&mesh, |e| creases.contains(&e), |v| corners.contains(&v)),
        levels: levels.collect::<Result<_, TensorsError>>()?,
    })
}

/// Features and parameters.
fn read_network(
    tensors: &SafeTensors<'_>,
    prefix: &str,
    vertices: usize,
    shape: &NetworkShape,
    mlp: impl Fn() -> MlpShape,
) -> Result<[Vec<f32>; 2], TensorsError> {
    // Sizes that are absurd must not get as far as being multiplied.
    shape.validate().map_err(|e| TensorsError::Parts(e.into()))?;
    let features =
        read_floats(tensors, &format!("{prefix}features"), &[Some(vertices), Some(shape.features)])?;
    let mut parameters = Vec::new();
    for (l, (inputs, outputs)) in mlp().layers().into_iter().enumerate() {
        let weight = format!("{prefix}network.{l}.weight");
        parameters.extend(read_floats(tensors, &weight, &[Some(outputs), Some(inputs)])?);
        parameters.extend(read_floats(tensors, &format!("{prefix}network.{l}.bias"), &[Some(outputs)])?);
    }
    Ok([features, parameters])
}

fn read_floats(
    tensors: &SafeTensors<'_>,
    name: &str,
    shape: &[Option<usize>],
) -> Result<Vec<f32>, TensorsError> {
    let bytes = read(tensors, name, Dtype::F32, shape)?;
    Ok(bytes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect())
}

/// The bytes of a tensor of this type and shape; `None` for any extent.
fn read<'a>(
    tensors: &SafeTensors<'a>,
    name: &str,
    dtype: Dtype,
    shape: &[Option<usize>],
) -> Result<&'a [u8], TensorsError> {
    let tensor = tensors.tensor(name)?;
    let fits = tensor.shape().len() == shape.len()
        && tensor.shape().iter().zip(shape).all(|(found, asked)| asked.is_none_or(|asked| asked == *found));
    if tensor.dtype() != dtype || !fits {
        let defect =
            format!("{:?} {:?} where {dtype:?} {shape:?} is expected", tensor.dtype(), tensor.shape());
        let defect = FileDefect::mismatch(defect);
        return Err(TensorsError::Tensor { name: name.to_owned(), defect });
    }
    Ok(tensor.data())
}

#[cfg(test)]
mod tests {
    use super::super::tests::model;
    use super::*;

    #[test]
    fn a_model_comes_back_from_its_tensors() {
        let model = model();
        let bytes = model.to_safetensors().unwrap();
        let again = Model::from_safetensors(&bytes).unwrap();
        assert_eq!(again.to_bytes(), model.to_bytes());
        assert_eq!(again.to_safetensors().unwrap(), bytes);
    }

    #[test]
    fn other_files_and_damaged_ones_are_refused() {
        let bytes = model().to_safetensors().unwrap();
        for length in (0..bytes.len()).step_by(7) {
            assert!(Model::from_safetensors(&bytes[..length]).is_err(), "{length}");
        }
        let other = safetensors::serialize([("x", &floats(vec![1], &[1.0]))], None).unwrap();
        assert!(matches!(Model::from_safetensors(&other), Err(TensorsError::NotAModel)));
        // A wrong count in the metadata is met by the shape of a tensor.
        let text = String::from_utf8_lossy(&bytes).into_owned();
        assert!(text.contains(r#"\"features\":2"#));
        let mut wrong = bytes;
        let at = wrong.windows(14).position(|w| w == br#"\"features\":2"#.as_slice()).unwrap();
        wrong[at + 13] = b'9';
        let error = Model::from_safetensors(&wrong).unwrap_err().to_string();
        assert!(error.contains("tensor features"), "{error}");
    }
}
