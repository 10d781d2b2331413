/** The first that runs: unpacks the rest of the page, or says why it cannot. */

import { messageOf } from '../message.js';
import initialise, { unpack } from '../wasm/ndf_unpack.js';

/** What the unpacked code leaves behind. */
declare const ndfPage: typeof import('./main.js');

const text = (id: string) => document.getElementById(id)!.textContent!;

/** The bytes of base64. Element by element: what goes through iterators takes a hundred times as long. */
function fromBase64(text: string): Uint8Array<ArrayBuffer> {
  const characters = atob(text);
  const bytes = new Uint8Array(characters.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = characters.charCodeAt(i);
  return bytes;
}

function say(message: string): void {
  const first = document.getElementById('first');
  if (first) first.textContent = message;
}

async function inflated(bytes: Uint8Array<ArrayBuffer>): Promise<Uint8Array> {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate-raw'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

async function boot() {
  await initialise({ module_or_path: await inflated(fromBase64(text('unpack'))) });
  const script = document.createElement('script');
  script.textContent = new TextDecoder().decode(unpack(fromBase64(text('code'))));
  document.head.append(script);
  const compiled = WebAssembly.compile(unpack(fromBase64(text('wasm'))) as Uint8Array<ArrayBuffer>);
  const given = text('input');
  if (!given.startsWith('{')) return ndfPage.start(compiled, undefined);
  const input = JSON.parse(given) as { packed: boolean; data: string };
  const data = fromBase64(input.data);
  const bytes = input.packed ? await inflated(data) : data;
  return ndfPage.start(compiled, { ...(input as never as import('./main.js').Input), bytes });
}

if (typeof WebAssembly !== 'object') {
  say('This page needs WebAssembly, which this browser does not have or has switched off.');
} else if (typeof DecompressionStream !== 'function') {
  say('This page needs a browser of 2023 or newer.');
} else {
  const page = boot();
  (window as unknown as { ndf: unknown }).ndf = page;
  page.catch((error: unknown) => say(messageOf(error)));
}
