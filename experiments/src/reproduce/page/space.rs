//! The plots of file size, client seconds and error in space (supplement, §2.4): data for plotly, and sentences.

use serde_json::{Value, json};

use super::html::{escaped, paragraph};
use super::plotly::Plotly;
use crate::reproduce::pareto::{Costs, Point, frontier, sentence};
use crate::reproduce::row::{Run, Task};

/// Where the supplement draws meshes that are extracted from fields: a file that none of the methods needs.
const PLANE: f64 = 100_000.0;

/// Both plots with their data and script. Without plotly there are sentences alone.
pub(super) fn html(runs: &[Run], plotly: Option<&Plotly>) -> String {
    let runs: Vec<&Run> = runs.iter().filter(|run| run.left_out.is_empty()).collect();
    let mut shapes: Vec<String> = runs.iter().map(|run| run.subject()).collect();
    shapes.sort_unstable();
    shapes.dedup();
    let mut html = String::new();
    let mut data = Vec::new();
    for task in Task::ALL {
        html += &format!("<h3>Error of {}</h3>\n", task.name());
        if plotly.is_some() {
            html += &controls(task, &shapes);
        }
        for shape in &shapes {
            let of_shape: Vec<&Run> = runs.iter().copied().filter(|run| run.subject() == *shape).collect();
            for (name, plane) in [("in the plane of 100 kB", Some(PLANE)), ("at true size", None)] {
                let points = points(&of_shape, task, plane);
                if points.iter().any(Point::is_ours) && points.iter().any(|p| !p.is_ours()) {
                    let text = sentence(&points, Costs::Both);
                    html += &paragraph(&format!("{shape}, extracted meshes {name}: {text}"));
                }
            }
        }
        let all: Vec<Value> = shapes.iter().flat_map(|shape| of_shape(&runs, shape, task)).collect();
        data.push(json!({ "name": task.name(), "runs": all }));
    }
    if let Some(Plotly { script, license }) = plotly {
        // A comment must not end within the notice.
        let license = license.replace("*/", "* /");
        let data = Value::from(data).to_string().replace("</", "<\\/");
        html += &format!("<script>\n/* plotly.js:\n{license}*/\n{script}\n</script>\n");
        html += &format!("<script>\nconst RUNS = {data};\n{}</script>\n", include_str!("space.js"));
    }
    html
}

fn points(runs: &[&Run], task: Task, plane: Option<f64>) -> Vec<Point> {
    runs.iter().filter_map(|run| Costs::Both.point(run, task, plane)).collect()
}

/// The runs of a shape as data, with whether they are on its frontier.
fn of_shape(runs: &[&Run], shape: &str, task: Task) -> Vec<Value> {
    let runs: Vec<&Run> = runs.iter().copied().filter(|run| run.subject() == shape).collect();
    let [flat, sized] = [Some(PLANE), None].map(|plane| points(&runs, task, plane));
    let is_best =
        |points: &[Point], point: &Point| frontier(&points.iter().collect::<Vec<_>>()).contains(&point);
    let value = |run: &&Run| {
        let [in_plane, at_size] = [Some(PLANE), None].map(|plane| Costs::Both.point(run, task, plane));
        // Fields that are made by code have no file: they are in the plane only.
        let in_plane = in_plane?;
        let bytes = at_size.as_ref().map_or(PLANE, |point| point.costs[0]);
        Some(json!({
            "shape": run.subject(),
            "method": run.method,
            "setting": run.setting,
            "bytes": bytes,
            "plane": in_plane.costs[0],
            "seconds": in_plane.costs[1],
            "error": in_plane.error,
            "best": at_size.is_some_and(|point| is_best(&sized, &point)),
            "best_in_plane": is_best(&flat, &in_plane),
        }))
    };
    runs.iter().filter_map(value).collect()
}

/// The place of a plot, with the choice of a shape and of the plane.
fn controls(task: Task, shapes: &[String]) -> String {
    let name = task.name();
    let option = |shape: &String| format!("<option value=\"{0}\">{0}</option>", escaped(shape));
    let options: String = shapes.iter().map(option).collect();
    format!(
        "<div class=\"controls\"><label>shape <select id=\"shape-{name}\"><option value=\"\">all</option>{options}</select></label>\n\
         <label><input type=\"checkbox\" id=\"plane-{name}\" checked> extracted meshes in the plane of 100 kB, as in the supplement; \
         otherwise at the size of the field's file</label></div>\n\
         <div class=\"space\" id=\"space-{name}\"></div>\n"
    )
}
