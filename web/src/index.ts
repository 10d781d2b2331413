/**
 * Neural displacement fields: opens `.ndf` models and meshes, extracts meshes of any edge length, and computes exact geodesic
 * distances, shortest paths and the modes of the Laplacian.
 *
 * @packageDocumentation
 */

export { Surface, init } from './surface.js';
export { Abandoned, WorkerSurface, type WorkerOptions } from './client.js';
export type * from './types.js';
