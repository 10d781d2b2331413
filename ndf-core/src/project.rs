//! Projecting many points over all threads.

use rayon::prelude::*;

use crate::{Answer, Miss, Query, Surface};

/// Projects every query over the current rayon pool, in [batches](Surface::batch). The answers do not depend on the number of threads.
///
/// # Panics
/// If the slices differ in length.
pub fn project_all(surface: &dyn Surface, queries: &[Query], feet: &mut [Answer]) {
    assert_eq!(queries.len(), feet.len());
    let batch = surface.batch().max(1);
    queries.par_chunks(batch).zip(feet.par_chunks_mut(batch)).for_each(|(q, f)| surface.project(q, f));
}

/// As [`project_all`], into a new vector.
pub fn projected(surface: &dyn Surface, queries: &[Query]) -> Vec<Answer> {
    let mut feet = vec![Err(Miss::OutOfReach); queries.len()];
    project_all(surface, queries, &mut feet);
    feet
}
