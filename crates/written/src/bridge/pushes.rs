//! A system whose shaken rates are pushed by inputs, for runs in which the motion has noise of its own.

use super::WrittenSystem;
use crate::error::ModelError;
use crate::model::{Hold, Input, Shaken};
use crate::text::{Kind, Symbol, TreeNode};

impl WrittenSystem {
    /// Noise of the motion by shaken state, in the order of the states.
    pub fn shaken(&self) -> Vec<Shaken> {
        self.model().states.iter().filter_map(|state| state.shaken).collect()
    }

    /// This system with one input more for each shaken state, behind those of the model: its value is held from sample to sample and
    /// added to the rate.
    ///
    /// # Errors
    /// [`ModelError`]: the model does not compile.
    pub fn with_pushes(&self) -> Result<Self, ModelError> {
        let mut model = self.model().clone();
        for state in model.states.iter_mut().filter(|state| state.shaken.is_some()) {
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
