/** The page of `ndf view` in Chromium, opened from the disk, against the program; and the element in a served page. */

import assert from 'node:assert/strict';
import { cpSync, mkdirSync, readFileSync, symlinkSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { after, before, test } from 'node:test';
import { fileURLToPath, pathToFileURL } from 'node:url';
import { build } from 'esbuild';
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
  const file = () => {
    if (url === '/model.ndf') return model;
    return url.startsWith('/bundled/') ? place(url.slice(1)) : fileURLToPath(new URL(`..${url}`, import.meta.url));
  };
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
  // What is said meanwhile does not move the slider away under the pointer.
  assert.match(await page.locator('#length-now').textContent(), /≈ [\d,]+ faces/);
  assert.deepEqual(await slider.boundingBox(), box);
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
  for (const viewport of [{ width: 1200, height: 800 }, { width: 360, height: 640 }]) {
    const page = await opened(url, { viewport }, withoutWebGL);
    await page.evaluate(() => window.ndf.then(() => undefined));
    assert.ok(!(await page.locator('.toast').isVisible()), 'it is said twice');
    const covering = await page.evaluate(() => {
      const message = document.querySelector('ndf-viewer').shadowRoot.querySelector('.message');
      const range = document.createRange();
      range.selectNodeContents(message);
      const { left, right, top, bottom } = range.getBoundingClientRect();
      const isOver = (box) => box.left < right && box.right > left && box.top < bottom && box.bottom > top;
      return ['header', '.panel', '.toast'].filter((part) => isOver(document.querySelector(part).getBoundingClientRect()));
    });
    assert.deepEqual(covering, []);
    // What needs no picture is there nevertheless.
    assert.ok((await report(page)).components > 0);
  }
});

test('a picture that the graphics card lost is drawn again', async () => {
  const page = await ready();
  const same = await page.evaluate(async () => {
    const { viewer } = await window.ndf;
    await viewer.showDistances(0);
    const canvas = viewer.shadowRoot.querySelector('canvas');
    const context = canvas.getContext('webgl2');
    // What was just drawn: it is there until the page is composed.
    const pixels = () => {
      const bytes = new Uint8Array(4 * canvas.width * canvas.height);
      context.readPixels(0, 0, canvas.width, canvas.height, context.RGBA, context.UNSIGNED_BYTE, bytes);
      return bytes;
    };
    viewer.screenshot();
    const before = pixels();
    const extension = context.getExtension('WEBGL_lose_context');
    const heard = (name) => new Promise((resolve) => canvas.addEventListener(name, resolve, { once: true }));
    const lost = heard('webglcontextlost');
    extension.loseContext();
    await lost;
    await new Promise((resolve) => setTimeout(resolve, 50));
    let after;
    canvas.addEventListener('webglcontextrestored', () => (after = pixels()), { once: true });
    const restored = heard('webglcontextrestored');
    extension.restoreContext();
    await restored;
    if (before.every((byte) => byte === 0)) return false;
    return before.length === after.length && before.every((byte, i) => Math.abs(byte - after[i]) <= 2);
  });
  assert.ok(same);
});

test('an edge length that memory does not hold is told, and the last mesh comes back', async () => {
  const page = await modules();
  const found = await page.evaluate(async () => {
    document.body.append(viewer);
    const { default_edge_length: usual } = await viewer.open(files.model, 'model.ndf');
    const { report } = await viewer.setEdgeLength(0.7 * usual);
    await viewer.showDistances(9);
    const dragged = await viewer.setEdgeLength(8 * usual, { isFinal: false });
    const { kind } = viewer.view;
    const refused = await failure(viewer.setEdgeLength(1e-9));
    const distances = await viewer.computing.geodesic(viewer.source);
    return { report, dragged: dragged.report.vertices, kind, refused, now: viewer.report, source: viewer.source, distances: distances.length };
  });
  assert.ok(found.dragged < found.report.vertices);
  assert.match(found.refused, /more than 4,000,000 triangles; the shortest possible is about \d/);
  assert.deepEqual({ ...found.now, seconds: 0 }, { ...found.report, seconds: 0 });
  // Distances stay while the edge length is dragged, and where they are from comes back, too.
  assert.deepEqual([found.kind, found.source, found.distances], ['distance', 9, found.report.vertices]);
});

test('the slider ends where memory does, and says so', async () => {
  const page = await ready();
  assert.ok(!(await page.locator('#length-end').isVisible()));
  const shortest = await page.evaluate(async () => {
    const { viewer } = await window.ndf;
    const { description } = viewer;
    const shortest = description.base_edge_length / 5;
    Object.defineProperty(viewer, 'description', { value: { ...description, min_edge_length: shortest } });
    viewer.dispatchEvent(new CustomEvent('ndf-change'));
    return shortest;
  });
  assert.match(await page.locator('#length-end').textContent(), /4 million faces/);
  await page.locator('#length').focus();
  await page.keyboard.press('End');
  await until(page, async () => (await window.ndf).viewer.report.components !== undefined && !(await window.ndf).viewer.computing.isBusy);
  const { target_edge_length: length } = await report(page);
  assert.ok(length >= shortest && length < 1.2 * shortest, `${length} of ${shortest}`);
});

test('keys that come faster than meshes and modes are all counted', async () => {
  const page = await ready();
  const place = () => page.locator('#length').inputValue().then(Number);
  const before = await place();
  const pressed = (key, times) => page.evaluate(([key, times]) => {
    for (let i = 0; i < times; i++) dispatchEvent(new KeyboardEvent('keydown', { key }));
  }, [key, times]);
  await pressed('[', 4);
  await until(page, async () => (await window.ndf).viewer.report.components !== undefined && !(await window.ndf).viewer.computing.isBusy);
  const after = await place();
  assert.ok(Math.abs(after - before + 160) <= 2, `${before}, then ${after}`);
  await page.keyboard.press('m');
  await pressed('.', 4);
  await until(page, async () => (await window.ndf).viewer.view.index === 5);
  assert.equal(await page.locator('#mode-now').textContent(), '5');
});

test('the length of a path stands beside modes, too', async () => {
  const page = await ready();
  await page.keyboard.press('m');
  await until(page, async () => (await window.ndf).viewer.view.kind === 'mode');
  await page.evaluate(async () => void (await (await window.ndf).path(0, 50)));
  assert.deepEqual(await shownView(page), { kind: 'mode', index: 1 });
  assert.match(await page.locator('#path dd').innerText(), /\d/);
});

test('what is wrong with arguments is said, and a message goes once something succeeds', async () => {
  const page = await ready();
  const told = await page.evaluate(async () => {
    const ndf = await window.ndf;
    const failure = async (work) => {
      try {
        await work();
        return 'nothing';
      } catch (error) {
        return `${error instanceof Error} ${error.message}`;
      }
    };
    return Promise.all([
      () => ndf.pick(), () => ndf.pick(1, NaN), () => ndf.geodesic(), () => ndf.path(0), () => ndf.setEdgeLength(),
      () => ndf.extract('fine'), () => ndf.modes(), () => ndf.modes(1e12), () => ndf.modes(1e9), () => ndf.viewer.nearest(), () => ndf.viewer.showMode(),
    ].map(failure));
  });
  for (const message of told) assert.match(message, /^true .*(should be a (whole )?number|modes requested, but)/);
  await page.locator('#file').setInputFiles({ name: 'bad.ndf', mimeType: '', buffer: Buffer.from('nothing of use') });
  await until(page, () => document.querySelector('.toast').textContent.includes('bad.ndf'));
  assert.ok(await page.locator('.toast').isVisible());
  await page.keyboard.press('d');
  await until(page, async () => (await window.ndf).viewer.view.kind === 'distance');
  assert.ok(!(await page.locator('.toast').isVisible()));
});

test('the help can be read on phones', async () => {
  for (const viewport of [{ width: 390, height: 844 }, { width: 360, height: 640 }]) {
    const page = await ready({ viewport, hasTouch: true, isMobile: true });
    await page.evaluate(() => dispatchEvent(new KeyboardEvent('keydown', { key: '?' })));
    const boxes = await page.evaluate(() => {
      const dialog = document.querySelector('dialog');
      const { left, right, top, bottom } = dialog.getBoundingClientRect();
      const cut = [...dialog.querySelectorAll('td')].filter((cell) => cell.scrollWidth > cell.clientWidth).map((cell) => cell.textContent);
      return { isInside: left >= 0 && top >= 0 && right <= innerWidth && bottom <= innerHeight, cut, wide: dialog.scrollWidth - dialog.clientWidth };
    });
    assert.deepEqual(boxes, { isInside: true, cut: [], wide: 0 });
  }
});

test('attributes that are taken away, empty or wrong are as none', async () => {
  const page = await modules();
  const found = await page.evaluate(async () => {
    const settled = async () => {
      await new Promise((resolve) => setTimeout(resolve, 20));
      while (viewer.report.components === undefined || viewer.computing.isBusy) await new Promise((resolve) => setTimeout(resolve, 20));
      return [viewer.report.target_edge_length, viewer.view.kind];
    };
    viewer.setAttribute('src', '/model.ndf');
    viewer.setAttribute('source', '');
    viewer.setAttribute('edge-length', 'fine');
    document.body.append(viewer);
    await viewer.ready;
    const usual = viewer.description.default_edge_length;
    const states = [await settled()];
    for (const [name, value] of [['edge-length', String(0.8 * usual)], ['source', '3'], ['edge-length', ''], ['source', 'here'], ['source', '4'], ['source', null], ['edge-length', '-1']]) {
      if (value === null) viewer.removeAttribute(name);
      else viewer.setAttribute(name, value);
      states.push(await settled());
    }
    viewer.removeAttribute('src');
    const cleared = [viewer.description, viewer.report, viewer.bytes.length, viewer.message];
    return { usual, states, told, cleared };
  });
  const { usual } = found;
  assert.deepEqual(found.states, [
    [usual, 'plain'], [0.8 * usual, 'plain'], [0.8 * usual, 'distance'], [usual, 'distance'], [usual, 'plain'], [usual, 'distance'], [usual, 'plain'], [usual, 'plain'],
  ]);
  assert.deepEqual(found.told, ['edge-length="fine"', 'source="here"', 'edge-length="-1"'].map((what) =>
    `${what} is not ${what.startsWith('source') ? 'the number of a vertex' : 'a length'}, and is left out`));
  assert.deepEqual(found.cleared, [undefined, undefined, 0, undefined]);
});

test('an element that is moved while another file is opened shows that file', async () => {
  const page = await modules();
  const found = await page.evaluate(async () => {
    document.body.append(viewer);
    await viewer.open(files.model, 'first.ndf');
    const moved = () => document.body.prepend(viewer);
    const opening = viewer.open(files.mesh, 'second.obj');
    moved();
    const { name } = await opening;
    const names = [name, viewer.description.name];
    const failing = failure(viewer.open(new Uint8Array([1, 2, 3]), 'bad.ndf'));
    moved();
    const refused = await failing;
    await viewer.ready;
    return { names, refused, now: viewer.description.name };
  });
  assert.deepEqual(found.names, ['second.obj', 'second.obj']);
  assert.match(found.refused, /bad\.ndf/);
  assert.equal(found.now, 'second.obj');
});

test('a coarse mesh is shown first', async () => {
  const page = await modules();
  const found = await page.evaluate(async () => {
    document.body.append(viewer);
    const faces = [];
    viewer.addEventListener('ndf-change', () => faces.push(viewer.report.faces));
    await viewer.open(files.model, 'model.ndf');
    return faces;
  });
  assert.ok(found[0] < found.at(-1), String(found));
});

test('what esbuild makes of the package runs', async () => {
  // Installed by a link, as npm would install it.
  mkdirSync(place('node_modules'), { recursive: true });
  symlinkSync(fileURLToPath(new URL('..', import.meta.url)), place('node_modules/ndf-geometry'), 'dir');
  const entry = place('app.js');
  writeFileSync(entry, "export * from 'ndf-geometry'; export { NDFLoader } from 'ndf-geometry/three'; import 'ndf-geometry/viewer';");
  const { warnings } = await build({
    entryPoints: { app: entry, worker: fileURLToPath(new URL('../lib/worker.js', import.meta.url)) },
    nodePaths: [fileURLToPath(new URL('../node_modules', import.meta.url))],
    bundle: true, format: 'esm', outdir: place('bundled'), logLevel: 'silent',
  });
  assert.deepEqual(warnings, []);
  cpSync(new URL('../lib/wasm/ndf_web_bg.wasm', import.meta.url), place('bundled/wasm/ndf_web_bg.wasm'));
  const page = await modules();
  const found = await page.evaluate(async () => {
    const { Surface, WorkerSurface, NDFLoader } = await import('/bundled/app.js');
    const [here, there] = [await Surface.open(files.model), await WorkerSurface.open(files.model)];
    const { index } = await new NDFLoader().loadAsync('/model.ndf');
    return [here.mesh().faces.length, (await there.mesh()).faces.length, index.count];
  });
  assert.ok(found[0] > 0);
  assert.deepEqual(found, Array(3).fill(found[0]));
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
    await viewer.ready;
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
