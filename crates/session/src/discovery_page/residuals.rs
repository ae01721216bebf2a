//! Figures of the residuals before and after, and of the added effects.

use super::{AFTER, BEFORE};
use augsim_discovery::{Bin, Discovery};
use augsim_report::capitalised;
use augsim_report::figure::{
    Autocorrelation, Axis, Correlogram, Figure, Line, Mark, Quantile, QuantileSeries, Series,
};
use augsim_report::page::{Block, Columns, Grid};

/// Standard normal quantiles at the percentiles of residuals in a result: 1, 5, 25, 50, 75, 95, 99 %.
const NORMAL_QUANTILES: [f64; 7] = [-2.326_348, -1.644_854, -0.674_490, 0.0, 0.674_490, 1.644_854, 2.326_348];
const BEFORE_NAME: &str = "before";
const AFTER_NAME: &str = "after";
/// Names of the quantities that take whole numbers only.
const COUNTED: [&str; 1] = ["bounce"];

/// The curve of an added effect over the values that its argument has in the data.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EffectCurve {
    /// Name of the effect.
    pub title: String,
    /// Name of the quantity that the effect changes, e.g. `d(speed)/dt`.
    pub adds: String,
    /// Unit of the value that the effect adds.
    pub unit: String,
    /// Name of the quantity that the effect depends on.
    pub of: String,
    /// Unit of the quantity that the effect depends on.
    pub of_unit: String,
    /// Values of the quantity that the effect depends on.
    pub x: Vec<f64>,
    /// Value that the effect adds at each value in `x`.
    pub y: Vec<f64>,
}

/// Figures of the mean residual over each quantity, of autocorrelation and quantiles, before and after.
pub(super) fn blocks(d: &Discovery) -> Vec<Block> {
    let a = &d.anatomy;
    let none = Vec::new();
    let mut figures: Vec<Figure> = (a.before.iter())
        .map(|(name, before)| profile(name, before, a.after.get(name).unwrap_or(&none)).into())
        .collect();
    let lags: Vec<f64> = (0..a.autocorrelation_before.len()).map(|l| l as f64).collect();
    let correlogram = |name: &str, tone, value: &[f64]| Correlogram {
        name: name.to_owned(),
        tone,
        lag: lags.clone(),
        value: value.to_vec(),
    };
    figures.push(Figure::from(Autocorrelation {
        title: "Autocorrelation of the whitened residual".to_owned(),
        lag_unit: "samples".to_owned(),
        white95: None,
        series: vec![
            correlogram(BEFORE_NAME, BEFORE, &a.autocorrelation_before),
            correlogram(AFTER_NAME, AFTER, &a.autocorrelation_after),
        ],
    }));
    let quantiles = |name: &str, tone, sample: &[f64]| QuantileSeries {
        name: name.to_owned(),
        tone,
        normal: NORMAL_QUANTILES.to_vec(),
        sample: sample.to_vec(),
    };
    figures.push(Figure::from(Quantile {
        title: "Quantiles of the whitened residual".to_owned(),
        series: vec![
            quantiles(BEFORE_NAME, BEFORE, &a.quantiles_before),
            quantiles(AFTER_NAME, AFTER, &a.quantiles_after),
        ],
    }));
    vec![
        Block::Prose("Residual of the calibrated model (before) and with the effects added (after). A residual that is pure noise has mean zero over every quantity, no autocorrelation, and normal quantiles.".to_owned()),
        Block::Grid(Grid { columns: Columns::Two, legend: Vec::new(), figures, caption: "Bands and whiskers: 95 % intervals.".to_owned() }),
    ]
}

/// Figure of the mean residual in bins of a quantity, before and after effects were added.
fn profile(name: &str, before: &[Bin], after: &[Bin]) -> Line {
    let (quantity, unit) = quantity_of(name);
    let x_axis = Axis { integer: COUNTED.contains(&quantity), ..Axis::linear(quantity, unit) };
    let y_axis = Axis::linear("mean residual", "noise sd").with_zero();
    let mut line = Line::new(&format!("Against {quantity}"), x_axis, y_axis);
    for (name, tone, bins) in [(BEFORE_NAME, BEFORE, before), (AFTER_NAME, AFTER, after)] {
        if !bins.is_empty() {
            let column = |value: fn(&Bin) -> f64| bins.iter().map(value).collect::<Vec<f64>>();
            let series = Series::line(name, tone, column(|b| b.x), column(|b| b.mean));
            let low = column(|b| b.mean - half_interval(b));
            let high = column(|b| b.mean + half_interval(b));
            line = line.with(series.with_mark(Mark::LinePoints).with_band(0.95, low, high));
        }
    }
    line
}

/// Half-width of the 95 % confidence interval of the mean residual in a bin.
fn half_interval(b: &Bin) -> f64 {
    1.96 * (b.rms * b.rms - b.mean * b.mean).max(0.0).sqrt() / (b.count.max(1) as f64).sqrt()
}

/// Display name and unit of the quantity `name`, over whose bins residuals are averaged.
pub(super) fn quantity_of(name: &str) -> (&str, &str) {
    match name {
        "time_s" => ("time", "s"),
        "height_m" | "z_m" => ("height", "m"),
        "x_m" => ("x", "m"),
        "y_m" => ("y", "m"),
        "speed_m_s" => ("speed", "m/s"),
        "heading_rad" => ("heading of the rod", "rad"),
        other => (other, ""),
    }
}

/// Figures of the curves of the added effects over the range of the data.
pub(super) fn laws(laws: &[EffectCurve]) -> Vec<Block> {
    if laws.is_empty() {
        return Vec::new();
    }
    let figure = |law: &EffectCurve| {
        let mut line = Line::new(
            &capitalised(&law.title),
            Axis::linear(&law.of, &law.of_unit),
            Axis::linear(&format!("added to {}", law.adds), &law.unit).with_zero(),
        );
        line.hide_legend = true;
        Figure::from(line.with(Series::line("effect", AFTER, law.x.clone(), law.y.clone())))
    };
    vec![Block::Grid(Grid {
        columns: Columns::Two,
        legend: Vec::new(),
        figures: laws.iter().map(figure).collect(),
        caption: "Over the range of the data; nothing is known outside it.".to_owned(),
    })]
}
