//! How much of the surroundings and of the main light reaches the surface.

use std::f64::consts::TAU;

use ndf_core::DVec3;
use rayon::prelude::*;

use super::{Camera, Scene, Surfel};

/// Rays into the surroundings and towards the main light, for every gathering point.
const AMBIENT_RAYS: u32 = 20;
const KEY_RAYS: u32 = 12;

/// Radius of the main light, seen from the surface, as a tangent: the softness of shadows.
const KEY_RADIUS: f64 = 0.16;

/// Where the key light comes from: over the left shoulder of the viewer.
pub(super) fn key_direction(camera: &Camera) -> DVec3 {
    (-0.55 * camera.right() + 0.85 * camera.up() - 0.75 * camera.forward()).normalize()
}

/// Light at a point: shares, 0 to 1, of the surroundings and of the main light that are not hidden.
#[derive(Clone, Copy, Debug)]
pub(super) struct Light {
    pub(super) ambient: f32,
    pub(super) key: f32,
}

/// Light gathered at one point of every block of 2 × 2 pixels.
pub(super) struct Lighting {
    points: Vec<Option<(DVec3, DVec3, Light)>>,
    columns: usize,
    rows: usize,
    width: usize,
    key: DVec3,
    /// Beyond this nothing darkens the surroundings.
    reach: f64,
}

impl Lighting {
    /// Gathers light for what every pixel sees. O(pixels of the surface · log faces).
    pub(super) fn gather(scene: &Scene<'_>, camera: &Camera, surfels: &[Option<Surfel>]) -> Self {
        let (width, height) = camera.size();
        let (columns, rows) = (width.div_ceil(2), height.div_ceil(2));
        let mut lighting = Self {
            points: Vec::new(),
            columns,
            rows,
            width,
            key: key_direction(camera),
            reach: 0.35 * scene.tree.bounds().diagonal(),
        };
        lighting.points = (0..columns * rows)
            .into_par_iter()
            .map(|block| {
                let (x, y) = (2 * (block % columns), 2 * (block / columns));
                let pixels = [(x, y), (x + 1, y + 1), (x + 1, y), (x, y + 1)];
                let inside = pixels.into_iter().filter(|&(x, y)| x < width && y < height);
                let surfel = inside.filter_map(|(x, y)| surfels[y * width + x].as_ref()).next()?;
                // Neighbouring points take different rays, so that their mean sees 16 times as many
                // (interleaved sampling, Keller and Heidrich 2001).
                let place = (block % columns % 4 + 4 * (block / columns % 4)) as u32;
                let light = lighting.light_at(scene, surfel, place);
                Some((surfel.position, surfel.face_normal, light))
            })
            .collect();
        lighting
    }

    /// Light at what is seen in a pixel, from the gathering points around it on the same piece of surface.
    pub(super) fn at(&self, scene: &Scene<'_>, camera: &Camera, pixel: usize, surfel: &Surfel) -> Light {
        let (column, row) = (pixel % self.width / 2, pixel / self.width / 2);
        let size = 2.0 * camera.pixel_size(surfel.hit.t);
        let (mut ambient, mut key, mut total) = (0.0, 0.0, 0.0);
        for y in row.saturating_sub(2)..(row + 3).min(self.rows) {
            for x in column.saturating_sub(2)..(column + 3).min(self.columns) {
                let Some((position, normal, light)) = &self.points[y * self.columns + x] else { continue };
                let away = *position - surfel.position;
                let off = surfel.face_normal.dot(away) / size;
                let facing = surfel.face_normal.dot(*normal).max(0.0).powi(12);
                let near = (-0.16 * away.length_squared() / (size * size)).max(-8.0).exp();
                let weight = (facing * near * (-off * off).exp()) as f32;
                ambient += weight * light.ambient;
                key += weight * light.key;
                total += weight;
            }
        }
        if total > 1e-3 {
            Light { ambient: ambient / total, key: key / total }
        } else {
            self.light_at(scene, surfel, 0)
        }
    }

    /// Casts rays; `place`, 0 to 15, tells which of the interleaved sets.
    fn light_at(&self, scene: &Scene<'_>, surfel: &Surfel, place: u32) -> Light {
        let origin = surfel.position + surfel.face_normal * 1e-4 * scene.tree.bounds().diagonal();
        // R₂ sequence (Roberts 2018) over the places, and again over the rays of each.
        let r2 = |k: u32| {
            [0.754_877_666_246_692_8, 0.569_840_290_998_053_2].map(|g| (0.5 + g * f64::from(k)).fract())
        };
        let turn = r2(place * 7 % 16);
        let around = |n: u32, k: u32| {
            let [u, v] = r2(k);
            ((f64::from(k) + (turn[0] + u).fract()) / f64::from(n), TAU * (turn[1] + v))
        };
        let (s, t) = surfel.normal.any_orthonormal_pair();
        let mut open = 0.0;
        for k in 0..AMBIENT_RAYS {
            // Cosine-weighted directions above the surface.
            let (r, angle) = around(AMBIENT_RAYS, k);
            let side = (s * angle.cos() + t * angle.sin()) * r.sqrt();
            let direction = side + surfel.normal * (1.0 - r).sqrt();
            open += match scene.tree.first_hit(origin, direction) {
                Some(hit) => (hit.t / self.reach).min(1.0),
                None => 1.0,
            };
        }
        let (s, t) = self.key.any_orthonormal_pair();
        let mut lit = 0.0;
        for k in 0..KEY_RAYS {
            let (r, angle) = around(KEY_RAYS, k);
            let direction = self.key + (s * angle.cos() + t * angle.sin()) * KEY_RADIUS * r.sqrt();
            let is_free =
                direction.dot(surfel.face_normal) > 0.0 && scene.tree.first_hit(origin, direction).is_none();
            lit += f64::from(u8::from(is_free));
        }
        Light { ambient: (open / f64::from(AMBIENT_RAYS)) as f32, key: (lit / f64::from(KEY_RAYS)) as f32 }
    }
}
