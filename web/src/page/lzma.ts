/**
 * Decodes LZMA, as the 7-Zip SDK specifies it (Pavlov 2015): browsers have no decoder that packs WebAssembly as tightly, and
 * this one is smaller than what it saves.
 */

const [TOP, HALF] = [1 << 24, 1024];
/** Least lengths of matches, and lengths that the position slots tell apart. */
const [MIN_MATCH, LENGTH_STATES] = [2, 4];
const [END_SLOT, ALIGN_BITS] = [14, 4];

/**
 * Numbers of 32 bits are kept signed, so that engines keep them in registers: turned over by this bit they compare as unsigned
 * ones. That halves the time.
 */
const SIGN = 1 << 31;
const probabilities = (count: number) => new Uint16Array(count).fill(HALF);

/** The bytes of a file of LZMA (`.lzma`) whose header says how many there are. */
export function decodeLzma(data: Uint8Array): Uint8Array<ArrayBuffer> {
  const header = new DataView(data.buffer, data.byteOffset);
  const properties = data[0]!;
  const [lc, lp, pb] = [properties % 9, Math.floor(properties / 9) % 5, Math.floor(properties / 45)];
  const output = new Uint8Array(Number(header.getBigUint64(5, true)));
  let at = 18;
  let code = header.getUint32(14) | 0;
  let range = -1;

  const bit = (table: Uint16Array, index: number): number => {
    const probability = table[index]!;
    const bound = Math.imul(range >>> 11, probability);
    let value: number;
    if ((code ^ SIGN) < (bound ^ SIGN)) {
      range = bound;
      table[index] = probability + ((2048 - probability) >> 5);
      value = 0;
    } else {
      range = (range - bound) | 0;
      code = (code - bound) | 0;
      table[index] = probability - (probability >> 5);
      value = 1;
    }
    if ((range & ~(TOP - 1)) === 0) {
      range <<= 8;
      code = (code << 8) | data[at++]!;
    }
    return value;
  };
  const direct = (count: number): number => {
    let value = 0;
    for (; count > 0; count--) {
      range >>>= 1;
      const isOne = (code ^ SIGN) >= (range ^ SIGN) ? 1 : 0;
      if (isOne) code = (code - range) | 0;
      value = (value << 1) | isOne;
      if ((range & ~(TOP - 1)) === 0) {
        range <<= 8;
        code = (code << 8) | data[at++]!;
      }
    }
    return value >>> 0;
  };
  const tree = (table: Uint16Array, start: number, bits: number): number => {
    let node = 1;
    for (let i = 0; i < bits; i++) node = (node << 1) | bit(table, start + node);
    return node - (1 << bits);
  };
  const reversed = (table: Uint16Array, start: number, bits: number): number => {
    let [node, value] = [1, 0];
    for (let i = 0; i < bits; i++) {
      const next = bit(table, start + node);
      node = (node << 1) | next;
      value |= next << i;
    }
    return value;
  };
  const lengths = () => {
    const [choice, low, mid, high] = [probabilities(2), probabilities(16 << 3), probabilities(16 << 3), probabilities(256)];
    return (place: number): number => {
      if (!bit(choice, 0)) return tree(low, place << 3, 3);
      if (!bit(choice, 1)) return 8 + tree(mid, place << 3, 3);
      return 16 + tree(high, 0, 8);
    };
  };

  const literals = probabilities(0x300 << (lc + lp));
  const [isMatch, isRepeat] = [probabilities(12 << 4), probabilities(12)];
  const [isRepeat0, isRepeat1, isRepeat2, isLong] = [probabilities(12), probabilities(12), probabilities(12), probabilities(12 << 4)];
  const slots = probabilities(LENGTH_STATES << 6);
  const [near, align] = [probabilities(128), probabilities(1 << ALIGN_BITS)];
  const [matchLength, repeatLength] = [lengths(), lengths()];
  let [state, rep0, rep1, rep2, rep3] = [0, 0, 0, 0, 0];
  let written = 0;

  while (written < output.length) {
    const place = written & ((1 << pb) - 1);
    if (!bit(isMatch, (state << 4) + place)) {
      const before = written > 0 ? output[written - 1]! : 0;
      const start = 0x300 * (((written & ((1 << lp) - 1)) << lc) + (before >> (8 - lc)));
      let symbol = 1;
      if (state >= 7) {
        let matched = output[written - rep0 - 1]!;
        while (symbol < 0x100) {
          const expected = (matched >> 7) & 1;
          matched <<= 1;
          const found = bit(literals, start + ((1 + expected) << 8) + symbol);
          symbol = (symbol << 1) | found;
          if (expected !== found) break;
        }
      }
      while (symbol < 0x100) symbol = (symbol << 1) | bit(literals, start + symbol);
      output[written++] = symbol;
      state = state < 4 ? 0 : state < 10 ? state - 3 : state - 6;
      continue;
    }
    let length: number;
    if (bit(isRepeat, state)) {
      if (!bit(isRepeat0, state)) {
        if (!bit(isLong, (state << 4) + place)) {
          state = state < 7 ? 9 : 11;
          output[written] = output[written - rep0 - 1]!;
          written++;
          continue;
        }
      } else {
        let distance: number;
        if (!bit(isRepeat1, state)) distance = rep1;
        else {
          if (!bit(isRepeat2, state)) distance = rep2;
          else [distance, rep3] = [rep3, rep2];
          rep2 = rep1;
        }
        rep1 = rep0;
        rep0 = distance;
      }
      length = repeatLength(place);
      state = state < 7 ? 8 : 11;
    } else {
      [rep3, rep2, rep1] = [rep2, rep1, rep0];
      length = matchLength(place);
      state = state < 7 ? 7 : 10;
      const slot = tree(slots, Math.min(length, LENGTH_STATES - 1) << 6, 6);
      rep0 = slot;
      if (slot >= 4) {
        const bits = (slot >> 1) - 1;
        rep0 = (2 | (slot & 1)) << bits;
        if (slot < END_SLOT) rep0 += reversed(near, rep0 - slot, bits);
        else rep0 = (rep0 + (direct(bits - ALIGN_BITS) << ALIGN_BITS) + reversed(align, 0, ALIGN_BITS)) >>> 0;
      }
    }
    if (rep0 >= written) throw new Error('the page is damaged');
    const end = Math.min(written + length + MIN_MATCH, output.length);
    for (; written < end; written++) output[written] = output[written - rep0 - 1]!;
  }
  return output;
}
