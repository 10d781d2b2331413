import {
  Box3, BufferAttribute, Color, InstancedBufferAttribute, InstancedBufferGeometry, Mesh, MeshBasicMaterial, PerspectiveCamera,
  Raycaster, Scene, SphereGeometry, Vector2, Vector3, WebGLRenderer, type BufferGeometry, type Sphere,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { toGeometry } from '../geometry.js';
import type { ColourScale } from './colours.js';
import { LineMaterial, NO_VALUE, SurfaceMaterial } from './materials.js';

/** The colours of a theme. */
export interface Theme {
  background: string;
  surface: string;
  wire: string;
  mark: string;
}

/** The direction that points up. */
export type Up = 'x' | 'y' | 'z' | '-x' | '-y' | '-z';

const FIELD_OF_VIEW = 32;
/** Pixels of a path, and of the mark of a source. */
const LINE_WIDTH = 4;
const MARK_RADIUS = 5;
/** Pixels around the surface that the first view leaves free. */
const MARGIN = 36;

/** The vertex nearest to a place. O(n). */
export function nearestVertex(positions: ArrayLike<number>, { x: a, y: b, z: c }: Vector3): number {
  let [nearest, least] = [0, Infinity];
  for (let v = 0; 3 * v < positions.length; v++) {
    const [x, y, z] = [positions[3 * v]! - a, positions[3 * v + 1]! - b, positions[3 * v + 2]! - c];
    const distance = x * x + y * y + z * z;
    if (distance < least) [nearest, least] = [v, distance];
  }
  return nearest;
}

/** What the time of the first picture is noted as (`performance.getEntriesByName`). */
export const PICTURE_MARK = 'ndf-picture';

/** The picture: a surface, its wires, marks and a path, and the camera. Draws only when something changed. */
export class Stage {
  readonly #renderer: WebGLRenderer;
  readonly #scene = new Scene();
  readonly #camera = new PerspectiveCamera(FIELD_OF_VIEW);
  #controls: OrbitControls;
  readonly #material = new SurfaceMaterial();
  readonly #wire = new MeshBasicMaterial({ wireframe: true, transparent: true, opacity: 0.45 });
  readonly #line = new LineMaterial();
  readonly #markMaterial = new MeshBasicMaterial({ depthTest: true });
  readonly #surface: Mesh<BufferGeometry, SurfaceMaterial>;
  readonly #wires: Mesh<BufferGeometry, MeshBasicMaterial>;
  readonly #path: Mesh<InstancedBufferGeometry, LineMaterial>;
  readonly #marks: Mesh[] = [];
  readonly #sphere = new SphereGeometry(1, 20, 12);
  /** What is drawn is relative to this place: in single precision surfaces far from the origin would lose their shape. */
  readonly #centre = new Vector3();
  #bounds: Sphere | undefined;
  #up: Up = 'y';
  #insets = { right: 0, bottom: 0 };
  /** Whether the view is the one of the beginning, which fits the picture whatever its size. */
  #isFramed = true;
  #asked: number | undefined;
  #theme: Theme | undefined;
  readonly #restored = () => {
    // The renderer begins with its own background.
    if (this.#theme) this.theme = this.#theme;
    this.draw();
  };

  /** @throws where there is no WebGL 2. */
  constructor(readonly canvas: HTMLCanvasElement) {
    const context = canvas.getContext('webgl2', { antialias: true, powerPreference: 'high-performance' });
    if (!context) throw new Error('there is no WebGL 2');
    this.#renderer = new WebGLRenderer({ canvas, context });
    // After the renderer has heard of it, and made anew what it had on the graphics card.
    canvas.addEventListener('webglcontextrestored', this.#restored);
    this.#surface = new Mesh(toGeometry(new Float32Array(), new Uint32Array()), this.#material);
    this.#wires = new Mesh(this.#surface.geometry, this.#wire);
    this.#wires.visible = false;
    this.#path = new Mesh(new InstancedBufferGeometry(), this.#line);
    this.#path.visible = false;
    for (const object of [this.#surface, this.#wires, this.#path]) {
      object.frustumCulled = false;
      this.#scene.add(object);
    }
    this.#controls = this.#controlled();
  }

  #controlled(): OrbitControls {
    const controls = new OrbitControls(this.#camera, this.canvas);
    controls.enableDamping = !matchMedia('(prefers-reduced-motion: reduce)').matches;
    controls.dampingFactor = 0.12;
    controls.zoomToCursor = true;
    controls.addEventListener('change', () => this.ask());
    controls.addEventListener('start', () => (this.#isFramed = false));
    return controls;
  }

  set theme(theme: Theme) {
    this.#theme = theme;
    this.#renderer.setClearColor(new Color(theme.background), 1);
    this.#material.plain = theme.surface;
    this.#wire.color.set(theme.wire);
    this.#line.colour = theme.mark;
    this.#markMaterial.color.set(theme.mark);
    this.ask();
  }

  /** Shows triangles. The view is kept, unless they are the first since {@link Stage.clear}. */
  setMesh(positions: Float64Array, faces: Uint32Array): void {
    const isFirst = this.#bounds === undefined;
    if (isFirst) new Box3().setFromArray(positions).getCenter(this.#centre);
    this.#surface.geometry.dispose();
    const geometry = toGeometry(this.#drawn(positions), faces);
    geometry.setAttribute('value', new BufferAttribute(new Float32Array(positions.length / 3), 1));
    this.#surface.geometry = this.#wires.geometry = geometry;
    geometry.computeBoundingSphere();
    this.#bounds = geometry.boundingSphere!.clone();
    if (isFirst && faces.length > 0) this.frame();
    this.setValues(undefined);
  }

  /** Shows no triangles; those that come next are looked at from the beginning. */
  clear(): void {
    this.setMesh(new Float64Array(), new Uint32Array());
    this.#bounds = undefined;
    this.setMarks([]);
    this.setPath(undefined);
  }

  /** Places as they are drawn. */
  #drawn(places: Float64Array): Float32Array {
    const centre = this.#centre.toArray();
    return Float32Array.from(places, (x, i) => x - centre[i % 3]!);
  }

  /** Colours the surface by values at its vertices, with isolines; nothing for the plain surface. */
  setValues(values: Float32Array | undefined, scale?: ColourScale, spacing = 0): void {
    const attribute = this.#surface.geometry.getAttribute('value') as BufferAttribute;
    if (values && values.length !== attribute.count) {
      throw new Error(`${values.length} values are not those of ${attribute.count} vertices`);
    }
    this.#material.colourBy(values && scale, spacing);
    if (values) {
      (attribute.array as Float32Array).set(values.map((value) => (Number.isFinite(value) ? value : NO_VALUE)));
      attribute.needsUpdate = true;
    }
    this.ask();
  }

  set hasWireframe(shown: boolean) {
    this.#wires.visible = shown;
    this.ask();
  }

  get hasWireframe(): boolean {
    return this.#wires.visible;
  }

  /** Marks these vertices. */
  setMarks(vertices: number[]): void {
    this.#marks.splice(0).forEach((mark) => this.#scene.remove(mark));
    for (const vertex of vertices) {
      const mark = new Mesh(this.#sphere, this.#markMaterial);
      mark.position.copy(this.#drawnVertex(vertex));
      this.#marks.push(mark);
      this.#scene.add(mark);
    }
    this.ask();
  }

  /** Draws a path through these points; nothing takes it away. */
  setPath(points: Float64Array | undefined): void {
    this.#path.visible = points !== undefined && points.length > 3;
    if (points && this.#path.visible) {
      const geometry = new InstancedBufferGeometry();
      const corners = new Float32Array([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0]);
      geometry.setAttribute('position', new BufferAttribute(corners, 3));
      geometry.setIndex([0, 1, 2, 0, 2, 3]);
      const places = this.#drawn(points);
      geometry.setAttribute('from', new InstancedBufferAttribute(places.slice(0, -3), 3));
      geometry.setAttribute('to', new InstancedBufferAttribute(places.slice(3), 3));
      geometry.instanceCount = points.length / 3 - 1;
      this.#path.geometry.dispose();
      this.#path.geometry = geometry;
    }
    this.ask();
  }

  /** The place of a vertex. */
  position(vertex: number): Vector3 {
    return this.#drawnVertex(vertex).add(this.#centre);
  }

  #drawnVertex(vertex: number): Vector3 {
    return new Vector3().fromBufferAttribute(this.#surface.geometry.getAttribute('position'), vertex);
  }

  /** The vertex nearest to a place. O(n). */
  nearest(place: Vector3): number {
    return nearestVertex(this.#surface.geometry.getAttribute('position').array, place.clone().sub(this.#centre));
  }

  /** The vertex at a place of the canvas in pixels of CSS; nothing beside the surface. */
  pick(x: number, y: number): number | undefined {
    const { clientWidth, clientHeight } = this.canvas;
    const ray = new Raycaster();
    this.#camera.updateMatrixWorld();
    ray.setFromCamera(new Vector2((2 * x) / clientWidth - 1, 1 - (2 * y) / clientHeight), this.#camera);
    const hit = ray.intersectObject(this.#surface)[0];
    if (!hit?.face) return undefined;
    const corners = [hit.face.a, hit.face.b, hit.face.c];
    const away = (vertex: number) => this.#drawnVertex(vertex).distanceToSquared(hit.point);
    return corners.reduce((a, b) => (away(b) < away(a) ? b : a));
  }

  get up(): Up {
    return this.#up;
  }

  set up(up: Up) {
    this.#up = up;
    const axis = up.replace('-', '') as 'x' | 'y' | 'z';
    this.#camera.up.set(0, 0, 0)[axis] = up.startsWith('-') ? -1 : 1;
    this.#controls.dispose();
    this.#controls = this.#controlled();
    this.frame();
  }

  /** Puts the camera back to where it sees all of the surface. */
  frame(): void {
    const bounds = this.#bounds;
    if (!bounds) return;
    const up = this.#camera.up;
    // To the right and a little above of what faces the viewer.
    const ahead = Math.abs(up.z) > 0.5 ? new Vector3(0, -1, 0) : new Vector3(0, 0, 1);
    const right = new Vector3().crossVectors(up, ahead);
    const direction = ahead.addScaledVector(right, 0.45).addScaledVector(up, 0.32).normalize();
    this.#camera.position.copy(bounds.center).addScaledVector(direction, this.#fitting(bounds.radius));
    this.#controls.target.copy(bounds.center);
    this.#controls.update();
    this.#isFramed = true;
    this.ask();
  }

  /** How far away a sphere fills what is free of the picture. */
  #fitting(radius: number): number {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const half = Math.tan((FIELD_OF_VIEW * Math.PI) / 360);
    const free = Math.min(width - this.#insets.right - 2 * MARGIN, height - this.#insets.bottom - 2 * MARGIN);
    return radius / Math.sin(Math.atan(half * Math.max(free / Math.max(height, 1), 0.1)));
  }

  /** Turns the camera, by radians. */
  turn(right: number, up: number): void {
    const offset = this.#camera.position.clone().sub(this.#controls.target);
    offset.applyAxisAngle(this.#camera.up, -right);
    const side = new Vector3().crossVectors(this.#camera.up, offset).normalize();
    const turned = offset.clone().applyAxisAngle(side, -up);
    // Not over the pole.
    if (turned.angleTo(this.#camera.up) > 0.05 && turned.angleTo(this.#camera.up) < Math.PI - 0.05) offset.copy(turned);
    this.#camera.position.copy(this.#controls.target).add(offset);
    this.#moved();
  }

  /** Goes nearer by a factor below one, or farther. */
  zoom(factor: number): void {
    const offset = this.#camera.position.clone().sub(this.#controls.target);
    this.#camera.position.copy(this.#controls.target).addScaledVector(offset, factor);
    this.#moved();
  }

  #moved(): void {
    this.#isFramed = false;
    this.#controls.update();
    this.ask();
  }

  /** Fits the picture to the canvas. */
  resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    this.#renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.#renderer.setSize(width, height, false);
    this.#camera.aspect = width / height;
    this.#camera.updateProjectionMatrix();
    this.setInsets(this.#insets.right, this.#insets.bottom);
    this.draw();
  }

  /** Shifts the middle of the picture into what panels leave free, given in pixels at the right and below. */
  setInsets(right: number, bottom: number): void {
    this.#insets = { right, bottom };
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (right || bottom) this.#camera.setViewOffset(width, height, right / 2, bottom / 2, width, height);
    else this.#camera.clearViewOffset();
    if (this.#isFramed) this.frame();
    this.ask();
  }

  /** Asks for a picture with the next frame of the screen. */
  ask(): void {
    this.#asked ??= requestAnimationFrame(() => {
      this.#asked = undefined;
      // Asks again while the camera comes to rest.
      this.#controls.update();
      this.draw();
    });
  }

  /** Draws now. */
  draw(): void {
    const bounds = this.#bounds;
    if (bounds) {
      const away = this.#camera.position.distanceTo(bounds.center);
      this.#camera.near = Math.max(away - 1.05 * bounds.radius, 1e-3 * bounds.radius);
      this.#camera.far = away + 1.05 * bounds.radius;
      this.#camera.updateProjectionMatrix();
      this.#controls.minDistance = 0.01 * bounds.radius;
      this.#controls.maxDistance = 20 * bounds.radius;
    }
    const { clientHeight } = this.canvas;
    const ratio = this.#renderer.getPixelRatio();
    const size = this.#renderer.getDrawingBufferSize(new Vector2());
    this.#line.setSize(size.x, size.y, LINE_WIDTH * ratio);
    const pixel = (2 * Math.tan((FIELD_OF_VIEW * Math.PI) / 360)) / Math.max(clientHeight, 1);
    for (const mark of this.#marks) {
      mark.scale.setScalar(MARK_RADIUS * pixel * mark.position.distanceTo(this.#camera.position));
    }
    this.#renderer.render(this.#scene, this.#camera);
    if (bounds && performance.getEntriesByName(PICTURE_MARK).length === 0) performance.mark(PICTURE_MARK);
  }

  /** The picture as PNG. */
  screenshot(): Promise<Blob> {
    this.draw();
    return new Promise((resolve, reject) => {
      this.canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error('the picture could not be taken'))));
    });
  }

  /** Gives the graphics memory back. */
  dispose(): void {
    if (this.#asked !== undefined) cancelAnimationFrame(this.#asked);
    this.canvas.removeEventListener('webglcontextrestored', this.#restored);
    for (const { geometry, material } of [this.#surface, this.#wires, this.#path]) {
      geometry.dispose();
      material.dispose();
    }
    this.#sphere.dispose();
    this.#markMaterial.dispose();
    this.#controls.dispose();
    this.#renderer.dispose();
  }
}
