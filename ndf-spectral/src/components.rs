//! Connected components, whose indicator functions span the kernel of the Laplacian.
//!
//! Where values are held at zero, a component with such vertices has no constants in the kernel. It is none of those counted here.

use crate::csr::CsrMatrix;
use crate::panel::{Row, WIDTH};

/// The connected components of a surface and their areas.
#[derive(Clone, Debug)]
pub struct Components {
    /// Component of every vertex; numbered in the order of their first vertices. [`NONE`] in components with held vertices.
    of_vertex: Vec<u32>,
    /// Area of every component.
    areas: Vec<f64>,
}

/// The number of components whose constants are not in the kernel.
const NONE: u32 = u32::MAX;

impl Components {
    /// Components of the graph of the Laplacian; areas by the mass matrix. O(n).
    pub fn new(laplacian: &CsrMatrix, mass: &CsrMatrix) -> Self {
        let n = laplacian.row_count();
        let mut of_vertex = vec![u32::MAX; n];
        let mut areas = Vec::new();
        let mut pending = Vec::new();
        for seed in 0..n {
            if of_vertex[seed] != u32::MAX {
                continue;
            }
            let component = areas.len() as u32;
            let mut area = 0.0;
            of_vertex[seed] = component;
            pending.push(seed);
            while let Some(v) = pending.pop() {
                area += mass.row(v).1.iter().sum::<f64>();
                for &w in laplacian.row(v).0 {
                    if of_vertex[w] == u32::MAX {
                        of_vertex[w] = component;
                        pending.push(w);
                    }
                }
            }
            areas.push(area);
        }
        Self { of_vertex, areas }
    }

    /// Those without held vertices, on the free vertices.
    pub(crate) fn without(&self, held: &[bool]) -> Self {
        let mut is_kept = vec![true; self.count()];
        for (&component, held) in self.of_vertex.iter().zip(held) {
            is_kept[component as usize] &= !held;
        }
        let mut next = 0;
        let number = |kept: &bool| {
            next += u32::from(*kept);
            if *kept { next - 1 } else { NONE }
        };
        let numbers: Vec<u32> = is_kept.iter().map(number).collect();
        let free = self.of_vertex.iter().zip(held).filter(|(_, held)| !**held);
        let areas = self.areas.iter().zip(&is_kept).filter(|(_, kept)| **kept).map(|(area, _)| *area);
        Self { of_vertex: free.map(|(&c, _)| numbers[c as usize]).collect(), areas: areas.collect() }
    }

    /// The same of vertices in another order: vertex `i` was `order[i]`. Numbers of components stay.
    pub(crate) fn permuted(&self, order: &[usize]) -> Self {
        Self { of_vertex: order.iter().map(|&v| self.of_vertex[v]).collect(), areas: self.areas.clone() }
    }

    /// Number of components.
    pub fn count(&self) -> usize {
        self.areas.len()
    }

    /// The component of every vertex.
    pub fn labels(&self) -> &[u32] {
        &self.of_vertex
    }

    /// Areas of the components.
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// Means over every component of the function whose product with the mass matrix is `massed`.
    pub(crate) fn means(&self, massed: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; self.count()];
        for (&component, value) in self.of_vertex.iter().zip(massed) {
            sums[component as usize] += value;
        }
        sums.iter().zip(&self.areas).map(|(sum, area)| sum / area).collect()
    }

    /// Subtracts from functions their means over every component, given their products with the mass matrix.
    pub(crate) fn remove_means(&self, panel: &mut [Row], massed: &[Row]) {
        let mut means = vec![[0.0; WIDTH]; self.count()];
        for (&component, row) in self.of_vertex.iter().zip(massed) {
            let Some(mean) = means.get_mut(component as usize) else { continue };
            mean.iter_mut().zip(&row.0).for_each(|(sum, x)| *sum += x);
        }
        for (mean, area) in means.iter_mut().zip(&self.areas) {
            mean.iter_mut().for_each(|sum| *sum /= area);
        }
        for (&component, row) in self.of_vertex.iter().zip(panel) {
            let Some(mean) = means.get(component as usize) else { continue };
            row.0.iter_mut().zip(mean).for_each(|(x, mean)| *x -= mean);
        }
    }

    /// The value on component `c` of the function of unit norm that is constant there and zero elsewhere.
    pub(crate) fn height(&self, c: usize) -> f64 {
        self.areas[c].sqrt().recip()
    }
}
