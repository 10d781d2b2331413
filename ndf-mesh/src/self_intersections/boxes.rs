//! Boxes of faces in the order of a curve that fills space, eight by eight.
//!
//! Faces in a row along the curve are near each other, so eight of them have a small box, and eight such boxes again. This tree
//! needs no pointers and is made by a sort and a pass over every level, in a fraction of the time of a
//! [hierarchy](crate::hierarchy) by surface areas, which is better to search: it pays where all is searched but once.

use ndf_core::{BoundingBox, DVec3};
use rayon::prelude::*;

use crate::{Face, TriangleMesh, Z_CURVE_DIGITS, z_curve_place};

/// Boxes in a group, and faces in a leaf.
pub(super) const WIDTH: usize = 8;

/// A box in the frame of the tree. Coordinates go there by a function that keeps their order, so what meets still meets.
#[derive(Clone, Copy)]
pub(super) struct Box32 {
    min: [f32; 3],
    max: [f32; 3],
}

/// Eight boxes, by axis; those of free places meet nothing.
struct Group {
    min: [[f32; WIDTH]; 3],
    max: [[f32; WIDTH]; 3],
}

impl Group {
    fn of(boxes: impl Iterator<Item = Box32>) -> Self {
        let mut group = Self { min: [[f32::INFINITY; WIDTH]; 3], max: [[f32::NEG_INFINITY; WIDTH]; 3] };
        for (place, one) in boxes.enumerate() {
            for axis in 0..3 {
                group.min[axis][place] = one.min[axis];
                group.max[axis][place] = one.max[axis];
            }
        }
        group
    }

    fn at(&self, place: usize) -> Box32 {
        Box32 { min: self.min.map(|axis| axis[place]), max: self.max.map(|axis| axis[place]) }
    }

    /// The box around all.
    fn around(&self) -> Box32 {
        Box32 {
            min: self.min.map(|axis| axis.into_iter().fold(f32::INFINITY, f32::min)),
            max: self.max.map(|axis| axis.into_iter().fold(f32::NEG_INFINITY, f32::max)),
        }
    }

    /// The places of the boxes that meet another, in ascending order.
    #[inline]
    fn meeting(&self, other: &Box32) -> Places {
        let mut apart = [0_u32; WIDTH];
        for axis in 0..3 {
            let (min, max) = (&self.min[axis], &self.max[axis]);
            for place in 0..WIDTH {
                apart[place] |=
                    u32::from(min[place] > other.max[axis]) | u32::from(max[place] < other.min[axis]);
            }
        }
        Places((0..WIDTH).fold(0, |bits, place| bits | ((apart[place] ^ 1) << place)))
    }
}

/// Some places of a group, a bit for each.
struct Places(u32);

impl Iterator for Places {
    type Item = usize;

    #[inline]
    fn next(&mut self) -> Option<usize> {
        let place = self.0.trailing_zeros() as usize;
        self.0 &= self.0.wrapping_sub(1);
        (place < WIDTH).then_some(place)
    }
}

/// The boxes of some faces of a mesh.
pub(super) struct Boxes {
    /// The faces along the curve: those of leaf `i` from `8 i` on.
    faces: Vec<Face>,
    /// On level 0 the group of every leaf; above, group `i` has the boxes of the groups from `8 i` on of the level below.
    levels: Vec<Vec<Group>>,
}

impl Boxes {
    /// The boxes of the faces that are usable, whose corners must be within `bounds`. O(n log n) on all threads.
    pub(super) fn new(
        mesh: &TriangleMesh,
        bounds: &BoundingBox,
        is_usable: impl Fn(Face) -> bool + Sync,
    ) -> Self {
        let scale = bounds.extent().max_element().recip().min(f64::MAX);
        let unit = |p: DVec3| (p - bounds.min) * scale;
        let digits = f64::from((1_u32 << Z_CURVE_DIGITS) - 1) / 3.0;
        let place = |f: u32| {
            let sum: DVec3 = mesh.corner_positions(Face(f)).map(unit).iter().sum();
            (z_curve_place(sum.to_array().map(|x| (digits * x) as u64)), Face(f))
        };
        let faces = (0..mesh.face_count() as u32).into_par_iter();
        let mut order: Vec<(u64, Face)> = faces.filter(|&f| is_usable(Face(f))).map(place).collect();
        order.par_sort_unstable();
        let faces: Vec<Face> = order.into_par_iter().map(|(_, face)| face).collect();
        let of_face = |&face: &Face| {
            let [a, b, c] = mesh.corner_positions(face).map(unit);
            let [min, max] = [a.min(b).min(c), a.max(b).max(c)].map(|p| p.to_array().map(|x| x as f32));
            Box32 { min, max }
        };
        let mut level: Vec<Group> =
            faces.par_chunks(WIDTH).map(|faces| Group::of(faces.iter().map(of_face))).collect();
        let mut levels = Vec::new();
        while level.len() > 1 {
            let above = level.par_chunks(WIDTH).map(|groups| Group::of(groups.iter().map(Group::around)));
            let above = above.collect();
            levels.push(std::mem::replace(&mut level, above));
        }
        levels.push(level);
        Self { faces, levels }
    }

    /// How many leaves there are.
    pub(super) fn leaf_count(&self) -> usize {
        self.levels[0].len()
    }

    /// The faces of a leaf.
    pub(super) fn leaf(&self, leaf: usize) -> &[Face] {
        &self.faces[WIDTH * leaf..self.faces.len().min(WIDTH * (leaf + 1))]
    }

    /// Calls `found` with the places in `leaf` and in another, or the same, of every two faces whose boxes meet; of each two but
    /// once, as they come in the order of all.
    pub(super) fn for_each_meeting(
        &self,
        leaf: usize,
        stack: &mut Vec<(usize, usize)>,
        mut found: impl FnMut(usize, usize, usize),
    ) {
        let own = &self.levels[0][leaf];
        let around = own.around();
        stack.clear();
        stack.push((self.levels.len() - 1, 0));
        while let Some((level, group)) = stack.pop() {
            if level > 0 {
                // Leaves before this one have looked for it.
                let is_before = |below: usize| (below + 1) << (3 * (level - 1)) <= leaf;
                let below = self.levels[level][group].meeting(&around).map(|place| WIDTH * group + place);
                stack.extend(below.filter(|&below| !is_before(below)).map(|below| (level - 1, below)));
                continue;
            }
            let other = &self.levels[0][group];
            for place in other.meeting(&around) {
                for mine in own.meeting(&other.at(place)).filter(|&mine| group > leaf || mine < place) {
                    found(mine, group, place);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;
    use std::collections::BTreeSet;

    fn meeting(mesh: &TriangleMesh, is_usable: impl Fn(Face) -> bool + Sync) -> Vec<[Face; 2]> {
        let boxes = Boxes::new(mesh, &mesh.bounds(), is_usable);
        let mut all = Vec::new();
        for leaf in 0..boxes.leaf_count() {
            boxes.for_each_meeting(leaf, &mut Vec::new(), |mine, other, place| {
                let (f, g) = (boxes.leaf(leaf)[mine], boxes.leaf(other)[place]);
                all.push([f.min(g), f.max(g)]);
            });
        }
        all
    }

    /// Boxes in single precision meet where those in double precision do, and hardly elsewhere.
    #[test]
    fn every_two_faces_whose_boxes_meet_are_found_once() {
        let far = shapes::rope_knot(40, 12, 0.24).map_positions(|p| 1e-3 * p + DVec3::splat(1e3));
        for mesh in [shapes::icosphere(0), shapes::torus(30, 20, 1.0, 0.4), shapes::cube(6), far] {
            let is_usable = |face: Face| face.0 % 5 != 2;
            let found = meeting(&mesh, is_usable);
            let once: BTreeSet<[Face; 2]> = found.iter().copied().collect();
            assert_eq!(once.len(), found.len());
            let box_of = |f: Face| BoundingBox::of_points(&mesh.corner_positions(f));
            let mut missed = 0;
            for f in mesh.face_indices().filter(|&f| is_usable(f)) {
                for g in mesh.face_indices().filter(|&g| g > f && is_usable(g)) {
                    let (a, b) = (box_of(f), box_of(g));
                    let meets = a.min.cmple(b.max).all() && b.min.cmple(a.max).all();
                    missed += usize::from(once.contains(&[f, g]) && !meets);
                    assert!(once.contains(&[f, g]) || !meets, "{f} {g}");
                }
            }
            assert!(100 * missed <= found.len(), "{missed} of {}", found.len());
        }
    }

    #[test]
    fn no_faces_make_no_leaf() {
        let boxes = Boxes::new(&shapes::cube(1), &BoundingBox::EMPTY, |_| false);
        assert_eq!(boxes.leaf_count(), 0);
    }
}
