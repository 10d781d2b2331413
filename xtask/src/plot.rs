//! Plots as SVG.

use plotters::prelude::*;

/// A line of a plot: its name, and points of bytes and error.
pub(crate) type Line = (String, Vec<(f64, f64)>);

/// Error against bytes, both logarithmically. `error` says what of, in percent.
pub(crate) fn error_by_bytes(
    title: &str,
    error: &str,
    lines: &[Line],
) -> Result<String, Box<dyn std::error::Error>> {
    let points = || lines.iter().flat_map(|(_, points)| points);
    let (x0, x1) = points().fold((f64::MAX, 0.0_f64), |(l, m), p| (l.min(p.0), m.max(p.0)));
    let (y0, y1) = points().fold((f64::MAX, 0.0_f64), |(l, m), p| (l.min(p.1), m.max(p.1)));
    let mut svg = String::new();
    let area = SVGBackend::with_string(&mut svg, (720, 420)).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .caption(title, ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(36)
        .y_label_area_size(64)
        .build_cartesian_2d((0.8 * x0..1.25 * x1).log_scale(), (0.7 * y0..1.4 * y1).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("bytes")
        .y_desc(error)
        .x_label_formatter(&|x| format!("{:.0} kB", x / 1000.0))
        // Ticks are sums of floats: 0.6000000000000001.
        .y_label_formatter(&|y| format!("{}", (y * 1e6).round() / 1e6))
        .max_light_lines(0)
        .draw()?;
    for (k, (name, points)) in lines.iter().enumerate() {
        let colour = Palette99::pick(k).to_rgba();
        chart.draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(2)))?;
        chart
            .draw_series(points.iter().map(|&p| Circle::new(p, 4, colour.filled())))?
            .label(name)
            .legend(move |(x, y)| Circle::new((x + 9, y), 4, colour.filled()));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK)
        .draw()?;
    area.present()?;
    drop(chart);
    drop(area);
    Ok(svg)
}
