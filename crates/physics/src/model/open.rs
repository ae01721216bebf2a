//! From a model file to the system that it declares.

use super::{EffectBlock, Model, Parameter, PushModel};
use crate::ball::{Axes, Ball};
use crate::push::Pushing;
use crate::push::effects::index_of;

impl Model {
    /// The declared ball, observed along `axes`. Scatter is no law and has no place in the system's parameters.
    pub fn open(&self, axes: Axes) -> Ball {
        let (world, _) = self.world(axes);
        let blocks = self.effects.iter().filter(|b| b.scatter.is_none());
        Ball::new(world, with_effects(&self.parameters, blocks), self.release)
    }
}

impl PushModel {
    /// The declared object and rod. Scatter is no law and has no place in the system's parameters.
    pub fn open(&self) -> Pushing {
        let (world, _) = self.world();
        let blocks = self.effects.iter().filter(|b| index_of(&b.kind).is_some());
        Pushing::new(world, with_effects(&self.parameters, blocks))
    }
}

/// Base parameters, then those of the effects, as they stand in the world's vector.
fn with_effects<'a>(base: &[Parameter], blocks: impl Iterator<Item = &'a EffectBlock>) -> Vec<Parameter> {
    base.iter().chain(blocks.flat_map(|b| &b.parameters)).cloned().collect()
}
