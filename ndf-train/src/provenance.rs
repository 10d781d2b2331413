//! What a model file says of how its field was made.

use serde::Serialize;

use crate::fit::FitReport;
use crate::settings::Settings;

#[derive(Serialize)]
struct Provenance<'a> {
    program: &'a str,
    input: Option<&'a str>,
    settings: Settings,
    metrics: Metrics,
}

/// The figures of a report that are the same in every run.
#[derive(Serialize)]
struct Metrics {
    epochs: usize,
    projection_rms: f64,
    projection_max: f64,
    cycle_loss: Option<f64>,
    flipped_fraction: f64,
}

/// The [`provenance`](ndf_model::Model::provenance) of a field: a JSON object of the program's name and version, the name of
/// the input, all [`Settings`] but the time limit, and what came out. A function of these alone: it tells no times.
pub fn provenance(program: &str, input: Option<&str>, settings: &Settings, report: &FitReport) -> String {
    let FitReport { epochs, projection_rms, projection_max, cycle_loss, flipped_fraction, .. } = *report;
    let metrics = Metrics { epochs, projection_rms, projection_max, cycle_loss, flipped_fraction };
    let settings = Settings { time_limit: None, ..settings.clone() };
    let provenance = Provenance { program, input, settings, metrics };
    serde_json::to_string(&provenance).expect("settings are numbers and words, with strings for keys")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn all_settings_are_told_and_no_times() {
        let report = FitReport {
            epochs: 7,
            seconds: 1.5,
            seconds_projecting: 0.5,
            projection_rms: 1e-3,
            projection_max: 2e-3,
            cycle_loss: None,
            flipped_fraction: 0.0,
            missed_fraction: 0.0,
            retreats: 0,
            interrupted: false,
        };
        let settings = Settings { time_limit: Some(Duration::from_secs(3)), ..Settings::paper() };
        let text = provenance("ndf 1", Some("a.ply"), &settings, &report);
        let value: serde_json::Value = serde_json::from_str(&text).unwrap();
        let told: Settings = serde_json::from_value(value["settings"].clone()).unwrap();
        assert_eq!(told, Settings { time_limit: None, ..settings });
        assert_eq!(value["metrics"]["epochs"], 7);
        assert!(!text.contains("seconds") && !text.contains("time"), "{text}");
        // The shortest decimals that stand for the numbers.
        assert!(text.contains("\"rate\":{\"first\":0.001,\"last\":0.001}"), "{text}");
    }
}
