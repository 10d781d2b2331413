import { Vector3 } from 'three';
import { Abandoned, WorkerSurface, type WorkerOptions } from '../client.js';
import type { Description, Extracted, FileFormat, GeodesicPath, Modes, NamedValues, Report } from '../types.js';
import { COLORMAPS, gradient, readable, roundStep, scaleOf, type Colormap } from './colours.js';
import { Stage, type Theme, type Up } from './stage.js';
import { STYLE } from './style.js';

/** What the colours of the surface mean. */
export type View =
  | { kind: 'plain' }
  | { kind: 'distance' }
  | { kind: 'mode'; index: number }
  | { kind: 'scalar'; name: string };

/** A mesh to be shown. */
type Shown = Extracted & { positions: Float64Array };

/** A file, and the length of the edges it is shown with. */
interface Opened {
  bytes: Uint8Array;
  name: string;
  edgeLength?: number | undefined;
}

/** An edge length that was asked for, and whoever waits for its mesh. */
interface Wanted {
  length: number | undefined;
  relative: boolean;
  isFinal: boolean;
  resolve(mesh: Extracted): void;
  reject(error: unknown): void;
}

/** How many modes are computed when the first is asked for. */
export const MODES = 20;

/** Seconds an extraction may take while the edge length is being dragged. */
const DRAG_SECONDS = 0.06;

/** Isolines in a picture of distances, about. */
const ISOLINES = 24;

const THEMES: Record<'light' | 'dark', Theme> = {
  light: { background: '#f3f4f6', surface: '#b4c0cf', wire: '#1d2733', mark: '#d3263a' },
  dark: { background: '#111418', surface: '#8d9bad', wire: '#e8eef6', mark: '#ff5a5f' },
};

/** What an element tells of itself. */
export interface ViewerEvents {
  /** Something was shown. */
  'ndf-change': CustomEvent<void>;
  /** Work began or ended; `detail` says what is being computed, or nothing. */
  'ndf-busy': CustomEvent<string | undefined>;
  /** Something failed; `detail` says why. */
  'ndf-error': CustomEvent<string>;
}

/**
 * `<ndf-viewer src="bunny.ndf" edge-length="0.02" source="12" colormap="auto">`: a model or a mesh to turn, with exact
 * distances from the vertex that is clicked. Without a `src`, {@link NdfViewer.open} shows bytes. All computing runs in one
 * Worker.
 */
export class NdfViewer extends HTMLElement {
  static readonly observedAttributes = ['src', 'edge-length', 'source', 'colormap', 'up', 'wireframe'];

  /** How elements come by their Workers; for pages that are one file. */
  static workerOptions: WorkerOptions = {};

  #stage: Stage | undefined;
  #surface: WorkerSurface | undefined;
  #description: Description | undefined;
  #file: Opened | undefined;
  /** Counts what was opened: only the last is shown. */
  #openings = 0;
  #report: Report | undefined;
  #view: View = { kind: 'plain' };
  #source: number | undefined;
  #target: number | undefined;
  #path: GeodesicPath | undefined;
  #values: NamedValues | undefined;
  #modes: { count: number; found: Promise<Modes> } | undefined;
  /** Counts what was asked for, so that answers to earlier questions are not shown. */
  #asked = 0;
  #wanted: Wanted | undefined;
  #isExtracting = false;
  /** Seconds of an extraction for edges of unit length: they grow as the square of the fineness. */
  #effort = 0;
  #readied = new Set<() => void>();
  readonly #canvas: HTMLCanvasElement;
  readonly #legend: HTMLElement;
  readonly #message: HTMLElement;
  readonly #resizing = new ResizeObserver(() => this.#stage?.resize());
  readonly #darkness = matchMedia('(prefers-color-scheme: dark)');

  constructor() {
    super();
    const root = this.attachShadow({ mode: 'open' });
    root.innerHTML = `<style>${STYLE}</style>
      <canvas tabindex="0" role="application" aria-label="A surface: arrow keys turn it, plus and minus zoom, Enter picks its middle"></canvas>
      <div class="legend" role="img" hidden><div class="name"></div><div class="bar"></div><div class="ends"><span></span><span></span></div></div>
      <div class="message" role="alert" hidden></div>`;
    this.#canvas = root.querySelector('canvas')!;
    this.#legend = root.querySelector('.legend')!;
    this.#message = root.querySelector('.message')!;
    this.#listen();
  }

  connectedCallback(): void {
    try {
      this.#stage ??= new Stage(this.#canvas);
    } catch {
      this.#say('This page needs WebGL 2, which this browser does not give. Another browser, or hardware acceleration switched on in its settings, may.');
      return;
    }
    this.#setTheme();
    this.#darkness.addEventListener('change', this.#setTheme);
    this.#resizing.observe(this);
    const up = this.getAttribute('up');
    if (up) this.up = up as Up;
    this.wireframe = this.hasAttribute('wireframe');
    if (this.#file) void this.#begin(this.#file);
    else if (this.hasAttribute('src')) void this.#begin(this.#fetched());
  }

  disconnectedCallback(): void {
    this.#darkness.removeEventListener('change', this.#setTheme);
    this.#resizing.disconnect();
    // It is opened again as it was.
    if (this.#file && this.#report) this.#file = { ...this.#file, edgeLength: this.#report.target_edge_length };
    this.#close();
    this.#stage?.dispose();
    this.#stage = undefined;
  }

  /** Gives up what is asked of the surface, and the surface. */
  #close(): void {
    this.#wanted?.reject(new Abandoned());
    this.#wanted = undefined;
    this.#surface?.free();
    this.#surface = undefined;
  }

  attributeChangedCallback(name: string, before: string | null, after: string | null): void {
    if (before === after) return;
    if (name === 'src' && !this.isConnected) this.#file = undefined;
    if (!this.isConnected || !this.#stage) return;
    if (name === 'src' && after !== null) void this.#begin(this.#fetched());
    // Before anything is open they are only noted: opening reads them.
    if (name === 'edge-length' && after !== null && this.#surface) this.#try(this.setEdgeLength(Number(after)));
    if (name === 'source' && after !== null && this.#surface) this.#try(this.showDistances(Number(after)));
    if (name === 'colormap') this.#paint();
    if (name === 'up' && after !== null) this.up = after as Up;
    if (name === 'wireframe') this.wireframe = after !== null;
  }

  /** Reports a failure as an event as well: for calls that nobody waits for. */
  #try(work: Promise<unknown>): void {
    work.catch((error: unknown) => this.#tell(error));
  }

  #tell(error: unknown): void {
    if (error instanceof Abandoned) return;
    const message = error instanceof Error ? error.message : String(error);
    this.dispatchEvent(new CustomEvent('ndf-error', { detail: message }));
  }

  async #fetched(): Promise<Opened> {
    const src = this.getAttribute('src')!;
    const response = await fetch(src);
    if (!response.ok) throw new Error(`${src}: the server answers ${response.status}`);
    const name = src.split(/[?#]/, 1)[0]!.split('/').pop() ?? src;
    return { bytes: new Uint8Array(await response.arrayBuffer()), name };
  }

  /** Opens a file that nobody waits for, unless another is opened or the element is taken away while it comes. */
  async #begin(file: Opened | Promise<Opened>): Promise<void> {
    const opening = ++this.#openings;
    try {
      const come = await file;
      if (opening !== this.#openings || !this.isConnected) return;
      await this.#open(opening, come);
      const source = this.getAttribute('source');
      if (source !== null) await this.showDistances(Number(source));
    } catch (error) {
      if (error instanceof Abandoned || opening !== this.#openings) return;
      this.#say(error instanceof Error ? error.message : String(error));
    }
  }

  #say(message: string | undefined): void {
    this.#message.textContent = message ?? '';
    this.#message.hidden = message === undefined;
    if (message) this.dispatchEvent(new CustomEvent('ndf-error', { detail: message }));
  }

  #setTheme = (): void => {
    const theme = { ...THEMES[this.#darkness.matches ? 'dark' : 'light'] };
    const style = getComputedStyle(this);
    for (const key of Object.keys(theme) as (keyof Theme)[]) {
      theme[key] = style.getPropertyValue(`--ndf-${key}`).trim() || theme[key];
    }
    if (this.#stage) this.#stage.theme = theme;
  };

  /**
   * Shows a model or a mesh, a model with edges of this length or of that of the attribute. The file is kept for
   * {@link NdfViewer.bytes}, and shown once the element is in a document. Of several that are being opened the last is shown;
   * the others reject ({@link Abandoned}).
   */
  open(bytes: Uint8Array, name: string, { edgeLength }: { edgeLength?: number | undefined } = {}): Promise<Description> {
    return this.#open(++this.#openings, { bytes, name, edgeLength });
  }

  #open(opening: number, file: Opened): Promise<Description> {
    const { bytes, name, edgeLength } = file;
    return this.#busy('opening', async () => {
      const surface = await WorkerSurface.open(bytes, name, NdfViewer.workerOptions);
      try {
        const length = edgeLength ?? Number(this.getAttribute('edge-length'));
        const mesh = await firstMesh(surface, length);
        if (opening !== this.#openings) throw new Abandoned();
        this.#close();
        this.#file = file;
        this.#description = surface.description;
        this.#report = undefined;
        this.#view = { kind: 'plain' };
        this.#effort = 0;
        if (this.isConnected) this.#surface = surface;
        // Connection opens it again.
        else surface.free();
        if (this.#stage) this.#say(undefined);
        await this.#shown(mesh, false);
      } catch (error) {
        surface.free();
        throw error;
      }
      if (this.isConnected) {
        this.#readied.forEach((resolve) => resolve());
        this.#readied.clear();
      }
      return surface.description;
    });
  }

  /** Resolves when a surface is shown. */
  get ready(): Promise<void> {
    if (this.#report) return Promise.resolve();
    return new Promise((resolve) => this.#readied.add(resolve));
  }

  /** What is open. */
  get description(): Description | undefined {
    return this.#description;
  }

  /** What is true of the mesh that is shown. */
  get report(): Report | undefined {
    return this.#report;
  }

  /** The file that is open. */
  get bytes(): Uint8Array {
    return this.#file?.bytes ?? new Uint8Array();
  }

  /** What the colours mean. */
  get view(): View {
    return this.#view;
  }

  /** The vertex from which distances are shown. */
  get source(): number | undefined {
    return this.#source;
  }

  /** The path that is shown. */
  get path(): GeodesicPath | undefined {
    return this.#path;
  }

  get wireframe(): boolean {
    return this.#stage?.hasWireframe ?? false;
  }

  set wireframe(shown: boolean) {
    if (!this.#stage || this.#stage.hasWireframe === shown) return;
    this.#stage.hasWireframe = shown;
    this.#changed();
  }

  get up(): Up {
    return this.#stage?.up ?? 'y';
  }

  set up(up: Up) {
    if (this.#stage && /^-?[xyz]$/.test(up)) this.#stage.up = up;
  }

  /** Pixels at the right and below that something else covers. */
  setInsets(right: number, bottom: number): void {
    this.#stage?.setInsets(right, bottom);
    this.style.setProperty('--inset-bottom', `${bottom}px`);
  }

  /** Shows all of the surface. */
  frame(): void {
    this.#stage?.frame();
  }

  #opened(): WorkerSurface {
    if (!this.#surface) throw new Error('no surface is open');
    return this.#surface;
  }

  #changed(): void {
    this.dispatchEvent(new CustomEvent('ndf-change'));
  }

  /** How much runs or waits, and how much of it is for files: that is not given up. */
  #working = 0;
  #writing = 0;

  async #busy<T>(what: string, work: () => Promise<T>): Promise<T> {
    this.#working++;
    this.dispatchEvent(new CustomEvent('ndf-busy', { detail: what }));
    try {
      return await work();
    } finally {
      this.#working--;
      if (this.#working === 0) this.dispatchEvent(new CustomEvent('ndf-busy', { detail: undefined }));
    }
  }

  /**
   * Shows a mesh of the model with this edge length, in the units of the file or in the model's box. While one is being
   * dragged (`isFinal` false) a mesh is shown that is coarse enough to be there at once, and only the last one asked for: the
   * calls it overtakes reject ({@link Abandoned}).
   */
  async setEdgeLength(length: number | undefined, { isFinal = true, relative = false } = {}): Promise<Extracted> {
    const surface = this.#opened();
    if (this.#working > 0 && this.#writing === 0) surface.abandon();
    this.#wanted?.reject(new Abandoned());
    return new Promise((resolve, reject) => {
      this.#wanted = { length, relative, isFinal, resolve, reject };
      void this.#extractWanted();
    });
  }

  async #extractWanted(): Promise<void> {
    if (this.#isExtracting) return;
    this.#isExtracting = true;
    while (this.#wanted) {
      const { length, relative, isFinal, resolve, reject } = this.#wanted;
      this.#wanted = undefined;
      const coarsest = Math.sqrt(this.#effort / DRAG_SECONDS);
      const inUnits = length !== undefined && relative ? length * (this.#description?.scale ?? 1) : length;
      const used = isFinal || inUnits === undefined ? length : Math.max(inUnits, coarsest);
      try {
        const options = { report: isFinal, relative: relative && isFinal, positions: true };
        const work = () => this.#opened().extract(used, options) as Promise<Shown>;
        const found = isFinal ? await this.#busy('extracting', work) : await work();
        const asked = found.report.target_edge_length ?? used;
        if (asked) this.#effort = found.report.seconds * asked * asked;
        await this.#shown(found, isFinal);
        resolve(found);
      } catch (error) {
        reject(error);
      }
    }
    this.#isExtracting = false;
  }

  /** Shows a mesh in the place of the one before, and on it what was shown before. */
  async #shown({ positions, faces, report }: Shown, isFinal: boolean): Promise<void> {
    const stage = this.#stage;
    if (!stage) return;
    const placeOf = (vertex: number | undefined) => (vertex === undefined ? undefined : stage.position(vertex));
    const places = this.#report ? [placeOf(this.#source), placeOf(this.#target)] : [];
    stage.setMesh(positions, faces, this.#report !== undefined);
    const found = (place: Vector3 | undefined) => (place ? stage.nearest(place) : undefined);
    const [source, target] = places.map(found);
    this.#report = report;
    this.#asked++;
    this.#modes = undefined;
    this.#present(this.#view, undefined, source, target);
    this.#changed();
    if (isFinal || this.#view.kind === 'scalar') await this.#repeat();
  }

  /** Computes on the new mesh what was shown on the one before. */
  async #repeat(): Promise<void> {
    const [view, source, target] = [this.#view, this.#source, this.#target];
    if (view.kind === 'distance' && source !== undefined) {
      await this.showDistances(source);
      if (target !== undefined) await this.showPath(source, target);
    }
    if (view.kind === 'mode') await this.showMode(view.index);
    if (view.kind === 'scalar') await this.showScalar(view.name);
  }

  /** Runs work whose result is shown unless something else was asked for since; gives it back in either case. */
  async #ask<T>(what: string, work: () => Promise<T>, show: (result: T) => void): Promise<T> {
    const asked = ++this.#asked;
    const result = await this.#busy(what, work);
    if (asked === this.#asked) {
      show(result);
      this.#changed();
    }
    return result;
  }

  /** Gives the colours a meaning, and takes away what belonged to the one before. */
  #present(view: View, values?: NamedValues, source?: number, target?: number): void {
    this.#view = view;
    this.#values = values;
    this.#source = source;
    this.#target = target;
    this.#path = undefined;
    this.#stage?.setPath(undefined);
    this.#mark();
    this.#paint();
  }

  /** Shows the surface without colours. */
  showPlain(): void {
    this.#asked++;
    this.#present({ kind: 'plain' });
    this.#changed();
  }

  /** Shows the exact distances from a vertex, with isolines. */
  showDistances(vertex: number): Promise<Float32Array> {
    const show = (values: Float32Array) => this.#present({ kind: 'distance' }, { name: 'distance', values }, vertex);
    return this.#ask('measuring', () => this.#opened().geodesic(vertex), show);
  }

  /** Shows the shortest path between two vertices. */
  showPath(from: number, to: number): Promise<GeodesicPath> {
    const show = (path: GeodesicPath) => {
      this.#source = from;
      this.#target = to;
      this.#path = path;
      this.#stage?.setPath(path.points);
      this.#mark();
    };
    return this.#ask('measuring', () => this.#opened().path(from, to), show);
  }

  /** The first modes, which are kept. */
  async modes(count: number): Promise<Modes> {
    if (!(this.#modes && this.#modes.count >= count)) {
      const asked = { count, found: this.#busy('computing modes', () => this.#opened().modes(count)) };
      this.#modes = asked;
      asked.found.catch(() => {
        if (this.#modes === asked) this.#modes = undefined;
      });
    }
    const { values, functions } = await this.#modes.found;
    return { values: values.slice(0, count), functions: functions.slice(0, count) };
  }

  /** The last mode of those that are at hand, or are computed when the first is asked for. */
  get lastMode(): number {
    return Math.max(this.#modes?.count ?? 0, Math.min(MODES, this.#report?.vertices ?? 0)) - 1;
  }

  /** Shows a mode of the Laplacian, counted from 0, or the first or last where there is no such mode. */
  showMode(wanted: number): Promise<Modes> {
    const vertices = this.#report?.vertices ?? 0;
    const index = Math.max(0, Math.min(wanted, vertices - 1));
    // Twice as many when they do not suffice: whoever goes on one by one does not wait each time.
    const enough = MODES * 2 ** Math.max(0, Math.ceil(Math.log2((index + 1) / MODES)));
    const count = Math.min(enough, vertices);
    const show = ({ values, functions }: Modes) => {
      this.#eigenvalue = values[index];
      const name = `mode_${String(index).padStart(2, '0')}`;
      this.#present({ kind: 'mode', index }, { name, values: functions[index]! });
    };
    return this.#ask('computing modes', () => this.modes(count), show);
  }

  #eigenvalue: number | undefined;

  /** Shows a stored scalar. */
  showScalar(name: string): Promise<Float32Array> {
    const show = (values: Float32Array) => this.#present({ kind: 'scalar', name }, { name, values });
    return this.#ask('reading', () => this.#opened().scalar(name), show);
  }

  #mark(): void {
    const isShown = this.#view.kind === 'distance' || this.#path !== undefined;
    const marks = [this.#source, this.#target].filter((vertex) => vertex !== undefined);
    this.#stage?.setMarks(isShown ? marks : []);
  }

  #paint(): void {
    const wanted = this.getAttribute('colormap') as Colormap | null;
    const map = wanted && COLORMAPS.includes(wanted) ? wanted : 'auto';
    const scale = this.#values && scaleOf(this.#values.values, map);
    const isDistance = this.#view.kind === 'distance';
    const spacing = scale && isDistance ? roundStep((scale.high - scale.low) / ISOLINES) : 0;
    this.#stage?.setValues(this.#values?.values, scale, spacing);
    this.#legend.hidden = scale === undefined;
    if (!scale) return;
    const what =
      this.#view.kind === 'distance' ? `Exact distance, a line every ${readable(spacing)}`
      : this.#view.kind === 'mode' ? `Mode ${this.#view.index}, eigenvalue ${readable(this.#eigenvalue ?? 0)}`
      : this.#view.kind === 'scalar' ? this.#view.name : '';
    const [low, high] = [readable(scale.low), readable(scale.high)];
    this.#legend.setAttribute('aria-label', `${what}: colours from ${low} to ${high}`);
    this.#legend.querySelector('.name')!.textContent = what;
    (this.#legend.querySelector('.bar') as HTMLElement).style.background = gradient(scale.map);
    const [first, last] = this.#legend.querySelectorAll('.ends span');
    first!.textContent = low;
    last!.textContent = high;
  }

  /** The vertex at a place of the page, in pixels of CSS; nothing beside the surface. */
  pick(x: number, y: number): number | undefined {
    const { left, top } = this.#canvas.getBoundingClientRect();
    return this.#stage?.pick(x - left, y - top);
  }

  /** The vertex nearest to a place. O(n). */
  nearest([x, y, z]: [number, number, number]): number {
    return this.#stage?.nearest(new Vector3(x, y, z)) ?? 0;
  }

  /** The picture as PNG. */
  screenshot(): Promise<Blob> {
    if (!this.#stage) return Promise.reject(new Error('nothing is shown'));
    return this.#stage.screenshot();
  }

  /** The mesh as a file, with its scalars and the values that are shown, which colour it. */
  async exportFile(format: FileFormat): Promise<Uint8Array> {
    this.#writing++;
    try {
      return await this.#busy('writing', () => this.#opened().file(format, this.#values));
    } finally {
      this.#writing--;
    }
  }

  /** The mesh as binary glTF, with its scalars. */
  async exportGLB(): Promise<ArrayBuffer> {
    return (await this.exportFile('glb')).buffer as ArrayBuffer;
  }

  /** The surface that computes, for what is not shown. */
  get computing(): WorkerSurface {
    return this.#opened();
  }

  /** Whether a click ends a path, as one with Shift does. */
  endsPaths = false;

  /** A click: a source, or the end of a path from the one before. */
  #clicked(x: number, y: number, endsPath: boolean): void {
    const vertex = this.pick(x, y);
    if (vertex === undefined) return;
    const source = this.#source;
    if (endsPath && source !== undefined) this.#try(this.showPath(source, vertex));
    else this.#try(this.showDistances(vertex));
  }

  #listen(): void {
    const canvas = this.#canvas;
    let pressed: { x: number; y: number; time: number; pointers: number } | undefined;
    let pointers = 0;
    canvas.addEventListener('pointerdown', ({ clientX: x, clientY: y, timeStamp: time, button }) => {
      pointers++;
      pressed = pointers === 1 && button === 0 ? { x, y, time, pointers } : undefined;
    });
    canvas.addEventListener('pointercancel', () => {
      pointers = 0;
      pressed = undefined;
    });
    canvas.addEventListener('pointerup', ({ clientX: x, clientY: y, timeStamp: time, shiftKey }) => {
      pointers = Math.max(0, pointers - 1);
      const start = pressed;
      pressed = undefined;
      if (!start || time - start.time > 600 || Math.hypot(x - start.x, y - start.y) > 6) return;
      this.#clicked(x, y, shiftKey || this.endsPaths);
    });
    canvas.addEventListener('keydown', (event) => {
      if (event.altKey || event.ctrlKey || event.metaKey) return;
      const stage = this.#stage;
      const { left, top, width, height } = canvas.getBoundingClientRect();
      const actions: Record<string, () => void> = {
        ArrowLeft: () => stage?.turn(-0.12, 0),
        ArrowRight: () => stage?.turn(0.12, 0),
        ArrowUp: () => stage?.turn(0, 0.12),
        ArrowDown: () => stage?.turn(0, -0.12),
        '+': () => stage?.zoom(0.88),
        '=': () => stage?.zoom(0.88),
        '-': () => stage?.zoom(1 / 0.88),
        '0': () => stage?.frame(),
        Enter: () => this.#clicked(left + width / 2, top + height / 2, event.shiftKey || this.endsPaths),
      };
      const action = actions[event.key];
      if (!action) return;
      event.preventDefault();
      action();
    });
  }
}

/** What is shown first: the mesh of the file, or that of a model with edges of this length. */
async function firstMesh(surface: WorkerSurface, length: number): Promise<Shown> {
  if (surface.description.kind === 'model' && length > 0) {
    return (await surface.extract(length, { positions: true })) as Shown;
  }
  const [mesh, positions, report] = await Promise.all([surface.mesh(), surface.positions(), surface.report()]);
  return { ...mesh, positions, report };
}

if (!customElements.get('ndf-viewer')) customElements.define('ndf-viewer', NdfViewer);
