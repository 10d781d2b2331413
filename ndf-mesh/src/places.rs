//! Vertices in the same place.

use ndf_core::DVec3;

/// For every position the first that has exactly the same coordinates, −0 and 0 being the same; NaN equals itself. O(n).
pub fn first_in_place(positions: &[DVec3]) -> Vec<u32> {
    // Adding zero makes −0 and 0 the same bits.
    let key = |v: u32| (positions[v as usize] + DVec3::ZERO).to_array().map(f64::to_bits);
    // A table of the first ones, a power of two long and half empty at least; collisions go to the next free place.
    let mut table = vec![FREE; (2 * positions.len()).next_power_of_two()];
    let mask = table.len() - 1;
    (0..positions.len() as u32)
        .map(|v| {
            let mut slot = hash(key(v)) as usize & mask;
            loop {
                match table[slot] {
                    FREE => {
                        table[slot] = v;
                        return v;
                    }
                    first if key(first) == key(v) => return first,
                    _ => slot = (slot + 1) & mask,
                }
            }
        })
        .collect()
}

/// In place of a vertex.
const FREE: u32 = u32::MAX;

/// Mixes all bits into all bits, by the steps of SplitMix64 (Steele, Lea and Flood 2014).
fn hash(key: [u64; 3]) -> u64 {
    key.into_iter().fold(0, |hash, bits| {
        let mut x = (hash ^ bits).wrapping_add(0x9e37_79b9_7f4a_7c15);
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_positions_have_the_same_first() {
        let nan = DVec3::new(f64::NAN, 0.0, 1.0);
        let all = [DVec3::X, DVec3::ZERO, DVec3::X, -DVec3::ZERO, DVec3::Y, nan, DVec3::X, nan];
        assert_eq!(first_in_place(&all), [0, 1, 0, 1, 4, 5, 0, 5]);
        assert!(first_in_place(&[]).is_empty());
        let grid: Vec<DVec3> =
            (0..2000).map(|i| DVec3::new(f64::from(i % 10), f64::from(i % 100), 0.0)).collect();
        assert!((0..).zip(first_in_place(&grid)).all(|(v, first)| first == v % 100));
    }
}
