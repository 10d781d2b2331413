//! The windows of the wavefront: a list for every half-edge that has any, in buffers that are used again.

use ndf_mesh::Halfedge;

use crate::envelope::merge;
use crate::windows::Window;

/// Stands for a half-edge without windows.
const NO_SLOT: u32 = u32::MAX;

/// Windows that wait at half-edges. Memory: four bytes a half-edge and the windows of the front.
pub(crate) struct Pending {
    slot_of: Vec<u32>,
    slots: Vec<Vec<Window>>,
    /// The least distance of every slot's windows so far.
    nearest: Vec<f64>,
    free: Vec<u32>,
    merged: Vec<Window>,
    /// Windows that wait now.
    pub(crate) waiting: usize,
    /// The most that ever waited at once.
    pub(crate) peak: usize,
}

impl Pending {
    pub(crate) fn new(halfedges: usize) -> Self {
        Self {
            slot_of: vec![NO_SLOT; halfedges],
            slots: Vec::new(),
            nearest: Vec::new(),
            free: Vec::new(),
            merged: Vec::new(),
            waiting: 0,
            peak: 0,
        }
    }

    /// Lets sorted, disjoint windows wait at a half-edge, merged with those there. Returns whether none there
    /// was as near as their `nearest`.
    pub(crate) fn add(&mut self, halfedge: Halfedge, windows: &[Window], nearest: f64) -> bool {
        let slot = &mut self.slot_of[halfedge.index()];
        if *slot == NO_SLOT {
            *slot = self.free.pop().unwrap_or_else(|| {
                self.slots.push(Vec::new());
                self.nearest.push(0.0);
                self.slots.len() as u32 - 1
            });
            self.nearest[*slot as usize] = f64::INFINITY;
            self.slots[*slot as usize].extend_from_slice(windows);
            self.waiting += windows.len();
        } else {
            let list = &mut self.slots[*slot as usize];
            merge(list, windows, &mut self.merged);
            self.waiting = self.waiting + self.merged.len() - list.len();
            std::mem::swap(list, &mut self.merged);
        }
        self.peak = self.peak.max(self.waiting);
        let before = &mut self.nearest[*slot as usize];
        let nearer = nearest < *before;
        *before = before.min(nearest);
        nearer
    }

    /// Takes the windows of a half-edge away; to be given back, as a buffer, with [`recycle`](Self::recycle).
    pub(crate) fn take(&mut self, halfedge: Halfedge) -> Option<(u32, Vec<Window>)> {
        let slot = std::mem::replace(&mut self.slot_of[halfedge.index()], NO_SLOT);
        if slot == NO_SLOT {
            return None;
        }
        let list = std::mem::take(&mut self.slots[slot as usize]);
        self.waiting -= list.len();
        Some((slot, list))
    }

    /// Takes back the buffer of a list.
    pub(crate) fn recycle(&mut self, slot: u32, mut list: Vec<Window>) {
        list.clear();
        self.slots[slot as usize] = list;
        self.free.push(slot);
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        4 * (self.slot_of.len() + self.free.len())
            + self
                .slots
                .iter()
                .map(|s| s.capacity() * size_of::<Window>() + size_of::<Vec<Window>>())
                .sum::<usize>()
    }
}
