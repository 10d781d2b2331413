//! Colour of what is seen: a key light with soft shadows, a cool fill, a rim, the sky and a faint gloss.

use ndf_core::DVec3;

use super::lighting::{Lighting, key_direction};
use super::lines::ScreenFrame;
use super::{Camera, Scene, Style, Surfel};

/// Faces seen from inside, linear: on a closed mesh this colour shows a wrong orientation.
const BACK: [f32; 3] = [0.55, 0.13, 0.09];

/// Lines on the surface and writing, linear.
pub(super) const INK: [f32; 3] = [0.012, 0.014, 0.02];

/// Lines in space, linear: an orange that none of the colour maps has.
const LINE: [f32; 3] = [0.85, 0.16, 0.01];

const KEY: [f32; 3] = [1.02, 0.98, 0.91];
const FILL: [f32; 3] = [0.17, 0.20, 0.25];
const RIM: [f32; 3] = [0.20, 0.20, 0.21];
const SKY: [f32; 3] = [0.44, 0.47, 0.52];
const GROUND: [f32; 3] = [0.27, 0.25, 0.23];

/// Linear colour of a surface point, opaque.
pub(super) fn shade(
    scene: &Scene<'_>,
    camera: &Camera,
    style: &Style,
    lighting: &Lighting,
    pixel: usize,
    surfel: &Surfel,
) -> [f32; 4] {
    let light = lighting.at(scene, camera, pixel, surfel);
    let albedo = albedo(scene, camera, style, surfel);
    let n = surfel.normal;
    let facing = |direction: DVec3| n.dot(direction.normalize()).max(0.0) as f32;
    let (right, up, forward) = (camera.right(), camera.up(), camera.forward());
    let key_direction = key_direction(camera);
    let key = facing(key_direction) * light.key;
    let fill = facing(0.9 * right + 0.15 * up - 0.5 * forward) * light.ambient;
    let rim = facing(0.35 * right + 0.8 * up + 0.7 * forward) * light.ambient;
    let upward = (0.5 + 0.5 * n.dot(up)) as f32;
    let half = (key_direction - surfel.direction).normalize();
    let gloss = 0.05 * facing(half).powi(40) * light.key;
    let mut colour = [0.0, 0.0, 0.0, 1.0];
    for c in 0..3 {
        let sky = GROUND[c] + (SKY[c] - GROUND[c]) * upward;
        // Light bounced between near walls takes on their colour (Jimenez et al. 2016).
        let ambient = bounced(light.ambient.powf(1.3), albedo[c]);
        let arriving = sky * ambient + KEY[c] * key + FILL[c] * fill + RIM[c] * rim;
        colour[c] = albedo[c] * arriving + gloss;
    }
    colour
}

/// Occlusion with the light that walls of this reflectance give back to each other.
fn bounced(open: f32, albedo: f32) -> f32 {
    let (a, b, c) = (2.0404 * albedo - 0.3324, -4.7951 * albedo + 0.6417, 2.7552 * albedo + 0.6903);
    open.max(((open * a + b) * open + c) * open)
}

fn albedo(scene: &Scene<'_>, camera: &Camera, style: &Style, surfel: &Surfel) -> [f32; 3] {
    if surfel.hit.at.face.index() >= scene.lines {
        return LINE;
    }
    let mut albedo = if surfel.is_back { BACK } else { style.colour };
    let needs_lines = style.wireframe || style.isolines > 0;
    let frame = needs_lines.then(|| ScreenFrame::at(scene, camera, surfel));
    if let (Some((_, map)), Some(corners)) = (&scene.scalar, scene.corner_values(surfel.hit.at.face)) {
        let value = surfel.value(scene);
        albedo = map.colour(value);
        if surfel.is_back {
            albedo = mix(albedo, BACK, 0.6);
        }
        let (low, high) = map.range();
        let spacing = (high - low) / f64::from(style.isolines + 1);
        if let Some(frame) = frame.as_ref().filter(|_| style.isolines > 0 && spacing > 0.0) {
            let covered = frame.isoline_coverage(corners, value, (low, spacing, style.isolines), 1.6);
            albedo = mix(albedo, INK, 0.85 * covered);
        }
    }
    if let Some(frame) = frame.filter(|_| style.wireframe) {
        albedo = mix(albedo, INK, 0.8 * frame.edge_coverage(surfel.hit.at.barycentric, 1.1));
    }
    albedo
}

fn mix(a: [f32; 3], b: [f32; 3], share: f32) -> [f32; 3] {
    [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * share)
}
