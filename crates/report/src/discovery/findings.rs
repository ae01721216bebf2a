//! Sections on findings: effects, parameters, candidates, noise, open questions.

use super::{DiscoveryReport, Lead, Noise, NullRecords, Parameter, Verdict};
use crate::figure::Heatmap;
use crate::page::{Block, Cell, Column, Columns, Grid, Row, Table};
use crate::plot::text::significant;

fn parameter_cells(p: &Parameter) -> [Cell; 2] {
    let unit = if p.unit.is_empty() { Cell::Missing } else { Cell::text(&p.unit) };
    [Cell::estimate(p.value, p.ci95), unit]
}

pub(super) fn found(report: &DiscoveryReport) -> Vec<Block> {
    let mut blocks = Vec::new();
    if report.effects.is_empty() {
        let text = match report.verdict {
            Verdict::NothingToAdd => {
                "No effect was added: what the calibrated model leaves looks like noise."
            }
            _ => "No effect is established.",
        };
        blocks.push(Block::Prose(text.to_owned()));
    } else {
        blocks.push(Block::Table(established(report)));
    }
    blocks.extend(report.null_records.map(|null| Block::Prose(null_rate(null))));
    if !report.calibrated.is_empty() {
        let rows = (report.calibrated.iter())
            .map(|c| {
                let [value, unit] = parameter_cells(&c.parameter);
                let value = if c.frozen { Cell::text("frozen") } else { value };
                Row::from(vec![
                    Cell::text(format!("`{}`", c.parameter.name)),
                    Cell::Number(c.declared),
                    value,
                    unit,
                ])
            })
            .collect();
        blocks.push(Block::Table(Table {
            caption: "Declared parameters".to_owned(),
            columns: vec![
                Column::text("parameter"),
                Column::number("declared", ""),
                Column::number("calibrated [95 %]", ""),
                Column::text("unit"),
            ],
            rows,
            footnotes: Vec::new(),
        }));
    }
    blocks
}

/// The table of established effects: one row for each parameter.
fn established(report: &DiscoveryReport) -> Table {
    let effects = &report.effects;
    let has_removed = effects.iter().any(|e| e.removed.is_some());
    let has_inclusion = effects.iter().any(|e| e.inclusion.is_some());
    let has_q_value = effects.iter().any(|e| e.q_value.is_some());
    let has_folds = effects.iter().any(|e| e.folds.is_some());
    let mut rows = Vec::new();
    for effect in effects {
        let mut of_effect = Vec::new();
        if has_removed {
            of_effect.push(Cell::number(effect.removed));
        }
        of_effect.push(Cell::number(effect.share.map(|s| s * 100.0)));
        if has_inclusion {
            of_effect.push(Cell::number(effect.inclusion.map(|s| s * 100.0)));
        }
        if has_q_value {
            of_effect.push(probability(effect.q_value));
        }
        if has_folds {
            of_effect.push(effect.folds.map_or(Cell::Missing, |[k, n]| Cell::text(format!("{k} of {n}"))));
        }
        let blank = vec![Cell::text(""); of_effect.len()];
        let name = [Cell::text(format!("`{}`", effect.kind)), Cell::text(&effect.stands_for)];
        let row = |is_first: bool, parameter: [Cell; 3]| {
            let name = if is_first { name.clone() } else { [Cell::text(""), Cell::text("")] };
            let own = if is_first { of_effect.clone() } else { blank.clone() };
            Row::from(name.into_iter().chain(parameter).chain(own).collect::<Vec<_>>())
        };
        if effect.parameters.is_empty() {
            rows.push(row(true, [Cell::Missing, Cell::Missing, Cell::Missing]));
        }
        for (i, p) in effect.parameters.iter().enumerate() {
            let [value, unit] = parameter_cells(p);
            rows.push(row(i == 0, [Cell::text(format!("`{}`", p.name)), value, unit]));
        }
    }
    let mut columns = vec![
        Column::text("kind"),
        Column::text("stands for"),
        Column::text("parameter"),
        Column::number("value [95 %]", ""),
        Column::text("unit"),
    ];
    if has_removed {
        columns.push(Column::number("error removed", &report.error.unit));
    }
    columns.push(Column::number("share of the gain", "%").decimals(1));
    if has_inclusion {
        columns.push(Column::number("in resamples", "%").decimals(0));
    }
    if has_q_value {
        columns.push(Column::text("q-value"));
    }
    if has_folds {
        columns.push(Column::text("found again in folds"));
    }
    Table { caption: "Established effects".to_owned(), columns, rows, footnotes: vec![FOOTNOTE.to_owned()] }
}

/// Meaning of the columns of the table of established effects.
const FOOTNOTE: &str = "Error removed: by how much the forecast error grows when this effect alone is left out and the rest is fitted again. \
                        Share of the gain: how much of the gain in predictions of left-out blocks is lost then. In resamples: share of the \
                        resamples of the data in which the effect, or another reading of it, comes back. q-value: share of false findings to \
                        be expected among those that are as significant.";

/// A probability in print: small ones as a bound.
fn probability(p: Option<f64>) -> Cell {
    match p {
        None => Cell::Missing,
        Some(p) if p < 0.001 => Cell::text("< 0.001"),
        Some(p) => Cell::text(format!("{p:.3}")),
    }
}

/// The share of records without an effect that name one, in a sentence.
fn null_rate(null: NullRecords) -> String {
    let NullRecords { named, of } = null;
    format!(
        "{named} of {of} records like these, made without an effect, {} one.",
        if named == 1 { "names" } else { "name" }
    )
}

pub(super) fn leads(report: &DiscoveryReport) -> Vec<Block> {
    if report.leads.is_empty() {
        return Vec::new();
    }
    let row = |lead: &Lead| {
        Row::from(vec![
            Cell::text(format!("`{}`", lead.kind)),
            Cell::Number(100.0 * lead.inclusion),
            probability(lead.chance),
            Cell::text(&lead.why),
            Cell::text(&lead.next),
        ])
    };
    let table = Table {
        caption: "Findings that are not established".to_owned(),
        columns: vec![
            Column::text("kind"),
            Column::number("in resamples", "%").decimals(0),
            Column::text("chance"),
            Column::text("what it is short of"),
            Column::text("what would establish it"),
        ],
        rows: report.leads.iter().map(row).collect(),
        footnotes: vec![
            "In resamples: share of the resamples of the data that select the effect. Chance: probability that chance alone moves its amount as \
             far from none; missing where no fitted model has the effect."
                .to_owned(),
        ],
    };
    let text = "The data hint at these effects and do not establish them. The verdict, the augmented model and its predictions do not rest on them.";
    vec![Block::Prose(text.to_owned()), Block::Table(table)]
}

pub(super) fn open_questions(report: &DiscoveryReport) -> Vec<Block> {
    let mut blocks = Vec::new();
    if let Some(u) = &report.unexplained {
        let mut text = format!(
            "A residual remains that no effect in the library explains. It lives {}, and depends on {}.",
            match u.r#where.as_str() {
                "flight" => "in flight".to_owned(),
                "impact" => "at impacts".to_owned(),
                "sensor" => "in what the sensor reports".to_owned(),
                "rate" => format!("in the rate of {}", u.target),
                "output" => format!("in the output {}", u.target),
                other => other.to_owned(),
            },
            u.against
        );
        if !u.term.is_empty() {
            text.push_str(&format!(" The term that removes most of it: `{}`.", u.term));
        }
        blocks.push(Block::Prose(text));
    }
    if !report.alternatives.is_empty() {
        blocks.push(Block::Prose(
            "These explanations fit equally well; the data cannot tell them apart:".to_owned(),
        ));
        let name =
            |kinds: &Vec<String>| kinds.iter().map(|k| format!("`{k}`")).collect::<Vec<_>>().join(" with ");
        blocks.push(Block::List(report.alternatives.iter().map(name).collect()));
    }
    if let Some(next) = &report.next_experiment {
        blocks.push(Block::Callout(format!("Next experiment: {next}")));
    }
    blocks
}

pub(super) fn candidates(report: &DiscoveryReport) -> Vec<Block> {
    if report.candidates.is_empty() {
        return Vec::new();
    }
    let rows = report.candidates.iter().enumerate().map(|(i, c)| {
        let kinds = if c.kinds.is_empty() {
            "calibrated model".to_owned()
        } else {
            c.kinds.iter().map(|k| format!("`{k}`")).collect::<Vec<_>>().join(" + ")
        };
        let one = |p: &Parameter| {
            let (value, interval) = match p.ci95 {
                Some(ci) => crate::page::estimate_text(p.value, ci),
                None => (significant(p.value, 3), String::new()),
            };
            let interval = if interval.is_empty() { interval } else { format!(" [{interval}]") };
            let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
            format!("`{}` = {value}{interval}{unit}", p.name)
        };
        let parameters = c.parameters.iter().map(one).collect::<Vec<_>>().join("; ");
        Row {
            cells: vec![
                Cell::text(kinds),
                Cell::Number((i + 1) as f64),
                Cell::number(c.score),
                if parameters.is_empty() { Cell::Missing } else { Cell::text(parameters) },
                Cell::text(&c.why),
            ],
            compare: None,
            strong: c.chosen,
        }
    });
    vec![Block::Table(Table {
        caption: "All candidates that were fitted, by gain less penalty".to_owned(),
        columns: vec![
            Column::text("effect"),
            Column::number("rank", "").decimals(0),
            Column::number("gain less penalty", &report.score_unit).decimals(1),
            Column::text("parameters [95 %]"),
            Column::text("why it won or lost"),
        ],
        rows: rows.collect(),
        footnotes: vec!["Bold row: chosen. Gain is that over the calibrated model in predictions of left-out blocks; the penalty grows with the number of candidates and of effects.".to_owned()],
    })]
}

pub(super) fn correlations(report: &DiscoveryReport) -> Vec<Block> {
    let c = &report.correlations;
    if c.names.len() < 2 {
        return Vec::new();
    }
    let figure = Heatmap {
        title: "Correlation of the estimates".to_owned(),
        names: c.names.clone(),
        values: c.values.clone(),
    };
    vec![Block::Grid(Grid {
        columns: Columns::Two,
        legend: Vec::new(),
        figures: vec![figure.into()],
        caption: "Near 1 or −1 the data determine a combination of two parameters, not each of them."
            .to_owned(),
    })]
}

pub(super) fn noise(noise: &Noise) -> Vec<Block> {
    let mut blocks = Vec::new();
    if let Some(sd) = noise.sd {
        let (value, interval) = noise.ci95.map_or_else(
            || (significant(sd, 3), String::new()),
            |ci| {
                let (value, interval) = crate::page::estimate_text(sd, ci);
                (value, format!(" (95 %: {interval})"))
            },
        );
        let declared = noise.declared_sd.map_or_else(
            || "none was declared".to_owned(),
            |d| format!("declared: {} {}", significant(d, 3), noise.unit),
        );
        blocks.push(Block::Prose(format!(
            "Standard deviation of the sensor, estimated from the data: {value} {}{interval}; {declared}.",
            noise.unit
        )));
    }
    let findings =
        noise.findings.iter().map(|f| (format!("`{}`", f.kind), f.text.clone())).collect::<Vec<_>>();
    if !findings.is_empty() {
        blocks.push(Block::Definitions(findings));
    } else if !blocks.is_empty() {
        blocks.push(Block::Prose(
            "Nothing else about the noise was found to differ from what a white, normal sensor gives."
                .to_owned(),
        ));
    }
    blocks
}

pub(super) fn model(report: &DiscoveryReport) -> Vec<Block> {
    if report.model_toml.is_empty() {
        return Vec::new();
    }
    vec![Block::Code {
        caption: "The model file with what was found. `augsim simulate model.toml --like DATA` and `augsim predict model.toml --data DATA` run it, `augsim evaluate DIR --data DATA` scores it beside the declared model, `augsim train --residual-of DIR --data DATA` trains a net on what it leaves; DIR is the folder of this page.".to_owned(),
        text: report.model_toml.clone(),
    }]
}
