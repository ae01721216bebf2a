//! Process noise: adds an input to the rate of each state that has it.

use super::EquationSystem;
use crate::error::ModelError;
use crate::model::{Hold, Input, RateNoise};
use crate::text::{Kind, Symbol, TreeNode};

impl EquationSystem {
    /// Lists the process noise of each state that has it, in the order of the states.
    pub fn process_noise(&self) -> Vec<RateNoise> {
        self.model().states.iter().filter_map(|state| state.process_noise).collect()
    }

    /// Returns this system with one more input for each state with process noise, after the inputs of the model.
    ///
    /// The additional input has zero-order hold and is added to the rate of the state.
    ///
    /// # Errors
    /// [`ModelError`]: the model does not compile.
    pub fn with_process_noise_inputs(&self) -> Result<Self, ModelError> {
        let mut model = self.model().clone();
        for state in model.states.iter_mut().filter(|state| state.process_noise.is_some()) {
            let input = Symbol::Input(model.inputs.len());
            let name = format!("push on {}", state.name);
            let rate = &mut state.rate.tree;
            let (before, span) = (rate.root(), 0..0);
            rate.nodes.push(TreeNode { kind: Kind::Symbol(input), span: span.clone() });
            rate.nodes.push(TreeNode { kind: Kind::Add(before, before + 1), span });
            model.inputs.push(Input { name, unit: None, hold: Some(Hold::Zero), delay: None });
        }
        self.with_equations(&model)
    }
}
