import type { Surface } from './surface.js';

/** The methods of a surface that a Worker answers. */
export type Method = 'describe' | 'extract' | 'mesh' | 'positions' | 'report' | 'geodesic' | 'path' | 'modes' | 'scalar' | 'file';

/** What is sent to a Worker: first the WebAssembly and the surface, then calls of its methods. */
export type Request =
  | { id: number; open: { wasm?: WebAssembly.Module | undefined; bytes: Uint8Array; name: string } }
  | { id: number; method: Method; arguments: unknown[] };

/** What a Worker answers. */
export type Response = { id: number; result: unknown } | { id: number; error: string };

/** What a method of a surface gives. */
export type Result<M extends Method> = ReturnType<Surface[M]>;
