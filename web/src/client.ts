import type { Method, Request, Response, Result } from './protocol.js';
import type {
  Description, ExtractOptions, Extracted, FileFormat, GeodesicPath, Modes, NamedValues, Report, Triangles,
} from './types.js';

/** How a Worker is come by. */
export interface WorkerOptions {
  /** Makes the Worker; by default from the file beside this module. */
  worker?: () => Worker;
  /** The compiled WebAssembly; by default the Worker loads the file beside it. */
  wasm?: WebAssembly.Module;
}

/** The work was given up for the sake of other work. */
export class Abandoned extends Error {
  constructor() {
    super('given up');
    this.name = 'Abandoned';
  }
}

interface Waiting {
  resolve(result: unknown): void;
  reject(error: Error): void;
}

const besideThis = () => new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });

/**
 * A {@link Surface} in a Worker: the same methods, each a promise. They run one after the other; {@link WorkerSurface.abandon}
 * gives up what runs, so that something more urgent need not wait.
 */
export class WorkerSurface {
  #options: WorkerOptions;
  #opened: { bytes: Uint8Array; name: string };
  #worker!: Worker;
  #waiting = new Map<number, Waiting>();
  #next = 0;
  #description!: Promise<Description>;

  private constructor(bytes: Uint8Array, name: string, options: WorkerOptions) {
    this.#options = options;
    this.#opened = { bytes, name };
    this.#start();
  }

  /** Opens an `.ndf` model, or a mesh (OBJ, PLY, STL, OFF, glTF), in a Worker of its own. */
  static async open(bytes: Uint8Array, name = 'the file', options: WorkerOptions = {}): Promise<WorkerSurface> {
    const surface = new WorkerSurface(bytes, name, options);
    try {
      await surface.#description;
    } catch (error) {
      surface.free();
      throw error;
    }
    return surface;
  }

  #start(): void {
    const worker = (this.#options.worker ?? besideThis)();
    this.#worker = worker;
    worker.onmessage = ({ data }: MessageEvent<Response>) => {
      const waiting = this.#waiting.get(data.id);
      this.#waiting.delete(data.id);
      if ('error' in data) waiting?.reject(new Error(data.error));
      else waiting?.resolve(data.result);
    };
    worker.onerror = (event) => this.#fail(new Error(event.message || 'the Worker could not be started'));
    const { bytes, name } = this.#opened;
    this.#description = this.#send({ open: { wasm: this.#options.wasm, bytes, name } }) as Promise<Description>;
    // Whoever calls a method hears of it there.
    this.#description.catch(() => undefined);
  }

  #send(content: DistributiveOmit<Request, 'id'>): Promise<unknown> {
    const id = this.#next++;
    return new Promise((resolve, reject) => {
      this.#waiting.set(id, { resolve, reject });
      this.#worker.postMessage({ id, ...content });
    });
  }

  #fail(error: Error): void {
    const waiting = [...this.#waiting.values()];
    this.#waiting.clear();
    waiting.forEach(({ reject }) => reject(error));
  }

  #call<M extends Method>(method: M, ...given: unknown[]): Promise<Result<M>> {
    return this.#send({ method, arguments: given }) as Promise<Result<M>>;
  }

  /** Whether something runs or waits. */
  get isBusy(): boolean {
    return this.#waiting.size > 0;
  }

  /** Gives up all that runs or waits ({@link Abandoned}) and starts afresh; the mesh is again the one of the beginning. */
  abandon(): void {
    this.#worker.terminate();
    this.#fail(new Abandoned());
    this.#start();
  }

  describe(): Promise<Description> {
    return this.#call('describe');
  }

  extract(edgeLength?: number, options?: ExtractOptions): Promise<Extracted> {
    return this.#call('extract', edgeLength, options);
  }

  mesh(): Promise<Triangles> {
    return this.#call('mesh');
  }

  positions(): Promise<Float64Array> {
    return this.#call('positions');
  }

  report(): Promise<Report> {
    return this.#call('report');
  }

  geodesic(vertex: number): Promise<Float32Array> {
    return this.#call('geodesic', vertex);
  }

  path(from: number, to: number): Promise<GeodesicPath> {
    return this.#call('path', from, to);
  }

  modes(count: number): Promise<Modes> {
    return this.#call('modes', count);
  }

  scalar(name: string): Promise<Float32Array> {
    return this.#call('scalar', name);
  }

  file(format: FileFormat, further?: NamedValues): Promise<Uint8Array> {
    return this.#call('file', format, further);
  }

  async exportGLB(): Promise<ArrayBuffer> {
    return (await this.file('glb')).buffer as ArrayBuffer;
  }

  async exportPLY(): Promise<ArrayBuffer> {
    return (await this.file('ply')).buffer as ArrayBuffer;
  }

  /** Ends the Worker. */
  free(): void {
    this.#worker.terminate();
    this.#fail(new Abandoned());
  }
}

type DistributiveOmit<T, K extends keyof T> = T extends unknown ? Omit<T, K> : never;
