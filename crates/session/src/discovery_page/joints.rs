//! Section of the report on the joints of a robot: effects, torque errors before and after, and friction.

use super::{AFTER, BEFORE};
use crate::joints::{
    FrictionCurve, JointEffect, JointParameter, JointResult, Quantity, effects_on_whole_arm, joint_results,
};
use crate::{ReportContext, Subject};
use augsim_data::{digits, estimate_digits};
use augsim_discovery::{Discovery, Example, ExampleChannel};
use augsim_report::capitalised;
use augsim_report::figure::{Axis, Figure, Line, Mark, Series, Tone};
use augsim_report::page::{Block, Cell, Column, Columns, Grid, LegendEntry, Row, Table};

/// Colour of the calibrated model in the figures of joints.
const CALIBRATED: Tone = Tone::Series(2);

/// Plain names of effects at joints; other kinds are shown with spaces for hyphens.
const PLAIN_NAMES: [(&str, &str); 17] = [
    ("linear-damping", "viscous friction"),
    ("quadratic-damping", "friction quadratic in speed"),
    ("cubic-damping", "friction cubic in speed"),
    ("asymmetric-damping", "friction that differs with direction"),
    ("coulomb", "Coulomb friction"),
    ("stribeck", "Stribeck friction"),
    ("presliding", "presliding friction"),
    ("load-friction", "load-dependent friction"),
    ("coupled-damping", "coupled viscous friction"),
    ("opposed-damping", "viscous friction between joints"),
    ("coupled-coulomb", "coupled Coulomb friction"),
    ("coupled-inertia", "coupled rotor inertia"),
    ("opposed-inertia", "rotor inertia between joints"),
    ("rotor-inertia", "rotor inertia"),
    ("constant", "constant torque"),
    ("linear-stiffness", "spring"),
    ("ripple", "torque ripple"),
];

/// Table of the joints, and for each its predictions over time and its friction; nothing for other models than robots.
pub(super) fn blocks(context: &ReportContext, subject: &Subject, d: &Discovery) -> Vec<Block> {
    let figures = &context.figures;
    let without_data;
    let joints = if figures.joints.is_empty() {
        without_data = joint_results(subject, d, None);
        &without_data
    } else {
        &figures.joints
    };
    let Some(first) = joints.first() else { return Vec::new() };
    let mut blocks = vec![Block::Table(table(joints, first, d))];
    let others = effects_on_whole_arm(subject, d, joints);
    if !others.is_empty() {
        let names: Vec<String> = others.iter().map(|name| format!("`{name}`")).collect();
        blocks.push(Block::Prose(format!("Effects on the whole arm: {}; see above.", names.join(", "))));
    }
    blocks.extend(grid(joints, &figures.friction, d));
    blocks
}

/// Plain name of an effect, with the other joint of an effect on two.
fn plain_name(effect: &JointEffect) -> String {
    let known = PLAIN_NAMES.iter().find(|(kind, _)| *kind == effect.kind).map(|(_, name)| *name);
    let name = known.map_or_else(|| effect.kind.replace('-', " "), str::to_owned);
    match &effect.with {
        Some(with) => format!("{name} with `{with}`"),
        None => name,
    }
}

/// Text of the parameters of an effect: name, value, interval and unit of each.
fn values(effect: &JointEffect) -> String {
    let parameter = |p: &JointParameter| {
        let e = &p.estimate;
        let unit = if e.unit.is_empty() { String::new() } else { format!("\u{a0}{}", e.unit) };
        if e.not_identified.is_some() {
            return format!("{} = {}{unit} (not determined)", p.name, digits(e.value));
        }
        let [value, low, high] = estimate_digits(e.value, e.ci95);
        format!("{} = {value}{unit} [{low}, {high}]", p.name)
    };
    effect.parameters.iter().map(parameter).collect::<Vec<String>>().join("; ")
}

/// Table with one row for each joint and effect; the errors of a joint are in its first row.
fn table(joints: &[JointResult], first: &JointResult, d: &Discovery) -> Table {
    let has_percent = joints.iter().any(|joint| joint.measured_sd.is_some());
    let is_uniform = joints.iter().all(|joint| joint.unit == first.unit);
    let mut rows = Vec::new();
    for joint in joints {
        let number = |value: f64| match is_uniform {
            true => Cell::Number(value),
            false => Cell::text(format!("{}\u{a0}{}", digits(value), joint.unit)),
        };
        let mut errors = vec![number(joint.calibrated.rmse), number(joint.augmented.rmse)];
        if has_percent {
            errors.extend([joint.calibrated, joint.augmented].map(|e| Cell::number(joint.percent(e))));
        }
        let blank = vec![Cell::text(""); errors.len()];
        let name = Cell::text(format!("`{}`", joint.joint));
        if joint.effects.is_empty() {
            let none = [name, Cell::text("none"), Cell::Missing, Cell::Missing];
            rows.push(Row::from(none.into_iter().chain(errors).collect::<Vec<Cell>>()));
            continue;
        }
        for (index, effect) in joint.effects.iter().enumerate() {
            let own = [
                if index == 0 { name.clone() } else { Cell::text("") },
                Cell::text(plain_name(effect)),
                Cell::text(values(effect)),
                Cell::number(effect.removed_share.map(|share| 100.0 * share)),
            ];
            let errors = if index == 0 { errors.clone() } else { blank.clone() };
            rows.push(Row::from(own.into_iter().chain(errors).collect::<Vec<Cell>>()));
        }
    }
    let word = first.quantity.word();
    let unit = if is_uniform { first.unit.as_str() } else { "" };
    let mut columns = vec![
        Column::text("joint"),
        Column::text("effect"),
        Column::text("value [95 %]"),
        Column::number(&format!("{word} error removed"), "%").decimals(1),
        Column::number("error before", unit),
        Column::number("error after", unit),
    ];
    if has_percent {
        columns.push(Column::number("before", "% of sd").decimals(1));
        columns.push(Column::number("after", "% of sd").decimals(1));
    }
    Table {
        caption: format!("Effects and {word} errors of the joints on held-out data"),
        columns,
        rows,
        footnotes: vec![footnote(word, d)],
    }
}

/// Footnote that explains the columns of the table.
fn footnote(word: &str, d: &Discovery) -> String {
    // Without held-out records only one effect has an error by models that did not use the data.
    let on = match d.heldout.is_empty() && d.effects.len() > 1 {
        true => ", on the data that the models were fitted to",
        false => "",
    };
    format!(
        "Error: root mean square of measured minus predicted {word} on data that the model was not fitted to; before: calibrated model, \
         after: with the effects added. Error removed: increase of the joint's error when the effect is removed and the others are \
         fitted again{on}, in % of the error before. Sd: standard deviation of the measured {word}."
    )
}

/// Figures of all joints: predictions over time, and friction over speed.
fn grid(joints: &[JointResult], friction: &[FrictionCurve], d: &Discovery) -> Option<Block> {
    // Of cross-validation the prediction of a fold; otherwise the typical one of the held-out records.
    let of_heldout = || d.examples.iter().find(|e| e.rank == "median").or(d.examples.first());
    let example = d.fold_example.as_ref().or_else(of_heldout);
    let mut figures = Vec::new();
    for joint in joints {
        let channel = example.and_then(|e| e.channels.iter().find(|c| c.column == joint.measure));
        figures.extend(example.zip(channel).map(|(e, c)| over_time(joint, e, c, !d.effects.is_empty())));
        figures.extend(friction.iter().find(|f| f.joint == joint.joint).and_then(over_speed));
    }
    let first = joints.first().filter(|_| !figures.is_empty())?;
    let line = |name: &str, tone| LegendEntry::Line(name.to_owned(), tone);
    let mut legend = vec![
        LegendEntry::Points("measured".to_owned(), Tone::Ink),
        line("declared model", BEFORE),
        line("calibrated model", CALIBRATED),
    ];
    if !d.effects.is_empty() {
        legend.push(line("augmented model", AFTER));
    }
    // A run that was stopped has predictions of fitted records only.
    let is_held_out = d.fold_example.is_some() || !d.heldout.is_empty();
    let what = if is_held_out { "held out" } else { "of the data that the models were fitted to" };
    let stretch = example.map_or_else(String::new, |e| format!(" Over time: {}, {what}.", e.id));
    let friction = match first.quantity {
        Quantity::Torque => {
            " Friction: torque that depends on the speed of this joint alone, in the augmented model; the points are the measured torque \
             minus that of the rigid bodies with the inertias of the augmented model, so that they also show effects of other quantities."
        }
        Quantity::Position => {
            " Friction: torque that depends on the speed of this joint alone, in the augmented model."
        }
    };
    let caption = format!("{}{friction}", stretch.trim_start()).trim().to_owned();
    Some(Block::Grid(Grid { columns: Columns::Two, legend, figures, caption }))
}

/// Figure of the measured and the predicted torque or position of a joint over a held-out stretch.
fn over_time(joint: &JointResult, e: &Example, c: &ExampleChannel, has_effects: bool) -> Figure {
    let plain = |list: &[Option<f64>]| -> Vec<f64> { list.iter().map(|v| v.unwrap_or(f64::NAN)).collect() };
    let word = joint.quantity.word();
    let mut figure = Line::new(
        &format!("{} of {}", capitalised(word), joint.joint),
        Axis::linear("time", "s"),
        Axis::linear(word, &c.unit),
    );
    figure.hide_legend = true;
    let series =
        |name: &str, tone, list: &[Option<f64>]| Series::line(name, tone, e.times_s.clone(), plain(list));
    figure = figure.with(series("measured", Tone::Ink, &c.measured).with_mark(Mark::Points)).with(series(
        "declared model",
        BEFORE,
        &c.declared,
    ));
    if !c.calibrated.is_empty() {
        figure = figure.with(series("calibrated model", CALIBRATED, &c.calibrated));
    }
    if has_effects {
        figure = figure.with(series("augmented model", AFTER, &c.augmented));
    }
    figure.into()
}

/// Figure of the friction torque of a joint over its speed; `None` without curve and points.
fn over_speed(curve: &FrictionCurve) -> Option<Figure> {
    if curve.speed.is_empty() && curve.measured_speed.is_empty() {
        return None;
    }
    let mut figure = Line::new(
        &format!("Friction of {}", curve.joint),
        Axis::linear("speed", &curve.speed_unit),
        Axis::linear("friction torque", &curve.torque_unit).with_zero(),
    );
    figure.hide_legend = true;
    let points =
        Series::line("measured", Tone::Ink, curve.measured_speed.clone(), curve.measured_torque.clone());
    let model = Series::line("augmented model", AFTER, curve.speed.clone(), curve.torque.clone());
    Some(figure.with(points.with_mark(Mark::Points)).with(model).into())
}
