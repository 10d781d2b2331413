//! What a model file says of how its field was made.

use serde::Serialize;

use crate::fit::FitReport;
use crate::levels::LevelOptions;
use crate::settings::Settings;

#[derive(Serialize)]
struct Provenance<'a> {
    program: &'a str,
    input: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    settings: Option<Settings>,
    #[serde(skip_serializing_if = "Option::is_none")]
    levels: Option<LevelOptions>,
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
    let settings = Some(Settings { time_limit: None, ..settings.clone() });
    text(&Provenance { program, input, settings, levels: None, metrics })
}

/// The same of a field of levels: what it was asked for, how far it is off, and the iterations as epochs.
pub fn level_provenance(
    program: &str,
    input: Option<&str>,
    settings: &LevelOptions,
    report: &FitReport,
) -> String {
    // Eight digits are more than the measurement has, and a file of levels is small.
    let short = |x: f64| format!("{x:.7e}").parse().unwrap_or(x);
    let metrics = Metrics {
        epochs: report.epochs,
        projection_rms: short(report.projection_rms),
        projection_max: short(report.projection_max),
        cycle_loss: None,
        flipped_fraction: short(report.flipped_fraction),
    };
    text(&Provenance {
        program,
        input,
        settings: None,
        levels: Some(LevelOptions { time_limit: None, ..*settings }),
        metrics,
    })
}

fn text(provenance: &Provenance<'_>) -> String {
    serde_json::to_string(provenance).expect("settings are numbers and words, with strings for keys")
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
            projection_mean: 5e-4,
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
