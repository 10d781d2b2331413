//! The level set of any scalar field as a surface.
//!
//! Neural distances, occupancies and densities, winding numbers and sums of Gaussians are all learned through
//! [`LevelSetSurface`]. All queries of a batch advance together, so that a field which is a network sees large
//! batches.

mod closest_point;
mod line_search;
mod side;
#[cfg(test)]
mod tests;

use ndf_core::{Answer, BoundingBox, DVec3, Foot, Hint, ImplicitField, Miss, Query, Surface};

use closest_point::Polish;
use line_search::{Line, search};
use side::Side;

/// How to look for the level. Lengths are in the field's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelSearch {
    /// How far along the gradient is looked. A level farther away is a [`Miss::NoCrossing`].
    pub reach: f64,
    /// How far along the guide is looked: what lies farther is likely another part of the surface. This is also the
    /// thickest wall that a point which has strayed through it is led back across.
    pub guide_reach: f64,
    /// The longest step of the search along a line: what is thinner may be jumped over. A field with a
    /// [Lipschitz bound](ImplicitField::lipschitz) is stepped through faster where the bound allows it.
    pub step: f64,
    /// How far a foot may be from the level.
    pub tolerance: f64,
    /// The most steps from the crossing of the line towards the closest point; 0 leaves feet on the line.
    pub polish: u32,
}

/// What is found within this many longest steps is taken for the closest part of the surface.
const NEAR: f64 = 2.0;

impl LevelSearch {
    /// The search for a surface in a box: a reach of a tenth of its diagonal (1/50 along guides), steps of
    /// 1/200, a tolerance of 10⁻⁷, and up to 8 steps of polish.
    pub fn within(bounds: &BoundingBox) -> Self {
        let diagonal = bounds.diagonal();
        Self {
            reach: 0.1 * diagonal,
            guide_reach: 0.02 * diagonal,
            step: 0.005 * diagonal,
            tolerance: 1e-7 * diagonal,
            polish: 8,
        }
    }
}

/// The level set of a field.
///
/// **Projection** of a point p with a guiding normal n: the line through p along n is searched for the level,
/// outward from a point inside and inward from a point outside, so that the crossing found is one where n leaves the
/// inside. The crossing is then moved along the level set to the point of it closest to p, by steps on tangent planes
/// (the limit p − x ∥ ∇f is a local minimum of the distance), unless that leads to where the surface is turned
/// against n. Without a guide, or where its line meets the level far away (two [steps](LevelSearch::step)) or not within
/// [`LevelSearch::guide_reach`], the gradient at p shows another way, and the nearer crossing is taken. If that leads to
/// where the surface is turned against n, p has strayed through a thin wall: the search goes on from there through the
/// wall, along n, to the other side. Points without a guide also look along the axes if the gradient does not lead to
/// the level at once. Points whose lines do not meet the level within [`LevelSearch::reach`] miss.
///
/// **Cost** of a projection: 5 to 10 values and 3 to 6 gradients, mostly.
#[derive(Clone, Debug)]
pub struct LevelSetSurface<F> {
    field: F,
    search: LevelSearch,
}

impl<F: ImplicitField> LevelSetSurface<F> {
    /// The level set of a field, searched as is usual [within its bounds](LevelSearch::within).
    pub fn new(field: F) -> Self {
        let search = LevelSearch::within(&field.bounds());
        Self { field, search }
    }

    /// The same surface with another search.
    #[must_use]
    pub fn with_search(self, search: LevelSearch) -> Self {
        Self { search, ..self }
    }

    /// How the level is looked for.
    pub fn search(&self) -> &LevelSearch {
        &self.search
    }

    /// The field.
    pub fn field(&self) -> &F {
        &self.field
    }

    /// Replaces the lines of some points by lines along the axes, where one of these meets the level sooner: the
    /// gradient of a rough field may lead anywhere.
    fn search_along_axes(
        &self,
        side: &Side<'_, F>,
        points: &[DVec3],
        starts: &[(f64, DVec3)],
        which: &[usize],
        crossed: &mut [Option<Line>],
    ) {
        let axes = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
        let lines = which.iter().flat_map(|&k| {
            let (height, gradient) = starts[k];
            axes.clone().map(move |axis| Some(Line::new(points[k], axis, height, gradient, &self.search)))
        });
        let mut lines: Vec<Option<Line>> = lines.collect();
        search(side, &mut lines, &self.search);
        for (&k, lines) in which.iter().zip(lines.chunks_exact(6)) {
            let all = lines.iter().flatten().filter(|line| line.is_bracketed()).chain(&crossed[k]);
            crossed[k] = all.min_by(|a, b| a.length().total_cmp(&b.length())).cloned();
        }
    }

    /// Leads feet whose normals oppose their guides through the wall they lie on, to its other side, where that is
    /// within reach of the guide. Guides come with the numbers of their feet.
    fn cross_walls(&self, side: &Side<'_, F>, guides: &[(usize, DVec3)], feet: &mut [Answer]) {
        let within = 4.0 * self.search.tolerance;
        let opposed: Vec<(usize, DVec3, DVec3)> = guides
            .iter()
            .filter_map(|&(i, guide)| feet[i].ok().map(|foot| (i, guide, foot)))
            .filter(|(_, guide, foot)| closest_point::opposes(foot.normal, *guide))
            .map(|(i, guide, foot)| (i, guide, foot.point - within * foot.normal))
            .collect();
        if opposed.is_empty() {
            return;
        }
        let starts: Vec<DVec3> = opposed.iter().map(|&(_, _, start)| start).collect();
        let along_guide = LevelSearch { reach: self.search.guide_reach, ..self.search };
        let mut lines: Vec<Option<Line>> = opposed
            .iter()
            .zip(side.values_and_gradients(&starts))
            .map(|(&(_, guide, start), (f, g))| Some(Line::new(start, guide, f, g, &along_guide)))
            .collect();
        search(side, &mut lines, &along_guide);
        let bracketed = lines.into_iter().zip(&opposed).filter_map(|(line, &(i, guide, _))| {
            line.filter(Line::is_bracketed).map(|line| Polish::new(i, line, Some(guide)))
        });
        let mut found: Vec<Polish> = bracketed.collect();
        closest_point::polish(side, &mut found, &self.search);
        for (i, foot) in found.into_iter().map(Polish::into_foot) {
            if let Ok([point, normal]) = foot {
                feet[i] = Ok(Foot { point, normal, hint: Hint::NONE });
            }
        }
    }
}

impl<F: ImplicitField> Surface for LevelSetSurface<F> {
    fn bounds(&self) -> BoundingBox {
        self.field.bounds()
    }

    fn project(&self, queries: &[Query], feet: &mut [Answer]) {
        feet.fill(Err(Miss::NotFinite));
        let side = Side::of(&self.field);
        let finite: Vec<usize> = (0..queries.len()).filter(|&i| queries[i].point.is_finite()).collect();
        let points: Vec<DVec3> = finite.iter().map(|&i| queries[i].point).collect();
        let starts = side.values_and_gradients(&points);
        let guide = |i: usize| queries[i].normal.filter(|n| n.is_finite()).and_then(DVec3::try_normalize);

        let along_guides: Vec<Option<DVec3>> = finite.iter().map(|&i| guide(i)).collect();
        let lines = |directions: &[Option<DVec3>]| -> Vec<Option<Line>> {
            let starts = points.iter().zip(&starts).zip(directions);
            starts.map(|((&p, &(f, g)), d)| d.map(|d| Line::new(p, d, f, g, &self.search))).collect()
        };
        let mut lines_of_guides = lines(&along_guides);
        let along_guide = LevelSearch { reach: self.search.guide_reach, ..self.search };
        search(&side, &mut lines_of_guides, &along_guide);
        // The others follow the gradient, and so do those whose guides led far: it may lead to something nearer.
        let is_near = |line: &Line| line.length() <= NEAR * self.search.step;
        let missed =
            |line: &Option<Line>| line.as_ref().is_none_or(|line| !(line.is_bracketed() && is_near(line)));
        let along_gradients: Vec<Option<DVec3>> = lines_of_guides
            .iter()
            .zip(&starts)
            .map(|(line, (_, gradient))| gradient.try_normalize().filter(|_| missed(line)))
            .collect();
        let mut lines_of_gradients = lines(&along_gradients);
        search(&side, &mut lines_of_gradients, &self.search);

        let either = |(first, second): (Option<Line>, Option<Line>)| {
            let bracketed = first.into_iter().chain(second).filter(Line::is_bracketed);
            bracketed.min_by(|a, b| a.length().total_cmp(&b.length()))
        };
        let mut crossed: Vec<Option<Line>> =
            lines_of_guides.into_iter().zip(lines_of_gradients).map(either).collect();
        let wrong: Vec<usize> = (0..crossed.len())
            .filter(|&k| along_guides[k].is_none() && !crossed[k].as_ref().is_some_and(is_near))
            .collect();
        self.search_along_axes(&side, &points, &starts, &wrong, &mut crossed);
        let mut found = Vec::new();
        for (k, line) in crossed.into_iter().enumerate() {
            feet[finite[k]] = Err(Miss::NoCrossing);
            found.extend(line.map(|line| Polish::new(finite[k], line, along_guides[k])));
        }
        closest_point::polish(&side, &mut found, &self.search);
        for polished in found {
            let (i, foot) = polished.into_foot();
            feet[i] = foot.map(|[point, normal]| Foot { point, normal, hint: Hint::NONE });
        }
        let guides: Vec<(usize, DVec3)> =
            finite.iter().zip(along_guides).filter_map(|(&i, guide)| Some((i, guide?))).collect();
        self.cross_walls(&side, &guides, feet);
    }

    fn tolerance(&self) -> f64 {
        self.search.tolerance
    }

    fn as_field(&self) -> Option<&dyn ImplicitField> {
        Some(&self.field)
    }
}
