//! The decoder: a range coder with adaptive probabilities, and what it tells of literals and of matches.

/// Bytes of the header, and of the beginning of the range coder after it.
const HEADER: usize = 13;
const CODER: usize = 5;

/// The least length of a match.
const MIN_MATCH: usize = 2;

/// A range below this takes another byte.
const TOP: u32 = 1 << 24;

/// Probabilities have eleven bits, and go a 32nd of the way to what they see.
const HALF: u16 = 1 << 10;
const PROBABILITY_BITS: u32 = 11;
const RATE: u32 = 5;

/// Low bits of far distances that have probabilities of their own.
const ALIGN_BITS: u32 = 4;
/// From this slot on, distances have bits that are as likely one as zero.
const FAR_SLOT: u32 = 14;

/// The range coder.
struct Coder<'a> {
    data: &'a [u8],
    at: usize,
    range: u32,
    code: u32,
}

impl Coder<'_> {
    #[inline(always)]
    fn normalise(&mut self) {
        if self.range < TOP {
            self.range <<= 8;
            self.code = self.code << 8 | u32::from(self.data.get(self.at).copied().unwrap_or(0));
            self.at += 1;
        }
    }

    #[inline(always)]
    fn bit(&mut self, probability: &mut u16) -> usize {
        let bound = (self.range >> PROBABILITY_BITS) * u32::from(*probability);
        let is_one = self.code >= bound;
        if is_one {
            self.range -= bound;
            self.code -= bound;
            *probability -= *probability >> RATE;
        } else {
            self.range = bound;
            *probability += ((1 << PROBABILITY_BITS) - *probability) >> RATE;
        }
        self.normalise();
        usize::from(is_one)
    }

    /// Bits that are as likely one as zero.
    fn direct(&mut self, count: u32) -> u32 {
        (0..count).fold(0, |value, _| {
            self.range >>= 1;
            let is_one = self.code >= self.range;
            if is_one {
                self.code -= self.range;
            }
            self.normalise();
            value << 1 | u32::from(is_one)
        })
    }

    /// A number whose bits, from the highest on, go down a binary tree of probabilities.
    fn tree(&mut self, tree: &mut [u16], bits: u32) -> usize {
        (0..bits).fold(1, |node, _| node << 1 | self.bit(&mut tree[node])) - (1 << bits)
    }

    /// The same from the lowest bit on.
    fn reversed(&mut self, tree: &mut [u16], bits: u32) -> u32 {
        let (mut node, mut value) = (1, 0);
        for i in 0..bits {
            let bit = self.bit(&mut tree[node]);
            node = node << 1 | bit;
            value |= (bit as u32) << i;
        }
        value
    }
}

/// Lengths of matches.
struct Lengths {
    choice: [u16; 2],
    low: [[u16; 8]; 16],
    mid: [[u16; 8]; 16],
    high: [u16; 256],
}

impl Lengths {
    fn new() -> Self {
        Self { choice: [HALF; 2], low: [[HALF; 8]; 16], mid: [[HALF; 8]; 16], high: [HALF; 256] }
    }

    fn next(&mut self, coder: &mut Coder<'_>, place: usize) -> usize {
        if coder.bit(&mut self.choice[0]) == 0 {
            coder.tree(&mut self.low[place], 3)
        } else if coder.bit(&mut self.choice[1]) == 0 {
            8 + coder.tree(&mut self.mid[place], 3)
        } else {
            16 + coder.tree(&mut self.high, 8)
        }
    }
}

/// Decodes a whole file. Nothing where it is damaged.
pub(crate) fn decode(data: &[u8]) -> Option<Vec<u8>> {
    let properties = usize::from(*data.first()?);
    let [lc, lp, pb] = [properties % 9, properties / 9 % 5, properties / 45];
    let length = u64::from_le_bytes(data.get(5..HEADER)?.try_into().ok()?);
    let length = usize::try_from(length).ok().filter(|&length| length < 1 << 28)?;
    let code = u32::from_be_bytes(data.get(HEADER + 1..HEADER + CODER)?.try_into().ok()?);
    let mut coder = Coder { data, at: HEADER + CODER, range: u32::MAX, code };
    let mut out: Vec<u8> = Vec::with_capacity(length);

    let mut literals = vec![[HALF; 0x300]; 1 << (lc + lp)];
    let (mut is_match, mut is_long) = ([[HALF; 16]; 12], [[HALF; 16]; 12]);
    let (mut is_repeat, mut is_other) = ([HALF; 12], [[HALF; 12]; 3]);
    let mut slots = [[HALF; 64]; 4];
    let (mut near, mut align) = ([HALF; 128], [HALF; 1 << ALIGN_BITS]);
    let (mut match_length, mut repeat_length) = (Lengths::new(), Lengths::new());
    let mut state = 0;
    let mut distances = [0; 4];

    while out.len() < length {
        let place = out.len() & ((1 << pb) - 1);
        if coder.bit(&mut is_match[state][place]) == 0 {
            let before = usize::from(out.last().copied().unwrap_or(0));
            let context = (out.len() & ((1 << lp) - 1)) << lc | before >> (8 - lc);
            let table = literals.get_mut(context)?;
            let mut symbol = 1;
            if state >= 7 {
                let mut matched = usize::from(*out.get(out.len().checked_sub(distances[0] + 1)?)?);
                while symbol < 0x100 {
                    matched <<= 1;
                    let expected = matched & 0x100;
                    let bit = coder.bit(&mut table[0x100 + expected + symbol]);
                    symbol = symbol << 1 | bit;
                    if expected >> 8 != bit {
                        break;
                    }
                }
            }
            while symbol < 0x100 {
                symbol = symbol << 1 | coder.bit(&mut table[symbol]);
            }
            out.push(symbol as u8);
            state = match state {
                0..4 => 0,
                4..10 => state - 3,
                _ => state - 6,
            };
            continue;
        }
        let count;
        if coder.bit(&mut is_repeat[state]) == 1 {
            if coder.bit(&mut is_other[0][state]) == 0 {
                if coder.bit(&mut is_long[state][place]) == 0 {
                    state = if state < 7 { 9 } else { 11 };
                    out.push(*out.get(out.len().checked_sub(distances[0] + 1)?)?);
                    continue;
                }
            } else {
                let which = if coder.bit(&mut is_other[1][state]) == 0 {
                    1
                } else {
                    2 + coder.bit(&mut is_other[2][state])
                };
                distances[..=which].rotate_right(1);
            }
            count = repeat_length.next(&mut coder, place);
            state = if state < 7 { 8 } else { 11 };
        } else {
            distances.rotate_right(1);
            count = match_length.next(&mut coder, place);
            state = if state < 7 { 7 } else { 10 };
            distances[0] = distance(&mut coder, &mut slots[count.min(3)], &mut near, &mut align) as usize;
        }
        let from = out.len().checked_sub(distances[0].checked_add(1)?)?;
        for i in from..from + (count + MIN_MATCH).min(length - out.len()) {
            out.push(out[i]);
        }
    }
    Some(out)
}

/// How far back a match lies, less one.
fn distance(coder: &mut Coder<'_>, slots: &mut [u16; 64], near: &mut [u16; 128], align: &mut [u16]) -> u32 {
    let slot = coder.tree(slots, 6) as u32;
    if slot < 4 {
        return slot;
    }
    let bits = (slot >> 1) - 1;
    let base = (2 | slot & 1) << bits;
    if slot < FAR_SLOT {
        return base + coder.reversed(&mut near[(base - slot) as usize..], bits);
    }
    base.wrapping_add(coder.direct(bits - ALIGN_BITS) << ALIGN_BITS)
        .wrapping_add(coder.reversed(align, ALIGN_BITS))
}
