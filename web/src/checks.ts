/** Arguments as JavaScript gives them: what is wrong with one is said by its name; WebAssembly would make something of it. */

function refuse(what: string, expected: string, value: unknown): never {
  const given = typeof value === 'string' ? JSON.stringify(value.slice(0, 40)) : Array.isArray(value) ? 'a list' : String(value);
  throw new TypeError(`${what} should be ${expected}, and is ${given}`);
}

/** A whole number that is not negative and has 32 bits. */
export function whole(value: unknown, what: string): number {
  if (typeof value === 'number' && Number.isInteger(value) && value >= 0 && value < 2 ** 32) return value;
  if (typeof value !== 'number') refuse(what, 'a whole number', value);
  throw new RangeError(`${what} should be a whole number from 0 to ${2 ** 32 - 1}, and is ${value}`);
}

/** A number, neither infinite nor NaN. */
export function finite(value: unknown, what: string): number {
  return typeof value === 'number' && Number.isFinite(value) ? value : refuse(what, 'a number', value);
}

/** A number, or nothing for what is usual. What numbers are lengths is for the extraction to say. */
export function lengthOrNothing(value: unknown): number | undefined {
  if (value === undefined || value === null) return undefined;
  return typeof value === 'number' ? value : refuse('the edge length', 'a number', value);
}

/** A text. */
export function text(value: unknown, what: string): string {
  return typeof value === 'string' ? value : refuse(what, 'a text', value);
}

/** The bytes of a file, of this window or another. */
export function bytesOf(value: unknown): Uint8Array {
  const isBytes = Object.prototype.toString.call(value) === '[object Uint8Array]';
  return isBytes ? (value as Uint8Array) : refuse('the file', 'a Uint8Array', value);
}
