//! The `FEAT` section: features on grids.

use super::bytes::{Reader, Writer};
use super::format::ModelError;
use super::grid::Grid;
use super::range_coder::{Coder, Decoder, Encoder, Integers};

const PLAIN: u8 = 0;
const CODED: u8 = 1;
const MOST_FEATURES: usize = 4096;

/// The section. Features are vertex-major, all of `vertices`.
pub(super) fn write(vertices: usize, dimension: usize, features: &[f32]) -> Vec<u8> {
    let mut w = Writer::default();
    match grids(dimension, features) {
        Some(grids) => {
            let integer = |(i, &x): (usize, &f32)| grids[i % dimension].integer(x);
            let integers: Vec<i32> = features.iter().enumerate().map(integer).collect();
            let mut coder = Encoder::new();
            code(&mut coder, vertices, dimension, Some(&integers));
            w.u8(CODED);
            w.u32(dimension as u32);
            grids.iter().for_each(|grid| w.u8(grid.exponent() as u8));
            w.0.extend(coder.finish());
        }
        None => {
            w.u8(PLAIN);
            w.u32(dimension as u32);
            w.f32s(features.iter().copied());
        }
    }
    w.0
}

/// The grid of every feature.
fn grids(dimension: usize, features: &[f32]) -> Option<Vec<Grid>> {
    (0..dimension).map(|k| Grid::of(features.iter().skip(k).step_by(dimension).copied())).collect()
}

/// Reads the section as it is since version 2: number of features a vertex, and features.
pub(super) fn read(mut r: Reader<'_>, vertices: usize) -> Result<(usize, Vec<f32>), ModelError> {
    match r.u8()? {
        PLAIN => read_plain(r, vertices),
        CODED => read_coded(r, vertices),
        other => Err(r.defect(format!("coding {other} is not known"))),
    }
}

/// Reads the section of version 1.
pub(super) fn read_plain(mut r: Reader<'_>, vertices: usize) -> Result<(usize, Vec<f32>), ModelError> {
    let dimension = read_dimension(&mut r)?;
    let features = r.f32s(vertices * dimension)?;
    r.end()?;
    Ok((dimension, features))
}

fn read_dimension(r: &mut Reader<'_>) -> Result<usize, ModelError> {
    let dimension = r.u32()? as usize;
    if dimension > MOST_FEATURES {
        return Err(r.defect(format!("{dimension} features a vertex are more than {MOST_FEATURES}")));
    }
    Ok(dimension)
}

fn read_coded(mut r: Reader<'_>, vertices: usize) -> Result<(usize, Vec<f32>), ModelError> {
    let dimension = read_dimension(&mut r)?;
    let grids: Vec<Grid> = r.take(dimension)?.iter().map(|&e| Grid::new(e as i8)).collect();
    let mut coder = Decoder::new(r.rest());
    let integers = code(&mut coder, vertices, dimension, None);
    if coder.is_exhausted() {
        return Err(r.defect("it ends too early"));
    }
    let features = integers.iter().enumerate().map(|(i, &q)| grids[i % dimension].number(q)).collect();
    Ok((dimension, features))
}

/// Codes features, vertex by vertex, each feature with a distribution of its own. Neighbours foretell nothing: learned
/// features are as far from their neighbours' mean as from zero. Ends early where the coder is exhausted.
fn code(coder: &mut impl Coder, vertices: usize, dimension: usize, known: Option<&[i32]>) -> Vec<i32> {
    let mut models: Vec<Integers> = vec![Integers::new(); dimension];
    let mut done: Vec<i32> = Vec::new();
    for _ in 0..vertices {
        for model in &mut models {
            let value = known.map_or(0, |known| known[done.len()]);
            done.push(model.code(coder, value));
        }
        if coder.is_exhausted() {
            break;
        }
    }
    done
}
