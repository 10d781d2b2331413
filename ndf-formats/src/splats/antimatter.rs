//! Records of 32 bytes: position and scales as floats, colour and opacity, rotation as bytes.

use super::Splat;

const RECORD: usize = 32;

/// Records are told by what they say: finite positions, scales that are positive and no larger than the scene.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    let (records, rest) = bytes.as_chunks::<RECORD>();
    if !rest.is_empty() || records.is_empty() {
        return false;
    }
    let plausible = |record: &[u8; RECORD]| {
        let splat = splat(record);
        splat.is_sound()
            && splat.center.iter().all(|x| x.abs() < 1e5)
            && splat.scales.iter().all(|&s| (1e-12..1e4).contains(&s))
    };
    let step = records.len().div_ceil(1000);
    let (good, all) = records
        .iter()
        .step_by(step)
        .fold((0, 0), |(good, all), r| (good + usize::from(plausible(r)), all + 1));
    10 * good >= 9 * all
}

pub(super) fn read(bytes: &[u8]) -> Vec<Splat> {
    bytes.as_chunks::<RECORD>().0.iter().map(splat).collect()
}

fn splat(record: &[u8; RECORD]) -> Splat {
    let float = |i: usize| f32::from_le_bytes([record[i], record[i + 1], record[i + 2], record[i + 3]]);
    let quaternion = |i: usize| (f32::from(record[28 + i]) - 128.0) / 128.0;
    Splat {
        center: [0, 4, 8].map(|i| f64::from(float(i))),
        scales: [12, 16, 20].map(float),
        rotation: [0, 1, 2, 3].map(quaternion),
        opacity: f32::from(record[27]) / 255.0,
    }
}
