/** The first that runs: unpacks the rest of the page, or says why it cannot. */

import { decodeLzma } from './lzma.js';

/** What the unpacked code leaves behind. */
declare const ndfPage: typeof import('./main.js');

const text = (id: string) => document.getElementById(id)!.textContent!;
const fromBase64 = (text: string) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

function say(message: string): void {
  const first = document.getElementById('first');
  if (first) first.textContent = message;
}

async function inflated(bytes: Uint8Array<ArrayBuffer>): Promise<Uint8Array> {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate-raw'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

async function boot() {
  const script = document.createElement('script');
  script.textContent = new TextDecoder().decode(decodeLzma(fromBase64(text('code'))));
  document.head.append(script);
  const wasm = decodeLzma(fromBase64(text('wasm')));
  const given = text('input');
  if (!given.startsWith('{')) return ndfPage.start(wasm, undefined);
  const input = JSON.parse(given) as { packed: boolean; data: string };
  const data = fromBase64(input.data);
  const bytes = input.packed ? await inflated(data) : data;
  return ndfPage.start(wasm, { ...(input as never as import('./main.js').Input), bytes });
}

if (typeof WebAssembly !== 'object') {
  say('This page needs WebAssembly, which this browser does not have or has switched off.');
} else if (typeof DecompressionStream !== 'function') {
  say('This page needs a browser of 2023 or newer.');
} else {
  const page = boot();
  (window as unknown as { ndf: unknown }).ndf = page;
  page.catch((error: unknown) => say(error instanceof Error ? error.message : String(error)));
}
