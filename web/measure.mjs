/**
 * Measures sizes and seconds, and writes the tables of `docs/web.md`: `cargo xtask web measure [--model FILE] [--runs N]
 * [--lengths 0.05,0.02,0.01] [--print]`. Native programs run on one thread; seconds are medians.
 */

import { existsSync, mkdirSync, readFileSync, statSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';
import { parseArgs } from 'node:util';
import { brotliCompressSync, constants, gzipSync } from 'node:zlib';
import lzma from 'lzma';
import { Surface, init } from 'ndf-geometry';
import { browser, folder, ndf } from './test/helpers.mjs';

const { values: options } = parseArgs({
  options: {
    model: { type: 'string' },
    runs: { type: 'string', default: '5' },
    lengths: { type: 'string', default: '0.05,0.02,0.01' },
    print: { type: 'boolean', default: false },
  },
});
const root = fileURLToPath(new URL('..', import.meta.url));
const runs = Number(options.runs);
const lengths = options.lengths.split(',').map(Number);
const place = folder();

/** The model that is measured: what is named, or the built-in shape, which is fitted once. */
function model() {
  if (options.model) return options.model;
  const kept = join(root, 'target', 'web-measure');
  const fitted = join(kept, 'rope.ndf');
  if (!existsSync(fitted)) {
    mkdirSync(kept, { recursive: true });
    const mesh = join(kept, 'rope.ply');
    ndf('sample', 'mesh', '-o', mesh);
    ndf('fit', mesh, '-o', fitted);
  }
  return fitted;
}

const median = (numbers) => [...numbers].sort((a, b) => a - b)[numbers.length >> 1];
const ms = (seconds) => (seconds === undefined ? '–' : `${(1000 * seconds).toFixed(seconds < 0.1 ? 1 : 0)}`);
const kilo = (bytes) => (bytes / 1000).toFixed(1);

/** Bytes as they are, and as servers send them. */
function sizes() {
  const html = readFileSync(join(root, 'web/dist/view.html'));
  const inside = (id) => {
    const text = new RegExp(`id="${id}">([^<]*)<`).exec(html.toString('latin1'))[1];
    return Buffer.from(lzma.decompress(Buffer.from(text, 'base64')));
  };
  const brotli = (bytes) => brotliCompressSync(bytes, { params: { [constants.BROTLI_PARAM_QUALITY]: 11 } }).length;
  const row = (name, bytes) => `| ${name} | ${kilo(bytes.length)} | ${kilo(gzipSync(bytes, { level: 9 }).length)} | ${kilo(brotli(bytes))} |`;
  return [
    '| kB | raw | gzip | brotli |', '|---|---:|---:|---:|',
    row('WebAssembly', inside('wasm')), row('JavaScript with three.js', inside('code')), row('the page without a model', html),
  ].join('\n');
}

/** Seconds of extraction and of distances from vertex 0, by relative edge length. */
const results = new Map(lengths.map((length) => [length, { faces: 0, extract: {}, geodesic: {} }]));

function native(path) {
  for (const [length, result] of results) {
    const mesh = place('native.ply');
    const extract = () => ndf('extract', path, '-o', mesh, '--relative-edge-length', length, '--double', '--threads', 1);
    const extractions = Array.from({ length: runs }, extract);
    const geodesic = () => ndf('geodesic', mesh, '-o', place('distances.ply'), '--source-vertex', 0, '--threads', 1).seconds;
    result.faces = extractions[0].faces;
    result.extract.native = median(extractions.map(({ seconds }) => seconds));
    result.geodesic.native = median(Array.from({ length: runs }, geodesic));
  }
}

async function inNode(path) {
  await init();
  const bytes = readFileSync(path);
  for (const [length, result] of results) {
    const [extractions, distances] = [[], []];
    const surface = Surface.openNow(bytes);
    for (let i = 0; i < runs; i++) {
      extractions.push(surface.extract(length, { relative: true, report: false }).report.seconds);
      const started = performance.now();
      surface.geodesic(0);
      distances.push((performance.now() - started) / 1000);
    }
    surface.free();
    result.extract.node = median(extractions);
    result.geodesic.node = median(distances);
  }
}

async function inChromium(path) {
  const view = place('view.html');
  ndf('view', path, '-o', view);
  const chromium = await browser();
  const [firsts, readies] = [[], []];
  for (let i = 0; i < runs; i++) {
    const page = await chromium.newPage();
    await page.goto(pathToFileURL(view).href);
    const seconds = await page.evaluate(async () => {
      await window.ndf;
      const now = performance.now();
      return [performance.getEntriesByName('ndf-picture')[0].startTime / 1000, now / 1000];
    });
    firsts.push(seconds[0]);
    readies.push(seconds[1]);
    await page.close();
  }
  const page = await chromium.newPage();
  await page.goto(pathToFileURL(view).href);
  for (const [length, result] of results) {
    const found = await page.evaluate(async ([length, runs]) => {
      const { viewer } = await window.ndf;
      const [extractions, distances] = [[], []];
      for (let i = 0; i < runs; i++) {
        extractions.push((await viewer.computing.extract(length, { relative: true, report: false })).report.seconds);
        const started = performance.now();
        await viewer.computing.geodesic(0);
        distances.push((performance.now() - started) / 1000);
      }
      return { extractions, distances };
    }, [length, runs]);
    result.extract.chromium = median(found.extractions);
    result.geodesic.chromium = median(found.distances);
  }
  const version = chromium.version();
  await chromium.close();
  return { first: median(firsts), ready: median(readies), version };
}

const path = model();
native(path);
await inNode(path);
const { first, ready, version } = await inChromium(path);
const row = ([length, { faces, extract, geodesic }]) =>
  `| ${length} | ${faces.toLocaleString('en')} | ${['native', 'node', 'chromium'].map((where) => ms(extract[where])).join(' | ')} | ${['native', 'node', 'chromium'].map((where) => ms(geodesic[where])).join(' | ')} |`;
const tables = [
  sizes(), '',
  `A model of ${kilo(statSync(path).size)} kB, Node ${process.versions.node}, Chromium ${version} drawing in software, one thread; the median of ${runs} runs.`,
  `From opening the page to its first picture: ${first.toFixed(2)} s; to the mesh of the default edge length and its figures: ${ready.toFixed(2)} s.`, '',
  '| relative edge length | faces | extraction, native (ms) | Node | Chromium | distances, native (ms) | Node | Chromium |',
  '|---:|---:|---:|---:|---:|---:|---:|---:|',
  ...[...results].map(row),
].join('\n');
if (options.print) console.log(tables);
else {
  const page = join(root, 'docs/web.md');
  const [beginning, end] = ['<!-- measured by cargo xtask web measure -->\n', '<!-- end -->'];
  const text = readFileSync(page, 'utf8');
  const [from, to] = [text.indexOf(beginning) + beginning.length, text.indexOf(end)];
  writeFileSync(page, `${text.slice(0, from)}${tables}\n${text.slice(to)}`);
}
