//! Where the points of a descent are, and how far from the surface.

use std::sync::Arc;

use ndf_core::{Answer, DVec3, Hint, Miss, Query, project_all};
use rayon::prelude::*;

use super::{Descent, Row};
use crate::fit::Measured;

/// Distances beyond this multiple of their root mean square weigh less (Huber 1964).
const HUBER: f64 = 4.0;
/// Points closer to the surface than this are moved along its normal, others towards their foot.
const CLOSE: f64 = 0.05;
/// A point whose normal and that of its foot enclose an angle of a smaller cosine is on the wrong side.
const OPPOSED: f64 = -0.2;
/// The least area of a point, as a multiple of the mean, where moves are to be small.
const MIN_SHARE: f64 = 0.01;

/// How far outwards the end of the surface is looked for, as a multiple of the mean edge of the base mesh.
const REACH: f64 = 0.5;
/// A surface that comes as close as this to where it was looked for, as a share of that reach, goes on there.
const GOES_ON: f64 = 0.25;

/// Points that are projected before it is asked again whether to stop, at least.
const BATCH: usize = 4096;

/// What is asked of the surface.
struct View {
    normals: Vec<DVec3>,
    /// Of every point of the boundary the direction along the surface that leads away from it.
    outwards: Vec<DVec3>,
    /// Where the end of the surface is looked for.
    beyond: Vec<DVec3>,
}

impl Descent<'_> {
    /// The surface anew from its numbers, and its distances. If it is to stop, the distances are not to be used.
    pub(in crate::levels) fn project(&mut self) {
        let view = self.view();
        let to_world = |p: DVec3| self.similarity.to_world(p * self.unit);
        let query = |((&p, &n), &hint): ((&DVec3, &DVec3), &Hint)| Query {
            point: to_world(p),
            normal: (n != DVec3::ZERO).then_some(n),
            hint,
        };
        let boundary_normals = self.boundary_points.iter().map(|&v| &view.normals[v as usize]);
        let places = self.points.iter().chain(&view.beyond).zip(view.normals.iter().chain(boundary_normals));
        let queries: Vec<Query> = places.zip(&self.hints).map(query).collect();
        let mut feet: Vec<Answer> = vec![Err(Miss::OutOfReach); queries.len()];
        let batch = BATCH.max(self.surface.batch());
        let batches = queries.par_chunks(batch).zip(feet.par_chunks_mut(batch));
        batches.for_each(|(queries, feet)| {
            if !self.stop.is_requested() {
                project_all(self.surface, queries, feet);
            }
        });
        for (hint, foot) in self.hints.iter_mut().zip(&feet) {
            *hint = foot.map_or(*hint, |foot| foot.hint);
        }
        let points = self.points.iter().chain(&view.beyond);
        let plane = |(&point, foot): (&DVec3, Answer)| {
            let foot = foot.ok()?;
            let away = point - self.similarity.to_normalised(foot.point) / self.unit;
            let distance = away.length();
            let direction = if distance < CLOSE { foot.normal } else { away / distance };
            Some([foot.point, foot.normal, direction])
        };
        self.feet = Arc::new(points.zip(feet).map(plane).collect());
        self.is_fresh = true;
        self.measure_seen(&view);
    }

    /// The same, or with distances from the planes through the feet that there are.
    pub(in crate::levels) fn look(&mut self, anew: bool) {
        if anew {
            self.project();
        } else {
            self.is_fresh = false;
            self.measure();
        }
    }

    pub(super) fn measure(&mut self) {
        let view = self.view();
        self.measure_seen(&view);
    }

    fn view(&mut self) -> View {
        let mut control = self.control.clone();
        for (l, level) in (1..).zip(&mut self.levels) {
            (control, level.normals) = self.hierarchy.displaced(l, &control, |i| level.values[i]);
        }
        let depth = self.hierarchy.levels();
        let finest = self.hierarchy.level(depth);
        self.points = finest.limit(&self.hierarchy.level(depth - 1).subdivide(&control));
        let normals = finest.normals(&self.points);
        let outwards = self.outwards();
        let reach = REACH * self.mean_edge;
        let on_boundary = self.boundary_points.iter().zip(&outwards);
        let beyond = on_boundary.map(|(&v, t)| self.points[v as usize] + reach * *t).collect();
        View { normals, outwards, beyond }
    }

    fn measure_seen(&mut self, View { normals, outwards, beyond }: &View) {
        let finest = self.hierarchy.level(self.hierarchy.levels());
        let mut areas = vec![0.0; self.points.len()];
        for face in finest.faces() {
            let [a, b, c] = face.map(|v| self.points[v as usize]);
            let area = (b - a).cross(c - a).length();
            face.iter().for_each(|&v| areas[v as usize] += area);
        }
        let total: f64 = areas.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let least = MIN_SHARE / self.points.len() as f64;
        let [mut mean, mut square, mut missed] = [0.0; 3];
        let (rows, boundary_rows) = self.rows.split_at_mut(self.points.len());
        let (feet, boundary_feet) = self.feet.split_at(self.points.len());
        for (i, (row, foot)) in rows.iter_mut().zip(feet).enumerate() {
            let area = areas[i] / total;
            // Vertices of faces without area are not free to go anywhere.
            let held = area.max(least);
            *row = Row { direction: row.direction, distance: 0.0, area: held as f32, weight: 0.0 };
            let Some([foot, normal, direction]) = *foot else {
                missed += area;
                continue;
            };
            let away = self.points[i] - self.similarity.to_normalised(foot) / self.unit;
            let along = away.dot(direction);
            let distance = if self.is_fresh { away.length() } else { along.abs() };
            (row.direction, row.distance) = (direction.as_vec3(), along as f32);
            mean += area * distance;
            square += area * distance * distance;
            if normals[i].dot(normal) >= OPPOSED {
                row.weight = area as f32;
            }
        }
        let found = (1.0 - missed).max(1e-9);
        (self.mean, self.rms, self.missed) = (mean / found, (square / found).sqrt(), missed);
        self.boundary_error = 0.0;
        let boundary = self.boundary_points.iter().zip(outwards).zip(boundary_feet.iter().zip(beyond));
        for (row, ((&v, &direction), (foot, &beyond))) in boundary_rows.iter_mut().zip(boundary) {
            let area = (areas[v as usize] / total) as f32;
            *row = Row { direction: direction.as_vec3(), distance: 0.0, area: 0.0, weight: 0.0 };
            let Some([end, ..]) = foot else { continue };
            let end = self.similarity.to_normalised(*end) / self.unit;
            // A surface that goes on has no end here, which a base mesh may have nevertheless.
            if end.distance(beyond) > GOES_ON * REACH * self.mean_edge {
                let missing = (self.points[v as usize] - end).dot(direction) as f32;
                (row.distance, row.weight) = (missing, area);
                self.boundary_error += f64::from(area * missing * missing);
            }
        }
        let most = (HUBER * self.rms) as f32;
        for row in &mut self.rows {
            row.weight *= (most / row.distance.abs().max(1e-9)).min(1.0);
        }
    }

    /// How far the points are from the surface, in the box.
    pub(in crate::levels) fn measured(&self) -> Measured {
        let normals = self.hierarchy.level(self.hierarchy.levels()).normals(&self.points);
        let (mut max, mut flipped, mut found) = (0.0_f64, 0, 0);
        for ((point, normal), foot) in self.points.iter().zip(&normals).zip(self.feet.iter()) {
            if let Some([foot, of_surface, _]) = foot {
                max = max.max(self.similarity.to_normalised(*foot).distance(*point * self.unit));
                flipped += usize::from(of_surface.dot(*normal) < 0.0);
                found += 1;
            }
        }
        let flipped = flipped as f64 / f64::from(found.max(1));
        Measured { mean: self.mean * self.unit, rms: self.rms * self.unit, max, flipped, missed: self.missed }
    }

    /// Of every point of the boundary the direction along the surface that leads away from it.
    fn outwards(&self) -> Vec<DVec3> {
        let finest = self.hierarchy.level(self.hierarchy.levels());
        let mut outwards = vec![DVec3::ZERO; self.boundary_points.len()];
        for side in finest.edges().iter().filter(|side| side.is_boundary()) {
            let [a, b, c] = [side.ends[0], side.ends[1], side.across[0]].map(|v| self.points[v as usize]);
            let along = b - a;
            let outward = along.cross(along.cross(c - a)).normalize_or_zero();
            for end in side.ends {
                if let Ok(k) = self.boundary_points.binary_search(&end) {
                    outwards[k] += outward;
                }
            }
        }
        outwards.iter_mut().for_each(|t| *t = t.normalize_or_zero());
        outwards
    }
}
