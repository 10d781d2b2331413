import { BufferAttribute, BufferGeometry } from 'three';

/** The geometry of triangles, with smooth normals. */
export function toGeometry(vertices: Float32Array, faces: Uint32Array): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(vertices, 3));
  geometry.setIndex(new BufferAttribute(faces, 1));
  geometry.computeVertexNormals();
  return geometry;
}
