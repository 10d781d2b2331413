import type { WorkerSurface } from '../client.js';
import type { GeodesicPath, Modes, NamedValues } from '../types.js';
import { readable } from './colours.js';

/** What the colours of the surface mean. */
export type View =
  | { kind: 'plain' }
  | { kind: 'distance' }
  | { kind: 'mode'; index: number }
  | { kind: 'scalar'; name: string };

/** How a surface is shown: the meaning of its colours, and what belongs to it. Vertices are those of the mesh that is shown. */
export interface Looks {
  view: View;
  /** The values that colour it. */
  values?: NamedValues;
  /** The vertex from which distances and the path are. */
  source?: number | undefined;
  /** The vertex to which the path leads. */
  target?: number | undefined;
  path?: GeodesicPath;
  eigenvalue?: number | undefined;
}

/** Without colours. */
export const PLAIN: Looks = { view: { kind: 'plain' } };

/** How many modes are computed when the first is asked for. */
export const MODES = 20;

/** By the distances from a vertex. */
export const byDistance = (values: Float32Array, source: number): Looks => ({
  view: { kind: 'distance' },
  values: { name: 'distance', values },
  source,
});

/** By a mode of the Laplacian. */
export const byMode = ({ values, functions }: Modes, index: number): Looks => ({
  view: { kind: 'mode', index },
  values: { name: `mode_${String(index).padStart(2, '0')}`, values: functions[index]! },
  eigenvalue: values[index],
});

/** By a stored scalar. */
export const byScalar = (values: Float32Array, name: string): Looks => ({ view: { kind: 'scalar', name }, values: { name, values } });

/** The mode that is nearest to the one that is wanted, and how many are computed for it. */
export function modeOf(wanted: number, vertices: number): { index: number; count: number } {
  const index = Math.max(0, Math.min(wanted, vertices - 1));
  // Twice as many when they do not suffice: whoever goes on one by one does not wait each time.
  const enough = MODES * 2 ** Math.max(0, Math.ceil(Math.log2((index + 1) / MODES)));
  return { index, count: Math.min(enough, vertices) };
}

/** Looks on another mesh, with their source and target at these vertices; without the colours that take time if it is short. */
export async function looksOn(
  surface: WorkerSurface,
  { view, path }: Looks,
  [source, target]: [number | undefined, number | undefined],
  vertices: number,
  isShort: boolean,
): Promise<Looks> {
  let looks: Looks = { view };
  if (view.kind === 'distance') looks = source === undefined ? PLAIN : byDistance(await surface.geodesic(source), source);
  if (view.kind === 'scalar') looks = byScalar(await surface.scalar(view.name), view.name);
  if (view.kind === 'mode' && !isShort) {
    const { index, count } = modeOf(view.index, vertices);
    looks = byMode(await surface.modes(count), index);
  }
  if (!path || source === undefined || target === undefined) return looks;
  return { ...looks, source, target, path: await surface.path(source, target) };
}

/** What the legend says. */
export function legendOf({ view, eigenvalue }: Looks, spacing: number): string {
  if (view.kind === 'distance') return `Exact distance, a line every ${readable(spacing)}`;
  if (view.kind === 'mode') return `Mode ${view.index}, eigenvalue ${readable(eigenvalue ?? 0)}`;
  return view.kind === 'scalar' ? view.name : '';
}
