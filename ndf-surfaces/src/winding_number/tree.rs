//! Sums over a hierarchy of sources: near ones exactly, far ones by their expansions (Barnes and Hut 1986).

use std::ops::Range;

use ndf_core::{BoundingBox, DVec3};
use ndf_mesh::hierarchy::{Child, Hierarchy, MAX_LEVELS, WIDTH};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::expansion::{Moments, Node, ValuesAndGradients};

/// Sources summed exactly at a time.
pub(super) const LANES: usize = WIDTH;

/// Bit of a child reference that says it is a packet.
const PACKET: u32 = 1 << 31;

const STACK: usize = (WIDTH - 1) * MAX_LEVELS + WIDTH;

/// Up to eight sources that are summed exactly.
pub(super) trait Packet: Send + Sync {
    /// Their potentials at `p`.
    fn values(&self, p: DVec3) -> [f64; LANES];
}

/// Sources that also know the gradients of their potentials.
pub(super) trait GradientPacket: Packet {
    /// Their potentials at `p`, and the gradients.
    fn values_and_gradients(&self, p: DVec3) -> ValuesAndGradients;
}

/// Sources in packets below nodes of expansions.
#[derive(Clone, Debug)]
pub(super) struct Tree<P> {
    nodes: Vec<Node>,
    packets: Vec<P>,
    /// Sources of the packets, as ranges of the order.
    packed: Vec<Range<usize>>,
    /// Sources below every place of every node, as ranges of the order.
    below: Vec<[Range<usize>; WIDTH]>,
    order: Vec<u32>,
    arch: Arch,
}

impl<P: Packet> Tree<P> {
    /// Groups sources by their boxes; those with an empty box, or one that is not finite, are left out. `pack` makes
    /// a packet of sources, `place` tells the centre of several and the distance from which they may be expanded.
    pub(super) fn new(
        boxes: &[BoundingBox],
        pack: impl Fn(&[u32]) -> P,
        place: impl Fn(&[u32]) -> (DVec3, f64) + Sync,
    ) -> Self {
        let hierarchy = Hierarchy::new(boxes, LANES);
        let below = ranges(&hierarchy);
        let order = hierarchy.order().to_vec();
        let mut packed = Vec::new();
        let mut nodes = Vec::with_capacity(below.len());
        for node in hierarchy.nodes() {
            let children = node.children.map(|child| match child {
                Child::Empty => 0,
                Child::Node(index) => index,
                Child::Leaf { start, end } => {
                    packed.push(start as usize..end as usize);
                    PACKET | (packed.len() - 1) as u32
                }
            });
            let count = node.children.iter().filter(|&&child| child != Child::Empty).count();
            nodes.push(Node::without_moments(children, count as u32));
        }
        let packets = packed.iter().map(|range| pack(&order[range.clone()])).collect();
        nodes.par_iter_mut().zip(&below).for_each(|(node, ranges)| {
            for (i, range) in ranges.iter().enumerate().filter(|(_, range)| !range.is_empty()) {
                let (center, reach) = place(&order[range.clone()]);
                node.set_reach(i, center, reach);
            }
        });
        Self { nodes, packets, packed, below, order, arch: Arch::new() }
    }

    /// Computes all expansions; `moments` sums the sources given about the centre given.
    pub(super) fn expand(&mut self, moments: impl Fn(&[u32], DVec3) -> Moments + Sync) {
        let order = &self.order;
        self.nodes.par_iter_mut().zip(&self.below).for_each(|(node, ranges)| {
            for (i, range) in ranges.iter().enumerate().filter(|(_, range)| !range.is_empty()) {
                node.set_moments(i, &moments(&order[range.clone()], node.center(i)));
            }
        });
    }

    /// Gives every packet its sources to be changed by.
    pub(super) fn repack(&mut self, change: impl Fn(&mut P, &[u32]) + Sync) {
        let order = &self.order;
        let packets = self.packets.par_iter_mut().zip(&self.packed);
        packets.for_each(|(packet, range)| change(packet, &order[range.clone()]));
    }

    /// Indices of the sources, neighbours together.
    pub(super) fn order(&self) -> &[u32] {
        &self.order
    }

    /// The sum of all potentials at `p`, which is finite.
    pub(super) fn value(&self, p: DVec3) -> f64 {
        if self.nodes.is_empty() { 0.0 } else { self.arch.dispatch(Value { tree: self, p }) }
    }
}

impl<P: GradientPacket> Tree<P> {
    /// The sum of all potentials at `p`, which is finite, and its gradient.
    pub(super) fn value_and_gradient(&self, p: DVec3) -> (f64, DVec3) {
        if self.nodes.is_empty() {
            return (0.0, DVec3::ZERO);
        }
        let [value, x, y, z] = self.arch.dispatch(ValueAndGradient { tree: self, p });
        (value, DVec3::new(x, y, z))
    }
}

/// Ranges of the sorted items below every child.
fn ranges(hierarchy: &Hierarchy) -> Vec<[Range<usize>; WIDTH]> {
    let mut ranges = vec![[const { 0..0 }; WIDTH]; hierarchy.nodes().len()];
    for (i, node) in hierarchy.nodes().iter().enumerate().rev() {
        for (place, child) in node.children.iter().enumerate() {
            ranges[i][place] = match *child {
                Child::Empty => 0..0,
                Child::Leaf { start, end } => start as usize..end as usize,
                Child::Node(below) => {
                    // Items of a subtree are consecutive, and the children in their order.
                    let mut filled = ranges[below as usize].iter().filter(|range| !range.is_empty());
                    let first = filled.next().map_or(0..0, Range::clone);
                    first.start..filled.next_back().map_or(first.end, |last| last.end)
                }
            };
        }
    }
    ranges
}

/// Walks down to what is near: adds every node on the way to the sums by `far`, which answers which of its children
/// are near, and every packet by `near`.
#[inline(always)]
fn walk<P, T>(tree: &Tree<P>, sums: &mut T, far: impl Fn(&Node, &mut T) -> u32, near: impl Fn(&P, &mut T)) {
    let mut stack = [0_u32; STACK];
    let mut top = 1;
    while top > 0 {
        top -= 1;
        let child = stack[top];
        if child & PACKET != 0 {
            near(&tree.packets[(child & !PACKET) as usize], sums);
            continue;
        }
        let node = &tree.nodes[child as usize];
        let mut open = far(node, sums);
        while open != 0 {
            let lane = open.trailing_zeros() as usize;
            open &= open - 1;
            stack[top] = node.children[lane];
            top += 1;
        }
    }
}

#[inline(always)]
fn add_lanes(sums: &mut [f64; WIDTH], terms: &[f64; WIDTH]) {
    for i in 0..WIDTH {
        sums[i] += terms[i];
    }
}

struct Value<'a, P> {
    tree: &'a Tree<P>,
    p: DVec3,
}

impl<P: Packet> WithSimd for Value<'_, P> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let Self { tree, p } = self;
        let mut sums = [0.0; WIDTH];
        let far = |node: &Node, sums: &mut [f64; WIDTH]| {
            let (values, open) = node.values(p);
            add_lanes(sums, &values);
            open
        };
        walk(tree, &mut sums, far, |packet, sums| add_lanes(sums, &packet.values(p)));
        sums.iter().sum()
    }
}

struct ValueAndGradient<'a, P> {
    tree: &'a Tree<P>,
    p: DVec3,
}

impl<P: GradientPacket> WithSimd for ValueAndGradient<'_, P> {
    type Output = [f64; 4];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [f64; 4] {
        let Self { tree, p } = self;
        let add = |sums: &mut ValuesAndGradients, terms: &ValuesAndGradients| {
            sums.iter_mut().zip(terms).for_each(|(sum, lanes)| add_lanes(sum, lanes));
        };
        let mut sums = [[0.0; WIDTH]; 4];
        let far = |node: &Node, sums: &mut ValuesAndGradients| {
            let (values, open) = node.values_and_gradients(p);
            add(sums, &values);
            open
        };
        walk(tree, &mut sums, far, |packet, sums| add(sums, &packet.values_and_gradients(p)));
        sums.map(|lanes| lanes.iter().sum())
    }
}
