/**
 * Builds the npm package into `lib` and, unless that is all that is asked for (`lib`), the page into `dist/view.html`. `cargo xtask web` calls it, after it has put the
 * WebAssembly of two crates and its JavaScript into `src/wasm`.
 */

import { execFileSync } from 'node:child_process';
import { cpSync, mkdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { basename, dirname, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { deflateRawSync } from 'node:zlib';
import { build, transform } from 'esbuild';
import lzma from 'lzma';

const here = dirname(fileURLToPath(import.meta.url));
const path = (...parts) => resolve(here, ...parts);

/** The page may not be larger, without a model. */
const MAX_PAGE = 1_000_000;

const bundling = {
  bundle: true,
  minify: true,
  format: 'iife',
  target: ['chrome109', 'firefox113', 'safari16.4'],
  legalComments: 'none',
  write: false,
  // The page hands the WebAssembly and the Worker over; nothing lies beside it.
  define: { 'import.meta.url': '""', process: 'undefined' },
  logLevel: 'warning',
};

/** `worker:FILE` is the bundled code of a file as text. */
const workers = {
  name: 'workers',
  setup(esbuild) {
    esbuild.onResolve({ filter: /^worker:/ }, (found) => ({
      path: resolve(dirname(found.importer), found.path.slice('worker:'.length)),
      namespace: 'worker',
    }));
    esbuild.onLoad({ filter: /.*/, namespace: 'worker' }, async ({ path }) => {
      const bundled = await build({ ...bundling, entryPoints: [path] });
      return { contents: bundled.outputFiles[0].text, loader: 'text' };
    });
  },
};

/** A third less than deflated; the crate in `unpack` unpacks it. */
const packed = (bytes) => Buffer.from(lzma.compress(bytes, 9)).toString('base64');

async function page() {
  const code = await build({
    ...bundling,
    globalName: 'ndfPage',
    entryPoints: [path('src/page/main.ts')],
    plugins: [workers],
  });
  const boot = await build({ ...bundling, entryPoints: [path('src/page/boot.ts')] });
  const style = await transform(readFileSync(path('src/page/style.css')), { loader: 'css', minify: true });
  const parts = {
    '/*style*/': style.code.trim(),
    '/*boot*/': boot.outputFiles[0].text.trim(),
    '<!--ndf:unpack-->': deflateRawSync(readFileSync(path('src/wasm/ndf_unpack_bg.wasm')), { level: 9 }).toString('base64'),
    '<!--ndf:wasm-->': packed(readFileSync(path('src/wasm/ndf_web_bg.wasm'))),
    '<!--ndf:code-->': packed(code.outputFiles[0].contents),
  };
  let html = readFileSync(path('src/page/index.html'), 'utf8');
  for (const [mark, part] of Object.entries(parts)) html = html.replace(mark, () => part);
  mkdirSync(path('dist'), { recursive: true });
  writeFileSync(path('dist/view.html'), html);
  if (Buffer.byteLength(html) > MAX_PAGE) {
    throw new Error(`dist/view.html has ${Buffer.byteLength(html)} bytes, more than ${MAX_PAGE}`);
  }
}

function library() {
  rmSync(path('lib'), { recursive: true, force: true });
  const tsc = path('node_modules/typescript/bin/tsc');
  execFileSync(process.execPath, [tsc, '--noEmit', '-p', path('tsconfig.json')], { stdio: 'inherit', cwd: here });
  execFileSync(process.execPath, [tsc, '-p', path('tsconfig.lib.json')], { stdio: 'inherit', cwd: here });
  mkdirSync(path('lib/wasm'), { recursive: true });
  for (const file of ['ndf_web.js', 'ndf_web.d.ts', 'ndf_web_bg.wasm']) {
    cpSync(path('src/wasm', file), path('lib/wasm', basename(file)));
  }
  // Three.js, as a peer, is not in the package, and so neither is its licence.
  for (const licence of ['LICENSE-APACHE', 'LICENSE-MIT']) cpSync(path('..', licence), path(licence));
}

const [what] = process.argv.slice(2);
library();
if (what !== 'lib') await page();
