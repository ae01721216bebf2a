//! Findings: effects, parameters, leads, candidates, noise, open questions.

use super::{DeclaredParameter, display_unit};
use augsim_data::Unit;
use augsim_discovery::{Candidate, Discovery, Estimate, Lead, NullRecords, Verdict};
use augsim_report::figure::Heatmap;
use augsim_report::page::{Block, Cell, Column, Columns, Grid, Row, Table, estimate_text, significant};
use std::collections::BTreeMap;

fn value_cell(estimate: &Estimate) -> Cell {
    Cell::estimate(estimate.value, Some(estimate.ci95))
}

fn unit_cell(unit: &str) -> Cell {
    if unit.is_empty() { Cell::Missing } else { Cell::text(unit) }
}

/// Estimates with their names; those with values by group are followed by the values of the groups.
fn with_groups(estimates: &BTreeMap<String, Estimate>) -> Vec<(String, &Estimate)> {
    let mut list = Vec::new();
    for (name, estimate) in estimates {
        let has_groups = !estimate.groups.is_empty();
        list.push((if has_groups { format!("{name}, mean over groups") } else { name.clone() }, estimate));
        list.extend(estimate.groups.iter().map(|(group, e)| (format!("{name} of {group}"), e)));
    }
    list
}

/// The candidates: the chosen one, then the others by gain less penalty.
fn sorted(candidates: &[Candidate]) -> Vec<&Candidate> {
    let mut sorted: Vec<&Candidate> = candidates.iter().collect();
    let place = |c: &Candidate| (!c.chosen, !c.fitted, -(c.gain - c.penalty));
    sorted.sort_by(|a, b| place(a).partial_cmp(&place(b)).unwrap_or(std::cmp::Ordering::Equal));
    sorted
}

/// Established effects, the null rate and the declared parameters.
pub(super) fn found(d: &Discovery, declared: &[DeclaredParameter]) -> Vec<Block> {
    let mut blocks = Vec::new();
    if d.effects.is_empty() {
        let text = match d.verdict {
            Verdict::NothingToAdd => {
                "No effect was added: what the calibrated model leaves looks like noise."
            }
            _ => "No effect is established.",
        };
        blocks.push(Block::Prose(text.to_owned()));
    } else {
        blocks.push(Block::Table(established(d)));
    }
    blocks.extend(d.null_records.as_ref().map(|null| Block::Prose(null_rate(null))));
    let rows: Vec<Row> = declared.iter().filter_map(|p| calibrated(p, d.parameters.get(&p.name))).collect();
    if !rows.is_empty() {
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

/// The row of a declared parameter; none where it was not fitted although it is free.
fn calibrated(declared: &DeclaredParameter, fitted: Option<&Estimate>) -> Option<Row> {
    let name = &declared.name;
    let unit = match fitted {
        Some(estimate) => estimate.unit.clone(),
        None => Unit::of_column_name(name).map_or(String::new(), |u| u.symbol()),
    };
    let value = match fitted {
        _ if declared.is_frozen => Cell::text("frozen"),
        estimate => value_cell(estimate?),
    };
    Some(Row::from(vec![
        Cell::text(format!("`{name}`")),
        Cell::Number(declared.value),
        value,
        unit_cell(&unit),
    ]))
}

/// The table of established effects: one row for each parameter.
fn established(d: &Discovery) -> Table {
    let (effects, (error_unit, scale)) = (&d.effects, display_unit(&d.error.unit));
    let has_removed = effects.iter().any(|e| e.removed.is_some());
    let has_inclusion = effects.iter().any(|e| e.inclusion.is_some());
    let has_q_value = effects.iter().any(|e| e.q_value.is_some());
    let has_folds = effects.iter().any(|e| e.folds.is_some());
    let mut rows = Vec::new();
    for effect in effects {
        let mut of_effect = Vec::new();
        if has_removed {
            of_effect.push(Cell::number(effect.removed.map(|r| scale * r)));
        }
        of_effect.push(Cell::Number(effect.share * 100.0));
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
        let name = [Cell::text(format!("`{}`", effect.kind)), Cell::text(effect.stands_for.join(", "))];
        let row = |is_first: bool, parameter: [Cell; 3]| {
            let name = if is_first { name.clone() } else { [Cell::text(""), Cell::text("")] };
            let own = if is_first { of_effect.clone() } else { blank.clone() };
            Row::from(name.into_iter().chain(parameter).chain(own).collect::<Vec<_>>())
        };
        if effect.parameters.is_empty() {
            rows.push(row(true, [Cell::Missing, Cell::Missing, Cell::Missing]));
        }
        for (i, (name, estimate)) in with_groups(&effect.parameters).into_iter().enumerate() {
            let cells = [Cell::text(format!("`{name}`")), value_cell(estimate), unit_cell(&estimate.unit)];
            rows.push(row(i == 0, cells));
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
        columns.push(Column::number("error removed", error_unit));
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
fn null_rate(null: &NullRecords) -> String {
    let NullRecords { named, of } = null;
    format!(
        "{named} of {of} records like these, made without an effect, {} one.",
        if *named == 1 { "names" } else { "name" }
    )
}

/// Findings that are not established.
pub(super) fn leads(d: &Discovery) -> Vec<Block> {
    if d.leads.is_empty() {
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
        rows: d.leads.iter().map(row).collect(),
        footnotes: vec![
            "In resamples: share of the resamples of the data that select the effect. Chance: probability that chance alone moves its amount as \
             far from none; missing where no fitted model has the effect."
                .to_owned(),
        ],
    };
    let text = "The data hint at these effects and do not establish them. The verdict, the augmented model and its predictions do not rest on them.";
    vec![Block::Prose(text.to_owned()), Block::Table(table)]
}

/// Open questions: unexplained structure, alternatives, the next experiment.
pub(super) fn open_questions(d: &Discovery) -> Vec<Block> {
    let mut blocks = Vec::new();
    if let Some(u) = &d.unexplained {
        let mut text = format!(
            "A residual remains that no effect in the library explains. It lives {}, and depends on {}.",
            match u.place.as_str() {
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
    if !d.alternatives.is_empty() {
        blocks.push(Block::Prose(
            "These explanations fit equally well; the data cannot tell them apart:".to_owned(),
        ));
        let name =
            |kinds: &Vec<String>| kinds.iter().map(|k| format!("`{k}`")).collect::<Vec<_>>().join(" with ");
        blocks.push(Block::List(d.alternatives.iter().map(name).collect()));
    }
    if !d.next_experiment.is_empty() {
        blocks.push(Block::Callout(format!("Next experiment: {}", d.next_experiment)));
    }
    blocks
}

/// All sets of effects that were fitted.
pub(super) fn candidates(d: &Discovery) -> Vec<Block> {
    if d.candidates.is_empty() {
        return Vec::new();
    }
    let rows = sorted(&d.candidates).into_iter().enumerate().map(|(i, c)| {
        let kinds = if c.kinds.is_empty() {
            "calibrated model".to_owned()
        } else {
            c.kinds.iter().map(|k| format!("`{k}`")).collect::<Vec<_>>().join(" + ")
        };
        let one = |(name, p): (String, &Estimate)| {
            let (value, interval) = estimate_text(p.value, p.ci95);
            let interval = if interval.is_empty() { interval } else { format!(" [{interval}]") };
            let unit = if p.unit.is_empty() { String::new() } else { format!(" {}", p.unit) };
            format!("`{name}` = {value}{interval}{unit}")
        };
        let parameters = with_groups(&c.parameters).into_iter().map(one).collect::<Vec<_>>().join("; ");
        Row {
            cells: vec![
                Cell::text(kinds),
                Cell::Number((i + 1) as f64),
                Cell::Number(c.gain - c.penalty),
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
            Column::number("gain less penalty", "nats").decimals(1),
            Column::text("parameters [95 %]"),
            Column::text("why it won or lost"),
        ],
        rows: rows.collect(),
        footnotes: vec!["Bold row: chosen. Gain is that over the calibrated model in predictions of left-out blocks; the penalty grows with the number of candidates and of effects.".to_owned()],
    })]
}

/// Correlations of the estimates.
pub(super) fn correlations(d: &Discovery) -> Vec<Block> {
    let (names, values) = &d.correlations;
    if names.len() < 2 {
        return Vec::new();
    }
    let figure = Heatmap {
        title: "Correlation of the estimates".to_owned(),
        names: names.clone(),
        values: values.iter().map(|row| row.iter().copied().map(Some).collect()).collect(),
    };
    vec![Block::Grid(Grid {
        columns: Columns::Two,
        legend: Vec::new(),
        figures: vec![figure.into()],
        caption: "Near 1 or −1 the data determine a combination of two parameters, not each of them."
            .to_owned(),
    })]
}

/// The noise that was found in the data, beside the standard deviation that the model declares.
pub(super) fn noise(d: &Discovery, declared_sd: Option<f64>) -> Vec<Block> {
    let (sd, unit) = (d.noise.sd, &d.noise.unit);
    let declared = declared_sd.map_or_else(
        || "none was declared".to_owned(),
        |declared| format!("declared: {} {unit}", significant(declared, 3)),
    );
    let sd = significant(sd, 3);
    let mut blocks = vec![Block::Prose(format!(
        "Standard deviation of the sensor, estimated from the data: {sd} {unit}; {declared}."
    ))];
    let finding = |kind: &String| (format!("`{kind}`"), noise_text(kind, d));
    let findings: Vec<_> = d.noise.findings.iter().map(finding).collect();
    blocks.push(if findings.is_empty() {
        Block::Prose(
            "Nothing else about the noise was found to differ from what a white, normal sensor gives."
                .to_owned(),
        )
    } else {
        Block::Definitions(findings)
    });
    blocks
}

/// A property of the noise that is not as declared, in words.
fn noise_text(kind: &str, d: &Discovery) -> String {
    let n = &d.noise;
    match kind {
        "noise-autocorrelated" => {
            n.correlation.map_or(String::new(), |r| format!("neighbouring samples correlate with {r:.2}"))
        }
        "timing-jitter" => {
            let scatter = n.jitter_s.map(|s| format!("time stamps scatter by {:.2} ms", 1e3 * s));
            let frames = n
                .frame_s
                .map(|s| format!(" about frames of {:.3} ms, on which the samples were put", 1e3 * s));
            scatter.unwrap_or_default() + &frames.unwrap_or_default()
        }
        "outliers" => n
            .outliers
            .map_or(String::new(), |count| format!("{count} samples lie too far off and were left out")),
        "noise-scale" => format!("the sensor scatters by {:.4} {}, not as declared", n.sd, n.unit),
        _ => String::new(),
    }
}

/// The augmented model file.
pub(super) fn model(d: &Discovery) -> Vec<Block> {
    if d.model_toml.is_empty() {
        return Vec::new();
    }
    vec![Block::Code {
        caption: "The model file with what was found. `augsim simulate model.toml --like DATA` and `augsim predict model.toml --data DATA` run it, `augsim evaluate DIR --data DATA` scores it beside the declared model, `augsim train --residual-of DIR --data DATA` trains a net on what it leaves; DIR is the folder of this page.".to_owned(),
        text: d.model_toml.clone(),
    }]
}
