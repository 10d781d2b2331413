//! How large a displacement is likely to be, from those that are coded before it: integers alone, so that every machine
//! comes to the same contexts.

use ndf_mesh::subdivision::{NONE, Refinement};

/// Contexts of a displacement: half octaves of its expected magnitude.
pub const CONTEXTS: usize = 14;

/// What tells of a displacement, in this order: the mean magnitude of the neighbours that share a face with it, and of
/// those a face further (on both counts those before it), the mean energy of the ends of its edge, of the vertices
/// across it, and a constant.
pub const CLUES: usize = 5;

/// Weights of the clues, in 32nds.
pub type ClueWeights = [u8; CLUES];

/// Magnitudes above count as this.
const LARGEST: u32 = 15;
/// Clues are in 16ths of a step.
const CLUE_UNIT: u32 = 16;
/// The least expected magnitude of contexts 1, 2, …, in 512ths of a step: 0.02 · 2^(k/2).
const THRESHOLDS: [u32; CONTEXTS - 1] = [14, 20, 29, 41, 58, 82, 116, 164, 232, 328, 463, 655, 927];

/// The displacements that tell of another, and the vertices below: what clues are taken from.
#[derive(Clone, Debug)]
pub struct Neighbours {
    /// Displacements before it; the list of each ends with [`NONE`].
    near: Vec<[u32; 4]>,
    far: Vec<[u32; 8]>,
    /// Ends of its edge and the vertices across it: on the boundary the only one, twice.
    vertices: Vec<[u32; 4]>,
}

impl Neighbours {
    /// The neighbours on the level above `below`. O(n).
    pub fn new(below: &Refinement) -> Self {
        let count = below.edges().len();
        let mut around = vec![[NONE; 4]; count];
        for sides in below.face_edges() {
            for c in 0..3 {
                let list = &mut around[sides[c] as usize];
                let from = if list[0] == NONE { 0 } else { 2 };
                (list[from], list[from + 1]) = (sides[(c + 1) % 3], sides[(c + 2) % 3]);
            }
        }
        let before = |e: u32| move |&n: &u32| n != NONE && n < e;
        let near = (0..count as u32).map(|e| padded(around[e as usize].into_iter().filter(before(e))));
        let far = (0..count as u32).map(|e| {
            let own = around[e as usize];
            let next = own.into_iter().filter(|&n| n != NONE).flat_map(|n| around[n as usize]);
            let mut found = [NONE; 8];
            let mut len = 0;
            for n in next.filter(before(e)) {
                if !own.contains(&n) && !found.contains(&n) && len < 8 {
                    found[len] = n;
                    len += 1;
                }
            }
            found
        });
        let vertices = below.edges().iter().map(|side| {
            let ([a, b], [c, d]) = (side.ends, side.across);
            [a, b, c, if d == NONE { c } else { d }]
        });
        Self { near: near.collect(), far: far.collect(), vertices: vertices.collect() }
    }
}

/// The clues of the displacements of one level.
#[derive(Clone, Debug)]
pub struct Clues<'a> {
    neighbours: &'a Neighbours,
    /// Mean energies of ends and of vertices across.
    coarse: Vec<[u32; 2]>,
}

impl<'a> Clues<'a> {
    /// The clues of these neighbours above vertices of these energies.
    pub fn new(neighbours: &'a Neighbours, energies: &[u32]) -> Self {
        let coarse = neighbours.vertices.iter().map(|vertices| {
            let [a, b, c, d] = vertices.map(|v| energies[v as usize]);
            [a.midpoint(b), c.midpoint(d)]
        });
        Self { neighbours, coarse: coarse.collect() }
    }

    /// The clues of displacement i; `magnitude(j)` is asked for j < i.
    pub fn of(&self, i: usize, magnitude: impl Fn(u32) -> u32) -> [u32; CLUES] {
        let mean = |list: &[u32]| {
            let known = list.iter().take_while(|&&n| n != NONE);
            let (sum, count) = known.fold((0, 0), |(s, c), &n| (s + magnitude(n).min(LARGEST), c + 1));
            CLUE_UNIT * sum / count.max(1)
        };
        let [ends, across] = self.coarse[i];
        [mean(&self.neighbours.near[i]), mean(&self.neighbours.far[i]), ends, across, CLUE_UNIT]
    }

    /// The context of displacement i.
    pub fn context(&self, weights: &ClueWeights, i: usize, magnitude: impl Fn(u32) -> u32) -> usize {
        let clues = self.of(i, magnitude);
        let expected: u32 = clues.iter().zip(weights).map(|(clue, &weight)| clue * u32::from(weight)).sum();
        THRESHOLDS.partition_point(|&threshold| threshold <= expected)
    }
}

fn padded<const N: usize>(items: impl Iterator<Item = u32>) -> [u32; N] {
    let mut list = [NONE; N];
    list.iter_mut().zip(items).for_each(|(to, item)| *to = item);
    list
}

/// Energies of the vertices of a level: of a new one its magnitude, of another the mean magnitude of its edges and half its
/// energy on the level below. In 16ths of a step.
pub fn energies(below: &Refinement, coarser: &[u32], magnitude: impl Fn(u32) -> u32) -> Vec<u32> {
    let mut sums = vec![[0, 0]; below.vertex_count()];
    let mut finer = Vec::with_capacity(below.vertex_count() + below.edges().len());
    for (e, side) in (0..).zip(below.edges()) {
        for v in side.ends {
            let [sum, count] = &mut sums[v as usize];
            *sum += magnitude(e).min(LARGEST);
            *count += 1;
        }
    }
    finer.extend(sums.iter().zip(coarser).map(|([sum, count], energy)| CLUE_UNIT * sum / count + energy / 2));
    finer.extend((0..below.edges().len() as u32).map(|e| CLUE_UNIT * magnitude(e).min(LARGEST)));
    finer
}

/// Weights with which the clues predict these displacements best: non-negative least squares of the magnitudes, each
/// weighed by its expected size.
pub fn fitted_weights(clues: &Clues<'_>, displacements: &[i32]) -> ClueWeights {
    if displacements.iter().all(|&q| q == 0) {
        return [0; CLUES];
    }
    let magnitude = |i: usize| displacements[i].unsigned_abs().min(LARGEST);
    let unit = f64::from(CLUE_UNIT);
    let rows: Vec<([f64; CLUES], f64)> = (0..displacements.len())
        .map(|i| {
            let clues = clues.of(i, |j| magnitude(j as usize));
            (clues.map(|clue| f64::from(clue) / unit), f64::from(magnitude(i)))
        })
        .collect();
    let mut weights = [0.3; CLUES];
    for _ in 0..3 {
        let (mut matrix, mut right) = ([[0.0; CLUES]; CLUES], [0.0; CLUES]);
        for (x, y) in &rows {
            let expected: f64 = x.iter().zip(&weights).map(|(x, w)| x * w).sum();
            let weight = (0.3 + expected).powi(-2);
            for a in 0..CLUES {
                right[a] += weight * x[a] * y;
                (0..CLUES).for_each(|b| matrix[a][b] += weight * x[a] * x[b]);
            }
        }
        // Coordinate descent, which keeps to the non-negative ones.
        for _ in 0..200 {
            for a in 0..CLUES {
                let slope: f64 = (0..CLUES).map(|b| matrix[a][b] * weights[b]).sum::<f64>() - right[a];
                weights[a] = (weights[a] - slope / matrix[a][a].max(1e-12)).max(0.0);
            }
        }
    }
    weights.map(|w| (32.0 * w).round().min(255.0) as u8)
}
