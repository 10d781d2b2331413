/** The npm package in Node, against the program. */

import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { Surface, init } from 'ndf-geometry';
import { NDFLoader } from 'ndf-geometry/three';
import { colours, readable, roundStep, scaleOf } from '../lib/viewer/colours.js';
import { assertSameReport, difference, folder, golden, ndf, readPly, tetrahedron } from './helpers.mjs';

const place = folder();

for (const name of ['sphere_version_2', 'levels_version_3', 'scalars_version_3']) {
  test(`${name}: extraction and distances are those of the program`, async () => {
    const surface = await Surface.open(readFileSync(golden(name)), `${name}.ndf`);
    const description = surface.describe();
    const length = 0.75 * description.default_edge_length;
    const found = surface.extract(length);
    const mesh = place(`${name}.ply`);
    const figures = ndf('extract', golden(name), '-o', mesh, '--edge-length', length, '--double');
    const written = readPly(mesh);
    assert.equal(found.report.vertices, figures.vertices);
    assert.deepEqual([...found.faces], written.faces);
    assert.equal(difference(surface.positions(), written.positions), 0);
    assertSameReport(found.report, figures);

    // Lengths as they are: the factors of a metric are of the model, and the mesh has none.
    const factor = description.distance_factor ?? 1;
    const [from, to] = [0, Math.floor(figures.vertices / 2)];
    const distances = place(`${name}-distances.ply`);
    const target = written.positions.slice(3 * to, 3 * to + 3);
    const { path } = ndf('geodesic', mesh, '-o', distances, '--source-vertex', from, '--path-to', target.join(','));
    const theirs = readPly(distances).scalars.distance;
    const ours = surface.geodesic(from);
    const farthest = Math.max(...theirs);
    assert.ok(difference(ours, theirs.map((d) => Math.fround(d * factor))) <= (factor === 1 ? 0 : 1e-6 * farthest));
    const mine = surface.path(from, to);
    assert.ok(Math.abs(mine.length - path.length * factor) <= 1e-9 * path.length);
    assert.equal(mine.points.length, 3 * path.points.length);

    const modes = surface.modes(6);
    const spectrum = ndf('spectrum', mesh, '-o', place(`${name}-modes.ply`), '--modes', 6);
    const scaled = spectrum.eigenvalues.map((value) => value / factor ** 2);
    assert.ok(difference(modes.values, scaled) <= 1e-6 * (factor === 1 ? 1 : 1e4) * scaled.at(-1));
    assert.deepEqual(modes.functions.map((f) => f.length), Array(6).fill(figures.vertices));
    for (const { name: scalar, min, max } of surface.describe().scalars) {
      const values = surface.scalar(scalar);
      assert.equal(values.length, figures.vertices);
      assert.ok(values.every((value) => value >= Math.fround(min) && value <= Math.fround(max)));
    }
    surface.free();
  });
}

test('a relative edge length is one in the box of the model', async () => {
  const surface = await Surface.open(readFileSync(golden('levels_version_3')));
  const { scale, default_edge_length: usual } = surface.describe();
  const { report } = surface.extract(usual / scale, { relative: true });
  assert.ok(Math.abs(report.target_edge_length - usual) <= 1e-12 * usual);
});

test('meshes are taken as they are, and files are written', async () => {
  const surface = await Surface.open(tetrahedron, 'tetrahedron.obj');
  assert.equal(surface.describe().kind, 'mesh');
  assert.deepEqual([...surface.mesh().faces], [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]);
  const values = surface.geodesic(0);
  assert.deepEqual([...values], [0, 1, 1, 1]);
  const again = await Surface.open(surface.file('ply', { name: 'distance', values }), 'again.ply');
  assert.deepEqual(again.describe().scalars, [{ name: 'distance', min: 0, max: 1 }]);
  assert.deepEqual(again.scalar('distance'), values);
  assert.throws(() => surface.extract(0.1), /mesh/);
});

test('what is wrong is said', async () => {
  await init();
  await assert.rejects(Surface.open(new Uint8Array([1, 2, 3]), 'x.ndf'), /x\.ndf is not a mesh file/);
  const damaged = readFileSync(golden('levels_version_3')).subarray(0, 200);
  await assert.rejects(Surface.open(damaged, 'damaged.ndf'), /damaged\.ndf: /);
  const surface = await Surface.open(readFileSync(golden('sphere_version_2')));
  const { scale, default_edge_length: usual } = surface.describe();
  assert.notEqual(scale, 1);
  // In the unit in which it was given.
  for (const relative of [false, true]) assert.throws(() => surface.extract(-1.5, { relative }), /edge length .* not -1\.5/);
  assert.throws(() => surface.extract(1e-9), /more than 4,000,000 triangles; the shortest possible is about \d/);
  assert.throws(() => surface.extract('fine'), /edge length should be a number, and is "fine"/);
  assert.throws(() => surface.geodesic(4e9 >>> 0), /vertex/);
  for (const wrong of [undefined, null, '1', -1, 0.5, NaN, 1e12]) {
    for (const call of [() => surface.geodesic(wrong), () => surface.path(0, wrong), () => surface.modes(wrong)]) {
      assert.throws(call, /^(RangeError|TypeError): .* should be a whole number/);
    }
  }
  assert.throws(() => surface.modes(1e9), /1000000000 modes requested, but the surface has only \d+ vertices/);
  assert.throws(() => surface.scalar('none'), /no scalar none/);
  assert.throws(() => surface.scalar(), /the name of a scalar should be a text, and is undefined/);
  assert.throws(() => surface.file(), /the format should be a text/);
  assert.throws(() => surface.file('obj'), /ply and glb are/);
  await assert.rejects(Surface.open(), /the file should be a Uint8Array, and is undefined/);
  assert.throws(() => new NDFLoader().parse(), /the file should be an ArrayBuffer/);
  // And afterwards all goes on.
  assert.ok(surface.extract().report.faces > 0);
});

test('the loader of three.js makes a geometry', async () => {
  await init();
  const { buffer } = Uint8Array.from(readFileSync(golden('scalars_version_3')));
  const geometry = new NDFLoader().parse(buffer, 'scalars.ndf');
  const { vertices, faces } = geometry.userData.report;
  assert.equal(geometry.getAttribute('position').count, vertices);
  assert.equal(geometry.index.count, 3 * faces);
  for (const { name } of geometry.userData.description.scalars) assert.equal(geometry.getAttribute(`_${name}`).count, vertices);
});

test('a surface that is opened coarsely is the same', async () => {
  const bytes = readFileSync(golden('levels_version_3'));
  const [coarse, usual] = [await Surface.open(bytes, 'a.ndf', { coarse: true }), await Surface.open(bytes, 'a.ndf')];
  assert.ok(coarse.mesh().faces.length < usual.mesh().faces.length);
  const [{ min_edge_length: estimated, ...ours }, { min_edge_length: known, ...theirs }] = [coarse.describe(), usual.describe()];
  assert.deepEqual(ours, theirs);
  assert.ok(estimated > 0.5 * known && estimated < 2 * known);
  assert.deepEqual(coarse.extract(undefined, { report: false }).faces, usual.mesh().faces);
});

test('the package has its licences, and types of its element', () => {
  const packed = execFileSync('npm', ['pack', '--dry-run', '--json', '--offline'], { cwd: new URL('..', import.meta.url), encoding: 'utf8' });
  const files = JSON.parse(packed)[0].files.map(({ path }) => path);
  for (const file of ['LICENSE-MIT', 'LICENSE-APACHE', 'README.md', 'lib/index.js', 'lib/worker.js']) assert.ok(files.includes(file), file);
  const types = readFileSync(new URL('../lib/viewer/element.d.ts', import.meta.url), 'utf8');
  assert.match(types, /interface HTMLElementTagNameMap \{\s*'ndf-viewer': NdfViewer/);
});

test('a scalar of the name of an attribute does not replace it', async () => {
  const surface = await Surface.open(tetrahedron, 'tetrahedron.obj');
  const file = surface.file('ply', { name: 'position', values: Float32Array.of(1, 2, 3, 4) });
  const geometry = new NDFLoader().parse(file.buffer, 'named.ply');
  assert.equal(geometry.getAttribute('position').itemSize, 3);
  assert.deepEqual([...geometry.getAttribute('_position').array], [1, 2, 3, 4]);
});

test('colours and numbers of the viewer', () => {
  assert.deepEqual([...colours('viridis', 256).slice(0, 4)], [0x44, 0x01, 0x54, 255]);
  assert.deepEqual([...colours('redblue', 3).slice(4, 8)], [0xf7, 0xf7, 0xf7, 255]);
  assert.deepEqual(scaleOf(Float32Array.of(0, 2, Infinity, NaN), 'auto'), { low: 0, high: 2, map: 'viridis' });
  assert.deepEqual(scaleOf(Float32Array.of(-1, 3), 'auto'), { low: -3, high: 3, map: 'redblue' });
  assert.deepEqual(scaleOf(new Float32Array(), 'magma'), { low: 0, high: 0, map: 'magma' });
  assert.deepEqual([0.013, 0.05, 7, 0].map(roundStep), [0.02, 0.05, 10, 0]);
  assert.deepEqual([0.12345, -2, 1e-5, 123456, Infinity].map(readable), ['0.1235', '−2', '1.00e−5', '123,500', '∞']);
});
