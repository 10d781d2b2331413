//! The `METR` section: how much longer lengths on the true surface are.

use super::bytes::{Reader, Writer};
use super::error::ModelError;
use crate::metric::Metric;

/// The tag.
pub(super) const TAG: &str = "METR";

/// One number for all of the surface.
const UNIFORM: u8 = 0;

pub(super) fn write(metric: Metric) -> Vec<u8> {
    let mut w = Writer::default();
    w.u8(UNIFORM);
    w.f32s([metric.area(), metric.exponent()]);
    w.0
}

pub(super) fn read(mut r: Reader<'_>) -> Result<Metric, ModelError> {
    match r.u8()? {
        UNIFORM => {}
        other => return Err(r.unknown_coding(other)),
    }
    let metric = Metric::new(r.f32()?, r.f32()?).map_err(|e| r.defect(e))?;
    r.end()?;
    Ok(metric)
}
