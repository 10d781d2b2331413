//! A subdivision surface at any point.

use std::collections::HashMap;

use ndf_core::DVec3;
use ndf_mesh::FacePoint;
use ndf_mesh::subdivision::Refinement;
use rayon::prelude::*;

use crate::mapped::Mapped;

/// The limit of a subdivided mesh, as curved triangles through limit points of its finest level: the cubic ones of Vlachos
/// et al. (2001), which the points and normals at their corners determine. Neighbours share their edge curves, so the
/// surface is continuous; it differs from the limit by an error of third order in the length of the finest edges. At
/// creases every side has normals of its own, and the edge curves follow the tangents of the crease.
#[derive(Clone, Debug)]
pub struct LevelSurface {
    /// How often base faces are split.
    depth: u32,
    /// Faces of the finest level; those of base face f are f · 4^depth and on.
    faces: Vec<[u32; 3]>,
    points: Vec<DVec3>,
    normals: Vec<DVec3>,
    creases: Option<SharpSides>,
}

/// What is different at creases.
#[derive(Clone, Debug)]
struct SharpSides {
    /// Of the corners of every face, which normal they have.
    normals: Vec<[u32; 3]>,
    /// Of every face, bit c: whether side c is a crease.
    sides: Vec<u8>,
    /// Tangents of the creases at vertices; zero where edges are straight.
    tangents: Vec<DVec3>,
}

impl LevelSurface {
    /// The surface through these limit points of the finest level, `depth` levels above the base mesh. `coarser` is the level
    /// below it.
    pub(super) fn new(depth: u32, coarser: &Refinement, points: Vec<DVec3>) -> Self {
        let (mut normals, faces) =
            rayon::join(|| coarser.refined_normals(&points), || coarser.refined_faces());
        let creases =
            coarser.has_creases().then(|| SharpSides::new(&coarser.refined(), &points, &mut normals));
        Self { depth, faces, points, normals, creases }
    }

    /// Corners of the faces of the finest level; those of base face f are f · 4^[depth](Self::depth) and on.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// Points of the surface: the vertices of the finest level.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// How often base faces are split on the finest level.
    pub fn depth(&self) -> u32 {
        self.depth
    }

    /// The surface at points of the base mesh. O(levels) each.
    ///
    /// # Panics
    /// If a face does not exist in the base mesh.
    pub fn map(&self, points: &[FacePoint]) -> Vec<DVec3> {
        points.par_iter().with_min_len(256).map(|point| self.at(point).point).collect()
    }

    /// The surface and its tangents.
    ///
    /// # Panics
    /// If a face does not exist in the base mesh.
    pub fn map_with_tangents(&self, points: &[FacePoint]) -> Vec<Mapped> {
        points.par_iter().with_min_len(256).map(|point| self.at(point)).collect()
    }

    /// The surface and its tangents at one point of the base mesh.
    ///
    /// # Panics
    /// If the face does not exist in the base mesh.
    pub fn at(&self, point: &FacePoint) -> Mapped {
        // The corners of the base face as rows of barycentric coordinates in the face of the finest level: where the
        // point is, and how it moves when the base coordinates do.
        let (mut face, mut b) = (point.face.index(), point.barycentric);
        let mut edges = [[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]];
        for _ in 0..self.depth {
            let child = (0..3).find(|&c| b[c] >= 0.5).unwrap_or(3);
            face = 4 * face + child;
            if child < 3 {
                b = b.map(|x| 2.0 * x);
                b[child] -= 1.0;
                edges = edges.map(|edge| edge.map(|x| 2.0 * x));
            } else {
                // Its corners are on the sides across the corners 2, 0, 1.
                b = [1.0 - 2.0 * b[2], 1.0 - 2.0 * b[0], 1.0 - 2.0 * b[1]];
                edges = edges.map(|[x, y, z]| [-2.0 * z, -2.0 * x, -2.0 * y]);
            }
        }
        let slopes = self.slopes(face, b);
        let along = |w: [f64; 3]| w[0] * slopes[0] + w[1] * slopes[1] + w[2] * slopes[2];
        // Euler: a homogeneous cubic form is a third of what its slopes give at the point itself.
        Mapped { point: along(b) / 3.0, tangents: edges.map(along) }
    }

    /// Partial derivatives of the cubic form of a face of the finest level.
    fn slopes(&self, face: usize, [u, v, w]: [f64; 3]) -> [DVec3; 3] {
        let corners = self.faces[face];
        let p = corners.map(|v| self.points[v as usize]);
        let (n, sharp) = match &self.creases {
            None => (corners, 0),
            Some(creases) => (creases.normals[face], creases.sides[face]),
        };
        let n = n.map(|v| self.normals[v as usize]);
        // Three times the control point next to corner i on the edge to corner j.
        let edge = |i: usize, j: usize| {
            let d = p[j] - p[i];
            let side = if (i + 1) % 3 == j { i } else { j };
            match &self.creases {
                Some(creases) if sharp >> side & 1 == 1 => {
                    let t = creases.tangents[corners[i] as usize];
                    3.0 * p[i] + if t == DVec3::ZERO { d } else { d.dot(t) * t }
                }
                _ => 3.0 * p[i] + d - d.dot(n[i]) * n[i],
            }
        };
        let (b210, b120) = (edge(0, 1), edge(1, 0));
        let (b021, b012) = (edge(1, 2), edge(2, 1));
        let (b102, b201) = (edge(2, 0), edge(0, 2));
        let [b300, b030, b003] = p.map(|p| 3.0 * p);
        // E + (E − V) / 2 with the means E of the six and V of the corners.
        let b111 = 0.25 * (b210 + b120 + b021 + b012 + b102 + b201) - 0.5 * (p[0] + p[1] + p[2]);
        let form = |a: [DVec3; 6]| {
            u * u * a[0] + v * v * a[1] + w * w * a[2] + 2.0 * (u * v * a[3] + v * w * a[4] + w * u * a[5])
        };
        [
            form([b300, b120, b102, b210, b111, b201]),
            form([b210, b030, b012, b120, b021, b111]),
            form([b201, b021, b003, b111, b012, b102]),
        ]
    }
}

impl SharpSides {
    /// The creases of the finest level. Adds the normals of their sides to those of the vertices.
    fn new(finest: &Refinement, points: &[DVec3], normals: &mut Vec<DVec3>) -> Self {
        let is_crease = |e: u32| {
            let side = &finest.edges()[e as usize];
            side.is_sharp && !side.is_boundary()
        };
        let sides: Vec<u8> = finest
            .face_edges()
            .iter()
            .map(|edges| (0..3).map(|c| u8::from(is_crease(edges[c])) << c).sum())
            .collect();
        let mut on_crease = vec![false; points.len()];
        for side in finest.edges().iter().filter(|side| side.is_sharp && !side.is_boundary()) {
            side.ends.into_iter().for_each(|v| on_crease[v as usize] = true);
        }
        // Corners that meet at a side which is no crease belong together.
        let faces = finest.faces();
        let mut first = vec![[u32::MAX; 2]; finest.edges().len()];
        let mut parts: Vec<u32> = (0..3 * faces.len() as u32).collect();
        fn root(parts: &mut [u32], mut i: u32) -> u32 {
            while parts[i as usize] != i {
                parts[i as usize] = parts[parts[i as usize] as usize];
                i = parts[i as usize];
            }
            i
        }
        for (f, (face, edges)) in (0..).zip(faces.iter().zip(finest.face_edges())) {
            for c in 0..3 {
                let ends = [3 * f + c as u32, 3 * f + (c as u32 + 1) % 3];
                let [v, w] = [face[c], face[(c + 1) % 3]];
                if is_crease(edges[c]) || !(on_crease[v as usize] || on_crease[w as usize]) {
                    continue;
                }
                let known = &mut first[edges[c] as usize];
                if known[0] == u32::MAX {
                    *known = ends;
                    continue;
                }
                // The other face runs along the side in the opposite direction.
                for (a, b) in [(ends[0], known[1]), (ends[1], known[0])] {
                    let (a, b) = (root(&mut parts, a), root(&mut parts, b));
                    parts[a.max(b) as usize] = a.min(b);
                }
            }
        }
        let mut sums: HashMap<u32, DVec3> = HashMap::new();
        let mut roots = Vec::new();
        for (f, face) in (0..).zip(faces) {
            if face.iter().all(|&v| !on_crease[v as usize]) {
                continue;
            }
            let [a, b, c] = face.map(|v| points[v as usize]);
            let cross = (b - a).cross(c - a);
            for (c, &v) in (0..3).zip(face).filter(|&(_, &v)| on_crease[v as usize]) {
                let part = root(&mut parts, 3 * f + c);
                *sums.entry(part).or_insert(DVec3::ZERO) += cross;
                roots.push((3 * f + c, part, v));
            }
        }
        let mut corners = faces.to_vec();
        let mut numbers: HashMap<u32, u32> = HashMap::new();
        for (corner, part, _) in roots {
            let number = *numbers.entry(part).or_insert_with(|| {
                normals.push(sums[&part].normalize_or_zero());
                normals.len() as u32 - 1
            });
            corners[corner as usize / 3][corner as usize % 3] = number;
        }
        let mut tangents = finest.crease_tangents(points);
        tangents.iter_mut().zip(&on_crease).filter(|(_, on)| !**on).for_each(|(t, _)| *t = DVec3::ZERO);
        Self { normals: corners, sides, tangents }
    }
}
