//! A bounding volume hierarchy over the triangles of a mesh: closest points and ray hits.
//!
//! Answers are exact in `f64`. Boxes are `f32`, rounded outward in a frame centred on the mesh and scaled by a
//! power of two, so that a search prunes conservatively wherever the mesh lies and whatever its unit is.
//! Leaves are packets of four triangles laid out by coordinate. The loops over boxes and packets are plain
//! Rust over arrays, compiled once for every instruction set and dispatched at run time; they use no
//! fused multiplication, so an answer does not depend on the processor.

mod closest_point;
mod point_triangle;
mod ray;
#[cfg(test)]
mod tests;

pub use closest_point::ClosestPoint;
pub use point_triangle::closest_point_on_triangle;
pub use ray::RayHit;

use pulp::Arch;

use crate::hierarchy::{Child, Hierarchy, MAX_LEVELS, WIDTH};
use crate::{Face, TriangleMesh};
use ndf_core::{BoundingBox, DVec3};

/// Triangles in a packet.
const LANES: usize = 4;

/// Bit of a child reference that says it is a packet.
const PACKET: u32 = 1 << 31;

/// Most entries a depth-first search has waiting: all but one child of every node on the way down.
const STACK: usize = (WIDTH - 1) * MAX_LEVELS + WIDTH;

/// Triangles of a mesh, arranged for closest-point and ray queries.
///
/// Owns what it needs: about 130 bytes per triangle. A query reads only, so any number of threads may ask.
#[derive(Clone, Debug)]
pub struct TriangleTree {
    nodes: Vec<Node>,
    packets: Vec<Packet>,
    /// `LANES · packet + lane` of every face of the mesh, [`NO_SLOT`] if it was left out.
    slots: Vec<u32>,
    frame: Frame,
    bounds: BoundingBox,
    arch: Arch,
}

/// In place of the slot of a face that is not in the tree.
const NO_SLOT: u32 = u32::MAX;

/// Eight boxes in the frame of the tree; that of an empty place is inverted and infinitely far from everything.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Node {
    min: [[f32; WIDTH]; 3],
    max: [[f32; WIDTH]; 3],
    /// Index of a node, or [`PACKET`] and the index of a packet.
    children: [u32; WIDTH],
}

/// Four triangles in the coordinates of the mesh; spare places repeat the last one.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Packet {
    /// By corner, axis and lane.
    corners: [[[f64; LANES]; 3]; 3],
    faces: [Face; LANES],
}

impl Packet {
    fn triangle(&self, lane: usize) -> [DVec3; 3] {
        self.corners.map(|corner| DVec3::from_array(corner.map(|axis| axis[lane])))
    }
}

/// Takes the mesh to a box of about unit size around the origin, where `f32` neither overflows nor wastes digits.
#[derive(Clone, Copy, Debug)]
struct Frame {
    center: DVec3,
    /// A power of two, so that scaling rounds nothing.
    scale: f64,
}

/// Points are clamped to this far from the origin of the frame. Clamping to a box around the tree moves no
/// point away from anything in it, so distances to boxes stay lower bounds.
const FAR: f64 = 1e15;

impl Frame {
    fn around(bounds: &BoundingBox) -> Self {
        let size = bounds.extent().max_element();
        let exponent = if size > 0.0 { size.log2().floor().clamp(-500.0, 500.0) } else { 0.0 };
        Self { center: bounds.center(), scale: (-exponent).exp2() }
    }

    fn to_local(self, p: DVec3) -> DVec3 {
        (p - self.center) * self.scale
    }

    /// The largest and smallest `f32` coordinates around a point, in this frame.
    fn around_point(self, p: DVec3) -> ([f32; 3], [f32; 3]) {
        let p = self.to_local(p).clamp(DVec3::splat(-FAR), DVec3::splat(FAR)).to_array();
        (p.map(|x| (x as f32).next_down()), p.map(|x| (x as f32).next_up()))
    }
}

impl TriangleTree {
    /// A tree over the faces of a mesh. Faces with a corner that is not finite are left out; without any other
    /// the tree is empty and answers `None`. O(n log n) on all threads; the result does not depend on how many.
    ///
    /// # Panics
    /// If the mesh has 2²⁸ faces or more.
    pub fn new(mesh: &TriangleMesh) -> Self {
        assert!(mesh.face_count() < 1 << 28, "a tree holds fewer than 2^28 triangles");
        let box_of = |&[a, b, c]: &[u32; 3]| {
            let corners = [a, b, c].map(|v| mesh.positions()[v as usize]);
            // `of_points` skips NaN, which must leave out the face.
            if corners.iter().all(|p| p.is_finite()) {
                BoundingBox::of_points(&corners)
            } else {
                BoundingBox::EMPTY
            }
        };
        let hierarchy = Hierarchy::of(mesh.face_count(), |face| box_of(&mesh.faces()[face]), LANES);
        let bounds = hierarchy.bounds();
        let frame = Frame::around(&bounds);
        let mut tree = Self {
            nodes: Vec::with_capacity(hierarchy.nodes().len()),
            packets: Vec::with_capacity(hierarchy.leaf_count()),
            slots: vec![NO_SLOT; mesh.face_count()],
            frame,
            bounds,
            arch: Arch::new(),
        };
        for source in hierarchy.nodes() {
            let mut node = Node {
                min: [[f32::INFINITY; WIDTH]; 3],
                max: [[f32::NEG_INFINITY; WIDTH]; 3],
                children: [0; WIDTH],
            };
            for (place, (child, outer)) in source.children.iter().zip(&source.boxes).enumerate() {
                node.children[place] = match *child {
                    Child::Empty => break,
                    Child::Node(below) => below,
                    Child::Leaf { start, end } => {
                        tree.pack(mesh, &hierarchy.order()[start as usize..end as usize])
                    }
                };
                let (min, _) = frame.around_point(outer.min);
                let (_, max) = frame.around_point(outer.max);
                for axis in 0..3 {
                    node.min[axis][place] = min[axis];
                    node.max[axis][place] = max[axis];
                }
            }
            tree.nodes.push(node);
        }
        tree
    }

    /// Adds a packet of these faces; returns the reference to it.
    fn pack(&mut self, mesh: &TriangleMesh, faces: &[u32]) -> u32 {
        let index = self.packets.len() as u32;
        let mut packet = Packet { corners: [[[0.0; LANES]; 3]; 3], faces: [Face(0); LANES] };
        for lane in 0..LANES {
            let face = Face(faces[lane.min(faces.len() - 1)]);
            packet.faces[lane] = face;
            for (corner, position) in mesh.corner_positions(face).into_iter().enumerate() {
                for axis in 0..3 {
                    packet.corners[corner][axis][lane] = position[axis];
                }
            }
        }
        for (lane, &face) in (0..).zip(faces) {
            self.slots[face as usize] = index * LANES as u32 + lane;
        }
        self.packets.push(packet);
        PACKET | index
    }

    /// The box around all triangles of the tree.
    pub fn bounds(&self) -> BoundingBox {
        self.bounds
    }

    /// Whether the tree has no triangle.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Corners of a face of the mesh; `None` if it does not exist or was left out.
    fn triangle(&self, face: Face) -> Option<[DVec3; 3]> {
        let slot = *self.slots.get(face.index())? as usize;
        Some(self.packets.get(slot / LANES)?.triangle(slot % LANES))
    }
}
