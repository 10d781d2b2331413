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

/// The two corners of every edge of a cell, the lower first. Corner `c` has the offset `c & 1` along x,
/// `c >> 1 & 1` along y and `c >> 2` along z. Edges `4 k .. 4 k + 4` run along axis `k`.
pub(crate) const EDGE_CORNERS: [[u8; 2]; 12] =
    [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

/// The corners of every face of a cell, counter-clockwise seen from outside the cell.
pub(crate) const FACE_CORNERS: [[u8; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// What one cell contributes to the surface.
#[derive(Clone, Debug, Default)]
pub(crate) struct CellCase {
    /// Corners of every triangle: a crossed edge, or `12 + i` for the middle of `middles[i]`. Counter-clockwise
    /// seen from outside the surface.
    pub(crate) triangles: Vec<[u8; 3]>,
    /// Loops filled by a fan around a vertex in their middle: their edges.
    pub(crate) middles: Vec<Vec<u8>>,
}

/// Patterns of inside corners whose face `f` has only two inside corners, on a diagonal: bit `f`.
static AMBIGUOUS_FACES: LazyLock<[u8; 256]> = LazyLock::new(|| {
    std::array::from_fn(|pattern| {
        let is_ambiguous = |face: &[u8; 4]| {
            let [a, b, c, d] = face.map(|corner| pattern >> corner & 1);
            a == c && b == d && a != b
        };
        (0..6).filter(|&f| is_ambiguous(&FACE_CORNERS[f])).fold(0, |bits, f| bits | 1 << f)
    })
});

static CASES: LazyLock<Vec<CellCase>> = LazyLock::new(|| {
    (0..256 * 64)
        .map(|i| {
            let (pattern, joined) = ((i / 64) as u8, (i % 64) as u8);
            let possible = joined & !AMBIGUOUS_FACES[usize::from(pattern)] == 0;
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
        Self { ambiguous: &AMBIGUOUS_FACES, cases: &CASES }
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

/// The edge between two corners.
fn edge_between(a: u8, b: u8) -> u8 {
    let pair = [a.min(b), a.max(b)];
    let edge = EDGE_CORNERS.iter().position(|&corners| corners == pair);
    edge.expect("consecutive corners of a face share an edge") as u8
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

/// The closed chains of segments on the faces of the cell.
fn loops(pattern: u8, joined: u8) -> Vec<Vec<u8>> {
    let inside = |corner: u8| pattern >> corner & 1 == 1;
    // The segment that leaves every crossing. Going around a face counter-clockwise, a segment runs from the
    // edge where the inside is entered to the one where it is left. On the other face of that edge the
    // direction is opposite, so that every crossing begins one segment and ends one.
    let mut following = [u8::MAX; 12];
    for (f, face) in FACE_CORNERS.iter().enumerate() {
        let entered: Vec<usize> = (0..4).filter(|&i| !inside(face[i]) && inside(face[(i + 1) % 4])).collect();
        for &i in &entered {
            // Inside corners of an ambiguous face are cut off one by one, or joined: then the outside ones are.
            let backward = entered.len() == 2 && joined >> f & 1 == 1;
            let steps = if backward { [3, 2, 1] } else { [1, 2, 3] };
            let is_left = |i: usize| inside(face[i % 4]) && !inside(face[(i + 1) % 4]);
            let left = steps.into_iter().map(|s| i + s).find(|&j| is_left(j));
            let left = left.expect("what is entered is left");
            let edge = |i: usize| edge_between(face[i % 4], face[(i + 1) % 4]);
            following[usize::from(edge(i))] = edge(left);
        }
    }
    let mut all = Vec::new();
    let mut met = [false; 12];
    for start in (0..12_u8).filter(|&e| following[usize::from(e)] != u8::MAX) {
        let mut polygon = Vec::new();
        let mut edge = start;
        while !met[usize::from(edge)] {
            met[usize::from(edge)] = true;
            polygon.push(edge);
            edge = following[usize::from(edge)];
        }
        if !polygon.is_empty() {
            all.push(polygon);
        }
    }
    all
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
    fn every_crossed_edge_is_on_one_loop() {
        for pattern in 0..=255_u8 {
            for joined in (0..64_u8).filter(|j| j & !AMBIGUOUS_FACES[usize::from(pattern)] == 0) {
                let mut edges: Vec<u8> = loops(pattern, joined).concat();
                edges.sort_unstable();
                let crossed = |e: &u8| {
                    let [a, b] = EDGE_CORNERS[usize::from(*e)].map(|c| pattern >> c & 1);
                    a != b
                };
                assert_eq!(edges, (0..12).filter(crossed).collect::<Vec<u8>>());
                assert!(loops(pattern, joined).iter().all(|l| l.len() >= 3));
            }
        }
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
