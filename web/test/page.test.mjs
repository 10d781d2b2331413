/** The page of `ndf view` in Chromium, opened from the disk, against the program; and the element in a served page. */

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { after, before, test } from 'node:test';
import { fileURLToPath, pathToFileURL } from 'node:url';
import validator from 'gltf-validator';
import { assertSameReport, browser, difference, folder, golden, ndf, readPly, tetrahedron } from './helpers.mjs';

const place = folder();
const model = golden('sphere_version_2');
const view = place('view.html');
/** @type {import('playwright-core').Browser} */
let chromium;
/** @type {import('node:http').Server} */
let server;
let served;
const outside = [];
const failures = [];

/** A page of the browser at an address, watched. */
async function opened(url, settings = {}, prepare) {
  const context = await chromium.newContext({ viewport: { width: 1200, height: 800 }, ...settings });
  const page = await context.newPage();
  page.on('request', (request) => {
    if (!/^(file|blob|data):/.test(request.url()) && !request.url().startsWith(served)) outside.push(request.url());
  });
  page.on('console', (message) => message.type() === 'error' && failures.push(message.text()));
  page.on('pageerror', (error) => failures.push(String(error)));
  if (prepare) await page.addInitScript(prepare);
  await page.goto(url);
  return page;
}

/** The page of the model, ready. */
async function ready(settings, url = pathToFileURL(view).href) {
  const page = await opened(url, settings);
  await page.evaluate(() => window.ndf.then(() => undefined));
  assert.ok(!(await page.locator('.toast').isVisible()), await page.locator('.toast').textContent());
  return page;
}

const MODULES = {
  'ndf-geometry': '/lib/index.js',
  'ndf-geometry/viewer': '/lib/viewer.js',
  three: '/node_modules/three/build/three.module.js',
  'three/examples/': '/node_modules/three/examples/',
};

/** A page of modules, with the package, three.js and a model beside it. */
const MODULE_PAGE = `<!DOCTYPE html><link rel="icon" href="data:,"><script type="importmap">${JSON.stringify({ imports: MODULES })}</script>
<style>ndf-viewer { display: block; width: 600px; height: 400px }</style>
<script type="module">
Object.assign(window, await import('ndf-geometry'), await import('ndf-geometry/viewer'));
const got = async (file) => new Uint8Array(await (await fetch(file)).arrayBuffer());
window.files = { model: await got('/model.ndf'), mesh: await got('/mesh.obj') };
window.told = [];
window.viewer = new NdfViewer();
viewer.addEventListener('ndf-error', ({ detail }) => told.push(detail));
window.failure = (work) => work.then(() => undefined, (error) => error.name + ': ' + error.message);
window.started = true;
</script>`;

function answer({ url }, response) {
  const types = { html: 'text/html', js: 'text/javascript', wasm: 'application/wasm' };
  const type = url === '/' ? 'text/html' : (types[url.split('.').pop()] ?? 'application/octet-stream');
  const contents = { '/': MODULE_PAGE, '/mesh.obj': tetrahedron };
  const file = () => (url === '/model.ndf' ? model : fileURLToPath(new URL(`..${url}`, import.meta.url)));
  response.writeHead(200, { 'content-type': type }).end(contents[url] ?? readFileSync(file()));
}

/** A page with the package, an element that is not yet in it, and a model and a mesh. */
async function modules() {
  const page = await opened(served);
  await until(page, () => window.started);
  return page;
}

const report = (page) => page.evaluate(async () => (await window.ndf).viewer.report);
const shownView = (page) => page.evaluate(async () => (await window.ndf).viewer.view);

/** Waits until something holds in the page; the page's policy forbids Playwright's own way, which evaluates text. */
async function until(page, condition, given) {
  const end = Date.now() + 60_000;
  while (!(await page.evaluate(condition, given))) {
    assert.ok(Date.now() < end, `not within a minute: ${condition}`);
    await new Promise((resolve) => setTimeout(resolve, 30));
  }
}

before(async () => {
  ndf('view', model, '-o', view);
  server = createServer(answer);
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  served = `http://127.0.0.1:${server.address().port}/`;
  chromium = await browser();
});

after(async () => {
  await chromium?.close();
  server?.close();
  assert.deepEqual(outside, [], 'a request left the page');
  assert.deepEqual(failures, []);
});

test('numbers are those of the program', async () => {
  const page = await ready();
  const { default_edge_length: usual } = await page.evaluate(async () => (await window.ndf).viewer.description);
  const length = 0.8 * usual;
  const found = await page.evaluate(async (length) => {
    const ndf = await window.ndf;
    const { vertices, faces, report } = await ndf.extract(length);
    const [from, to] = [0, report.vertices >> 1];
    const distances = await ndf.geodesic(from);
    const path = await ndf.path(from, to);
    const modes = await ndf.modes(5);
    return {
      vertices: [...vertices], faces: [...faces], report, from, to, distances: [...distances],
      points: [...path.points], length: path.length, values: [...modes.values], functions: modes.functions.length,
    };
  }, length);
  const mesh = place('mesh.ply');
  const figures = ndf('extract', model, '-o', mesh, '--edge-length', length, '--double');
  const written = readPly(mesh);
  assertSameReport(found.report, figures);
  assert.deepEqual(found.faces, written.faces);
  assert.equal(difference(found.vertices, written.positions.map(Math.fround)), 0);
  const target = written.positions.slice(3 * found.to, 3 * found.to + 3);
  const measured = place('distances.ply');
  const { path } = ndf('geodesic', mesh, '-o', measured, '--source-vertex', found.from, '--path-to', target.join(','));
  const description = await page.evaluate(async () => (await window.ndf).viewer.description);
  const factor = description.distance_factor ?? 1;
  const theirs = readPly(measured).scalars.distance;
  const bound = factor === 1 ? 0 : 1e-6 * Math.max(...theirs);
  assert.ok(difference(found.distances, theirs.map((d) => d * factor)) <= bound);
  assert.ok(Math.abs(found.length - factor * path.length) <= 1e-9 * path.length);
  assert.equal(found.points.length, 3 * path.points.length);
  assert.equal(found.functions, 5);
  const spectrum = ndf('spectrum', mesh, '-o', place('modes.ply'), '--modes', 5);
  const eigenvalues = spectrum.eigenvalues.map((value) => value / factor ** 2);
  assert.ok(difference(found.values, eigenvalues) <= 1e-6 * (factor === 1 ? 1 : 1e4) * eigenvalues.at(-1));
});

test('a page with an edge length opens with it, and without an error', async () => {
  const shown = place('edges.html');
  const page = await ready();
  const { default_edge_length: usual } = await page.evaluate(async () => (await window.ndf).viewer.description);
  ndf('view', model, '-o', shown, '--edge-length', 1.5 * usual);
  const { target_edge_length: length } = await report(await ready({}, pathToFileURL(shown).href));
  assert.ok(Math.abs(length - 1.5 * usual) <= 1e-9 * usual);
});

test('a damaged link is told, and the page shows its own model', async () => {
  for (const damage of ['***', 'AAAA']) {
    const page = await opened(`${pathToFileURL(view).href}#m=${damage}`);
    assert.equal((await page.evaluate(async () => (await window.ndf).viewer.description)).name, 'sphere_version_2.ndf');
    assert.ok(await page.locator('.toast').isVisible());
  }
  const page = await ready();
  await page.evaluate(() => (location.hash = '#m=***'));
  await until(page, () => document.querySelector('.toast').textContent.includes('link is damaged'));
  assert.ok((await report(page)).vertices > 0);
});

test('a frame that holds its page has no link', async () => {
  const page = await opened(served);
  await page.evaluate((text) => {
    const frame = document.createElement('iframe');
    frame.srcdoc = text;
    document.body.append(frame);
  }, readFileSync(view, 'utf8'));
  const link = page.frameLocator('iframe').locator('[data-save="link"]');
  await link.waitFor({ state: 'attached' });
  assert.ok(!(await link.isVisible()));
});

test('the slider shows other meshes, coarse ones while it is dragged', async () => {
  const page = await ready();
  const slider = page.locator('#length');
  const box = await slider.boundingBox();
  const before = await report(page);
  const y = box.y + box.height / 2;
  const at = (share) => box.x + box.width * share;
  await page.mouse.move(at(0.4), y);
  await page.mouse.down();
  for (let share = 0.4; share <= 0.75; share += 0.05) await page.mouse.move(at(share), y);
  // A mesh is there before the slider is let go, without the figures that take time.
  await until(page, async (vertices) => {
    const { report } = (await window.ndf).viewer;
    return report.vertices !== vertices && report.components === undefined;
  }, before.vertices);
  await page.mouse.up();
  await until(page, async () => {
    const { viewer } = await window.ndf;
    return viewer.report.components !== undefined && !viewer.computing.isBusy;
  });
  const released = await report(page);
  assert.ok(released.vertices > before.vertices, `${released.vertices} vertices after ${before.vertices}`);
  const shown = Number((await page.locator('#length-now').textContent()).replaceAll(',', ''));
  assert.ok(Math.abs(shown - released.target_edge_length) <= 1e-3 * shown);
  assert.match(await page.locator('header p').textContent(), new RegExp(released.vertices.toLocaleString('en')));
});

test('a click shows distances, and one with Shift a path', async () => {
  const page = await ready();
  const { width, height } = page.viewportSize();
  const [x, y] = [(width - 300) / 2, height / 2];
  const picked = await page.evaluate(async ([x, y]) => (await window.ndf).pick(x, y), [x, y]);
  assert.ok(Number.isInteger(picked));
  await page.mouse.click(x, y);
  await until(page, async () => (await window.ndf).viewer.view.kind === 'distance');
  assert.equal(await page.evaluate(async () => (await window.ndf).viewer.source), picked);
  assert.match(await page.locator('ndf-viewer .legend .name').textContent(), /distance/i);
  await page.keyboard.down('Shift');
  await page.mouse.click(x + 60, y - 40);
  await page.keyboard.up('Shift');
  await until(page, async () => (await window.ndf).viewer.path !== undefined);
  const { length, points } = await page.evaluate(async () => {
    const { length, points } = (await window.ndf).viewer.path;
    return { length, points: [...points] };
  });
  let sum = 0;
  for (let i = 3; i < points.length; i += 3) sum += Math.hypot(points[i] - points[i - 3], points[i + 1] - points[i - 2], points[i + 2] - points[i - 1]);
  assert.ok(Math.abs(sum - length) <= 0.05 * length, `${sum} along the corners of a path of ${length}`);
  assert.match(await page.locator('#path dd').textContent(), /\d/);
  // Nothing beside the surface.
  assert.equal(await page.evaluate(async () => (await window.ndf).pick(2, 790)), undefined);
});

test('modes, wireframe, help and turning by keys', async () => {
  const page = await ready();
  await page.keyboard.press('m');
  await until(page, async () => (await window.ndf).viewer.view.kind === 'mode');
  await page.locator('#mode').fill('3');
  await until(page, async () => (await window.ndf).viewer.view.index === 3);
  await page.keyboard.press('w');
  assert.equal(await page.evaluate(async () => (await window.ndf).viewer.wireframe), true);
  const picture = () => page.evaluate(async () => (await (await window.ndf).screenshot()).size);
  const before = await picture();
  await page.locator('ndf-viewer canvas').focus();
  for (let i = 0; i < 6; i++) await page.keyboard.press('ArrowRight');
  assert.notEqual(await picture(), before);
  await page.keyboard.press('?');
  assert.ok(await page.locator('dialog').isVisible());
  await page.keyboard.press('Escape');
  assert.ok(!(await page.locator('dialog').isVisible()));
});

test('files are written, and the GLB is valid', async () => {
  const page = await ready();
  const glb = await page.evaluate(async () => {
    const ndf = await window.ndf;
    await ndf.geodesic(0);
    return [...new Uint8Array(await ndf.exportGLB())];
  });
  const found = await validator.validateBytes(Uint8Array.from(glb));
  assert.deepEqual([found.issues.numErrors, found.issues.numWarnings], [0, 0], JSON.stringify(found.issues.messages));
  assert.equal(found.info.totalVertexCount, (await report(page)).vertices);
  for (const format of ['glb', 'ply', 'png']) {
    const download = page.waitForEvent('download');
    await page.locator(`[data-save="${format}"]`).click();
    assert.equal((await download).suggestedFilename(), `sphere_version_2.${format}`);
    const written = readFileSync(await (await download).path());
    assert.ok(written.length > 1000);
  }
});

test('a link holds the model, and other files are opened', async () => {
  const page = await ready();
  const other = golden('scalars_version_3');
  await page.locator('#file').setInputFiles(other);
  await until(page, async () => (await window.ndf).viewer.description.name === 'scalars_version_3.ndf');
  const [{ name }] = (await page.evaluate(async () => (await window.ndf).viewer.description)).scalars;
  await page.locator('[data-view="scalar"]').click();
  await until(page, async () => (await window.ndf).viewer.view.kind === 'scalar');
  assert.deepEqual(await shownView(page), { kind: 'scalar', name });
  const link = `${pathToFileURL(view).href}#m=${readFileSync(other).toString('base64url')}`;
  const linked = await opened(link);
  const description = await linked.evaluate(async () => (await window.ndf).viewer.description);
  assert.deepEqual([description.kind, description.bytes], ['model', readFileSync(other).length]);
});

test('a damaged file is told, and what was shown stays', async () => {
  const page = await ready();
  const before = await report(page);
  await page.locator('#file').setInputFiles({ name: 'bad.ndf', mimeType: '', buffer: Buffer.from('nothing of use') });
  await until(page, () => document.querySelector('.toast').textContent.includes('bad.ndf'));
  assert.deepEqual(await report(page), before);
});

test('a mesh with scalars is shown with one of them, from its source', async () => {
  const mesh = place('torus.ply');
  ndf('sample', 'mesh', '--shape', 'torus', '-o', mesh);
  const withDistances = place('with-distances.ply');
  ndf('geodesic', mesh, '-o', withDistances, '--source-vertex', 5);
  const shown = place('torus.html');
  ndf('view', withDistances, '-o', shown, '--scalar', 'distance');
  const page = await opened(pathToFileURL(shown).href);
  await page.evaluate(() => window.ndf.then(() => undefined));
  assert.deepEqual(await shownView(page), { kind: 'scalar', name: 'distance' });
  const ours = await page.evaluate(async () => [...(await (await window.ndf).geodesic(5))]);
  assert.equal(difference(ours, readPly(withDistances).scalars.distance), 0);
  assert.ok(!(await page.locator('#fineness').isVisible()));
});

test('on a phone a tap shows distances', async () => {
  const page = await ready({ viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true, deviceScaleFactor: 2 });
  await page.touchscreen.tap(195, 340);
  await until(page, async () => (await window.ndf).viewer.view.kind === 'distance');
  const wide = await page.evaluate(() => document.documentElement.scrollWidth);
  assert.ok(wide <= 390, `the page is ${wide} pixels wide`);
});

test('without WebGL or WebAssembly there is a message', async () => {
  const url = pathToFileURL(view).href;
  const text = async (prepare) => {
    const page = await opened(url, {}, prepare);
    await until(page, () => document.querySelector('#first')?.textContent !== 'Loading…');
    const message = page.locator('ndf-viewer .message');
    return (await page.locator('#first').count()) ? page.locator('#first').textContent() : message.textContent();
  };
  assert.match(await text(() => delete window.WebAssembly), /WebAssembly/);
  const withoutWebGL = () => {
    HTMLCanvasElement.prototype.getContext = () => null;
  };
  assert.match(await text(withoutWebGL), /WebGL 2/);
});

test('a Worker that is started again computes on the mesh that is shown', async () => {
  const page = await modules();
  const found = await page.evaluate(async () => {
    document.body.append(viewer);
    const { default_edge_length: usual } = await viewer.open(files.model, 'model.ndf');
    const { report } = await viewer.setEdgeLength(0.6 * usual);
    const modes = failure(viewer.modes(20));
    const refused = await failure(viewer.setEdgeLength(1e-9));
    const distances = await viewer.showDistances(0);
    return { shown: report.vertices, modes: await modes, refused, distances: distances.length, now: viewer.report.vertices };
  });
  assert.match(found.modes, /Abandoned/);
  assert.match(found.refused, /triangles/);
  assert.deepEqual([found.distances, found.now], [found.shown, found.shown]);
});

test('the last of several files and edge lengths is shown', async () => {
  const page = await modules();
  const found = await page.evaluate(async () => {
    viewer.setAttribute('edge-length', '0.5');
    document.body.append(viewer);
    viewer.setAttribute('edge-length', '0.4');
    const first = failure(viewer.open(files.model, 'first.ndf'));
    await viewer.open(files.mesh, 'second.obj');
    const overtaken = [await first];
    const { name, default_edge_length: usual } = await viewer.open(files.model, 'third.ndf');
    const lengths = [usual, 0.9 * usual, 0.8 * usual];
    const extracted = await Promise.allSettled(lengths.map((length) => viewer.setEdgeLength(length)));
    overtaken.push(...extracted.slice(0, 2).map(({ reason }) => reason.name));
    return { overtaken, name, told, vertices: extracted[2].value.report.vertices, now: viewer.report.vertices };
  });
  found.overtaken.forEach((reason) => assert.match(reason, /Abandoned/));
  assert.deepEqual([found.name, found.now, found.told], ['third.ndf', found.vertices, []]);
});

test('small meshes have as many modes as vertices, and further modes are kept', async () => {
  const page = await modules();
  const found = await page.evaluate(async () => {
    document.body.append(viewer);
    await viewer.open(files.mesh, 'mesh.obj');
    await viewer.showMode(9);
    const small = [viewer.view, viewer.lastMode];
    await viewer.open(files.model, 'model.ndf');
    await viewer.showMode(20);
    const started = viewer.lastMode;
    const [a, b] = [await viewer.modes(40), await viewer.modes(21)];
    return { small, started, kept: a.functions[20] === b.functions[20], counts: [a.values.length, b.values.length] };
  });
  assert.deepEqual(found, { small: [{ kind: 'mode', index: 3 }, 3], started: 39, kept: true, counts: [40, 21] });
});

test('an element that is taken out and put back shows what it showed', async () => {
  const page = await modules();
  const found = await page.evaluate(async () => {
    document.body.append(viewer);
    const { default_edge_length: usual } = await viewer.open(files.model, 'model.ndf');
    const { report } = await viewer.setEdgeLength(1.5 * usual);
    viewer.remove();
    let changes = 0;
    viewer.addEventListener('ndf-change', () => changes++);
    document.body.append(viewer);
    while (changes === 0) await new Promise((resolve) => setTimeout(resolve, 20));
    // A press of a key is heard once.
    const [before, after] = [viewer.report.vertices, report.vertices];
    let asked = 0;
    viewer.addEventListener('ndf-busy', ({ detail }) => (asked += detail === 'measuring'));
    viewer.shadowRoot.querySelector('canvas').dispatchEvent(new KeyboardEvent('keydown', { key: 'Enter' }));
    const other = new NdfViewer();
    other.setAttribute('src', '/model.ndf');
    let began = 0;
    other.addEventListener('ndf-busy', () => began++);
    document.body.append(other);
    other.remove();
    await new Promise((resolve) => setTimeout(resolve, 500));
    return { before, after, asked, began };
  });
  assert.deepEqual([found.before, found.asked, found.began], [found.after, 1, 0]);
});

test('a freed Worker rejects, and meshes far from the origin are drawn and picked', async () => {
  const page = await modules();
  const found = await page.evaluate(async () => {
    const surface = await WorkerSurface.open(files.mesh, 'mesh.obj');
    surface.free();
    const freed = await failure(surface.report());
    document.body.append(viewer);
    const far = new TextDecoder().decode(files.mesh).replaceAll(/^v (\d) /gm, (_, x) => `v ${5e6 + 0.01 * x} `);
    await viewer.open(new TextEncoder().encode(far.replaceAll(/^(v \S+) (\d) (\d)/gm, (_, x, y, z) => `${x} ${0.01 * y} ${0.01 * z}`)), 'far.obj');
    const { left, top, width, height } = viewer.getBoundingClientRect();
    const picked = viewer.pick(left + width / 2, top + height / 2);
    const nearest = [[5e6, 0, 0], [5e6 + 0.01, 0, 0], [5e6, 0.01, 0], [5e6, 0, 0.01]].map((place) => viewer.nearest(place));
    return { freed, picked, nearest };
  });
  assert.match(found.freed, /Abandoned/);
  assert.ok(Number.isInteger(found.picked));
  assert.deepEqual(found.nearest, [0, 1, 2, 3]);
});

test('after a trap another Worker goes on', async () => {
  const page = await modules();
  const found = await page.evaluate(async () => {
    const answer = "{ id, ...(open ? { result: {} } : { error: 'broke off', isTrapped: true }) }";
    const code = URL.createObjectURL(new Blob([`onmessage = ({ data: { id, open } }) => postMessage(${answer})`]));
    let started = 0;
    const worker = () => {
      started++;
      return new Worker(code);
    };
    const surface = await WorkerSurface.open(files.mesh, 'mesh.obj', { worker });
    return { told: [await failure(surface.report()), await failure(surface.report())], started };
  });
  assert.deepEqual(found, { told: Array(2).fill('Error: broke off'), started: 3 });
});
