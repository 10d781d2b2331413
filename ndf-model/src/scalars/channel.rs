//! What a channel is called and which values it has.

use serde::{Deserialize, Serialize};

use super::error::ScalarsError;
use ndf_mesh::io::is_property_name;

/// Longer names are refused.
const LONGEST_NAME: usize = 255;

/// One of the fields.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Channel {
    /// Its name, which can name a [PLY property](is_property_name).
    pub name: String,
    /// Its smallest and largest value.
    pub range: [f32; 2],
    /// Value where the network gives 0.
    pub mean: f32,
    /// What a unit of the network's output stands for; 0 where the field is constant.
    pub deviation: f32,
}

impl Channel {
    /// The value that an output of the network stands for, always within the range.
    #[inline(always)]
    pub fn value(&self, output: f32) -> f32 {
        (self.mean + self.deviation * output).max(self.range[0]).min(self.range[1])
    }

    /// The output of the network that stands for a value; 0 where the field is constant.
    pub fn output(&self, value: f32) -> f32 {
        if self.deviation > 0.0 { (value - self.mean) / self.deviation } else { 0.0 }
    }

    /// Whether name and range can stand in a file.
    ///
    /// # Errors
    /// If they cannot.
    pub(super) fn validate(&self) -> Result<(), ScalarsError> {
        if !is_property_name(&self.name) || self.name.len() > LONGEST_NAME {
            return Err(ScalarsError::Name(self.name.clone()));
        }
        let [min, max] = self.range;
        let finite = [min, max, self.mean, self.deviation].into_iter().all(f32::is_finite);
        if !(finite && min <= max && self.deviation >= 0.0) {
            return Err(ScalarsError::Range(self.name.clone()));
        }
        Ok(())
    }
}
