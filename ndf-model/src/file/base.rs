//! The `BASE` section: connectivity by [`connectivity`](super::connectivity), positions by parallelograms.

use ndf_core::glam::{DVec3, Vec3};

use super::bytes::{Reader, Writer};
use super::connectivity::{self, BaseOrder};
use super::error::ModelError;
use super::grid::Grid;
use super::range_coder::{Coder, Decoder, Encoder, Integers};
use ndf_mesh::io::FileDefect;
use ndf_mesh::{Halfedge, ManifoldMesh, TriangleMesh, Vertex};

/// How positions and faces are written.
const PLAIN: u8 = 0;
const CODED: u8 = 1;
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
        code_positions(&mut coder, &base, Some(&known));
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

/// Reads the section. In version 1 it is always plain, without saying so.
pub(super) fn read(mut r: Reader<'_>, version: u32) -> Result<ManifoldMesh, ModelError> {
    match if version == 1 { PLAIN } else { r.u8()? } {
        PLAIN => read_plain(r),
        CODED => read_coded(r),
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

fn read_coded(mut r: Reader<'_>) -> Result<ManifoldMesh, ModelError> {
    let (vertices, faces) = (r.u32()? as usize, r.u32()? as usize);
    let exponent = r.u8()? as i8;
    let length = r.u32()? as usize;
    if !is_plausible(faces, length) {
        return Err(r.defect(connectivity::too_many_faces()));
    }
    let mut coder = Decoder::new(r.take(length)?);
    let (faces, found) = connectivity::decode(&mut coder, faces).map_err(|e| r.defect(e))?;
    if found != vertices {
        let text = format!("it has {found} vertices, not {vertices}");
        return Err(r.defect(FileDefect::Mismatch(text.into())));
    }
    if exponent == NO_GRID {
        let positions = read_positions(&mut r, vertices)?;
        r.end()?;
        return manifold(&r, positions, faces);
    }
    r.end()?;
    let grid = Grid::new(exponent);
    let base = manifold(&r, vec![DVec3::ZERO; vertices], faces)?;
    let integers = code_positions(&mut coder, &base, None);
    if coder.is_exhausted() || !coder.is_spent() {
        return Err(r.defect(FileDefect::Mismatch("its positions do not fit its faces".into())));
    }
    let positions: Vec<DVec3> =
        integers.iter().map(|p| Vec3::from(p.map(|q| grid.number(q))).as_dvec3()).collect();
    if !positions.iter().all(|p| p.is_finite()) {
        return Err(r.defect(FileDefect::NotFinite("a position")));
    }
    Ok(base.with_positions(positions))
}

/// Codes positions on a grid, vertex by vertex: what a parallelogram does not predict.
fn code_positions(coder: &mut impl Coder, base: &ManifoldMesh, known: Option<&[[i32; 3]]>) -> Vec<[i32; 3]> {
    let mut models = [Integers::new(), Integers::new(), Integers::new()];
    let mut done: Vec<[i32; 3]> = Vec::with_capacity(base.vertex_count());
    for v in base.topology().vertices() {
        let predicted = predict(base, v, &done);
        let mut position = [0; 3];
        for c in 0..3 {
            let rest = known.map_or(0, |known| known[v.index()][c].wrapping_sub(predicted[c]));
            position[c] = predicted[c].wrapping_add(models[c].code(coder, rest));
        }
        done.push(position);
    }
    done
}

/// The mean of the parallelograms that end in a vertex (Touma & Gotsman 1998); where there is none, of the neighbours
/// that are known; else the vertex before.
fn predict(base: &ManifoldMesh, v: Vertex, done: &[[i32; 3]]) -> [i32; 3] {
    let mut parallelograms = Mean::default();
    let mut neighbours = Mean::default();
    let known = |v: Vertex| done.get(v.index()).map(|p| p.map(i64::from));
    for h in base.topology().outgoing(v) {
        let across = h.next();
        let (x, y) = (known(base.topology().tail(across)), known(base.topology().tip(across)));
        [x, y].into_iter().flatten().for_each(|p| neighbours.add(p));
        if let (Some(x), Some(y), Some(twin)) = (x, y, base.topology().twin(across))
            && let Some(o) = known(base.topology().tail(twin.previous()))
        {
            parallelograms.add([0, 1, 2].map(|c| x[c] + y[c] - o[c]));
        }
    }
    let before = done.last().copied().unwrap_or_default();
    parallelograms.rounded().or_else(|| neighbours.rounded()).unwrap_or(before)
}

/// A mean of places.
#[derive(Default)]
struct Mean {
    sum: [i64; 3],
    count: i64,
}

impl Mean {
    fn add(&mut self, p: [i64; 3]) {
        (0..3).for_each(|c| self.sum[c] += p[c]);
        self.count += 1;
    }

    /// The nearest integers, halves upwards.
    fn rounded(&self) -> Option<[i32; 3]> {
        let mean = |sum: i64| (2 * sum + self.count).div_euclid(2 * self.count) as i32;
        (self.count > 0).then(|| self.sum.map(mean))
    }
}
