//! The `BASE` section: connectivity by [`connectivity`](super::connectivity), positions by parallelograms.

use ndf_core::glam::{DVec3, Vec3};

use super::bytes::{Reader, Writer};
use super::connectivity::{self, BaseOrder};
use super::error::ModelError;
use super::grid::Grid;
use super::range_coder::{Coder, Decoder, Encoder, Integers};
use crate::levels::{GateWeights, LevelsError, MAX_FACES, PARALLELOGRAM, Predictor};
use ndf_mesh::io::FileDefect;
use ndf_mesh::{Halfedge, ManifoldMesh, TriangleMesh};

/// How positions and faces are written.
const PLAIN: u8 = 0;
const CODED: u8 = 1;
/// As [`CODED`], with positions on a grid of any spacing and a predictor of their own.
const LEVELLED: u8 = 2;
/// Faces a coded byte may stand for, beyond the first 2¹⁶: what a hostile file can ask for stays in proportion. More
/// regular meshes are written plain.
const MAX_PER_BYTE: usize = 1024;

fn is_plausible(faces: usize, bytes: usize) -> bool {
    faces <= (1 << 16) + MAX_PER_BYTE * bytes
}

/// In place of the exponent of a grid: positions are plain.
const NO_GRID: i8 = i8::MAX;

/// The section, and the order in which vertices are written: all that belongs to vertices follows it.
pub(super) fn write(base: &ManifoldMesh) -> (Vec<u8>, Vec<u32>) {
    coded(base).unwrap_or_else(|| (plain(base), (0..base.vertex_count() as u32).collect()))
}

/// The mesh as it is once written and read: the same with its vertices and faces in another order, in which it then
/// stays.
pub(super) fn in_file_order(base: &ManifoldMesh) -> (ManifoldMesh, BaseOrder) {
    let order = connectivity::encode(&mut Encoder::new(), base);
    order.map_or_else(|| (base.clone(), BaseOrder::identity(base)), |order| (reordered(base, &order), order))
}

/// The mesh with vertices and faces as they come out of a file, of a field with levels or of a network.
pub(super) fn as_written(base: &ManifoldMesh, levelled: bool) -> (ManifoldMesh, BaseOrder) {
    if !levelled && base.face_count() > 1 << 16 && coded(base).is_none() {
        return (base.clone(), BaseOrder::identity(base));
    }
    in_file_order(base)
}

fn plain(base: &ManifoldMesh) -> Vec<u8> {
    let mut w = Writer::default();
    w.u8(PLAIN);
    w.u32(base.vertex_count() as u32);
    w.u32(base.face_count() as u32);
    w.f32s(coordinates(base.positions()));
    for &v in base.faces().iter().flatten() {
        if base.vertex_count() <= 1 << 16 { w.u16(v as u16) } else { w.u32(v) }
    }
    w.0
}

/// Exact: a field's base positions are `f32` values.
fn coordinates(positions: &[DVec3]) -> impl Iterator<Item = f32> + Clone + '_ {
    positions.iter().flat_map(|p| p.as_vec3().to_array())
}

fn coded(base: &ManifoldMesh) -> Option<(Vec<u8>, Vec<u32>)> {
    let mut coder = Encoder::new();
    let order = connectivity::encode(&mut coder, base)?;
    let base = reordered(base, &order);
    let grid = Grid::of(coordinates(base.positions()));
    if let Some(grid) = grid {
        let known: Vec<[i32; 3]> =
            base.positions().iter().map(|p| p.as_vec3().to_array().map(|x| grid.integer(x))).collect();
        code_positions(&mut coder, &Predictor::new(&base), &PARALLELOGRAM, base.vertex_count(), Some(&known));
    }
    let stream = coder.finish();
    if !is_plausible(base.face_count(), stream.len()) {
        return None;
    }
    let mut w = Writer::default();
    w.u8(CODED);
    w.u32(base.vertex_count() as u32);
    w.u32(base.face_count() as u32);
    w.u8(grid.map_or(NO_GRID, Grid::exponent) as u8);
    w.u32(stream.len() as u32);
    w.0.extend(stream);
    if grid.is_none() {
        w.f32s(coordinates(base.positions()));
    }
    Some((w.0, order.vertices))
}

/// The mesh with its parts in another order.
fn reordered(mesh: &ManifoldMesh, order: &BaseOrder) -> ManifoldMesh {
    let mut new = vec![0; mesh.vertex_count()];
    order.vertices.iter().zip(0..).for_each(|(&old, v)| new[old as usize] = v);
    let positions = order.vertices.iter().map(|&old| mesh.positions()[old as usize]).collect();
    let corners = |first: Halfedge| [first, first.next(), first.previous()].map(|h| mesh.topology().tail(h));
    let faces = order.faces.iter().map(|&first| corners(Halfedge(first)).map(|v| new[v.index()])).collect();
    let mesh = TriangleMesh::new(positions, faces).expect("the vertices are the same");
    ManifoldMesh::try_from(mesh).expect("the connectivity is the same")
}

/// A base mesh as it is read.
pub(super) struct ReadBase {
    /// The mesh. Where it has levels, without its positions.
    pub(super) mesh: ManifoldMesh,
    /// Spacing and control vertices of a mesh with levels.
    pub(super) control: Option<(f32, Vec<[i32; 3]>)>,
}

impl From<ManifoldMesh> for ReadBase {
    fn from(mesh: ManifoldMesh) -> Self {
        Self { mesh, control: None }
    }
}

/// Reads the section. In version 1 it is always plain, without saying so.
pub(super) fn read(mut r: Reader<'_>, version: u32) -> Result<ReadBase, ModelError> {
    match if version == 1 { PLAIN } else { r.u8()? } {
        PLAIN => read_plain(r).map(ReadBase::from),
        CODED => read_coded(r).map(ReadBase::from),
        LEVELLED if version >= 3 => read_levelled(r),
        other => Err(r.unknown_coding(other)),
    }
}

fn read_plain(mut r: Reader<'_>) -> Result<ManifoldMesh, ModelError> {
    let (vertices, faces) = (r.u32()? as usize, r.u32()? as usize);
    let positions = read_positions(&mut r, vertices)?;
    let count = faces.saturating_mul(3);
    let indices = if vertices <= 1 << 16 {
        r.u16s(count)?.into_iter().map(u32::from).collect()
    } else {
        r.u32s(count)?
    };
    r.end()?;
    manifold(&r, positions, indices.as_chunks().0.to_vec())
}

fn read_positions(r: &mut Reader<'_>, vertices: usize) -> Result<Vec<DVec3>, ModelError> {
    let positions = r.f32s(vertices.saturating_mul(3))?;
    Ok(positions.as_chunks().0.iter().map(|&p: &[f32; 3]| Vec3::from(p).as_dvec3()).collect())
}

fn manifold(r: &Reader<'_>, positions: Vec<DVec3>, faces: Vec<[u32; 3]>) -> Result<ManifoldMesh, ModelError> {
    let mesh = TriangleMesh::new(positions, faces).map_err(|e| r.defect(FileDefect::from(e)))?;
    ManifoldMesh::try_from(mesh).map_err(|e| r.defect(FileDefect::from(e)))
}

/// The connectivity at the beginning of a stream.
fn read_faces(
    r: &Reader<'_>,
    coder: &mut impl Coder,
    vertices: usize,
    faces: usize,
) -> Result<Vec<[u32; 3]>, ModelError> {
    let (faces, found) = connectivity::decode(coder, faces).map_err(|e| r.defect(e))?;
    if found == vertices {
        return Ok(faces);
    }
    Err(r.defect(FileDefect::mismatch(format!("it has {found} vertices, not {vertices}"))))
}

fn read_coded(mut r: Reader<'_>) -> Result<ManifoldMesh, ModelError> {
    let (vertices, faces) = (r.u32()? as usize, r.u32()? as usize);
    let exponent = r.u8()? as i8;
    let length = r.u32()? as usize;
    if !is_plausible(faces, length) {
        return Err(r.defect(connectivity::too_many_faces()));
    }
    let mut coder = Decoder::new(r.take(length)?);
    let faces = read_faces(&r, &mut coder, vertices, faces)?;
    if exponent == NO_GRID {
        let positions = read_positions(&mut r, vertices)?;
        r.end()?;
        return manifold(&r, positions, faces);
    }
    r.end()?;
    let grid = Grid::new(exponent);
    let base = manifold(&r, vec![DVec3::ZERO; vertices], faces)?;
    let integers = code_positions(&mut coder, &Predictor::new(&base), &PARALLELOGRAM, vertices, None);
    if coder.is_exhausted() || !coder.is_spent() {
        return Err(r.defect(FileDefect::mismatch("its positions do not fit its faces")));
    }
    let positions: Vec<DVec3> =
        integers.iter().map(|p| Vec3::from(p.map(|q| grid.number(q))).as_dvec3()).collect();
    if !positions.iter().all(|p| p.is_finite()) {
        return Err(r.defect(FileDefect::NotFinite("a position")));
    }
    Ok(base.with_positions(positions))
}

/// Codes positions on a grid, vertex by vertex: the residuals of the prediction.
fn code_positions(
    coder: &mut impl Coder,
    predictor: &Predictor,
    weights: &GateWeights,
    count: usize,
    known: Option<&[[i32; 3]]>,
) -> Vec<[i32; 3]> {
    let mut models = [Integers::new(), Integers::new(), Integers::new()];
    let mut done: Vec<[i32; 3]> = Vec::with_capacity(count);
    for v in 0..count {
        let predicted = predictor.predict(v, weights, &done);
        let mut position = [0; 3];
        for c in 0..3 {
            let rest = known.map_or(0, |known| known[v][c].wrapping_sub(predicted[c]));
            position[c] = predicted[c].wrapping_add(models[c].code(coder, rest));
        }
        done.push(position);
    }
    done
}

/// A base mesh with levels without its positions: what does not change while they do.
#[derive(Clone, Debug)]
pub(super) struct LevelledBase {
    /// The mesh in the order of the file; its positions do not count.
    pub(super) mesh: ManifoldMesh,
    /// The vertex that became every vertex.
    pub(super) order: Vec<u32>,
    /// Faces as they are coded; `None` where they are written plain.
    connectivity: Option<Encoder>,
    predictor: Predictor,
}

impl LevelledBase {
    /// The base mesh in the order of the file. O(n).
    pub(super) fn new(base: &ManifoldMesh) -> Self {
        let mut coder = Encoder::new();
        let order = connectivity::encode(&mut coder, base);
        let connectivity = order.is_some().then_some(coder);
        let order = order.unwrap_or_else(|| BaseOrder::identity(base));
        let mesh = reordered(base, &order);
        Self { order: order.vertices, connectivity, predictor: Predictor::new(&mesh), mesh }
    }

    /// The section with these control vertices, in the order of the file. Where it costs so little that a reader would
    /// not believe it, zeros fill it up.
    pub(super) fn write(&self, spacing: f32, control: &[[i32; 3]]) -> Vec<u8> {
        let Self { mesh, connectivity, predictor, .. } = self;
        let mut coder = connectivity.clone().unwrap_or_else(Encoder::new);
        let weights = predictor.fitted_weights(control);
        code_positions(&mut coder, predictor, &weights, mesh.vertex_count(), Some(control));
        let mut w = Writer::default();
        w.u8(LEVELLED);
        w.u32(mesh.vertex_count() as u32);
        w.u32(mesh.face_count() as u32);
        w.f32s([spacing]);
        weights.as_flattened().iter().for_each(|&x| w.u8(x as u8));
        w.u8(if connectivity.is_some() { CODED } else { PLAIN });
        if connectivity.is_none() {
            mesh.faces().iter().flatten().for_each(|&v| w.u32(v));
        }
        let mut stream = coder.finish();
        while !is_plausible(mesh.face_count(), stream.len()) {
            stream.push(0);
        }
        w.0.extend(stream);
        w.0
    }
}

fn read_levelled(mut r: Reader<'_>) -> Result<ReadBase, ModelError> {
    let (vertices, faces) = (r.u32()? as usize, r.u32()? as usize);
    if faces > MAX_FACES {
        return Err(r.defect(LevelsError::Faces));
    }
    let spacing = r.f32()?;
    if !(spacing.is_finite() && spacing > 0.0) {
        return Err(r.defect(FileDefect::value("its spacing is not a positive number")));
    }
    let mut weights = PARALLELOGRAM;
    for weight in weights.as_flattened_mut() {
        *weight = r.u8()? as i8;
    }
    let plain = match r.u8()? {
        PLAIN => Some(r.u32s(faces.saturating_mul(3))?),
        CODED => None,
        other => return Err(r.unknown_coding(other)),
    };
    let stream = r.rest();
    if !is_plausible(faces, stream.len()) {
        return Err(r.defect(connectivity::too_many_faces()));
    }
    let mut coder = Decoder::new(stream);
    let faces = match plain {
        Some(indices) => indices.as_chunks().0.to_vec(),
        None => read_faces(&r, &mut coder, vertices, faces)?,
    };
    // Positions are made for all vertices before it is known that every one has a face.
    if vertices > faces.len().saturating_mul(3) {
        return Err(r.defect(FileDefect::mismatch("it has more vertices than corners of faces")));
    }
    let mesh = manifold(&r, vec![DVec3::ZERO; vertices], faces)?;
    let control = code_positions(&mut coder, &Predictor::new(&mesh), &weights, vertices, None);
    if coder.is_exhausted() || !coder.has_only_zeros() {
        return Err(r.defect(FileDefect::mismatch("its positions do not fit its faces")));
    }
    Ok(ReadBase { mesh, control: Some((spacing, control)) })
}
