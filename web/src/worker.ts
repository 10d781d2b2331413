/** What runs in the Worker: one surface, whose methods are called one after the other. */

import { messageOf } from './message.js';
import type { Opening, Request, Response } from './protocol.js';
import { Surface, init } from './surface.js';

interface Scope {
  onmessage: ((event: MessageEvent<Request>) => void) | null;
  postMessage(message: Response, transfer: Transferable[]): void;
}

const scope = globalThis as unknown as Scope;
let surface: Surface | undefined;
/** What is to be extracted before the mesh is computed on: another extraction may come first and make it needless. */
let owed: Opening['extraction'];

/** The memory of the arrays in a result, which moves with it. */
function memory(value: unknown): Transferable[] {
  if (ArrayBuffer.isView(value)) return [value.buffer as ArrayBuffer];
  if (value === null || typeof value !== 'object') return [];
  return Object.values(value).flatMap(memory);
}

async function answer(request: Request): Promise<unknown> {
  if ('open' in request) {
    const { wasm, bytes, name, options, extraction } = request.open;
    await init(wasm);
    surface?.free();
    surface = undefined;
    surface = Surface.openNow(bytes, name, options);
    owed = extraction;
    return surface.describe();
  }
  if (!surface) throw new Error('nothing is open');
  if (owed && request.method !== 'extract') surface.extract(...owed);
  const method = surface[request.method] as (...given: unknown[]) => unknown;
  const result = method.apply(surface, request.arguments);
  owed = undefined;
  return result;
}

// In order: the answer to one request is sent before the next is begun.
let last: Promise<void> = Promise.resolve();

scope.onmessage = ({ data: request }) => {
  last = last.then(async () => {
    try {
      const result = await answer(request);
      scope.postMessage({ id: request.id, result }, memory(result));
    } catch (error) {
      const isTrapped = error instanceof WebAssembly.RuntimeError;
      const message = messageOf(error);
      const told = isTrapped ? `the computation broke off, most likely because memory ran out (${message})` : message;
      scope.postMessage({ id: request.id, error: told, isTrapped }, []);
    }
  });
};
