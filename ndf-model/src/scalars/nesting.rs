//! In which order the nodes of a base mesh become known: coarse ones first, each level spread over the whole surface. It
//! follows from the connectivity and the numbering of the file alone, so that every machine comes to the same order.

use ndf_mesh::subdivision::Refinement;

/// The coarsest level is the first with so few nodes, and levels of a base mesh are at most so many.
const FEW_NODES: usize = 24;
const MAX_LEVELS: usize = 40;
/// No vertex.
const NONE: u32 = u32::MAX;

/// Nodes in levels from coarse to fine. The place of a node in this order is its *rank*.
#[derive(Clone, Debug)]
pub struct Nesting {
    /// The node of every rank.
    order: Vec<u32>,
    /// Where levels begin, and the number of nodes.
    starts: Vec<usize>,
    /// Of every rank, the lower ranks of the neighbours on its level.
    before: Adjacency,
}

impl Nesting {
    /// The nodes of the last of these meshes, each of which is the one before refined. Vertices that are new in a mesh are
    /// a level. Those of the first are divided: a vertex of the lowest number that has no neighbour yet takes its
    /// neighbours, which are the level; the takers are the graph of what is coarser, joined where what they took is.
    /// O(n log n).
    pub(super) fn new(meshes: &[Refinement]) -> Self {
        let mut levels: Vec<(Vec<u32>, Adjacency)> = Vec::new();
        for pair in meshes.windows(2).rev() {
            let new = pair[0].vertex_count() as u32..pair[1].vertex_count() as u32;
            levels.push((new.collect(), Adjacency::of_mesh(&pair[1])));
        }
        let count = meshes[0].vertex_count();
        let mut nodes: Vec<u32> = (0..count as u32).collect();
        let mut edges: Vec<[u32; 2]> = meshes[0].edges().iter().map(|side| side.ends).collect();
        while nodes.len() > FEW_NODES && levels.len() < meshes.len() + MAX_LEVELS {
            let around = Adjacency::new(count, &edges);
            let mut takers = vec![NONE; count];
            for &v in &nodes {
                if takers[v as usize] == NONE {
                    takers[v as usize] = v;
                    for &u in around.of(v as usize) {
                        let taker = &mut takers[u as usize];
                        *taker = if *taker == NONE { v } else { *taker };
                    }
                }
            }
            let (coarse, fine): (Vec<u32>, Vec<u32>) = nodes.iter().partition(|&&v| takers[v as usize] == v);
            if fine.is_empty() {
                break;
            }
            levels.push((fine, around));
            nodes = coarse;
            edges.iter_mut().for_each(|edge| {
                *edge = edge.map(|v| takers[v as usize]);
                edge.sort_unstable();
            });
            edges.retain(|[a, b]| a != b);
            edges.sort_unstable();
            edges.dedup();
        }
        levels.push((nodes, Adjacency::new(count, &edges)));
        levels.reverse();
        let order: Vec<u32> = levels.iter().flat_map(|(nodes, _)| nodes.iter().copied()).collect();
        let mut ranks = vec![0; order.len()];
        order.iter().zip(0..).for_each(|(&node, rank)| ranks[node as usize] = rank);
        let (mut starts, mut before) = (vec![0], Adjacency::default());
        for (nodes, around) in &levels {
            for &node in nodes {
                let known = around.of(node as usize).iter().map(|&u| ranks[u as usize]);
                before.push(known.filter(|&rank| rank < ranks[node as usize]));
            }
            starts.push(starts[starts.len() - 1] + nodes.len());
        }
        Self { order, starts, before }
    }

    /// Number of levels.
    pub fn levels(&self) -> usize {
        self.starts.len() - 1
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.order.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    /// The ranks of a level.
    pub fn level(&self, level: usize) -> std::ops::Range<usize> {
        self.starts[level]..self.starts[level + 1]
    }

    /// The node of every rank.
    pub(super) fn order(&self) -> &[u32] {
        &self.order
    }

    /// The ranks of the neighbours of a rank that are known before it.
    pub fn before(&self, rank: usize) -> &[u32] {
        self.before.of(rank)
    }
}

/// Lists one after the other.
#[derive(Clone, Debug)]
pub(super) struct Adjacency {
    starts: Vec<usize>,
    items: Vec<u32>,
}

impl Default for Adjacency {
    fn default() -> Self {
        Self { starts: vec![0], items: Vec::new() }
    }
}

impl Adjacency {
    fn of_mesh(mesh: &Refinement) -> Self {
        let edges: Vec<[u32; 2]> = mesh.edges().iter().map(|side| side.ends).collect();
        Self::new(mesh.vertex_count(), &edges)
    }

    /// The neighbours of every vertex, in the order of the edges.
    pub(super) fn new(count: usize, edges: &[[u32; 2]]) -> Self {
        let mut starts = vec![0; count + 1];
        edges.iter().flatten().for_each(|&v| starts[v as usize + 1] += 1);
        (0..count).for_each(|v| starts[v + 1] += starts[v]);
        let (mut next, mut items) = (starts.clone(), vec![0; 2 * edges.len()]);
        for &[a, b] in edges {
            for (v, w) in [(a, b), (b, a)] {
                items[next[v as usize]] = w;
                next[v as usize] += 1;
            }
        }
        Self { starts, items }
    }

    fn push(&mut self, list: impl Iterator<Item = u32>) {
        self.items.extend(list);
        self.starts.push(self.items.len());
    }

    pub(super) fn of(&self, v: usize) -> &[u32] {
        &self.items[self.starts[v]..self.starts[v + 1]]
    }
}
