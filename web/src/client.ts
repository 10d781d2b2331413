import type { Method, Opening, Request, Response, Result } from './protocol.js';
import type {
  Description, ExtractOptions, Extracted, FileFormat, GeodesicPath, Modes, NamedValues, OpenOptions, Report, Triangles,
} from './types.js';

/** How a Worker is come by, and what it opens first. */
export interface WorkerOptions extends OpenOptions {
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
  #opening!: Promise<Description>;
  #description!: Description;
  /** How the mesh that is computed on was extracted. */
  #extraction: Opening['extraction'];
  /** Why nothing is answered any more. */
  #ended: Error | undefined;

  private constructor(bytes: Uint8Array, name: string, options: WorkerOptions) {
    this.#options = options;
    this.#opened = { bytes, name };
    this.#start();
  }

  /** Opens an `.ndf` model, or a mesh (OBJ, PLY, STL, OFF, glTF), in a Worker of its own. */
  static async open(bytes: Uint8Array, name = 'the file', options: WorkerOptions = {}): Promise<WorkerSurface> {
    const surface = new WorkerSurface(bytes, name, options);
    try {
      surface.#description = await surface.#opening;
    } catch (error) {
      surface.free();
      throw error;
    }
    return surface;
  }

  #start(): void {
    const worker = (this.#options.worker ?? besideThis)();
    this.#worker = worker;
    const opening = this.#next;
    worker.onmessage = ({ data }: MessageEvent<Response>) => {
      const waiting = this.#waiting.get(data.id);
      this.#waiting.delete(data.id);
      if (!('error' in data)) return waiting?.resolve(data.result);
      const error = new Error(data.error);
      waiting?.reject(error);
      if (!data.isTrapped) return;
      // What cannot even be opened would trap again.
      if (data.id === opening) this.#end(error);
      else this.#restart(error);
    };
    worker.onerror = (event) => this.#end(new Error(event.message || 'the Worker could not be started'));
    const { wasm, coarse = false } = this.#options;
    const open = { ...this.#opened, wasm, options: { coarse }, extraction: this.#extraction };
    this.#opening = this.#send({ open }) as Promise<Description>;
    // Whoever calls a method hears of it there.
    this.#opening.catch(() => undefined);
  }

  /** Takes the Worker from those who wait. */
  #stop(error: Error): void {
    this.#worker.terminate();
    const waiting = [...this.#waiting.values()];
    this.#waiting.clear();
    waiting.forEach(({ reject }) => reject(error));
  }

  #restart(error: Error): void {
    if (this.#ended) return;
    this.#stop(error);
    this.#start();
  }

  #end(error: Error): void {
    this.#stop(error);
    this.#ended ??= error;
  }

  #send(content: DistributiveOmit<Request, 'id'>): Promise<unknown> {
    if (this.#ended) return Promise.reject(this.#ended);
    const id = this.#next++;
    return new Promise((resolve, reject) => {
      this.#waiting.set(id, { resolve, reject });
      this.#worker.postMessage({ id, ...content });
    });
  }

  #call<M extends Method>(method: M, ...given: unknown[]): Promise<Result<M>> {
    return this.#send({ method, arguments: given }) as Promise<Result<M>>;
  }

  /** Whether something runs or waits. */
  get isBusy(): boolean {
    return this.#waiting.size > 0;
  }

  /** Gives up all that runs or waits ({@link Abandoned}); the mesh stays the one that was last extracted to the end. */
  abandon(): void {
    this.#restart(new Abandoned());
  }

  /** What was opened, with the mesh of the beginning. */
  get description(): Description {
    return this.#description;
  }

  describe(): Promise<Description> {
    return this.#call('describe');
  }

  async extract(edgeLength?: number, options?: ExtractOptions): Promise<Extracted> {
    const extracted = await this.#call('extract', edgeLength, options);
    this.#extraction = [edgeLength, { ...options, report: false }];
    return extracted;
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

  /** Ends the Worker: what runs or waits is given up ({@link Abandoned}), and so is what is called later. */
  free(): void {
    this.#end(new Abandoned());
  }
}

type DistributiveOmit<T, K extends keyof T> = T extends unknown ? Omit<T, K> : never;
