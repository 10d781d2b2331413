import type { NdfViewer } from '../viewer.js';
import { readable } from '../viewer/colours.js';
import { hasAddress } from './link.js';

/** What a page says and asks beside the picture. */
const MARKUP = /* html */ `
<button class="grip" aria-label="Show or hide the controls" aria-expanded="false"></button>
<section id="fineness">
  <h2><label for="length">Edge length</label><output id="length-now" for="length"></output></h2>
  <input id="length" type="range" min="0" max="1000" step="1" aria-describedby="length-now length-end">
  <p id="length-end" class="hint" hidden></p>
</section>
<section>
  <h2>Colours</h2>
  <div class="choice" role="group" aria-label="What the colours show">
    <button data-view="plain">None</button><button data-view="distance">Distance</button><button data-view="mode">Modes</button><button data-view="scalar">Scalars</button>
  </div>
  <div id="of-distance" hidden>
    <p class="hint">Click the surface: distances from there. Shift-click: the shortest path to there.</p>
    <div class="row"><label class="check"><input type="checkbox" id="ends">A click ends a path</label></div>
  </div>
  <div id="of-mode" hidden>
    <div class="row"><input id="mode" type="range" min="0" step="1" aria-label="Mode"><output id="mode-now" for="mode"></output></div>
  </div>
  <div id="of-scalar" hidden><div class="row"><select id="scalar" aria-label="Stored scalar"></select></div></div>
  <dl id="path" hidden><dt>Path</dt><dd></dd></dl>
  <div class="row"><label class="check"><input type="checkbox" id="wireframe">Wireframe</label></div>
</section>
<section id="figures"><h2>Mesh</h2><dl></dl></section>
<section>
  <h2>Take away</h2>
  <div class="row"><button data-save="glb">GLB</button><button data-save="ply">PLY</button><button data-save="png">PNG</button><button data-save="link">Link</button></div>
  <div class="row"><button id="open">Open a file…</button><button id="help">Help</button></div>
  <input id="file" type="file" accept=".ndf,.ply,.obj,.stl,.off,.glb,.gltf" hidden>
</section>`;

/** What the panel asks for. */
export interface Wishes {
  view(kind: string): void;
  save(format: string): void;
  open(file: File): void;
  help(): void;
  failed(error: unknown): void;
}

/** The controls beside the picture. */
export class Panel {
  readonly element = document.createElement('aside');
  /** The shortest and the longest edges of the slider. */
  #range: [number, number] | undefined;

  constructor(readonly viewer: NdfViewer, wishes: Wishes) {
    this.element.className = 'panel folded';
    this.element.setAttribute('aria-label', 'Controls');
    this.element.innerHTML = MARKUP;
    const grip = this.element.querySelector<HTMLButtonElement>('.grip')!;
    grip.addEventListener('click', () => {
      const isFolded = this.element.classList.toggle('folded');
      grip.setAttribute('aria-expanded', String(!isFolded));
    });
    const slider = this.#get<HTMLInputElement>('length');
    const asked = (isFinal: boolean) => {
      const length = this.#lengthAt(Number(slider.value));
      if (length === undefined) return;
      const { report } = viewer;
      const faces = report?.target_edge_length ? report.faces * (report.target_edge_length / length) ** 2 : 0;
      const about = Number(faces.toPrecision(2)).toLocaleString('en');
      this.#get('length-now').textContent = `${readable(length)}, ≈ ${about} faces`;
      viewer.setEdgeLength(length, { isFinal }).catch(wishes.failed);
    };
    slider.addEventListener('input', () => asked(false));
    slider.addEventListener('change', () => asked(true));
    for (const button of this.element.querySelectorAll<HTMLButtonElement>('[data-view]')) {
      button.addEventListener('click', () => wishes.view(button.dataset['view']!));
    }
    for (const button of this.element.querySelectorAll<HTMLButtonElement>('[data-save]')) {
      button.addEventListener('click', () => wishes.save(button.dataset['save']!));
    }
    this.element.querySelector<HTMLElement>('[data-save="link"]')!.hidden = !hasAddress;
    const mode = this.#get<HTMLInputElement>('mode');
    mode.addEventListener('input', () => viewer.showMode(Number(mode.value)).catch(wishes.failed));
    const scalar = this.#get<HTMLSelectElement>('scalar');
    scalar.addEventListener('change', () => viewer.showScalar(scalar.value).catch(wishes.failed));
    const wireframe = this.#get<HTMLInputElement>('wireframe');
    wireframe.addEventListener('change', () => (viewer.wireframe = wireframe.checked));
    const ends = this.#get<HTMLInputElement>('ends');
    ends.addEventListener('change', () => (viewer.endsPaths = ends.checked));
    const file = this.#get<HTMLInputElement>('file');
    this.#get('open').addEventListener('click', () => file.click());
    file.addEventListener('change', () => {
      if (file.files?.[0]) wishes.open(file.files[0]);
      file.value = '';
    });
    this.#get('help').addEventListener('click', wishes.help);
  }

  #get<T extends HTMLElement>(id: string): T {
    return this.element.querySelector<T>(`#${id}`)!;
  }

  /** Makes the slider and the scalars those of what was opened. */
  opened(): void {
    const description = this.viewer.description;
    const base = description?.base_edge_length;
    // What memory holds is an estimate: the slider ends a little before.
    const shortest = 1.05 * (description?.min_edge_length ?? 0);
    this.#range = base ? [Math.max(base / 16, shortest), 2 * Math.max(base, shortest)] : undefined;
    this.#get('fineness').hidden = !base;
    const isCut = base !== undefined && base !== null && shortest > base / 16;
    this.#get('length-end').hidden = !isCut;
    this.#get('length-end').textContent = `Down to ${readable(shortest)}: memory in browsers ends at about 4 million faces.`;
    const names = description?.scalars.map(({ name }) => name) ?? [];
    const select = this.#get<HTMLSelectElement>('scalar');
    select.replaceChildren(...names.map((name) => new Option(name, name)));
    this.element.querySelector<HTMLButtonElement>('[data-view="scalar"]')!.disabled = names.length === 0;
    this.changed();
  }

  /** Of a place of the slider: fine edges are at the right. */
  #lengthAt(place: number): number | undefined {
    if (!this.#range) return undefined;
    const [least, most] = this.#range;
    return most * (least / most) ** (place / 1000);
  }

  #placeOf(length: number): number {
    const [least, most] = this.#range!;
    return (1000 * Math.log(most / length)) / Math.log(most / least);
  }

  /** Moves the slider by steps, as keys do. */
  step(steps: number): void {
    const slider = this.#get<HTMLInputElement>('length');
    if (!this.#range) return;
    slider.value = String(Number(slider.value) + 40 * steps);
    slider.dispatchEvent(new Event('change'));
  }

  /** Shows what is shown. */
  changed(): void {
    const { askedView: view, report, path, description, edgeLength: length } = this.viewer;
    for (const button of this.element.querySelectorAll<HTMLButtonElement>('[data-view]')) {
      button.setAttribute('aria-pressed', String(button.dataset['view'] === view.kind));
    }
    for (const kind of ['distance', 'mode', 'scalar']) this.#get(`of-${kind}`).hidden = view.kind !== kind;
    this.#get<HTMLInputElement>('wireframe').checked = this.viewer.wireframe;
    this.#get('path').hidden = !path;
    if (path) this.#get('path').querySelector('dd')!.textContent = readable(path.length);
    if (view.kind === 'mode') {
      const mode = this.#get<HTMLInputElement>('mode');
      mode.max = String(this.viewer.lastMode);
      mode.value = String(view.index);
      this.#get('mode-now').textContent = String(view.index);
    }
    if (view.kind === 'scalar') this.#get<HTMLSelectElement>('scalar').value = view.name;
    const slider = this.#get<HTMLInputElement>('length');
    if (length !== undefined && this.#range && !slider.matches(':active')) {
      slider.value = String(this.#placeOf(length));
      slider.setAttribute('aria-valuetext', readable(length));
      if (length === report?.target_edge_length) this.#get('length-now').textContent = readable(length);
    }
    if (!report || !description) return;
    const rows: [string, string][] = [
      ['File', `${description.bytes.toLocaleString('en')} bytes`],
      ['Vertices', report.vertices.toLocaleString('en')],
      ['Faces', report.faces.toLocaleString('en')],
    ];
    if (report.min_angle_deg) {
      const { components = 1, euler_characteristic: euler = 0, boundary_edges: border = 0 } = report;
      rows.push(['Pieces', String(components)], ['Euler characteristic', String(euler).replace('-', '−')]);
      rows.push(['Border edges', border.toLocaleString('en')]);
      rows.push(['Smallest angle', `${(report.min_angle_deg['min'] ?? 0).toFixed(1)}°`]);
      rows.push(['Self-intersections', (report.self_intersections ?? 0).toLocaleString('en')]);
    }
    if (description.kind === 'model' && report.seconds) rows.push(['Extracted in', `${report.seconds.toFixed(2)} s`]);
    const list = this.#get('figures').querySelector('dl')!;
    list.replaceChildren(...rows.flatMap(([name, value]) => {
      const [dt, dd] = [document.createElement('dt'), document.createElement('dd')];
      dt.textContent = name;
      dd.textContent = value;
      return [dt, dd];
    }));
  }
}
