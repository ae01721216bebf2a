//! Sections that only some benchmarks have: clouds of a repeated experiment, fitted parameters.

use super::{BenchmarkReport, Cloud as Points};
use crate::figure::{Axis, Cloud, Figure, Scatter, Tone};
use crate::page::{Best, Block, Cell, Column, Columns, Grid, LegendEntry, Row, Table};

pub(super) fn clouds(report: &BenchmarkReport) -> Vec<Block> {
    let Some(truth) = report.clouds.first() else { return Vec::new() };
    let cloud = |c: &Points, tone| Cloud { name: c.name.clone(), tone, x: c.x_mm.clone(), y: c.y_mm.clone() };
    // One figure per model, drawn over the truth.
    let figures = report.clouds[1..]
        .iter()
        .map(|c| {
            Figure::from(Scatter {
                title: c.name.clone(),
                x: Axis::linear("x", "mm"),
                y: Axis::linear("y", "mm"),
                clouds: vec![cloud(truth, Tone::Ink), cloud(c, Tone::Series(0))],
                references: Vec::new(),
                hide_legend: true,
            })
        })
        .collect();
    let legend = vec![
        LegendEntry::Points("truth".to_owned(), Tone::Ink),
        LegendEntry::Points("model".to_owned(), Tone::Series(0)),
    ];
    let number = |title: &str, unit: &str| Column::number(title, unit).decimals(3).best(Best::Lowest);
    let row = |c: &Points| {
        let cells = vec![
            Cell::text(&c.name),
            Cell::number(c.chamfer_mm),
            Cell::number(c.over_floor),
            Cell::number(c.energy_mm),
        ];
        // The second set of truths defines the floor (ratio 1) and is not compared with the models.
        Row { cells, compare: (c.over_floor != Some(1.0)).then(|| "model".to_owned()), strong: false }
    };
    let table = Table {
        caption: "Distance from the truth".to_owned(),
        columns: vec![
            Column::text("cloud"),
            number("Chamfer distance", "mm"),
            number("over the floor", ""),
            number("energy distance", "mm"),
        ],
        rows: report.clouds[1..].iter().map(row).collect(),
        footnotes: vec![
            "The floor is the Chamfer distance of a second, independent set of true displacements. The Chamfer distance is insensitive to a shift; the energy distance is sensitive to it, and near zero for two sets from the same distribution.".to_owned(),
        ],
    };
    vec![
        Block::Table(table),
        Block::Grid(Grid {
            columns: Columns::Three,
            legend,
            figures,
            caption: report.clouds_caption.clone(),
        }),
    ]
}

pub(super) fn parameters(report: &BenchmarkReport) -> Vec<Block> {
    if report.parameters.is_empty() {
        return Vec::new();
    }
    let row = |(name, declared, value, ci95): &(String, f64, f64, [f64; 2])| {
        Row::from(vec![
            Cell::text(name),
            Cell::number(Some(*declared)),
            Cell::Interval { value: *value, low: ci95[0], high: ci95[1] },
        ])
    };
    vec![Block::Table(Table {
        caption: "Parameters fitted to the training runs".to_owned(),
        columns: vec![
            Column::text("parameter"),
            Column::number("declared", ""),
            Column::number("fitted, 95 % interval", ""),
        ],
        rows: report.parameters.iter().map(row).collect(),
        footnotes: vec!["Intervals count each run as one observation.".to_owned()],
    })]
}
