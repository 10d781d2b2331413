//! Numbers with bounds.

use std::time::Duration;

use ndf::DVec3;
use ndf_model::file::Precision;

/// A positive length.
pub fn length(text: &str) -> Result<f64, String> {
    let x: f64 = text.parse().map_err(|_| "a number is expected".to_owned())?;
    if x.is_finite() && x > 0.0 { Ok(x) } else { Err("a positive number is expected".to_owned()) }
}

/// An angle in degrees.
pub fn angle(text: &str) -> Result<f64, String> {
    finite(text)
}

/// The angle between the normals at a crease, in degrees.
pub fn crease(text: &str) -> Result<f64, String> {
    match finite(text)? {
        degrees if degrees > 0.0 && degrees < 180.0 => Ok(degrees),
        _ => Err("expected degrees between 0 and 180, such as 30".to_owned()),
    }
}

/// A number of bits of features.
pub fn bits(text: &str) -> Result<u32, String> {
    let allowed = Precision::BITS;
    match text.parse() {
        Ok(bits) if allowed.contains(&bits) => Ok(bits),
        _ => Err(format!("expected a number from {} to {}", allowed.start(), allowed.end())),
    }
}

/// A finite number.
pub(super) fn finite(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if number.is_finite() { Ok(number) } else { Err("not finite".to_owned()) }
}

/// A positive number.
pub(super) fn positive(text: &str) -> Result<f32, String> {
    let x: f32 = text.parse().map_err(|_| "a number is expected".to_owned())?;
    if x.is_finite() && x > 0.0 { Ok(x) } else { Err("a positive number is expected".to_owned()) }
}

/// A weight of a loss.
pub(super) fn weight(text: &str) -> Result<f32, String> {
    let x: f32 = text.parse().map_err(|_| "a number is expected".to_owned())?;
    if x.is_finite() && x >= 0.0 { Ok(x) } else { Err("expected a number that is not negative".to_owned()) }
}

/// A share of something, as a number or in per cent.
pub fn share(text: &str) -> Result<f64, String> {
    let (number, unit) = text.strip_suffix('%').map_or((text, 1.0), |number| (number.trim_end(), 0.01));
    let share = number.parse().map(|x: f64| x * unit).ok().filter(|x| *x > 0.0 && *x < 1.0);
    share.ok_or_else(|| "expected a share such as 0.02% or 0.0002".to_owned())
}

/// A time.
pub fn seconds(text: &str) -> Result<Duration, String> {
    let x: f64 = text.parse().map_err(|_| "expected a number of seconds".to_owned())?;
    Duration::try_from_secs_f64(x).map_err(|_| "expected a number of seconds that is not negative".to_owned())
}

/// A point: three numbers with commas between them.
pub fn point(text: &str) -> Result<DVec3, String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|w| w.trim().parse().ok()).collect();
    match numbers[..] {
        [x, y, z] if text.split(',').count() == 3 && DVec3::new(x, y, z).is_finite() => {
            Ok(DVec3::new(x, y, z))
        }
        _ => Err("three numbers like 0.5,-1,2 are expected".to_owned()),
    }
}

/// Numbers of vertices, at least two.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Vertices(pub Vec<u32>);

/// Two or more numbers of vertices with commas between them.
pub fn vertices(text: &str) -> Result<Vertices, String> {
    let numbers: Result<Vec<u32>, _> = text.split(',').map(|word| word.trim().parse()).collect();
    match numbers {
        Ok(numbers) if numbers.len() > 1 => Ok(Vertices(numbers)),
        _ => Err("numbers of two or more vertices, like 0,17,4, are expected".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_two_vertices_or_more() {
        assert_eq!(vertices("3, 1,2"), Ok(Vertices(vec![3, 1, 2])));
        for bad in ["", "1", "1,", "1,-2", "1,x"] {
            assert!(vertices(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn points_are_three_numbers() {
        assert_eq!(point("1,-2.5, 3e2"), Ok(DVec3::new(1.0, -2.5, 300.0)));
        for bad in ["", "1,2", "1,2,3,4", "1,2,x", "1,2,x,3", "1,2,inf"] {
            assert!(point(bad).is_err(), "{bad}");
        }
    }
}
