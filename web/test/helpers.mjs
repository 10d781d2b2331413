/** What tests and measurements share: the program, its files, and a browser. */

import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { chromium } from 'playwright-core';

/** The program, whose numbers are compared with. */
export const PROGRAM = process.env.NDF_PROGRAM;

/** Models that the repository has. */
export const golden = (name) => fileURLToPath(new URL(`../../ndf-model/tests/golden/${name}.ndf`, import.meta.url));

/** The smallest closed mesh, an OBJ file. */
export const tetrahedron = new TextEncoder().encode('v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n');

/** A folder of its own, which is removed when the process ends. */
export function folder() {
  const made = mkdtempSync(join(tmpdir(), 'ndf-web-'));
  process.on('exit', () => rmSync(made, { recursive: true, force: true }));
  return (name) => join(made, name);
}

/** Runs the program; what it prints as JSON. */
export function ndf(...given) {
  const printed = execFileSync(PROGRAM, [...given.map(String), '--json', '--quiet'], { encoding: 'utf8', maxBuffer: 2 ** 30 });
  return JSON.parse(printed);
}

/** The vertices, faces and scalars of a binary PLY file of triangles as the program writes it. */
export function readPly(path) {
  const bytes = readFileSync(path);
  const end = bytes.indexOf('end_header\n') + 'end_header\n'.length;
  const lines = bytes.subarray(0, end).toString('latin1').split('\n');
  const count = (name) => Number(lines.find((line) => line.startsWith(`element ${name} `))?.split(' ')[2] ?? 0);
  const properties = lines.filter((line) => /^property (float|double) /.test(line)).map((line) => line.split(' ').slice(1));
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let at = end;
  const values = Object.fromEntries(properties.map(([, name]) => [name, []]));
  for (let v = 0; v < count('vertex'); v++) {
    for (const [type, name] of properties) {
      values[name].push(type === 'double' ? view.getFloat64(at, true) : view.getFloat32(at, true));
      at += type === 'double' ? 8 : 4;
    }
  }
  const faces = [];
  for (let f = 0; f < count('face'); f++) {
    at += 1;
    for (let c = 0; c < 3; c++, at += 4) faces.push(view.getUint32(at, true));
  }
  const { x, y, z, ...scalars } = values;
  return { positions: x.flatMap((_, v) => [x[v], y[v], z[v]]), faces, scalars };
}

/** The largest difference of two lists of the same length. */
export function difference(a, b) {
  if (a.length !== b.length) return Infinity;
  let largest = 0;
  for (let i = 0; i < a.length; i++) {
    if (!Object.is(a[i], b[i])) largest = Math.max(largest, Math.abs(a[i] - b[i]));
  }
  return largest;
}

/**
 * Whether a report has the keys and numbers of the program's, seconds apart. Angles are functions of the C library, of which
 * there are several: their last bits may differ.
 */
export function assertSameReport(ours, theirs) {
  const [{ min_angle_deg: angles, ...rest }, { min_angle_deg: expected, ...others }] = [ours, theirs];
  assert.deepEqual({ ...rest, seconds: 0 }, { ...others, seconds: 0 });
  assert.deepEqual(Object.keys(angles).sort(), Object.keys(expected).sort());
  for (const [key, angle] of Object.entries(expected)) assert.ok(Math.abs(angles[key] - angle) <= 1e-12 * angle, key);
}

/** Chromium without a screen, which draws in software. */
export function browser(flags = []) {
  return chromium.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    args: [
      '--no-sandbox', '--disable-gpu', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-quic',
      '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync', ...flags,
    ],
  });
}
