import type { Surface } from './surface.js';
import type { OpenOptions } from './types.js';

/** The methods of a surface that a Worker answers. */
export type Method = 'describe' | 'extract' | 'mesh' | 'positions' | 'report' | 'geodesic' | 'path' | 'modes' | 'scalar' | 'file';

/** What a Worker opens. */
export interface Opening {
  wasm: WebAssembly.Module | undefined;
  bytes: Uint8Array;
  name: string;
  options: OpenOptions;
  /** How the mesh that is computed on was extracted, where another Worker did that. */
  extraction: Parameters<Surface['extract']> | undefined;
}

/** What is sent to a Worker: first the WebAssembly and the surface, then calls of its methods. */
export type Request =
  | { id: number; open: Opening }
  | { id: number; method: Method; arguments: unknown[] };

/** What a Worker answers; after a trap its WebAssembly is of no more use. */
export type Response = { id: number; result: unknown } | { id: number; error: string; isTrapped: boolean };

/** What a method of a surface gives. */
export type Result<M extends Method> = ReturnType<Surface[M]>;
