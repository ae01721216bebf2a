//! Python class of trained networks.

use crate::background::{self, Line};
use crate::error::{raised, unlocked};
use crate::model::Model;
use crate::numbers::{Bytes, Numbers};
use crate::source::{Data, Source, accepted};
use augsim_data::checks::Warning;
use augsim_session::configure::{PhysicsSource, TrainingRequest, configure};
use augsim_session::run_data::{check_measured, load_timed, read_measured};
use augsim_session::run_dir::{Config, RunDir};
use augsim_session::simulate::MAX_SERIAL_VALUES;
use augsim_session::training_run::{TrainingObserver, TrainingStart, train_in_memory};
use augsim_session::usage::{Inapplicable, Missing, PathFault, PlanFault, UnknownName};
use augsim_session::{RunLock, Subject, Usage, forecast};
use augsim_trainer::{Forecaster, Losses, NetModel, Recipe, Task};
use pyo3::prelude::*;
use pyo3::types::PyByteArray;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Name that selects, in place of a model, the PyBullet ball of the experiment in Ajay et al.
const PYBULLET_BALL: &str = "pybullet-ball";

/// Number of training iterations between two progress reports.
const PROGRESS_INTERVAL: u64 = 10;

/// Python class of a trained network.
#[pyclass(frozen, module = "augsim._augsim")]
pub struct Run {
    config: Option<Config>,
    pub model: Arc<NetModel>,
    #[pyo3(get)]
    notes: Vec<String>,
}

/// Reports the progress of a training to the caller, and stops it if the caller was interrupted.
struct ProgressReporter<'a, T> {
    line: &'a Line<T>,
    total: u64,
}

impl<T> TrainingObserver for ProgressReporter<'_, T> {
    fn must_stop(&mut self) -> bool {
        self.line.must_stop()
    }

    fn begins(&mut self, from: TrainingStart) {
        self.total = from.total;
    }

    fn step(&mut self, losses: &Losses) {
        if losses.iteration.is_multiple_of(PROGRESS_INTERVAL) {
            let Losses { iteration, loss, .. } = losses;
            let text = format!("iteration {iteration} of {}, loss {loss:.1} nats", self.total);
            self.line.step(text, Some(*iteration as f64 / self.total.max(1) as f64));
        }
    }

    fn ends(&mut self) {}
}

/// Physics model whose errors a network corrects: a model object or a path.
#[derive(FromPyObject)]
pub enum Corrects {
    Model(Py<Model>),
    Path(PathBuf),
}

impl Corrects {
    fn corrected(self) -> anyhow::Result<PhysicsSource> {
        match self {
            Corrects::Path(path) if path == Path::new(PYBULLET_BALL) => Ok(PhysicsSource::PybulletBall),
            Corrects::Path(path) if path.is_file() => Ok(PhysicsSource::File(path)),
            Corrects::Path(path) => Ok(PhysicsSource::Folder(path)),
            Corrects::Model(model) => match &model.get().subject {
                Subject::BuiltIn(model) => Ok(PhysicsSource::Model(model.clone())),
                Subject::Equations(_) => Err(Usage::Inapplicable(Inapplicable::NetOfEquations).into()),
            },
        }
    }
}

/// Trains a network on trajectories.
#[pyfunction]
#[pyo3(signature = (data, *, recipe, residual_of, iterations, seed, accept, progress))]
#[expect(clippy::too_many_arguments, reason = "all but one are keywords of Python")]
pub fn train(
    py: Python<'_>,
    data: &Source,
    recipe: &str,
    residual_of: Option<Corrects>,
    iterations: u64,
    seed: u64,
    accept: Vec<String>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Run> {
    let request = || {
        let accept = accepted(&accept)?;
        let residual_of = match residual_of {
            Some(corrects) => corrects.corrected()?,
            None => PhysicsSource::from_options(None, None, false, &data.from)?,
        };
        let residual_of = Some(residual_of);
        Ok(TrainingRequest { recipe: parse_recipe(recipe)?, residual_of, iterations, seed, accept })
    };
    let request = request().map_err(|e| raised(py, &e))?;
    let data = data.from.clone();
    background::run(py, progress.as_ref(), move |line| {
        let (config, mut notes) = configure(&request, &data)?;
        let set = read_measured(&data, &config.settings.engine)?;
        let (train, warnings) = check_measured(set, &config)?;
        notes.extend(warnings.into_iter().map(|Warning { text, .. }| text));
        let mut watch = ProgressReporter { line, total: 0 };
        let state = train_in_memory(&config.settings, &train, &mut watch)?;
        // Only an interrupted caller stops the training, and it no longer waits.
        let state = state.ok_or_else(|| anyhow::anyhow!("the training was stopped"))?;
        Ok(Run { config: Some(config), model: Arc::new(NetModel::new(state)?), notes })
    })
}

fn parse_recipe(recipe: &str) -> anyhow::Result<Recipe> {
    Recipe::named(recipe).ok_or_else(|| {
        let known = Recipe::all().map(Recipe::name).collect();
        Usage::Unknown(UnknownName::Recipe { name: recipe.to_owned(), known }).into()
    })
}

/// Number of samples that are transposed together: one cache line of the source array.
const TRANSPOSE_BLOCK: usize = 16;

/// Writes the array `from` `[row, sample]` to `to` as the bytes of its transpose `[sample, row]`.
fn transpose(from: &[f32], samples: usize, to: &mut [u8]) {
    const SIZE: usize = size_of::<f32>();
    let rows = from.len() / samples.max(1);
    for first in (0..samples).step_by(TRANSPOSE_BLOCK) {
        for row in 0..rows {
            let block = &from[row * samples..][first..(first + TRANSPOSE_BLOCK).min(samples)];
            for (i, value) in block.iter().enumerate() {
                value.put(&mut to[((first + i) * rows + row) * SIZE..][..SIZE]);
            }
        }
    }
}

/// Reads a trained network from the run directory of `augsim train`.
#[pyfunction]
pub fn read_run(py: Python<'_>, folder: PathBuf) -> PyResult<Run> {
    unlocked(py, || {
        let run = RunDir::open(&folder);
        let model = Arc::new(NetModel::new(run.read_model()?)?);
        Ok(Run { config: run.read_config().ok(), model, notes: Vec::new() })
    })
}

#[pymethods]
impl Run {
    /// Returns the names of the state columns and of the action columns.
    fn columns(&self) -> (Vec<String>, Vec<String>) {
        let engine = &self.model.state().settings.engine;
        let owned = |names: Vec<&str>| names.into_iter().map(str::to_owned).collect();
        (owned(engine.columns()), owned(engine.action_columns()))
    }

    /// Returns the label of the recipe, the number of iterations, the seed, and the number of network
    /// parameters.
    fn settings(&self) -> (String, u64, u64, usize) {
        let state = self.model.state();
        let settings = &state.settings;
        (settings.recipe.label().to_owned(), state.iteration, settings.seed, state.params.len())
    }

    /// Writes the network as a run directory like that of `augsim train`, but without the training losses.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        unlocked(py, || {
            let config = self.config.as_ref();
            let config = config.ok_or(Usage::Missing(Missing::Configuration))?;
            let _lock = RunLock::take(&folder)?;
            let run = RunDir::open(&folder);
            if run.checkpoint().exists() {
                return Err(Usage::path(&folder, PathFault::RunSaved).into());
            }
            run.write_config(config)?;
            run.write_checkpoint(self.model.state())?;
            run.write_weights(self.model.params())
        })
    }

    /// Forecasts each trajectory of `data` from its first state: mean, median and bands.
    fn predict(&self, py: Python<'_>, data: &Source, samples: usize) -> PyResult<Data> {
        let (model, data) = (Arc::clone(&self.model), data.from.clone());
        let set = background::run(py, None, move |_| {
            let (starts, times) = load_timed(&data, &model.state().settings.engine)?;
            forecast::bands(&model, &starts, &times, samples)
        })?;
        Data::from_dataset(py, set)
    }

    /// Draws random forecasts `[trajectory, sample, time, state]` from the network. `shape` is the number of
    /// trajectories and of times. `start` holds the first states `[trajectory, S]` with S state columns,
    /// `actions` the actions `[trajectory or 1, time, A]` with A action columns.
    #[expect(clippy::too_many_arguments, reason = "the package hands its arguments on")]
    fn sample<'py>(
        &self,
        py: Python<'py>,
        start: Numbers,
        actions: Numbers,
        shape: (usize, usize),
        samples: usize,
        seed: Option<u64>,
        first: u64,
    ) -> PyResult<Bound<'py, PyByteArray>> {
        let (start, actions) = (start.into_vec(), actions.into_vec());
        let (batch, time) = shape;
        let model = Arc::clone(&self.model);
        let is_brief = batch.saturating_mul(samples).saturating_mul(time) <= MAX_SERIAL_VALUES;
        let drawn = background::run_unless_brief(py, is_brief, move || {
            let model = match seed {
                Some(seed) if seed != model.state().settings.seed => Arc::new(model.with_seed(seed)?),
                _ => model,
            };
            let engine = &model.state().settings.engine;
            let (states, width) = (engine.columns().len(), time * engine.action_columns().len());
            forecast::check_size(batch, samples, time, states)?;
            let is_shared = actions.len() == width;
            let drawn = |i: usize| -> anyhow::Result<Vec<f32>> {
                let from = if is_shared { 0 } else { i * width };
                let lacking = || Usage::Plan(PlanFault::Shape);
                let start = start.get(i * states..(i + 1) * states).ok_or_else(lacking)?;
                let actions = actions.get(from..from + width).ok_or_else(lacking)?;
                let task = Task { start, actions, time, index: first.wrapping_add(i as u64) };
                Ok(model.forecast(task, samples)?.values)
            };
            match batch == 1 || is_brief {
                true => (0..batch).map(drawn).collect(),
                false => (0..batch).into_par_iter().map(drawn).collect::<anyhow::Result<Vec<_>>>(),
            }
        })?;
        let size = drawn.iter().map(Vec::len).sum::<usize>() * size_of::<f32>();
        // Writing directly into the `bytearray` saves a copy, which would take 10 % of the forecast
        // time.
        PyByteArray::new_with(py, size, |bytes| {
            let each = (size / drawn.len().max(1)).max(1);
            py.detach(|| {
                let places = bytes.par_chunks_mut(each).zip(&drawn);
                places.for_each(|(to, from)| transpose(from, samples, to));
            });
            Ok(())
        })
    }
}
