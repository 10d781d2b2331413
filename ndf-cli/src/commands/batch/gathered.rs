//! The rows of all parts of a batch.

use std::collections::HashMap;

use super::items::Item;
use super::plan::{Places, Plan, read_list};
use super::rows::{Head, Lines};
use super::shard::Shard;
use crate::output::{Failure, grouped};

/// The rows of all parts of a batch, as far as there are some.
#[derive(Debug)]
pub(super) struct Gathered {
    /// All items, in order.
    pub items: Vec<Item>,
    parts: Vec<Lines>,
    /// For every item the part and the place of its row in it.
    rows: Vec<Option<(usize, usize)>>,
}

impl Gathered {
    /// Reads the rows of all parts. A line that is torn, by a part that is at work or was killed, is not there.
    ///
    /// # Errors
    /// If they cannot be read, or do not belong to the plan.
    pub(super) fn read(plan: &Plan, places: &Places) -> Result<Self, Failure> {
        let items = read_list(plan, places)?;
        let mut rows = vec![None; items.len()];
        let mut parts = Vec::new();
        for part in 0..plan.shards {
            let path = places.rows(part + 1);
            let lines = Lines::read(&path)?;
            let shard = Shard { index: part + 1, count: plan.shards };
            let ranks: HashMap<&str, usize> =
                shard.of(items.len()).map(|place| (items[place].id.as_str(), place)).collect();
            for (k, (head, _)) in lines.iter().enumerate() {
                let Some(&place) = ranks.get(head.id.as_str()) else {
                    let what =
                        format!("{} has a row of {}, which is none of its items", path.display(), head.id);
                    return Err(Failure::new(what).try_instead("remove what is not of this batch"));
                };
                rows[place] = Some((part, k));
            }
            parts.push(lines);
        }
        Ok(Self { items, parts, rows })
    }

    /// The rows that are there, in the order of the items.
    pub(super) fn rows(&self) -> impl Iterator<Item = (&Head, &[u8])> {
        self.rows.iter().flatten().map(|&(part, place)| self.parts[part].line(place))
    }

    /// How many items have no row.
    pub(super) fn missing(&self) -> usize {
        self.rows.iter().filter(|row| row.is_none()).count()
    }

    /// Which parts lack how many rows, in words.
    pub(super) fn missing_in_words(&self) -> String {
        let count = self.parts.len();
        let lacking = (1..=count).filter_map(|index| {
            let of = Shard { index, count }.of(self.items.len());
            let (all, lacks) = (of.clone().count(), of.filter(|&place| self.rows[place].is_none()).count());
            (lacks > 0).then(|| format!("{} of {} of part {index}/{count}", grouped(lacks), grouped(all)))
        });
        lacking.collect::<Vec<_>>().join(", ")
    }
}
