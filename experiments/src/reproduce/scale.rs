//! How much is run: all of it, or what ends within ten minutes.

/// Sizes of everything.
#[derive(Clone, Debug)]
pub(crate) struct Scale {
    /// Whether this is the quick subset.
    pub(crate) is_quick: bool,
    /// Cells along the longest side of the truths of fields and of meshes, and the edge length to which they are
    /// remeshed; edges of truths of meshes are split to twice that.
    pub(crate) field_grid: u32,
    pub(crate) mesh_grid: u32,
    pub(crate) truth_edge: f64,
    /// Cells of isosurfacing, in the box.
    pub(crate) cells: &'static [f64],
    /// Edge lengths of meshes of models, in the box.
    pub(crate) edge_lengths: &'static [f64],
    /// Bytes of models of levels.
    pub(crate) sizes: &'static [usize],
    /// Epochs of the paper's preset; all of them if not given.
    pub(crate) paper_epochs: Option<usize>,
    /// Faces that spectral simplification leaves, the most first: it goes through all of them.
    pub(crate) sms_faces: &'static [usize],
    /// Quadrilaterals of neural geometry fields, and iterations on each of their tessellations.
    pub(crate) ngf_quads: &'static [usize],
    pub(crate) ngf_iterations: usize,
    /// Faces and micro-faces of micromeshes.
    pub(crate) micromeshes: &'static [(usize, usize)],
    /// Faces of the meshes that Draco compresses, and its bits.
    pub(crate) draco_faces: &'static [usize],
    pub(crate) draco_bits: &'static [u32],
    /// Shapes of each kind.
    pub(crate) shapes: usize,
    /// How often solves are timed that take less than two seconds.
    pub(crate) repeats: usize,
}

impl Scale {
    /// The supplement's sizes. Cells and edge lengths begin with the coarse ones, so that a run that is stopped has some of each
    /// method.
    pub(crate) const FULL: Self = Self {
        is_quick: false,
        field_grid: 300,
        mesh_grid: 400,
        truth_edge: 0.005,
        cells: &[0.1, 0.05, 0.03, 0.02, 0.07, 0.04, 0.09, 0.08, 0.06, 0.01],
        edge_lengths: &[0.2, 0.1, 0.05, 0.025, 0.014, 0.14, 0.07, 0.035, 0.01],
        sizes: &[9_000, 26_000, 4_500, 52_000, 17_500, 35_000],
        paper_epochs: None,
        sms_faces: &[32_000, 16_000, 8_000, 4_000, 2_000, 1_000],
        ngf_quads: &[400, 100, 200, 800],
        ngf_iterations: 100,
        micromeshes: &[(1_000, 64_000), (4_000, 64_000), (250, 64_000), (1_000, 256_000), (16_000, 256_000)],
        draco_faces: &[8_000, 32_000, 2_000, 128_000, 4_000, 16_000, 64_000, 256_000, 512_000],
        draco_bits: &[8, 9, 10, 11, 12, 14],
        shapes: 10,
        repeats: 3,
    };

    /// A part of it with coarser truths.
    pub(crate) const QUICK: Self = Self {
        is_quick: true,
        field_grid: 128,
        mesh_grid: 200,
        truth_edge: 0.02,
        cells: &[0.1, 0.05],
        edge_lengths: &[0.1, 0.05, 0.025],
        sizes: &[9_000, 4_500],
        paper_epochs: Some(100),
        sms_faces: &[2_000],
        ngf_quads: &[60],
        ngf_iterations: 100,
        micromeshes: &[(500, 16_000)],
        draco_faces: &[2_000, 8_000],
        draco_bits: &[8, 10, 12],
        shapes: 1,
        repeats: 3,
    };

    /// What the quick subset leaves out of the full one, in a sentence.
    pub(crate) fn left_out(&self) -> Option<String> {
        let full = Self::FULL;
        self.is_quick.then(|| {
            format!(
                "The quick subset has {} shape of each kind in place of up to {}, truths on grids of {} and {} cells with edges of {} \
                 in place of {}, {} and {}, {} of {} cell sizes, {} of {} edge lengths, {} of {} sizes of models (one on fields), {} of the 10,000 \
                 epochs of the paper's preset, no compressed meshes of networks, no pictures of radiance fields and splats, and no runs of spectral simplification, neural geometry fields, micromeshes and \
                 Draco but {}, {}, {} and {} of {}, {}, {} and {}.",
                self.shapes, full.shapes, self.field_grid, self.mesh_grid, self.truth_edge, full.field_grid,
                full.mesh_grid, full.truth_edge, self.cells.len(), full.cells.len(), self.edge_lengths.len(),
                full.edge_lengths.len(), self.sizes.len(), full.sizes.len(), self.paper_epochs.unwrap_or_default(),
                self.sms_faces.len(), self.ngf_quads.len(), self.micromeshes.len(), 2 * self.draco_faces.len() * self.draco_bits.len(),
                full.sms_faces.len(), full.ngf_quads.len(), full.micromeshes.len(), 2 * full.draco_faces.len() * full.draco_bits.len(),
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::Scale;

    #[test]
    fn the_quick_subset_is_a_part_that_has_some_of_everything() {
        let (quick, full) = (Scale::QUICK, Scale::FULL);
        assert!(quick.cells.iter().all(|h| full.cells.contains(h)) && !quick.cells.is_empty());
        assert!(
            quick.edge_lengths.iter().all(|h| full.edge_lengths.contains(h)) && quick.edge_lengths.len() > 1
        );
        assert!(quick.sizes.iter().all(|size| full.sizes.contains(size)) && quick.sizes.len() > 1);
        assert!(quick.sms_faces.iter().all(|n| full.sms_faces.contains(n)) && !quick.sms_faces.is_empty());
        assert!(quick.draco_faces.iter().all(|n| full.draco_faces.contains(n)));
        assert!(quick.draco_bits.iter().all(|n| full.draco_bits.contains(n)));
        assert!(!quick.ngf_quads.is_empty() && !quick.micromeshes.is_empty() && quick.shapes > 0);
        assert!(quick.left_out().is_some_and(|text| text.contains("100 of the 10,000 epochs")));
        assert_eq!(full.left_out(), None);
    }

    #[test]
    fn the_full_run_has_the_sizes_of_the_supplement() {
        let sorted = |values: &[f64]| {
            let mut values = values.to_vec();
            values.sort_by(f64::total_cmp);
            values
        };
        let full = Scale::FULL;
        assert_eq!(sorted(full.cells), (1..=10).map(|k| f64::from(k) / 100.0).collect::<Vec<_>>());
        let lengths = [0.01, 0.014, 0.025, 0.035, 0.05, 0.07, 0.1, 0.14, 0.2];
        assert_eq!(sorted(full.edge_lengths), lengths);
        assert_eq!((full.field_grid, full.mesh_grid, full.truth_edge), (300, 400, 0.005));
    }
}
