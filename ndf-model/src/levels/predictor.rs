//! Where a vertex of the base mesh is likely to be, from those before it.

use ndf_mesh::{ManifoldMesh, Vertex};

/// How far a prediction goes from the middle of a *gate*, the edge opposite to the vertex in a face of which the corners are
/// known: away from the apex of the face across it, and towards the mean of the known neighbours. In 16ths; first for
/// vertices with one gate, then for those with several. (16, 0) is the parallelogram of Touma & Gotsman (1998).
pub type GateWeights = [[i8; 2]; 2];

/// The parallelogram.
pub const PARALLELOGRAM: GateWeights = [[16, 0]; 2];

/// What a vertex is predicted from: those before it.
#[derive(Clone, Debug, Default)]
struct Known {
    /// Ends and apex of every gate.
    gates: Vec<[u32; 3]>,
    /// One for each face that it shares.
    neighbours: Vec<u32>,
}

/// Predicts vertices of a base mesh in their order.
#[derive(Clone, Debug)]
pub struct Predictor {
    known: Vec<Known>,
}

impl Predictor {
    /// The predictor of a base mesh. O(n).
    pub fn new(base: &ManifoldMesh) -> Self {
        Self { known: base.topology().vertices().map(|v| known(base, v)).collect() }
    }

    /// The integer position of vertex v, from the positions of those before it.
    pub fn predict(&self, v: usize, weights: &GateWeights, before: &[[i32; 3]]) -> [i32; 3] {
        let Known { gates, neighbours } = &self.known[v];
        // Whatever a hostile file says, nothing overflows.
        let sum = |vertices: &mut dyn Iterator<Item = u32>, c: usize| -> i128 {
            vertices.map(|u| i128::from(before[u as usize][c])).sum()
        };
        let [n, m] = [gates.len() as i128, neighbours.len() as i128];
        let [away, towards] = weights[usize::from(n > 1)].map(i128::from);
        [0, 1, 2].map(|c| {
            let around = sum(&mut neighbours.iter().copied(), c);
            if n == 0 {
                return if m == 0 { before.last().map_or(0, |p| p[c]) } else { rounded(around, m) };
            }
            let ends = sum(&mut gates.iter().flat_map(|g| [g[0], g[1]]), c);
            let apexes = sum(&mut gates.iter().map(|g| g[2]), c);
            rounded(
                16 * m * ends + away * m * (ends - 2 * apexes) + towards * (2 * n * around - m * ends),
                32 * n * m,
            )
        })
    }

    /// The prediction as a weighted sum, before it is rounded.
    pub fn row(&self, v: usize, weights: &GateWeights) -> Vec<(u32, f64)> {
        let Known { gates, neighbours } = &self.known[v];
        let [n, m] = [gates.len() as f64, neighbours.len() as f64];
        if gates.is_empty() {
            let before = (v as u32).checked_sub(1).filter(|_| neighbours.is_empty()).map(|u| (u, 1.0));
            return neighbours.iter().map(|&u| (u, 1.0 / m)).chain(before).collect();
        }
        let [away, towards] = weights[usize::from(gates.len() > 1)].map(|w| f64::from(w) / 16.0);
        let end = (1.0 + away - towards) / (2.0 * n);
        let mut row: Vec<(u32, f64)> =
            gates.iter().flat_map(|&[p, q, o]| [(p, end), (q, end), (o, -away / n)]).collect();
        row.extend(neighbours.iter().map(|&u| (u, towards / m)));
        row.sort_unstable_by_key(|&(u, _)| u);
        row.dedup_by(|(u, x), (first, sum)| {
            *u == *first && {
                *sum += *x;
                true
            }
        });
        row
    }

    /// Weights with which these positions are predicted best: least squares, the large residuals weighed down.
    pub fn fitted_weights(&self, positions: &[[i32; 3]]) -> GateWeights {
        let mut weights = PARALLELOGRAM;
        for (class, weights) in weights.iter_mut().enumerate() {
            let mut equations = Vec::new();
            for (v, Known { gates, neighbours }) in self.known.iter().enumerate() {
                if gates.is_empty() || usize::from(gates.len() > 1) != class {
                    continue;
                }
                let at = |u: u32, c: usize| f64::from(positions[u as usize][c]);
                for c in 0..3 {
                    let [n, m] = [gates.len() as f64, neighbours.len() as f64];
                    let middle = gates.iter().map(|g| at(g[0], c) + at(g[1], c)).sum::<f64>() / (2.0 * n);
                    let apex = gates.iter().map(|g| at(g[2], c)).sum::<f64>() / n;
                    let around = neighbours.iter().map(|&u| at(u, c)).sum::<f64>() / m;
                    equations.push([middle - apex, around - middle, at(v as u32, c) - middle]);
                }
            }
            if equations.len() < 24 {
                continue;
            }
            let mut w = [1.0, 0.0];
            for _ in 0..8 {
                let [mut aa, mut ab, mut bb, mut ay, mut by] = [0.0; 5];
                for [a, b, y] in &equations {
                    let weight = 1.0 / ((y - w[0] * a - w[1] * b).abs() + 1.0);
                    aa += weight * a * a;
                    ab += weight * a * b;
                    bb += weight * b * b;
                    ay += weight * a * y;
                    by += weight * b * y;
                }
                let determinant = aa * bb - ab * ab;
                if determinant <= 1e-9 * aa * bb {
                    break;
                }
                w = [(ay * bb - by * ab) / determinant, (by * aa - ay * ab) / determinant];
            }
            *weights = w.map(|w| (16.0 * w).round().clamp(-127.0, 127.0) as i8);
        }
        weights
    }
}

fn known(base: &ManifoldMesh, v: Vertex) -> Known {
    let topology = base.topology();
    let mut known = Known::default();
    for h in topology.outgoing(v) {
        let across = h.next();
        let ends = [topology.tail(across), topology.tip(across)];
        known.neighbours.extend(ends.into_iter().filter(|&u| u < v).map(u32::from));
        let apex = topology.twin(across).map(|twin| topology.tail(twin.previous()));
        if let Some(apex) = apex.filter(|&o| o < v && ends[0] < v && ends[1] < v) {
            known.gates.push([ends[0], ends[1], apex].map(u32::from));
        }
    }
    known
}

/// The nearest integer of a quotient, halves upwards; what no 32 bits hold wraps around.
fn rounded(sum: i128, count: i128) -> i32 {
    (2 * sum + count).div_euclid(2 * count) as i32
}
