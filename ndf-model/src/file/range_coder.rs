//! An adaptive binary range coder (Martin 1979, in the carry-counting form of the LZMA coder) and the integer models
//! on top of it.
//!
//! Every decision has its own estimate of how probable a 0 is, learned from the decisions already coded by both sides
//! alike. All arithmetic is on integers: the same bytes mean the same numbers on every machine.

/// Probabilities are kept as integers of 2²⁴ and used as integers of 2¹⁶, these at least this far from 0 and from 1.
const MARGIN: u32 = 32;
const ONE: i32 = 1 << 24;
/// Decisions after which an estimate forgets the oldest.
const MEMORY: i32 = 254;
/// Below this, the range is widened by a byte.
const NARROW: u32 = 1 << 24;

/// The probability of a decision, as estimated so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bit {
    /// That of a 0, of 2²⁴.
    zero: i32,
    seen: i32,
}

impl Bit {
    pub(super) const NEW: Self = Self { zero: ONE / 2, seen: 0 };

    /// Range of a 0.
    fn split(self, range: u32) -> u32 {
        (range >> 16) * (self.zero as u32 >> 8).clamp(MARGIN, (1 << 16) - MARGIN)
    }

    /// The running mean of the first decisions, then an exponential one.
    fn learn(&mut self, bit: bool) {
        let target = if bit { 0 } else { ONE };
        self.zero += (target - self.zero) / (self.seen + 2);
        self.seen = (self.seen + 1).min(MEMORY);
    }
}

/// Either side of the coder. What is coded is described once, for both: the encoder is given the values and hands them
/// back, the decoder ignores those it is given and hands back what it reads.
pub(super) trait Coder {
    /// A decision of which `model` estimates the probability.
    fn bit(&mut self, model: &mut Bit, value: bool) -> bool;

    /// `count` ≤ 32 bits that are as good as random, the highest first.
    fn plain_bits(&mut self, count: u32, value: u32) -> u32;

    /// Whether bytes that should have been there were missing.
    fn is_exhausted(&self) -> bool {
        false
    }
}

/// Writes decisions.
#[derive(Clone, Debug)]
pub(super) struct Encoder {
    /// The lower end of the range, with the carry in bit 32.
    low: u64,
    range: u32,
    /// The last byte that may still be changed by a carry, and how many 0xff follow it.
    pending: u8,
    runs: usize,
    is_first: bool,
    bytes: Vec<u8>,
}

impl Encoder {
    pub(super) fn new() -> Self {
        Self { low: 0, range: u32::MAX, pending: 0, runs: 0, is_first: true, bytes: Vec::new() }
    }

    fn shift(&mut self) {
        if self.low < 0xff00_0000 || self.low > 0xffff_ffff {
            let carry = (self.low >> 32) as u8;
            if !self.is_first {
                self.bytes.push(self.pending.wrapping_add(carry));
            }
            self.is_first = false;
            self.bytes.extend(std::iter::repeat_n(0xff_u8.wrapping_add(carry), self.runs));
            self.runs = 0;
            self.pending = (self.low >> 24) as u8;
        } else {
            self.runs += 1;
        }
        self.low = (self.low & 0x00ff_ffff) << 8;
    }

    fn widen(&mut self) {
        while self.range < NARROW {
            self.range <<= 8;
            self.shift();
        }
    }

    /// The bytes of all decisions. Of the last bytes, [`MAX_MISSING`] at most, zeros are left out: the decoder reads
    /// zeros there anyway.
    pub(super) fn finish(mut self) -> Vec<u8> {
        for _ in 0..5 {
            self.shift();
        }
        for _ in 0..MAX_MISSING {
            self.bytes.pop_if(|byte| *byte == 0);
        }
        self.bytes
    }
}

impl Coder for Encoder {
    fn bit(&mut self, model: &mut Bit, value: bool) -> bool {
        let split = model.split(self.range);
        if value {
            self.low += u64::from(split);
            self.range -= split;
        } else {
            self.range = split;
        }
        self.widen();
        model.learn(value);
        value
    }

    fn plain_bits(&mut self, count: u32, value: u32) -> u32 {
        for i in (0..count).rev() {
            self.range >>= 1;
            if value >> i & 1 == 1 {
                self.low += u64::from(self.range);
            }
            self.widen();
        }
        value
    }
}

/// Reads decisions. Behind the end there are zeros.
pub(super) struct Decoder<'a> {
    bytes: &'a [u8],
    /// Position of the code in the range.
    code: u32,
    range: u32,
    /// Bytes read behind the end.
    missing: usize,
}

/// Zeros an encoder may leave out at its end.
const MAX_MISSING: usize = 4;

impl<'a> Decoder<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        let mut decoder = Self { bytes, code: 0, range: u32::MAX, missing: 0 };
        for _ in 0..4 {
            decoder.shift();
        }
        decoder
    }

    /// Whether the bytes that were not read are zeros.
    pub(super) fn has_only_zeros(&self) -> bool {
        self.bytes.iter().all(|&byte| byte == 0)
    }

    /// Whether all bytes were read: the encoder writes none that the decoder does not need.
    pub(super) fn is_spent(&self) -> bool {
        self.bytes.is_empty()
    }

    fn shift(&mut self) {
        let byte = match self.bytes.split_first() {
            Some((&byte, rest)) => {
                self.bytes = rest;
                byte
            }
            None => {
                self.missing += 1;
                0
            }
        };
        self.code = self.code << 8 | u32::from(byte);
    }

    fn widen(&mut self) {
        while self.range < NARROW {
            self.range <<= 8;
            self.shift();
        }
    }
}

impl Coder for Decoder<'_> {
    fn bit(&mut self, model: &mut Bit, _: bool) -> bool {
        let split = model.split(self.range);
        let value = self.code >= split;
        if value {
            self.code -= split;
            self.range -= split;
        } else {
            self.range = split;
        }
        self.widen();
        model.learn(value);
        value
    }

    fn plain_bits(&mut self, count: u32, _: u32) -> u32 {
        let mut value = 0;
        for _ in 0..count {
            self.range >>= 1;
            let bit = self.code >= self.range;
            if bit {
                self.code -= self.range;
            }
            value = value << 1 | u32::from(bit);
            self.widen();
        }
        value
    }

    fn is_exhausted(&self) -> bool {
        self.missing > MAX_MISSING
    }
}

/// Bits behind the leading one of which the probabilities are learned; those behind are plain.
const LEARNED_BITS: u32 = 3;
const CLASSES: usize = 32;

/// A distribution of integers: the number of bits of the magnitude (five decisions, a binary tree), the sign, and the
/// bits behind the leading one.
#[derive(Clone)]
pub(super) struct Integers {
    class: [Bit; CLASSES],
    sign: [Bit; CLASSES],
    /// Of every class, a tree of the bits behind the leading one.
    mantissa: [[Bit; 1 << LEARNED_BITS]; CLASSES],
}

impl Integers {
    pub(super) fn new() -> Self {
        Self {
            class: [Bit::NEW; CLASSES],
            sign: [Bit::NEW; CLASSES],
            mantissa: [[Bit::NEW; 1 << LEARNED_BITS]; CLASSES],
        }
    }

    /// Codes an integer of magnitude less than 2³¹.
    pub(super) fn code(&mut self, coder: &mut impl Coder, value: i32) -> i32 {
        let magnitude = value.unsigned_abs();
        let bits = tree(coder, &mut self.class, 5, u32::BITS - magnitude.leading_zeros());
        if bits == 0 {
            return 0;
        }
        let class = bits as usize;
        let negative = coder.bit(&mut self.sign[class], value < 0);
        let behind = bits - 1;
        let learned = behind.min(LEARNED_BITS);
        let plain = behind - learned;
        let rest = magnitude & ((1_u32 << behind) - 1);
        let high = tree(coder, &mut self.mantissa[class], learned, rest >> plain);
        let low = coder.plain_bits(plain, rest & ((1_u32 << plain) - 1));
        let magnitude = (1_u32 << behind | high << plain | low) as i32;
        if negative { -magnitude } else { magnitude }
    }
}

/// Codes `count` bits, the highest first, each in the light of those before it.
fn tree(coder: &mut impl Coder, models: &mut [Bit], count: u32, value: u32) -> u32 {
    let mut node = 1;
    for i in (0..count).rev() {
        let bit = coder.bit(&mut models[node as usize], value >> i & 1 == 1);
        node = node << 1 | u32::from(bit);
    }
    node - (1 << count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    fn encoded(values: &[i32]) -> Vec<u8> {
        let (mut encoder, mut model) = (Encoder::new(), Integers::new());
        for &value in values {
            model.code(&mut encoder, value);
        }
        encoder.finish()
    }

    fn decoded(bytes: &[u8], count: usize) -> Vec<i32> {
        let (mut decoder, mut model) = (Decoder::new(bytes), Integers::new());
        let values = (0..count).map(|_| model.code(&mut decoder, 0)).collect();
        assert!(!decoder.is_exhausted() && decoder.is_spent());
        values
    }

    #[test]
    fn integers_of_all_sizes_come_back() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for round in 0..200 {
            let shift = rng.random_range(0..32);
            let count = rng.random_range(0..400);
            let mut values: Vec<i32> = (0..count).map(|_| rng.random::<i32>() >> shift).collect();
            values.retain(|v| *v != i32::MIN);
            values.extend([0, 1, -1, i32::MAX, -i32::MAX].iter().take(round % 6));
            assert_eq!(decoded(&encoded(&values), values.len()), values);
        }
    }

    /// Two-sided geometric and uniform distributions, to within three per cent of their entropies.
    #[test]
    fn sizes_are_near_the_entropy() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        for p in [0.02, 0.1, 0.5, 0.9] {
            let n = 20_000;
            let geometric = |rng: &mut ChaCha8Rng| {
                let mut k = 0;
                while rng.random_bool(1.0 - p) {
                    k += 1;
                }
                k
            };
            let values: Vec<i32> = (0..n).map(|_| geometric(&mut rng) - geometric(&mut rng)).collect();
            let mut counts = std::collections::BTreeMap::new();
            values.iter().for_each(|v| *counts.entry(v).or_insert(0.0) += 1.0);
            let entropy: f64 = counts.values().map(|c: &f64| -c * (c / f64::from(n)).log2()).sum();
            let bits = 8.0 * encoded(&values).len() as f64;
            assert!(bits < 1.03 * entropy + 300.0, "p = {p}: {bits} bits, entropy {entropy}");
        }
    }

    #[test]
    fn long_runs_of_the_probable_cost_next_to_nothing_and_carries_are_carried() {
        assert!(encoded(&[0; 100_000]).len() < 200);
        let values = [vec![-1; 5000], vec![i32::MAX; 3], vec![-1; 5000]].concat();
        assert_eq!(decoded(&encoded(&values), values.len()), values);
    }

    #[test]
    fn reading_behind_the_end_is_noticed() {
        let bytes = encoded(&(0..100).collect::<Vec<_>>());
        let (mut decoder, mut model) = (Decoder::new(&bytes[..50]), Integers::new());
        for _ in 0..100 {
            model.code(&mut decoder, 0);
        }
        assert!(decoder.is_exhausted());
    }
}
