//! Which methods are on the frontier of costs and error, and where ours is behind: sentences made of the data.

use super::row::{Run, Task};

/// A run in a plot.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Point {
    pub(crate) method: String,
    pub(crate) setting: String,
    /// Bytes, seconds, or both.
    pub(crate) costs: Vec<f64>,
    /// A share of 1.
    pub(crate) error: f64,
    /// Of the machine, where it is known.
    pub(crate) load: Option<f64>,
}

/// What is beside the error in a plot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Costs {
    Bytes,
    Seconds,
    Both,
}

impl Costs {
    fn name(self) -> &'static str {
        match self {
            Self::Bytes => "bytes",
            Self::Seconds => "client seconds",
            Self::Both => "bytes and client seconds",
        }
    }

    /// A run as a point, if it has all figures; meshes extracted from fields are in the plane of `plane` bytes where that is given.
    pub(crate) fn point(self, run: &Run, task: Task, plane: Option<f64>) -> Option<Point> {
        let bytes = || match plane {
            Some(plane) if run.evaluations.is_some() => Some(plane),
            _ => run.bytes.map(|bytes| bytes as f64),
        };
        let seconds = || run.client_seconds(task);
        let costs = match self {
            Self::Bytes => vec![bytes()?],
            Self::Seconds => vec![seconds()?],
            Self::Both => vec![bytes()?, seconds()?],
        };
        let error = run.error(task).filter(|e| e.is_finite())?;
        Some(Point { method: run.method.clone(), setting: run.setting.clone(), costs, error, load: run.load })
    }
}

impl Point {
    /// Whether it is a model of ours, with our settings.
    pub(crate) fn is_ours(&self) -> bool {
        self.method.starts_with("ours")
    }

    fn is_within(&self, other: &Self) -> bool {
        self.costs.iter().zip(&other.costs).all(|(a, b)| a <= b)
    }

    /// Whether another is worse in something and better in nothing.
    fn dominates(&self, other: &Self) -> bool {
        self.is_within(other)
            && self.error <= other.error
            && (self.error < other.error || self.costs.iter().zip(&other.costs).any(|(a, b)| a < b))
    }
}

/// The points that no other dominates.
pub(crate) fn frontier<'a>(points: &[&'a Point]) -> Vec<&'a Point> {
    points.iter().copied().filter(|p| !points.iter().any(|other| other.dominates(p))).collect()
}

/// Which methods are on the frontier, whether ours is, and where not and by how much; then what that is beside, and at what loads
/// seconds were measured.
pub(crate) fn sentence(points: &[Point], costs: Costs) -> String {
    comparison(points, costs) + &conditions(points, costs)
}

/// The rivals that were measured, and the loads.
fn conditions(points: &[Point], costs: Costs) -> String {
    let (ours, rivals): (Vec<&Point>, Vec<&Point>) = points.iter().partition(|point| point.is_ours());
    if ours.is_empty() || rivals.is_empty() {
        return String::new();
    }
    let mut names: Vec<&str> = rivals.iter().map(|point| point.method.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let mut text = format!(" Rivals measured here: {}.", names.join(", "));
    let loads = |points: &[&Point]| {
        let all = || points.iter().filter_map(|point| point.load);
        Some(format!("{:.1} to {:.1}", all().reduce(f64::min)?, all().reduce(f64::max)?))
    };
    if costs != Costs::Bytes
        && let (Some(ours), Some(rivals)) = (loads(&ours), loads(&rivals))
    {
        text += &format!(
            " The load of the machine was {ours} for ours and {rivals} for rivals, on which seconds depend."
        );
    }
    text
}

fn comparison(points: &[Point], costs: Costs) -> String {
    let all: Vec<&Point> = points.iter().collect();
    let rivals: Vec<&Point> = points.iter().filter(|p| !p.is_ours()).collect();
    let ours: Vec<&Point> = points.iter().filter(|p| p.is_ours()).collect();
    if ours.is_empty() || rivals.is_empty() {
        return format!(
            "Nothing can be said yet: {} of ours and {} of rivals were measured.",
            runs(ours.len()),
            runs(rivals.len())
        );
    }
    let best = frontier(&all);
    let mut methods: Vec<(&str, usize)> = Vec::new();
    for point in &best {
        let name = if point.is_ours() { "ours" } else { &point.method };
        match methods.iter_mut().find(|(method, _)| *method == name) {
            Some((_, count)) => *count += 1,
            None => methods.push((name, 1)),
        }
    }
    methods.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(b.0)));
    let listed: Vec<String> =
        methods.iter().map(|(name, count)| format!("{name} ({})", runs(*count))).collect();
    let mut text = format!("On the frontier of {} and error: {}.", costs.name(), listed.join(", "));
    if !best.iter().any(|point| point.is_ours()) {
        text += " Ours is not on it.";
    }
    // Rivals at their best, and what ours reaches at no more cost.
    let rivals = frontier(&rivals);
    let mut behind: Vec<(&Point, Option<f64>)> = Vec::new();
    for rival in &rivals {
        let reached = ours.iter().filter(|p| p.is_within(rival)).map(|p| p.error).reduce(f64::min);
        if reached.is_none_or(|error| error > rival.error) {
            behind.push((rival, reached.map(|error| error / rival.error)));
        }
    }
    if behind.is_empty() {
        text += &format!(" Ours is at or below the error of every rival at equal {}.", costs.name());
        return text;
    }
    text += &format!(
        " At equal {}, ours is at or below the error of {} of the {} that rivals have on their own frontier.",
        costs.name(),
        rivals.len() - behind.len(),
        runs(rivals.len())
    );
    let unreached: Vec<&str> =
        behind.iter().filter(|(_, f)| f.is_none()).map(|(p, _)| p.method.as_str()).collect();
    if !unreached.is_empty() {
        let mut names = unreached.clone();
        names.sort_unstable();
        names.dedup();
        let (count, names) = (runs(unreached.len()), names.join(", "));
        text += &format!(" No run of ours costs as little as {count} of {names}.");
    }
    let worst =
        behind.iter().filter_map(|(p, factor)| Some((p, (*factor)?))).max_by(|a, b| a.1.total_cmp(&b.1));
    if let Some((point, factor)) = worst {
        text += &format!(
            " It is farthest behind {} ({}), whose error is {}: ours is {factor:.2} times as large.",
            point.method,
            point.setting,
            percent(point.error)
        );
    }
    text
}

fn runs(count: usize) -> String {
    if count == 1 { "1 run".to_owned() } else { format!("{count} runs") }
}

/// A share in per cent, in three digits.
pub(crate) fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent == 0.0 || !percent.is_finite() {
        return format!("{percent} %");
    }
    let decimals = (2 - percent.abs().log10().floor() as i32).clamp(0, 9) as usize;
    format!("{percent:.decimals$} %")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(method: &str, costs: &[f64], error: f64) -> Point {
        Point { method: method.into(), setting: "h = 1".into(), costs: costs.into(), error, load: Some(2.0) }
    }

    #[test]
    fn the_frontier_is_what_nothing_dominates() {
        let points = [
            point("MC", &[1.0, 9.0], 0.5),
            point("MC", &[2.0, 9.0], 0.5),
            point("ODC", &[2.0, 1.0], 0.5),
            point("ours", &[2.0, 9.0], 0.1),
            point("SMS", &[3.0, 9.0], 0.1),
        ];
        let all: Vec<&Point> = points.iter().collect();
        let found: Vec<usize> =
            frontier(&all).iter().map(|p| points.iter().position(|q| q == *p).unwrap()).collect();
        assert_eq!(found, [0, 2, 3]);
        // Equal points are all on it.
        let twins = [point("a", &[1.0], 1.0), point("b", &[1.0], 1.0)];
        assert_eq!(frontier(&twins.iter().collect::<Vec<_>>()).len(), 2);
    }

    #[test]
    fn sentences_say_who_leads_and_where_ours_is_behind() {
        let mut points =
            vec![point("ours, 9 kB", &[2.0], 0.01), point("MC", &[3.0], 0.02), point("MC", &[2.5], 0.05)];
        let ahead = sentence(&points, Costs::Seconds);
        assert!(ahead.contains("ours (1 run)") && ahead.contains("Rivals measured here: MC."), "{ahead}");
        assert!(ahead.contains("was 2.0 to 2.0 for ours and 2.0 to 2.0 for rivals"), "{ahead}");
        assert!(ahead.contains("at or below the error of every rival at equal client seconds"), "{ahead}");
        points.push(point("ODC", &[1.0], 0.3));
        points.push(point("ODC", &[4.0], 0.004));
        let behind = sentence(&points, Costs::Seconds);
        assert!(behind.contains("0 of the 2 runs") || behind.contains("of the 4 runs"), "{behind}");
        assert!(behind.contains("No run of ours costs as little as 1 run of ODC."), "{behind}");
        assert!(
            behind.contains("farthest behind ODC (h = 1), whose error is 0.400 %: ours is 2.50 times"),
            "{behind}"
        );
        let lost = sentence(&[point("ours", &[2.0], 0.5), point("MC", &[1.0], 0.1)], Costs::Bytes);
        assert!(lost.contains("Ours is not on it"), "{lost}");
        assert!(sentence(&points[..1], Costs::Bytes).contains("Nothing can be said yet"));
    }

    #[test]
    fn extracted_meshes_are_in_the_plane_or_at_the_size_of_their_field() {
        let run = Run {
            bytes: Some(2_000_000),
            evaluations: Some(1),
            eigenvalues: Some(0.1),
            seconds_extraction: Some(1.0),
            seconds_eigenvalues: Some(2.0),
            ..Run::default()
        };
        let costs = |plane| Costs::Both.point(&run, Task::Eigenvalues, plane).unwrap().costs;
        assert_eq!((costs(Some(1e5)), costs(None)), (vec![1e5, 3.0], vec![2e6, 3.0]));
        assert_eq!(Costs::Both.point(&run, Task::Geodesics, None), None);
        assert_eq!(
            (percent(0.012345), percent(0.5), percent(1.2e-7)),
            ("1.23 %".into(), "50.0 %".into(), "0.0000120 %".into())
        );
    }
}
