//! The training loop, and the state that a checkpoint holds.

use crate::difference::Difference;
use crate::featuriser::{Featuriser, fits};
use crate::latent::LatentDistribution;
use crate::league::ClassNet;
use crate::nets::Net;
use crate::prepared::Prepared;
use crate::rates::acceptance::{AcceptedCorrection, TrainedRateNet};
use crate::rates::features::{self, CorrectionShrinkage};
use crate::rates::split_records::{Segments, split_records};
use crate::scales::Scales;
use crate::sequences::{Sequence, Sequences};
use crate::settings::Settings;
use crate::tiles::{TileContext, TileLoss, Workspace, clip, sum_gradients};
use crate::{Engine, TILE, TrainerError};
use augsim_data::random_stream;
use augsim_nn::{AdamState, Params};
use rand::seq::SliceRandom;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Losses of one iteration, averaged over its batch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Losses {
    /// Number of the iteration, from 1.
    pub iteration: u64,
    /// Sum of `kl` and `negative_ln_likelihood`, nats per trajectory; some nets minimise a weighted sum instead.
    pub loss: f64,
    /// Kullback-Leibler divergence, nats per trajectory.
    pub kl: f64,
    /// Negative log-likelihood without constant terms, nats per trajectory.
    #[serde(rename = "misfit")]
    pub negative_ln_likelihood: f64,
    /// Learning rate of this iteration.
    pub learning_rate: f64,
}

/// State of a training run, sufficient to resume it bit for bit; the content of a checkpoint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrainingState {
    /// Settings of the training run.
    pub settings: Settings,
    /// Names of the state columns of the training set.
    pub columns: Vec<String>,
    /// Normalisation scales fitted on the training set.
    pub scales: Scales,
    /// CRC-32 of the training set, to refuse resuming on different data.
    pub data: u32,
    /// Number of completed training iterations.
    pub iteration: u64,
    /// Values of all parameters of the net.
    pub params: Vec<f32>,
    /// State of the Adam optimiser.
    pub adam: AdamState<f32>,
    /// Distribution of the trajectory latent, fitted at the end of training (Hybrid+ only).
    pub latent: Option<LatentDistribution>,
}

/// A training run: net, optimiser, training set and progress.
///
/// ```
/// use augsim_physics::ball::drop_distribution::{DropDistribution, published_predictor};
/// use augsim_trainer::{Engine, Forecaster, NetModel, Recipe, Sequences, Settings, Task, Training};
///
/// let (data, _) = DropDistribution::default().generate(20, 5)?;
/// let drops = Sequences::new(&data, &["height_m", "velocity_m_s"])?;
/// let settings = Settings::new(Recipe::HybridPlus, 30, 3, Engine::PybulletBall(published_predictor()));
/// let mut training = Training::new(settings, &drops)?;
/// let first = training.step()?.loss;
/// let last = (1..30).try_fold(first, |_, _| training.step().map(|losses| losses.loss))?;
/// assert!(last < first);
///
/// let model = NetModel::new(training.finish()?.clone())?;
/// let from_4_m = Task { start: &[4.0, 0.0], actions: &[], time: 50, index: 0 };
/// assert_eq!(model.forecast(from_4_m, 10)?.values.len(), 50 * 2 * 10); // [time, state, sample]
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Training {
    state: TrainingState,
    net: Net,
    params: Params<f32>,
    prepared: Vec<Prepared>,
    /// Indices of the training set in shuffled order, and the epoch for which they were shuffled.
    order: Vec<usize>,
    order_epoch: Option<u64>,
    /// The batch as (length, position in the batch, trajectory index), longest first.
    batch: Vec<(usize, usize, usize)>,
    /// Training-set indices of the trajectories in the batch, longest first.
    chosen: Vec<usize>,
    workspaces: Vec<Workspace>,
    grads: Vec<f32>,
    /// The training set, for a class that is fitted directly; `None` for a net trained by gradients.
    fit_data: Option<Sequences>,
    /// Held-out records of a system of equations, on which the shrinkage factors of the corrections are chosen.
    held_out: Vec<Sequence>,
}

impl Training {
    /// Starts a training run on `train`. A batch larger than the training set is reduced to its size.
    ///
    /// # Errors
    /// [`TrainerError`] if a setting is out of range, the set is empty, or its columns are not the engine's.
    pub fn new(settings: Settings, train: &Sequences) -> Result<Self, TrainerError> {
        settings.check()?;
        if train.items.is_empty() {
            return Err(TrainerError::NoTrajectories { what: "the training set" });
        }
        check_columns(&settings.engine, &train.columns, &train.action_columns)?;
        let scales = match cut_records(&settings, train) {
            Some(segments) => Featuriser::for_settings(&settings)?.fit(&segments.train),
            None => Featuriser::for_settings(&settings)?.fit(train),
        };
        let mut params = Params::new(random_stream(settings.seed, "init", 0));
        Net::new(&settings, train.state_dim(), &mut params);
        let n = params.values().len();
        let state = TrainingState {
            columns: train.columns.clone(),
            data: fingerprint(train),
            iteration: 0,
            params: params.values().to_vec(),
            adam: AdamState::new(n),
            latent: None,
            scales,
            settings,
        };
        Self::assemble(state, train)
    }

    /// Resumes the run that `state` was taken from, bit for bit as if it had not been stopped.
    ///
    /// # Errors
    /// [`TrainerError::Mismatch`] if `train` is not the training set of that run or the state is inconsistent.
    pub fn resume(state: TrainingState, train: &Sequences) -> Result<Self, TrainerError> {
        state.settings.check()?;
        if state.columns != train.columns {
            return Err(Difference::Columns.into());
        }
        if state.data != fingerprint(train) {
            return Err(Difference::Data.into());
        }
        Self::assemble(state, train)
    }

    /// Builds the net, the targets and the buffers of a training run from its state.
    fn assemble(state: TrainingState, train: &Sequences) -> Result<Self, TrainerError> {
        if train.items.is_empty() {
            return Err(TrainerError::NoTrajectories { what: "the training set" });
        }
        check_columns(&state.settings.engine, &state.columns, &train.action_columns)?;
        let (net, params) = rebuild_net(&state)?;
        let featuriser = Featuriser::for_settings(&state.settings)?;
        let fit_data = net.is_fitted().then(|| train.clone());
        let segments = cut_records(&state.settings, train);
        let train_set = segments.as_ref().map_or(train, |segments| &segments.train);
        let prepared: Vec<Prepared> =
            train_set.items.par_iter().map(|q| featuriser.prepare(&state.scales, q)).collect();
        let batch = state.settings.batch.min(prepared.len());
        Ok(Training {
            fit_data,
            held_out: segments.map_or_else(Vec::new, |segments| segments.held_out),
            order: (0..prepared.len()).collect(),
            order_epoch: None,
            batch: Vec::with_capacity(batch),
            chosen: Vec::with_capacity(batch),
            workspaces: Vec::new(),
            grads: vec![0.0; params.values().len()],
            state,
            net,
            params,
            prepared,
        })
    }

    /// Number of completed training iterations.
    pub fn iteration(&self) -> u64 {
        self.state.iteration
    }

    /// Settings of the training run.
    pub fn settings(&self) -> &Settings {
        &self.state.settings
    }

    /// State of the training run, which a checkpoint holds.
    pub fn state(&mut self) -> &TrainingState {
        self.state.params.copy_from_slice(self.params.values());
        &self.state
    }

    /// Ends training: fits the latent distribution and, for equation models, chooses the shrinkage factors.
    ///
    /// # Errors
    /// [`TrainerError`] if the net cannot be run.
    pub fn finish(&mut self) -> Result<&TrainingState, TrainerError> {
        if let Net::Stepwise(net) = &self.net {
            let mut distribution = LatentDistribution::fit(net, &self.params, &self.prepared)?;
            if let Some(motion) = self.state.settings.engine.rate_model() {
                features::set_shrinkage(&mut self.state.scales, CorrectionShrinkage::FULL);
                let (scales, seed) = (&self.state.scales, self.state.settings.seed);
                let learned = TrainedRateNet {
                    motion,
                    net,
                    params: &self.params,
                    latent_distribution: &distribution,
                    scales,
                    seed,
                };
                if let Some(AcceptedCorrection { shrinkage: trust, latents_differ }) =
                    learned.decide(&self.held_out)?
                {
                    features::set_shrinkage(&mut self.state.scales, trust);
                    if !latents_differ {
                        distribution.factor.fill(0.0);
                    }
                }
            }
            self.state.latent = Some(distribution);
        }
        Ok(self.state())
    }

    /// Values of the trained parameters, under PyTorch's names.
    pub fn params(&self) -> &Params<f32> {
        &self.params
    }

    /// Runs one training iteration: loss and gradient of a batch, one optimiser step.
    ///
    /// A directly fitted class is fitted instead.
    ///
    /// # Errors
    /// [`TrainerError::Diverged`] if loss or gradient is not finite; the parameters are then unchanged.
    pub fn step(&mut self) -> Result<Losses, TrainerError> {
        if let (Net::Class(ClassNet::Fitted(class, _)), Some(train)) = (&self.net, &self.fit_data) {
            let misfit = class.fit(&self.state.settings, train, &mut self.params)?;
            self.state.iteration += 1;
            let learning_rate = self.state.settings.learning_rate.initial;
            return Ok(Losses {
                iteration: self.state.iteration,
                loss: misfit,
                kl: 0.0,
                negative_ln_likelihood: misfit,
                learning_rate,
            });
        }
        let settings = &self.state.settings;
        let iteration = self.state.iteration;
        let learning_rate = settings.learning_rate.at(iteration);
        let batch = settings.batch.min(self.prepared.len());
        let per_epoch = (self.prepared.len() / batch) as u64;
        let epoch = iteration / per_epoch;
        if self.order_epoch != Some(epoch) {
            self.order.sort_unstable();
            self.order.shuffle(&mut random_stream(settings.seed, "shuffle", epoch));
            self.order_epoch = Some(epoch);
        }
        let start = (iteration % per_epoch) as usize * batch;
        // Sorting by length puts similar lengths into one tile, which is only as long as its longest
        // trajectory.
        let positions = self.order[start..start + batch].iter().enumerate();
        self.batch.clear();
        self.batch.extend(positions.map(|(position, &item)| (self.prepared[item].time, position, item)));
        self.batch.sort_unstable_by_key(|&(time, position, _)| (std::cmp::Reverse(time), position));
        self.chosen.clear();
        self.chosen.extend(self.batch.iter().map(|&(_, _, item)| item));
        let chosen = &self.chosen;
        let (net, params, all, seed) = (&self.net, &self.params, &self.prepared, settings.seed);
        let scale = 1.0 / batch as f64;
        let shared = TileContext { net, params, train_set: all, scale, seed };
        // Consecutive tiles share a workspace; the workspace does not affect a tile's result. The last tile
        // may be a narrow one, so the rounding gives the later shares more tiles.
        let tiles = batch.div_ceil(TILE);
        let shares = tiles.min(rayon::current_num_threads());
        self.workspaces.resize_with(shares, Workspace::default);
        self.workspaces.par_iter_mut().enumerate().try_for_each(|(i, workspace)| {
            let [first, end] = [i, i + 1].map(|i| (i * tiles / shares * TILE).min(batch));
            workspace.run_all(shared, &chosen[first..end], iteration * batch as u64 + first as u64)
        })?;
        let results = self.workspaces.iter().flat_map(|w| &w.results);
        let TileLoss { kl, negative_ln_likelihood: misfit } = sum_gradients(results, scale, &mut self.grads);
        let loss = kl + misfit;
        let norm = clip(&mut self.grads, settings.clip_norm);
        if !loss.is_finite() || !norm.is_finite() {
            return Err(TrainerError::Diverged { iteration: iteration + 1, loss, rate: learning_rate });
        }
        settings.adam.step(&mut self.state.adam, self.params.values_mut(), &self.grads, learning_rate);
        self.state.iteration += 1;
        Ok(Losses {
            iteration: self.state.iteration,
            loss,
            kl,
            negative_ln_likelihood: misfit,
            learning_rate,
        })
    }
}

/// Splits records of a system of equations into training segments and held-out records; `None` for other systems.
fn cut_records(settings: &Settings, train: &Sequences) -> Option<Segments> {
    // Corrections of league classes are not shrunk, so nothing is held out of their training.
    settings.engine.rate_model().map(|_| split_records(train, settings.recipe.class().is_none()))
}

/// Rebuilds the net and its parameters from a saved state.
///
/// # Errors
/// [`TrainerError::Mismatch`] if settings, columns, scales or the number of parameters are inconsistent.
pub fn rebuild_net(state: &TrainingState) -> Result<(Net, Params<f32>), TrainerError> {
    // A corrupt file may hold any sizes, so they are checked before memory is allocated.
    state.settings.check().map_err(|e| Difference::Settings(Box::new(e)))?;
    if state.columns != state.settings.engine.columns() {
        return Err(Difference::ColumnsOfEngine.into());
    }
    if !fits(&state.scales, &state.settings, state.columns.len()) {
        return Err(Difference::Scales.into());
    }
    let mut params = Params::new(random_stream(state.settings.seed, "init", 0));
    let net = Net::new(&state.settings, state.columns.len(), &mut params);
    let (expected, found) = (params.values().len(), state.params.len());
    if expected != found || state.adam.len() != found {
        return Err(Difference::Parameters { expected, found }.into());
    }
    params.values_mut().copy_from_slice(&state.params);
    Ok((net, params))
}

/// Checks that the data have the engine's columns.
fn check_columns(engine: &Engine, states: &[String], actions: &[String]) -> Result<(), TrainerError> {
    for (role, expected, found) in
        [("states", engine.columns(), states), ("actions", engine.action_columns(), actions)]
    {
        if found != expected {
            let expected = expected.into_iter().map(Into::into).collect();
            return Err(Difference::EngineColumns { role, expected, found: found.to_vec() }.into());
        }
    }
    Ok(())
}

/// Computes a CRC-32 over all lengths and values of a training set, to recognise it on resuming.
fn fingerprint(data: &Sequences) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    for q in &data.items {
        hasher.update(&(q.time as u64).to_le_bytes());
        q.states.iter().chain(&q.actions).for_each(|v| hasher.update(&v.to_le_bytes()));
    }
    hasher.finalize()
}
