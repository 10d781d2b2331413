//! Levels of faces, and the micro-vertices that follow from them.
//!
//! The micro-vertices of a face of level l are a triangular grid of 2ˡ steps a side, row by row: place (i, j) has the
//! barycentric coordinates (2ˡ − i − j, i, j) / 2ˡ.

use ndf_mesh::{Halfedge, ManifoldMesh};

use super::MAX_LEVEL;

/// Levels by which micro-faces of all faces have about the same size, `micro_faces` in all, and those of neighbours differ
/// by at most one.
pub(crate) fn levels(base: &ManifoldMesh, micro_faces: usize) -> Vec<u8> {
    let share = base.area() / micro_faces.max(1) as f64;
    let level = |f| (0.5 * (base.face_area(f) / share).log2()).round().clamp(0.0, f64::from(MAX_LEVEL)) as u8;
    let mut levels: Vec<u8> = base.face_indices().map(level).collect();
    let topology = base.topology();
    // From the highest down, so that each face is raised once.
    for high in (2..=MAX_LEVEL).rev() {
        for face in topology.faces().filter(|f| levels[f.index()] == high).collect::<Vec<_>>() {
            for twin in face.halfedges().into_iter().filter_map(|h| topology.twin(h)) {
                let level = &mut levels[twin.face().index()];
                *level = (*level).max(high - 1);
            }
        }
    }
    levels
}

/// A micro-vertex, in the first face that has it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Site {
    pub(crate) face: usize,
    /// Its place in the grid of the face.
    pub(crate) place: usize,
    pub(crate) barycentric: [f64; 3],
}

/// All micro-vertices.
pub(crate) struct Layout {
    pub(crate) sites: Vec<Site>,
    /// For each face, the site of each place of its grid. A place that is left out beside a coarser face has the site of
    /// its neighbour on the edge.
    pub(crate) grids: Vec<Vec<u32>>,
}

/// Steps along a side.
pub(crate) fn steps(level: u8) -> usize {
    1 << level
}

/// Number of places in a grid.
pub(crate) fn places(level: u8) -> usize {
    (steps(level) + 1) * (steps(level) + 2) / 2
}

/// The places (i, j) of a grid, in order.
fn grid(level: u8) -> impl Iterator<Item = [usize; 2]> {
    let n = steps(level);
    (0..=n).flat_map(move |i| (0..=n - i).map(move |j| [i, j]))
}

fn index(level: u8, [i, j]: [usize; 2]) -> usize {
    let row = steps(level) + 1;
    // Rows before i have n + 1, n, …, n + 2 − i places.
    i * row - i * i.saturating_sub(1) / 2 + j
}

/// The micro-faces of a grid whose places have these sites, but those that lost a corner.
pub(crate) fn triangles(level: u8, sites: &[u32]) -> Vec<[u32; 3]> {
    let n = steps(level);
    let at = |i, j| sites[index(level, [i, j])];
    let mut faces = Vec::with_capacity(n * n);
    for [i, j] in grid(level).filter(|[i, j]| i + j < n) {
        faces.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
        if i + j + 1 < n {
            faces.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    faces.retain(|[a, b, c]| a != b && b != c && c != a);
    faces
}

impl Layout {
    /// The layout of faces with these levels, which differ by at most one between neighbours.
    pub(crate) fn new(vertices: usize, faces: &[[u32; 3]], levels: &[u8]) -> Self {
        let edges = Edges::new(faces, levels);
        let mut first_of_edge = Vec::with_capacity(edges.levels.len());
        let mut count = vertices;
        for &level in &edges.levels {
            first_of_edge.push(count);
            count += steps(level) - 1;
        }
        let mut sites: Vec<Option<Site>> = vec![None; count];
        let mut grids = Vec::with_capacity(faces.len());
        for (f, corners) in faces.iter().enumerate() {
            let (level, n) = (levels[f], steps(levels[f]));
            let mut of_face = Vec::with_capacity(places(level));
            for (place, [i, j]) in grid(level).enumerate() {
                let side = match [i, j] {
                    [i, 0] if i < n => Some((0, i)),
                    [i, j] if i + j == n && j < n => Some((1, j)),
                    [0, j] => Some((2, n - j)),
                    _ => None,
                };
                let mut is_left_out = false;
                let site = match side {
                    None => {
                        sites.push(None);
                        sites.len() - 1
                    }
                    Some((side, along)) => {
                        let (edge, is_forward) = edges.of_face[f][side];
                        let coarser = level - edges.levels[edge];
                        is_left_out = coarser > 0 && along % 2 == 1;
                        let (along, end) = (along >> coarser, n >> coarser);
                        match along {
                            0 => corners[side] as usize,
                            _ if is_forward => first_of_edge[edge] + along - 1,
                            _ => first_of_edge[edge] + end - along - 1,
                        }
                    }
                };
                if !is_left_out && sites[site].is_none() {
                    let barycentric = [n - i - j, i, j].map(|x| x as f64 / n as f64);
                    sites[site] = Some(Site { face: f, place, barycentric });
                }
                of_face.push(site as u32);
            }
            grids.push(of_face);
        }
        let sites = sites.into_iter().map(|site| site.expect("every vertex and edge is in a face")).collect();
        Self { sites, grids }
    }
}

/// Whether the levels of all faces at an edge differ by one at most.
pub(crate) fn are_graded(faces: &[[u32; 3]], levels: &[u8]) -> bool {
    let edges = Edges::new(faces, levels);
    let is_graded = |(of_face, &level): (&[(usize, bool); 3], &u8)| {
        of_face.iter().all(|&(edge, _)| level <= edges.levels[edge] + 1)
    };
    edges.of_face.iter().zip(levels).all(is_graded)
}

/// The edges of faces.
struct Edges {
    /// The lower level of both sides.
    levels: Vec<u8>,
    /// For each side of each face, its edge and whether it runs from the lower to the higher vertex.
    of_face: Vec<[(usize, bool); 3]>,
}

impl Edges {
    fn new(faces: &[[u32; 3]], levels: &[u8]) -> Self {
        let ends = |h: Halfedge| {
            let corners = faces[h.face().index()];
            [corners[h.corner()], corners[h.next().corner()]]
        };
        let mut sides: Vec<([u32; 2], Halfedge)> = (0..3 * faces.len())
            .map(Halfedge::new)
            .map(|h| {
                let [a, b] = ends(h);
                ([a.min(b), a.max(b)], h)
            })
            .collect();
        sides.sort_unstable();
        let mut this = Self { levels: Vec::new(), of_face: vec![[(0, false); 3]; faces.len()] };
        let mut last = None;
        for (edge, h) in sides {
            let level = levels[h.face().index()];
            if last != Some(edge) {
                this.levels.push(level);
                last = Some(edge);
            }
            let number = this.levels.len() - 1;
            this.levels[number] = this.levels[number].min(level);
            this.of_face[h.face().index()][h.corner()] = (number, ends(h)[0] == edge[0]);
        }
        this
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_numbered_row_by_row() {
        for level in 0..=MAX_LEVEL {
            assert!(grid(level).enumerate().all(|(place, at)| index(level, at) == place));
            assert_eq!(grid(level).count(), places(level));
            let own: Vec<u32> = (0..places(level) as u32).collect();
            assert_eq!(triangles(level, &own).len(), steps(level) * steps(level));
        }
    }
}
