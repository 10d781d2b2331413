//! Displacements: rays from the coarse mesh to the input, first to measure how thick a layer they need at each vertex, then
//! within the layer as it is stored.

use half::f16;
use ndf_core::{DVec3, Hint};
use ndf_mesh::{ManifoldMesh, TriangleTree, Vertex};
use rayon::prelude::*;

use super::directions::max_min_visibility;
use super::layout::{Layout, Site, places};
use super::{FULL, Micromesh};

/// Rounds of the search for a direction.
const ROUNDS: u32 = 1000;
/// Faces seen from behind that a ray passes before it gives up.
const PASSED: usize = 4;
/// The layer is thicker than displacements need by this share of the longest edge, on both sides.
const MARGIN: f64 = 1e-5;
/// Longer ways than this share of the longest edge of the coarse mesh lead to another part of the surface.
const REACH: f64 = 0.5;

/// A micromesh of a coarse mesh with these levels that follows `input`.
pub(crate) fn bake(base: &ManifoldMesh, levels: &[u8], input: &ManifoldMesh) -> Micromesh {
    let layout = Layout::new(base.vertex_count(), base.faces(), levels);
    let topology = base.topology();
    let longest = topology.edges().map(|e| {
        let [a, b] = topology.edge_vertices(e).map(|v| base.positions()[v.index()]);
        a.distance(b)
    });
    let longest = longest.fold(0.0, f64::max);
    let target = Target { input, tree: TriangleTree::new(input), reach: REACH * longest };
    let direction = |v: Vertex| {
        let normals: Vec<DVec3> = topology.outgoing(v).map(|h| base.face_normal(h.face())).collect();
        max_min_visibility(&normals, ROUNDS).0
    };
    let directions: Vec<DVec3> = topology.par_vertices().map(direction).collect();
    let mix = |of: &[DVec3], site: &Site| -> DVec3 {
        base.faces()[site.face].iter().zip(site.barycentric).map(|(&v, b)| b * of[v as usize]).sum()
    };
    let found: Vec<f64> = layout
        .sites
        .par_iter()
        .map(|site| target.displacement(mix(base.positions(), site), mix(&directions, site)))
        .collect();

    // The layer at a vertex holds all that is found in the faces around it.
    let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; base.vertex_count()];
    for (grid, corners) in layout.grids.iter().zip(base.faces()) {
        for t in grid.iter().map(|&site| found[site as usize]) {
            for &v in corners {
                let [low, high] = &mut ranges[v as usize];
                (*low, *high) = (low.min(t), high.max(t));
            }
        }
    }
    let margin = MARGIN * longest;
    let positions: Vec<DVec3> = base
        .positions()
        .iter()
        .zip(&directions)
        .zip(&ranges)
        .map(|((&p, &d), [low, _])| p + (low - margin) * d)
        .collect();
    let ways: Vec<DVec3> =
        directions.iter().zip(&ranges).map(|(&d, [low, high])| (high - low + 2.0 * margin) * d).collect();
    let scale = ways.iter().map(|w| w.abs().max_element()).fold(0.0, f64::max) as f32;
    let mut baked = Micromesh {
        positions: positions.iter().map(|p| p.to_array().map(|x| x as f32)).collect(),
        directions: ways.iter().map(|w| (*w / f64::from(scale)).to_array().map(f16::from_f64)).collect(),
        scale,
        faces: base.faces().to_vec(),
        levels: levels.to_vec(),
        displacements: Vec::new(),
    };
    let values: Vec<u16> = layout
        .sites
        .par_iter()
        .zip(&found)
        .map(|(site, &found)| {
            let near = mix(base.positions(), site) + found * mix(&directions, site);
            let [bottom, way] = baked.layer(site.face, site.barycentric);
            // Where on the way the place found before is, nearly.
            let start = (near - bottom).dot(way) / way.length_squared();
            let share = start + target.displacement(bottom + start * way, way);
            (share * f64::from(FULL)).round().clamp(0.0, f64::from(FULL)) as u16
        })
        .collect();
    baked.displacements = layout
        .grids
        .iter()
        .zip(levels)
        .map(|(grid, &level)| {
            debug_assert_eq!(grid.len(), places(level));
            grid.iter().map(|&site| values[site as usize]).collect()
        })
        .collect();
    baked
}

/// The input, seen along rays.
struct Target<'a> {
    input: &'a ManifoldMesh,
    tree: TriangleTree,
    /// The longest way to it.
    reach: f64,
}

impl Target<'_> {
    /// How far along `direction`, in its lengths, the input is from `origin`, forward or backward: the nearest face seen
    /// from outside, or else as far as the closest point is.
    fn displacement(&self, origin: DVec3, direction: DVec3) -> f64 {
        let length = direction.length();
        let hit = [1.0, -1.0].into_iter().filter_map(|sign| {
            let t = self.hit(origin, sign * direction, direction)?;
            (t * length <= self.reach).then_some(sign * t)
        });
        let nearest = hit.min_by(|a, b| a.abs().total_cmp(&b.abs()));
        nearest.unwrap_or_else(|| {
            let closest = self.tree.closest_point(origin, Hint::NONE).map_or(origin, |c| c.point);
            (closest - origin).dot(direction) / (length * length)
        })
    }

    /// The first hit of a face that looks along `outward`.
    fn hit(&self, origin: DVec3, direction: DVec3, outward: DVec3) -> Option<f64> {
        let mut start = 0.0;
        for _ in 0..PASSED {
            let hit = self.tree.first_hit(origin + start * direction, direction)?;
            if self.input.face_cross(hit.at.face).dot(outward) > 0.0 {
                return Some(start + hit.t);
            }
            start += hit.t + 1e-9 * self.reach / direction.length();
        }
        None
    }
}
