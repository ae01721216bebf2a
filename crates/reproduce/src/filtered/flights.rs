//! Forecasts of measured table-tennis flights: declared and augmented physics, flight-specific spin with
//! a prior from other flights, and a network on the residual.

use super::Plan;
use super::believed::{self, Prefixes, score_measured};
use super::page;
use crate::reproduction::{claim, finish, repeat};
use anyhow::Context;
use augsim_data::convert::CONVERTERS;
use augsim_data::{Dataset, FrameClock, Trajectory, atomic_write, write_dataset};
use augsim_discovery::Options;
use augsim_physics::ball::{Axes, FLOOR};
use augsim_physics::model::{Model, ModelFile};
use augsim_session::filtered::{ObservedColumns, PrefixLength, SystemOnPrefix, built_in_on_prefix};
use augsim_system::{Describe, Seed};
use augsim_terminal::Outcome;
use augsim_terminal::output::Output;
use augsim_terminal::record::Record;
use augsim_trainer::SAMPLES;
use augsim_trainer::filter::{
    CorrectedForecaster, FilteredScore, ForecastCorrection, LearnedPriors, RescaledSpread, Sensor,
};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

/// Lengths of the measured prefixes that are scored, s.
const PREFIXES_S: [f64; 3] = [0.05, 0.1, 0.2];
/// Prefix lengths of the training flights of the network, s.
const TRAINING_PREFIXES_S: [f64; 8] = [0.03, 0.05, 0.075, 0.1, 0.125, 0.15, 0.2, 0.25];
/// Duration after the prefix that is also scored alone, s: the horizon of published errors of such flights.
const AHEAD_S: f64 = 0.42;
/// Every n-th flight, by file number, is held out.
const HELD_OUT_EVERY: u32 = 3;
/// Text of the effect that gives each flight its own spin, for the model file.
const SPIN: &str = "\n[[effect]]\nkind = \"spin-offset\"\n";
/// Initial standard deviation of the prior of each spin component, rad/s.
///
/// The range of the spin is 1,040 rad/s to each side. Recorded spins are sometimes wrong by the full spin,
/// and a bound that is reached spoils the forecast.
const SPIN_SD: f64 = 600.0;
/// Standard deviation of the prior of the table height, m.
///
/// The data set only gives the height of the ball centre on contact.
const FLOOR_SD: f64 = 0.004;
/// Height of the ball in m below which it may touch the table.
const NEAR_TABLE_M: f64 = 0.08;
/// Number of samples between two positions that determine in which direction the ball moves.
const DIRECTION_STEPS: usize = 3;

#[derive(Debug, Serialize)]
struct ResultFile {
    schema: &'static str,
    scenario: &'static str,
    /// Number of training flights; the next field is the number of held-out flights.
    train: usize,
    held_out: usize,
    /// Frame period of the camera, s; the next field is the jitter of the time stamps, s.
    frame_s: f64,
    jitter_s: f64,
    /// Noise of the positions, m; the next field is its factor with the best forecasts in training.
    noise_m: Vec<f64>,
    noise_factor: f64,
    /// Spread factor of the physics for each prefix length, chosen for nominal coverage on training flights.
    spread_factors: Vec<f64>,
    /// Shrinkage factor of the network's corrections, chosen by cross-validation.
    ///
    /// The next field has the spread factors of the corrected forecasts.
    net_trust: f64,
    net_spread_factors: Vec<f64>,
    /// `[mean, standard deviation]` over flights of each flight-specific parameter, by name.
    own: BTreeMap<String, [f64; 2]>,
    rows: Vec<Row>,
    seed: u64,
    command: String,
}

/// Scores of one model with one prefix length.
#[derive(Debug, Serialize)]
struct Row {
    /// Name of the protocol, always `filtered`.
    protocol: &'static str,
    model: &'static str,
    /// Length of the measured prefix, s.
    seen_s: f64,
    /// Number of held-out flights that were scored.
    flights: usize,
    /// Position error of the median forecast, mean over forecast rows, median over flights, mm.
    rest_mm: f64,
    /// Position error as `rest_mm`, only within [`AHEAD_S`] after the prefix, mm.
    near_mm: f64,
    /// Position error as `rest_mm`, only before the first rebound, mm.
    in_flight_mm: f64,
    /// Coverage of the 90 % band before the first rebound, as a fraction.
    in_flight_coverage90: Option<f64>,
    /// Position error over all forecast rows, mean, mm; a few flights with unusual ends dominate it.
    rest_mean_mm: f64,
    /// Continuous ranked probability score, mean over forecast rows, median over flights, mm.
    crps_mm: f64,
    coverage50: Option<f64>,
    coverage90: Option<f64>,
}

/// How a model forecasts the held-out flights.
#[derive(Clone, Copy)]
enum Kind {
    /// With the model file alone, without tuning on training flights.
    Untuned,
    /// With priors of the flight-specific parameters, and bands tuned on training flights.
    LearnedPriors,
    /// As `LearnedPriors`, with a network that corrects the residual.
    Net,
}

/// Runs the comparison of forecasts of measured table-tennis flights from measured prefixes.
pub fn run(plan: Plan<'_>, data: &Path, output: &Output) -> anyhow::Result<Outcome> {
    let seed = plan.seed;
    let record = Record::new("reproduce filtered flights").setting("seed", seed).input("data", data);
    let claim = claim(plan.out, record, &[data], plan.args.resume, plan.force)?;
    claim.begin()?;
    let flights = Flights::read(data)?;
    for (name, set) in [("train.csv", &flights.train), ("held-out.csv", &flights.test)] {
        write_dataset(set, &claim.folder().join(name))?;
    }
    output.note("searching for missing effects");
    let model = Model::parse(&flights.declared, "model.toml")?;
    let options = Options { seed, ..Options::default() };
    let found = augsim_discovery::discover(&model, &flights.train, &options, &mut |_| {})?;
    atomic_write(&claim.folder().join("model.toml"), |w| w.write_all(found.model_toml.as_bytes()))?;
    let with_spin_effect = with_spin(&found.model_toml);
    let learned = Learned::from_training_flights(&with_spin_effect, &flights.train, seed, output)?;
    let tests = TestSets::cut(&flights.test)?;
    let mut rows = Vec::new();
    for (name, text, kind) in [
        ("Physics", &flights.declared, Kind::Untuned),
        ("Physics augmented", &found.model_toml, Kind::Untuned),
        ("Physics augmented, own spin", &with_spin_effect, Kind::LearnedPriors),
        ("Hybrid", &with_spin_effect, Kind::Net),
    ] {
        output.note(name);
        rows.extend(tests.rows(name, |data| learned.score((text, kind), data, (&tests.lengths, seed)))?);
    }
    let words =
        ["filtered", "--scenario", "flights", "--seed", &seed.to_string(), "--data"].map(str::to_owned);
    let result = ResultFile {
        schema: "augsim.filtered-flights/1",
        scenario: "flights",
        train: flights.train.trajectories().len(),
        held_out: flights.test.trajectories().len(),
        frame_s: flights.clock.period_s,
        jitter_s: flights.clock.jitter_s,
        noise_m: learned.priors.noise().to_vec(),
        noise_factor: learned.noise_factor,
        own: named(&learned.priors, &with_spin_effect)?,
        spread_factors: learned.spread,
        net_trust: learned.correction.shrinkage(),
        net_spread_factors: learned.net_spread,
        rows,
        seed,
        command: repeat(words.into_iter().chain([data.display().to_string()]).collect()),
    };
    finish(&claim, &result, |result| Ok(page_of(result).render()), None::<()>, table, output)
}

/// Measured flights, resampled to the frames of the camera, and their declared model.
struct Flights {
    train: Dataset,
    test: Dataset,
    declared: String,
    clock: FrameClock,
}

impl Flights {
    /// Reads the flights of a folder, and holds out every [`HELD_OUT_EVERY`]-th file.
    fn read(folder: &Path) -> anyhow::Result<Self> {
        let (_, convert) =
            CONVERTERS.iter().find(|(name, _)| *name == super::FLIGHTS).context("a converter")?;
        let converted = convert(folder)?;
        let declared = converted.model_toml.context("flights come with a model")?;
        let clock = FrameClock::estimate(&converted.data)
            .context("the time stamps of the flights have no common frame period")?;
        let steady = until_they_turn(&clock.apply_to(&converted.data)?)?;
        let is_held_out = |t: &Trajectory| t.id().parse::<u32>().is_ok_and(|n| n % HELD_OUT_EVERY == 0);
        let (test, train): (Vec<usize>, Vec<usize>) =
            (0..steady.trajectories().len()).partition(|&i| is_held_out(&steady.trajectories()[i]));
        Ok(Flights { train: steady.select(&train), test: steady.select(&test), declared, clock })
    }
}

/// Opens a model (text of a model file) on flights, for forecasts from a prefix.
fn open_on_prefix(text: &str, data: &Dataset) -> anyhow::Result<SystemOnPrefix> {
    built_in_on_prefix(&ModelFile::parse(text, "model.toml")?, data, &ObservedColumns::default(), None)
}

/// Priors, noise and corrections that are learned from the training flights.
struct Learned {
    priors: LearnedPriors,
    noise_factor: f64,
    sensor: Sensor,
    /// Spread factor of the physics for each prefix length.
    spread: Vec<f64>,
    /// Network that corrects the residual of the physics.
    correction: ForecastCorrection,
    /// Spread factor of the network-corrected forecasts for each prefix length.
    net_spread: Vec<f64>,
}

impl Learned {
    /// Learns priors, noise and corrections from training flights, with a model that has a spin per flight.
    fn from_training_flights(
        with_spin_effect: &str,
        train: &Dataset,
        seed: u64,
        output: &Output,
    ) -> anyhow::Result<Self> {
        output.note("estimating flight-specific parameters");
        let mut system = open_on_prefix(with_spin_effect, train)?;
        system.filter = system.filter.with_random_parameter(FLOOR, FLOOR_SD);
        let priors = LearnedPriors::learn(&system.filter, &system.data.set)?;
        system.filter = system.filter.with_normal_priors(priors.normal_priors(), priors.noise());
        let lengths = prefix_lengths_of(train, &PREFIXES_S);
        let prefixes = (&lengths[..], seed);
        let (noise_factor, sensor) = believed::noise(&system, &priors, prefixes, output)?;
        let spread = believed::choose_spread_factors(&system.filter, &system, &sensor, prefixes)?;
        output.note("training a network on the residual");
        let training_lengths = prefix_lengths_of(train, &TRAINING_PREFIXES_S);
        let (correction, net_spread) = believed::correction(&system, &sensor, &training_lengths, prefixes)?;
        Ok(Learned { priors, noise_factor, sensor, spread, correction, net_spread })
    }

    /// Scores a model on flights, for each prefix length.
    fn score(
        &self,
        (text, kind): (&str, Kind),
        data: &Dataset,
        prefixes: Prefixes<'_>,
    ) -> anyhow::Result<Vec<FilteredScore>> {
        let SystemOnPrefix { mut filter, data, sensor: declared_sensor, start } = open_on_prefix(text, data)?;
        if let Kind::Untuned = kind {
            return score_measured(&filter, &data, (&declared_sensor, &start), prefixes);
        }
        filter = filter
            .with_random_parameter(FLOOR, FLOOR_SD)
            .with_normal_priors(self.priors.normal_priors(), self.priors.noise());
        let known = (&self.sensor, &start);
        if let Kind::LearnedPriors = kind {
            return score_measured(&RescaledSpread::new(&filter, &self.spread), &data, known, prefixes);
        }
        let corrected = CorrectedForecaster::new(&filter, &self.correction);
        score_measured(&RescaledSpread::new(&corrected, &self.net_spread), &data, known, prefixes)
    }
}

/// Held-out flights: whole, cut before the rebound, and cut after a fixed horizon.
struct TestSets<'a> {
    whole: &'a Dataset,
    /// Held-out flights, cut before the first rebound.
    in_flight: Dataset,
    /// Flights until [`AHEAD_S`] after the prefix, one data set per prefix length.
    near: Vec<Dataset>,
    /// Number of measured rows, `[flight][prefix]`, of the whole flights; also used for the cut flights.
    lengths: Vec<Vec<usize>>,
}

impl<'a> TestSets<'a> {
    fn cut(whole: &'a Dataset) -> anyhow::Result<Self> {
        Ok(TestSets {
            whole,
            in_flight: before_the_rebound(whole)?,
            near: PREFIXES_S.iter().map(|seen_s| near(whole, *seen_s)).collect::<anyhow::Result<_>>()?,
            lengths: prefix_lengths_of(whole, &PREFIXES_S),
        })
    }

    /// Scores a model on the held-out flights; returns one row for each prefix length.
    fn rows(
        &self,
        model: &'static str,
        score: impl Fn(&Dataset) -> anyhow::Result<Vec<FilteredScore>>,
    ) -> anyhow::Result<Vec<Row>> {
        let (whole, in_flight) = (score(self.whole)?, score(&self.in_flight)?);
        let mut rows = Vec::new();
        for (k, seen_s) in PREFIXES_S.into_iter().enumerate() {
            let (rest, flight) = (&whole[k], &in_flight[k]);
            let near = score(&self.near[k])?.swap_remove(k);
            rows.push(Row {
                protocol: "filtered",
                model,
                seen_s,
                flights: rest.trajectories,
                rest_mm: 1e3 * rest.median_forecast_rows[0],
                near_mm: 1e3 * near.median_forecast_rows[0],
                in_flight_mm: 1e3 * flight.median_forecast_rows[0],
                in_flight_coverage90: flight.coverage90,
                rest_mean_mm: 1e3 * rest.forecast_rows[0],
                crps_mm: 1e3 * rest.median_crps[0],
                coverage50: rest.coverage50,
                coverage90: rest.coverage90,
            });
        }
        Ok(rows)
    }
}

/// Returns `[mean, standard deviation]` of each learned prior by parameter name.
fn named(laws: &LearnedPriors, model: &str) -> anyhow::Result<BTreeMap<String, [f64; 2]>> {
    let system = Model::parse(model, "model.toml")?.open(Axes::Space);
    let name = |seed: &Seed| match seed {
        Seed::Parameter(i) => system.quantity(*i).name,
        Seed::Start(i) => format!("start {i}"),
        Seed::Offset(i) => format!("offset {i}"),
    };
    Ok(laws.normal_priors().iter().map(|(seed, mean, sd)| (name(seed), [*mean, *sd])).collect())
}

/// Returns the number of measured rows of each flight for each prefix length in s.
fn prefix_lengths_of(data: &Dataset, seconds: &[f64]) -> Vec<Vec<usize>> {
    let of = |t: &Trajectory| seconds.iter().map(|s| PrefixLength::Seconds(*s).rows(t.time_s())).collect();
    data.trajectories().iter().map(of).collect()
}

/// Adds the effect with a spin per flight to the text of a model file.
fn with_spin(model: &str) -> String {
    let range = SPIN_SD * 12_f64.sqrt() / 2.0;
    let axis = |axis: &str| {
        format!(
            "{axis}_rad_s = {{ nominal = 0.0, min = {:.1}, max = {range:.1}, per = \"trajectory\" }}\n",
            -range
        )
    };
    format!("{model}{SPIN}{}{}{}", axis("x"), axis("y"), axis("z"))
}

/// Cuts each flight where the ball turns back along the table, because a player hit it.
fn until_they_turn(data: &Dataset) -> anyhow::Result<Dataset> {
    let y = data.column_index("y_m")?;
    cut(data, |t| {
        let y = t.column(y);
        let way = |k: usize| y[k + DIRECTION_STEPS] - y[k];
        let last = t.len().saturating_sub(DIRECTION_STEPS);
        (1..last).find(|&k| way(k) * way(0) < 0.0).unwrap_or(t.len())
    })
}

/// Cuts each flight [`AHEAD_S`] after a prefix.
fn near(data: &Dataset, seen_s: f64) -> anyhow::Result<Dataset> {
    cut(data, |t| {
        let times = t.time_s();
        let last = times[PrefixLength::Seconds(seen_s).rows(times) - 1];
        times.partition_point(|time| *time <= last + AHEAD_S)
    })
}

/// Cuts each flight at the first rebound.
fn before_the_rebound(data: &Dataset) -> anyhow::Result<Dataset> {
    let z = data.column_index("z_m")?;
    cut(data, |t| {
        let z = t.column(z);
        let turns = |k: usize| {
            z[k] < NEAR_TABLE_M
                && z[k] < z[k - DIRECTION_STEPS]
                && z[k] < z[k + DIRECTION_STEPS]
                && z[k] <= z[k - 1]
                && z[k] <= z[k + 1]
        };
        (DIRECTION_STEPS..t.len().saturating_sub(DIRECTION_STEPS)).find(|&k| turns(k)).unwrap_or(t.len())
    })
}

/// Cuts each trajectory at an index, with at least one sample.
fn cut(data: &Dataset, end: impl Fn(&Trajectory) -> usize) -> anyhow::Result<Dataset> {
    let shorter = |t: &Trajectory| {
        let end = end(t).max(1);
        t.with_samples(t.time_s()[..end].to_vec(), t.values().iter().map(|v| v[..end].to_vec()).collect())
    };
    let all = data.trajectories().iter().map(shorter).collect::<Result<_, _>>()?;
    Ok(Dataset::new(data.columns().to_vec(), all)?)
}

fn page_of(result: &ResultFile) -> augsim_report::page::Page {
    let ahead = format!("{AHEAD_S} s ahead");
    let numbers = [
        ("seen", "s", 2),
        ("rest", "mm", 1),
        (&ahead[..], "mm", 1),
        ("in flight", "mm", 1),
        ("mean", "mm", 1),
        ("CRPS", "mm", 1),
        ("in 50 %", "%", 1),
        ("in 90 %", "%", 1),
    ];
    let row = |r: &Row| {
        let errors = [r.seen_s, r.rest_mm, r.near_mm, r.in_flight_mm, r.rest_mean_mm, r.crps_mm].map(Some);
        let bands = [r.coverage50, r.coverage90].map(page::percent);
        (r.model.to_owned(), errors.into_iter().chain(bands).collect())
    };
    let caption = format!(
        "Median over {} held-out flights of the mean error of the median of {SAMPLES} samples, and of the mean CRPS; {ahead}: \
         of the rows up to that time after the prefix; in flight: before the first rebound; mean: over all rows.",
        result.held_out
    );
    let summary = format!(
        "{} flights of table-tennis balls, {} others to learn from; the first part of a second is measured, the rest is forecast.",
        result.held_out, result.train
    );
    let tables = vec![page::table(caption, &numbers, result.rows.iter().map(row))];
    page::page(("Measured flights", summary), Vec::new(), tables, (&result.command, result.seed))
}

fn table(result: &ResultFile) -> String {
    let mut out = format!(
        "filtered forecasts of {} measured flights, {} others to learn from: a prefix is measured, the rest is forecast; median \
         over flights of the mean error of the median of {SAMPLES} samples; stamps on frames of {:.3} ms (jitter {:.2} ms)\n  \
         {:<30}{:>7}{:>9}{:>10}{:>14}{:>14}{:>10}{:>9}{:>8}{:>8}\n",
        result.held_out,
        result.train,
        1e3 * result.frame_s,
        1e3 * result.jitter_s,
        "model",
        "seen s",
        "flights",
        "rest mm",
        format!("to {AHEAD_S} s mm"),
        "in flight mm",
        "mean mm",
        "CRPS mm",
        "in 50%",
        "in 90%"
    );
    for r in &result.rows {
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "  {:<30}{:>7}{:>9}{:>10.1}{:>14.1}{:>14.1}{:>10.1}{:>9.1}{:>8}{:>8}",
            r.model,
            r.seen_s,
            r.flights,
            r.rest_mm,
            r.near_mm,
            r.in_flight_mm,
            r.rest_mean_mm,
            r.crps_mm,
            page::percent_text(r.coverage50),
            page::percent_text(r.coverage90)
        );
    }
    out
}
