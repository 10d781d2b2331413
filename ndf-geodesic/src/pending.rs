//! The windows of the wavefront: a list for every half-edge that has any, in buffers that are used again.

use ndf_mesh::Halfedge;

use crate::envelope::merge;
use crate::windows::Window;

/// Stands for a half-edge without windows.
const NONE: u32 = u32::MAX;
/// Stands for a half-edge whose windows are lent.
const LENT: u32 = u32::MAX - 1;

/// Windows that wait at one half-edge, sorted and disjoint.
pub(crate) struct Waiting {
    pub(crate) windows: Vec<Window>,
    /// No more than the least distance of the windows.
    nearest: f64,
    /// The distance at which the front has the half-edge; +∞ if it has not.
    announced: f64,
}

impl Waiting {
    fn in_buffer(windows: Vec<Window>) -> Self {
        Self { windows, nearest: f64::INFINITY, announced: f64::INFINITY }
    }

    /// Adds windows, sorted and disjoint. `merged` is a buffer.
    pub(crate) fn add(&mut self, windows: &[Window], merged: &mut Vec<Window>) {
        self.nearest = windows.iter().map(Window::nearest).fold(self.nearest, f64::min);
        if self.windows.is_empty() {
            self.windows.extend_from_slice(windows);
        } else if !windows.is_empty() {
            merge(&self.windows, windows, merged);
            std::mem::swap(&mut self.windows, merged);
        }
    }
}

/// Windows that wait at half-edges. Memory: four bytes a half-edge and the windows of the front.
pub(crate) struct Pending {
    slot_of: Vec<u32>,
    slots: Vec<Waiting>,
    free: Vec<u32>,
    buffers: Vec<Vec<Window>>,
    merged: Vec<Window>,
    /// Windows that wait now.
    pub(crate) waiting: usize,
    /// The most that ever waited at once.
    pub(crate) peak: usize,
}

impl Pending {
    pub(crate) fn new(halfedges: usize) -> Self {
        Self {
            slot_of: vec![NONE; halfedges],
            slots: Vec::new(),
            free: Vec::new(),
            buffers: Vec::new(),
            merged: Vec::new(),
            waiting: 0,
            peak: 0,
        }
    }

    /// Lets sorted, disjoint windows wait at a half-edge, merged with those there. Returns the least distance of those there
    /// if the front does not know it.
    pub(crate) fn add(&mut self, halfedge: Halfedge, windows: &[Window]) -> Option<f64> {
        let mut all = self.lend(halfedge);
        all.add(windows, &mut self.merged);
        self.put(halfedge, all)
    }

    /// Takes the windows of a half-edge away, if there are any.
    pub(crate) fn take(&mut self, halfedge: Halfedge) -> Option<Waiting> {
        let slot = self.slot_of[halfedge.index()];
        if slot >= LENT {
            return None;
        }
        self.slot_of[halfedge.index()] = NONE;
        self.free.push(slot);
        let empty = Waiting::in_buffer(Vec::new());
        let waiting = std::mem::replace(&mut self.slots[slot as usize], empty);
        self.waiting -= waiting.windows.len();
        Some(waiting)
    }

    /// Takes the windows of a half-edge, or no windows, to add others and to [`put`](Self::put) all back. What is lent a second
    /// time before that is empty.
    pub(crate) fn lend(&mut self, halfedge: Halfedge) -> Waiting {
        let waiting = self.take(halfedge);
        self.slot_of[halfedge.index()] = LENT;
        waiting.unwrap_or_else(|| Waiting::in_buffer(self.buffers.pop().unwrap_or_default()))
    }

    /// Puts windows at a half-edge that were lent. Returns the least distance of those there if the front does not know it.
    pub(crate) fn put(&mut self, halfedge: Halfedge, mut waiting: Waiting) -> Option<f64> {
        let slot = &mut self.slot_of[halfedge.index()];
        if *slot < LENT {
            // Lent twice.
            let mut merged = std::mem::take(&mut self.merged);
            let mut all = self.lend(halfedge);
            all.add(&waiting.windows, &mut merged);
            self.merged = merged;
            self.recycle(waiting);
            return self.put(halfedge, all);
        }
        if waiting.windows.is_empty() {
            *slot = NONE;
            self.recycle(waiting);
            return None;
        }
        self.waiting += waiting.windows.len();
        self.peak = self.peak.max(self.waiting);
        let news = (waiting.nearest < waiting.announced).then_some(waiting.nearest);
        waiting.announced = waiting.nearest;
        *slot = if let Some(free) = self.free.pop() {
            self.slots[free as usize] = waiting;
            free
        } else {
            self.slots.push(waiting);
            self.slots.len() as u32 - 1
        };
        news
    }

    /// Takes back the buffer of a list.
    pub(crate) fn recycle(&mut self, waiting: Waiting) {
        let mut buffer = waiting.windows;
        buffer.clear();
        self.buffers.push(buffer);
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        let lists = self.slots.iter().map(|slot| &slot.windows).chain(&self.buffers);
        4 * (self.slot_of.len() + self.free.len())
            + size_of::<Waiting>() * self.slots.len()
            + lists
                .map(|list| list.capacity() * size_of::<Window>() + size_of::<Vec<Window>>())
                .sum::<usize>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window(start: f64, depth: f64) -> Window {
        Window { start, end: start + 1.0, x: start + 0.5, depth, offset: 0.0, root: 0 }
    }

    #[test]
    fn what_is_lent_twice_is_merged_and_told_once() {
        let mut pending = Pending::new(6);
        let h = Halfedge(4);
        assert_eq!(pending.add(h, &[window(0.0, 3.0)]), Some(3.0));
        let (mut first, mut second) = (pending.lend(h), pending.lend(h));
        assert_eq!((first.windows.len(), second.windows.len(), pending.waiting), (1, 0, 0));
        let mut buffer = Vec::new();
        first.add(&[window(1.0, 4.0)], &mut buffer);
        second.add(&[window(2.0, 2.0)], &mut buffer);
        assert_eq!(pending.put(h, first), None, "the front knows of a nearer one");
        assert_eq!(pending.put(h, second), Some(2.0));
        let all = pending.take(h).expect("windows");
        assert_eq!(all.windows, [window(0.0, 3.0), window(1.0, 4.0), window(2.0, 2.0)]);
        assert!(pending.take(h).is_none());
        pending.recycle(all);
        let none = pending.lend(h);
        assert_eq!(pending.put(h, none), None);
        assert!(pending.take(h).is_none(), "nothing waits");
    }
}
