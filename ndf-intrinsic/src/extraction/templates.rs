//! How a triangle is cut when some of its sides are halved (red–green refinement, Bank et al. 1983), and how the
//! pieces hang together.
//!
//! Points of a template are the corners 0, 1, 2 and the middles 3 (of side 0–1), 4 (of 1–2), 5 (of 2–0).

/// What a half-edge of a piece is glued to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Gluing {
    /// Half-edge `3 piece + corner` of the same template.
    Inside(u8),
    /// Part `part` of the triangle's side `side`: the first part, or the whole side, is 0.
    Outside { side: u8, part: u8 },
}

/// One way to cut a triangle.
#[derive(Clone, Debug)]
pub(super) struct Template {
    /// Corners of the pieces, at most four.
    pub(super) pieces: Vec<[u8; 3]>,
    /// What each half-edge of the pieces is glued to.
    pub(super) gluing: Vec<Gluing>,
    /// The half-edge of the pieces that lies along each part of each side.
    pub(super) along: [[u8; 2]; 3],
}

/// All ways to cut a triangle.
pub(super) struct Templates(Vec<Template>);

impl Templates {
    pub(super) fn new() -> Self {
        Self((0..16).map(|key| Template::new(pieces(key & 7, key & 8 != 0))).collect())
    }

    /// The template for the sides of which the bits are set. Where two sides are halved the quad that is left is
    /// cut along one of its diagonals: from the first corner of the whole side, or the `other`, from the second.
    pub(super) fn get(&self, halved: u8, other: bool) -> &Template {
        &self.0[usize::from(halved) + if other { 8 } else { 0 }]
    }
}

fn pieces(halved: u8, other: bool) -> Vec<[u8; 3]> {
    let turned = |by: u8, triangles: &[[u8; 3]]| {
        let turn = |point: u8| point / 3 * 3 + (point % 3 + by) % 3;
        triangles.iter().map(|t| t.map(turn)).collect()
    };
    match halved.count_ones() {
        0 => vec![[0, 1, 2]],
        1 => turned(halved.trailing_zeros() as u8, &[[0, 3, 2], [3, 1, 2]]),
        2 => {
            // Side 0 is whole.
            let whole = (!halved & 7).trailing_zeros() as u8;
            let tip = [5, 4, 2];
            turned(whole, &if other { [tip, [0, 1, 5], [1, 4, 5]] } else { [tip, [0, 1, 4], [0, 4, 5]] })
        }
        _ => vec![[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]],
    }
}

impl Template {
    fn new(pieces: Vec<[u8; 3]>) -> Self {
        let halfedges: Vec<[u8; 2]> =
            pieces.iter().flat_map(|p| [[p[0], p[1]], [p[1], p[2]], [p[2], p[0]]]).collect();
        let mut along = [[u8::MAX; 2]; 3];
        let gluing = halfedges
            .iter()
            .zip(0..)
            .map(|(&[a, b], h)| {
                if let Some(inside) = halfedges.iter().position(|&[c, d]| [d, c] == [a, b]) {
                    return Gluing::Inside(inside as u8);
                }
                // From a corner, the side is that corner's; from a middle, the middle's.
                let (side, part) = (a % 3, a / 3);
                along[side as usize][part as usize] = h;
                Gluing::Outside { side, part }
            })
            .collect();
        Self { pieces, gluing, along }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn templates_cover_the_triangle_and_its_sides() {
        let templates = Templates::new();
        let point =
            |p: u8| [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5_f64]][p as usize];
        for halved in 0..8 {
            for other in [false, true] {
                let template = templates.get(halved, other);
                assert_eq!(template.pieces.len(), 1 + halved.count_ones() as usize);
                let area: f64 = template
                    .pieces
                    .iter()
                    .map(|piece| {
                        let [a, b, c] = piece.map(point);
                        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
                        assert!(area > 0.0);
                        area
                    })
                    .sum();
                assert_eq!(area, 1.0);
                for side in 0..3_u8 {
                    let parts = 1 + (halved >> side & 1);
                    for part in 0..parts {
                        let h = template.along[side as usize][part as usize];
                        assert_eq!(template.gluing[h as usize], Gluing::Outside { side, part });
                    }
                    assert_eq!(template.along[side as usize][1] == u8::MAX, parts == 1);
                }
                for (h, gluing) in template.gluing.iter().enumerate() {
                    if let Gluing::Inside(t) = gluing {
                        assert_eq!(template.gluing[*t as usize], Gluing::Inside(h as u8));
                    }
                }
            }
        }
    }
}
