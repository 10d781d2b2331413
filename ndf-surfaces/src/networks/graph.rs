//! Networks as graphs: values forward, gradients backward, a block of points at a time.
//!
//! A block of n points keeps every quantity as columns of n numbers, so that layers are matrix products of
//! columns, activations and encodings run over whole columns, and joining two quantities puts one after the other.

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};
use ndf_core::DVec3;

use super::activation::Activation;
use super::encoding::Encoding;
use super::hash_grid::HashGrid;

/// Points of a block: enough for the products to be efficient, few enough for a layer to stay in the cache.
const BLOCK: usize = 128;

/// Number of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeId(usize);

/// A layer: `y = W x + b`.
#[derive(Clone, Debug)]
pub struct Dense {
    /// W, one row an output.
    weights: Vec<f32>,
    /// b
    bias: Vec<f32>,
    inputs: usize,
}

impl Dense {
    /// A layer with a row of weights for each output; `None` if the sizes contradict.
    pub fn new(weights: Vec<f32>, bias: Vec<f32>) -> Option<Self> {
        let outputs = bias.len();
        let inputs = weights.len().checked_div(outputs)?;
        (inputs > 0 && inputs * outputs == weights.len()).then_some(Self { weights, bias, inputs })
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.bias.len()
    }

    /// The same layer on inputs that are this many times larger.
    #[must_use]
    pub fn on_scaled_inputs(mut self, factor: f32) -> Self {
        self.weights.iter_mut().for_each(|w| *w *= factor);
        self
    }

    /// The layer with only one of its outputs; `None` if there is no such output.
    #[must_use]
    pub fn only_output(self, output: usize) -> Option<Self> {
        let row = self.weights.chunks_exact(self.inputs).nth(output)?.to_vec();
        Self::new(row, vec![self.bias[output]])
    }

    /// The layer with the inputs from `from` on, as many as are given, held fixed; `None` if there are no others.
    #[must_use]
    pub fn with_inner_inputs(self, from: usize, fixed: &[f32]) -> Option<Self> {
        let (mut weights, mut bias) = (Vec::new(), self.bias);
        for (row, b) in self.weights.chunks_exact(self.inputs).zip(&mut bias) {
            let (before, rest) = row.split_at_checked(from)?;
            let (inner, after) = rest.split_at_checked(fixed.len())?;
            *b += inner.iter().zip(fixed).map(|(w, x)| w * x).sum::<f32>();
            weights.extend_from_slice(before);
            weights.extend_from_slice(after);
        }
        Self::new(weights, bias)
    }
}

#[derive(Clone, Debug)]
enum Node {
    /// The position, three columns.
    Position,
    Encoding(Encoding),
    Grid(Box<HashGrid>),
    Dense(Dense, usize),
    Map(Activation, usize),
    /// One after the other.
    Joined(Vec<usize>),
    /// Number by number.
    Product(usize, usize),
}

/// A network from positions to numbers.
#[derive(Clone, Debug)]
pub struct Graph {
    nodes: Vec<Node>,
    widths: Vec<usize>,
}

impl Default for Graph {
    fn default() -> Self {
        Self::new()
    }
}

impl Graph {
    /// A graph of which the only node is the position.
    pub fn new() -> Self {
        Self { nodes: vec![Node::Position], widths: vec![3] }
    }

    /// The position.
    pub fn position(&self) -> NodeId {
        NodeId(0)
    }

    /// Width of a node.
    pub fn width(&self, node: NodeId) -> usize {
        self.widths[node.0]
    }

    fn push(&mut self, node: Node, width: usize) -> NodeId {
        self.nodes.push(node);
        self.widths.push(width);
        NodeId(self.nodes.len() - 1)
    }

    /// An encoding of the position.
    pub fn encoding(&mut self, encoding: Encoding) -> NodeId {
        self.push(Node::Encoding(encoding), encoding.width())
    }

    /// Features of a grid at the position.
    pub fn grid(&mut self, grid: HashGrid) -> NodeId {
        let width = grid.width();
        self.push(Node::Grid(Box::new(grid)), width)
    }

    /// A layer on a node; `None` if it has another number of inputs than the node is wide.
    pub fn dense(&mut self, layer: Dense, from: NodeId) -> Option<NodeId> {
        let outputs = layer.outputs();
        (layer.inputs() == self.width(from)).then(|| self.push(Node::Dense(layer, from.0), outputs))
    }

    /// An activation of a node.
    pub fn map(&mut self, activation: Activation, from: NodeId) -> NodeId {
        let width = self.width(from);
        self.push(Node::Map(activation, from.0), width)
    }

    /// Nodes joined to one.
    pub fn joined(&mut self, parts: &[NodeId]) -> NodeId {
        let width = parts.iter().map(|&part| self.width(part)).sum();
        self.push(Node::Joined(parts.iter().map(|part| part.0).collect()), width)
    }

    /// The product of two nodes, number by number; `None` if their widths differ.
    pub fn product(&mut self, a: NodeId, b: NodeId) -> Option<NodeId> {
        let width = self.width(a);
        (width == self.width(b)).then(|| self.push(Node::Product(a.0, b.0), width))
    }

    /// Number of weights and biases.
    pub fn parameters(&self) -> usize {
        let of_node = |node: &Node| match node {
            Node::Dense(layer, _) => layer.weights.len() + layer.bias.len(),
            Node::Grid(grid) => grid.parameters(),
            _ => 0,
        };
        self.nodes.iter().map(of_node).sum()
    }

    /// Widths of what goes into the layers, one after the other, and of what comes out of the last.
    pub fn widths(&self) -> Vec<usize> {
        let layers =
            || self.nodes.iter().filter_map(|node| if let Node::Dense(l, _) = node { Some(l) } else { None });
        layers().map(Dense::inputs).chain(layers().next_back().map(Dense::outputs)).collect()
    }

    /// Octaves of the encoding of the position, if it has one.
    pub fn octaves(&self) -> Option<usize> {
        self.nodes.iter().find_map(|node| if let Node::Encoding(e) = node { Some(e.octaves()) } else { None })
    }

    /// The first of its activations, if it has one.
    pub fn activation(&self) -> Option<Activation> {
        self.nodes.iter().find_map(|node| if let Node::Map(a, _) = node { Some(*a) } else { None })
    }

    /// Puts another activation everywhere in the place of one.
    pub fn replace_activation(&mut self, old: Activation, new: Activation) {
        for node in &mut self.nodes {
            match node {
                Node::Map(activation, _) if *activation == old => *activation = new,
                _ => {}
            }
        }
    }

    /// Whether every weight is finite.
    pub fn is_finite(&self) -> bool {
        self.nodes.iter().all(|node| match node {
            Node::Dense(layer, _) => layer.weights.iter().chain(&layer.bias).all(|w| w.is_finite()),
            Node::Grid(grid) => grid.is_finite(),
            _ => true,
        })
    }

    /// First output of the last node at every point, and its gradient if room for gradients is given.
    pub fn evaluate(&self, points: &[DVec3], values: &mut [f64], mut gradients: Option<&mut [DVec3]>) {
        let mut forward: Vec<Vec<f32>> = self.widths.iter().map(|&w| vec![0.0; w * BLOCK]).collect();
        let mut adjoints = if gradients.is_some() { forward.clone() } else { Vec::new() };
        for (i, block) in points.chunks(BLOCK).enumerate() {
            let n = block.len();
            self.run_forward(block, &mut forward);
            let output = forward.last().expect("a graph has the position");
            let from = i * BLOCK;
            values[from..from + n].iter_mut().zip(output).for_each(|(v, &y)| *v = f64::from(y));
            if let Some(gradients) = &mut gradients {
                self.run_backward(block, &forward, &mut adjoints, &mut gradients[from..from + n]);
            }
        }
    }

    fn run_forward(&self, points: &[DVec3], values: &mut [Vec<f32>]) {
        let n = points.len();
        for (k, node) in self.nodes.iter().enumerate() {
            let (before, rest) = values.split_at_mut(k);
            let y = &mut rest[0][..self.widths[k] * n];
            let input = |from: usize| &before[from][..self.widths[from] * n];
            match node {
                Node::Position => {
                    for (axis, column) in y.chunks_exact_mut(n).enumerate() {
                        points.iter().zip(column).for_each(|(p, y)| *y = p[axis] as f32);
                    }
                }
                Node::Encoding(encoding) => encoding.encode(points, y),
                Node::Grid(grid) => grid.evaluate(points, y),
                Node::Dense(layer, from) => {
                    for (column, &b) in y.chunks_exact_mut(n).zip(&layer.bias) {
                        column.fill(b);
                    }
                    let y = MatMut::from_column_major_slice_mut(y, n, layer.outputs());
                    let x = MatRef::from_column_major_slice(input(*from), n, layer.inputs);
                    matmul(y, Accum::Add, x, layer.transposed(), 1.0, Par::Seq);
                }
                Node::Map(activation, from) => activation.apply(input(*from), y),
                Node::Joined(parts) => {
                    let mut rest = y;
                    for &part in parts {
                        let (y, after) = rest.split_at_mut(self.widths[part] * n);
                        y.copy_from_slice(input(part));
                        rest = after;
                    }
                }
                Node::Product(a, b) => {
                    let factors = input(*a).iter().zip(input(*b));
                    y.iter_mut().zip(factors).for_each(|(y, (a, b))| *y = a * b);
                }
            }
        }
    }

    /// Adjoints from the last node's first output down to the positions.
    fn run_backward(
        &self,
        points: &[DVec3],
        values: &[Vec<f32>],
        adjoints: &mut [Vec<f32>],
        gradients: &mut [DVec3],
    ) {
        let n = points.len();
        gradients.fill(DVec3::ZERO);
        adjoints.iter_mut().zip(&self.widths).for_each(|(a, &width)| a[..width * n].fill(0.0));
        adjoints.last_mut().expect("a graph has the position")[..n].fill(1.0);
        for (k, node) in self.nodes.iter().enumerate().rev() {
            let (before, rest) = adjoints.split_at_mut(k);
            let a = &mut rest[0][..self.widths[k] * n];
            let value = |from: usize| &values[from][..self.widths[from] * n];
            match node {
                Node::Position => {
                    for (axis, column) in a.chunks_exact(n).enumerate() {
                        gradients.iter_mut().zip(column).for_each(|(g, &a)| g[axis] += f64::from(a));
                    }
                }
                Node::Encoding(encoding) => encoding.pull_back(value(k), a, gradients),
                Node::Grid(grid) => grid.pull_back(points, a, gradients),
                Node::Dense(layer, from) => {
                    let to = &mut before[*from][..layer.inputs * n];
                    let to = MatMut::from_column_major_slice_mut(to, n, layer.inputs);
                    let a = MatRef::from_column_major_slice(a, n, layer.outputs());
                    matmul(to, Accum::Add, a, layer.transposed().transpose(), 1.0, Par::Seq);
                }
                Node::Map(activation, from) => {
                    activation.pull_back(value(*from), a);
                    add(&mut before[*from], a);
                }
                Node::Joined(parts) => {
                    let mut rest = &*a;
                    for &part in parts {
                        let (a, after) = rest.split_at(self.widths[part] * n);
                        add(&mut before[part], a);
                        rest = after;
                    }
                }
                Node::Product(x, y) => {
                    for (to, other) in [(*x, *y), (*y, *x)] {
                        let terms = a.iter().zip(value(other));
                        before[to].iter_mut().zip(terms).for_each(|(t, (a, o))| *t += a * o);
                    }
                }
            }
        }
    }
}

impl Dense {
    fn transposed(&self) -> MatRef<'_, f32> {
        MatRef::from_column_major_slice(&self.weights, self.inputs, self.outputs())
    }
}

fn add(to: &mut [f32], terms: &[f32]) {
    to.iter_mut().zip(terms).for_each(|(t, x)| *t += x);
}
