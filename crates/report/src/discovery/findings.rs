//! Sections on findings: effects, parameters, candidates, noise, open questions.

use super::{DiscoveryReport, Noise, Parameter, Verdict};
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
            _ => "No effect from the library was added.",
        };
        blocks.push(Block::Prose(text.to_owned()));
    } else {
        let mut rows = Vec::new();
        let folds = report.effects.iter().any(|e| e.folds.is_some());
        let removed = report.effects.iter().any(|e| e.removed.is_some());
        for effect in &report.effects {
            for (i, p) in effect.parameters.iter().enumerate() {
                let first = |cell: Cell| if i == 0 { cell } else { Cell::text("") };
                let [value, unit] = parameter_cells(p);
                let mut cells = vec![
                    first(Cell::text(format!("`{}`", effect.kind))),
                    first(Cell::text(&effect.stands_for)),
                    Cell::text(format!("`{}`", p.name)),
                    value,
                    unit,
                    first(Cell::number(effect.share.map(|s| s * 100.0))),
                ];
                if removed {
                    cells.insert(5, first(Cell::number(effect.removed)));
                }
                if folds {
                    let again =
                        effect.folds.map_or(Cell::Missing, |[k, n]| Cell::text(format!("{k} of {n}")));
                    cells.push(first(again));
                }
                rows.push(Row::from(cells));
            }
        }
        let mut columns = vec![
            Column::text("kind"),
            Column::text("stands for"),
            Column::text("parameter"),
            Column::number("value [95 %]", ""),
            Column::text("unit"),
            Column::number("share of the gain", "%").decimals(1),
        ];
        if removed {
            columns.insert(5, Column::number("error removed", &report.error.unit));
        }
        if folds {
            columns.push(Column::text("found again in folds"));
        }
        blocks.push(Block::Table(Table {
            caption: "Effects added".to_owned(),
            columns,
            rows,
            footnotes: vec!["Error removed: by how much the forecast error grows when this effect alone is left out and the rest is fitted again. Share of the gain: how much of the gain in likelihood is lost then.".to_owned()],
        }));
    }
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
        caption: "All candidates: those that were fitted, then those that were only tested, each by gain less penalty".to_owned(),
        columns: vec![
            Column::text("effect"),
            Column::number("rank", "").decimals(0),
            Column::number("gain less penalty", &report.score_unit).decimals(1),
            Column::text("parameters [95 %]"),
            Column::text("why it won or lost"),
        ],
        rows: rows.collect(),
        footnotes: vec!["Bold row: chosen. Gain is that over the calibrated model on the trajectories that fits may see; of a candidate that was only tested it is what the test promises.".to_owned()],
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
