//! Contract: the report of a discovery shows findings, unconfirmed effects and errors in order, says whether
//! its examples were held out, and escapes every text.

use augsim_data::random_stream;
use augsim_discovery::{Discovery, Lead, NullRecords, Options};
use augsim_session::discovery_page::page;
use augsim_session::{DataFrom, DiscoverRequest, ReportContext, Subject, discover};
use rand_distr::{Distribution, StandardNormal};
use std::fmt::Write;
use std::sync::OnceLock;

const MODEL: &str = "scenario = \"ball\"\n[parameters]\ngravity_m_s2 = { nominal = 9.81, frozen = true }\n";

fn subject() -> Subject {
    Subject::parse(MODEL, "model.toml").expect("a model")
}

/// Simulates thirty drops with a quadratic drag of 0.03 per metre, measured at 60 Hz with 2 mm of noise.
fn drops() -> DataFrom {
    let (g, k) = (9.81_f64, 0.03_f64);
    let mut csv = "trajectory,t_s,height_m\n".to_owned();
    for drop in 0..30 {
        let mut rng = random_stream(1, "drops", drop);
        for frame in 0..60 {
            let t = f64::from(frame) / 60.0;
            let noise: f64 = StandardNormal.sample(&mut rng);
            let height = 6.0 + 0.1 * drop as f64 - ((g * k).sqrt() * t).cosh().ln() / k + 0.002 * noise;
            // Writing to a string cannot fail.
            let _ = writeln!(csv, "{drop},{t},{height}");
        }
    }
    DataFrom::Table { name: "drops".into(), csv: csv.into_bytes().into() }
}

fn found() -> &'static Discovery {
    static FOUND: OnceLock<Discovery> = OnceLock::new();
    FOUND.get_or_init(|| {
        let wanted = DiscoverRequest {
            options: Options { null_runs: 0, ..Options::default() },
            ..DiscoverRequest::default()
        };
        discover(&subject(), &drops(), &wanted, &mut |_| {}).expect("an answer")
    })
}

fn html(found: &Discovery) -> String {
    page(&ReportContext::default(), &subject(), found).render()
}

#[test]
fn page_shows_errors_effects_and_the_model() {
    let found = found();
    let text = html(found);
    let share = format!("{:.1}", 100.0 * found.error.explained_share.expect("most of the error was removed"));
    for expected in ["explained", "quadratic-drag", "k_per_m", "noise floor", "Established effects", &share] {
        assert!(text.contains(expected), "{expected}");
    }
    assert!(text.contains("[[effect]]\nkind = &quot;quadratic-drag&quot;\n"), "shown line by line");
    assert!(!text.contains("not established") && !text.contains("False alarms"));
}

#[test]
fn effects_of_a_stopped_search_are_not_called_established() {
    let mut found = found().clone();
    found.effects.iter_mut().for_each(|effect| (effect.inclusion, effect.q_value) = (None, None));
    let text = html(&found);
    assert!(!text.contains("Established effects") && text.contains("not tested for significance"));
}

#[test]
fn unestablished_effects_follow_established_ones() {
    let mut found = found().clone();
    found.null_records = Some(NullRecords { named: 1, of: 19 });
    found.leads = vec![Lead {
        kind: "wind".into(),
        inclusion: 0.4,
        chance: None,
        why: "not significant among so many candidates".into(),
        next: "more drops like these".into(),
    }];
    let text = html(&found);
    let place = |part: &str| text.find(part).unwrap_or_else(|| panic!("`{part}` is not on the page"));
    let places = [
        "Established effects",
        "False alarms: an effect was found in 1 of 19 data sets like this one, generated without a missing effect.",
        "do not use them",
        "Findings that are not established",
        "not significant among so many candidates",
        "more drops like these",
    ]
    .map(place);
    assert!(places.is_sorted(), "{places:?}");
}

#[test]
fn examples_are_captioned_as_held_out_or_fitted() {
    let mut found = found().clone();
    assert!(!found.heldout.is_empty(), "every fifth drop is held out");
    let held_out = html(&found);
    assert!(
        held_out.contains("Held-out trajectories.") && !held_out.contains("that the models were fitted to")
    );
    found.heldout.clear();
    assert!(html(&found).contains("Trajectories that the models were fitted to."));
}

/// Replaces every string in a JSON value that is not the name of an enum variant.
fn replace_texts(value: &mut serde_json::Value, text: &str) {
    const WORDS: [&str; 3] = ["verdict", "by", "code"];
    match value {
        serde_json::Value::String(s) => text.clone_into(s),
        serde_json::Value::Array(items) => items.iter_mut().for_each(|v| replace_texts(v, text)),
        serde_json::Value::Object(fields) => {
            let texts = fields.iter_mut().filter(|(key, _)| !WORDS.contains(&key.as_str()));
            texts.for_each(|(_, v)| replace_texts(v, text));
        }
        _ => {}
    }
}

#[test]
fn every_text_is_escaped() {
    let mut json = serde_json::to_value(found()).expect("a result is JSON");
    replace_texts(&mut json, "<script>alert(1)</script>&\"'");
    let found: Discovery = serde_json::from_value(json).expect("still a result");
    let text = html(&found);
    assert!(text.contains("&lt;script&gt;") && !text.contains("<script"));
}
