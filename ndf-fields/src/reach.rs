//! How far heat reaches in double precision.

use ndf_spectral::Components;

/// Heat below this part of the hottest loses digits, and soon all of them.
const UNDERFLOW: f64 = 1e-290;

/// Whether heat is so little that its direction and its quotients are lost.
pub(crate) fn is_underflow(heat: f64, hottest: f64) -> bool {
    heat < UNDERFLOW * hottest
}

/// How many vertices of components with heat have none that double precision resolves.
pub(crate) fn out_of_reach(heat: &[f64], components: &Components) -> usize {
    let labels = components.labels();
    let mut hottest = vec![0.0_f64; components.count()];
    for (u, &component) in heat.iter().zip(labels) {
        hottest[component as usize] = hottest[component as usize].max(*u);
    }
    heat.iter().zip(labels).filter(|&(u, &c)| is_underflow(*u, hottest[c as usize])).count()
}
