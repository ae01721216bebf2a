//! Rows of the tables: scores of models under a protocol on a test set.

use super::layout::{ColumnFormat, Layout, Value};
use augsim_report::benchmark::{self, ResultRow, Results};
use augsim_trainer::Protocol;
use augsim_trainer::score::Score;
use serde::{Serialize, Serializer};

/// Numbers with names, in the order of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Numbers(pub Vec<(&'static str, f64)>);

impl Serialize for Numbers {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().copied())
    }
}

impl Numbers {
    fn get(&self, name: &str) -> Option<f64> {
        self.0.iter().find(|(n, _)| *n == name).map(|(_, v)| *v)
    }

    fn value(&self, value: Value) -> Option<f64> {
        if let Value::Key(name) = value { self.get(name) } else { None }
    }
}

/// Test set of a row, named if there are several test sets.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tested {
    /// Name of the surface on which the object slides.
    pub surface: String,
    /// Name of the pushed object.
    pub object: String,
    /// One of `test`, `unseen surface`, `unseen object`, `test runs`, `test runs without knocks`.
    pub split: &'static str,
    /// Number of training trajectories or windows.
    pub train_pushes: usize,
    /// Number of test trajectories or windows.
    pub test_pushes: usize,
}

/// Scores of one model under one protocol.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// Name of the source of the trajectories; `None` for ball drops.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub data: Option<&'static str>,
    /// Name of the model.
    pub model: String,
    /// Protocol under which the model was scored (forecast, reconstruction or lower bound).
    pub protocol: Protocol,
    /// Test set of the row; `None` if there is only one.
    #[serde(flatten)]
    pub tested: Option<Tested>,
    /// Name of the point estimate that is computed from samples.
    pub estimate: &'static str,
    /// Errors of the point estimate that `estimate` names.
    #[serde(flatten)]
    pub errors: Numbers,
    /// Errors of a second point estimate, if the model draws samples.
    #[serde(flatten)]
    pub second: Option<Second>,
    /// Continuous ranked probability score of each measured quantity.
    #[serde(flatten)]
    pub crps: Numbers,
    /// Coverage of the 50 % prediction band, as a fraction; `None` for a model without samples.
    pub coverage50: Option<f64>,
    /// Coverage of the 90 % prediction band, as a fraction; `None` for a model without samples.
    pub coverage90: Option<f64>,
    #[serde(skip)]
    layout: &'static Layout,
}

/// Name and errors of a second point estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Second(&'static str, Numbers);

impl Serialize for Second {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map([(self.0, &self.1)])
    }
}

impl Row {
    /// Makes the row of a model with the score `s`.
    pub fn new(layout: &'static Layout, model: &str, protocol: Protocol, s: &Score) -> Self {
        let sampled = s.coverage50.is_some();
        let (second, _, estimate) = layout.second;
        let crps = layout.crps.iter().map(|(name, measure, factor)| (*name, factor * s.crps[*measure]));
        Row {
            data: None,
            model: model.to_owned(),
            protocol,
            tested: None,
            estimate: if sampled { layout.estimate.0 } else { "single" },
            errors: Numbers(layout.numbers((layout.estimate.1)(s))),
            second: sampled.then(|| Second(second, Numbers(layout.numbers(estimate(s))))),
            crps: Numbers(crps.collect()),
            coverage50: s.coverage50,
            coverage90: s.coverage90,
            layout,
        }
    }

    /// Makes the row of the lowest possible errors: of the median given the first state, without samples.
    pub fn floor(layout: &'static Layout, errors: [f64; 3], crps: [f64; 2]) -> Self {
        Row {
            data: None,
            model: "Floor".to_owned(),
            protocol: Protocol::Floor,
            tested: None,
            estimate: "median of the law",
            errors: Numbers(layout.errors.iter().map(|(name, _)| *name).zip(errors).collect()),
            second: None,
            crps: Numbers(layout.crps.iter().map(|(name, ..)| *name).zip(crps).collect()),
            coverage50: None,
            coverage90: None,
            layout,
        }
    }

    /// Returns the error or CRPS with this name; NaN if there is none.
    pub fn number(&self, name: &str) -> f64 {
        self.errors.get(name).or(self.crps.get(name)).unwrap_or(f64::NAN)
    }

    /// Returns the value of a table column; `None` if the row has none.
    fn value(&self, value: Value) -> Option<f64> {
        match value {
            Value::Trained => self.tested.as_ref().map(|t| t.train_pushes as f64),
            Value::Key(_) => self.errors.value(value).or(self.crps.value(value)),
            Value::Inside50 => self.coverage50.map(|v| 100.0 * v),
            Value::Inside90 => self.coverage90.map(|v| 100.0 * v),
        }
    }

    /// Returns name and errors of the second point estimate if tables show it.
    fn second_in_tables(&self) -> Option<(&'static str, &Numbers)> {
        let second = self.second.as_ref().filter(|_| self.layout.names_estimates());
        second.map(|s| (self.layout.second.1, &s.1))
    }

    /// Describes the test set of the row; `None` if there is only one.
    pub fn set(&self) -> Option<String> {
        let Tested { split, object, surface, test_pushes, .. } = self.tested.as_ref()?;
        let (data, many) = (self.data.unwrap_or_default(), self.layout.words[1]);
        Some(format!("{split}: {object} on {surface}, {test_pushes} {many}, {data}"))
    }

    fn heading(&self) -> String {
        self.set().unwrap_or_else(|| {
            let explanation = match self.protocol {
                Protocol::Forecast => self.layout.sees,
                Protocol::Reconstruction => "the encoder uses the whole trajectory: not a prediction",
                Protocol::Floor => {
                    "estimate of the lowest error from the first state, by simulation of the generating model"
                }
            };
            format!("{} ({explanation})", self.protocol.label())
        })
    }
}

/// Formats the rows as text, one block per test set and protocol, because these are not comparable.
pub fn table(rows: &[Row]) -> String {
    let Some(layout) = rows.first().map(|r| r.layout) else { return String::new() };
    let width = rows.iter().map(|r| r.model.chars().count()).max().unwrap_or(0).max(layout.width);
    let shown: Vec<&ColumnFormat> = (layout.shown.iter())
        // An evaluated run does not contain the size of its training set.
        .filter(|c| !matches!(c.value, Value::Trained) || rows.iter().any(|r| r.tested.is_some()))
        .collect();
    let line = |model: &str, estimate: &str, cells: Vec<String>| {
        let estimate = if layout.names_estimates() { format!(" {estimate:<18}") } else { String::new() };
        let cells: String =
            cells.iter().zip(&shown).map(|(cell, c)| format!(" {cell:>0$}", c.text.1)).collect();
        format!("  {model:<width$}{estimate}{cells}\n")
    };
    let number = |c: &ColumnFormat, v: Option<f64>| v.map(|v| format!("{v:.0$}", c.text.2));
    let (mut out, mut block) = (String::new(), String::new());
    for r in rows {
        if r.heading() != block {
            block = r.heading();
            let heads = shown.iter().map(|c| c.text.0.to_owned()).collect();
            out += if out.is_empty() { "" } else { "\n" };
            out += &format!("{block}\n{}", line("model", "estimate", heads));
        }
        let cell = |c: &&ColumnFormat| number(c, r.value(c.value)).unwrap_or_else(|| "-".to_owned());
        out += &line(&r.model, r.estimate, shown.iter().map(cell).collect());
        if let Some((name, second)) = r.second_in_tables() {
            let cells = shown.iter().map_while(|c| number(c, second.value(c.value)));
            out += &line("", name, cells.collect());
        }
    }
    out
}

/// Makes the tables of a page, one per test set; `caption` is used if there is only one.
pub fn results(rows: &[Row], caption: &str) -> Vec<Results> {
    let mut sets: Vec<(Option<String>, Results)> = Vec::new();
    for r in rows {
        let layout = r.layout;
        if sets.last().is_none_or(|(set, _)| *set != r.set()) {
            let results = Results {
                caption: r.set().map_or(caption.to_owned(), |set| format!("Forecasts, {set}")),
                columns: layout.shown.iter().map(ColumnFormat::column).collect(),
                rows: Vec::new(),
                footnotes: layout.footnotes.iter().map(|f| (*f).to_owned()).collect(),
            };
            sets.push((r.set(), results));
        }
        let row = |estimator: &str, value: &dyn Fn(Value) -> Option<f64>| ResultRow {
            model: r.model.clone(),
            protocol: match r.protocol {
                Protocol::Forecast => benchmark::Protocol::Forecast,
                Protocol::Reconstruction => benchmark::Protocol::Reconstruction,
                Protocol::Floor => benchmark::Protocol::Floor,
            },
            estimator: if layout.names_estimates() { estimator.to_owned() } else { String::new() },
            values: layout.shown.iter().map(|c| value(c.value)).collect(),
        };
        if let Some((_, results)) = sets.last_mut() {
            results.rows.push(row(r.estimate, &|v| r.value(v)));
            results.rows.extend(r.second_in_tables().map(|(name, second)| row(name, &|v| second.value(v))));
        }
    }
    sets.into_iter().map(|(_, results)| results).collect()
}
