import { BufferAttribute, FileLoader, Loader, type BufferGeometry, type LoadingManager } from 'three';
import { toGeometry } from './geometry.js';
import { Surface, init } from './surface.js';
import type { ExtractOptions } from './types.js';

/**
 * Loads an `.ndf` model, or a mesh, as a `BufferGeometry` in the units of the file. Stored scalars are attributes
 * of their names with `_` before them, as in glTF, so that none takes the place of `position` or `normal`; `userData.report`
 * says what is true of the mesh.
 *
 * ```ts
 * const geometry = await new NDFLoader().setEdgeLength(0.02).loadAsync('bunny.ndf');
 * ```
 */
export class NDFLoader extends Loader<BufferGeometry> {
  edgeLength: number | undefined;
  options: ExtractOptions = {};

  constructor(manager?: LoadingManager) {
    super(manager);
  }

  /** Sets the edge length of models: in the units of the file, or in the box [-1.5, 1.5]³. */
  setEdgeLength(edgeLength: number | undefined, options: ExtractOptions = {}): this {
    this.edgeLength = edgeLength;
    this.options = options;
    return this;
  }

  override load(
    url: string,
    onLoad: (geometry: BufferGeometry) => void,
    onProgress?: (event: ProgressEvent) => void,
    onError?: (error: unknown) => void,
  ): void {
    const loader = new FileLoader(this.manager);
    loader.setPath(this.path);
    loader.setResponseType('arraybuffer');
    loader.setRequestHeader(this.requestHeader);
    loader.setWithCredentials(this.withCredentials);
    const failed = (error: unknown) => {
      if (onError) onError(error);
      else console.error(error);
      this.manager.itemError(url);
    };
    const loaded = (data: string | ArrayBuffer) => {
      const name = url.split(/[?#]/, 1)[0]!.split('/').pop() ?? url;
      init().then(() => onLoad(this.parse(data as ArrayBuffer, name))).catch(failed);
    };
    loader.load(url, loaded, onProgress, failed);
  }

  /** The geometry of a file; `init()` must have been awaited. */
  parse(data: ArrayBuffer, name = 'the file'): BufferGeometry {
    if (!data) throw new TypeError(`the file should be an ArrayBuffer, and is ${String(data)}`);
    const isAsked = this.edgeLength !== undefined;
    // What is not wanted need not be fine.
    const surface = Surface.openNow(new Uint8Array(data), name, { coarse: isAsked });
    try {
      if (isAsked && surface.describe().kind === 'model') surface.extract(this.edgeLength, { ...this.options, report: false });
      const description = surface.describe();
      const { vertices, faces } = surface.mesh();
      const geometry = toGeometry(vertices, faces);
      for (const { name: scalar } of description.scalars) {
        geometry.setAttribute(`_${scalar}`, new BufferAttribute(surface.scalar(scalar), 1));
      }
      geometry.userData['report'] = surface.report();
      geometry.userData['description'] = description;
      return geometry;
    } finally {
      surface.free();
    }
  }
}
