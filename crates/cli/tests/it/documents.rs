//! Contract: generated documents are up to date: `docs/commands.md` from the parser, `docs/effects.md`
//! from the registries of effects and the generic library, `docs/report.svg` from a report (texts and
//! figures; coordinates may round differently on another instruction set). To update them:
//!
//! ```sh
//! AUGSIM_RENEW=1 cargo test --release -p augsim --test it documents
//! ```

use crate::documents_on_disk::{root, words};
use augsim_physics::ball::effects::SCATTER_SPEC;
use augsim_physics::library::EffectSpec;
use augsim_report::figure::{Axis, BarShape, Bars, Figure};
use std::fmt::Write;
use std::process::Command;

const RENEW: &str = "AUGSIM_RENEW=1 cargo test --release -p augsim --test it documents";

/// Updates a generated document if requested; otherwise checks that the part that `of` extracts is up to date.
fn current(name: &str, text: &str, of: fn(&str) -> String) {
    let path = root().join("docs").join(name);
    if std::env::var_os("AUGSIM_RENEW").is_some() {
        return std::fs::write(&path, text).expect("a document");
    }
    let there = std::fs::read_to_string(&path).unwrap_or_default();
    let (there, now) = (of(&there), of(text));
    let differs = there.lines().zip(now.lines()).find(|(a, b)| a != b);
    assert!(there == now, "docs/{name} is stale (first difference: {differs:?}); renew it by\n{RENEW}");
}

fn printed(arguments: &[&str]) -> String {
    let run = Command::new(env!("CARGO_BIN_EXE_augsim")).args(arguments).current_dir(root()).output();
    let run = run.expect("the binary runs");
    assert!(run.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&run.stderr));
    String::from_utf8(run.stdout).expect("text")
}

#[test]
fn commands_page_matches_the_parser() {
    current("commands.md", &printed(&["reference"]), str::to_owned);
}

const EFFECTS: &str = "\
# Effects

Generated from the registries of `crates/physics` and from `crates/equations/library.toml`. `augsim effects --for
MODEL.toml` lists those that are tried on one model, with usual sizes; [a recipe](recipes/add-an-effect.md) adds one.
";

/// Escapes a cell of a Markdown table: bars would end it, and asterisks and underscores would be emphasis.
fn cell(text: &str) -> String {
    words(text).replace('|', "\\|").replace('*', "\\*").replace('_', "\\_").replace('<', "&lt;")
}

fn row(page: &mut String, cells: [String; 5]) {
    // Writing to a string cannot fail.
    let _ = writeln!(page, "| {} |", cells.join(" | "));
}

/// Text of the section on effects of recordings (not of systems), which are in no registry.
const OF_RECORDINGS: &str = "
## Of recordings, whatever the system

`frame-clock`: time stamps jitter about the frames of one clock, or are rounded (30 frames a second, stamps with two decimals).
`discover` puts the samples on the frames where the motion between neighbouring samples is then smoother by five standard errors, and
says so beside the noise (`noise.frame_s`, the time from one frame to the next; `noise.jitter_s`). `data convert --frame-clock` does the
same for measured sets.
";

const COLUMNS: [&str; 5] = ["kind", "formula", "parameters", "equivalent on some data", "source"];

fn heading(page: &mut String, title: &str, columns: [&str; 5]) {
    let _ = writeln!(page, "\n## {title}\n\n| {} |\n|---|---|---|---|---|", columns.join(" | "));
}

fn effect(page: &mut String, spec: &EffectSpec) {
    let parameters = spec.parameters.iter().map(|p| {
        let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
        format!("`{}` about {}{unit}", p.name, p.typical)
    });
    let parameters = parameters.collect::<Vec<_>>().join(", ");
    let kind = format!("`{}` ({})", spec.kind, spec.location.name());
    row(
        page,
        [kind, cell(spec.formula), parameters, cell(&spec.equivalent_causes.join("; ")), cell(spec.source)],
    );
}

/// Appends an effect of the generic library to the page, as a table row.
///
/// Inner parameters are multiples of a size in the data, the others are coefficients.
fn candidate(page: &mut String, entry: &toml::Table) {
    let text = |key: &str| match entry.get(key) {
        Some(toml::Value::String(text)) => text.clone(),
        Some(toml::Value::Array(list)) => {
            list.iter().filter_map(toml::Value::as_str).collect::<Vec<_>>().join(", ")
        }
        _ => String::new(),
    };
    let parts = ["states", "add", "factor", "replace", "add_other"].map(|key| match entry.get(key) {
        Some(toml::Value::String(_)) => format!("{key} `{}`", text(key).replace('|', "\\|")),
        Some(toml::Value::Table(list)) => {
            let rate = |state: &toml::Value| Some(state.get("rate")?.as_str()?.replace('|', "\\|"));
            let states = list.iter().filter_map(|(state, value)| Some((state, rate(value)?)));
            states.map(|(state, rate)| format!("`d({state})/dt = {rate}`")).collect::<Vec<_>>().join(", ")
        }
        _ => String::new(),
    });
    let formula = parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("; ");
    let parameters = entry.iter().filter_map(|(name, value)| {
        let table = value.as_table().filter(|_| !["states", "separated_by"].contains(&name.as_str()))?;
        let of = table.get("of").and_then(toml::Value::as_str);
        Some(of.map_or_else(|| format!("`{name}`"), |of| format!("`{name}` (of {of})")))
    });
    let parameters = parameters.collect::<Vec<_>>().join(", ");
    let kind = format!("`{}` ({})", text("kind"), text("on"));
    row(page, [kind, formula, parameters, cell(&text("stands_for")), cell(&text("source"))]);
}

#[test]
fn effects_page_matches_the_registries() {
    let mut page = EFFECTS.to_owned();
    heading(&mut page, "Of the ball", COLUMNS);
    let ball = augsim_physics::ball::effects::all::<f64>();
    ball.iter().map(|e| e.spec()).chain([&SCATTER_SPEC]).for_each(|spec| effect(&mut page, spec));
    heading(&mut page, "Of pushing", COLUMNS);
    let push = augsim_physics::push::effects::all::<f64>();
    let scatter = &augsim_physics::push::effects::SCATTER_SPEC;
    push.iter().map(|e| e.spec()).chain([scatter]).for_each(|spec| effect(&mut page, spec));
    heading(&mut page, "Of systems of equations (by the place where a row is tried)", COLUMNS);
    let library = std::fs::read_to_string(root().join("crates/equations/library.toml")).expect("the library");
    let library: toml::Table = toml::from_str(&library).expect("TOML");
    let rows = library["candidate"].as_array().expect("rows");
    rows.iter().for_each(|entry| candidate(&mut page, entry.as_table().expect("a table")));
    page.push_str(OF_RECORDINGS);
    current("effects.md", &page, str::to_owned);
}

/// Returns the texts of an SVG figure in order.
fn words_of(svg: &str) -> String {
    let texts = svg.split("<text").skip(1).filter_map(|t| t.split_once('>')?.1.split('<').next());
    texts.collect::<Vec<_>>().join("\n")
}

/// Returns the SVG figure at the start of `text`, up to its closing tag, with nested figures.
fn whole(text: &str) -> &str {
    let mut depth = 1;
    for (at, _) in text.match_indices("svg") {
        if text[..at].ends_with('<') {
            depth += 1;
        } else if text[..at].ends_with("</") {
            depth -= 1;
            if depth == 0 {
                return text[..at].trim_end_matches("</");
            }
        }
    }
    text
}

/// Returns the text of the SVG figure whose title begins with `title`, in its larger width.
///
/// The text begins after the opening `<svg`.
fn figure<'p>(page: &'p str, title: &str) -> &'p str {
    let begun = page.match_indices("<svg").map(|(at, tag)| &page[at + tag.len()..]);
    let titled = |svg: &&str| {
        let head = svg.split_once("<title").filter(|(before, _)| !before.contains("<svg"));
        head.and_then(|(_, rest)| rest.split_once('>')).is_some_and(|(_, text)| text.starts_with(title))
    };
    let wide = |svg: &&str| {
        let tag = svg.split('>').next().unwrap_or_default();
        tag.contains("width=\"500\"") || tag.contains("width=\"960\"")
    };
    whole(begun.filter(titled).find(wide).expect("the figure is in the report"))
}

#[test]
fn readme_figure_matches_a_report() {
    let folder = tempfile::tempdir().expect("a temporary directory");
    let out = folder.path().join("found").display().to_string();
    printed(&["discover", "fixtures/sealed/model.toml", "fixtures/sealed/bounces.csv", "--out", &out]);
    let page = std::fs::read_to_string(format!("{out}/report.html")).expect("a report");
    let empty = Figure::Bars(Bars {
        title: String::new(),
        value: Axis::linear("error", "m"),
        groups: Vec::new(),
        references: Vec::new(),
        shape: BarShape::Bar,
    })
    .svg_document(500.0);
    let style = empty.split_once("<style>").and_then(|(_, s)| s.split_once("</style>")).expect("a style").0;
    let [errors, speed, time] = ["Error on", "Against speed", "Against time"].map(|t| figure(&page, t));
    let picture = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"fig\" viewBox=\"0 0 1030 470\" width=\"1030\" height=\"470\">\n\
         <style>{style}</style>\n<rect class=\"bg\" width=\"1030\" height=\"470\"/>\n<svg x=\"30\"{errors}</svg>\n<svg x=\"10\" y=\"165\"{speed}</svg>\n<svg x=\"525\" y=\"165\"{time}</svg>\n</svg>\n"
    );
    current("report.svg", &picture, words_of);
}
