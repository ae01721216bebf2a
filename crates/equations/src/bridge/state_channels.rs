//! A system whose states are additional outputs, for filters that estimate them.

use super::EquationSystem;
use crate::error::ModelError;
use crate::library::Kinematics;
use crate::model::{Expression, Output};
use crate::text::{Kind, Symbol, Tree, TreeNode};

impl EquationSystem {
    /// Returns this system with every state as a channel after its outputs, in the order of the schema's states.
    ///
    /// Records of this system are valid for the returned one as well.
    ///
    /// # Errors
    /// [`ModelError`]: the model does not compile.
    pub fn with_states_as_channels(&self) -> Result<Self, ModelError> {
        let mut model = self.model().clone();
        for (index, state) in self.model().states.iter().enumerate() {
            let node = TreeNode { kind: Kind::Symbol(Symbol::State(index)), span: 0..state.name.len() };
            let tree = Tree { text: state.name.clone(), nodes: vec![node] };
            model.outputs.push(Output {
                name: state.name.clone(),
                unit: state.unit,
                value: Expression { tree, line: state.line, key: format!("states.{}", state.name) },
                sd: None,
                range: None,
                step: None,
                noise: None,
                period: None,
                low_pass_hz: None,
            });
        }
        self.with_equations(&model)
    }

    /// Indices of the states with a force or flow equation, on whose rates unmodelled effects may act.
    ///
    /// Every other state has another state as its rate, or belongs to an effect.
    pub fn process_noise_states(&self) -> Vec<usize> {
        let mut states = Kinematics::from_model(self.model()).force_and_flow_states();
        states.sort_unstable();
        states
    }
}
