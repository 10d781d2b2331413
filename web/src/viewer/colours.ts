/** Values to colours: the perceptually even scales of matplotlib, and ColorBrewer's blue and red. */

/** Evenly spaced stops, six hexadecimal digits each. */
const SCALES = {
  viridis: '440154472d7b3b528b2c728e21918c28ae805ec962addc30fde725',
  cividis: '00224e1235703b496c575d6d7071738a8678a59c74c3b369e1cc55fee838',
  magma: '000004180f3d440f76721f819e2f7fcd4071f1605dfd9668feca8dfcfdbf',
  redblue: '0530612166ac4393c392c5ded1e5f0f7f7f7fddbc7f4a582d6604db2182b67001f',
} as const;

/** The scales there are; `auto` is red and blue where values lie on both sides of zero, and viridis otherwise. */
export type Colormap = keyof typeof SCALES | 'auto';

/** The names of all scales. */
export const COLORMAPS = ['auto', ...Object.keys(SCALES)] as Colormap[];

/** A scale over a range. */
export interface ColourScale {
  low: number;
  high: number;
  map: keyof typeof SCALES;
}

/** The scale over the finite ones of these values. A range well to both sides of zero is made symmetric. */
export function scaleOf(values: Float32Array, wanted: Colormap): ColourScale {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (!Number.isFinite(value)) continue;
    if (value < low) low = value;
    if (value > high) high = value;
  }
  if (low > high) [low, high] = [0, 0];
  const greatest = Math.max(high, -low);
  const isBothSides = low < 0 && high > 0 && Math.min(-low, high) > 0.1 * greatest;
  const map = wanted === 'auto' ? (isBothSides ? 'redblue' : 'viridis') : wanted;
  return map === 'redblue' && isBothSides ? { low: -greatest, high: greatest, map } : { low, high, map };
}

/** The colours of a scale as bytes of sRGB, `count` times four. */
export function colours(map: ColourScale['map'], count: number): Uint8Array {
  const stops = SCALES[map].match(/../g)!.map((byte) => parseInt(byte, 16));
  const last = stops.length / 3 - 1;
  const bytes = new Uint8Array(4 * count);
  for (let i = 0; i < count; i++) {
    const x = (i / (count - 1)) * last;
    const k = Math.min(Math.floor(x), last - 1);
    for (let c = 0; c < 3; c++) {
      const [a, b] = [stops[3 * k + c]!, stops[3 * k + 3 + c]!];
      bytes[4 * i + c] = Math.round(a + (b - a) * (x - k));
    }
    bytes[4 * i + 3] = 255;
  }
  return bytes;
}

/** A scale as a gradient of CSS, from the left to the right. */
export function gradient(map: ColourScale['map']): string {
  const stops = SCALES[map].match(/.{6}/g)!.map((stop) => `#${stop}`);
  return `linear-gradient(to right, ${stops.join(', ')})`;
}

/** A round number near to a share of a range: 1, 2 or 5 times a power of ten. */
export function roundStep(step: number): number {
  if (!(step > 0) || !Number.isFinite(step)) return 0;
  const power = 10 ** Math.floor(Math.log10(step));
  const digit = [1, 2, 5, 10].find((digit) => digit * power >= 0.999 * step) ?? 10;
  return digit * power;
}

/** A number with four digits, as people read it. */
export function readable(x: number): string {
  if (!Number.isFinite(x)) return x > 0 ? '∞' : x < 0 ? '−∞' : '–';
  const size = Math.abs(x);
  if (x !== 0 && (size >= 1e6 || size < 1e-3)) return x.toExponential(2).replace('-', '−').replace('e+', 'e');
  return x.toLocaleString('en', { maximumSignificantDigits: 4 }).replace('-', '−');
}
