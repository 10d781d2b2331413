/** The first that runs: unpacks the rest of the page, or says why it cannot. */

import { messageOf } from '../message.js';
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

/**
 * Compiles the WebAssembly in a Worker that runs this very script, while the rest is unpacked here.
 * Unpacked, it takes most of the time until something is shown.
 */
function compiled(packed: string, script: string): Promise<WebAssembly.Module> {
  const worker = new Worker(URL.createObjectURL(new Blob([script], { type: 'text/javascript' })));
  return new Promise<WebAssembly.Module>((resolve, reject) => {
    worker.onmessage = ({ data }: MessageEvent<WebAssembly.Module | string>) => (typeof data === 'string' ? reject(new Error(data)) : resolve(data));
    worker.onerror = ({ message }) => reject(new Error(message || 'the Worker could not be started'));
    worker.postMessage(packed);
  }).finally(() => worker.terminate());
}

/** In the Worker. */
function compile(): void {
  const scope = globalThis as unknown as { onmessage: unknown; postMessage(message: WebAssembly.Module | string): void };
  scope.onmessage = async ({ data }: MessageEvent<string>) => {
    try {
      scope.postMessage(await WebAssembly.compile(decodeLzma(fromBase64(data))));
    } catch (error) {
      scope.postMessage(messageOf(error));
    }
  };
}

async function boot(own: string) {
  const module = compiled(text('wasm'), own);
  // Whoever waits for it hears of it.
  module.catch(() => undefined);
  const script = document.createElement('script');
  script.textContent = new TextDecoder().decode(decodeLzma(fromBase64(text('code'))));
  document.head.append(script);
  const given = text('input');
  if (!given.startsWith('{')) return ndfPage.start(module, undefined);
  const input = JSON.parse(given) as { packed: boolean; data: string };
  const data = fromBase64(input.data);
  const bytes = input.packed ? await inflated(data) : data;
  return ndfPage.start(module, { ...(input as never as import('./main.js').Input), bytes });
}

if (typeof document === 'undefined') {
  compile();
} else if (typeof WebAssembly !== 'object') {
  say('This page needs WebAssembly, which this browser does not have or has switched off.');
} else if (typeof DecompressionStream !== 'function') {
  say('This page needs a browser of 2023 or newer.');
} else {
  const page = boot(document.currentScript!.textContent!);
  (window as unknown as { ndf: unknown }).ndf = page;
  page.catch((error: unknown) => say(messageOf(error)));
}
