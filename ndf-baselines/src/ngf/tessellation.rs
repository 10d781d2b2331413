//! Even tessellations of quadrilaterals that share the samples on common sides.

/// A sample, in the first quadrilateral that has it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) quad: usize,
    /// Weights of its corners.
    pub(crate) weights: [f32; 4],
}

/// Samples and the triangles between them.
pub(crate) struct Tessellation {
    pub(crate) samples: Vec<Sample>,
    pub(crate) faces: Vec<[u32; 3]>,
}

impl Tessellation {
    /// So many steps along each side. The first samples are the corners, of which each must be in a quadrilateral.
    pub(crate) fn new(corners: usize, quads: &[[u32; 4]], steps: usize) -> Self {
        assert!(steps > 0);
        let mut edges: Vec<[u32; 2]> = quads.iter().flat_map(sides).filter(|[a, b]| a != b).collect();
        edges.sort_unstable();
        edges.dedup();
        let mut samples: Vec<Option<Sample>> = vec![None; corners + edges.len() * (steps - 1)];
        let mut faces = Vec::with_capacity(2 * quads.len() * steps * steps);
        let mut grid = Vec::new();
        for (quad, corners_of_quad) in quads.iter().enumerate() {
            let edge_of_side =
                sides(corners_of_quad).map(|side| edges.binary_search(&side).ok()).collect::<Vec<_>>();
            grid.clear();
            for j in 0..=steps {
                for i in 0..=steps {
                    let side = match (i, j) {
                        (i, 0) if i < steps => Some((0, i)),
                        (i, j) if i == steps && j < steps => Some((1, j)),
                        (i, j) if j == steps && i > 0 => Some((2, steps - i)),
                        (0, j) => Some((3, steps - j)),
                        _ => None,
                    };
                    let place = match side {
                        None => {
                            samples.push(None);
                            samples.len() - 1
                        }
                        Some((side, along)) => {
                            let [a, b] = [corners_of_quad[side], corners_of_quad[(side + 1) % 4]];
                            match edge_of_side[side] {
                                // A side without length.
                                _ if a == b || along == 0 => a as usize,
                                Some(edge) => {
                                    let along = if a < b { along } else { steps - along };
                                    corners + edge * (steps - 1) + along - 1
                                }
                                None => a as usize,
                            }
                        }
                    };
                    if samples[place].is_none() {
                        let [u, v] = [i, j].map(|x| x as f32 / steps as f32);
                        let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), u * v, (1.0 - u) * v];
                        samples[place] = Some(Sample { quad, weights });
                    }
                    grid.push(place as u32);
                }
            }
            for j in 0..steps {
                for i in 0..steps {
                    let at = |i: usize, j: usize| grid[j * (steps + 1) + i];
                    let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    // Diagonals alternate, so that none is favoured.
                    let pair = if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
                    faces.extend(pair.into_iter().filter(|[p, q, r]| p != q && q != r && r != p));
                }
            }
        }
        let samples = samples.into_iter().map(|s| s.expect("every corner is in a quadrilateral")).collect();
        Self { samples, faces }
    }
}

/// The sides of a quadrilateral in turn, the lower corner first.
fn sides(quad: &[u32; 4]) -> impl Iterator<Item = [u32; 2]> {
    let quad = *quad;
    (0..4).map(move |side| {
        let [a, b] = [quad[side], quad[(side + 1) % 4]];
        [a.min(b), a.max(b)]
    })
}

#[cfg(test)]
mod tests {
    use super::super::quads::paired;
    use super::*;
    use ndf_core::DVec3;
    use ndf_mesh::{ManifoldMesh, TriangleMesh, shapes};

    #[test]
    fn tessellations_of_closed_meshes_are_closed() {
        for (shape, euler) in [(shapes::icosphere(2), 2), (shapes::torus(14, 9, 1.0, 0.4), 0)] {
            let mesh = ManifoldMesh::try_from(shape).unwrap();
            let mut quads = paired(&mesh).quads;
            // As if a pair had not been found.
            let [a, b, c, d] = quads[5];
            quads[5] = [a, b, c, c];
            quads.push([a, c, d, d]);
            for steps in [1, 2, 3, 8] {
                let Tessellation { samples, faces } = Tessellation::new(mesh.vertex_count(), &quads, steps);
                let place = |s: &Sample| -> DVec3 {
                    quads[s.quad]
                        .iter()
                        .zip(s.weights)
                        .map(|(&v, w)| f64::from(w) * mesh.positions()[v as usize])
                        .sum()
                };
                let fine = TriangleMesh::new(samples.iter().map(place).collect(), faces).unwrap();
                let fine = ManifoldMesh::try_from(fine).unwrap();
                assert_eq!(fine.topology().boundary_edge_count(), 0);
                assert_eq!(fine.topology().euler_characteristic(), euler);
                assert!((fine.area() / mesh.area() - 1.0).abs() < 0.05);
            }
        }
    }
}
