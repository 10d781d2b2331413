//! Plots of error against one cost, and the sentences below them.

use std::fs;
use std::path::Path;

use super::html::{details, figure, table};
use crate::plot::{Line, error_by_bytes, error_by_seconds};
use crate::reproduce::pareto::{Costs, Point, percent, sentence};
use crate::reproduce::row::{Run, Task};

/// Runs of one experiment as plots: a pair for each shape.
pub(super) struct Plots<'a> {
    /// The folder of the plots, and what their names begin with.
    pub(super) folder: &'a Path,
    pub(super) name: &'a str,
    pub(super) costs: Costs,
    /// Whether a model counts with the edge length that suits it best, and models of one kind are a line.
    pub(super) is_best_length: bool,
}

impl Plots<'_> {
    /// The plots with their sentences, and the table of all runs.
    pub(super) fn html(&self, runs: &[Run]) -> Result<String, String> {
        let mut shapes: Vec<(&str, &str)> = Vec::new();
        for run in runs {
            if !shapes.contains(&(&run.shape, &run.kind)) {
                shapes.push((&run.shape, &run.kind));
            }
        }
        let mut html = String::new();
        for (shape, kind) in shapes {
            let of_shape: Vec<&Run> = runs.iter().filter(|r| r.shape == shape && r.kind == kind).collect();
            html += &format!("<h3>{} ({})</h3>\n", super::html::escaped(shape), super::html::escaped(kind));
            html += "<div class=\"plots\">\n";
            for task in Task::ALL {
                let points = self.points(&of_shape, task);
                if points.is_empty() {
                    continue;
                }
                let title = format!("{shape}: {}", task.name());
                let axis = format!("error of {}, %", task.name());
                let draw = if self.costs == Costs::Seconds { error_by_seconds } else { error_by_bytes };
                let svg = draw(&title, &axis, &self.lines(&points)).map_err(|e| e.to_string())?;
                let file = self.folder.join(format!("{}-{shape}-{kind}-{}.svg", self.name, task.name()));
                fs::write(&file, &svg).map_err(|e| format!("{}: {e}", file.display()))?;
                html += &figure(&svg, &sentence(&points, self.costs));
            }
            html += "</div>\n";
            html += &details("All runs of this shape", &runs_table(&of_shape));
        }
        Ok(html)
    }

    fn points(&self, runs: &[&Run], task: Task) -> Vec<Point> {
        let mut points: Vec<Point> = Vec::new();
        for point in runs.iter().filter_map(|run| self.costs.point(run, task, None)) {
            let is_model = point.is_ours() || point.method.starts_with(crate::reproduce::fits::PAPER);
            let earlier = points.iter_mut().find(|p| p.method == point.method);
            match earlier.filter(|_| self.is_best_length && is_model) {
                Some(earlier) if earlier.error > point.error => *earlier = point,
                Some(_) => {}
                None => points.push(point),
            }
        }
        points
    }

    /// A line a method, from the largest error to the least.
    fn lines(&self, points: &[Point]) -> Vec<Line> {
        let mut lines: Vec<Line> = Vec::new();
        for point in points {
            let is_size = point.method.starts_with("ours") && point.method.ends_with("kB");
            let name = if self.is_best_length && is_size { "ours" } else { &point.method };
            let place = (point.costs[0], 100.0 * point.error);
            match lines.iter_mut().find(|(line, _)| line == name) {
                Some((_, places)) => places.push(place),
                None => lines.push((name.to_owned(), vec![place])),
            }
        }
        lines.iter_mut().for_each(|(_, places)| places.sort_by(|a, b| b.1.total_cmp(&a.1)));
        lines.sort_by_key(|(name, _)| !name.starts_with("ours"));
        lines
    }
}

const HEADER: [&str; 16] = [
    "method",
    "setting",
    "kB",
    "faces",
    "passing through",
    "geodesics",
    "own source",
    "largest",
    "eigenvalues",
    "modes",
    "making",
    "queries",
    "extraction",
    "geodesics",
    "eigenvalues",
    "load",
];

fn runs_table(runs: &[&Run]) -> String {
    let rows: Vec<Vec<String>> =
        runs.iter().filter(|run| run.left_out.is_empty()).map(|run| row(run)).collect();
    table(&HEADER, 2, &rows)
}

fn row(run: &Run) -> Vec<String> {
    let share = |x: Option<f64>| x.map_or_else(String::new, percent);
    let seconds = |x: Option<f64>| x.map_or_else(String::new, |x| format!("{x:.2} s"));
    let count = |x: Option<u64>| x.map_or_else(String::new, |x| x.to_string());
    let length = |x: Option<f64>| x.map_or_else(String::new, |x| format!("{x:.3}"));
    vec![
        run.method.clone(),
        run.setting.clone(),
        run.bytes.map_or_else(String::new, |b| format!("{:.1}", b as f64 / 1000.0)),
        run.faces.map_or_else(String::new, |f| f.to_string()),
        count(run.self_intersections),
        share(run.geodesic_share),
        share(run.own_geodesic_share),
        length(run.geodesic_max),
        share(run.eigenvalues),
        share(run.modes),
        seconds(run.seconds_making),
        seconds(run.seconds_queries),
        seconds(run.seconds_extraction),
        seconds(run.seconds_geodesics),
        seconds(run.seconds_eigenvalues),
        run.load.map_or_else(String::new, |load| format!("{load:.1}")),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(method: &str, setting: &str, bytes: usize, error: f64) -> Run {
        Run {
            shape: "a".into(),
            kind: "neus".into(),
            method: method.into(),
            setting: setting.into(),
            bytes: Some(bytes),
            eigenvalues: Some(error),
            geodesic_share: Some(error),
            seconds_extraction: Some(1.0),
            seconds_eigenvalues: Some(1.0),
            seconds_geodesics: Some(1.0),
            ..Run::default()
        }
    }

    #[test]
    fn models_count_with_their_best_edge_length() {
        let runs = [
            run("ours, 9 kB", "h = 0.1", 9000, 0.2),
            run("ours, 9 kB", "h = 0.05", 9000, 0.1),
            run("ours, 26 kB", "h = 0.1", 26000, 0.05),
            run("SMS", "2000 faces", 9000, 0.3),
            run("SMS", "4000 faces", 18000, 0.2),
        ];
        let runs: Vec<&Run> = runs.iter().collect();
        let plots =
            |is_best_length| Plots { folder: Path::new(""), name: "", costs: Costs::Bytes, is_best_length };
        let best = plots(true).points(&runs, Task::Eigenvalues);
        assert_eq!(best.iter().map(|p| p.error).collect::<Vec<_>>(), [0.1, 0.05, 0.3, 0.2]);
        let lines = plots(true).lines(&best);
        assert_eq!(
            lines.iter().map(|(name, p)| (name.as_str(), p.len())).collect::<Vec<_>>(),
            [("ours", 2), ("SMS", 2)]
        );
        assert_eq!(plots(false).points(&runs, Task::Eigenvalues).len(), 5);
    }
}
