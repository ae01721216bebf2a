//! From a discovery to a page: the order of the sections, the verdict, the error before and after.

use super::tones::{AFTER, BEFORE};
use super::{DiscoveryReport, ErrorSummary, Rmse, Verdict, anatomy, examples, findings};
use crate::figure::{Axis, Bar, BarGroup, BarShape, Bars, Tone};
use crate::page::{Block, Cell, Column, FigureBlock, KeyFigure, Page, Row, Section, Table};
use crate::plot::text::significant;

pub(super) fn page(report: &DiscoveryReport) -> Page {
    let mut reproduce = Vec::new();
    if !report.reproduce.is_empty() {
        reproduce.push(Block::Code { caption: String::new(), text: report.reproduce.join("\n") });
    }
    let methods =
        if report.methods.is_empty() { Vec::new() } else { vec![Block::Methods(report.methods.clone())] };
    let runs = match (report.examples_note.is_empty(), report.examples_fitted) {
        (false, _) => "Runs of both models",
        (true, false) => "Trajectories that no fit has seen",
        (true, true) => "Trajectories and both models",
    };
    Page {
        overline: format!("augsim · discovery report · {}", report.scenario),
        title: report.title.clone(),
        verdict: report.verdict.words().to_owned(),
        summary: lead(&report.sentence),
        key_figures: key_figures(report),
        sections: vec![
            Section::new(runs, examples::examples(report)),
            Section::new(
                "Warnings about the data",
                report.warnings.iter().cloned().map(Block::Prose).collect(),
            ),
            Section::new("Error on data that no fit has seen", error(&report.error)),
            Section::new("What was found", findings::found(report)),
            Section::new("Leads", findings::leads(report)),
            Section::new("The laws as curves", anatomy::laws(&report.laws)),
            Section::new("What remains open", findings::open_questions(report)),
            Section::new("Residual, before and after", anatomy::residual(&report.anatomy)),
            Section::new("Candidates", findings::candidates(report)),
            Section::new("How well the parameters are told apart", findings::correlations(report)),
            Section::new("Noise", findings::noise(&report.noise)),
            Section::new("Augmented model", findings::model(report)),
            Section::new("Remarks", report.notes.iter().cloned().map(Block::Prose).collect()),
            Section::new("Methods and references", methods),
            Section::new("How to reproduce", reproduce),
        ],
        provenance: report.provenance.clone(),
    }
}

/// The sentence as a lead of few lines: intervals stand in the tables.
fn lead(sentence: &str) -> String {
    let mut out = String::new();
    let mut rest = sentence;
    while let Some((before, after)) = rest.split_once(" [") {
        match after.split_once(']') {
            // An interval is two numbers.
            Some((inside, behind)) if inside.split(", ").all(|n| n.parse::<f64>().is_ok()) => {
                out += before;
                rest = behind;
            }
            _ => {
                out += before;
                out += " [";
                rest = after;
            }
        }
    }
    out + rest
}

fn key_figures(report: &DiscoveryReport) -> Vec<KeyFigure> {
    let e = &report.error;
    let figure = |label: &str, value: Option<f64>, unit: &str, note: String| {
        Some(KeyFigure {
            value: significant(value?, 3),
            unit: unit.to_owned(),
            label: label.to_owned(),
            note,
        })
    };
    let rmse = |r: Option<Rmse>| r.map(|r| r.rmse);
    let floor = rmse(e.noise_floor)
        .map_or_else(String::new, |f| format!("noise floor {}\u{202f}{}", significant(f, 3), e.unit));
    let after_label =
        if report.effects.is_empty() { "error after calibration" } else { "error with the effects added" };
    let share_note = match report.verdict {
        Verdict::NothingToAdd => "by calibration",
        _ => "of what noise does not explain",
    };
    [
        figure("error as declared", rmse(e.declared), &e.unit, "root mean square".to_owned()),
        figure(after_label, rmse(e.augmented.or(e.calibrated)), &e.unit, floor),
        figure("removable error removed", e.explained_share.map(|s| s * 100.0), "%", share_note.to_owned()),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn error(e: &ErrorSummary) -> Vec<Block> {
    let stages = [
        ("declared", e.declared, BEFORE, "the model file as it is"),
        ("calibrated", e.calibrated, Tone::Series(2), "declared parameters fitted"),
        ("augmented", e.augmented, AFTER, "with the effects added"),
        ("noise floor", e.noise_floor, Tone::Muted, "what the sensor alone gives"),
    ];
    let shown: Vec<_> = stages.into_iter().filter(|s| s.1.is_some()).collect();
    if shown.is_empty() {
        return vec![Block::Prose("No trajectories were evaluated.".to_owned())];
    }
    let bars = shown.iter().map(|(name, rmse, tone, _)| Bar {
        name: (*name).to_owned(),
        tone: *tone,
        value: rmse.map(|r| r.rmse),
        interval: rmse.and_then(|r| r.ci95),
    });
    let figure = Bars {
        title: format!(
            "Error on {} trajectories that no fit has seen: {}",
            e.heldout_trajectories, e.quantity
        ),
        value: Axis::linear("root mean square error", &e.unit),
        groups: vec![BarGroup { label: String::new(), bars: bars.collect() }],
        references: Vec::new(),
        shape: BarShape::Bar,
    };
    let gain = e.reduction.map(|r| ("reduction", Some(r), Tone::Muted, "calibrated minus augmented"));
    let rows = shown.iter().chain(&gain).map(|(name, rmse, _, what)| {
        let rmse = rmse.unwrap_or_default();
        Row {
            cells: vec![Cell::text(*name), Cell::text(*what), Cell::estimate(rmse.rmse, rmse.ci95)],
            compare: None,
            strong: *name == "augmented",
        }
    });
    let table = Table {
        caption: format!("Error of the {} on {} trajectories that no fit has seen", e.quantity, e.heldout_trajectories),
        columns: vec![
            Column::text("model"),
            Column::text("which is"),
            Column::number("root mean square error [95 %]", &e.unit),
        ],
        rows: rows.collect(),
        footnotes: vec![match e.folds {
            None => "These trajectories were kept out from the beginning. Intervals by bootstrap over trajectories.".to_owned(),
            Some(n) => format!(
                "Too few trajectories to keep any out: fits and choice were repeated without each of {n} folds, and every trajectory \
                 is forecast by a model that has not seen it. Intervals by bootstrap over trajectories."
            ),
        }],
    };
    let share = e.explained_share.map(|s| {
        Block::Prose(format!(
            "Of the error that noise does not explain, {} % was removed.",
            significant(s * 100.0, 3)
        ))
    });
    let mut blocks: Vec<Block> = share.into_iter().collect();
    blocks.extend([
        Block::Table(table),
        Block::Figure(Box::new(FigureBlock { figure: figure.into(), caption: String::new() })),
    ]);
    blocks
}

#[cfg(test)]
mod tests {
    //! Contract: the lead leaves out intervals and nothing else.
    use super::lead;

    #[test]
    fn intervals_go_and_groups_stay() {
        assert_eq!(
            lead("lacks drag (k = 0.3 [0.2, 0.4]) and x [a, b]; gain"),
            "lacks drag (k = 0.3) and x [a, b]; gain"
        );
        assert_eq!(lead("no [end"), "no [end");
    }
}
