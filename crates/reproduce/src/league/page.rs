//! Report page of the league: a table for each test set, and a dot plot for each column of the first
//! set.

use super::measures::{Key, keys};
use super::result::{League, ResultFile};
use super::rows::Row as Result;
use super::table::scenario_of;
use crate::reproduction::{how_to_reproduce, provenance};
use augsim_report::figure::{Axis, Bar, BarGroup, BarShape, Bars, Figure, Line, Series, Tone};
use augsim_report::page::{Best, Block, Cell, Column, Columns, Grid, Method, Page, Row, Section, Table};

/// Makes the report page of the league.
pub fn page(result: &ResultFile) -> Page {
    let mut sections: Vec<Section> = result.leagues.iter().map(section).collect();
    sections.push(Section::new("Methods", vec![Block::Methods(methods())]));
    sections.push(how_to_reproduce(&result.command));
    let firsts = result.leagues.iter().filter_map(|l| l.verdicts.first().map(|v| v.sentence.clone()));
    Page {
        overline: "league of model classes".to_owned(),
        title: "Every model class under one protocol".to_owned(),
        summary: firsts.collect::<Vec<_>>().join(" "),
        sections,
        provenance: provenance(result.seed, None),
        ..Default::default()
    }
}

fn section(league: &League) -> Section {
    let keys = keys(scenario_of(league));
    let mut blocks = vec![Block::Prose(format!(
        "{} training trajectories, {} iterations of every net; {} settings of each class tried on the last fifth of the training \
         data; median of {} seeds. A forecast uses only the first state and the actions. Processor times are in \
         `timing.json`.",
        league.training, league.iterations, league.settings_tried, league.seeds
    ))];
    blocks.push(Block::List(league.verdicts.iter().map(|v| v.sentence.clone()).collect()));
    blocks.extend(league.sets.iter().map(|set| Block::Table(table(league, set, keys))));
    let first: Vec<&Result> = league.rows.iter().filter(|r| league.sets.first() == Some(&r.set)).collect();
    blocks.push(Block::Grid(Grid {
        columns: Columns::Two,
        legend: Vec::new(),
        figures: keys.iter().map(|key| dots(&first, key)).collect(),
        caption: "Dots are medians over seeds, lines reach from the least to the largest; of the deciding score the bootstrap \
                  interval over trajectories."
            .to_owned(),
    }));
    if !league.sizes.is_empty() {
        let drawn = |key: &&Key| ["pos_mm", "rot_deg", "crps_mm", "crps_deg"].contains(&key.name);
        blocks.push(Block::Grid(Grid {
            columns: Columns::Two,
            legend: Vec::new(),
            figures: keys.iter().filter(drawn).map(|key| curve(league, key)).collect(),
            caption: "The five best classes trained on fewer and on more trajectories, with the settings of the table, on its first \
                      test set."
                .to_owned(),
        }));
    }
    let title = if league.scenario == "ball" { "The bouncing ball" } else { "Planar pushing" };
    Section::new(title, blocks)
}

fn table(league: &League, set: &str, keys: &[Key]) -> Table {
    let mut columns = vec![Column::text("model")];
    columns.extend(keys.iter().map(|k| Column::number(k.title, k.unit).decimals(k.decimals).best(k.best)));
    columns.push(Column::number("parameters", "").decimals(0));
    columns.push(Column::number("trained on", "").decimals(0));
    let row = |r: &Result| {
        let mut cells = vec![Cell::text(r.model.as_str())];
        cells.extend(keys.iter().map(|k| Cell::number(r.figures.get(k.name).map(|f| f.median))));
        cells.extend([r.parameters, r.trained_on].map(|n| Cell::number(n.map(|n| n as f64))));
        let aside = ["(the data)", "Exact law"].contains(&r.model.as_str());
        Row { cells, compare: (!aside).then(|| "league".to_owned()), strong: r.model == "Hybrid+" }
    };
    Table {
        caption: format!("{}: {set}.", league.scenario),
        columns,
        rows: league.rows.iter().filter(|r| r.set == set).map(row).collect(),
        footnotes: vec![
            "Bold: best of the column (of bands: nearest to the nominal coverage). Row \u{201c}(the data)\u{201d}: what measured \
             trajectories themselves violate, by the noise of sensors."
                .to_owned(),
        ],
    }
}

/// Makes the figure of column `key` over the number of training trajectories, with a line per model.
fn curve(league: &League, key: &Key) -> Figure {
    let x = Axis::log("training trajectories", "");
    let mut line = Line::new(&format!("{} ({})", key.title, key.unit), x, Axis::log(key.title, key.unit));
    for (tone, model) in (0..).zip(league.sized_models()) {
        let points = league.sizes.iter().filter(|r| r.model == model);
        let point = |r: &Result| Some((r.trained_on? as f64, r.figures.get(key.name)?.median));
        let (x, y) = points.filter_map(point).unzip();
        line = line.with(Series::line(model, Tone::Series(tone), x, y));
    }
    Figure::from(line)
}

/// Makes a figure of column `key` with a dot and an interval for each model.
fn dots(rows: &[&Result], key: &Key) -> Figure {
    let bar = |r: &&Result| {
        let figure = r.figures.get(key.name)?;
        let interval = r.crps_ci95.filter(|_| key.decides());
        Some(Bar {
            name: r.model.clone(),
            tone: if r.model == "Hybrid+" { Tone::Series(0) } else { Tone::Ink },
            value: Some(figure.median),
            interval: interval.or(Some([figure.min, figure.max])),
        })
    };
    let bars: Vec<Bar> = rows.iter().filter_map(bar).collect();
    // On a linear axis a diverging model would hide the differences between the others.
    let is_positive = bars.iter().all(|b| b.value.is_some_and(|v| v > 0.0));
    let is_share = matches!(key.best, Best::Nearest(_));
    let axis = if is_positive && !is_share {
        Axis::log(key.title, key.unit)
    } else {
        Axis::linear(key.title, key.unit)
    };
    Figure::from(Bars {
        title: format!("{} ({})", key.title, key.unit),
        value: axis,
        groups: vec![BarGroup { label: String::new(), bars }],
        references: Vec::new(),
        shape: BarShape::Dot,
    })
}

fn methods() -> Vec<Method> {
    let method = |(name, purpose, reference): &(&str, &str, &str)| Method {
        name: (*name).to_owned(),
        purpose: (*purpose).to_owned(),
        reference: (*reference).to_owned(),
    };
    METHODS.iter().map(method).collect()
}

const METHODS: [(&str, &str, &str); 10] = [
    (
        "Decoupled conditional VRNN",
        "Neural and Hybrid",
        "Ajay, Wu, Fazeli, Bauza, Kaelbling, Tenenbaum, Rodriguez: Augmenting Physical Simulators with Stochastic Neural \
         Networks, IROS 2018",
    ),
    (
        "Variational recurrent net",
        "VRNN and CVRNN",
        "Chung, Kastner, Dinh, Goel, Courville, Bengio: A Recurrent Latent Variable Model for Sequential Data, NeurIPS 2015",
    ),
    (
        "PETS",
        "ensembles",
        "Chua, Calandra, McAllister, Levine: Deep Reinforcement Learning in a Handful of Trials using Probabilistic Dynamics \
         Models, NeurIPS 2018",
    ),
    (
        "Learned inputs of the contact model",
        "Kloss and Kloss+error",
        "Kloss, Schaal, Bohg: Combining Learned and Analytical Models for Predicting Action Effects, arXiv:1710.04102, 2017",
    ),
    (
        "Gaussian process of the residual",
        "GP residual and its mean",
        "Fazeli, Zapolsky, Drumwright, Rodriguez: Learning Data-Efficient Rigid-Body Contact Models: Case Study of Planar \
         Impact, CoRL 2017",
    ),
    (
        "Convex fourth-order force-motion model",
        "Zhou and Zhou drawn",
        "Zhou, Paolini, Bagnell, Mason: A Convex Polynomial Force-Motion Model for Planar Sliding, ICRA 2016; Zhou, Bagnell, \
         Mason: A Fast Stochastic Contact Model for Planar Pushing and Grasping, RSS 2017",
    ),
    (
        "SE3-Nets",
        "points that flow with rigid bodies",
        "Byravan, Fox: SE3-Nets: Learning Rigid Body Motion using Deep Neural Networks, ICRA 2017",
    ),
    ("Mixture density network", "MDN residual", "Bishop: Mixture Density Networks, Aston University 1994"),
    (
        "Bootstrap over trajectories",
        "intervals and verdicts",
        "Efron, Tibshirani: An Introduction to the Bootstrap, Chapman & Hall 1993",
    ),
    (
        "Continuous ranked probability score",
        "the deciding score",
        "Gneiting, Raftery: Strictly Proper Scoring Rules, Prediction, and Estimation, JASA 2007",
    ),
];
