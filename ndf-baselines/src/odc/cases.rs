//! The loops of every pattern of inside corners, and planes between the loops of one cell.

use std::sync::LazyLock;

use ndf_core::DVec3;
use ndf_meshing::marching_cubes::cell::{EDGE_CORNERS, FACE_CORNERS, ambiguous_faces, loops};

/// The half-space `normal · x ≥ offset` in the coordinates of a cell, [0, 1]³.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HalfSpace {
    pub(crate) normal: DVec3,
    pub(crate) offset: f64,
}

impl HalfSpace {
    fn flipped(self) -> Self {
        Self { normal: -self.normal, offset: -self.offset }
    }

    /// Whether it contains an edge of the cell, which does not lie in its plane.
    fn contains(&self, edge: u8) -> bool {
        let sides = EDGE_CORNERS[usize::from(edge)].map(|c| self.normal.dot(corner(c)) - self.offset);
        sides.iter().all(|&s| s >= 0.0) && sides.iter().any(|&s| s > 0.0)
    }
}

/// The place of a corner in its cell.
pub(crate) fn corner(c: u8) -> DVec3 {
    DVec3::new(f64::from(c & 1), f64::from(c >> 1 & 1), f64::from(c >> 2))
}

/// One of the loops in which the surface crosses the sides of a cell.
#[derive(Clone, Debug)]
pub(crate) struct LoopCase {
    /// The crossed edges in turn, counter-clockwise seen from outside.
    pub(crate) edges: Vec<u8>,
    /// What runs from each of them to the next.
    pub(crate) segments: Vec<SegmentCase>,
    /// Half-spaces that keep the loop from the others of the cell.
    pub(crate) region: Vec<HalfSpace>,
}

/// Where the surface crosses a face of a cell.
#[derive(Clone, Debug)]
pub(crate) struct SegmentCase {
    /// The axis of the face's normal.
    pub(crate) normal: u8,
    /// Half-spaces that keep the segment, in its face, from others there, and with its loop from the others of the cell.
    pub(crate) region: Vec<HalfSpace>,
}

static CASES: LazyLock<Vec<Vec<LoopCase>>> = LazyLock::new(|| (0..=255).map(cases_of).collect());

/// The loops of a pattern of inside corners; those of an ambiguous face are cut off one by one.
pub(crate) fn cases(pattern: u8) -> &'static [LoopCase] {
    &CASES[usize::from(pattern)]
}

fn cases_of(pattern: u8) -> Vec<LoopCase> {
    let all = loops(pattern, 0);
    let ambiguous = ambiguous_faces(pattern);
    let separate = |edges: &[u8], others: &[u8]| {
        let between = |plane: &HalfSpace| {
            edges.iter().all(|&e| plane.contains(e)) && others.iter().all(|&e| plane.flipped().contains(e))
        };
        planes().find(between).expect("a plane parts any two loops of a cell")
    };
    let case = |edges: &Vec<u8>| {
        let others = all.iter().filter(|other| *other != edges);
        let region: Vec<HalfSpace> = others.map(|other| separate(edges, other)).collect();
        let segment = |i: usize| {
            let ends = [edges[i], edges[(i + 1) % edges.len()]];
            let face = face_of(ends);
            let normal = face / 2;
            let mut region = region.clone();
            if ambiguous >> face & 1 == 1 {
                let in_face = |plane: &HalfSpace| plane.normal[usize::from(normal)] == 0.0;
                let half = planes().find(|plane| in_face(plane) && ends.iter().all(|&e| plane.contains(e)));
                region.push(half.expect("both edges meet in a corner"));
            }
            SegmentCase { normal, region }
        };
        LoopCase { segments: (0..edges.len()).map(segment).collect(), edges: edges.clone(), region }
    };
    all.iter().map(case).collect()
}

/// The planes that may part loops: through the neighbours of a corner, and through opposite edges. Both sides of each.
fn planes() -> impl Iterator<Item = HalfSpace> {
    let at_corners = (0..8).map(|c| {
        let inward = DVec3::ONE - 2.0 * corner(c);
        HalfSpace { normal: inward, offset: inward.dot(corner(c)) + 1.0 }
    });
    let diagonal = [[0, 1], [1, 2], [2, 0]].into_iter().flat_map(|[k, l]| {
        let (a, b) = (DVec3::AXES[k], DVec3::AXES[l]);
        [HalfSpace { normal: a - b, offset: 0.0 }, HalfSpace { normal: a + b, offset: 1.0 }]
    });
    at_corners.chain(diagonal).flat_map(|plane| [plane, plane.flipped()])
}

/// The face on which two edges lie.
fn face_of(edges: [u8; 2]) -> u8 {
    let on =
        |face: &[u8; 4]| edges.iter().all(|&e| EDGE_CORNERS[usize::from(e)].iter().all(|c| face.contains(c)));
    FACE_CORNERS.iter().position(on).expect("consecutive edges of a loop share a face") as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_have_up_to_four_loops_with_planes_between() {
        let most = (0..=255).map(|pattern| cases(pattern).len()).max();
        assert_eq!(most, Some(4));
        for pattern in 0..=255_u8 {
            for (i, case) in cases(pattern).iter().enumerate() {
                assert_eq!(case.region.len(), cases(pattern).len() - 1, "{pattern} {i}");
                assert!(case.region.iter().all(|plane| case.edges.iter().all(|&e| plane.contains(e))));
            }
        }
    }

    #[test]
    fn segments_of_an_ambiguous_face_are_on_different_sides() {
        // Corners 0 and 3 of the face z = 0.
        let pattern = 0b1001;
        let regions: Vec<&[HalfSpace]> = cases(pattern)
            .iter()
            .flat_map(|case| &case.segments)
            .filter(|segment| segment.normal == 2)
            .map(|segment| segment.region.as_slice())
            .collect();
        assert_eq!(regions.len(), 2);
        let inside = |region: &[HalfSpace], p: DVec3| region.iter().all(|h| h.normal.dot(p) > h.offset);
        let [near, far] = [DVec3::new(0.3, 0.3, 0.0), DVec3::new(0.7, 0.7, 0.0)];
        assert!(regions.iter().filter(|r| inside(r, near)).count() == 1);
        assert!(regions.iter().filter(|r| inside(r, far)).count() == 1);
    }
}
