//! Polygons of a file to triangles of a mesh.
//!
//! A polygon becomes a fan at its first corner where the fan has the polygon's outline: every triangle turns as the polygon
//! does. Where it does not, because the polygon is not convex there, it is cut in its plane by a constrained
//! Delaunay triangulation (crate `spade`), in which every corner keeps its place on the outline. Ear clipping leaves
//! out corners between two edges in a line, and with them the neighbours' edges. The plane is Newell's: normal to the
//! sum of the cross products of successive corners.

use std::collections::HashMap;

use ndf_core::DVec3;
use spade::handles::{DirectedEdgeHandle, FixedVertexHandle};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::{Content, FileDefect, Parsed, ReadNote, VertexScalars};
use crate::TriangleMesh;

/// How far corners may be from the plane of a flat polygon, in diameters of the polygon.
const FLAT: f64 = 0.01;
/// The least area of a triangle of a fan, in squared diameters of the polygon.
const MIN_AREA: f64 = 1e-12;

/// Most corners of a polygon: cutting one takes some 500 bytes a corner.
const MAX_CORNERS: usize = 1 << 20;

/// Collects polygons and remembers what there is to say about them.
#[derive(Default)]
pub(super) struct Triangles {
    /// Triangles; a polygon is a fan.
    faces: Vec<[u32; 3]>,
    /// The polygons among them: the first triangle of the fan, and how many there are.
    polygons: Vec<(usize, usize)>,
    too_small: usize,
}

impl Triangles {
    /// Whether nothing with three corners was added.
    pub(super) fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    /// Adds a polygon. Fewer than three corners enclose nothing and are only counted.
    pub(super) fn add(&mut self, corners: &[u32]) {
        match corners {
            [] | [_] | [_, _] => self.too_small += 1,
            [first, rest @ ..] => {
                if corners.len() > 3 {
                    self.polygons.push((self.faces.len(), corners.len() - 2));
                }
                self.faces.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
            }
        }
    }

    /// Adds a strip of triangles: every corner after the second makes a triangle with the two before it.
    pub(super) fn add_strip(&mut self, corners: &[u32]) {
        for (i, three) in corners.windows(3).enumerate() {
            let [a, b, c] = [three[0], three[1], three[2]];
            self.faces.push(if i % 2 == 0 { [a, b, c] } else { [b, a, c] });
        }
    }

    /// The mesh of these triangles over `positions`.
    pub(super) fn into_content(self, positions: Vec<DVec3>, scalars: Vec<VertexScalars>) -> Parsed {
        if let Some(&(_, count)) = self.polygons.iter().find(|(_, count)| count + 2 > MAX_CORNERS) {
            let corners = count + 2;
            let text = format!("a face has {corners} corners; at most {MAX_CORNERS} are read");
            return Err(FileDefect::unsupported(text));
        }
        let mut mesh = TriangleMesh::new(positions, self.faces)?;
        let (mut not_convex, mut crossed, mut not_flat) = (0, 0, 0);
        if !self.polygons.is_empty() {
            let (positions, fans) = mesh.into_parts();
            let mut faces = Vec::with_capacity(fans.len());
            let mut copied = 0;
            for &(from, count) in &self.polygons {
                let fan = &fans[from..from + count];
                let Some(outline) = Outline::of_fan(fan, &positions) else { continue };
                not_flat += usize::from(!outline.is_flat());
                if outline.is_star_of_first() {
                    continue;
                }
                let Some(cut) = outline.delaunay() else {
                    crossed += 1;
                    continue;
                };
                not_convex += 1;
                faces.extend_from_slice(&fans[copied..from]);
                faces.extend(cut);
                copied = from + count;
            }
            faces.extend_from_slice(&fans[copied..]);
            mesh = TriangleMesh::from_parts(positions, faces);
        }
        let all = [
            (self.polygons.len(), ReadNote::PolygonsCut { faces: self.polygons.len() }),
            (not_convex, ReadNote::PolygonsNotConvex { faces: not_convex }),
            (crossed, ReadNote::PolygonsCrossed { faces: crossed }),
            (not_flat, ReadNote::PolygonsNotFlat { faces: not_flat }),
            (self.too_small, ReadNote::FacesTooSmall { faces: self.too_small }),
        ];
        let notes = all.into_iter().filter(|(count, _)| *count > 0).map(|(_, note)| note).collect();
        Ok(Content { mesh, scalars, notes })
    }
}

/// A polygon in coordinates of its own: its first corner is the origin, its diameter about 1.
struct Outline {
    corners: Vec<u32>,
    points: Vec<DVec3>,
    /// Of length 1.
    normal: DVec3,
}

impl Outline {
    /// The polygon that was cut into a fan; `None` if it has no plane.
    fn of_fan(fan: &[[u32; 3]], positions: &[DVec3]) -> Option<Self> {
        let corners: Vec<u32> = fan[0][..2].iter().copied().chain(fan.iter().map(|face| face[2])).collect();
        let origin = positions[corners[0] as usize];
        let points: Vec<DVec3> = corners.iter().map(|&v| positions[v as usize] - origin).collect();
        let diameter = points.iter().map(|p| p.length()).fold(0.0, f64::max);
        let points: Vec<DVec3> = points.iter().map(|&p| p / diameter).collect();
        let next = points.iter().cycle().skip(1);
        let normal = points.iter().zip(next).map(|(a, b)| a.cross(*b)).sum::<DVec3>().try_normalize()?;
        Some(Self { corners, points, normal })
    }

    fn is_flat(&self) -> bool {
        let heights = || self.points.iter().map(|p| p.dot(self.normal));
        heights().fold(f64::MIN, f64::max) - heights().fold(f64::MAX, f64::min) <= 2.0 * FLAT
    }

    /// Whether all of it is seen from the first corner: the triangles of the fan turn as it does, and none is without area.
    fn is_star_of_first(&self) -> bool {
        self.points[1..].windows(2).all(|pair| 0.5 * pair[0].cross(pair[1]).dot(self.normal) > MIN_AREA)
    }

    /// Its triangles by Delaunay's rule; `None` if it crosses itself. What the outline goes around is inside, once
    /// or more often; ways there and back cancel, as the bridges to holes have them. O(n log n).
    fn delaunay(&self) -> Option<Vec<[u32; 3]>> {
        let u = self.normal.any_orthonormal_vector();
        let v = self.normal.cross(u);
        // Corners in the same place are one.
        let mut at: HashMap<[u64; 2], usize> = HashMap::with_capacity(self.points.len());
        let (mut corner_of, mut points) = (Vec::new(), Vec::new());
        let mut handles = Vec::with_capacity(self.points.len());
        for (p, &corner) in self.points.iter().zip(&self.corners) {
            // −0 is 0.
            let [x, y] = [p.dot(u) + 0.0, p.dot(v) + 0.0];
            handles.push(*at.entry([x.to_bits(), y.to_bits()]).or_insert_with(|| {
                corner_of.push(corner);
                points.push(Point2::new(x, y));
                points.len() - 1
            }));
        }
        let sides: Vec<[usize; 2]> = (0..handles.len())
            .map(|i| [handles[i], handles[(i + 1) % handles.len()]])
            .filter(|[a, b]| a != b)
            .collect();
        let mut crosses = false;
        let cdt =
            ConstrainedDelaunayTriangulation::<Point2<f64>>::try_bulk_load_cdt(points, sides.clone(), |_| {
                crosses = true;
            })
            .ok()?;
        if crosses || cdt.num_vertices() != corner_of.len() {
            return None;
        }
        // How often the outline passes along each edge.
        let mut passes: HashMap<[usize; 2], i32> = HashMap::new();
        for [from, to] in sides.into_iter().map(|side| side.map(FixedVertexHandle::from_index)) {
            let end = cdt.vertex(to).position();
            let mut at = cdt.vertex(from);
            while at.fix() != to {
                let start = at.position();
                let leads_on = |edge: &DirectedEdgeHandle<'_, _, _, _, _>| {
                    let [p, q] = [edge.to().position(), end].map(|p| [p.x - start.x, p.y - start.y]);
                    edge.is_constraint_edge()
                        && p[0] * q[0] + p[1] * q[1] > 0.0
                        && edge.side_query(end).is_on_line()
                };
                let edge = at.out_edges().find(leads_on)?;
                let [a, b] = [at.index(), edge.to().index()];
                *passes.entry([a, b]).or_default() += 1;
                *passes.entry([b, a]).or_default() -= 1;
                at = edge.to();
            }
        }
        // Winding numbers, from the outside, where it is 0, over every edge.
        let mut windings = vec![None; cdt.num_all_faces()];
        windings[cdt.outer_face().index()] = Some(0);
        let mut open: Vec<_> = cdt.convex_hull().collect();
        while let Some(edge) = open.pop() {
            let other = edge.rev();
            if windings[other.face().index()].is_none() {
                let passed = passes.get(&[other.from().index(), other.to().index()]).copied().unwrap_or(0);
                windings[other.face().index()] = Some(windings[edge.face().index()]? + passed);
                open.extend(other.face().as_inner()?.adjacent_edges());
            }
        }
        let inside = cdt.inner_faces().filter(|face| windings[face.index()].is_some_and(|w| w > 0));
        let cut: Vec<[u32; 3]> = inside.map(|face| face.vertices().map(|v| corner_of[v.index()])).collect();
        (!cut.is_empty()).then_some(cut)
    }
}
