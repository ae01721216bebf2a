//! Model files: what is declared about a system, and what `discover` adds to it.

mod augment;
mod error;
mod expected;
mod groups;
mod open;
pub(crate) mod parameter;
mod parse;
mod push;
mod rule;
mod scenario;
mod template;
mod write;

use crate::ball::{Axes, BASE_PARAMETERS, LawRef, World};
use crate::effects::{Table, index_of};
use crate::system::ScatterPer;
use std::path::Path;

pub use error::{KnownKeys, ModelError};
pub use groups::{UnknownGroup, unknown_group};
pub use parameter::{NORMAL_95, Parameter, Per};
pub(crate) use parse::edit_distance;
pub use push::PushModel;
pub use rule::{Place, Rule};
pub use scenario::ModelFile;
pub use template::{TEMPLATES, template};

/// Reads a file and parses it by `parse(text, file)`.
fn read<T>(path: &Path, parse: fn(&str, &str) -> Result<T, ModelError>) -> Result<T, ModelError> {
    let file = path.display().to_string();
    match augsim_data::read_text(path) {
        Ok(text) => parse(&text, &file),
        Err(cause) => Err(ModelError::Read { file, cause }),
    }
}

/// An effect in the model.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectBlock {
    /// Kind, as in the library.
    pub kind: String,
    /// For the scatter of restitution: what one draw belongs to.
    pub scatter: Option<ScatterPer>,
    /// For a tabulated law: its shape; the parameters are the values at the knots.
    pub table: Option<Table>,
    /// Its parameters, in the order of the library.
    pub parameters: Vec<Parameter>,
}

/// How a trajectory begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Release {
    /// At rest at `t_s = 0`; the position is fitted for each trajectory.
    Rest,
    /// Position and velocity are fitted for each trajectory.
    #[default]
    Free,
}

/// A model of the bouncing ball.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Where it is from, for messages.
    pub file: String,
    /// The base parameters in the order of [`BASE_PARAMETERS`]; those not in the file are frozen at their defaults.
    pub parameters: Vec<Parameter>,
    /// Names of the base parameters that the file declares.
    pub declared: Vec<String>,
    /// Declared standard deviation of the position sensor, m.
    pub position_sd_m: Option<f64>,
    /// Session time that laws of the session clock count from, s; without it the mean of the data's start times.
    pub clock_reference_s: Option<f64>,
    /// How trajectories begin.
    pub release: Release,
    /// Effects in the model.
    pub effects: Vec<EffectBlock>,
}

impl Model {
    /// Reads a model file.
    ///
    /// # Errors
    /// [`ModelError`] names the file, the line and the remedy.
    pub fn read(path: &Path) -> Result<Self, ModelError> {
        read(path, Self::parse)
    }

    /// Parses the text of a model file; `file` is used in messages.
    ///
    /// ```
    /// use augsim_physics::model::Model;
    /// let text = "scenario = \"ball\"\n[parameters]\ngravity_m_s2 = { nominal = 9.81, frozen = true }\n";
    /// let model = Model::parse(text, "ball.toml").expect("a model");
    /// assert_eq!((model.parameters[0].nominal, model.parameters[0].frozen), (9.81, true));
    /// let error = Model::parse(&text.replace("gravity", "gravty"), "ball.toml").unwrap_err().to_string();
    /// assert!(error.contains("ball.toml") && error.contains("gravty_m_s2"), "{error}");
    /// ```
    ///
    /// # Errors
    /// [`ModelError`] names the file, the line and the remedy.
    pub fn parse(text: &str, file: &str) -> Result<Self, ModelError> {
        parse::parse(text, file)
    }

    /// Gravity and restitution, both with their usual bounds.
    pub fn plain(gravity_m_s2: f64, restitution: f64) -> Self {
        let mut parameters: Vec<_> = BASE_PARAMETERS.iter().map(|n| parse::base_default(n)).collect();
        parameters[0].nominal = gravity_m_s2;
        parameters[1].nominal = restitution;
        parameters[1].frozen = false;
        Self {
            file: "model".into(),
            parameters,
            declared: BASE_PARAMETERS[..2].iter().map(|s| s.to_string()).collect(),
            position_sd_m: None,
            clock_reference_s: None,
            release: Release::Free,
            effects: Vec::new(),
        }
    }

    /// The world of this model and the nominal parameter vector. Scatter is no law and has no place in the vector.
    pub fn world(&self, axes: Axes) -> (World, Vec<f64>) {
        let mut world = World::new(axes);
        let mut values: Vec<f64> = self.parameters.iter().map(|p| p.nominal).collect();
        for block in &self.effects {
            let law = match (&block.table, index_of(&block.kind)) {
                (Some(table), _) => LawRef::Table(table.clone()),
                (None, Some(index)) => LawRef::Listed(index),
                (None, None) => continue,
            };
            world.add(law, block.parameters.len());
            values.extend(block.parameters.iter().map(|p| p.nominal));
        }
        (world, values)
    }

    /// The model file's text; [`parse`](Model::parse) reads it back to the same model.
    ///
    /// ```
    /// use augsim_physics::model::Model;
    /// let model = Model::plain(9.81, 0.7);
    /// let again = Model::parse(&model.to_toml(), "model").expect("what was written can be read");
    /// assert_eq!(again.parameters, model.parameters);
    /// ```
    pub fn to_toml(&self) -> String {
        write::to_toml(self)
    }
}
