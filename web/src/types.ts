/** A range of the values of a stored scalar. */
export interface ScalarRange {
  name: string;
  min: number;
  max: number;
}

/** What was opened. Lengths are in the units of the file. */
export interface Description {
  name: string;
  kind: 'model' | 'mesh';
  /** Bytes of the file. */
  bytes: number;
  /** The edge length of a model's mesh where none is asked for. */
  default_edge_length: number | null;
  /** The mean edge length of a model's base mesh. */
  base_edge_length: number | null;
  /** About the shortest edges with which a mesh of a model can be extracted, estimated from the mesh that is computed on. */
  min_edge_length: number | null;
  /** An edge length is this many times the one in the box [-1.5, 1.5]³ of a model. */
  scale: number | null;
  /** What lengths of geodesics are multiplied by, where a model carries the metric of what it was learned from. */
  distance_factor: number | null;
  scalars: ScalarRange[];
  /** What was repaired or is doubtful, a sentence each. */
  notes: string[];
}

/** The keys of `ndf extract --json`; of a mesh that is no manifold only `vertices` and `faces`. */
export interface Report {
  vertices: number;
  faces: number;
  components?: number;
  euler_characteristic?: number;
  boundary_edges?: number;
  manifold?: boolean;
  oriented?: boolean;
  self_intersections?: number;
  delaunay_intrinsic?: boolean;
  delaunay_embedded_fraction?: number;
  edge_length?: { min: number; mean: number; max: number };
  min_angle_deg?: Record<string, number>;
  target_edge_length?: number;
  /** Seconds of the extraction. */
  seconds: number;
}

/** How a file is opened. */
export interface OpenOptions {
  /** Let the first mesh of a model be as coarse as its base mesh: it has a sixteenth of the faces, and is there sooner. */
  coarse?: boolean;
}

/** How a model is extracted. */
export interface ExtractOptions {
  /** The edge length is in the box [-1.5, 1.5]³ of the model, not in the units of the file. */
  relative?: boolean;
  /** Leave the report out, which takes about as long as the extraction. */
  report?: boolean;
  /** Give the positions in double precision, too. */
  positions?: boolean;
}

/** Triangles, in the units of the file. */
export interface Triangles {
  /** x, y, z of each vertex. */
  vertices: Float32Array;
  /** Three vertices of each face. */
  faces: Uint32Array;
}

/** A mesh and what is true of it. */
export interface Extracted extends Triangles {
  report: Report;
  /** x, y, z of each vertex in double precision, where they were asked for. */
  positions?: Float64Array;
}

/** A shortest path: its corners, x, y, z of each, and its length. */
export interface GeodesicPath {
  points: Float64Array;
  length: number;
}

/** Eigenvalues of the Laplacian, and a function at the vertices for each. */
export interface Modes {
  values: Float64Array;
  functions: Float32Array[];
}

/** A scalar at the vertices that is written with a mesh. */
export interface NamedValues {
  name: string;
  values: Float32Array;
}

/** Formats that meshes are written in. */
export type FileFormat = 'ply' | 'glb';

/** What the WebAssembly is made of: nothing for the file beside this module, or its bytes, a module, or a response. */
export type WasmSource = BufferSource | WebAssembly.Module | Response | Promise<Response> | string | URL;
