//! Contract: figures of valid, missing, constant and extreme data are valid XML without NaN, without
//! overlapping or cut text, with units on the axes, deterministic and escaped. Small figures are also
//! compared with snapshots, so that a review shows every change.

use crate::common::{self, check_svg};
use augsim_report::figure::*;
use std::path::Path;

fn tone(i: u8) -> Tone {
    Tone::Series(i)
}

fn wave(n: u32, scale: f64) -> (Vec<f64>, Vec<f64>) {
    let x: Vec<f64> = (0..n).map(|i| f64::from(i) * 0.1).collect();
    let y = x.iter().map(|x| scale * x.sin()).collect();
    (x, y)
}

/// Bar chart of two groups, with an interval and a reference line.
fn bars(y: &[f64], name: &str) -> Bars {
    let bar = |name: &str, i, value, interval| Bar { name: name.into(), tone: tone(i), value, interval };
    let group = |label: &str, bar| BarGroup { label: label.into(), bars: vec![bar] };
    Bars {
        title: name.into(),
        value: Axis::linear("height", "m"),
        groups: vec![
            group(name, bar("before", 1, y.last().copied(), Some([0.0, 1.0]))),
            group("second", bar("after", 0, y.first().copied(), None)),
        ],
        references: vec![Reference { value: 0.5, label: "noise floor".into() }],
        shape: BarShape::Bar,
    }
}

/// The chart of [`bars`] with dots, on an axis without zero.
fn dots(y: &[f64], name: &str) -> Bars {
    Bars { value: Axis::log("height", "m"), references: Vec::new(), shape: BarShape::Dot, ..bars(y, name) }
}

/// One figure of each kind from the same horizontal and vertical values.
fn all(x: &[f64], y: &[f64], name: &str) -> Vec<Figure> {
    let shifted = |by: f64| y.iter().map(|v| v + by).collect::<Vec<f64>>();
    let (title, x_axis, y_axis) = (name.to_owned(), Axis::linear("time", "s"), Axis::linear("height", "m"));
    let banded =
        Series::line(name, tone(0), x.to_vec(), y.to_vec()).with_band(0.9, shifted(-1.0), shifted(1.0));
    let dotted = Series::line("other", tone(1), x.to_vec(), shifted(0.5)).with_mark(Mark::LinePoints);
    let mut line = Line::new(name, x_axis.clone(), y_axis.clone()).with(banded).with(dotted);
    line.references.push(Reference { value: 0.2, label: "noise floor".into() });
    line.events.push(Event { at: 1.0, label: "impact".into() });
    let log = Line::new(name, x_axis.clone(), Axis::log("loss", "nats")).with(Series::line(
        "a",
        tone(0),
        x.to_vec(),
        y.to_vec(),
    ));
    let fan = Fan {
        title: title.clone(),
        x: x_axis.clone(),
        y: y_axis.clone(),
        t: x.to_vec(),
        median: y.to_vec(),
        lower50: shifted(-0.2),
        upper50: shifted(0.2),
        lower90: shifted(-0.5),
        upper90: shifted(0.5),
        truth: shifted(0.1),
        ..Fan::default()
    };
    let cloud =
        |i: u8| Cloud { name: format!("{name} {i}"), tone: tone(i), x: x.to_vec(), y: shifted(f64::from(i)) };
    let clouds = (0..3).map(cloud).collect();
    let scatter =
        Scatter { title: title.clone(), x: x_axis, y: y_axis.clone(), clouds, ..Scatter::default() };
    let sample = |name: &str, i, values| HistogramSample { name: name.into(), tone: tone(i), values };
    let samples = vec![sample(name, 0, y.to_vec()), sample("other", 1, shifted(1.0))];
    let quantiles =
        QuantileSeries { name: title.clone(), tone: tone(0), normal: y.to_vec(), sample: shifted(0.1) };
    let correlogram = Correlogram { name: title.clone(), tone: tone(0), lag: x.to_vec(), value: y.to_vec() };
    vec![
        line.into(),
        log.into(),
        fan.into(),
        scatter.into(),
        bars(y, name).into(),
        Histogram { title: title.clone(), x: y_axis, samples }.into(),
        Quantile { title: title.clone(), series: vec![quantiles] }.into(),
        Autocorrelation {
            title: title.clone(),
            lag_unit: "samples".into(),
            white95: Some(0.06),
            series: vec![correlogram],
        }
        .into(),
        Heatmap {
            title,
            names: vec![name.into(), "k_per_m".into(), "restitution".into()],
            values: vec![vec![], y.iter().map(|v| Some(*v)).collect(), vec![None, y.first().copied()]],
        }
        .into(),
        dots(y, name).into(),
    ]
}

#[test]
fn every_figure_passes_the_checks_for_any_data_and_width() {
    let (x, y) = wave(80, 2.0);
    let cases: Vec<(Vec<f64>, Vec<f64>)> = vec![
        (x.clone(), y.clone()),
        (vec![], vec![]),
        (vec![1.0], vec![2.0]),
        (vec![1.0, 2.0, 3.0], vec![f64::NAN; 3]),
        (vec![f64::NAN; 3], vec![1.0, 2.0, 3.0]),
        (vec![0.0; 4], vec![0.0; 4]),
        (vec![1.0, 2.0, 3.0], vec![1.0, f64::INFINITY, -2.0]),
        (vec![0.0, 1.0], vec![1e300, -1e300]),
        (vec![0.0, 1e-9], vec![3e-7, 4e-7]),
        (vec![1e7, 2e7], vec![-1e12, 1e12]),
        (x.iter().map(|v| v * 1e5).collect(), y.iter().map(|v| v * 1e-8).collect()),
        (x, vec![5.0, 6.0]),
    ];
    for (x, y) in &cases {
        for name in ["ball", "", "a rather long name of a series that has to be cut or wrapped somewhere"] {
            for figure in all(x, y, name) {
                for width in [240.0, 336.0, 360.0, 500.0, 960.0] {
                    check_svg(&figure.svg_document(width));
                }
            }
        }
    }
}

#[test]
fn figures_without_data_say_no_data() {
    for figure in all(&[], &[], "Height") {
        let svg = figure.svg_document(360.0);
        let is_heatmap = matches!(figure, Figure::Heatmap(_));
        assert!(is_heatmap || svg.contains("no data: "), "{svg}");
    }
}

#[test]
fn axis_labels_have_units() {
    let (x, y) = wave(20, 1.0);
    for figure in all(&x, &y, "Height") {
        let svg = figure.svg_document(500.0);
        let unit = match figure {
            Figure::Heatmap(_) => "",
            Figure::Quantile(_) => "(sd)",
            Figure::Autocorrelation(_) => "(samples)",
            Figure::Histogram(_) => "density (1/m)",
            Figure::Line(ref line) if line.y.scale == Scale::Log => "loss (nats)",
            _ => "height (m)",
        };
        assert!(svg.contains(unit), "{unit} is missing in {svg}");
    }
}

#[test]
fn text_is_escaped_everywhere() {
    let (x, y) = wave(20, 1.0);
    for figure in all(&x, &y, "<b>&\"'") {
        let svg = figure.svg_document(500.0);
        check_svg(&svg);
        assert!(!svg.contains("<b>") && svg.contains("&lt;b&gt;&amp;"), "{svg}");
    }
}

#[test]
fn figures_are_deterministic_and_survive_json() {
    let (x, mut y) = wave(30, 1.0);
    y[3] = f64::NAN;
    for figure in all(&x, &y, "Height") {
        let json = serde_json::to_string(&figure).expect("figures serialise");
        let back: Figure = serde_json::from_str(&json).expect("and come back, missing values included");
        assert!(figure.svg_document(400.0) == back.svg_document(400.0), "{json}");
    }
}

#[test]
fn marks_outside_the_domain_have_bounded_coordinates() {
    let axis = Axis::linear("height", "m").with_domain(0.0, 1.0);
    let series = Series::line("ball", tone(0), vec![0.0, 1.0], vec![0.5, 1e12]);
    let svg =
        Figure::from(Line::new("Height", Axis::linear("time", "s"), axis).with(series)).svg_document(360.0);
    check_svg(&svg);
    let d = svg.split("class=\"ln k0\" d=\"").last().and_then(|s| s.split('"').next()).expect("a line");
    assert!(common::numbers(d).iter().all(|v| v.abs() < 2000.0), "{d}");
}

#[test]
fn small_figures_equal_their_snapshots() {
    let (x, y) = ([0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 0.5, 0.8]);
    let kinds = [
        "line",
        "log",
        "fan",
        "scatter",
        "bars",
        "histogram",
        "quantile",
        "autocorrelation",
        "heatmap",
        "dots",
    ];
    for (figure, kind) in all(&x, &y, "Small").into_iter().zip(kinds) {
        // The style is the same in all figures and is tested elsewhere, so it is left out of the snapshots.
        let svg = figure.svg_document(320.0);
        let (head, after_head) = svg.split_once("<style>").expect("a document has a style");
        let body = after_head.split_once("</style>").expect("closed").1;
        let drawn = format!("{head}{body}\n").replace("><", ">\n<");
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/it/snapshots/{kind}.svg"));
        if std::env::var_os("AUGSIM_RENEW").is_some() {
            std::fs::write(&path, &drawn).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        }
        let reviewed = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let difference = reviewed.lines().zip(drawn.lines()).find(|(old, new)| old != new);
        assert!(
            reviewed == drawn,
            "{} differs, first in {difference:?}; if this is intended, renew it with AUGSIM_RENEW=1 and review it",
            path.display()
        );
    }
}
