import { Color, DataTexture, DoubleSide, LinearFilter, ShaderMaterial, SRGBColorSpace, Vector2 } from 'three';
import { colours, type ColourScale } from './colours.js';

/** What stands for a value that is not finite: shaders need not know those. */
export const NO_VALUE = 3e38;

const COLOURS = 256;

const surfaceVertex = /* glsl */ `
attribute float value;
varying vec3 vNormal;
varying vec3 vPosition;
varying float vValue;
void main() {
  vec4 place = modelViewMatrix * vec4(position, 1.0);
  vNormal = normalMatrix * normal;
  vPosition = place.xyz;
  vValue = value;
  gl_Position = projectionMatrix * place;
}`;

// Light comes with the camera: from above and the left, and a little from everywhere. Isolines are as wide on the screen
// everywhere, which the derivative of the value sees to.
const surfaceFragment = /* glsl */ `
uniform vec3 plain;
uniform sampler2D scale;
uniform vec2 range;
uniform float spacing;
uniform bool hasValues;
varying vec3 vNormal;
varying vec3 vPosition;
varying float vValue;
void main() {
  vec3 toCamera = normalize(-vPosition);
  vec3 normal = normalize(vNormal);
  if (dot(normal, cross(dFdx(vPosition), dFdy(vPosition))) < 0.0) normal = -normal;
  vec3 colour = plain;
  float line = 0.0;
  if (hasValues) {
    bool isFinite = abs(vValue) < 1e38;
    float t = range.y > range.x ? (vValue - range.x) / (range.y - range.x) : 0.5;
    float inner = clamp(t, 0.0, 1.0) * ${COLOURS - 1}.0 / ${COLOURS}.0 + 0.5 / ${COLOURS}.0;
    colour = isFinite ? texture2D(scale, vec2(inner, 0.5)).rgb : vec3(0.07);
    if (spacing > 0.0 && isFinite) {
      float f = vValue / spacing;
      float away = abs(fract(f - 0.5) - 0.5) / max(fwidth(f), 1e-6);
      line = (1.0 - smoothstep(0.5, 1.5, away)) * (1.0 - smoothstep(0.3, 0.7, fwidth(f)));
    }
  }
  float key = max(dot(normal, normalize(vec3(-0.35, 0.55, 0.76))), 0.0);
  float fill = 0.5 + 0.5 * normal.y;
  float rim = pow(1.0 - max(dot(normal, toCamera), 0.0), 3.0);
  float gloss = pow(max(dot(normal, normalize(toCamera + vec3(-0.35, 0.55, 0.76))), 0.0), 48.0);
  vec3 light = vec3(0.30) + 0.26 * fill * vec3(0.93, 0.97, 1.0) + 0.62 * key * vec3(1.0, 0.98, 0.95);
  vec3 lit = colour * light + 0.05 * gloss + 0.03 * rim;
  lit = mix(lit, lit * 0.22, 0.75 * line);
  gl_FragColor = vec4(lit, 1.0);
  #include <colorspace_fragment>
}`;

/** The surface: plain, or coloured by values with isolines. */
export class SurfaceMaterial extends ShaderMaterial {
  constructor() {
    const texture = new DataTexture(colours('viridis', COLOURS), COLOURS, 1);
    texture.colorSpace = SRGBColorSpace;
    texture.minFilter = texture.magFilter = LinearFilter;
    texture.needsUpdate = true;
    super({
      vertexShader: surfaceVertex,
      fragmentShader: surfaceFragment,
      side: DoubleSide,
      polygonOffset: true,
      polygonOffsetFactor: 1,
      polygonOffsetUnits: 1,
      uniforms: {
        plain: { value: new Color() },
        scale: { value: texture },
        range: { value: new Vector2(0, 1) },
        spacing: { value: 0 },
        hasValues: { value: false },
      },
    });
  }

  override dispose(): void {
    (this.uniforms['scale']!.value as DataTexture).dispose();
    super.dispose();
  }

  set plain(colour: string) {
    (this.uniforms['plain']!.value as Color).set(colour);
  }

  /** Colours by a scale, with isolines this far apart, or none for 0. */
  colourBy(scale: ColourScale | undefined, spacing: number): void {
    this.uniforms['hasValues']!.value = scale !== undefined;
    if (!scale) return;
    (this.uniforms['range']!.value as Vector2).set(scale.low, scale.high);
    this.uniforms['spacing']!.value = spacing;
    const texture = this.uniforms['scale']!.value as DataTexture;
    texture.image.data!.set(colours(scale.map, COLOURS));
    texture.needsUpdate = true;
  }
}

const lineVertex = /* glsl */ `
uniform vec2 size;
uniform float width;
attribute vec3 from;
attribute vec3 to;
void main() {
  vec4 a = projectionMatrix * modelViewMatrix * vec4(from, 1.0);
  vec4 b = projectionMatrix * modelViewMatrix * vec4(to, 1.0);
  vec2 along = (b.xy / b.w - a.xy / a.w) * size;
  vec2 direction = dot(along, along) > 0.0 ? normalize(along) : vec2(1.0, 0.0);
  vec2 offset = (direction * position.x + vec2(-direction.y, direction.x) * position.y) * width / size;
  vec4 place = position.x < 0.0 ? a : b;
  place.xy += offset * place.w;
  place.z -= 2e-4 * place.w;
  gl_Position = place;
}`;

const lineFragment = /* glsl */ `
uniform vec3 colour;
void main() {
  gl_FragColor = vec4(colour, 1.0);
  #include <colorspace_fragment>
}`;

/** Line segments of a width in pixels, as rectangles turned to the camera. */
export class LineMaterial extends ShaderMaterial {
  constructor() {
    super({
      vertexShader: lineVertex,
      fragmentShader: lineFragment,
      side: DoubleSide,
      uniforms: { size: { value: new Vector2(1, 1) }, width: { value: 3 }, colour: { value: new Color() } },
    });
  }

  set colour(colour: string) {
    (this.uniforms['colour']!.value as Color).set(colour);
  }

  /** Pixels of the canvas, and of the line. */
  setSize(width: number, height: number, line: number): void {
    (this.uniforms['size']!.value as Vector2).set(width, height);
    this.uniforms['width']!.value = line;
  }
}
