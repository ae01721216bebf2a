//! The report of an experiment as a whole page: well-formed, self-contained, deterministic, escaped, complete
//! with full data and with none, and honest about protocols.

#[path = "../../examples/sample_report/training.rs"]
mod training;

use crate::common::check_page;
use augsim_report::benchmark::Protocol;
use augsim_report::{BenchmarkReport, benchmark_report};

#[test]
fn full_reports_are_sound() {
    assert!(check_page(&benchmark_report(&training::sample())) > 30);
}

#[test]
fn empty_reports_are_sound_and_say_what_is_missing() {
    let training = benchmark_report(&BenchmarkReport::default());
    check_page(&training);
    assert!(training.contains("No model was evaluated."));
}

#[test]
fn reports_are_deterministic_and_survive_json() {
    let report = training::sample();
    let text = serde_json::to_string(&report).expect("reports serialise");
    let back: BenchmarkReport = serde_json::from_str(&text).expect("and come back");
    assert!(benchmark_report(&report) == benchmark_report(&back));
}

/// Replaces every text that is not an enumeration's word.
fn poison(value: &mut serde_json::Value, text: &str) {
    match value {
        serde_json::Value::String(s) => text.clone_into(s),
        serde_json::Value::Array(items) => items.iter_mut().for_each(|v| poison(v, text)),
        serde_json::Value::Object(fields) => {
            let words = ["protocol", "verdict", "best"];
            let texts = fields.iter_mut().filter(|(k, _)| !words.contains(&k.as_str()));
            texts.for_each(|(_, v)| poison(v, text));
        }
        _ => {}
    }
}

#[test]
fn every_text_is_escaped() {
    const EVIL: &str = "<script>alert(1)</script>&\"'";
    let mut json = serde_json::to_value(training::sample()).expect("serialises");
    poison(&mut json, EVIL);
    let report: BenchmarkReport = serde_json::from_value(json).expect("still a report");
    let html = benchmark_report(&report);
    check_page(&html);
    assert!(html.contains("&lt;script&gt;"));
}

#[test]
fn every_row_of_the_table_names_its_protocol_and_best_is_within_it() {
    let report = training::sample();
    let html = benchmark_report(&report);
    let body = html.split_once("<tbody>").and_then(|(_, b)| b.split_once("</tbody>")).expect("a table").0;
    let rows: Vec<&str> = body.split("<tr").skip(1).collect();
    assert_eq!(rows.len(), report.results[0].rows.len());
    for row in &rows {
        let names = [Protocol::Forecast, Protocol::Reconstruction, Protocol::Floor].map(Protocol::name);
        assert_eq!(names.iter().filter(|n| row.contains(&format!(">{n}<"))).count(), 1, "{row}");
    }
    // The reconstruction error is the smallest of all, and must not take the forecast's mark.
    let best = |protocol: &str, value: &str| {
        let mark = format!("<span class=\"best\">{value}</span>");
        rows.iter().any(|r| r.contains(&format!(">{protocol}<")) && r.contains(&mark))
    };
    assert!(best("forecast", "0.110"));
    assert!(best("reconstruction", "0.013"));
    assert!(!best("floor", "0.107"), "a single floor has no rival");
}
