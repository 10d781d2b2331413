//! Plots as SVG.

use std::ops::Range;

use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

/// A line of a plot: its name, and points of what it is plotted against and of the error.
pub(crate) type Line = (String, Vec<(f64, f64)>);

/// Error against bytes, both logarithmically. `error` says what of, in percent. Points without bytes or error have no
/// place there and are left out, as are lines without points.
pub(crate) fn error_by_bytes(
    title: &str,
    error: &str,
    lines: &[Line],
) -> Result<String, Box<dyn std::error::Error>> {
    error_by(title, error, lines, ("bytes", &|x| format!("{:.0} kB", x / 1000.0)))
}

/// Error against seconds, as above.
pub(crate) fn error_by_seconds(
    title: &str,
    error: &str,
    lines: &[Line],
) -> Result<String, Box<dyn std::error::Error>> {
    error_by(title, error, lines, ("client seconds", &|x| format!("{} s", tidy(x))))
}

/// Ticks are sums of floats: 0.6000000000000001.
fn tidy(tick: &f64) -> f64 {
    (tick * 1e6).round() / 1e6
}

fn error_by(
    title: &str,
    error: &str,
    lines: &[Line],
    (x_name, x_label): (&str, &dyn Fn(&f64) -> String),
) -> Result<String, Box<dyn std::error::Error>> {
    let lines = positive(lines, |(x, y)| x.min(y));
    let axes = Axes {
        x: with_room(widened(&lines, |p| p.0, [0.8, 1.25]), lines.len()).log_scale(),
        x_name,
        x_label,
        y: widened(&lines, |p| p.1, [0.7, 1.4]),
        y_name: error,
        y_label: &|y| format!("{}", tidy(y)),
    };
    draw(title, axes, &lines, Mark::Points)
}

/// Something by the size of inputs, both logarithmically. What is not positive is left out, as above.
pub(crate) fn by_size(
    title: &str,
    figure: &str,
    lines: &[Line],
) -> Result<String, Box<dyn std::error::Error>> {
    let lines = positive(lines, |(x, y)| x.min(y));
    let axes = Axes {
        x: with_room(widened(&lines, |p| p.0, [0.8, 1.25]), lines.len()).log_scale(),
        x_name: "faces, points or splats",
        x_label: &|x| format!("{x:.0e}"),
        y: widened(&lines, |p| p.1, [0.7, 1.4]),
        y_name: figure,
        y_label: &|y| format!("{}", tidy(y)),
    };
    draw(title, axes, &lines, Mark::Points)
}

/// Loss by epoch, the loss logarithmically. `loss` says which. What is not positive is left out, as above.
pub(crate) fn loss_by_epoch(
    title: &str,
    loss: &str,
    lines: &[Line],
) -> Result<String, Box<dyn std::error::Error>> {
    let lines = positive(lines, |(_, y)| y);
    let axes = Axes {
        x: 0.0..widened(&lines, |p| p.0, [1.0; 2]).end,
        x_name: "epoch",
        x_label: &|x| format!("{x:.0}"),
        y: widened(&lines, |p| p.1, [0.7, 1.4]),
        y_name: loss,
        y_label: &|y| format!("{y:.0e}"),
    };
    draw(title, axes, &lines, Mark::Line)
}

/// What is beside the lines of a plot; y is logarithmic.
struct Axes<'a, X> {
    x: X,
    x_name: &'a str,
    x_label: &'a dyn Fn(&f64) -> String,
    y: Range<f64>,
    y_name: &'a str,
    y_label: &'a dyn Fn(&f64) -> String,
}

/// What shows in the legend, and where the points of a line are.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Mark {
    Points,
    Line,
}

/// Lines with those points of which `least` is positive and finite; lines without any are left out.
fn positive(lines: &[Line], least: fn((f64, f64)) -> f64) -> Vec<Line> {
    let shown = |p: &(f64, f64)| p.0.is_finite() && p.1.is_finite() && least(*p) > 0.0;
    let kept = |points: &[(f64, f64)]| points.iter().copied().filter(shown).collect::<Vec<_>>();
    lines
        .iter()
        .map(|(name, points)| (name.clone(), kept(points)))
        .filter(|(_, points)| !points.is_empty())
        .collect()
}

/// From the least coordinate to the greatest and somewhat farther; from 1 to 10 where there is none.
fn widened(lines: &[Line], coordinate: fn(&(f64, f64)) -> f64, [below, above]: [f64; 2]) -> Range<f64> {
    let all = || lines.iter().flat_map(|(_, points)| points).map(coordinate);
    match (all().reduce(f64::min), all().reduce(f64::max)) {
        (Some(least), Some(most)) => below * least..above * most,
        _ => 1.0..10.0,
    }
}

/// A range of logarithms with room for a long legend on its right.
fn with_room(range: Range<f64>, lines: usize) -> Range<f64> {
    let room = if lines > 5 { (range.end / range.start).powf(0.5) } else { 1.0 };
    range.start..room * range.end
}

fn draw<X>(
    title: &str,
    axes: Axes<'_, X>,
    lines: &[Line],
    mark: Mark,
) -> Result<String, Box<dyn std::error::Error>>
where
    X: AsRangedCoord<Value = f64>,
    X::CoordDescType: ValueFormatter<f64>,
{
    let mut svg = String::new();
    let area = SVGBackend::with_string(&mut svg, (720, 420)).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .caption(title, ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(36)
        .y_label_area_size(64)
        .build_cartesian_2d(axes.x, axes.y.log_scale())?;
    chart
        .configure_mesh()
        .x_desc(axes.x_name)
        .y_desc(axes.y_name)
        .x_label_formatter(axes.x_label)
        .y_label_formatter(axes.y_label)
        .x_labels(8)
        .max_light_lines(0)
        .draw()?;
    for (k, (name, points)) in lines.iter().enumerate() {
        let colour = Palette99::pick(k).to_rgba();
        let line = chart.draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(2)))?;
        match mark {
            Mark::Line => line
                .label(name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2))),
            Mark::Points => chart
                .draw_series(points.iter().map(|&p| Circle::new(p, 4, colour.filled())))?
                .label(name)
                .legend(move |(x, y)| Circle::new((x + 9, y), 4, colour.filled())),
        };
    }
    if !lines.is_empty() {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.8))
            .border_style(BLACK)
            .draw()?;
    }
    area.present()?;
    drop(chart);
    drop(area);
    Ok(svg)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_sound(svg: &str) -> bool {
        svg.ends_with("</svg>\n") && !svg.contains("NaN") && !svg.contains("inf")
    }

    #[test]
    fn what_has_no_place_on_a_logarithmic_axis_is_left_out() {
        let exact = ("exact".to_owned(), vec![(2000.0, 0.0)]);
        let empty = ("empty".to_owned(), Vec::new());
        let usual =
            ("usual".to_owned(), vec![(1000.0, 0.0), (2000.0, 0.5), (4000.0, 0.1), (8000.0, f64::NAN)]);
        let lines = [exact, empty, usual];
        for svg in [error_by_bytes("A", "rms", &lines).unwrap(), loss_by_epoch("A", "loss", &lines).unwrap()]
        {
            assert!(is_sound(&svg) && svg.contains("usual"), "{svg}");
            assert!(!svg.contains("exact") && !svg.contains("empty"), "{svg}");
        }
        // Both points of the line, and the one of the legend.
        assert_eq!(error_by_bytes("A", "rms", &lines).unwrap().matches("<circle").count(), 3);
        for svg in
            [error_by_bytes("A", "rms", &lines[..2]).unwrap(), loss_by_epoch("A", "loss", &[]).unwrap()]
        {
            assert!(is_sound(&svg), "{svg}");
        }
    }
}
