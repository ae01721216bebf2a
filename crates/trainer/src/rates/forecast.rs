//! Forecasts of Hybrid+ with corrected rates.

use super::corrector::Corrector;
use super::features::{CorrectionShrinkage, Units};
use super::roll_out::{RollOuts, repeat_starts, roll_out};
use crate::latent::LatentDistribution;
use crate::nets::Stepwise;
use crate::noise::standard;
use crate::scales::Scales;
use crate::settings::Settings;
use crate::{Difference, Samples, Task, TrainerError};
use augsim_data::random_stream;
use augsim_nn::Params;
use rayon::prelude::*;

/// Number of sampled trajectories that are simulated in one batch.
const BATCH_SAMPLES: usize = 32;

/// A trained Hybrid+: an equation model and the net that corrects its rates.
#[derive(Clone, Copy)]
pub(crate) struct Hybrid<'a> {
    pub settings: &'a Settings,
    pub scales: &'a Scales,
    pub params: &'a Params<f32>,
    pub net: &'a Stepwise,
    pub law: &'a LatentDistribution,
}

/// Draws trajectories `[time, S, sample]` of S state columns.
/// The start of the task is one state `[S]` for all samples, or one for each, `[samples, S]`.
///
/// # Errors
/// [`TrainerError::Mismatch`] if the engine has no equations.
pub(crate) fn forecast(hybrid: Hybrid<'_>, task: Task<'_>, samples: usize) -> Result<Samples, TrainerError> {
    let Hybrid { settings, scales, params, net, law } = hybrid;
    let Some(motion) = settings.engine.rate_model() else { return Err(Difference::OtherSystem.into()) };
    let s = motion.periods().len();
    let starts = repeat_starts(task.start, s, samples);
    let latent = net.sizes().latent;
    let latents = law.draw(&standard(settings.seed, "forecast", task.index, latent * samples), samples);
    let batches: Vec<Samples> = (0..samples.div_ceil(BATCH_SAMPLES))
        .into_par_iter()
        .map(|batch| {
            let (first, end) = (batch * BATCH_SAMPLES, samples.min((batch + 1) * BATCH_SAMPLES));
            let lane_latents =
                latents.chunks_exact(samples).flat_map(|row| row[first..end].iter().copied()).collect();
            let correlation_intervals = Units::from_scales(scales).correlation_intervals;
            let shrinkage =
                vec![CorrectionShrinkage { correlation_intervals, ..CorrectionShrinkage::FULL }; end - first];
            let rng = random_stream(settings.seed, "step-noise", (task.index << 16) + batch as u64);
            let mut corrector =
                Corrector::new((net, params), lane_latents, shrinkage, Units::from_scales(scales), rng);
            let motions =
                RollOuts { starts: &starts[first * s..end * s], actions: task.actions, time: task.time };
            roll_out(motion, scales, motions, &mut |u, rates| corrector.draw(u, rates))
        })
        .collect();
    let mut values = Vec::with_capacity(task.time * s * samples);
    for row in 0..task.time * s {
        batches.iter().for_each(|p| values.extend_from_slice(&p.values[row * p.count..(row + 1) * p.count]));
    }
    Ok(Samples { count: samples, values })
}
