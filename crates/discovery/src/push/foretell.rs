//! A model of pushing run as it stands: every push forecast from its first measured pose, with bands.

use super::error_table::whole_windows;
use super::evaluate::plain;
use super::forecast::{self, Counted, Squares};
use super::hypothesis::Hypothesis;
use super::measured::{Measured, Window, measure_for};
use crate::DiscoveryError;
use crate::foretold::{Draws, ForetellOptions, Foretelling, Foretold, ForetoldChannel, ForetoldError};
use augsim_data::{Dataset, random_stream};
use augsim_physics::model::{Parameter, PushModel};
use augsim_physics::push::effects::{SCATTER_KIND, index_of};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// The effect whose parameters the centre of pressure is: it differs from push to push where friction scatters.
const CENTRE_KIND: &str = "pressure-offset";
/// Widths of a 95 % interval in standard deviations.
const INTERVAL: f64 = 2.0 * 1.959_963_984_540_054;
/// Columns of a pose.
const COLUMNS: [&str; 3] = ["x_m", "y_m", "theta_rad"];

/// Forecasts every push of `data` by `model` as it stands, open loop from its first measured pose; long runs in pieces, each
/// from its own first pose, as in the table of errors.
///
/// Bands are those of draws: parameters from their 95 % intervals, one independent of the other, the centre of pressure from
/// its scatter, the first pose from the sensor's noise, and that noise on top.
///
/// # Errors
/// [`DiscoveryError`], where model and data do not go together.
pub fn foretell_push(
    model: &PushModel,
    data: &Dataset,
    options: &ForetellOptions,
) -> Result<Foretelling, DiscoveryError> {
    let measured = measure_for(model, data, 1)?;
    let asked = |i: &usize| options.asks_for(&measured.records[*i].id);
    let everything: Vec<usize> = (0..measured.records.len()).filter(asked).collect();
    let windows = whole_windows(&measured, &everything);
    let model = Drawn::of(model, &measured);
    let done: Vec<(Foretold, Squares)> = (0..windows.len())
        .into_par_iter()
        .map(|i| model.one(&measured, &windows[i], i as u64, options))
        .collect();
    let (records, squares): (Vec<Foretold>, Vec<Squares>) = done.into_iter().unzip();
    let error = |measure: &str, unit: &str, scale: f64, of: fn(&Squares) -> f64| {
        let row = forecast::row(&windows, &squares, of, scale, options.seed);
        ForetoldError { measure: measure.into(), unit: unit.into(), rmse: row.rmse, ci95: row.ci95 }
    };
    let errors = vec![
        error("position", "m", 1.0, |s| s.position),
        error("rotation", "deg", 1f64.to_degrees(), |s| s.rotation),
    ];
    let squares = squares.iter().map(|s| (s.position, s.count)).collect();
    let (noise_sd, start) = (measured.noise.sd.to_vec(), "the first measured pose".to_owned());
    Ok(Foretelling { records, errors, squares, noise_sd, start })
}

/// A model with what is drawn of it.
struct Drawn {
    hypothesis: Hypothesis,
    theta: Vec<f64>,
    /// Standard deviation of each entry of theta.
    spread: Vec<f64>,
    /// Places in theta of the centre of pressure, and the standard deviation with which it differs from push to push, m.
    centre: Option<(usize, f64)>,
}

impl Drawn {
    fn of(model: &PushModel, data: &Measured) -> Self {
        let scatter = model.effects.iter().find(|b| b.kind == SCATTER_KIND);
        let sd_m = scatter.and_then(|b| b.parameters.first()).map(|p| p.nominal);
        let mut model = model.clone();
        let declared = model.effects.iter_mut().find(|b| b.kind == CENTRE_KIND);
        let has_centre = declared.is_some();
        if sd_m.is_some() {
            // A centre that differs is one that a draw has to move.
            declared.into_iter().flat_map(|b| &mut b.parameters).for_each(|p| p.frozen = false);
        }
        let kinds: &[&'static str] = if sd_m.is_some() && !has_centre { &[CENTRE_KIND] } else { &[] };
        let hypothesis = Hypothesis::new(&model, &data.groups, kinds);
        let laws = model.effects.iter().filter(|b| index_of(&b.kind).is_some());
        let parameters: Vec<&Parameter> =
            model.parameters.iter().chain(laws.flat_map(|b| &b.parameters)).collect();
        let sd = |index: usize| {
            let ci95 = parameters.get(index).filter(|p| !p.frozen).and_then(|p| p.ci95);
            ci95.map_or(0.0, |[low, high]| (high - low) / INTERVAL)
        };
        let spread =
            hypothesis.free.iter().map(|f| if f.group.is_none() { sd(f.index) } else { 0.0 }).collect();
        let centre = sd_m.map(|sd| (hypothesis.range_of(CENTRE_KIND).start, sd));
        Self { theta: hypothesis.start(), hypothesis, spread, centre }
    }

    /// One window and its squared errors.
    fn one(
        &self,
        data: &Measured,
        w: &Window,
        stream: u64,
        options: &ForetellOptions,
    ) -> (Foretold, Squares) {
        let (h, record, sd) = (&self.hypothesis, &data.records[w.record], data.noise.sd);
        let seen = &record.pose[w.first..=w.last];
        let path = plain(h, &self.theta, seen[0], record, w);
        let mut rng = random_stream(options.seed, "foretell push", stream);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut draws = Draws::new(3, seen.len(), options.draws);
        for _ in 0..options.draws {
            let mut theta: Vec<f64> =
                self.theta.iter().zip(&self.spread).map(|(t, s)| t + s * normal()).collect();
            if let Some((at, sd_m)) = self.centre {
                theta[at..].iter_mut().take(2).for_each(|c| *c += sd_m * normal());
            }
            h.admit(&mut theta);
            let start = [0, 1, 2].map(|c| seen[0][c] + sd[c] * normal());
            for (k, pose) in plain(h, &theta, start, record, w).iter().enumerate() {
                (0..3).for_each(|c| draws.push(c, k, pose[c] + sd[c] * normal()));
            }
        }
        let channels = (0..3).map(|c| {
            let (mean, quantiles) = draws.summary(c);
            ForetoldChannel {
                column: COLUMNS[c].into(),
                measured: seen.iter().map(|p| p[c]).collect(),
                forecast: path.iter().map(|p| p[c]).collect(),
                mean,
                quantiles,
            }
        });
        let channels = channels.collect();
        let times = record.time[w.first..=w.last].to_vec();
        let foretold = Foretold { id: record.name(w), times, known: 1, channels };
        (foretold, forecast::squares(&path, seen, Counted::All))
    }
}
