//! A second structure for the same thing, by other means: every half-edge keeps its length and its direction, as an
//! angle in the tangent plane of its tail (Sharp, Soliman and Crane 2019, §3). No integers, no normal coordinates:
//! where an edge runs over the input is found by walking from its tail by its angle and length, in space.

use ndf_core::DVec3;
use ndf_mesh::ManifoldMesh;

/// Directions at the vertices of an input mesh, and an intrinsic triangulation of it that follows flips.
pub(crate) struct Signposts<'m> {
    input: &'m ManifoldMesh,
    /// Angle around each input vertex.
    sums: Vec<f64>,
    /// Direction of every input half-edge, counter-clockwise from the first of the fan, in true angle.
    input_directions: Vec<f64>,
    tails: Vec<u32>,
    twins: Vec<Option<u32>>,
    lengths: Vec<f64>,
    directions: Vec<f64>,
}

fn angle(a: f64, b: f64, opposite: f64) -> f64 {
    ((a * a + b * b - opposite * opposite) / (2.0 * a * b)).clamp(-1.0, 1.0).acos()
}

impl<'m> Signposts<'m> {
    pub(crate) fn new(input: &'m ManifoldMesh) -> Self {
        let count = input.topology().halfedge_count() as u32;
        let p = input.positions();
        let lengths: Vec<f64> = (0..count)
            .map(|h| p[input.topology().tail(h) as usize].distance(p[input.topology().tip(h) as usize]))
            .collect();
        let corner = |h: u32| {
            let (next, last) = (input.topology().next(h), input.topology().previous(h));
            angle(lengths[h as usize], lengths[last as usize], lengths[next as usize])
        };
        let mut sums = vec![0.0; p.len()];
        let mut directions = vec![0.0; count as usize];
        for v in 0..p.len() as u32 {
            for h in input.topology().outgoing(v) {
                directions[h as usize] = sums[v as usize];
                sums[v as usize] += corner(h);
            }
        }
        Self {
            input,
            sums,
            input_directions: directions.clone(),
            tails: (0..count).map(|h| input.topology().tail(h)).collect(),
            twins: (0..count).map(|h| input.topology().twin(h)).collect(),
            lengths,
            directions,
        }
    }

    fn next(h: u32) -> u32 {
        h / 3 * 3 + (h + 1) % 3
    }

    fn corner(&self, h: u32) -> f64 {
        let (next, last) = (Self::next(h), Self::next(Self::next(h)));
        angle(self.lengths[h as usize], self.lengths[last as usize], self.lengths[next as usize])
    }

    pub(crate) fn tail(&self, h: u32) -> u32 {
        self.tails[h as usize]
    }

    pub(crate) fn length(&self, h: u32) -> f64 {
        self.lengths[h as usize]
    }

    /// Flips the edge of a half-edge, i → j between k on its left and l on its right; the caller knows that it can
    /// be. Slots are filled as the other structure fills them, so that half-edges have the same numbers.
    pub(crate) fn flip(&mut self, h: u32) {
        let t = self.twins[h as usize].expect("an inner edge");
        let (hn, tn) = (Self::next(h), Self::next(t));
        let (hp, tp) = (Self::next(hn), Self::next(tn));
        let [jk, ki, il, lj] = [hn, hp, tn, tp].map(|h| self.lengths[h as usize]);
        let turn = self.corner(h) + self.corner(tn);
        let length = (ki * ki + il * il - 2.0 * ki * il * turn.cos()).max(0.0).sqrt();
        // The new edge leaves k counter-clockwise of k → i, and l of l → j.
        let from_k = self.turned(hp, angle(ki, length, il));
        let from_l = self.turned(tp, angle(lj, length, jk));
        let (k, l) = (self.tails[hp as usize], self.tails[tp as usize]);
        self.relocate(hn, t);
        self.relocate(tn, h);
        for (slot, twin, tail, direction) in [(hn, tn, l, from_l), (tn, hn, k, from_k)] {
            self.tails[slot as usize] = tail;
            self.twins[slot as usize] = Some(twin);
            self.lengths[slot as usize] = length;
            self.directions[slot as usize] = direction;
        }
    }

    /// The direction at an angle counter-clockwise of a half-edge.
    fn turned(&self, h: u32, by: f64) -> f64 {
        let v = self.tails[h as usize];
        let (direction, sum) = (self.directions[h as usize] + by, self.sums[v as usize]);
        if direction >= sum && !self.input.topology().is_boundary_vertex(v) {
            direction - sum
        } else {
            direction
        }
    }

    fn relocate(&mut self, from: u32, to: u32) {
        let (from, to) = (from as usize, to as usize);
        self.tails[to] = self.tails[from];
        self.lengths[to] = self.lengths[from];
        self.directions[to] = self.directions[from];
        self.twins[to] = self.twins[from];
        if let Some(twin) = self.twins[to] {
            self.twins[twin as usize] = Some(to as u32);
        }
    }

    /// The input half-edges that a half-edge crosses, by a straight walk in its direction, and where it ends.
    pub(crate) fn trace(&self, h: u32) -> (Vec<u32>, DVec3) {
        let (input, v) = (self.input, self.tails[h as usize]);
        let (direction, length) = (self.directions[h as usize], self.lengths[h as usize]);
        // The corner of the fan it leaves by.
        let fan: Vec<u32> = input.topology().outgoing(v).collect();
        let start = *fan
            .iter()
            .rev()
            .find(|&&out| self.input_directions[out as usize] <= direction + 1e-9)
            .unwrap_or(&fan[0]);
        let turn = direction - self.input_directions[start as usize];
        let p = |h: u32| input.positions()[input.topology().tail(h) as usize];
        // In the plane of the face: its first half-edge along x.
        let along = (p(input.topology().next(start)) - p(start)).normalize();
        let third = p(input.topology().previous(start)) - p(start);
        let up = (third - third.dot(along) * along).normalize();
        let mut heading = turn.cos() * along + turn.sin() * up;
        let (mut at, mut left) = (p(start), length);
        let mut crossed = Vec::new();
        let mut door = input.topology().next(start);
        loop {
            // The nearer of the doors ahead.
            let candidates = if crossed.is_empty() {
                vec![door]
            } else {
                vec![input.topology().next(door), input.topology().previous(door)]
            };
            let hit = candidates
                .into_iter()
                .filter_map(|side| {
                    let (a, b) = (p(side), p(input.topology().next(side)));
                    let edge = b - a;
                    let inward = p(input.topology().previous(side)) - a;
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
            let axis = (p(input.topology().next(twin)) - p(twin)).normalize();
            let apex = p(input.topology().previous(twin)) - p(twin);
            let into = (apex - apex.dot(axis) * axis).normalize();
            let straight = heading.dot(axis);
            heading = straight * axis + (1.0 - straight * straight).max(0.0).sqrt() * into;
            door = twin;
        }
    }
}
