import { Vector3 } from 'three';
import { finite, whole } from '../checks.js';
import { Abandoned, WorkerSurface, type WorkerOptions } from '../client.js';
import { messageOf } from '../message.js';
import type { Description, Extracted, FileFormat, GeodesicPath, Modes, Report } from '../types.js';
import { COLORMAPS, roundStep, scaleOf, type Colormap } from './colours.js';
import { Extractions, type Length, type Shown } from './extractions.js';
import { listen } from './input.js';
import { Legend } from './legend.js';
import { PLAIN, byDistance, byMode, byScalar, legendOf, looksOn, modeOf, type Looks, type View } from './looks.js';
import { Stage, nearestVertex, type Theme, type Up } from './stage.js';
import { STYLE } from './style.js';

/** A file, and the length of the edges it is shown with. */
interface Opened {
  bytes: Uint8Array;
  name: string;
  edgeLength?: number | undefined;
}

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
 * Worker. An attribute that is empty or wrong is as none; what is wrong is told by `ndf-error`.
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
  /** The one that is under way and not yet shown. */
  #opening: number | undefined;
  #report: Report | undefined;
  #looks = PLAIN;
  /** Where the source and the target lie: on other meshes they are the vertices nearest to there. */
  #places: [Vector3 | undefined, Vector3 | undefined] = [undefined, undefined];
  #modes: { count: number; found: Promise<Modes> } | undefined;
  /** Counts what was asked for, so that answers to earlier questions are not shown. */
  #asked = 0;
  /** What the last question that is not yet answered will show. */
  #askedView: View | undefined;
  /** Whether the element is in a document, and its attributes are followed. */
  #isStarted = false;
  #isReady = false;
  readonly #extractions = new Extractions({
    surface: () => this.#surface,
    description: () => this.#description,
    busy: (what, work) => this.#busy(what, work),
    looksOn: (surface, mesh, isShort) => this.#looksOn(surface, mesh, isShort),
    show: (mesh, looks) => this.#shown(mesh, looks),
    learn: (report, description) => {
      this.#report = report;
      this.#description = description;
      this.#changed();
    },
    failed: () => {
      this.#askedView = undefined;
      this.#changed();
    },
  });
  #readied = new Set<() => void>();
  readonly #canvas: HTMLCanvasElement;
  readonly #legend: Legend;
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
    this.#legend = new Legend(root);
    this.#message = root.querySelector('.message')!;
    listen(this.#canvas, () => this.#stage, (x, y, hasShift) => this.#clicked(x, y, hasShift || this.endsPaths));
  }

  connectedCallback(): void {
    try {
      this.#stage ??= new Stage(this.#canvas);
    } catch {
      this.#say('This page needs WebGL 2, which this browser does not give. Another browser, or hardware acceleration switched on in its settings, may.');
    }
    this.#isStarted = true;
    this.#setTheme();
    this.#darkness.addEventListener('change', this.#setTheme);
    this.#resizing.observe(this);
    this.up = (this.getAttribute('up') ?? this.up) as Up;
    this.wireframe = this.hasAttribute('wireframe');
    // What is being opened is shown when it has come: an element that is moved does not go back to what was there before.
    if (this.#opening !== undefined) return;
    if (this.#file) void this.#begin(this.#file);
    else if (this.getAttribute('src')) void this.#begin(this.#fetched());
  }

  disconnectedCallback(): void {
    this.#isStarted = false;
    this.#darkness.removeEventListener('change', this.#setTheme);
    this.#resizing.disconnect();
    // It is opened again as it was.
    if (this.#file) this.#file = { ...this.#file, edgeLength: this.#extractions.settled ?? this.#file.edgeLength };
    this.#close();
    this.#stage?.dispose();
    this.#stage = undefined;
  }

  /** Gives up what is asked of the surface, and the surface. */
  #close(): void {
    this.#extractions.reset(false);
    this.#surface?.free();
    this.#surface = undefined;
    this.#description = undefined;
    this.#report = undefined;
    this.#isReady = false;
    this.#looks = PLAIN;
    this.#places = [undefined, undefined];
  }

  /** Shows nothing any more. */
  clear(): void {
    this.#openings++;
    this.#opening = undefined;
    this.#close();
    this.#file = undefined;
    this.#asked++;
    this.#stage?.clear();
    this.#present(PLAIN);
    if (this.#stage) this.#say(undefined);
    this.#changed();
  }

  attributeChangedCallback(name: string, before: string | null, after: string | null): void {
    if (before === after) return;
    if (name === 'src' && !this.#isStarted) this.#file = undefined;
    if (!this.#isStarted) return;
    if (name === 'src') {
      if (after) void this.#begin(this.#fetched());
      else this.clear();
    }
    // Before anything is open they are only noted: opening reads them.
    if (name === 'edge-length' && this.#description?.kind === 'model') this.#try(this.setEdgeLength(this.#number('edge-length')));
    if (name === 'source' && this.#surface) this.#try(this.#showSource());
    if (name === 'colormap') this.#paint();
    if (name === 'up') this.up = (after || 'y') as Up;
    if (name === 'wireframe') this.wireframe = after !== null;
  }

  /** The number in an attribute; nothing where there is none, or where it is wrong, which is told. */
  #number(name: 'edge-length' | 'source'): number | undefined {
    const text = this.getAttribute(name)?.trim();
    if (!text) return undefined;
    const value = Number(text);
    const isVertex = name === 'source';
    if (isVertex ? Number.isInteger(value) && value >= 0 : Number.isFinite(value) && value > 0) return value;
    this.#tell(new Error(`${name}="${text}" is not ${isVertex ? 'the number of a vertex' : 'a length'}, and is left out`));
    return undefined;
  }

  /** Shows the distances that the attribute asks for, or takes away those that are there. */
  async #showSource(): Promise<void> {
    const source = this.#number('source');
    if (source !== undefined) await this.showDistances(source);
    else if (this.view.kind === 'distance') this.showPlain();
  }

  /** Reports a failure as an event as well: for calls that nobody waits for. */
  #try(work: Promise<unknown>): void {
    work.catch((error: unknown) => this.#tell(error));
  }

  #tell(error: unknown): void {
    if (error instanceof Abandoned) return;
    this.dispatchEvent(new CustomEvent('ndf-error', { detail: messageOf(error) }));
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
    this.#opening = opening;
    try {
      const come = await file;
      if (opening !== this.#openings) return;
      if (!this.isConnected) {
        this.#file = come;
        return;
      }
      await this.#open(opening, come);
      if (this.hasAttribute('source')) await this.#showSource();
    } catch (error) {
      if (error instanceof Abandoned || opening !== this.#openings) return;
      this.#say(messageOf(error));
      if (file instanceof Promise) this.#reopen();
    } finally {
      this.#ended(opening);
    }
  }

  /** An opening is no longer under way. */
  #ended(opening: number): void {
    if (this.#opening === opening) this.#opening = undefined;
  }

  /** Opens what was shown before, where it was closed while something else was opened in vain. */
  #reopen(): void {
    if (this.#file && !this.#surface && this.isConnected) void this.#begin(this.#file);
  }

  #say(message: string | undefined): void {
    this.#message.textContent = message ?? '';
    this.#message.hidden = message === undefined;
    if (message) this.dispatchEvent(new CustomEvent('ndf-error', { detail: message }));
  }

  /** What the element says in place of a picture. */
  get message(): string | undefined {
    return this.#message.textContent || undefined;
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
  async open(bytes: Uint8Array, name: string, { edgeLength }: { edgeLength?: number | undefined } = {}): Promise<Description> {
    const opening = ++this.#openings;
    this.#opening = opening;
    try {
      return await this.#open(opening, { bytes, name, edgeLength });
    } catch (error) {
      this.#ended(opening);
      if (opening === this.#openings) this.#reopen();
      throw error;
    }
  }

  #open(opening: number, file: Opened): Promise<Description> {
    return this.#busy('opening', async () => {
      const surface = await WorkerSurface.open(file.bytes, file.name, { ...NdfViewer.workerOptions, coarse: true });
      try {
        const [mesh, positions] = await Promise.all([surface.mesh(), surface.positions()]);
        if (opening !== this.#openings) throw new Abandoned();
        this.#ended(opening);
        this.#close();
        this.#file = file;
        // Connection opens it again.
        if (!this.isConnected) throw new Abandoned();
        this.#surface = surface;
        this.#description = surface.description;
        if (this.#stage) this.#say(undefined);
        const report = { vertices: positions.length / 3, faces: mesh.faces.length / 3, seconds: 0 };
        this.#stage?.clear();
        this.#extractions.reset(true);
        this.#shown({ ...mesh, positions, report }, PLAIN);
      } catch (error) {
        surface.free();
        if (error instanceof Abandoned && this.#file === file) return surface.description;
        throw error;
      }
      await this.#refine(file);
      this.#isReady = true;
      this.#readied.forEach((resolve) => resolve());
      this.#readied.clear();
      return this.#description ?? surface.description;
    });
  }

  /** Shows the mesh that is wanted in the place of the coarse one that is there first, and what is true of it. */
  async #refine(file: Opened): Promise<void> {
    try {
      if (this.#description?.kind === 'model') {
        const length = file.edgeLength ?? this.#number('edge-length');
        const isShown = length === undefined ? undefined : await this.#attempt(this.#extractions.ask({ length }));
        if (!isShown) await this.#attempt(this.#extractions.ask({}));
      } else {
        const report = await this.#opened().report();
        if (this.#file === file) this.#report = report;
        this.#changed();
      }
    } catch (error) {
      // Another edge length was asked for, or the element was taken away.
      if (!(error instanceof Abandoned) || this.#file?.bytes !== file.bytes) throw error;
    }
  }

  /** What comes of work that is told where it fails; nothing then. */
  async #attempt<T>(work: Promise<T>): Promise<T | undefined> {
    try {
      return await work;
    } catch (error) {
      if (error instanceof Abandoned) throw error;
      this.#tell(error);
      return undefined;
    }
  }

  /** Resolves when a surface is shown. */
  get ready(): Promise<void> {
    if (this.#isReady) return Promise.resolve();
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
    return this.#looks.view;
  }

  /** What the colours mean, or will when what was asked for last is computed. */
  get askedView(): View {
    return this.#askedView ?? this.view;
  }

  /** The edge length of what is shown, or of what was asked for last and is not yet there. */
  get edgeLength(): number | undefined {
    return this.#extractions.asked ?? this.#report?.target_edge_length;
  }

  /** The vertex from which distances are shown. */
  get source(): number | undefined {
    return this.#looks.source;
  }

  /** The path that is shown. */
  get path(): GeodesicPath | undefined {
    return this.#looks.path;
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
    if (this.#stage && this.#stage.up !== up && /^-?[xyz]$/.test(up)) this.#stage.up = up;
  }

  /** Pixels at the right and below that something else covers. */
  setInsets(right: number, bottom: number): void {
    this.#stage?.setInsets(right, bottom);
    this.style.setProperty('--inset-right', `${right}px`);
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
   * calls it overtakes reject ({@link Abandoned}). If there is no such mesh, the one before stays or comes back.
   */
  async setEdgeLength(length: number | undefined, options: Omit<Length, 'length'> = {}): Promise<Extracted> {
    const surface = this.#opened();
    if (this.#working > 0 && this.#writing === 0) surface.abandon();
    return this.#extractions.ask({ length, ...options });
  }

  /** What is shown, on a mesh that is to take the place of the one before. */
  async #looksOn(surface: WorkerSurface, { positions, report }: Shown, isShort: boolean): Promise<Looks> {
    for (;;) {
      const before = this.#looks;
      // What was asked for in vain, since another edge length was, is shown on its mesh.
      const asked = this.#askedView;
      const view = asked?.kind === 'mode' || asked?.kind === 'scalar' ? asked : before.view;
      const [source, target] = this.#places.map((place) => place && nearestVertex(positions, place));
      try {
        const looks = await looksOn(surface, { ...before, view }, [source, target], report.vertices, isShort);
        if (before === this.#looks && asked === this.#askedView) return looks;
      } catch (error) {
        if (error instanceof Abandoned) throw error;
        this.#tell(error);
        return PLAIN;
      }
    }
  }

  /** Shows a mesh in the place of the one before. */
  #shown({ positions, faces, report }: Shown, looks: Looks): void {
    this.#stage?.setMesh(positions, faces);
    this.#report = report;
    this.#asked++;
    this.#modes = undefined;
    this.#askedView = undefined;
    this.#draw(looks);
    this.#changed();
  }

  /** Runs work whose result is shown unless something else was asked for since; gives it back in either case. */
  async #ask<T>(what: string, view: View, work: (surface: WorkerSurface) => Promise<T>, looks: (result: T) => Looks): Promise<T> {
    const asked = ++this.#asked;
    this.#askedView = view;
    let isGivenUp = false;
    try {
      const result = await this.#busy(what, () => work(this.#opened()));
      if (asked === this.#asked) {
        this.#present(looks(result));
        this.#changed();
      }
      return result;
    } catch (error) {
      isGivenUp = error instanceof Abandoned && this.#extractions.isWanted;
      throw error;
    } finally {
      if (asked === this.#asked && !isGivenUp) this.#askedView = undefined;
    }
  }

  /** Gives the surface other looks, and keeps where their source and target lie. */
  #present(looks: Looks): void {
    const place = (vertex: number | undefined, before: number | undefined, known: Vector3 | undefined) =>
      vertex === undefined ? undefined : vertex === before && known ? known : this.#stage?.position(vertex);
    const { source, target } = this.#looks;
    this.#places = [place(looks.source, source, this.#places[0]), place(looks.target, target, this.#places[1])];
    this.#draw(looks);
  }

  #draw(looks: Looks): void {
    this.#looks = looks;
    const marks = [looks.source, looks.target].filter((vertex) => vertex !== undefined);
    this.#stage?.setPath(looks.path?.points);
    this.#stage?.setMarks(marks);
    this.#paint();
  }

  /** Shows the surface without colours. */
  showPlain(): void {
    this.#asked++;
    this.#askedView = undefined;
    this.#present(PLAIN);
    this.#changed();
  }

  /** Shows the exact distances from a vertex, with isolines. */
  showDistances(vertex: number): Promise<Float32Array> {
    const work = (surface: WorkerSurface) => surface.geodesic(vertex);
    return this.#ask('measuring', { kind: 'distance' }, work, (values) => byDistance(values, vertex));
  }

  /** Shows the shortest path between two vertices. */
  showPath(from: number, to: number): Promise<GeodesicPath> {
    const work = (surface: WorkerSurface) => surface.path(from, to);
    return this.#ask('measuring', this.view, work, (path) => ({ ...this.#looks, source: from, target: to, path }));
  }

  /** The first modes, which are kept. */
  async modes(count: number): Promise<Modes> {
    whole(count, 'the number of modes');
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
    const { count } = modeOf(this.view.kind === 'mode' ? this.view.index : 0, this.#report?.vertices ?? 0);
    return Math.max(this.#modes?.count ?? 0, count) - 1;
  }

  /** Shows a mode of the Laplacian, counted from 0, or the first or last where there is no such mode. */
  async showMode(wanted: number): Promise<Modes> {
    const { index, count } = modeOf(Math.floor(finite(wanted, 'the mode')), this.#report?.vertices ?? 0);
    return this.#ask('computing modes', { kind: 'mode', index }, () => this.modes(count), (modes) => byMode(modes, index));
  }

  /** Shows a stored scalar. */
  showScalar(name: string): Promise<Float32Array> {
    const work = (surface: WorkerSurface) => surface.scalar(name);
    return this.#ask('reading', { kind: 'scalar', name }, work, (values) => byScalar(values, name));
  }

  #paint(): void {
    const wanted = this.getAttribute('colormap') as Colormap | null;
    const map = wanted && COLORMAPS.includes(wanted) ? wanted : 'auto';
    const values = this.#looks.values?.values;
    const scale = values && scaleOf(values, map);
    const spacing = scale && this.view.kind === 'distance' ? roundStep((scale.high - scale.low) / ISOLINES) : 0;
    this.#stage?.setValues(values, scale, spacing);
    this.#legend.show(legendOf(this.#looks, spacing), scale);
  }

  /** The vertex at a place of the page, in pixels of CSS; nothing beside the surface. */
  pick(x: number, y: number): number | undefined {
    const { left, top } = this.#canvas.getBoundingClientRect();
    return this.#stage?.pick(finite(x, 'x of a place to pick') - left, finite(y, 'y of a place to pick') - top);
  }

  /** The vertex nearest to a place. O(n). */
  nearest(place: [number, number, number]): number {
    const [x, y, z] = [0, 1, 2].map((i) => finite(place?.[i], 'a coordinate of a place')) as [number, number, number];
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
      return await this.#busy('writing', () => this.#opened().file(format, this.#looks.values));
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
    const { source } = this;
    if (endsPath && source !== undefined) this.#try(this.showPath(source, vertex));
    else this.#try(this.showDistances(vertex));
  }
}

declare global {
  interface HTMLElementTagNameMap {
    'ndf-viewer': NdfViewer;
  }
}

if (!customElements.get('ndf-viewer')) customElements.define('ndf-viewer', NdfViewer);
