import { finite, lengthOrNothing } from '../checks.js';
import { Abandoned } from '../client.js';
import { messageOf } from '../message.js';
import type { Description } from '../types.js';
import { NdfViewer, type Up } from '../viewer.js';
import { hasAddress, linkTo, modelIn } from './link.js';
import { Panel } from './panel.js';
import workerCode from 'worker:../worker.ts';

/** What a page was made with. */
export interface Input {
  name: string;
  bytes: Uint8Array;
  scalar?: string | null;
  source?: [number, number, number] | null;
  edge_length?: number | null;
  up?: Up | null;
}

const HELP = /* html */ `
<h2 id="help-title">What can be done here</h2>
<table>
<tr><td>Drag, or one finger</td><td>turn</td></tr>
<tr><td>Right drag, or two fingers</td><td>move</td></tr>
<tr><td>Wheel, or pinch</td><td>zoom</td></tr>
<tr><td>Click, or tap</td><td>exact distances from there</td></tr>
<tr><td>Shift-click, or a tap after “A click ends a path”</td><td>the shortest path from the source to there</td></tr>
<tr><td>Drop or open a file</td><td>show another model or mesh</td></tr>
</table>
<table class="keys">
<tr><td><kbd>←</kbd> <kbd>→</kbd> <kbd>↑</kbd> <kbd>↓</kbd></td><td>turn (when the picture is focused)</td></tr>
<tr><td><kbd>+</kbd> <kbd>−</kbd> <kbd>0</kbd></td><td>zoom; show all</td></tr>
<tr><td><kbd>Enter</kbd>, <kbd>Shift</kbd> <kbd>Enter</kbd></td><td>click in the middle of the picture</td></tr>
<tr><td><kbd>[</kbd> <kbd>]</kbd></td><td>coarser, finer</td></tr>
<tr><td><kbd>W</kbd> <kbd>U</kbd></td><td>wireframe; another direction up</td></tr>
<tr><td><kbd>N</kbd> <kbd>D</kbd> <kbd>M</kbd> <kbd>S</kbd></td><td>no colours, distances, modes, scalars</td></tr>
<tr><td><kbd>,</kbd> <kbd>.</kbd></td><td>mode before, mode after</td></tr>
<tr><td><kbd>P</kbd> <kbd>L</kbd></td><td>picture as PNG; copy a link</td></tr>
<tr><td><kbd>?</kbd> <kbd>Esc</kbd></td><td>open and close this</td></tr>
</table>
<p>Nothing leaves this page: all computing is done here.</p>
<form method="dialog"><button class="plain" autofocus>Close</button></form>`;

/** Characters of a link that browsers and programs take. */
const LONG_LINK = 60_000;

function made<K extends keyof HTMLElementTagNameMap>(tag: K, className: string, html = ''): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  element.className = className;
  element.innerHTML = html;
  return element;
}

/** The page: a picture, a panel, and what is around them. */
class Page {
  readonly viewer = new NdfViewer();
  readonly #main = document.getElementById('main')!;
  readonly #header = made('header', '', '<h1></h1><p role="status"></p>');
  readonly #toast = made('div', 'toast');
  readonly #drop = made('div', 'drop', 'Drop a model or a mesh');
  readonly #empty = made('div', 'empty', '<p>Drop an .ndf model or a mesh here.</p><button class="plain">Open a file…</button>');
  readonly #help = made('dialog', '', HELP);
  readonly #panel = new Panel(this.viewer, {
    view: (kind) => this.#show(kind),
    save: (format) => void this.#save(format),
    open: (file) => void this.#openFile(file),
    help: () => this.#help.showModal(),
    failed: (error) => this.fail(error),
  });
  #work: string | undefined;
  #described: Description | undefined;

  constructor() {
    this.#toast.setAttribute('role', 'alert');
    this.#help.setAttribute('aria-labelledby', 'help-title');
    for (const element of [this.#toast, this.#drop, this.#empty, this.#panel.element]) element.hidden = true;
    this.#main.replaceChildren(this.viewer, this.#header, this.#panel.element, this.#empty, this.#toast, this.#drop, this.#help);
    this.#empty.querySelector('button')!.addEventListener('click', () => this.#panel.element.querySelector<HTMLElement>('#open')!.click());
    this.viewer.addEventListener('ndf-change', () => {
      // What went wrong is over once something went right.
      if (this.#toast.classList.contains('error')) this.#toast.hidden = true;
      this.#changed();
    });
    this.viewer.addEventListener('ndf-busy', (event) => {
      this.#work = (event as CustomEvent<string | undefined>).detail;
      // What is done in a moment is not worth a word.
      setTimeout(() => this.#changed(), this.#work ? 250 : 0);
    });
    this.viewer.addEventListener('ndf-error', (event) => {
      const { detail } = event as CustomEvent<string>;
      if (detail !== this.viewer.message) this.fail(detail);
    });
    this.#listen();
    const fitted = () => this.#inset();
    addEventListener('resize', fitted);
    new ResizeObserver(fitted).observe(this.#panel.element);
  }

  /** Leaves to the picture what the panel does not cover. */
  #inset(): void {
    const panel = this.#panel.element;
    const isBelow = matchMedia('(max-width: 700px)').matches;
    if (panel.hidden) this.viewer.setInsets(0, 0);
    else this.viewer.setInsets(isBelow ? 0 : panel.offsetWidth + 16, isBelow ? panel.offsetHeight : 0);
  }

  async open(input: Input): Promise<void> {
    if (input.up) this.viewer.up = input.up;
    const { notes } = await this.viewer.open(input.bytes, input.name, { edgeLength: input.edge_length ?? undefined });
    if (notes.length > 0) this.tell(notes.join('; '));
    if (input.scalar) await this.viewer.showScalar(input.scalar);
    if (input.source) await this.viewer.showDistances(this.viewer.nearest(input.source));
  }

  /** Opens the model in the fragment; whether there is one that can be shown. */
  async openLinked(): Promise<boolean> {
    try {
      const linked = modelIn(location.hash);
      if (linked) await this.open(linked);
      return linked !== undefined;
    } catch (error) {
      // It stands while the page's own model is shown.
      if (!(error instanceof Abandoned)) this.tell(messageOf(error));
      // What was opened in the meantime is shown.
      return error instanceof Abandoned;
    }
  }

  /** Waits for a file to be dropped. */
  waitForFile(): void {
    this.#empty.hidden = false;
  }

  /** Shows the name and the controls of what was opened, or of what is now known of it. */
  #opened(description: Description): void {
    this.#described = description;
    document.title = `${description.name} – ndf`;
    this.#header.querySelector('h1')!.textContent = description.name;
    this.#empty.hidden = true;
    this.#panel.element.hidden = false;
    this.#panel.opened();
    this.#inset();
  }

  #changed(): void {
    const { report, description } = this.viewer;
    if (description && description !== this.#described) this.#opened(description);
    const line = this.#header.querySelector('p')!;
    line.className = this.#work ? 'work' : '';
    const counts = report ? `${report.vertices.toLocaleString('en')} vertices, ${report.faces.toLocaleString('en')} faces` : '';
    line.textContent = this.#work ? `${this.#work}…` : counts;
    this.viewer.setAttribute('aria-busy', String(this.#work !== undefined));
    this.#panel.changed();
  }

  #hiding: ReturnType<typeof setTimeout> | undefined;

  /** Tells of a failure for some seconds, or until something succeeds. */
  fail(error: unknown): void {
    if (error instanceof Abandoned) return;
    this.tell(messageOf(error));
    this.#toast.classList.add('error');
  }

  /** Tells of something for some seconds. */
  tell(message: string): void {
    this.#toast.textContent = message;
    this.#toast.classList.remove('error');
    this.#toast.hidden = false;
    clearTimeout(this.#hiding);
    this.#hiding = setTimeout(() => (this.#toast.hidden = true), 6000);
  }

  /** Does work, and tells why where it fails. */
  async #try(work: () => unknown): Promise<void> {
    try {
      await work();
    } catch (error) {
      this.fail(error);
    }
  }

  #show(kind: string): void {
    const { viewer } = this;
    void this.#try(() => {
      if (kind === 'plain') return viewer.showPlain();
      if (kind === 'distance') return viewer.showDistances(viewer.source ?? 0);
      if (kind === 'mode') return viewer.showMode(viewer.askedView.kind === 'mode' ? viewer.askedView.index : 1);
      const first = viewer.description?.scalars[0];
      return first ? viewer.showScalar(first.name) : undefined;
    });
  }

  async #openFile(file: File): Promise<void> {
    await this.#try(async () => this.open({ name: file.name, bytes: new Uint8Array(await file.arrayBuffer()) }));
  }

  async #save(format: string): Promise<void> {
    await this.#try(async () => {
      if (format === 'link') return this.#copyLink();
      const { viewer } = this;
      const blob = format === 'png'
        ? await viewer.screenshot()
        : new Blob([(await viewer.exportFile(format as 'ply' | 'glb')) as Uint8Array<ArrayBuffer>]);
      const url = URL.createObjectURL(blob);
      const anchor = made('a', '');
      anchor.href = url;
      anchor.download = `${viewer.description?.name.replace(/\.\w+$/, '') ?? 'surface'}.${format}`;
      anchor.click();
      setTimeout(() => URL.revokeObjectURL(url), 10_000);
    });
  }

  async #copyLink(): Promise<void> {
    const { bytes, description } = this.viewer;
    const link = linkTo(bytes, description?.name ?? 'model.ndf');
    try {
      await navigator.clipboard.writeText(link);
    } catch {
      // Pages that were opened from a disk have no clipboard everywhere.
      const area = made('textarea', '');
      area.value = link;
      this.#main.append(area);
      area.select();
      const isCopied = document.execCommand('copy');
      area.remove();
      if (!isCopied) throw new Error('the browser does not let this page copy');
    }
    const size = `${link.length.toLocaleString('en')} characters`;
    this.tell(link.length > LONG_LINK
      ? `The link is copied. It has ${size}, which many programs cut off; the file is the safer way.`
      : `The link is copied: the model is in it (${size}).`);
  }

  #listen(): void {
    const ends: Up[] = ['y', 'z', 'x', '-y', '-z', '-x'];
    const keys: Record<string, () => void> = {
      w: () => (this.viewer.wireframe = !this.viewer.wireframe),
      u: () => (this.viewer.up = ends[(ends.indexOf(this.viewer.up) + 1) % ends.length]!),
      n: () => this.#show('plain'),
      d: () => this.#show('distance'),
      m: () => this.#show('mode'),
      s: () => this.#show('scalar'),
      p: () => void this.#save('png'),
      ...(hasAddress && { l: () => void this.#save('link') }),
      '[': () => this.#panel.step(-1),
      ']': () => this.#panel.step(1),
      ',': () => this.#nextMode(-1),
      '.': () => this.#nextMode(1),
      '?': () => this.#help.showModal(),
    };
    addEventListener('keydown', (event) => {
      const isTyping = event.target instanceof HTMLSelectElement || event.target instanceof HTMLTextAreaElement;
      if (event.altKey || event.ctrlKey || event.metaKey || this.#help.open || isTyping || !this.viewer.report) return;
      const action = keys[event.key.toLowerCase()];
      if (!action) return;
      event.preventDefault();
      action();
    });
    let depth = 0;
    addEventListener('dragenter', (event) => {
      event.preventDefault();
      depth++;
      this.#drop.hidden = false;
    });
    addEventListener('dragleave', () => {
      depth--;
      this.#drop.hidden = depth > 0 ? this.#drop.hidden : true;
    });
    addEventListener('dragover', (event) => event.preventDefault());
    addEventListener('drop', (event) => {
      event.preventDefault();
      depth = 0;
      this.#drop.hidden = true;
      const file = event.dataTransfer?.files[0];
      if (file) void this.#openFile(file);
    });
    addEventListener('hashchange', () => void this.openLinked());
  }

  #nextMode(step: number): void {
    // From the one that was asked for: keys may come faster than modes.
    const { askedView: view } = this.viewer;
    if (view.kind === 'mode') void this.#try(() => this.viewer.showMode(Math.min(view.index + step, this.viewer.lastMode)));
    else this.#show('mode');
  }
}

/** What checks and other programs call as `window.ndf`: what is computed is shown, too. All are promises. */
function programming(viewer: NdfViewer) {
  return {
    extract: (edgeLength?: number, { relative = false } = {}) => viewer.setEdgeLength(lengthOrNothing(edgeLength), { relative }),
    geodesic: (vertex: number) => viewer.showDistances(vertex),
    path: (from: number, to: number) => viewer.showPath(from, to),
    modes: (count: number) => viewer.modes(count),
    setEdgeLength: async (edgeLength: number) => void (await viewer.setEdgeLength(finite(edgeLength, 'the edge length'))),
    pick: async (x: number, y: number) => viewer.pick(x, y),
    screenshot: () => viewer.screenshot(),
    exportGLB: () => viewer.exportGLB(),
    viewer,
  };
}

/** Starts the page: with what is in its fragment, or in itself, or with nothing. */
export async function start(
  compiled: Promise<WebAssembly.Module>,
  input: Input | undefined,
): Promise<ReturnType<typeof programming>> {
  const url = URL.createObjectURL(new Blob([workerCode], { type: 'text/javascript' }));
  // The first Worker starts while the page is made and WebAssembly is compiled.
  let first: Worker | undefined = new Worker(url);
  const worker = () => {
    const started = first ?? new Worker(url);
    first = undefined;
    return started;
  };
  const page = new Page();
  NdfViewer.workerOptions = { worker, wasm: await compiled };
  if (!(await page.openLinked())) {
    if (!input) page.waitForFile();
    else {
      await page.open(input).catch((error: unknown) => {
        if (error instanceof Abandoned) return;
        if (!page.viewer.report) page.waitForFile();
        page.fail(error);
        throw error;
      });
    }
  }
  return programming(page.viewer);
}
