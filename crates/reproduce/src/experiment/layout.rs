//! Names of the scores of each kind of system in results, tables and pages.

use augsim_report::page::{Best, Column};
use augsim_trainer::Engine;
use augsim_trainer::score::{PointError, Score};

/// An error of a point estimate, which tables show.
#[derive(Debug, Clone, Copy)]
pub enum Figure {
    /// Position error in % of the distance from the origin; mean over trajectories.
    Trans,
    /// Position error in % of the distance moved; sum of errors over sum of distances of all trajectories.
    Moved,
    /// Mean error of the measured quantity with this index, times a unit factor.
    Error(usize, f64),
    /// Mean error at the last sample of the measured quantity with this index, times a unit factor.
    End(usize, f64),
}

impl Figure {
    fn error(self, e: &PointError) -> f64 {
        match self {
            Figure::Trans => e.trans_percent,
            Figure::Moved => e.moved_percent,
            Figure::Error(measure, factor) => factor * e.absolute[measure],
            Figure::End(measure, factor) => factor * e.end[measure],
        }
    }
}

/// Which value of a model's row a table column shows.
#[derive(Debug, Clone, Copy)]
pub enum Value {
    /// Number of training trajectories of the model.
    Trained,
    /// Error or CRPS (of a row's model) with this name.
    Key(&'static str),
    /// Coverage of the 50 % prediction band in %.
    Inside50,
    /// Coverage of the 90 % prediction band in %.
    Inside90,
}

/// A table column: its value, and its heading and format in text and on a page.
#[derive(Debug)]
pub struct ColumnFormat {
    /// Value that the column shows.
    pub value: Value,
    /// `(heading, width, decimals)` of the column in text tables.
    pub text: (&'static str, usize, usize),
    /// `(title, unit, decimals)` of the column on a page.
    pub page: (&'static str, &'static str, usize),
}

impl ColumnFormat {
    /// Makes the column of the table on a page.
    pub fn column(&self) -> Column {
        let (title, unit, decimals) = self.page;
        let column = Column::number(title, unit).decimals(decimals);
        match self.value {
            Value::Trained => column,
            Value::Key(_) => column.best(Best::Lowest),
            Value::Inside50 => column.best(Best::Nearest(50.0)),
            Value::Inside90 => column.best(Best::Nearest(90.0)),
        }
    }
}

/// Names and columns of the scores, for systems with or without known actions.
#[derive(Debug)]
pub struct Layout {
    /// Description of the input of a forecast, for pages.
    pub sees: &'static str,
    /// Words for one trajectory and for several: `[singular, plural]`.
    pub words: [&'static str; 2],
    /// Name of the first point estimate, and the function that picks it from a score.
    pub estimate: (&'static str, fn(&Score) -> &PointError),
    /// Second point estimate: name in results, name in tables (empty: not shown), function that picks it.
    pub second: (&'static str, &'static str, fn(&Score) -> &PointError),
    /// Name and definition of each error of a point estimate.
    pub errors: &'static [(&'static str, Figure)],
    /// CRPS columns: name, index of the measured quantity, unit factor.
    pub crps: &'static [(&'static str, usize, f64)],
    /// Minimum width of the model column in text tables, characters.
    pub width: usize,
    /// Columns that the tables show, in order.
    pub shown: &'static [ColumnFormat],
    /// Notes below the tables of a page.
    pub footnotes: &'static [&'static str],
    /// Quantities of which a page shows forecasts: name, unit, unit factor.
    pub channels: &'static [(&'static str, &'static str, f64)],
}

const DEGREES: f64 = 180.0 / std::f64::consts::PI;

const fn shown(
    value: Value,
    text: (&'static str, usize, usize),
    page: (&'static str, &'static str, usize),
) -> ColumnFormat {
    ColumnFormat { value, text, page }
}

/// Layout of the scores of systems without actions: the ball.
static WITHOUT_ACTIONS: Layout = Layout {
    sees: "the model uses the first state only",
    words: ["trajectory", "trajectories"],
    estimate: ("mean of 10", |s| &s.mean_of_10),
    second: ("median_of_100", "median of 100", |s| &s.median),
    errors: &[
        ("trans_percent", Figure::Trans),
        ("pos_m", Figure::Error(0, 1.0)),
        ("vel_m_s", Figure::Error(1, 1.0)),
    ],
    crps: &[("crps_pos_m", 0, 1.0), ("crps_vel_m_s", 1, 1.0)],
    width: 10,
    shown: &[
        shown(Value::Key("trans_percent"), ("trans %", 8, 2), ("translation", "%", 2)),
        shown(Value::Key("pos_m"), ("pos m", 8, 4), ("position", "m", 3)),
        shown(Value::Key("vel_m_s"), ("vel m/s", 8, 4), ("velocity", "m/s", 3)),
        shown(Value::Key("crps_pos_m"), ("CRPS m", 8, 4), ("CRPS position", "m", 3)),
        shown(Value::Key("crps_vel_m_s"), ("CRPS m/s", 9, 4), ("CRPS velocity", "m/s", 3)),
        shown(Value::Inside50, ("in 50%", 6, 1), ("50 % band coverage", "%", 1)),
        shown(Value::Inside90, ("in 90%", 6, 1), ("90 % band coverage", "%", 1)),
    ],
    footnotes: &[
        "Mean absolute error over all steps and trajectories; translation is the mean over trajectories of the summed absolute error over the summed true height. CRPS: continuous ranked probability score; for a deterministic model it is the absolute error.",
        "Bold and underlined: best of its protocol (for bands: nearest to the nominal coverage). Protocols are not compared with each other.",
    ],
    channels: &[("height", "m", 1.0), ("velocity", "m/s", 1.0)],
};

/// Layout of the scores of systems with known actions: pushes.
static WITH_ACTIONS: Layout = Layout {
    sees: "the model uses the first pose and the path of the pusher",
    words: ["push", "pushes"],
    estimate: ("mean of 100", |s| &s.mean),
    second: ("mean_of_10", "", |s| &s.mean_of_10),
    errors: &[
        ("trans_percent", Figure::Trans),
        ("moved_percent", Figure::Moved),
        ("pos_mm", Figure::Error(0, 1e3)),
        ("rot_deg", Figure::Error(1, DEGREES)),
        ("end_pos_mm", Figure::End(0, 1e3)),
        ("end_rot_deg", Figure::End(1, DEGREES)),
    ],
    crps: &[("crps_mm", 0, 1e3), ("crps_deg", 1, DEGREES)],
    width: 16,
    shown: &[
        shown(Value::Trained, ("train", 6, 0), ("trained on", "pushes", 0)),
        shown(Value::Key("trans_percent"), ("trans %", 8, 3), ("translation", "%", 2)),
        shown(Value::Key("moved_percent"), ("moved %", 8, 2), ("of the way moved", "%", 1)),
        shown(Value::Key("pos_mm"), ("pos mm", 8, 3), ("position", "mm", 2)),
        shown(Value::Key("rot_deg"), ("rot deg", 8, 3), ("rotation", "°", 2)),
        shown(Value::Key("crps_mm"), ("CRPS mm", 9, 3), ("CRPS position", "mm", 2)),
        shown(Value::Key("crps_deg"), ("CRPS deg", 9, 3), ("CRPS rotation", "°", 2)),
        shown(Value::Inside50, ("in 50%", 7, 1), ("50 % band coverage", "%", 1)),
        shown(Value::Inside90, ("in 90%", 6, 1), ("90 % band coverage", "%", 1)),
    ],
    footnotes: &[
        "The model sees the first pose and the rod's path. Errors of the mean of 100 samples, averaged over the samples of a push and then over pushes. Translation divides by the distance from the robot's base, as the published tables do; the next column by the distance from the first position.",
    ],
    channels: &[("displacement x", "mm", 1e3), ("displacement y", "mm", 1e3), ("rotation", "°", DEGREES)],
};

impl Layout {
    /// Returns the layout of the scores of a simulator's system.
    pub fn for_engine(engine: &Engine) -> &'static Self {
        if engine.action_columns().is_empty() { &WITHOUT_ACTIONS } else { &WITH_ACTIONS }
    }

    /// Whether tables name the point estimate of each row, because they show two.
    pub fn names_estimates(&self) -> bool {
        !self.second.1.is_empty()
    }

    /// Returns the errors of a point estimate with their names.
    pub fn numbers(&self, e: &PointError) -> Vec<(&'static str, f64)> {
        self.errors.iter().map(|(name, figure)| (*name, figure.error(e))).collect()
    }
}
