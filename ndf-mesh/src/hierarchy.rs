//! Eight-ary bounding volume hierarchies, built by the surface area heuristic.
//!
//! A [`Hierarchy`] only says which items lie together and in which boxes. What is searched is made of it: the
//! [`TriangleTree`](crate::TriangleTree) packs triangles into its leaves, a winding number sums moments up to
//! its root. Nodes are wide because one comparison with eight boxes costs a SIMD core about as much as one
//! with a single box (Wald, Benthin and Boulos 2008, "Getting rid of packets").

use rayon::prelude::*;

use ndf_core::{BoundingBox, DVec3};

/// Children of a node.
pub const WIDTH: usize = 8;

/// What a [`Node`] holds in one of its places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Child {
    /// Nothing; the box of that place is empty.
    Empty,
    /// Another node. Its index is greater than that of its parent.
    Node(u32),
    /// The items `order[start..end]`, at least one.
    Leaf {
        /// First position in [`Hierarchy::order`].
        start: u32,
        /// Position past the last.
        end: u32,
    },
}

/// Eight children and their boxes.
#[derive(Clone, Debug)]
pub struct Node {
    /// What is in each place; the empty places come last.
    pub children: [Child; WIDTH],
    /// A box around the items below each child.
    pub boxes: [BoundingBox; WIDTH],
}

/// Items grouped by their boxes. A function of the boxes and the leaf size alone, not of the number of threads.
#[derive(Clone, Debug, Default)]
pub struct Hierarchy {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

/// Levels below which parts are halved by count, whatever it costs, so that no input makes a deep tree.
const MAX_HEURISTIC_LEVELS: usize = 16;

/// No hierarchy is deeper: `2³²` items halved three times in each level past the heuristic ones.
pub const MAX_LEVELS: usize = MAX_HEURISTIC_LEVELS + 11;

/// Bins along each axis in the search for the best split (Wald 2007).
const BINS: usize = 16;

/// Items below which a subtree is built by one thread.
const SERIAL_ITEMS: usize = 4096;

#[derive(Clone, Copy)]
struct Item {
    bounds: BoundingBox,
    index: u32,
}

impl Item {
    /// Twice the centre of its box.
    fn center(&self) -> DVec3 {
        self.bounds.min + self.bounds.max
    }
}

impl Hierarchy {
    /// Groups the items with these boxes, at most `leaf_size` in a leaf. Items whose box is empty or not finite
    /// are left out. O(n log n) time, O(n) memory.
    ///
    /// # Panics
    /// If `leaf_size` is 0 or there are more than `u32::MAX` boxes.
    pub fn new(boxes: &[BoundingBox], leaf_size: usize) -> Self {
        Self::of(boxes.len(), |item| boxes[item], leaf_size)
    }

    /// As [`new`](Self::new), of so many items whose boxes are asked for one by one: those of millions take a good part of the memory.
    ///
    /// # Panics
    /// If `leaf_size` is 0 or there are more than `u32::MAX` items.
    pub fn of(count: usize, box_of: impl Fn(usize) -> BoundingBox, leaf_size: usize) -> Self {
        assert!(leaf_size > 0 && u32::try_from(count).is_ok());
        let usable = |b: &BoundingBox| b.min.is_finite() && b.max.is_finite() && !b.is_empty();
        let mut items = Vec::with_capacity(count);
        for index in 0..count {
            let bounds = box_of(index);
            if usable(&bounds) {
                items.push(Item { bounds, index: index as u32 });
            }
        }
        if items.is_empty() {
            return Self::default();
        }
        let nodes = subtree(&mut items, 0, 0, leaf_size);
        Self { nodes, order: items.iter().map(|item| item.index).collect() }
    }

    /// How many leaves there are.
    pub fn leaf_count(&self) -> usize {
        let is_leaf = |child: &&Child| matches!(child, Child::Leaf { .. });
        self.nodes.iter().map(|node| node.children.iter().filter(is_leaf).count()).sum()
    }

    /// The nodes; the root is the first, parents come before their children. Empty if there are no items.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Indices of the items, in the order of the leaves.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// The box around everything.
    pub fn bounds(&self) -> BoundingBox {
        self.nodes.first().map_or(BoundingBox::EMPTY, |root| {
            root.boxes.iter().fold(BoundingBox::EMPTY, |all, &b| all.union(b))
        })
    }
}

/// A consecutive range of the items of a node.
struct Part<'a> {
    items: &'a mut [Item],
    start: usize,
    bounds: BoundingBox,
}

/// The nodes of the subtree over `items`, which begin at `start` in the order of all. Indices are local.
fn subtree(items: &mut [Item], start: usize, level: usize, leaf_size: usize) -> Vec<Node> {
    let large = items.len() > SERIAL_ITEMS;
    let mut parts = split_into_parts(items, start, level, leaf_size);
    let mut node = Node { children: [Child::Empty; WIDTH], boxes: [BoundingBox::EMPTY; WIDTH] };
    for (place, part) in parts.iter().enumerate() {
        node.boxes[place] = part.bounds;
    }
    let below = |part: &mut Part<'_>| {
        if part.items.len() > leaf_size {
            subtree(part.items, part.start, level + 1, leaf_size)
        } else {
            Vec::new()
        }
    };
    let subtrees: Vec<Vec<Node>> =
        if large { parts.par_iter_mut().map(below).collect() } else { parts.iter_mut().map(below).collect() };
    let mut nodes = vec![node];
    for (place, (part, subtree)) in parts.iter().zip(subtrees).enumerate() {
        let base = nodes.len() as u32;
        nodes[0].children[place] = if subtree.is_empty() {
            Child::Leaf { start: part.start as u32, end: (part.start + part.items.len()) as u32 }
        } else {
            Child::Node(base)
        };
        nodes.extend(subtree.into_iter().map(|mut node| {
            for child in &mut node.children {
                if let Child::Node(local) = child {
                    *local += base;
                }
            }
            node
        }));
    }
    nodes
}

/// Splits the items of a node in two until there are [`WIDTH`] parts or all fit a leaf, always the part most
/// costly to search.
fn split_into_parts(items: &mut [Item], start: usize, level: usize, leaf_size: usize) -> Vec<Part<'_>> {
    let by_count = level >= MAX_HEURISTIC_LEVELS;
    let bounds = bounds_of(items);
    let mut parts = Vec::with_capacity(WIDTH);
    parts.push(Part { items, start, bounds });
    while parts.len() < WIDTH {
        let cost = |part: &Part<'_>| {
            let area = if by_count { 1.0 } else { half_area(&part.bounds) };
            area * part.items.len() as f64
        };
        let splittable = (0..parts.len()).filter(|&i| parts[i].items.len() > leaf_size);
        let Some(worst) = splittable.max_by(|&i, &j| cost(&parts[i]).total_cmp(&cost(&parts[j]))) else {
            break;
        };
        let Part { items, start, bounds } = parts.swap_remove(worst);
        let best = if by_count { None } else { best_split(items, leaf_size) };
        let middle = match best {
            Some(split) => partition(items, |item| split.bin_of(item) < split.bin),
            None => halve(items, &bounds),
        };
        let (left, right) = items.split_at_mut(middle);
        let (left_bounds, right_bounds) = (bounds_of(left), bounds_of(right));
        parts.push(Part { items: left, start, bounds: left_bounds });
        parts.push(Part { items: right, start: start + middle, bounds: right_bounds });
    }
    parts.sort_by_key(|part| part.start);
    parts
}

/// Items whose centre falls in a bin below `bin` along `axis` go left.
struct Split {
    axis: usize,
    origin: f64,
    bins_per_length: f64,
    bin: usize,
}

impl Split {
    fn bin_of(&self, item: &Item) -> usize {
        (((item.center()[self.axis] - self.origin) * self.bins_per_length) as usize).min(BINS - 1)
    }
}

/// The binned split of least cost; `None` if all centres coincide.
fn best_split(items: &[Item], leaf_size: usize) -> Option<Split> {
    let centers = items.iter().fold(BoundingBox::EMPTY, |b, item| b.including(item.center()));
    let leaves = |count: usize| count.div_ceil(leaf_size) as f64;
    let mut best: Option<(f64, Split)> = None;
    for axis in 0..3 {
        let bins_per_length = BINS as f64 / centers.extent()[axis];
        if !(bins_per_length.is_finite() && bins_per_length > 0.0) {
            continue;
        }
        let mut split = Split { axis, origin: centers.min[axis], bins_per_length, bin: 0 };
        let mut bins = [(BoundingBox::EMPTY, 0); BINS];
        for item in items {
            let (bounds, count) = &mut bins[split.bin_of(item)];
            *bounds = bounds.union(item.bounds);
            *count += 1;
        }
        let mut right_costs = [0.0; BINS];
        let (mut bounds, mut count) = (BoundingBox::EMPTY, 0);
        for i in (1..BINS).rev() {
            bounds = bounds.union(bins[i].0);
            count += bins[i].1;
            right_costs[i] = if count == 0 { f64::INFINITY } else { half_area(&bounds) * leaves(count) };
        }
        let (mut bounds, mut count) = (BoundingBox::EMPTY, 0);
        for i in 1..BINS {
            bounds = bounds.union(bins[i - 1].0);
            count += bins[i - 1].1;
            if count == 0 {
                continue;
            }
            let cost = half_area(&bounds) * leaves(count) + right_costs[i];
            if cost.is_finite() && best.as_ref().is_none_or(|(least, _)| cost < *least) {
                split.bin = i;
                best = Some((cost, Split { ..split }));
            }
        }
    }
    best.map(|(_, split)| split)
}

/// Moves the items for which `left` holds before the others; returns how many there are.
fn partition(items: &mut [Item], left: impl Fn(&Item) -> bool) -> usize {
    let mut middle = 0;
    for i in 0..items.len() {
        if left(&items[i]) {
            items.swap(i, middle);
            middle += 1;
        }
    }
    middle
}

/// Splits at the median along the longest side of the box.
fn halve(items: &mut [Item], bounds: &BoundingBox) -> usize {
    let axis = bounds.extent().max_position();
    let middle = items.len() / 2;
    items.select_nth_unstable_by(middle, |a, b| {
        a.center()[axis].total_cmp(&b.center()[axis]).then(a.index.cmp(&b.index))
    });
    middle
}

fn bounds_of(items: &[Item]) -> BoundingBox {
    items.iter().fold(BoundingBox::EMPTY, |b, item| b.union(item.bounds))
}

/// Half the area of the sides of a box.
fn half_area(bounds: &BoundingBox) -> f64 {
    let e = bounds.extent();
    e.x * e.y + e.y * e.z + e.z * e.x
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    fn check(boxes: &[BoundingBox], leaf_size: usize) {
        let hierarchy = Hierarchy::new(boxes, leaf_size);
        let mut seen = vec![0; boxes.len()];
        let mut levels = vec![0; hierarchy.nodes().len()];
        for (i, node) in hierarchy.nodes().iter().enumerate() {
            assert!(levels[i] < MAX_LEVELS);
            for (child, outer) in node.children.iter().zip(&node.boxes) {
                let contains = |b: &BoundingBox| outer.union(*b) == *outer;
                match *child {
                    Child::Empty => assert!(outer.is_empty()),
                    Child::Node(below) => {
                        assert!(below as usize > i);
                        levels[below as usize] = levels[i] + 1;
                        assert!(hierarchy.nodes()[below as usize].boxes.iter().all(contains));
                    }
                    Child::Leaf { start, end } => {
                        assert!(start < end && (end - start) as usize <= leaf_size);
                        for &item in &hierarchy.order()[start as usize..end as usize] {
                            assert!(contains(&boxes[item as usize]));
                            seen[item as usize] += 1;
                        }
                    }
                }
            }
        }
        assert!(seen.iter().all(|&count| count == 1));
    }

    #[test]
    fn every_item_lies_in_one_leaf_and_in_all_boxes_above() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for count in [1, 2, 8, 9, 100, 20_000] {
            let boxes: Vec<BoundingBox> = (0..count)
                .map(|_| {
                    let p = DVec3::from_array(rng.random());
                    BoundingBox { min: p, max: p + 0.1 * DVec3::from_array(rng.random::<[f64; 3]>()) }
                })
                .collect();
            check(&boxes, 4);
            check(&boxes, 1);
        }
    }

    #[test]
    fn coinciding_and_clustered_items_make_no_deep_tree() {
        let at = |x: f64| BoundingBox { min: DVec3::splat(x), max: DVec3::splat(x) };
        check(&vec![at(1.0); 10_000], 4);
        // Every split by bins would part a single item from the rest.
        let powers: Vec<BoundingBox> = (0..900).map(|i| at(2.0_f64.powi(-i))).collect();
        check(&powers, 1);
    }

    #[test]
    fn threads_change_nothing() {
        let boxes: Vec<BoundingBox> = (0..30_000)
            .map(|i| {
                let p = (DVec3::new(0.618, 0.414, 0.732) * f64::from(i)).fract();
                BoundingBox { min: p, max: p }
            })
            .collect();
        let built = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| Hierarchy::new(&boxes, 8).order)
        };
        assert_eq!(built(1), built(4));
    }

    #[test]
    fn nothing_makes_nothing() {
        assert!(Hierarchy::new(&[], 4).nodes().is_empty());
        let nan = BoundingBox { min: DVec3::NAN, max: DVec3::NAN };
        assert!(Hierarchy::new(&[BoundingBox::EMPTY, nan], 4).nodes().is_empty());
    }
}
