//! From pushing results to a page.

use super::{PushCloud, PushReport, PushRow};
use crate::figure::{Axis, Cloud, Figure, Line, Mark, Scatter, Series, Tone};
use crate::page::{
    Best, Block, Cell, Column, Columns, FigureBlock, Grid, LegendEntry, Page, Row, Section, Table,
};
use crate::training::TrainingReport;
use crate::training::page::{Tones, distinct, forecasts, learning};

pub(super) fn page(report: &PushReport) -> Page {
    // Forecasts and learning curves look as those of any other net.
    let nets = TrainingReport {
        subject: report.subject.clone(),
        forecasts: report.forecasts.clone(),
        learning: report.learning.clone(),
        training: report.training.clone(),
        ..TrainingReport::default()
    };
    let tones = Tones::of(&nets);
    let tone = |model: &str| tones.get(model);
    let mut data = vec![Block::Methods(report.methods.clone())];
    if report.methods.is_empty() {
        data.clear();
    }
    Page {
        overline: "augsim · pushing report".to_owned(),
        title: report.title.clone(),
        verdict: String::new(),
        summary: report.summary.clone(),
        key_figures: report.key_figures.clone(),
        sections: vec![
            Section::new("Results", tables(report)),
            Section::new("Training pushes", curves(report, &tone)),
            Section::new("The same push again and again", clouds(report)),
            Section::new("Forecasts over what happened", forecasts(&nets, &tones)),
            Section::new("Error over the push", over_push(report, &tone)),
            Section::new("Fitted parameters", parameters(report)),
            Section::new("Learning curves", learning(&nets, &tones)),
            Section::new("Remarks", report.notes.iter().cloned().map(Block::Prose).collect()),
            Section::new("Methods and references", data),
            Section::new("How to reproduce", reproduce(report)),
        ],
        provenance: report.provenance.clone(),
    }
}

fn tables(report: &PushReport) -> Vec<Block> {
    distinct(&report.rows, |r| &r.set)
        .into_iter()
        .map(|set| {
            let rows: Vec<&PushRow> = report.rows.iter().filter(|r| r.set == set).collect();
            Block::Table(table(set, &rows))
        })
        .collect()
}

fn table(set: &str, rows: &[&PushRow]) -> Table {
    let lowest =
        |title: &str, unit: &str, decimals| Column::number(title, unit).decimals(decimals).best(Best::Lowest);
    let row = |r: &&PushRow| {
        let percent = |v: Option<f64>| Cell::number(v.map(|v| v * 100.0));
        let mut cells = vec![Cell::text(&r.model), Cell::number(Some(r.train_pushes as f64))];
        let numbers = [r.trans_percent, r.moved_percent, r.pos_mm, r.rot_deg, r.crps_mm, r.crps_deg];
        cells.extend(numbers.map(|v| Cell::number(Some(v))));
        cells.extend([percent(r.coverage50), percent(r.coverage90)]);
        Row { cells, compare: Some(set.to_owned()), strong: false }
    };
    Table {
        caption: format!("Forecasts, {set}"),
        columns: vec![
            Column::text("model"),
            Column::number("trained on", "pushes").decimals(0),
            lowest("translation", "%", 2),
            lowest("of the way moved", "%", 1),
            lowest("position", "mm", 2),
            lowest("rotation", "°", 2),
            lowest("CRPS position", "mm", 2),
            lowest("CRPS rotation", "°", 2),
            Column::number("50 % band holds", "%").decimals(1).best(Best::Nearest(50.0)),
            Column::number("90 % band holds", "%").decimals(1).best(Best::Nearest(90.0)),
        ],
        rows: rows.iter().map(row).collect(),
        footnotes: vec![
            "The model sees the first pose and the rod's path. Errors of the mean of 100 samples, averaged over the samples of a push and then over pushes. Translation divides by the distance from the robot's base, as the published tables do; the next column by the distance from the first position.".to_owned(),
        ],
    }
}

fn curves(report: &PushReport, tone: &dyn Fn(&str) -> Tone) -> Vec<Block> {
    if report.curve.iter().all(|c| c.train_pushes.len() < 2) {
        return Vec::new();
    }
    let figure = |title: &str, unit: &str, get: &dyn Fn(&super::PushCurve) -> Vec<f64>| {
        let mut line =
            Line::new(title, Axis::log("training pushes", ""), Axis::linear("error", unit).with_zero());
        for c in &report.curve {
            let series = Series::line(&c.model, tone(&c.model), c.train_pushes.clone(), get(c));
            line = line.with(series.with_mark(Mark::LinePoints));
        }
        Figure::from(line)
    };
    let figures = vec![
        figure("Position", "mm", &|c| c.pos_mm.clone()),
        figure("Rotation", "°", &|c| c.rot_deg.clone()),
    ];
    let caption = "Error on the test pushes against the number of training pushes.".to_owned();
    vec![Block::Grid(Grid { columns: Columns::Two, legend: Vec::new(), figures, caption })]
}

fn over_push(report: &PushReport, tone: &dyn Fn(&str) -> Tone) -> Vec<Block> {
    if report.over_push.is_empty() {
        return Vec::new();
    }
    let y = Axis::linear("position error", "mm").with_zero();
    let mut line = Line::new("Position error over the push", Axis::linear("part of the duration", ""), y);
    for o in &report.over_push {
        let n = o.pos_mm.len() as f64;
        let x = (0..o.pos_mm.len()).map(|i| (i as f64 + 0.5) / n).collect();
        line = line.with(Series::line(&o.model, tone(&o.model), x, o.pos_mm.clone()));
    }
    let caption = "Mean over the test pushes; the rod rests during the last quarter of a second.".to_owned();
    vec![Block::Figure(Box::new(FigureBlock { figure: line.into(), caption }))]
}

fn clouds(report: &PushReport) -> Vec<Block> {
    let Some(truth) = report.clouds.first() else { return Vec::new() };
    let cloud =
        |c: &PushCloud, tone| Cloud { name: c.name.clone(), tone, x: c.x_mm.clone(), y: c.y_mm.clone() };
    // Each model over the truth, on one range.
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
    let row = |c: &PushCloud| {
        let cells = vec![
            Cell::text(&c.name),
            Cell::number(c.chamfer_mm),
            Cell::number(c.over_floor),
            Cell::number(c.energy_mm),
        ];
        // The truth against itself is no competitor.
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
            "The floor is the Chamfer distance of a second, independent set of truths. It hardly sees a shift; the energy distance does, and is zero on average for two sets of one law.".to_owned(),
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

fn parameters(report: &PushReport) -> Vec<Block> {
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
        footnotes: vec!["Intervals take each run as one observation.".to_owned()],
    })]
}

fn reproduce(report: &PushReport) -> Vec<Block> {
    if report.reproduce.is_empty() {
        return Vec::new();
    }
    vec![Block::Code { caption: String::new(), text: report.reproduce.join("\n") }]
}
