//! The cell of a grid: its corners, edges and faces, and the loops in which a surface crosses its sides.
//!
//! Corner `c` has the offset `c & 1` along x, `c >> 1 & 1` along y and `c >> 2` along z. The corners inside the surface
//! make a pattern: bit `c` for corner `c`.

/// The two corners of every edge of a cell, the lower first. Edges `4 k .. 4 k + 4` run along axis `k`.
pub const EDGE_CORNERS: [[u8; 2]; 12] =
    [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

/// The corners of every face of a cell, counter-clockwise seen from outside the cell.
pub const FACE_CORNERS: [[u8; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// The faces of a cell whose inside corners are two on a diagonal: bit `f` for face `f`.
pub fn ambiguous_faces(pattern: u8) -> u8 {
    let is_ambiguous = |face: &[u8; 4]| {
        let [a, b, c, d] = face.map(|corner| pattern >> corner & 1);
        a == c && b == d && a != b
    };
    (0..6).filter(|&f| is_ambiguous(&FACE_CORNERS[f])).fold(0, |bits, f| bits | 1 << f)
}

/// The edge between two corners.
fn edge_between(a: u8, b: u8) -> u8 {
    let pair = [a.min(b), a.max(b)];
    let edge = EDGE_CORNERS.iter().position(|&corners| corners == pair);
    edge.expect("consecutive corners of a face share an edge") as u8
}

/// The closed chains of segments on the faces of the cell, each as the edges it crosses in turn, counter-clockwise seen
/// from outside the surface. The bit of an ambiguous face in `joined` says that its inside corners are joined on it;
/// otherwise each is cut off by itself.
pub fn loops(pattern: u8, joined: u8) -> Vec<Vec<u8>> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_crossed_edge_is_on_one_loop() {
        for pattern in 0..=255_u8 {
            for joined in (0..64_u8).filter(|j| j & !ambiguous_faces(pattern) == 0) {
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
}
