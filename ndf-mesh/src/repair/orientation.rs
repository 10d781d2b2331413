//! Turns faces so that neighbours agree and solids are outside in.

use ndf_core::{BoundingBox, DVec3};

use super::Components;
use crate::triangle_tree::TriangleTree;
use crate::{Face, ManifoldMesh, Sides, TriangleMesh};

/// Turns faces so that neighbours across edges with two faces agree, and closed components so that their faces point out of
/// what they enclose.
///
/// A closed component whose faces disagreed is turned outward. One whose faces agreed is turned only where it has to be:
/// it may point inward as the wall of a cavity, inside of others. If the components whose faces agreed enclose a negative
/// volume together, all of them are inside out, and turned first. Of an open component the majority of its faces keep
/// their side. Components that cannot be oriented (Möbius strips) stay inconsistent somewhere; the report of the result
/// says so. O(n log n), and O(log n) for every component that points inward (O(n) where it touches others).
pub fn oriented(mesh: &TriangleMesh) -> TriangleMesh {
    turned(mesh, &faces_to_turn(mesh))
}

/// The mesh with some faces turned.
pub(super) fn turned(mesh: &TriangleMesh, turned: &[bool]) -> TriangleMesh {
    let face = |(&[a, b, c], &turned): (&[u32; 3], &bool)| if turned { [a, c, b] } else { [a, b, c] };
    let faces = mesh.faces().iter().zip(turned).map(face).collect();
    TriangleMesh::from_parts(mesh.positions().to_vec(), faces)
}

/// Share of the volumes of its faces seen from a corner that what a component encloses must exceed for its sign to be sure.
const SURE: f64 = 1e-6;

/// Whether all components of a closed manifold surely enclose a positive volume, so that [`oriented`] turns nothing.
pub(super) fn is_outward(mesh: &ManifoldMesh, components: &Components) -> bool {
    let mut corners: Vec<Option<DVec3>> = vec![None; components.len()];
    let mut volumes = vec![[0.0, 0.0]; components.len()];
    for (face, &component) in mesh.face_indices().zip(&components.of_face) {
        let [a, b, c] = mesh.corner_positions(face);
        let origin = *corners[component as usize].get_or_insert(a);
        let volume = (a - origin).dot((b - origin).cross(c - origin));
        let [sum, sum_of_sizes] = &mut volumes[component as usize];
        *sum += volume;
        *sum_of_sizes += volume.abs();
    }
    volumes.iter().all(|[sum, sum_of_sizes]| *sum > SURE * sum_of_sizes)
}

/// A component without boundary.
struct Solid {
    faces: Vec<u32>,
    /// Whether its faces agree in the mesh as it is.
    agrees: bool,
    /// Six times its volume, negative where it points inward.
    volume: f64,
    bounds: BoundingBox,
}

/// Which faces [`oriented`] turns.
pub(super) fn faces_to_turn(mesh: &TriangleMesh) -> Vec<bool> {
    let (adjacent, is_open) = neighbours(mesh);
    let mut turned: Vec<Option<bool>> = vec![None; mesh.face_count()];
    let mut solids = Vec::new();
    for start in 0..mesh.face_count() {
        if turned[start].is_some() {
            continue;
        }
        turned[start] = Some(false);
        let mut component = vec![start as u32];
        let mut next = 0;
        while let Some(&f) = component.get(next) {
            next += 1;
            let begin = adjacent.partition_point(|side| side.0 < f);
            for &(_, other, disagree) in adjacent[begin..].iter().take_while(|side| side.0 == f) {
                if turned[other as usize].is_none() {
                    turned[other as usize] = turned[f as usize].map(|t| t != disagree);
                    component.push(other);
                }
            }
        }
        let is_turned = |f: &&u32| turned[**f as usize] == Some(true);
        let count = component.iter().filter(is_turned).count();
        if !component.iter().any(|&f| is_open[f as usize]) {
            let agrees = count == 0;
            solids.push(Solid::new(mesh, component, agrees, |f| turned[f as usize] == Some(true)));
        } else if 2 * count > component.len() {
            turn(&mut turned, &component);
        }
    }
    for solid in turn_solids(mesh, solids, &turned) {
        turn(&mut turned, &solid);
    }
    turned.into_iter().map(|turned| turned == Some(true)).collect()
}

fn turn(turned: &mut [Option<bool>], faces: &[u32]) {
    faces.iter().for_each(|&f| turned[f as usize] = turned[f as usize].map(|turned| !turned));
}

/// Neighbours across edges with two faces, (face, other face, whether they disagree), by face; and which faces have an edge
/// with another number of faces.
fn neighbours(mesh: &TriangleMesh) -> (Vec<(u32, u32, bool)>, Vec<bool>) {
    let sides = Sides::of(mesh.vertex_count(), mesh.face_indices().zip(mesh.faces().iter().copied()));
    let tails = mesh.faces().as_flattened();
    let mut adjacent = Vec::with_capacity(3 * mesh.face_count());
    let mut is_open = vec![false; mesh.face_count()];
    for (_, edge) in sides.edges() {
        match *edge {
            [(_, h), (_, g)] => {
                let disagree = tails[h.index()] == tails[g.index()];
                adjacent.push((h.face().0, g.face().0, disagree));
                adjacent.push((g.face().0, h.face().0, disagree));
            }
            _ => edge.iter().for_each(|(_, h)| is_open[h.face().index()] = true),
        }
    }
    adjacent.sort_unstable();
    (adjacent, is_open)
}

impl Solid {
    fn new(mesh: &TriangleMesh, faces: Vec<u32>, agrees: bool, is_turned: impl Fn(u32) -> bool) -> Self {
        let center = mesh.positions()[mesh.faces()[faces[0] as usize][0] as usize];
        let six_volumes = |&f: &u32| {
            let [a, b, c] = mesh.corner_positions(Face(f)).map(|p| p - center);
            a.dot(b.cross(c)) * if is_turned(f) { -1.0 } else { 1.0 }
        };
        let volume = faces.iter().map(six_volumes).sum();
        let corners: Vec<DVec3> = faces.iter().flat_map(|&f| mesh.corner_positions(Face(f))).collect();
        Self { faces, agrees, volume, bounds: BoundingBox::of_points(&corners) }
    }

    /// Its winding number around a point: 1 inside of a solid that points outward (Van Oosterom and Strackee 1983).
    fn winding(&self, mesh: &TriangleMesh, turned: &[Option<bool>], p: DVec3) -> f64 {
        let angle = |&f: &u32| {
            let [a, b, c] = mesh.corner_positions(Face(f)).map(|corner| corner - p);
            let [la, lb, lc] = [a, b, c].map(DVec3::length);
            let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            let half = a.dot(b.cross(c)).atan2(below);
            if turned[f as usize] == Some(true) { -half } else { half }
        };
        self.faces.iter().map(angle).sum::<f64>() / std::f64::consts::TAU
    }
}

/// Directions of rays, along which no grid of points is aligned.
const RAYS: [DVec3; 3] =
    [DVec3::new(0.331, 0.577, 0.746), DVec3::new(-0.813, 0.197, 0.548), DVec3::new(0.271, -0.921, 0.279)];
/// How close to an edge, to the plane of a face or to its beginning a ray meets nothing surely.
const DOUBTFUL: f64 = 1e-9;

/// Winding numbers of solids around points, by what a ray crosses.
struct Crossings<'a> {
    mesh: &'a TriangleMesh,
    turned: &'a [Option<bool>],
    tree: TriangleTree,
    /// The solid of each face.
    solid_of: Vec<u32>,
}

impl<'a> Crossings<'a> {
    fn new(mesh: &'a TriangleMesh, solids: &[Solid], turned: &'a [Option<bool>]) -> Self {
        let mut solid_of = vec![u32::MAX; mesh.face_count()];
        for (s, solid) in (0..).zip(solids) {
            solid.faces.iter().for_each(|&f| solid_of[f as usize] = s);
        }
        Self { mesh, turned, tree: TriangleTree::new(mesh), solid_of }
    }

    /// The solids that a ray from `p` leaves (1) or enters (−1); `None` if every ray meets an edge, or `p` lies on another
    /// solid than its own.
    fn of(&self, p: DVec3, own: usize) -> Option<Vec<(usize, f64)>> {
        let scale = self.tree.bounds().extent().length();
        RAYS.iter().find_map(|&ray| {
            let hits = self.tree.hits(p, ray);
            let others = hits.iter().filter(|hit| {
                let solid = self.solid_of[hit.at.face.index()];
                solid != own as u32 && solid != u32::MAX
            });
            others
                .map(|hit| {
                    let f = hit.at.face.index();
                    let across = self.mesh.face_normal(hit.at.face).dot(ray);
                    let least = hit.at.barycentric.into_iter().fold(across.abs(), f64::min);
                    let sign = if self.turned[f] == Some(true) { -across } else { across };
                    let is_sure = least > DOUBTFUL && hit.t > DOUBTFUL * scale;
                    is_sure.then(|| (self.solid_of[f] as usize, sign.signum()))
                })
                .collect()
        })
    }
}

/// The faces of the solids that have to be turned.
fn turn_solids(mesh: &TriangleMesh, solids: Vec<Solid>, turned: &[Option<bool>]) -> Vec<Vec<u32>> {
    let together: f64 = solids.iter().filter(|solid| solid.agrees).map(|solid| solid.volume).sum();
    let mut turn: Vec<bool> =
        solids.iter().map(|s| if s.agrees { together < 0.0 } else { s.volume < 0.0 }).collect();
    let mut inward: Vec<usize> = (0..solids.len()).filter(|&s| (solids[s].volume < 0.0) != turn[s]).collect();
    // Walls of cavities lie in larger solids, of which it is known by then which way they point.
    inward.sort_by(|&s, &t| solids[t].volume.abs().total_cmp(&solids[s].volume.abs()));
    if inward.is_empty() {
        return turned_ones(solids, turn);
    }
    let crossings = Crossings::new(mesh, &solids, turned);
    for s in inward {
        let p = mesh.positions()[mesh.faces()[solids[s].faces[0] as usize][0] as usize];
        let size = |t: usize| solids[t].volume.abs();
        let sign = |t: usize| if turn[t] { -1.0 } else { 1.0 };
        let inside: f64 = match crossings.of(p, s) {
            Some(crossed) => {
                crossed.into_iter().filter(|&(t, _)| size(t) > size(s)).map(|(t, side)| side * sign(t)).sum()
            }
            None => {
                let around = (0..solids.len()).filter(|&t| t != s && size(t) > size(s));
                let contains = |t: &usize| {
                    let BoundingBox { min, max } = solids[*t].bounds;
                    p.cmpge(min).all() && p.cmple(max).all()
                };
                around.filter(contains).map(|t| solids[t].winding(mesh, turned, p) * sign(t)).sum()
            }
        };
        if inside < 0.5 {
            turn[s] = !turn[s];
        }
    }
    turned_ones(solids, turn)
}

fn turned_ones(solids: Vec<Solid>, turn: Vec<bool>) -> Vec<Vec<u32>> {
    let all = solids.into_iter().zip(turn).filter(|(_, turn)| *turn);
    all.map(|(solid, _)| solid.faces).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ManifoldMesh, shapes};

    /// A sphere: centre on the x-axis, radius, whether outward.
    type Ball = (f64, f64, bool);

    fn spheres(all: &[Ball]) -> TriangleMesh {
        let (mut positions, mut faces) = (Vec::new(), Vec::new());
        for &(x, radius, outward) in all {
            let (p, f) = shapes::icosphere(1).into_parts();
            let first = positions.len() as u32;
            positions.extend(p.into_iter().map(|p| radius * p + x * DVec3::X));
            let face = |[a, b, c]: [u32; 3]| if outward { [a, b, c] } else { [a, c, b] };
            faces.extend(f.into_iter().map(|f| face(f).map(|v| v + first)));
        }
        TriangleMesh::new(positions, faces).unwrap()
    }

    #[test]
    fn orientation_is_restored_and_turned_outward() {
        let mesh = shapes::icosphere(2);
        let (positions, mut faces) = mesh.clone().into_parts();
        for f in faces.iter_mut().step_by(3) {
            f.swap(0, 1);
        }
        let mixed = TriangleMesh::new(positions.clone(), faces).unwrap();
        let repaired = oriented(&mixed);
        assert!((repaired.signed_volume() - mesh.signed_volume()).abs() < 1e-12);
        assert!(ManifoldMesh::try_from(repaired).is_ok());

        let inward = mesh.faces().iter().map(|&[a, b, c]| [a, c, b]).collect();
        let inward = TriangleMesh::new(positions, inward).unwrap();
        assert!(oriented(&inward).signed_volume() > 0.0);
    }

    #[test]
    fn cavities_stay_cavities() {
        let unit = shapes::icosphere(1).signed_volume();
        // Solids, and the volume of what they are in units of a ball's.
        let solids: [(&[Ball], f64); 7] = [
            // A hollow ball; one with a ball in its cavity; both inside out.
            (&[(0.0, 1.0, true), (0.0, 0.8, false)], 1.0 - 0.512),
            (&[(0.0, 0.2, true), (0.0, 0.8, false), (0.0, 1.0, true)], 1.0 - 0.512 + 0.008),
            (&[(0.0, 1.0, false), (0.0, 0.8, true)], 1.0 - 0.512),
            (&[(0.0, 0.2, false), (0.0, 0.8, true), (0.0, 1.0, false)], 1.0 - 0.512 + 0.008),
            // Balls apart, all right, one of them inside out, and the larger one.
            (&[(0.0, 1.0, true), (3.0, 0.5, true)], 1.125),
            (&[(0.0, 1.0, true), (3.0, 0.5, false)], 1.125),
            (&[(0.0, 1.0, false), (3.0, 0.5, true)], 1.125),
        ];
        for (all, volume) in solids {
            let found = oriented(&spheres(all)).signed_volume() / unit;
            assert!((found - volume).abs() < 1e-9, "{all:?}: {found}");
        }
        // Bubbles in rows, of which the last touches the wall; within some of them is a ball.
        let mut all: Vec<Ball> = vec![(0.0, 10.0, true)];
        for i in -8..9 {
            all.push((f64::from(i), 0.4, false));
            if i % 3 == 0 {
                all.push((f64::from(i), 0.1, true));
            }
        }
        all.push((9.5, 0.5, false));
        let volume: f64 =
            all.iter().map(|&(_, r, outward)| if outward { r.powi(3) } else { -r.powi(3) }).sum();
        for turned in [false, true] {
            let all: Vec<Ball> = all.iter().map(|&(x, r, outward)| (x, r, outward != turned)).collect();
            let found = oriented(&spheres(&all)).signed_volume() / unit;
            assert!((found - volume).abs() < 1e-9 * volume, "{found} instead of {volume}");
        }
        // A wall whose faces disagree may be either: it is turned outward.
        let (positions, mut faces) = spheres(&[(0.0, 1.0, true), (0.0, 0.8, false)]).into_parts();
        faces[100].swap(0, 1);
        let volume = oriented(&TriangleMesh::new(positions, faces).unwrap()).signed_volume() / unit;
        assert!((volume - 1.512).abs() < 1e-9);
    }
}
