//! A second structure for the same thing, by other means: every half-edge keeps its length and its direction, as an
//! angle in the tangent plane of its tail (Sharp, Soliman and Crane 2019, §3). No integers, no normal coordinates:
//! where an edge runs over the input is found by walking from its tail by its angle and length, in space.

use ndf_core::DVec3;
use ndf_mesh::{Halfedge, ManifoldMesh, Vertex};

/// Directions at the vertices of an input mesh, and an intrinsic triangulation of it that follows flips.
pub(crate) struct Signposts<'m> {
    input: &'m ManifoldMesh,
    /// Angle around each input vertex.
    sums: Vec<f64>,
    /// Direction of every input half-edge, counter-clockwise from the first of the fan, in true angle.
    input_directions: Vec<f64>,
    tails: Vec<Vertex>,
    twins: Vec<Option<Halfedge>>,
    lengths: Vec<f64>,
    directions: Vec<f64>,
}

fn angle(a: f64, b: f64, opposite: f64) -> f64 {
    ((a * a + b * b - opposite * opposite) / (2.0 * a * b)).clamp(-1.0, 1.0).acos()
}

impl<'m> Signposts<'m> {
    pub(crate) fn new(input: &'m ManifoldMesh) -> Self {
        let (topology, p) = (input.topology(), input.positions());
        let lengths: Vec<f64> = topology
            .halfedges()
            .map(|h| p[topology.tail(h).index()].distance(p[topology.tip(h).index()]))
            .collect();
        let corner = |h: Halfedge| {
            let (next, last) = (h.next(), h.previous());
            angle(lengths[h.index()], lengths[last.index()], lengths[next.index()])
        };
        let mut sums = vec![0.0; p.len()];
        let mut directions = vec![0.0; lengths.len()];
        for v in topology.vertices() {
            for h in topology.outgoing(v) {
                directions[h.index()] = sums[v.index()];
                sums[v.index()] += corner(h);
            }
        }
        Self {
            input,
            sums,
            input_directions: directions.clone(),
            tails: topology.halfedges().map(|h| topology.tail(h)).collect(),
            twins: topology.halfedges().map(|h| topology.twin(h)).collect(),
            lengths,
            directions,
        }
    }

    fn corner(&self, h: Halfedge) -> f64 {
        let (next, last) = (h.next(), h.previous());
        angle(self.lengths[h.index()], self.lengths[last.index()], self.lengths[next.index()])
    }

    pub(crate) fn tail(&self, h: Halfedge) -> Vertex {
        self.tails[h.index()]
    }

    pub(crate) fn length(&self, h: Halfedge) -> f64 {
        self.lengths[h.index()]
    }

    /// Flips the edge of a half-edge, i → j between k on its left and l on its right; the caller knows that it can
    /// be. Slots are filled as the other structure fills them, so that half-edges have the same numbers.
    pub(crate) fn flip(&mut self, h: Halfedge) {
        let t = self.twins[h.index()].expect("an inner edge");
        let (hn, tn) = (h.next(), t.next());
        let (hp, tp) = (hn.next(), tn.next());
        let [jk, ki, il, lj] = [hn, hp, tn, tp].map(|h| self.lengths[h.index()]);
        let turn = self.corner(h) + self.corner(tn);
        let length = (ki * ki + il * il - 2.0 * ki * il * turn.cos()).max(0.0).sqrt();
        // The new edge leaves k counter-clockwise of k → i, and l of l → j.
        let from_k = self.turned(hp, angle(ki, length, il));
        let from_l = self.turned(tp, angle(lj, length, jk));
        let (k, l) = (self.tails[hp.index()], self.tails[tp.index()]);
        self.relocate(hn, t);
        self.relocate(tn, h);
        for (slot, twin, tail, direction) in [(hn, tn, l, from_l), (tn, hn, k, from_k)] {
            self.tails[slot.index()] = tail;
            self.twins[slot.index()] = Some(twin);
            self.lengths[slot.index()] = length;
            self.directions[slot.index()] = direction;
        }
    }

    /// The direction at an angle counter-clockwise of a half-edge.
    fn turned(&self, h: Halfedge, by: f64) -> f64 {
        let v = self.tails[h.index()];
        let (direction, sum) = (self.directions[h.index()] + by, self.sums[v.index()]);
        if direction >= sum && !self.input.topology().is_boundary_vertex(v) {
            direction - sum
        } else {
            direction
        }
    }

    fn relocate(&mut self, from: Halfedge, to: Halfedge) {
        let (source, target) = (from.index(), to.index());
        self.tails[target] = self.tails[source];
        self.lengths[target] = self.lengths[source];
        self.directions[target] = self.directions[source];
        self.twins[target] = self.twins[source];
        if let Some(twin) = self.twins[target] {
            self.twins[twin.index()] = Some(to);
        }
    }

    /// The input half-edges that a half-edge crosses, by a straight walk in its direction, and where it ends.
    pub(crate) fn trace(&self, h: Halfedge) -> (Vec<Halfedge>, DVec3) {
        let (input, v) = (self.input, self.tails[h.index()]);
        let (direction, length) = (self.directions[h.index()], self.lengths[h.index()]);
        // The corner of the fan it leaves by.
        let fan: Vec<Halfedge> = input.topology().outgoing(v).collect();
        let start = *fan
            .iter()
            .rev()
            .find(|&&out| self.input_directions[out.index()] <= direction + 1e-9)
            .unwrap_or(&fan[0]);
        let turn = direction - self.input_directions[start.index()];
        let p = |h: Halfedge| input.positions()[input.topology().tail(h).index()];
        // In the plane of the face: its first half-edge along x.
        let along = (p(start.next()) - p(start)).normalize();
        let third = p(start.previous()) - p(start);
        let up = (third - third.dot(along) * along).normalize();
        let mut heading = turn.cos() * along + turn.sin() * up;
        let (mut at, mut left) = (p(start), length);
        let mut crossed = Vec::new();
        let mut door = start.next();
        loop {
            // The nearer of the doors ahead.
            let candidates = if crossed.is_empty() { vec![door] } else { vec![door.next(), door.previous()] };
            let hit = candidates
                .into_iter()
                .filter_map(|side| {
                    let (a, b) = (p(side), p(side.next()));
                    let edge = b - a;
                    let inward = p(side.previous()) - a;
                    let normal = (inward - inward.dot(edge) / edge.length_squared() * edge).normalize();
                    let rate = -heading.dot(normal);
                    (rate > 1e-14).then(|| ((at - a).dot(normal).max(0.0) / rate, side))
                })
                .min_by(|a, b| a.0.total_cmp(&b.0));
            // At the tip rounding lets it meet doors that end there.
            let Some((distance, side)) = hit.filter(|(distance, _)| *distance < left - 1e-8 * length) else {
                return (crossed, at + left * heading);
            };
            at += distance * heading;
            left -= distance;
            let Some(twin) = input.topology().twin(side) else { return (crossed, at) };
            crossed.push(side);
            let axis = (p(twin.next()) - p(twin)).normalize();
            let apex = p(twin.previous()) - p(twin);
            let into = (apex - apex.dot(axis) * axis).normalize();
            let straight = heading.dot(axis);
            heading = straight * axis + (1.0 - straight * straight).max(0.0).sqrt() * into;
            door = twin;
        }
    }
}
