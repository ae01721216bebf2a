//! Contract: the report of a benchmark is a well-formed, self-contained, deterministic and escaped page, with
//! full data and with none, and never compares different protocols.

#[path = "../../examples/sample_report/training.rs"]
mod training;

use crate::common::check_page;
use augsim_report::benchmark::Protocol;
use augsim_report::{BenchmarkReport, benchmark_report};

#[test]
fn full_reports_pass_the_checks() {
    assert!(check_page(&benchmark_report(&training::sample())) > 30);
}

#[test]
fn empty_reports_pass_the_checks_and_say_what_is_missing() {
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

/// Replaces every string of a JSON value by `text`, except names of enum variants.
fn replace_texts(value: &mut serde_json::Value, text: &str) {
    match value {
        serde_json::Value::String(s) => text.clone_into(s),
        serde_json::Value::Array(items) => items.iter_mut().for_each(|v| replace_texts(v, text)),
        serde_json::Value::Object(fields) => {
            let words = ["protocol", "verdict", "best"];
            let texts = fields.iter_mut().filter(|(k, _)| !words.contains(&k.as_str()));
            texts.for_each(|(_, v)| replace_texts(v, text));
        }
        _ => {}
    }
}

#[test]
fn every_text_is_escaped() {
    const MARKUP: &str = "<script>alert(1)</script>&\"'";
    let mut json = serde_json::to_value(training::sample()).expect("serialises");
    replace_texts(&mut json, MARKUP);
    let report: BenchmarkReport = serde_json::from_value(json).expect("still a report");
    let html = benchmark_report(&report);
    check_page(&html);
    assert!(html.contains("&lt;script&gt;"));
}

#[test]
fn best_value_is_marked_within_each_protocol() {
    let report = training::sample();
    let html = benchmark_report(&report);
    // One table per protocol, because their errors are not comparable.
    let bodies = html.split("<tbody>").skip(1).take(3).map(|b| b.split_once("</tbody>").expect("a table").0);
    let bodies: Vec<&str> = bodies.collect();
    let names = [Protocol::Forecast, Protocol::Reconstruction, Protocol::Floor].map(Protocol::name);
    for (body, name) in bodies.iter().zip(names) {
        let others = names.iter().filter(|n| **n != name);
        assert!(others.into_iter().all(|n| !body.contains(&format!(">{n}<"))), "{name}: {body}");
    }
    let rows: Vec<&str> = bodies.iter().flat_map(|body| body.split("<tr").skip(1)).collect();
    assert_eq!(rows.len(), report.results[0].rows.len());
    for row in &rows {
        let names = [Protocol::Forecast, Protocol::Reconstruction, Protocol::Floor].map(Protocol::name);
        assert_eq!(names.iter().filter(|n| row.contains(&format!(">{n}<"))).count(), 1, "{row}");
    }
    // The reconstruction error is the smallest of all, but the best forecast is marked too.
    let best = |protocol: &str, value: &str| {
        let mark = format!("<span class=\"best\">{value}</span>");
        rows.iter().any(|r| r.contains(&format!(">{protocol}<")) && r.contains(&mark))
    };
    assert!(best("forecast", "0.110"));
    assert!(best("reconstruction", "0.013"));
    assert!(!best("floor", "0.107"), "a single row is not compared");
}
