//! Contract (issue 16, item 6): the report of a discovery is true: declared noise is called declared,
//! parameters have units, the error with added effects is shown only if effects were added, candidates
//! are in the order of their caption, and every group is listed once by name.

use crate::command::{fail, succeed};
use std::path::{Path, PathBuf};

fn sealed(name: &str) -> String {
    let file: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/sealed").join(name);
    std::fs::read_to_string(file).expect("a fixture")
}

/// Reads the report page and `result.json` of a discovery in the folder `out`.
fn page(dir: &Path, out: &str) -> (String, serde_json::Value) {
    let read = |name: &str| std::fs::read_to_string(dir.join(out).join(name)).expect("written");
    (read("report.html"), serde_json::from_str(&read("result.json")).expect("JSON"))
}

/// Returns the cells, row by row and without tags, of the table of a report page with the caption `caption`.
fn table(page: &str, caption: &str) -> Vec<Vec<String>> {
    let from = page.find(caption).unwrap_or_else(|| panic!("no table `{caption}`"));
    let body =
        page[from..].split("<tbody>").nth(1).and_then(|t| t.split("</tbody>").next()).expect("a table");
    let plain = |cell: &str| {
        let pieces = cell.split('<').map(|piece| piece.split_once('>').map_or(piece, |(_, text)| text));
        pieces.collect::<String>()
    };
    let rows = body.split("</tr>").filter(|row| !row.is_empty());
    rows.map(|row| row.split("</t").filter(|c| c.contains("<t")).map(plain).collect()).collect()
}

#[test]
fn reports_declared_noise_units_and_order() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let d = dir.path();
    std::fs::write(d.join("bounces.csv"), sealed("bounces.csv")).expect("written");
    let model = sealed("model.toml");
    std::fs::write(d.join("model.toml"), &model).expect("written");
    succeed(&["discover", "model.toml", "bounces.csv", "--out", "found", "-q"], d);
    let (html, result) = page(d, "found");
    assert!(html.contains("; declared: 0.00204 m.") && !html.contains("none was declared"));
    for (name, unit) in [("gravity_m_s2", "m/s^2"), ("radius_m", "m")] {
        let rows = table(&html, "Declared parameters");
        let row = rows.iter().find(|row| row[0] == name).unwrap_or_else(|| panic!("no {name} in {rows:?}"));
        assert_eq!(row.last().map(String::as_str), Some(unit), "{row:?}");
    }
    assert!(html.contains("error with the effects added") && !html.contains(">score"));
    // The chosen set, then the ten others that come nearest to it; all of them were fitted.
    let rows = table(&html, "Fitted sets of effects");
    let candidates = result["candidates"].as_array().expect("a list");
    assert!(rows.len() > 1 && rows.len() == candidates.len().min(10), "{rows:?}");
    assert!(candidates.iter().all(|c| c["fitted"] == true));
    assert!(rows[0].last().is_some_and(|why| why.starts_with("chosen")), "{:?}", rows[0]);
    let scores: Vec<f64> =
        rows[1..].iter().map(|row| row[2].replace('−', "-").parse().expect("a number")).collect();
    assert!(scores.windows(2).all(|w| w[0] >= w[1]), "{scores:?}");

    // A page says that the noise is not declared; without added effects it does not mention effects.
    let silent = model.replace("[sensor]\nposition_sd_m = 0.0020430227234388893\n", "");
    assert_ne!(silent, model);
    let drag =
        "\n[[effect]]\nkind = \"quadratic-drag\"\nk_per_m = { nominal = 0.03, min = 0.0, max = 1.0 }\n";
    std::fs::write(d.join("complete.toml"), silent + drag).expect("written");
    succeed(&["discover", "complete.toml", "bounces.csv", "--out", "complete", "-q"], d);
    let (html, result) = page(d, "complete");
    assert_eq!(result["verdict"], "nothing-to-add");
    assert!(html.contains("none was declared"));
    assert!(html.contains("error after calibration") && !html.contains("error with the effects added"));
}

#[test]
fn reports_resamples_and_null_rate_of_established_effects() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let d = dir.path();
    std::fs::write(d.join("bounces.csv"), sealed("bounces.csv")).expect("written");
    std::fs::write(d.join("model.toml"), sealed("model.toml")).expect("written");
    let printed =
        succeed(&["discover", "model.toml", "bounces.csv", "--out", "found", "--null-runs", "7"], d);
    let (html, result) = page(d, "found");
    let effect = &result["effects"][0];
    let (share, q) = (effect["inclusion"].as_f64(), effect["q_value"].as_f64());
    let (share, q) = (100.0 * share.expect("a share"), q.expect("a probability"));
    assert!(share >= 90.0 && q < 0.001, "an effect of 14 standard errors: {share} % {q}");
    let row = &table(&html, "Established effects")[0];
    assert_eq!(row[0], "quadratic-drag");
    assert_eq!(row[row.len() - 2..], [format!("{share:.0}"), "&lt; 0.001".to_owned()], "{row:?}");
    let line = format!("  quadratic-drag: established, in {share:.0} % of resamples, q-value < 0.001\n");
    assert!(printed.contains(&line), "{printed}");
    assert_eq!(result["null_records"]["of"], 7);
    let named = result["null_records"]["named"].as_u64().expect("a count");
    let verb = if named == 1 { "names" } else { "name" };
    let printed_rate =
        format!("null rate: {named} of 7 simulated recordings without a missing effect {verb} one");
    assert!(printed.contains(&printed_rate), "{printed}");
    assert!(
        html.contains(&format!("False alarms: an effect was found in {named} of 7 data sets like this one"))
    );
    // There are enough trajectories to hold some out, so errors and examples are those of held-out
    // trajectories.
    assert_eq!(
        result["heldout"].as_array().map(Vec::len).map(|n| n as u64),
        result["error"]["heldout_trajectories"].as_u64()
    );
    assert!(
        html.contains("used neither for fitting nor for choosing effects")
            && html.contains("Held-out trajectories")
    );

    // Without simulated recordings the null rate is not mentioned.
    let printed = succeed(&["discover", "model.toml", "bounces.csv", "--out", "none", "--null-runs", "0"], d);
    let (html, result) = page(d, "none");
    assert!(result["null_records"].is_null());
    assert!(!printed.contains("null rate") && !html.contains("False alarms"));
    let many = ["discover", "model.toml", "bounces.csv", "--out", "many", "--null-runs", "1001"];
    fail(2, &many, d, &["--null-runs 1001: give at most 1000"]);
}

#[test]
fn lists_every_group_once_by_name() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let d = dir.path();
    let text = sealed("bounces.csv");
    let mut lines = text.lines();
    let mut grouped = format!("{},group\n", lines.next().expect("a header"));
    for line in lines {
        let number: u32 = line.split(',').next().and_then(|n| n.parse().ok()).expect("a trajectory");
        grouped += &format!("{line},{}\n", if number.is_multiple_of(2) { "even" } else { "odd" });
    }
    std::fs::write(d.join("grouped.csv"), grouped).expect("written");
    let model = sealed("model.toml").replace("max = 1.0 }", "max = 1.0, per = \"group\" }");
    std::fs::write(d.join("model.toml"), model).expect("written");
    succeed(&["discover", "model.toml", "grouped.csv", "--out", "found", "-q"], d);
    let (html, _) = page(d, "found");
    let rows = table(&html, "Declared parameters");
    let names: Vec<&str> = rows.iter().map(|row| row[0].as_str()).collect();
    let listed = |name: &str| names.iter().filter(|n| n.contains(name)).count();
    assert_eq!(listed("restitution"), names.iter().filter(|n| n.starts_with("restitution")).count());
    let mut unique = names.clone();
    unique.sort_unstable();
    unique.dedup();
    assert_eq!(unique.len(), names.len(), "{names:?}");
    let correlations = html.find("Correlation").map_or("", |at| &html[at..]);
    for group in ["restitution[even]", "restitution[odd]"] {
        assert!(correlations.contains(group), "`{group}` is not among the correlations");
    }
}
