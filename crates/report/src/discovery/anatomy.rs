//! Figures of the residual before and after, and of laws.

use super::tones::{AFTER, BEFORE};
use super::{Anatomy, Bins, LawCurve, Profile, Rmse};
use crate::figure::{
    Autocorrelation, Axis, Bar, BarGroup, BarShape, Bars, Correlogram, Figure, Line, Mark, Quantile,
    QuantileSeries, Series, Tone,
};
use crate::page::{Block, Columns, Grid};
use crate::plot::text::capitalised;

const BEFORE_NAME: &str = "before";
const AFTER_NAME: &str = "after";
/// Quantities that are counted, and have no halves.
const COUNTED: [&str; 1] = ["bounce"];

pub(super) fn residual(anatomy: &Anatomy) -> Vec<Block> {
    let mut figures: Vec<Figure> = anatomy.profiles.iter().map(|p| profile(p).into()).collect();
    if !anatomy.contact.is_empty() {
        let bar = |name: &str, tone: Tone, rmse: Option<Rmse>| {
            rmse.map(|r| Bar { name: name.to_owned(), tone, value: Some(r.rmse), interval: r.ci95 })
        };
        let group = |label: &str, before, after| BarGroup {
            label: label.to_owned(),
            bars: [bar(BEFORE_NAME, BEFORE, before), bar(AFTER_NAME, AFTER, after)]
                .into_iter()
                .flatten()
                .collect(),
        };
        figures.push(Figure::from(Bars {
            title: "Size of the residual by contact".to_owned(),
            value: Axis::linear("root mean square residual", &anatomy.contact_unit),
            groups: anatomy.contact.iter().map(|c| group(&c.label, c.before, c.after)).collect(),
            references: Vec::new(),
            shape: BarShape::Bar,
        }));
    }
    if let Some(a) = &anatomy.autocorrelation {
        let of = |name: &str, tone, value: &[f64]| Correlogram {
            name: name.to_owned(),
            tone,
            lag: a.lag.clone(),
            value: value.to_vec(),
        };
        figures.push(Figure::from(Autocorrelation {
            title: "Autocorrelation of the whitened residual".to_owned(),
            lag_unit: a.lag_unit.clone(),
            white95: a.white95,
            series: vec![of(BEFORE_NAME, BEFORE, &a.before), of(AFTER_NAME, AFTER, &a.after)],
        }));
    }
    if let Some(q) = &anatomy.quantiles {
        let of = |name: &str, tone, sample: &[f64]| QuantileSeries {
            name: name.to_owned(),
            tone,
            normal: q.normal.clone(),
            sample: sample.to_vec(),
        };
        figures.push(Figure::from(Quantile {
            title: "Quantiles of the whitened residual".to_owned(),
            series: vec![of(BEFORE_NAME, BEFORE, &q.before), of(AFTER_NAME, AFTER, &q.after)],
        }));
    }
    if figures.is_empty() {
        return Vec::new();
    }
    vec![
        Block::Prose("What the calibrated model leaves (before) and what remains with the effects added (after). A residual that is only noise is zero on average against everything, is not correlated with itself, and has normal quantiles.".to_owned()),
        Block::Grid(Grid { columns: Columns::Two, legend: Vec::new(), figures, caption: "Bands and whiskers: 95 % intervals.".to_owned() }),
    ]
}

fn profile(p: &Profile) -> Line {
    let series = |name: &str, tone, bins: &Bins| {
        let mut s = Series::line(name, tone, bins.x.clone(), bins.mean.clone()).with_mark(Mark::LinePoints);
        if !bins.lower95.is_empty() {
            s = s.with_band(0.95, bins.lower95.clone(), bins.upper95.clone());
        }
        s
    };
    let mut line = Line::new(
        &format!("Against {}", p.against),
        Axis { integer: COUNTED.contains(&p.against.as_str()), ..Axis::linear(&p.against, &p.against_unit) },
        Axis::linear(&p.residual, &p.unit).with_zero(),
    );
    for (name, tone, bins) in [(BEFORE_NAME, BEFORE, &p.before), (AFTER_NAME, AFTER, &p.after)] {
        if !bins.x.is_empty() {
            line = line.with(series(name, tone, bins));
        }
    }
    line
}

/// Curves of the laws that were added, over the range of the data.
pub(super) fn laws(laws: &[LawCurve]) -> Vec<Block> {
    if laws.is_empty() {
        return Vec::new();
    }
    let figure = |law: &LawCurve| {
        let mut line = Line::new(
            &capitalised(&law.title),
            Axis::linear(&law.of, &law.of_unit),
            Axis::linear(&format!("added to {}", law.adds), &law.unit).with_zero(),
        );
        line.hide_legend = true;
        Figure::from(line.with(Series::line("law", AFTER, law.x.clone(), law.y.clone())))
    };
    vec![Block::Grid(Grid {
        columns: Columns::Two,
        legend: Vec::new(),
        figures: laws.iter().map(figure).collect(),
        caption: "Over the values that occur in the data; outside nothing is known.".to_owned(),
    })]
}
