//! What the values of nodes are likely to be, from those of coarser levels.
//!
//! Of all functions with these values the likeliest has the least biharmonic energy uᵀ Q u, Q = L M⁻¹ L with the
//! cotangent Laplacian L of the surface and its lumped masses M: thin plates (Duchon 1977), level where a surface ends. Nodes of finer levels are
//! then the solution of Q_ff u_f = −Q_fc u_c, for which a factor Q_ff = T D Tᵀ is made with the nodes in an order of
//! nested dissection (George 1973).

use ndf_core::DVec3;
use rayon::prelude::*;

use super::error::ScalarsError;
use super::nesting::{Adjacency, Nesting};

/// Cotangents are cut here: slivers say nothing.
const MAX_COTANGENT: f64 = 1e3;
/// The least mass of a node, as a share of the mean.
const MIN_MASS: f64 = 1e-3;
/// The least pivot, as a share of the diagonal: constants have no energy.
const MIN_PIVOT: f64 = 1e-12;
/// Entries of the energy and of its factor that are allowed, for every node and beyond: vertices of absurd degrees
/// would fill both.
const MAX_ENTRIES: [usize; 2] = [512, 1 << 22];

/// Sets of nodes of at most this size are not divided.
const UNDIVIDED: usize = 24;

/// The extensions of all levels but the finest to the nodes of finer ones.
#[derive(Clone, Debug)]
pub struct Extensions(Vec<Extension>);

/// From the nodes of a level and coarser ones to all others.
#[derive(Clone, Debug)]
pub struct Extension {
    /// Number of given nodes.
    given: usize,
    /// The other nodes in the order of elimination.
    nodes: Vec<u32>,
    /// The columns of T in that order.
    starts: Vec<usize>,
    entries: Vec<(u32, f64)>,
    /// 1 / D.
    inverse_pivots: Vec<f64>,
    /// Of every node, the given ones in its row of −Q.
    coupled_starts: Vec<usize>,
    coupled: Vec<(u32, f64)>,
}

impl Extensions {
    /// The extensions over nodes at these positions, in the order of their ranks. O(n^1.5) for n nodes.
    ///
    /// # Errors
    /// If the mesh is so irregular that factors have too many entries.
    pub(super) fn new(
        nesting: &Nesting,
        positions: &[DVec3],
        faces: &[[u32; 3]],
    ) -> Result<Self, ScalarsError> {
        let columns = energy(positions, faces)?;
        let order = dissected(positions.len(), faces);
        let extension = |level: usize| Extension::new(&columns, &order, nesting.level(level).end);
        let all = (0..nesting.levels() - 1).into_par_iter().map(extension);
        Ok(Self(all.collect::<Result<_, _>>()?))
    }

    /// That of a level and coarser ones.
    ///
    /// # Panics
    /// If the level is the finest, or none.
    pub fn of_level(&self, level: usize) -> &Extension {
        &self.0[level]
    }

    /// Values of nodes from what they differ by from the extension of coarser levels: `channels` for every rank, in place.
    pub fn accumulate(&self, nesting: &Nesting, values: &mut [f64], channels: usize) {
        for (level, extension) in (1..).zip(&self.0) {
            let (known, new) = values.split_at_mut(extension.given * channels);
            let new = &mut new[..nesting.level(level).len() * channels];
            extension.run(known, channels, |rank, extended| {
                let at = (rank - extension.given) * channels;
                if let Some(row) = new.get_mut(at..at + channels) {
                    row.iter_mut().zip(extended).for_each(|(to, x)| *to += x);
                }
            });
        }
    }
}

impl Extension {
    fn new(columns: &[Vec<(u32, f64)>], order: &[u32], given: usize) -> Result<Self, ScalarsError> {
        const NONE: usize = usize::MAX;
        let nodes: Vec<u32> = order.iter().copied().filter(|&v| v as usize >= given).collect();
        let count = nodes.len();
        let mut steps = vec![NONE; columns.len()];
        nodes.iter().enumerate().for_each(|(k, &v)| steps[v as usize] = k);
        let column = |k: usize| {
            let entries = columns[nodes[k] as usize].iter();
            entries.map(|&(v, x)| (steps[v as usize], x)).filter(move |&(i, _)| i <= k)
        };
        // The factor row by row (Davis 2005, "LDL"): at first the number of entries of its columns.
        let (mut parents, mut marks) = (vec![NONE; count], vec![NONE; count]);
        let (mut lengths, mut total) = (vec![0; count], 0);
        for k in 0..count {
            marks[k] = k;
            for (mut i, _) in column(k) {
                while marks[i] != k {
                    if parents[i] == NONE {
                        parents[i] = k;
                    }
                    lengths[i] += 1;
                    total += 1;
                    marks[i] = k;
                    i = parents[i];
                }
            }
            if total > limit(columns.len()) {
                return Err(ScalarsError::Irregular);
            }
        }
        let mut starts = vec![0; count + 1];
        (0..count).for_each(|k| starts[k + 1] = starts[k] + lengths[k]);
        let mut ends = starts[..count].to_vec();
        let mut entries = vec![(0_u32, 0.0); total];
        let (mut row, mut inverse_pivots) = (vec![0.0; count], vec![0.0; count]);
        let (mut path, mut pattern) = (Vec::new(), Vec::new());
        marks.fill(NONE);
        for k in 0..count {
            marks[k] = k;
            pattern.clear();
            let mut diagonal = 0.0;
            for (i, x) in column(k) {
                if i == k {
                    diagonal = x;
                    continue;
                }
                row[i] = x;
                let mut at = i;
                while marks[at] != k {
                    path.push(at);
                    marks[at] = k;
                    at = parents[at];
                }
                pattern.extend(path.drain(..).rev());
            }
            let mut pivot = diagonal * (1.0 + MIN_PIVOT);
            // The paths are, backwards, a topological order.
            for &i in pattern.iter().rev() {
                let x = std::mem::take(&mut row[i]);
                for &(j, weight) in &entries[starts[i]..ends[i]] {
                    row[j as usize] -= weight * x;
                }
                let weight = x * inverse_pivots[i];
                pivot -= weight * x;
                entries[ends[i]] = (k as u32, weight);
                ends[i] += 1;
            }
            row[k] = 0.0;
            inverse_pivots[k] = 1.0 / pivot.max(MIN_PIVOT * diagonal).max(f64::MIN_POSITIVE);
        }
        let (mut coupled_starts, mut coupled) = (vec![0], Vec::new());
        for &v in &nodes {
            let known = columns[v as usize].iter().filter(|&&(u, _)| (u as usize) < given);
            coupled.extend(known.map(|&(u, x)| (u, -x)));
            coupled_starts.push(coupled.len());
        }
        Ok(Self { given, nodes, starts, entries, inverse_pivots, coupled_starts, coupled })
    }

    /// Extends given values, `channels` for every rank, and calls `found(rank, values)` for all other nodes.
    pub fn run(&self, given: &[f64], channels: usize, mut found: impl FnMut(usize, &[f64])) {
        let count = self.nodes.len();
        let mut x = vec![0.0; count * channels];
        for (k, row) in x.chunks_exact_mut(channels).enumerate() {
            for &(u, weight) in &self.coupled[self.coupled_starts[k]..self.coupled_starts[k + 1]] {
                let known = &given[u as usize * channels..][..channels];
                row.iter_mut().zip(known).for_each(|(to, x)| *to += weight * x);
            }
        }
        for k in 0..count {
            let (before, after) = x.split_at_mut((k + 1) * channels);
            let row = &before[k * channels..];
            if row.iter().all(|x| *x == 0.0) {
                continue;
            }
            for &(i, weight) in self.column(k) {
                let to = &mut after[(i as usize - k - 1) * channels..][..channels];
                to.iter_mut().zip(row).for_each(|(to, x)| *to -= weight * x);
            }
        }
        for k in (0..count).rev() {
            let (before, after) = x.split_at_mut((k + 1) * channels);
            let row = &mut before[k * channels..];
            row.iter_mut().for_each(|x| *x *= self.inverse_pivots[k]);
            for &(i, weight) in self.column(k) {
                let from = &after[(i as usize - k - 1) * channels..][..channels];
                row.iter_mut().zip(from).for_each(|(to, x)| *to -= weight * x);
            }
        }
        self.nodes.iter().zip(x.chunks_exact(channels)).for_each(|(&v, row)| found(v as usize, row));
    }

    fn column(&self, k: usize) -> &[(u32, f64)] {
        &self.entries[self.starts[k]..self.starts[k + 1]]
    }
}

/// An order of elimination: sets are divided by two layers of nodes, which come last, and so are both parts.
fn dissected(count: usize, faces: &[[u32; 3]]) -> Vec<u32> {
    let sides = faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let around = Adjacency::new(count, &sides.collect::<Vec<_>>());
    let mut order = Vec::with_capacity(count);
    // Sets that are to be divided, or else only to be put in order.
    let mut sets = vec![((0..count as u32).collect::<Vec<u32>>(), true)];
    let (mut member, mut depth) = (vec![false; count], vec![0_usize; count]);
    while let Some((set, divide)) = sets.pop() {
        if !divide || set.len() <= UNDIVIDED {
            order.extend(set);
            continue;
        }
        let mut layers = |from: u32, found: &mut Vec<u32>, member: &mut [bool]| {
            let begin = found.len();
            found.push(from);
            (member[from as usize], depth[from as usize]) = (false, 0);
            let mut at = begin;
            while at < found.len() {
                let v = found[at];
                for &u in around.of(v as usize) {
                    if std::mem::take(&mut member[u as usize]) {
                        depth[u as usize] = depth[v as usize] + 1;
                        found.push(u);
                    }
                }
                at += 1;
            }
        };
        set.iter().for_each(|&v| member[v as usize] = true);
        let mut found = Vec::with_capacity(set.len());
        let mut parts = vec![0];
        for &v in &set {
            if member[v as usize] {
                layers(v, &mut found, &mut member);
                parts.push(found.len());
            }
        }
        if parts.len() > 2 {
            sets.extend(parts.windows(2).map(|part| (found[part[0]..part[1]].to_vec(), true)));
            continue;
        }
        // From a node far out.
        set.iter().for_each(|&v| member[v as usize] = true);
        let far = found[found.len() - 1];
        found.clear();
        layers(far, &mut found, &mut member);
        let middle = depth[found[found.len() / 2] as usize];
        let (near, rest): (Vec<u32>, Vec<u32>) = found.iter().partition(|&&v| depth[v as usize] < middle);
        let (between, beyond) = rest.into_iter().partition(|&v| depth[v as usize] < middle + 2);
        sets.push((between, false));
        sets.extend([(beyond, true), (near, true)]);
    }
    order
}

fn limit(nodes: usize) -> usize {
    MAX_ENTRIES[0] * nodes + MAX_ENTRIES[1]
}

/// The columns of Q, of ascending rows, zeros included.
fn energy(positions: &[DVec3], faces: &[[u32; 3]]) -> Result<Vec<Vec<(u32, f64)>>, ScalarsError> {
    let count = positions.len();
    let mut laplacian: Vec<Vec<(u32, f64)>> = vec![Vec::new(); count];
    let mut masses = vec![0.0; count];
    for face in faces {
        let p = face.map(|v| positions[v as usize]);
        let area = (p[1] - p[0]).cross(p[2] - p[0]).length();
        for c in 0..3 {
            let [a, b] = [(c + 1) % 3, (c + 2) % 3];
            let cotangent = (p[a] - p[c]).dot(p[b] - p[c]) / area;
            // What is not a number counts for nothing.
            let cotangent = if cotangent.is_nan() { 0.0 } else { cotangent };
            let weight = cotangent.clamp(-MAX_COTANGENT, MAX_COTANGENT);
            for (v, w) in [(face[a], face[b]), (face[b], face[a])] {
                laplacian[v as usize].extend([(v, weight), (w, -weight)]);
            }
            masses[face[c] as usize] += if area.is_finite() { area } else { 0.0 };
        }
    }
    laplacian.iter_mut().for_each(merge);
    let total: usize = laplacian.iter().map(|row| row.len() * row.len()).sum();
    if total > limit(count) {
        return Err(ScalarsError::Irregular);
    }
    let mean = masses.iter().sum::<f64>() / count as f64;
    let mean = if mean.is_finite() && mean > 0.0 { mean } else { 1.0 };
    let mut columns: Vec<Vec<(u32, f64)>> = vec![Vec::new(); count];
    for (row, mass) in laplacian.iter().zip(&masses) {
        let share = mean / mass.max(MIN_MASS * mean);
        for &(v, x) in row {
            columns[v as usize].extend(row.iter().map(|&(w, y)| (w, share * x * y)));
        }
    }
    columns.iter_mut().for_each(merge);
    Ok(columns)
}

/// Sums entries of the same row.
fn merge(entries: &mut Vec<(u32, f64)>) {
    entries.sort_by_key(|&(row, _)| row);
    entries.dedup_by(|(row, x), (first, sum)| {
        *row == *first && {
            *sum += *x;
            true
        }
    });
}
