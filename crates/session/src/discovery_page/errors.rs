//! Error before and after: the key figures at the top of the page, and its section on errors.

use super::{AFTER, BEFORE, display_unit};
use augsim_discovery::{Discovery, ErrorTable, Rmse, Verdict};
use augsim_report::figure::{Axis, Bar, BarGroup, BarShape, Bars, Tone};
use augsim_report::page::{Block, Cell, Column, FigureBlock, KeyFigure, Row, Table, significant};

/// Key figures at the top of the report: error before, error after, share of the removable error removed.
pub(super) fn key_figures(d: &Discovery) -> Vec<KeyFigure> {
    let (e, (unit, scale)) = (&d.error, display_unit(&d.error.unit));
    let figure = |label: &str, value: f64, unit: &str, note: String| KeyFigure {
        value: significant(value, 3),
        unit: unit.to_owned(),
        label: label.to_owned(),
        note,
    };
    let floor = e.noise_floor.interval_text(|bound| significant(scale * bound, 3));
    let floor = format!("noise floor estimated at {floor}\u{202f}{unit}");
    let after_label =
        if d.effects.is_empty() { "error after calibration" } else { "error with the effects added" };
    let after = if d.has_additions() { e.augmented } else { e.calibrated };
    let share_note = match d.verdict {
        Verdict::NothingToAdd => "by calibration",
        _ => "of the error that noise does not explain",
    };
    let mut figures = vec![
        figure("error as declared", scale * e.declared.rmse, unit, "root mean square".to_owned()),
        figure(after_label, scale * after.rmse, unit, floor),
    ];
    let share = e.explained_text().map(|text| KeyFigure {
        value: text.trim_end_matches(" %").replace("more than ", "> "),
        unit: if text.ends_with('%') { "%".to_owned() } else { String::new() },
        label: "removable error removed".to_owned(),
        note: share_note.to_owned(),
    });
    figures.extend(share);
    figures
}

/// Tables and bars of the errors of the declared, the calibrated and the augmented model, for every measure.
pub(super) fn blocks(d: &Discovery, quantity: &str) -> Vec<Block> {
    let several = !d.errors.is_empty() && !d.error.measure.is_empty();
    let first = if several { format!("`{}`", d.error.measure) } else { quantity.to_owned() };
    let mut blocks = blocks_of(d, &d.error, &first);
    blocks.extend(d.errors.iter().flat_map(|(name, table)| blocks_of(d, table, &format!("`{name}`"))));
    blocks
}

/// Table and bars of the errors of one measure.
fn blocks_of(d: &Discovery, e: &ErrorTable, quantity: &str) -> Vec<Block> {
    let (unit, scale) = display_unit(&e.unit);
    let scaled = |r: Rmse| (scale * r.rmse, r.ci95.map(|v| scale * v));
    let mut stages = vec![
        ("declared", e.declared, BEFORE, "the model file as it is"),
        ("calibrated", e.calibrated, Tone::Series(2), "declared parameters fitted"),
    ];
    if d.has_additions() {
        stages.push(("augmented", e.augmented, AFTER, "with the effects added"));
    }
    stages.push((
        "noise floor",
        e.noise_floor,
        Tone::Muted,
        "estimate: error from measurement noise alone, with initial states estimated from noisy samples",
    ));
    let bar = |(name, error, tone, _): &(&str, Rmse, Tone, &str)| {
        let (value, interval) = scaled(*error);
        Bar { name: (*name).to_owned(), tone: *tone, value: Some(value), interval: Some(interval) }
    };
    let figure = Bars {
        title: format!(
            "Error on {} held-out trajectories: {}",
            e.heldout_trajectories,
            quantity.replace('`', "")
        ),
        value: Axis::linear("root mean square error", unit),
        groups: vec![BarGroup { label: String::new(), bars: stages.iter().map(bar).collect() }],
        references: Vec::new(),
        shape: BarShape::Bar,
    };
    let has_effects = !d.effects.is_empty();
    let gain = has_effects.then_some(("reduction", e.reduction, Tone::Muted, "calibrated minus augmented"));
    let row = |(name, error, _, meaning): &(&str, Rmse, Tone, &str)| {
        let (value, interval) = scaled(*error);
        Row {
            cells: vec![Cell::text(*name), Cell::text(*meaning), Cell::estimate(value, Some(interval))],
            compare: None,
            strong: *name == "augmented",
        }
    };
    let table = Table {
        caption: format!(
            "Error of the {quantity} on {} held-out trajectories",
            e.heldout_trajectories
        ),
        columns: vec![
            Column::text("model"),
            Column::text("meaning"),
            Column::number("root mean square error [95 %]", unit),
        ],
        rows: stages.iter().chain(&gain).map(row).collect(),
        footnotes: vec![match e.folds {
            None => "These trajectories were used neither for fitting nor for choosing effects. Intervals by bootstrap over trajectories.".to_owned(),
            Some(n) => format!(
                "Too few trajectories to hold any out: nested cross-validation with {n} folds. Every trajectory is predicted by a model \
                 that was fitted and chosen without it. Intervals by bootstrap over trajectories."
            ),
        }],
    };
    let share = e.explained_text().map(|share| {
        Block::Prose(format!(
            "The added effects and the calibration removed {share} of the squared error above the estimated noise floor."
        ))
    });
    let mut blocks: Vec<Block> = share.into_iter().collect();
    blocks.extend([
        Block::Table(table),
        Block::Figure(Box::new(FigureBlock { figure: figure.into(), caption: String::new() })),
    ]);
    blocks
}
