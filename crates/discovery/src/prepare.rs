//! Preparation of a data set: records, events, noise, and the held-out split.

use crate::calibrate::calibrate;
use crate::difference_noise::{noise_from_differences, rough_noise};
use crate::fit::{ChosenRecords, Fit};
use crate::frame_clock::snap_to_frames;
use crate::noise::estimate_noise;
use crate::noise_estimate::Noise;
use crate::options::Clock;
use crate::record::{Measured, Record};
use crate::records::parts::split_into_blocks;
use crate::residuals::record_residuals;
use crate::segments;
use crate::single_record;
use crate::spikes::{mask, spikes};
use crate::statistics::median;
use crate::{DiscoveryError, Options};
use augsim_data::Dataset;
use augsim_system::{Declaration, Record as SystemRecord, channel_sd, unknown_group};
use std::sync::Arc;

/// A data set ready for fits: records with events, noise, and the held-out split.
#[derive(Clone)]
pub(crate) struct Prepared {
    pub data: Measured,
    pub noise: Noise,
    /// Whether polynomials follow the motion between samples, so that their residuals are measurement noise.
    pub is_smooth: bool,
    /// Indices of the records used in the search for effects.
    pub searched: Vec<usize>,
    /// Indices of the records held out from all fits, on which prediction errors are measured. Empty where
    /// there are too few records.
    pub held_out: Vec<usize>,
    /// Remarks on how the records were read, for the reader of the result, one sentence each.
    pub notes: Vec<String>,
    /// Deadline of calibration and search on these data.
    pub clock: Clock,
}

impl Prepared {
    /// The records with the indices `chosen`, with the noise correlation of all records.
    pub fn sample<'a>(&'a self, chosen: &'a [usize]) -> ChosenRecords<'a> {
        ChosenRecords { data: &self.data, chosen, correlation: self.noise.correlation }
    }

    /// Standard deviation of the measured values in the deciding measure about their means, in the unit of
    /// its channels.
    pub fn spread(&self) -> f64 {
        let records: Vec<SystemRecord> = self.data.records.iter().map(|r| r.data.clone()).collect();
        let Some(measure) = self.data.system.schema().error_figures.first() else { return f64::INFINITY };
        let squares: f64 =
            measure.channels.iter().map(|&channel| channel_sd(&records, channel).powi(2)).sum();
        let count = if measure.is_euclidean { 1 } else { measure.channels.len().max(1) };
        (squares / count as f64).sqrt()
    }

    /// Whether all records are parts of one recording.
    pub fn has_single_recording(&self) -> bool {
        self.data.recordings.len() == 1
    }

    /// Whether the noise estimate is only an upper bound, because polynomials do not follow the motion.
    pub fn is_noise_bounded(&self) -> bool {
        !self.is_smooth && !self.data.is_idealised()
    }

    /// Lowers the noise estimate to the residual standard deviations `found` of a fit, by channel. Applies
    /// only where the estimate was an upper bound. Returns whether it changed by more than 10 %.
    pub fn lower_noise(&mut self, found: Vec<f64>) -> bool {
        if !self.is_noise_bounded() {
            return false;
        }
        let ratios: Vec<f64> = found
            .iter()
            .zip(&self.noise.sd)
            .map(|(found, sd)| if *found > 0.0 { (found.max(MIN_NOISE_SD) / sd).min(1.0) } else { 1.0 })
            .collect();
        if ratios.iter().all(|ratio| *ratio > KEEP_NOISE_RATIO) {
            return false;
        }
        for sds in [&mut self.noise.sd, &mut self.noise.white] {
            sds.iter_mut().zip(&ratios).for_each(|(sd, ratio)| *sd *= ratio);
        }
        for record in &mut self.data.records {
            for (weights, ratio) in record.weight.iter_mut().zip(&ratios) {
                weights.iter_mut().for_each(|w| *w /= ratio);
            }
        }
        true
    }
}

/// Minimum of the noise estimate, in the unit of any channel, as in [`estimate_noise`].
const MIN_NOISE_SD: f64 = 1e-6;
/// Ratio of the new to the old noise estimate above which the old one is kept, if all channels exceed it.
const KEEP_NOISE_RATIO: f64 = 0.9;

/// Standard deviation of a fit's residuals in each channel, in its unit. Fitted parameters and initial states
/// reduce the degrees of freedom.
pub(crate) fn residual_sds(sample: &ChosenRecords<'_>, fit: &Fit) -> Vec<f64> {
    let records = record_residuals(sample, fit);
    let channels = sample.data.system.schema().channels.len();
    let of_channel =
        |c: usize| records.iter().flat_map(move |r| r.residuals[c].iter().filter(|r| r.is_finite()));
    let counts: Vec<f64> = (0..channels).map(|c| of_channel(c).count() as f64).collect();
    let total: f64 = counts.iter().sum();
    let fitted = records.iter().map(|r| r.nuisances).sum::<usize>() + fit.theta.len();
    let share = (1.0 - fitted as f64 / total.max(1.0)).max(0.1);
    (0..channels)
        .map(|c| (of_channel(c).map(|r| r * r).sum::<f64>() / (share * counts[c]).max(1.0)).sqrt())
        .collect()
}

/// Number of records from which on a fifth is held out. With fewer, less than four held-out records would
/// give too uncertain errors.
const MIN_RECORDS_TO_HOLD_OUT: usize = 20;
/// Number of records, in their order, of which one is held out.
const HELD_OUT_STRIDE: usize = 5;

/// Records with detected events and estimated noise.
pub(crate) struct PreparedRecords {
    pub data: Measured,
    pub noise: Noise,
    /// Whether polynomials follow the motion between samples, so that their residuals are measurement noise.
    pub is_smooth: bool,
    /// Remarks on how the records were read, for the reader of the result, one sentence each.
    pub notes: Vec<String>,
}

/// Prepares a data set for the search: corrects jittering time stamps, detects events, estimates the noise,
/// and holds records out.
pub(crate) fn prepare(
    model: &dyn Declaration,
    dataset: &Dataset,
    options: &Options,
) -> Result<Prepared, DiscoveryError> {
    let snap_to_frames = snap_to_frames(model, dataset)?;
    let on_frames = snap_to_frames.as_ref().map_or(dataset, |(on_frames, _)| on_frames);
    let PreparedRecords { mut data, mut noise, is_smooth, mut notes } =
        load_records(model, on_frames, 2, true)?;
    if let Some((_, clock)) = snap_to_frames {
        notes.push(format!(
            "the time stamps jitter by {:.2} ms (standard deviation) about frames of period {:.3} ms; each sample was moved to the time \
             of its frame",
            1e3 * clock.jitter_s,
            1e3 * clock.period_s
        ));
        noise.set_frame_clock(clock);
    }
    let (searched, held_out) = held_out(&data);
    let clock = Clock::new(options);
    data.clock = clock.clone();
    data.effects = Arc::new(options.effects.clone());
    Ok(Prepared { data, noise, is_smooth, searched, held_out, notes, clock })
}

/// Splits the records into those searched and those held out. One in five of each group is held out, if there
/// are enough whole records.
fn held_out(data: &Measured) -> (Vec<usize>, Vec<usize>) {
    let everything: Vec<usize> = (0..data.records.len()).collect();
    let recordings = if data.recordings.is_empty() { everything.len() } else { data.recordings.len() };
    if recordings < MIN_RECORDS_TO_HOLD_OUT || data.records.len() != recordings {
        return (everything, Vec::new());
    }
    let mut count_in_group = vec![0; data.groups.len()];
    let is_searched = |j: &usize| {
        let count = &mut count_in_group[data.records[*j].data.group];
        *count += 1;
        // The third of each five is held out: the first and the last record of a session are the least
        // representative.
        *count % HELD_OUT_STRIDE != HELD_OUT_STRIDE.div_ceil(2)
    };
    everything.into_iter().partition(is_searched)
}

/// Reads records, detects events and estimates the noise; fails with fewer than `fewest` usable records.
/// `is_fitted` says whether parameters will be fitted to them; then the system's objections to such fits
/// apply.
pub(crate) fn load_records(
    model: &dyn Declaration,
    dataset: &Dataset,
    fewest: usize,
    is_fitted: bool,
) -> Result<PreparedRecords, DiscoveryError> {
    let mut data = Measured::from_dataset(dataset, model)?;
    let names: Vec<&str> = data.groups.iter().map(String::as_str).collect();
    if let Some(unknown) = unknown_group(data.system.parameters().iter(), &names) {
        return Err(DiscoveryError::unknown_group(model.file(), &data.name, unknown, &data.groups));
    }
    let channels = 0..data.system.schema().channels.len();
    let rough: Vec<f64> = channels
        .map(|c| {
            let levels = data.records.iter().map(|r| rough_noise(&r.data.times, &r.data.values[c]));
            median(&mut levels.collect::<Vec<_>>())
        })
        .collect();
    let system = data.system.clone();
    let mut notes = Vec::new();
    if let [only] = &data.records[..]
        && is_fitted
        && let Some((split_record, at_s)) = single_record::split_record(&*system, only, &rough)
    {
        notes.push(format!(
            "there is only one {}: it was split at {at_s:.2} s, and each part is predicted by a fit to the other; differences between \
             {} cannot be detected",
            system.schema().record[0],
            system.schema().record[1]
        ));
        data.records = split_record;
    }
    data.records.retain_mut(|r| system.prepare(&mut r.data, &rough).is_ok());
    if let Some(settled) = system.with_scene_from_data(&data.system_records()) {
        data.system = settled;
    }
    let system = data.system.clone();
    let is_smooth = !data.is_idealised() && segments::split_smooth_segments(&mut data);
    (data.records, data.recordings) = split_into_blocks(std::mem::take(&mut data.records), data.groups.len());
    if data.is_idealised() {
        // Free runs of an idealised system drift whatever effects were added, so they are not compared.
        data.recordings.clear();
    }
    let found = data.records.len();
    if found < fewest {
        let data = data.name;
        return Err(DiscoveryError::TooFew { data, found });
    }
    if is_fitted && data.records.iter().all(|r| r.data.forecasts.is_empty()) {
        let has_later = |r: &&Record| {
            let first = r.data.initial_sample_count;
            r.data.values.iter().any(|v| v.iter().skip(first).any(|v| v.is_finite()))
        };
        let found = data.records.iter().filter(has_later).count();
        if found < fewest {
            let known = data.records.iter().map(|r| r.data.initial_sample_count).max().unwrap_or(0);
            return Err(DiscoveryError::NothingToPredict { data: data.name, known, found });
        }
    }
    let mut noise = if data.is_idealised() {
        noise_from_differences(&mut data)
    } else {
        estimate_noise(&mut data, is_smooth)
    };
    data.white_share = noise.white_share();
    if is_fitted && let Some(objection) = system.objection(&without_outliers(&data), &noise.sd) {
        let (data, model) = (data.name, model.file().into());
        return Err(DiscoveryError::Objection { data, model, objection });
    }
    let everything: Vec<usize> = (0..data.records.len()).collect();
    if noise.findings.contains(&"outliers") {
        let sample = ChosenRecords { data: &data, chosen: &everything, correlation: noise.correlation };
        let found = spikes(&sample, &calibrate(&sample));
        noise.outliers += found.len();
        mask(&mut data, &found);
    }
    Ok(PreparedRecords { data, noise, is_smooth, notes })
}

/// Copies of the records in which masked samples are marked as not measured.
fn without_outliers(data: &Measured) -> Vec<SystemRecord> {
    let mut records: Vec<SystemRecord> = data.records.iter().map(|r| r.data.clone()).collect();
    for (data, record) in records.iter_mut().zip(&data.records) {
        for (values, weights) in data.values.iter_mut().zip(&record.weight) {
            values.iter_mut().zip(weights).filter(|(_, w)| **w == 0.0).for_each(|(v, _)| *v = f64::NAN);
        }
    }
    records
}
