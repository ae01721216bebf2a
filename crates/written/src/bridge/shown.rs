//! A system that shows its states, for filters that follow them.

use super::WrittenSystem;
use crate::error::ModelError;
use crate::library::Motion;
use crate::model::{Expression, Output};
use crate::text::{Kind, Symbol, Tree, TreeNode};

impl WrittenSystem {
    /// This system with every state as a channel behind its outputs, in the order of the schema's states. Records of this system
    /// are records of that one.
    ///
    /// # Errors
    /// [`ModelError`]: the model does not compile.
    pub fn showing_states(&self) -> Result<Self, ModelError> {
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
            });
        }
        self.with_equations(&model)
    }

    /// States whose equation is one of force or of flow: their rates may be pushed by what the model does not have. The others have
    /// another state as their rate, or came with an effect.
    pub fn pushed_states(&self) -> Vec<usize> {
        let mut states = Motion::of(self.model()).laws();
        states.sort_unstable();
        states
    }
}
