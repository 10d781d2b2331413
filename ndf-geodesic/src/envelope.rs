//! Lists of windows on one half-edge: disjoint intervals from tail to tip, nearest windows only.

use crate::windows::{Survivors, TIE, Window, comes_from_left, crossed, divide, divide_unordered};

/// Appends a window that comes after all of `list[from..]` in the order of windows, and trims the end of the
/// list and the window against one another.
#[inline]
pub(crate) fn push_ordered(list: &mut Vec<Window>, from: usize, mut window: Window) {
    while list.len() > from {
        let last = list.len() - 1;
        let left = &mut list[last];
        if left.end <= window.start {
            break;
        }
        let survivors =
            if window.end <= left.start { crossed(left, &window) } else { divide(left, &mut window) };
        match survivors {
            Survivors::Both if window.start < list[last].end => {
                // Crossed rays that tie: keep the list sorted and lose nothing.
                let at = list[from..].partition_point(|w| w.start < window.start) + from;
                list.insert(at, window);
                return;
            }
            Survivors::Both => break,
            Survivors::Left => return,
            Survivors::Right => {
                list.pop();
            }
        }
    }
    list.push(window);
}

/// The nearest windows of two lists, sorted. `merged` is overwritten.
pub(crate) fn merge(a: &[Window], b: &[Window], merged: &mut Vec<Window>) {
    merged.clear();
    let (mut i, mut j) = (0, 0);
    while i < a.len() || j < b.len() {
        let next_is_a = j == b.len() || (i < a.len() && a[i].start <= b[j].start);
        let window = if next_is_a { a[i] } else { b[j] };
        if next_is_a {
            i += 1;
        } else {
            j += 1;
        }
        insert_last(merged, window);
    }
}

/// Adds a window that starts no earlier than those of the list did before they were trimmed.
#[inline]
fn insert_last(list: &mut Vec<Window>, mut window: Window) {
    // Windows of the list that come after the new one; they are put back on top of it.
    let mut position = list.len();
    while position > 0 {
        let other = &mut list[position - 1];
        if other.end <= window.start {
            break;
        }
        if window.end <= other.start {
            position -= 1;
            continue;
        }
        let middle = 0.5 * (other.start.max(window.start) + other.end.min(window.end));
        let order = comes_from_left(other, &window, middle);
        let survivors = match order {
            Some(true) => divide(other, &mut window),
            Some(false) => divide(&mut window, other),
            None => divide_unordered(other, &mut window),
        };
        let other_alone = if order == Some(false) { Survivors::Right } else { Survivors::Left };
        if survivors == other_alone {
            return;
        } else if survivors != Survivors::Both {
            list.remove(position - 1);
        } else if other.start < window.start {
            break;
        }
        position -= 1;
    }
    if position == list.len() {
        list.push(window);
    } else {
        list.insert(position, window);
    }
}

/// Cuts from the front of the list what a path over the vertex at the half-edge's tail makes superfluous,
/// `distance` being the tail's. The vertex comes before all windows in their order, so its wins are a prefix.
/// Returns how many windows are gone.
pub(crate) fn cut_by_tail(list: &mut [Window], distance: f64) -> usize {
    let mut gone = 0;
    for w in list.iter_mut() {
        if distance + w.end < w.at(w.end) * (1.0 - TIE) {
            gone += 1;
            continue;
        }
        if distance + w.start < w.at(w.start) * (1.0 - TIE) {
            // distance + x = offset + |x − p|, squared, is linear in x.
            let c = distance - w.offset;
            let x = (w.x * w.x + w.depth * w.depth - c * c) / (2.0 * (c + w.x));
            if x > w.start && x < w.end {
                w.start = x;
            }
        }
        break;
    }
    gone
}

/// The mirror of [`cut_by_tail`]: cuts from the end what a path over the tip makes superfluous. Returns how
/// many windows remain.
pub(crate) fn cut_by_tip(list: &mut [Window], length: f64, distance: f64) -> usize {
    let mut kept = list.len();
    for w in list.iter_mut().rev() {
        if distance + (length - w.start) < w.at(w.start) * (1.0 - TIE) {
            kept -= 1;
            continue;
        }
        if distance + (length - w.end) < w.at(w.end) * (1.0 - TIE) {
            let c = distance - w.offset;
            let p = length - w.x;
            let x = length - (p * p + w.depth * w.depth - c * c) / (2.0 * (c + p));
            if x > w.start && x < w.end {
                w.end = x;
            }
        }
        break;
    }
    kept
}

/// Cuts from the front what a path over a vertex to the left of all windows' strips, straight through the
/// face, makes superfluous; `rival` is that path as a window on the same half-edge. Returns how many windows
/// are gone.
pub(crate) fn cut_by_left_rival(list: &mut [Window], rival: &Window) -> usize {
    let mut gone = 0;
    for w in list.iter_mut() {
        if rival.at(w.end) < w.at(w.end) * (1.0 - TIE) {
            gone += 1;
            continue;
        }
        let mut rival = Window { start: w.start, end: w.end, ..*rival };
        if rival.at(w.start) < w.at(w.start) * (1.0 - TIE) {
            divide(&mut rival, w);
            if w.is_narrow() {
                gone += 1;
                continue;
            }
        }
        break;
    }
    gone
}

/// The mirror of [`cut_by_left_rival`]. Returns how many windows remain.
pub(crate) fn cut_by_right_rival(list: &mut [Window], rival: &Window) -> usize {
    let mut kept = list.len();
    for w in list.iter_mut().rev() {
        if rival.at(w.start) < w.at(w.start) * (1.0 - TIE) {
            kept -= 1;
            continue;
        }
        let mut rival = Window { start: w.start, end: w.end, ..*rival };
        if rival.at(w.end) < w.at(w.end) * (1.0 - TIE) {
            divide(w, &mut rival);
            if w.is_narrow() {
                kept -= 1;
                continue;
            }
        }
        break;
    }
    kept
}
