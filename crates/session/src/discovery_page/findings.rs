//! Sections of the report on findings: effects, parameters, unconfirmed effects, candidates, noise, open questions.

use super::{DeclaredParameter, display_unit};
use augsim_data::Unit;
use augsim_discovery::{Candidate, Discovery, Estimate, Lead, NoiseCause, NullRecords, Verdict};
use augsim_report::capitalised;
use augsim_report::figure::Heatmap;
use augsim_report::page::{Block, Cell, Column, Columns, Grid, Row, Table, significant};
use std::collections::BTreeMap;

fn value_cell(estimate: &Estimate) -> Cell {
    match &estimate.not_identified {
        Some(why) => Cell::text(format!("{} ({why})", significant(estimate.value, 3))),
        None => Cell::estimate(estimate.value, Some(estimate.ci95)),
    }
}

fn unit_cell(unit: &str) -> Cell {
    if unit.is_empty() { Cell::Missing } else { Cell::text(unit) }
}

/// Lists estimates with their labels; an estimate with values by group is followed by these values.
///
/// Only the name of a parameter is code, which is never broken over lines.
fn with_groups(estimates: &BTreeMap<String, Estimate>) -> Vec<(String, &Estimate)> {
    let mut list = Vec::new();
    for (name, estimate) in estimates {
        let has_groups = !estimate.groups.is_empty();
        let note = if has_groups { ", mean over groups" } else { "" };
        list.push((format!("`{name}`{note}"), estimate));
        list.extend(estimate.groups.iter().map(|(group, e)| (format!("`{name}` of `{group}`"), e)));
    }
    list
}

/// Number of candidate models that are shown at once; the others are folded.
const SHOWN_CANDIDATES: usize = 10;

/// Sorts the candidate models: the chosen one first, then the others by decreasing gain over it.
fn sorted(candidates: &[Candidate]) -> Vec<&Candidate> {
    let mut sorted: Vec<&Candidate> = candidates.iter().collect();
    let sort_key = |c: &Candidate| (!c.chosen, !c.fitted, -c.over_chosen);
    sorted.sort_by(|a, b| sort_key(a).partial_cmp(&sort_key(b)).unwrap_or(std::cmp::Ordering::Equal));
    sorted
}

/// Section on the established effects, the false-alarm rate on null data and the declared parameters.
pub(super) fn found(d: &Discovery, declared: &[DeclaredParameter]) -> Vec<Block> {
    let mut blocks = Vec::new();
    if d.effects.is_empty() {
        let text = match d.verdict {
            Verdict::NothingToAdd => {
                "No effect was added: the residual of the calibrated model is consistent with noise."
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

/// Table row of a declared parameter with its fitted value; `None` if it is free but was not fitted.
fn calibrated(declared: &DeclaredParameter, fitted: Option<&Estimate>) -> Option<Row> {
    let name = &declared.name;
    let unit = match fitted {
        Some(estimate) => estimate.unit.clone(),
        None => Unit::from_column_name(name).map_or(String::new(), |u| u.symbol()),
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

/// Builds the table of established effects, with one row for each parameter.
fn established(d: &Discovery) -> Table {
    let (effects, (error_unit, scale)) = (&d.effects, display_unit(&d.error.unit));
    let has_removed = effects.iter().any(|e| e.removed.is_some());
    let has_inclusion = effects.iter().any(|e| e.inclusion.is_some());
    let has_q_value = effects.iter().any(|e| e.q_value.is_some());
    let has_folds = effects.iter().any(|e| e.folds.is_some());
    let mut rows = Vec::new();
    for effect in effects {
        let mut effect_cells = Vec::new();
        if has_removed {
            effect_cells.push(Cell::number(effect.removed.map(|r| scale * r)));
        }
        effect_cells.push(Cell::Number(effect.share * 100.0));
        if has_inclusion {
            effect_cells.push(Cell::number(effect.inclusion.map(|s| s * 100.0)));
        }
        if has_q_value {
            effect_cells.push(probability(effect.q_value));
        }
        if has_folds {
            effect_cells.push(effect.folds.map_or(Cell::Missing, |[k, n]| Cell::text(format!("{k} of {n}"))));
        }
        let blank = vec![Cell::text(""); effect_cells.len()];
        let kind = match effect.kind.strip_suffix(" per group") {
            Some(name) => format!("`{name}` per group"),
            None => format!("`{}`", effect.kind),
        };
        let name = [Cell::text(kind), Cell::text(effect.stands_for.join(", "))];
        let row = |is_first: bool, parameter: [Cell; 3]| {
            let name = if is_first { name.clone() } else { [Cell::text(""), Cell::text("")] };
            let cells = if is_first { effect_cells.clone() } else { blank.clone() };
            Row::from(name.into_iter().chain(parameter).chain(cells).collect::<Vec<_>>())
        };
        if effect.parameters.is_empty() {
            rows.push(row(true, [Cell::Missing, Cell::Missing, Cell::Missing]));
        }
        for (i, (label, estimate)) in with_groups(&effect.parameters).into_iter().enumerate() {
            let cells = [Cell::text(label), value_cell(estimate), unit_cell(&estimate.unit)];
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
    // The interim result of a search that was stopped has effects whose significance was not tested.
    let is_tested = has_inclusion || has_q_value || effects.iter().all(|e| e.per.is_some());
    let caption = match is_tested {
        true => "Established effects",
        false => "Effects of the best set so far, not tested for significance",
    };
    Table { caption: caption.to_owned(), columns, rows, footnotes: vec![FOOTNOTE.to_owned()] }
}

/// Footnote that explains the columns of the table of established effects.
const FOOTNOTE: &str = "Error removed: increase of the prediction error when this effect alone is removed and the others are fitted again. \
                        Share of the gain: share of the gain in cross-validated log-likelihood that is lost then. In resamples: share of \
                        the resampled data sets in which the effect, or an equivalent one, is found again. q-value: expected share of \
                        false findings among all that are at least as significant.";

/// Table cell of a probability; a value below 0.001 is shown as a bound.
fn probability(p: Option<f64>) -> Cell {
    match p {
        None => Cell::Missing,
        Some(p) if p < 0.001 => Cell::text("< 0.001"),
        Some(p) => Cell::text(format!("{p:.3}")),
    }
}

/// Sentence on false alarms: in how many simulated null data sets an effect was found.
fn null_rate(null: &NullRecords) -> String {
    let NullRecords { named, of } = null;
    format!(
        "False alarms: an effect was found in {named} of {of} data sets like this one, generated without a missing effect."
    )
}

/// Section on effects that the data suggest but do not establish.
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
            Column::text("why it is not established"),
            Column::text("what would establish it"),
        ],
        rows: d.leads.iter().map(row).collect(),
        footnotes: vec![
            "In resamples: share of the resampled data sets in which the effect is selected. Chance: p-value of its parameters being zero; \
             missing if no fitted model has the effect."
                .to_owned(),
        ],
    };
    let text = "The data suggest these effects but do not establish them. The verdict, the augmented model and its predictions do not use them.";
    vec![Block::Prose(text.to_owned()), Block::Table(table)]
}

/// Section on open questions: unexplained structure in the residual, equivalent alternatives, the next experiment.
pub(super) fn open_questions(d: &Discovery) -> Vec<Block> {
    let mut blocks = Vec::new();
    if let Some(u) = &d.unexplained {
        let mut text = format!(
            "A residual remains that no effect in the library explains. It is {}, and depends on {}.",
            match u.place.as_str() {
                "flight" => "in flight".to_owned(),
                "impact" => "at impacts".to_owned(),
                "sensor" => "in the sensor readings".to_owned(),
                "rate" => format!("in the rate of {}", u.target),
                "output" => format!("in the output {}", u.target),
                other => other.to_owned(),
            },
            u.feature
        );
        if !u.term.is_empty() {
            text.push_str(&format!(" The term that removes most of it: `{}`.", u.term));
        }
        blocks.push(Block::Prose(text));
    }
    if !d.alternatives.is_empty() {
        blocks.push(Block::Prose(
            "These explanations fit equally well and cannot be distinguished with these data:".to_owned(),
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

/// Section on the candidate models (sets of effects) that were fitted: the best in a table, the others folded.
pub(super) fn candidates(d: &Discovery) -> Vec<Block> {
    let list = sorted(&d.candidates);
    if list.is_empty() {
        return Vec::new();
    }
    let (shown, folded) = list.split_at(list.len().min(SHOWN_CANDIDATES));
    let mut table = candidate_table(shown, 1);
    table.caption = "Fitted sets of effects".to_owned();
    table.footnotes = vec![
        "Bold row: chosen. Over the chosen set: gain in the cross-validated log-likelihood minus the difference of the penalties, which grow with the \
         number of candidates and of effects. The file result.json has the parameters of every set."
            .to_owned(),
    ];
    let mut blocks = vec![Block::Table(table)];
    if !folded.is_empty() {
        blocks.push(Block::Folded {
            title: format!("{} more sets", folded.len()),
            blocks: vec![Block::Table(candidate_table(folded, SHOWN_CANDIDATES + 1))],
        });
    }
    blocks
}

/// Table of candidate models, the first with rank `first`.
fn candidate_table(list: &[&Candidate], first: usize) -> Table {
    let row = |(i, c): (usize, &&Candidate)| {
        let kinds = match c.kinds.is_empty() {
            true => "calibrated model".to_owned(),
            false => c.kinds.iter().map(|k| format!("`{k}`")).collect::<Vec<_>>().join(" + "),
        };
        let cells = vec![
            Cell::text(kinds),
            Cell::Number((first + i) as f64),
            Cell::Number(c.over_chosen),
            Cell::text(&c.why),
        ];
        Row { cells, compare: None, strong: c.chosen }
    };
    Table {
        caption: String::new(),
        columns: vec![
            Column::text("effects"),
            Column::number("rank", "").decimals(0),
            Column::number("over the chosen set", "nats").decimals(1),
            Column::text("why it was chosen or not"),
        ],
        rows: list.iter().enumerate().map(row).collect(),
        footnotes: Vec::new(),
    }
}

/// Table of the correlation matrix of the parameter estimates.
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
        caption:
            "Near 1 or −1 the data determine only a combination of the two parameters, not each of them."
                .to_owned(),
    })]
}

/// Section on the noise: the estimate from the data, beside the standard deviation that the model declares.
pub(super) fn noise(d: &Discovery, declared_sd: Option<f64>) -> Vec<Block> {
    let (sd, unit) = (d.noise.sd, &d.noise.unit);
    let declared = declared_sd.map_or_else(
        || "none was declared".to_owned(),
        |declared| format!("declared: {} {unit}", significant(declared, 3)),
    );
    let sd = significant(sd, 3);
    let mut blocks = vec![Block::Prose(format!(
        "Standard deviation of the measurement noise, estimated from the data: {sd} {unit}; {declared}."
    ))];
    let finding = |kind: &String| (format!("`{kind}`"), noise_text(kind, d));
    let findings: Vec<_> = d.noise.findings.iter().map(finding).collect();
    let cause = d.noise_cause.as_ref().and_then(NoiseCause::sentence);
    if findings.is_empty() && cause.is_none() {
        blocks.push(Block::Prose(
            "No other deviation from white, normally distributed measurement noise was found.".to_owned(),
        ));
    }
    if !findings.is_empty() {
        blocks.push(Block::Definitions(findings));
    }
    blocks.extend(cause.map(|sentence| Block::Prose(capitalised(&format!("{sentence}.")))));
    blocks
}

/// Sentence on a property of the estimated noise that differs from the declared noise.
fn noise_text(kind: &str, d: &Discovery) -> String {
    let n = &d.noise;
    match kind {
        "noise-autocorrelated" => n
            .correlation
            .map_or(String::new(), |r| format!("the noise of neighbouring samples has correlation {r:.2}")),
        "timing-jitter" => {
            let scatter = n.jitter_s.map(|s| format!("time stamps scatter by {:.2} ms", 1e3 * s));
            let frames = n.frame_s.map(|s| {
                format!(" around a frame clock of {:.3} ms; the samples were moved onto it", 1e3 * s)
            });
            scatter.unwrap_or_default() + &frames.unwrap_or_default()
        }
        "outliers" => n.outliers.map_or(String::new(), |count| format!("{count} outliers were removed")),
        "noise-scale" => {
            format!(
                "the standard deviation is {} {}, different from the declared one",
                significant(n.sd, 3),
                n.unit
            )
        }
        "noise-differs" => {
            "the noise of the recordings differs in size, and each has its own standard deviation".to_owned()
        }
        _ => String::new(),
    }
}

/// Section with the text of the augmented model file.
pub(super) fn model(d: &Discovery) -> Vec<Block> {
    if d.model_toml.is_empty() {
        return Vec::new();
    }
    vec![Block::Code {
        caption: "The model file with the effects that were found. `augsim simulate model.toml --like DATA` and `augsim predict model.toml --data DATA` run it, `augsim evaluate DIR --data DATA` scores it beside the declared model, `augsim train --residual-of DIR --data DATA` trains a net on its residual; DIR is the folder of this page.".to_owned(),
        text: d.model_toml.clone(),
    }]
}
