//! The two reports as whole pages: well-formed, self-contained, deterministic, escaped, complete
//! with full data and with none, and honest about protocols.

#[path = "../../examples/sample_report/discovery.rs"]
mod discovery;
#[path = "../../examples/sample_report/training.rs"]
mod training;

use crate::common::check_page;
use augsim_report::benchmark::Protocol;
use augsim_report::{BenchmarkReport, DiscoveryReport, benchmark_report, discovery_report};

#[test]
fn full_reports_are_sound() {
    assert!(check_page(&benchmark_report(&training::sample())) > 30);
    assert!(check_page(&discovery_report(&discovery::sample())) > 15);
}

#[test]
fn empty_reports_are_sound_and_say_what_is_missing() {
    let training = benchmark_report(&BenchmarkReport::default());
    check_page(&training);
    assert!(training.contains("No model was evaluated."));
    let discovery = discovery_report(&DiscoveryReport::default());
    check_page(&discovery);
    assert!(discovery.contains("nothing to add"));
    assert!(discovery.contains("No effect was added"));
    assert!(discovery.contains("No trajectories were evaluated."));
}

#[test]
fn leads_stand_apart_from_what_is_established() {
    let mut report = discovery::sample();
    let page = discovery_report(&report);
    let place = |text: &str| page.find(text).unwrap_or_else(|| panic!("`{text}` is not on the page"));
    let (effects, leads) = (place("Established effects"), place("Findings that are not established"));
    assert!(effects < leads);
    let mut places = vec![effects];
    places.extend(
        ["1 of 19 records like these, made without an effect, names one.", "do not rest on them"].map(place),
    );
    places.extend([leads, place("not significant among so many candidates"), place("more drops like these")]);
    assert!(places.is_sorted(), "{places:?}");
    // What is not there is not spoken of.
    (report.leads, report.null_records) = (Vec::new(), None);
    let page = discovery_report(&report);
    assert!(!page.contains("not established") && !page.contains("records like these"));
}

#[test]
fn examples_say_whether_fits_have_seen_them() {
    let mut report = discovery::sample();
    let unseen = discovery_report(&report);
    assert!(unseen.contains("Trajectories that no fit has seen.") && !unseen.contains("were fitted to"));
    report.examples_fitted = true;
    let fitted = discovery_report(&report);
    assert!(
        fitted.contains("Trajectories that the models were fitted to."),
        "as there are too few to keep any out"
    );
}

#[test]
fn reports_are_deterministic_and_survive_json() {
    let (t, d) = (training::sample(), discovery::sample());
    let json = |text: Result<String, serde_json::Error>| text.expect("reports serialise");
    let t_back: BenchmarkReport =
        serde_json::from_str(&json(serde_json::to_string(&t))).expect("and come back");
    let d_back: DiscoveryReport =
        serde_json::from_str(&json(serde_json::to_string(&d))).expect("and come back");
    assert!(benchmark_report(&t) == benchmark_report(&t_back));
    assert!(discovery_report(&d) == discovery_report(&d_back));
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
    let mut json = serde_json::to_value(discovery::sample()).expect("serialises");
    poison(&mut json, EVIL);
    let report: DiscoveryReport = serde_json::from_value(json).expect("still a report");
    let html = discovery_report(&report);
    check_page(&html);
    assert!(html.contains("&lt;script&gt;"));

    let mut json = serde_json::to_value(training::sample()).expect("serialises");
    poison(&mut json, EVIL);
    let report: BenchmarkReport = serde_json::from_value(json).expect("still a report");
    check_page(&benchmark_report(&report));
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

#[test]
fn the_discovery_report_tells_before_from_after_and_shows_the_model() {
    let html = discovery_report(&discovery::sample());
    for text in [
        "38.4",
        "[33.9, 43.1]",
        "2.14",
        "noise floor",
        "99.8",
        "quadratic-drag",
        "Next experiment",
        "0.88",
        "wrong shape against speed",
    ] {
        assert!(html.contains(text), "{text}");
    }
    assert!(html.contains("[[effect]]\nkind = &quot;quadratic-drag&quot;\n"), "shown line by line");
}
