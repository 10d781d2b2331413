import { Abandoned, type WorkerSurface } from '../client.js';
import type { Description, Extracted, Report } from '../types.js';
import type { Looks } from './looks.js';

/** A mesh to be shown. */
export type Shown = Extracted & { positions: Float64Array };

/** An edge length, in the units of the file or in the model's box; nothing for the default. */
export interface Length {
  length?: number | undefined;
  /** Whether it is in the model's box. */
  relative?: boolean;
  /** Whether it stays, and is not dragged on. */
  isFinal?: boolean;
}

/** An edge length that was asked for, and whoever waits for its mesh. */
interface Wanted extends Required<Length> {
  resolve(mesh: Extracted): void;
  reject(error: unknown): void;
}

/** What shows the meshes. */
export interface Screen {
  /** The surface that is open. */
  surface(): WorkerSurface | undefined;
  description(): Description | undefined;
  busy<T>(what: string, work: () => Promise<T>): Promise<T>;
  /** What is shown, on another mesh. */
  looksOn(surface: WorkerSurface, mesh: Shown, isShort: boolean): Promise<Looks>;
  show(mesh: Shown, looks: Looks): void;
  /** Takes what is true of the mesh that is shown. */
  learn(report: Report, description: Description | undefined): void;
  /** After a failure: nothing else is waited for. */
  failed(): void;
}

/** Seconds that a mesh may take while the edge length is being dragged. */
const DRAG_SECONDS = 0.06;

/** Extractions, one after the other: of the edge lengths that were asked for meanwhile only the last. */
export class Extractions {
  readonly #screen: Screen;
  #wanted: Wanted | undefined;
  #isRunning = false;
  #asked: number | undefined;
  #settled: number | undefined;
  #isCoarse = false;
  /** Seconds of an extraction for edges of unit length: they grow as the square of the fineness. */
  #effort = 0;

  constructor(screen: Screen) {
    this.#screen = screen;
  }

  /** The edge length that was asked for last, in the units of the file, until its mesh is shown. */
  get asked(): number | undefined {
    return this.#asked;
  }

  /** The edge length of the last mesh that was not one for dragging. */
  get settled(): number | undefined {
    return this.#settled;
  }

  /** Gives up what is wanted, and begins with a mesh that, if it is coarse, is only there until a finer one is. */
  reset(isCoarse: boolean): void {
    this.#wanted?.reject(new Abandoned());
    this.#wanted = this.#asked = this.#settled = undefined;
    this.#effort = 0;
    this.#isCoarse = isCoarse;
  }

  /** Whether an edge length waits for the one that is under way. */
  get isWanted(): boolean {
    return this.#wanted !== undefined;
  }

  /** Extracts and shows a mesh. What is overtaken rejects ({@link Abandoned}). */
  ask({ length, relative = false, isFinal = true }: Length): Promise<Extracted> {
    this.#wanted?.reject(new Abandoned());
    this.#asked = length === undefined ? undefined : this.#inUnits(length, relative);
    return new Promise((resolve, reject) => {
      this.#wanted = { length, relative, isFinal, resolve, reject };
      void this.#run();
    });
  }

  #inUnits(length: number, relative: boolean): number {
    return relative ? length * (this.#screen.description()?.scale ?? 1) : length;
  }

  async #run(): Promise<void> {
    if (this.#isRunning) return;
    this.#isRunning = true;
    while (this.#wanted) {
      const wanted = this.#wanted;
      this.#wanted = undefined;
      const work = () => this.#extract(wanted);
      try {
        wanted.resolve(await (wanted.isFinal ? this.#screen.busy('extracting', work) : work()));
      } catch (error) {
        if (wanted.isFinal && !(error instanceof Abandoned)) await this.#goBack();
        wanted.reject(error);
      }
    }
    this.#isRunning = false;
  }

  /** After a failure: shows what was shown before the edge length was dragged. */
  async #goBack(): Promise<void> {
    if (this.#wanted) return;
    this.#asked = undefined;
    const length = this.#settled;
    if (this.#isCoarse && length !== undefined) {
      const work = () => this.#extract({ length, relative: false, isFinal: true });
      // If there is not even that, what is shown stays.
      await this.#screen.busy('extracting', work).catch(() => undefined);
    }
    this.#screen.failed();
  }

  async #extract({ length, relative, isFinal }: Required<Length>): Promise<Extracted> {
    const screen = this.#screen;
    const surface = screen.surface();
    const goesOn = () => {
      if (surface !== screen.surface() || (isFinal && this.#wanted)) throw new Abandoned();
    };
    if (!surface) throw new Error('no surface is open');
    const { default_edge_length: usual, base_edge_length: base } = screen.description()!;
    const wanted = length === undefined ? usual : this.#inUnits(length, relative);
    // Extraction begins with the base mesh: what is coarser takes no less time.
    const coarsest = Math.min(Math.sqrt(this.#effort / DRAG_SECONDS), base ?? Infinity);
    const used = isFinal || wanted === null ? length : Math.max(wanted, coarsest);
    const found = (await surface.extract(used, { report: false, relative: relative && isFinal, positions: true })) as Shown;
    goesOn();
    const target = (isFinal ? wanted : used) ?? undefined;
    if (target !== undefined) found.report.target_edge_length = target;
    const started = performance.now();
    const looks = await screen.looksOn(surface, found, !isFinal);
    goesOn();
    const seconds = found.report.seconds + (performance.now() - started) / 1000;
    if (target !== undefined) this.#effort = seconds * target * target;
    this.#isCoarse = !isFinal;
    if (isFinal) this.#asked = undefined;
    screen.show(found, looks);
    if (!isFinal) return found;
    this.#settled = target;
    // What was estimated from the coarse mesh of the beginning is known better.
    const isFirst = screen.description() === surface.description;
    const [report, description] = await Promise.all([surface.report(), isFirst ? surface.describe() : screen.description()]);
    goesOn();
    found.report = report;
    screen.learn(report, description);
    return found;
  }
}
