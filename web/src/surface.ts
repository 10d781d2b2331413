import initialise, { Surface as Native } from './wasm/ndf_web.js';
import { bytesOf, lengthOrNothing, text, whole } from './checks.js';
import type {
  Description, ExtractOptions, Extracted, FileFormat, GeodesicPath, Modes, NamedValues, OpenOptions, Report, Triangles, WasmSource,
} from './types.js';

let ready: Promise<void> | undefined;

/** The WebAssembly beside this module. In Node, where files are read and not fetched, no import says so to bundlers. */
function besideThis(): WasmSource {
  const url = new URL('./wasm/ndf_web_bg.wasm', import.meta.url);
  const isNode = typeof process !== 'undefined' && process.versions?.node !== undefined;
  return isNode && url.protocol === 'file:' ? process.getBuiltinModule('node:fs').readFileSync(url) : url;
}

async function load(source: WasmSource | undefined): Promise<void> {
  try {
    await initialise({ module_or_path: await (source ?? besideThis()) });
  } catch (error) {
    // The next call may have a better source, or a better network.
    ready = undefined;
    throw error;
  }
}

/** Loads the WebAssembly, once: the source of the first call counts, unless it fails. Everything else waits for it. */
export function init(source?: WasmSource): Promise<void> {
  return (ready ??= load(source));
}

/**
 * A model or a mesh that was opened, and the mesh that is computed on: that of the file, or the one that was last extracted.
 * All of it runs in the calling thread; {@link WorkerSurface} is the same in a Worker.
 */
export class Surface {
  readonly #native: Native;
  #seconds: number;

  private constructor(native: Native, seconds: number) {
    this.#native = native;
    this.#seconds = seconds;
  }

  /** Opens an `.ndf` model, or a mesh (OBJ, PLY, STL, OFF, glTF). The content decides; the name stands in messages. */
  static async open(bytes: Uint8Array, name = 'the file', options: OpenOptions = {}): Promise<Surface> {
    await init();
    return Surface.openNow(bytes, name, options);
  }

  /** As {@link Surface.open}, after {@link init}. */
  static openNow(bytes: Uint8Array, name = 'the file', { coarse = false }: OpenOptions = {}): Surface {
    const started = performance.now();
    const native = new Native(bytesOf(bytes), text(name, 'the name'), coarse);
    return new Surface(native, (performance.now() - started) / 1000);
  }

  /** What was opened. */
  describe(): Description {
    return JSON.parse(this.#native.describe()) as Description;
  }

  /** Extracts another mesh of a model: with the default edge length, or this one in the units of the file. */
  extract(edgeLength?: number, options: ExtractOptions = {}): Extracted {
    const started = performance.now();
    this.#native.extract(lengthOrNothing(edgeLength), options.relative ?? false);
    this.#seconds = (performance.now() - started) / 1000;
    const mesh = this.mesh();
    const report = options.report === false
      ? { vertices: mesh.vertices.length / 3, faces: mesh.faces.length / 3, seconds: this.#seconds }
      : this.report();
    return { ...mesh, report, ...(options.positions && { positions: this.positions() }) };
  }

  /** The mesh that is computed on. */
  mesh(): Triangles {
    return { vertices: this.#native.vertices(), faces: this.#native.faces() };
  }

  /** The positions of the vertices in double precision. */
  positions(): Float64Array {
    return this.#native.positions();
  }

  /** What is true of the mesh. */
  report(): Report {
    return { ...(JSON.parse(this.#native.report()) as Report), seconds: this.#seconds };
  }

  /** Exact geodesic distances of all vertices from one; infinite where it does not reach. */
  geodesic(vertex: number): Float32Array {
    return this.#native.distances(whole(vertex, 'a vertex'));
  }

  /** The shortest path between two vertices. */
  path(from: number, to: number): GeodesicPath {
    const found = this.#native.path(whole(from, 'a vertex'), whole(to, 'a vertex'));
    try {
      return { points: found.points, length: found.length };
    } finally {
      found.free();
    }
  }

  /** The first modes of the Laplacian, the constant one among them. */
  modes(count: number): Modes {
    const found = this.#native.modes(whole(count, 'the number of modes'));
    try {
      const [values, all] = [found.values, found.functions];
      const vertices = all.length / count;
      const functions = Array.from(values, (_, i) => all.slice(i * vertices, (i + 1) * vertices));
      return { values, functions };
    } finally {
      found.free();
    }
  }

  /** The values of a stored scalar at the vertices. */
  scalar(name: string): Float32Array {
    return this.#native.scalar(text(name, 'the name of a scalar'));
  }

  /** The mesh as a file, with its stored scalars and these. */
  file(format: FileFormat, further?: NamedValues): Uint8Array {
    return this.#native.file(text(format, 'the format'), further?.name, further?.values ?? new Float32Array());
  }

  /** The mesh as binary glTF. */
  exportGLB(): ArrayBuffer {
    return this.file('glb').buffer as ArrayBuffer;
  }

  /** The mesh as PLY. */
  exportPLY(): ArrayBuffer {
    return this.file('ply').buffer as ArrayBuffer;
  }

  /** Gives the memory back. */
  free(): void {
    this.#native.free();
  }
}
