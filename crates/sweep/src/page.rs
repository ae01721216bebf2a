//! Report page of a collected sweep.

use super::collected::Collected;
use super::curves::{Curve, Series as CurveSeries};
use super::row::{Row as TaskRow, State};
use augsim_report::figure::{Axis, Bar, BarGroup, BarShape, Bars, Figure, Line, Mark, Series, Tone};
use augsim_report::page::{
    Block, Cell, Column, Columns, DataSource, Grid, KeyFigure, Method, Page, Provenance, Row, Section, Table,
};

/// Maximum number of scores for which the page has figures. The table has all scores.
const MAX_DRAWN_SCORES: usize = 6;
/// Maximum number of tasks that the page lists. `table.csv` has all tasks.
const MAX_LISTED_TASKS: usize = 200;
/// Ratio of the largest to the smallest value of a setting from which its axis is logarithmic.
const MIN_LOG_AXIS_RATIO: f64 = 20.0;

/// Makes the report page of the collected results of a sweep.
pub fn page(c: &Collected) -> Page {
    let scores = scores_to_draw(c);
    let curves: Vec<&Curve> = c.curves.iter().filter(|curve| scores.contains(&curve.score)).collect();
    let mut tabled: Vec<Vec<&String>> = Vec::new();
    let mut sections: Vec<Section> = (c.crossed.iter())
        .map(|over| {
            let over_setting: Vec<&Curve> =
                curves.iter().copied().filter(|curve| curve.over == *over).collect();
            let mut blocks = figures(&over_setting);
            // The table over A for each B repeats that over B for each A, so it is shown once.
            let mut settings: Vec<&String> =
                over_setting.iter().flat_map(|c| c.by.iter().chain([&c.over])).collect();
            settings.sort_unstable();
            settings.dedup();
            if !tabled.contains(&settings) {
                blocks.extend(over_setting.iter().map(|curve| Block::Table(table(curve))));
                tabled.push(settings);
            }
            Section::new(&format!("Over {over}"), blocks)
        })
        .collect();
    sections.push(Section::new("Without a result", without_result(c)));
    sections.push(Section::new("Tasks", tasks(c, &scores)));
    sections.push(Section::new("Method", method(c)));
    let n = c.tasks.len();
    let done = c.count(State::Done) + c.count(State::CriterionNotMet);
    let crossed = if c.crossed.is_empty() { "nothing".to_owned() } else { c.crossed.join(", ") };
    let key = |value: String, label: &str, note: String| KeyFigure {
        value,
        unit: String::new(),
        label: label.to_owned(),
        note,
    };
    Page {
        overline: "augsim · sweep".to_owned(),
        title: format!("Sweep of augsim {}", c.command),
        verdict: if done == n { String::new() } else { "partial".to_owned() },
        summary: format!("{done} of {n} tasks have a result; crossed: {crossed}."),
        key_figures: vec![
            key(n.to_string(), "tasks", String::new()),
            key((n - done).to_string(), "without a result", format!("{} failed", c.count(State::Failed))),
        ],
        sections,
        provenance: Provenance {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            data: (c.inputs.iter())
                .map(|(path, hash)| DataSource { path: path.clone(), hash: format!("sha256:{hash}") })
                .collect(),
            ..Provenance::default()
        },
    }
}

/// Returns the names of numeric scores that differ between tasks, at most [`MAX_DRAWN_SCORES`].
fn scores_to_draw(c: &Collected) -> Vec<String> {
    let differs = |score: &&String| {
        let mut values = c.tasks.iter().filter_map(|row| row.number(score));
        let first = values.next();
        values.any(|value| Some(value) != first)
    };
    c.scores.iter().filter(differs).take(MAX_DRAWN_SCORES).cloned().collect()
}

/// Makes the figures of the curves over one setting, one per score.
fn figures(curves: &[&Curve]) -> Vec<Block> {
    let Some(first) = curves.first() else { return Vec::new() };
    let figures = curves.iter().map(|curve| figure(curve)).collect();
    let by = match first.by.as_slice() {
        [] => String::new(),
        by => format!(", for each {}", by.join(" and ")),
    };
    let caption = format!(
        "Mean over the tasks that share the value of {}{by}; the band is the 95 % interval of the mean where there are \
         several.",
        first.over
    );
    vec![Block::Grid(Grid { columns: Columns::Two, legend: Vec::new(), figures, caption })]
}

fn figure(curve: &Curve) -> Figure {
    let numeric = curve.series.iter().flat_map(|s| &s.points).all(|p| p.at.number().is_some());
    if numeric && curve.series.iter().any(|s| s.points.len() > 1) {
        return line(curve);
    }
    let bar = |series: &CurveSeries, tone, name: &str| {
        let point = series.points.iter().find(|p| p.at.to_string() == name);
        Bar {
            name: series.name.clone(),
            tone,
            value: point.map(|p| p.summary.mean),
            interval: point.and_then(|p| p.summary.ci95),
        }
    };
    let mut names: Vec<String> = Vec::new();
    for point in curve.series.iter().flat_map(|s| &s.points) {
        let name = point.at.to_string();
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let alone = curve.series.len() == 1;
    let group = |name: &String| BarGroup {
        label: name.clone(),
        bars: (curve.series.iter().zip(0..)).map(|(s, tone)| bar(s, Tone::Series(tone), name)).collect(),
    };
    let groups = match alone {
        // A single series needs no legend: its bars have the names of the values.
        true => {
            let bars = names
                .iter()
                .flat_map(|name| group(name).bars.into_iter().map(|b| Bar { name: name.clone(), ..b }));
            vec![BarGroup { label: String::new(), bars: bars.collect() }]
        }
        false => names.iter().map(group).collect(),
    };
    Bars {
        title: curve.score.clone(),
        value: Axis::linear(&curve.score, ""),
        groups,
        references: Vec::new(),
        shape: BarShape::Bar,
    }
    .into()
}

fn line(curve: &Curve) -> Figure {
    let at = |s: &CurveSeries| s.points.iter().filter_map(|p| p.at.number()).collect::<Vec<f64>>();
    let all: Vec<f64> = curve.series.iter().flat_map(at).collect();
    let [low, high] = [f64::min, f64::max].map(|f| all.iter().copied().reduce(f).unwrap_or(0.0));
    let x = match low > 0.0 && high / low >= MIN_LOG_AXIS_RATIO && curve.over != "seed" {
        true => Axis::log(&curve.over, ""),
        false => {
            // The margin keeps the intervals of the first and last point inside the frame.
            let margin = 0.04 * (high - low);
            Axis::linear(&curve.over, "").with_domain(low - margin, high + margin)
        }
    };
    let x = if all.iter().all(|v| v.fract() == 0.0) { x.with_integers() } else { x };
    let mut figure = Line::new(&curve.score, x, Axis::linear(&curve.score, ""));
    for (s, tone) in curve.series.iter().zip(0..) {
        let mean: Vec<f64> = s.points.iter().map(|p| p.summary.mean).collect();
        let mut series = Series::line(&s.name, Tone::Series(tone), at(s), mean);
        if s.points.iter().any(|p| p.summary.ci95.is_some()) {
            let end =
                |k: usize| s.points.iter().map(|p| p.summary.ci95.map_or(f64::NAN, |ci| ci[k])).collect();
            series = series.with_band(0.95, end(0), end(1));
        }
        // Points of different seeds are not connected, because seeds have no order.
        let mark = if curve.over == "seed" { Mark::Points } else { Mark::LinePoints };
        figure = figure.with(series.with_mark(mark));
    }
    figure.into()
}

fn table(curve: &Curve) -> Table {
    let mut columns = vec![Column::text(&curve.over)];
    if !curve.by.is_empty() {
        columns.push(Column::text(&curve.by.join(", ")));
    }
    columns.extend([
        Column::number("tasks", "").decimals(0),
        Column::number("mean, 95 % interval", ""),
        Column::number("standard deviation", ""),
        Column::number("smallest", ""),
        Column::number("largest", ""),
    ]);
    let mut rows = Vec::new();
    for series in &curve.series {
        for point in &series.points {
            let s = &point.summary;
            let mut cells = vec![Cell::text(point.at.to_string())];
            if !curve.by.is_empty() {
                cells.push(Cell::text(&series.name));
            }
            cells.extend([
                Cell::number(Some(s.tasks as f64)),
                Cell::estimate(s.mean, s.ci95),
                Cell::number(s.sd),
                Cell::number(Some(s.min)),
                Cell::number(Some(s.max)),
            ]);
            rows.push(Row::from(cells));
        }
    }
    Table { caption: format!("{} over {}", curve.score, curve.over), columns, rows, footnotes: Vec::new() }
}

fn without_result(c: &Collected) -> Vec<Block> {
    let said = |row: &TaskRow| match row.state {
        State::Failed => Some(format!("task {}: {}", row.index, row.error.as_deref().unwrap_or("failed"))),
        State::Missing => Some(format!("task {} was not completed", row.index)),
        State::Done | State::CriterionNotMet => None,
    };
    let items: Vec<String> = c.tasks.iter().filter_map(said).collect();
    if items.is_empty() {
        return Vec::new();
    }
    vec![Block::List(items)]
}

/// Makes the table of tasks with their settings that have several values, and the given scores.
fn tasks(c: &Collected, scores: &[String]) -> Vec<Block> {
    let mut columns = vec![Column::number("task", "").decimals(0)];
    columns.extend(c.crossed.iter().map(|name| Column::text(name)));
    columns.extend(scores.iter().map(|name| Column::number(name, "")));
    let row = |row: &TaskRow| {
        let mut cells = vec![Cell::number(Some(row.index as f64))];
        let setting =
            |name: &String| row.settings.get(name).map_or(Cell::Missing, |v| Cell::text(v.to_string()));
        cells.extend(c.crossed.iter().map(setting));
        cells.extend(scores.iter().map(|name| Cell::number(row.number(name))));
        Row::from(cells)
    };
    let mut footnotes = vec!["All settings and scores are in `table.csv`.".to_owned()];
    if c.tasks.len() > MAX_LISTED_TASKS {
        footnotes.push(format!("The first {MAX_LISTED_TASKS} of {} tasks.", c.tasks.len()));
    }
    let rows = c.tasks.iter().take(MAX_LISTED_TASKS).map(row).collect();
    vec![Block::Table(Table { caption: "One row per task".to_owned(), columns, rows, footnotes })]
}

fn method(c: &Collected) -> Vec<Block> {
    let fixed = c.tasks.first().map_or(Vec::new(), |row| {
        let fixed = row.settings.iter().filter(|(name, _)| !c.crossed.contains(name));
        fixed.map(|(name, value)| (name.clone(), value.to_string())).collect()
    });
    let mut blocks = vec![Block::Methods(vec![Method {
        name: "Interval of a mean".to_owned(),
        purpose: "95 % interval by Student's distribution, each task one observation; tasks of one seed may share data, and \
                  are then less independent than it supposes"
            .to_owned(),
        reference: "Student: The Probable Error of a Mean, Biometrika 1908".to_owned(),
    }])];
    if !fixed.is_empty() {
        blocks.insert(0, Block::Definitions(fixed));
    }
    blocks
}
