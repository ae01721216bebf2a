//! Model files of the built-in systems: parsing, writing, and inserting the results of a fit.

mod augment;
mod error;
mod expected;
mod groups;
mod open;
mod parse;
mod push;
mod rule;
mod scenario;
mod template;
mod write;

use crate::ball::effects::{Table, index_of};
use crate::ball::{Axes, BASE_PARAMETERS, LawRef, World};
use augsim_system::{Parameter, ScatterPer};
use std::path::Path;

pub use error::{KnownKeys, ModelError};
pub use push::PushModel;
pub use rule::{Place, Rule};
pub use scenario::ModelFile;
pub use template::{TEMPLATES, template};

/// Reads a model file and parses it with `parse(text, file)`.
fn read<T>(path: &Path, parse: fn(&str, &str) -> Result<T, ModelError>) -> Result<T, ModelError> {
    let file = path.display().to_string();
    match augsim_data::read_text(path) {
        Ok(text) => parse(&text, &file),
        Err(cause) => Err(ModelError::Read { file, cause }),
    }
}

/// An `[[effect]]` block of a model file: one effect with its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectBlock {
    /// Kind of the effect in the effect library.
    pub kind: String,
    /// For a random effect: whether it is drawn per event or per record; `None` for other effects.
    pub scatter: Option<ScatterPer>,
    /// For a table: its target, feature and range; the parameters are the values at the knots. Else `None`.
    pub table: Option<Table>,
    /// Parameters of the effect, in the order of the library.
    pub parameters: Vec<Parameter>,
}

/// How the initial state of each trajectory is determined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Release {
    /// The ball is released at rest at `t_s = 0`; only its position is estimated for each trajectory.
    Rest,
    /// Initial position and velocity are estimated for each trajectory.
    #[default]
    Free,
}

/// A model of the bouncing ball, as read from a model file.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Path of the model file, for messages.
    pub file: String,
    /// Base parameters in the order of [`BASE_PARAMETERS`]; frozen defaults if not in the file.
    pub parameters: Vec<Parameter>,
    /// Names of the base parameters that the file declares.
    pub declared: Vec<String>,
    /// Declared standard deviation of the position sensor, m; `None` if not declared.
    pub position_sd_m: Option<f64>,
    /// Reference time of the session clock, s; `None`: the mean of the data's start times.
    pub clock_reference_s: Option<f64>,
    /// How the initial state of each trajectory is determined.
    pub release: Release,
    /// Effects that the model file declares.
    pub effects: Vec<EffectBlock>,
}

impl Model {
    /// Reads and parses the model file of a ball.
    ///
    /// # Errors
    /// [`ModelError`], with file, line and remedy.
    pub fn read(path: &Path) -> Result<Self, ModelError> {
        read(path, Self::parse)
    }

    /// Parses the text of a ball's model file; `file` is used in messages.
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
    /// [`ModelError`], with file, line and remedy.
    pub fn parse(text: &str, file: &str) -> Result<Self, ModelError> {
        parse::parse(text, file)
    }

    /// A model without effects; gravity is frozen, restitution is calibrated.
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

    /// Effects and nominal parameter vector of the model; random effects are not part of either.
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

    /// Text of the model file; [`parse`](Model::parse) reads it back to the same model.
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
