//! Contract (issue 16, item 6): a report of a discovery says nothing false: declared noise is named as declared, parameters have
//! their units, an error with effects added stands only where effects were added, candidates stand in the order that their
//! caption says, and every group is listed once, by its name.

use crate::command::succeed;
use std::path::{Path, PathBuf};

fn sealed(name: &str) -> String {
    let file: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/sealed").join(name);
    std::fs::read_to_string(file).expect("a fixture")
}

/// The page of a discovery in `out`, with its result.
fn page(dir: &Path, out: &str) -> (String, serde_json::Value) {
    let read = |name: &str| std::fs::read_to_string(dir.join(out).join(name)).expect("written");
    (read("report.html"), serde_json::from_str(&read("result.json")).expect("JSON"))
}

/// The table with a caption, by rows of cells without their tags.
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
fn declared_noise_units_and_order_are_as_they_are() {
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
    // The chosen set, then what was fitted, then what was only tested, each by gain less penalty.
    let rows = table(&html, "All candidates: those that were fitted, then those that were only tested");
    assert_eq!(rows.len(), result["candidates"].as_array().map_or(0, Vec::len));
    assert!(rows[0].last().is_some_and(|why| why.starts_with("chosen")), "{:?}", rows[0]);
    let is_tested =
        |row: &&[String]| row.last().is_some_and(|w| w.starts_with("its test") || w.starts_with("cannot be"));
    let first_tested = rows.iter().position(|row| is_tested(&&row[..])).expect("some were only tested");
    for part in [&rows[1..first_tested], &rows[first_tested..]] {
        assert_eq!(part.iter().filter(|row| is_tested(&&row[..])).count() % part.len(), 0, "{part:?}");
        let scores: Vec<f64> =
            part.iter().map(|row| row[2].replace('−', "-").parse().expect("a number")).collect();
        assert!(scores.windows(2).all(|w| w[0] >= w[1]), "{scores:?}");
    }

    // Where the noise is not declared that is said; where nothing is added no effect is spoken of.
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
fn every_group_is_listed_once_by_its_name() {
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
