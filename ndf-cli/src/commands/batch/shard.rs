//! The part of a batch that one process does.

use std::fmt;
use std::str::FromStr;

use crate::output::Failure;

/// Part `index` of `count`, counted from 1. Items are dealt in turns, so that long and short ones mix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 1 to `count`.
    pub index: usize,
    /// How many there are.
    pub count: usize,
}

impl Shard {
    /// A batch that is not divided.
    pub const WHOLE: Self = Self { index: 1, count: 1 };

    fn new(index: usize, count: usize) -> Result<Self, String> {
        if (1..=count).contains(&index) {
            return Ok(Self { index, count });
        }
        Err(format!("there is no part {index} of {count}; parts are counted from 1"))
    }

    /// The places of its items in a list of so many.
    pub fn of(self, items: usize) -> impl Iterator<Item = usize> + Clone {
        (self.index - 1..items).step_by(self.count)
    }

    /// The part that is this task of a Slurm array, if it is one, by a function that looks up environment variables.
    ///
    /// # Errors
    /// If the tasks are not numbered evenly.
    pub fn of_slurm(variable: impl Fn(&str) -> Option<String>) -> Result<Option<Self>, Failure> {
        let number = |name: &str| variable(&format!("SLURM_ARRAY_TASK_{name}"))?.parse::<usize>().ok();
        let Some(task) = number("ID") else { return Ok(None) };
        let (first, step) = (number("MIN").unwrap_or(1), number("STEP").unwrap_or(1).max(1));
        let count = number("COUNT").unwrap_or(1);
        let above = task.checked_sub(first).filter(|above| above % step == 0);
        let shard = above.and_then(|above| Self::new(above / step + 1, count).ok());
        shard.map(Some).ok_or_else(|| {
            let told = format!(
                "task {task} of a Slurm array of {count} that begins with {first} is no part of a batch"
            );
            Failure::new(told).try_instead("number the tasks evenly, as in --array=1-16, or give --shard")
        })
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        let (index, count) = numbers.ok_or("expected a part and how many there are, such as 3/16")?;
        Self::new(index, count)
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_share_out_everything() {
        for items in [0, 1, 7, 12] {
            for count in 1..6 {
                let mut all: Vec<usize> =
                    (1..=count).flat_map(|index| Shard { index, count }.of(items)).collect();
                all.sort_unstable();
                assert_eq!(all, (0..items).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn parts_are_read_and_counted_from_one() {
        assert_eq!("3/16".parse(), Ok(Shard { index: 3, count: 16 }));
        for wrong in ["0/2", "3/2", "1", "1/", "a/b", "1/0", "-1/2"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn tasks_of_arrays_are_parts() {
        let of = |id: &str, min: &str, step: &str, count: &str| {
            let values = [("ID", id), ("MIN", min), ("STEP", step), ("COUNT", count)];
            let values = values.map(|(name, value)| (format!("SLURM_ARRAY_TASK_{name}"), value.to_owned()));
            Shard::of_slurm(|name| {
                values.iter().find(|(n, v)| n == name && !v.is_empty()).map(|(_, v)| v.clone())
            })
        };
        assert_eq!(of("", "", "", ""), Ok(None));
        assert_eq!(of("0", "0", "1", "4"), Ok(Some(Shard { index: 1, count: 4 })));
        assert_eq!(of("3", "0", "1", "4"), Ok(Some(Shard { index: 4, count: 4 })));
        assert_eq!(of("11", "1", "5", "3"), Ok(Some(Shard { index: 3, count: 3 })));
        // Of --array=1,3,7.
        assert!(of("7", "1", "1", "3").is_err());
        assert!(of("2", "1", "5", "3").is_err());
    }
}
