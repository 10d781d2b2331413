//! The cases of one cell: which triangles join the crossed edges, for every pattern of corners and every way
//! to resolve its ambiguous faces.
//!
//! The tables are generated, not typed in. On each face of the cell the crossings are joined by segments that
//! depend on that face alone, so that both cells of a face agree. The segments of the six faces chain up to
//! closed loops, each crossing on exactly one; each loop is filled by a disk. A filling never uses a diagonal
//! between two crossings of one face, which the neighbour could use as well: where there is none without, the
//! disk gets a vertex in its middle. So every edge of the result has two faces and every vertex one fan.
//!
//! Of the ambiguities of marching cubes (Chernyaev 1995; Lewiner et al. 2003) that of the faces is resolved as
//! the trilinear interpolant has it, by the asymptotic decider (Nielson and Hamann 1991); that of the interior
//! always as two sheets, never as a tunnel.

use std::sync::LazyLock;

use super::cell::{EDGE_CORNERS, FACE_CORNERS, ambiguous_faces, loops};

/// What one cell contributes to the surface.
#[derive(Clone, Debug, Default)]
pub(crate) struct CellCase {
    /// Corners of every triangle: a crossed edge, or `12 + i` for the middle of `middles[i]`. Counter-clockwise
    /// seen from outside the surface.
    pub(crate) triangles: Vec<[u8; 3]>,
    /// Loops filled by a fan around a vertex in their middle: their edges.
    pub(crate) middles: Vec<Vec<u8>>,
}

static AMBIGUOUS: LazyLock<[u8; 256]> =
    LazyLock::new(|| std::array::from_fn(|pattern| ambiguous_faces(pattern as u8)));

static CASES: LazyLock<Vec<CellCase>> = LazyLock::new(|| {
    (0..256 * 64)
        .map(|i| {
            let (pattern, joined) = ((i / 64) as u8, (i % 64) as u8);
            let possible = joined & !AMBIGUOUS[usize::from(pattern)] == 0;
            if possible { make_case(pattern, joined) } else { CellCase::default() }
        })
        .collect()
});

/// All cases; looked up once a run rather than once a cell.
#[derive(Clone, Copy)]
pub(crate) struct CaseTable {
    ambiguous: &'static [u8; 256],
    cases: &'static [CellCase],
}

impl CaseTable {
    pub(crate) fn new() -> Self {
        Self { ambiguous: &AMBIGUOUS, cases: &CASES }
    }

    /// The case of a cell with these values at its corners; inside is above zero, NaN is outside.
    pub(crate) fn case(&self, pattern: u8, values: &[f64; 8]) -> &'static CellCase {
        let ambiguous = self.ambiguous[usize::from(pattern)];
        let mut joined = 0;
        if ambiguous != 0 {
            for f in (0..6).filter(|f| ambiguous >> f & 1 == 1) {
                let [a, b, c, d] = FACE_CORNERS[f].map(|corner| values[usize::from(corner)]);
                // The saddle of the bilinear interpolant is inside. Products of pairs do not depend on the
                // order in which a cell lists the corners: both neighbours decide alike, also on NaN.
                let (inner, outer) = if a > 0.0 { (a * c, b * d) } else { (b * d, a * c) };
                joined |= u8::from(inner > outer) << f;
            }
        }
        &self.cases[usize::from(pattern) * 64 + usize::from(joined)]
    }
}

/// Whether two edges lie on one face.
fn share_a_face(a: u8, b: u8) -> bool {
    let on = |face: &[u8; 4], edge: u8| EDGE_CORNERS[usize::from(edge)].iter().all(|c| face.contains(c));
    FACE_CORNERS.iter().any(|face| on(face, a) && on(face, b))
}

fn make_case(pattern: u8, joined: u8) -> CellCase {
    let mut case = CellCase::default();
    for polygon in loops(pattern, joined) {
        if let Some(triangles) = fill(&polygon) {
            case.triangles.extend(triangles);
        } else {
            let middle = 12 + case.middles.len() as u8;
            let n = polygon.len();
            case.triangles.extend((0..n).map(|i| [polygon[i], polygon[(i + 1) % n], middle]));
            case.middles.push(polygon);
        }
    }
    case
}

/// Fills a loop by triangles without a diagonal on a face of the cell, with the least sum of squared diagonals
/// over the middles of the edges; `None` if there is no such filling.
fn fill(polygon: &[u8]) -> Option<Vec<[u8; 3]>> {
    let n = polygon.len();
    let weight = |i: usize, j: usize| -> Option<u32> {
        if j == i + 1 || (i == 0 && j == n - 1) {
            return Some(0);
        }
        if share_a_face(polygon[i], polygon[j]) {
            return None;
        }
        // Twice the middle of an edge has integer coordinates.
        let twice = |edge: u8| {
            let [a, b] = EDGE_CORNERS[usize::from(edge)];
            [0, 1, 2].map(|k| i32::from(a >> k & 1) + i32::from(b >> k & 1))
        };
        let (p, q) = (twice(polygon[i]), twice(polygon[j]));
        Some((0..3).map(|k| p[k].abs_diff(q[k]).pow(2)).sum())
    };
    // Best filling of the part from corner i to corner j, by length (Klincsek 1980).
    let mut best: Vec<Vec<Option<(u32, usize)>>> = vec![vec![None; n]; n];
    for i in 0..n - 1 {
        best[i][i + 1] = Some((0, i));
    }
    for length in 2..n {
        for i in 0..n - length {
            let j = i + length;
            let Some(own) = weight(i, j) else { continue };
            let candidates = (i + 1..j).filter_map(|k| Some((best[i][k]?.0 + best[k][j]?.0 + own, k)));
            best[i][j] = candidates.min();
        }
    }
    best[0][n - 1]?;
    let mut triangles = Vec::with_capacity(n - 2);
    let mut open = vec![(0, n - 1)];
    while let Some((i, j)) = open.pop() {
        if j > i + 1 {
            let (_, k) = best[i][j]?;
            triangles.push([polygon[i], polygon[k], polygon[j]]);
            open.extend([(i, k), (k, j)]);
        }
    }
    Some(triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_inside_corner_is_cut_off_by_an_outward_triangle() {
        assert_eq!(loops(1, 0), vec![vec![0, 4, 8]]);
        let case = CaseTable::new().case(1, &[1.0, -1.0, -1.0, -1.0, -1.0, -1.0, -1.0, -1.0]);
        // Edges along x, y, z from the corner at the origin: the normal points to (1, 1, 1).
        assert_eq!(case.triangles, vec![[0, 4, 8]]);
    }

    #[test]
    fn no_diagonal_lies_on_a_face() {
        let mut with_middle = 0;
        for (i, case) in CASES.iter().enumerate() {
            let polygons = loops((i / 64) as u8, (i % 64) as u8);
            with_middle += case.middles.len();
            for [a, b, c] in &case.triangles {
                for (p, q) in [(a, b), (b, c), (c, a)] {
                    let on_loop =
                        |l: &Vec<u8>| (0..l.len()).any(|k| (l[k], l[(k + 1) % l.len()]) == (*p, *q));
                    let inner = *p >= 12 || *q >= 12 || polygons.iter().any(on_loop);
                    assert!(inner || !share_a_face(*p, *q), "case {i}");
                }
            }
        }
        assert!(with_middle > 0, "some loops of the joined cases need a middle");
    }
}
