//! Generated trajectories for examples and tests.

use crate::background;
use crate::error::unlocked;
use crate::model::Model;
use crate::numbers::{Numbers, memory};
use crate::source::Data;
use augsim_data::Limit;
use augsim_physics::ball::drop_distribution::DropDistribution;
use augsim_physics::model::ModelFile;
use augsim_physics::push::Pose;
use augsim_physics::push::laboratory::{PushDesign, PushRecipe};
use augsim_session::run_data::recipe;
use augsim_session::usage::{Oversized, PlanFault, Takes};
use augsim_session::{Subject, Usage};
use pyo3::prelude::*;
use pyo3::types::PyByteArray;

/// Checks that the number of trajectories is at least 1 and within the limit for data sets.
fn check(trajectories: usize) -> Result<(), Usage> {
    if trajectories == 0 {
        return Err(Usage::keyword("trajectories", 0, Takes::AtLeastOne));
    }
    let oversized = Oversized::Trajectories { count: trajectories };
    let checked = Limit::Trajectories.check(trajectories as u64);
    checked.map_err(|exceeded| Usage::Limit { oversized, exceeded })
}

/// Simulates ball drops with the random restitution of the experiment in Ajay et al.
#[pyfunction]
pub fn drops(py: Python<'_>, trajectories: usize, samples: usize, seed: u64) -> PyResult<Data> {
    let made = background::run(py, None, move |_| {
        check(trajectories)?;
        let oversized = Oversized::Samples { count: samples };
        Limit::Cells
            .check((trajectories as u64).saturating_mul(samples as u64))
            .map_err(|exceeded| Usage::Limit { oversized, exceeded })?;
        Ok(DropDistribution { samples, ..DropDistribution::default() }.generate(trajectories, seed)?.0)
    })?;
    Data::from_dataset(py, made)
}

/// Simulates pushes in the layout of the MIT data set; also returns the model declared for them.
#[pyfunction]
pub fn pushes(
    py: Python<'_>,
    trajectories: usize,
    surface: String,
    shape: String,
    seed: u64,
) -> PyResult<(Data, Model)> {
    let made = background::run(py, None, move |_| {
        check(trajectories)?;
        Ok(recipe(PushDesign::Mit, &shape, &surface, trajectories)?.generate(seed)?)
    })?;
    let subject = Subject::BuiltIn(Box::new(ModelFile::Push(made.declared)));
    Ok((Data::from_dataset(py, made.data)?, Model { subject, path: None, function: None }))
}

/// Simulated laboratory that performs single pushes.
#[pyclass(frozen, module = "augsim._augsim")]
pub struct Laboratory {
    recipe: PushRecipe,
    seed: u64,
}

#[pymethods]
impl Laboratory {
    #[new]
    fn new(py: Python<'_>, surface: String, shape: String, seed: u64) -> PyResult<Self> {
        let recipe = unlocked(py, || Ok(recipe(PushDesign::Random, &shape, &surface, 1)?))?;
        Ok(Laboratory { recipe, seed })
    }

    /// Simulates a push and returns the poses `[time, 3]` (x, y, angle) of the object. It starts at the pose
    /// `start` `[3]`, with the pusher at `x` and `y` at the times `times`.
    fn pushed<'py>(
        &self,
        py: Python<'py>,
        start: Numbers,
        times: Numbers,
        x: Numbers,
        y: Numbers,
        index: u64,
    ) -> PyResult<Bound<'py, PyByteArray>> {
        let (start, times, x, y) = (start.into_vec(), times.into_vec(), x.into_vec(), y.into_vec());
        let poses = unlocked(py, || {
            let [px, py, angle] = start[..] else {
                return Err(Usage::Plan(PlanFault::Pose { found: start.len() }).into());
            };
            let poses =
                self.recipe.simulate_along(Pose::new(px, py, angle), &times, [&x, &y], self.seed, index);
            let poses = poses.map_err(Usage::Laboratory)?;
            Ok(poses.iter().flat_map(|p| [p.position[0], p.position[1], p.angle]).collect::<Vec<f64>>())
        })?;
        memory(py, &poses)
    }
}
