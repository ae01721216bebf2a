//! From a model file to the system that it declares.

use super::{EffectBlock, Model, Parameter, PushModel};
use crate::ball::{Axes, Ball, Declares};
use crate::push::effects::{SCATTER_KIND, index_of};
use crate::push::{PushDeclares, Pushing};
use crate::system::Scatter;

impl Model {
    /// The declared ball, observed along `axes`. Scatter is no law and has no place in the system's parameters.
    pub fn open(&self, axes: Axes) -> Ball {
        let (world, _) = self.world(axes);
        let blocks = self.effects.iter().filter(|b| b.scatter.is_none());
        Ball::new(world, with_effects(&self.parameters, blocks), self.release, self.declares())
    }

    /// The declared ball in data whose only column of position is `height_column`.
    pub fn open_height(&self, height_column: &str) -> Ball {
        let (world, _) = self.world(Axes::Vertical);
        let blocks = self.effects.iter().filter(|b| b.scatter.is_none());
        let declares = Declares { height_column: Some(height_column.into()), ..self.declares() };
        Ball::new(world, with_effects(&self.parameters, blocks), self.release, declares)
    }

    fn declares(&self) -> Declares {
        Declares {
            bounces: self.declared.iter().any(|p| p == "restitution"),
            floor: self.declared.iter().any(|p| p == "floor_height_m"),
            kinds: self.effects.iter().map(|b| b.kind.clone()).collect(),
            position_sd_m: self.position_sd_m,
            scatter: self.effects.iter().find_map(|b| {
                let p = b.parameters.first()?;
                Some(Scatter { per: b.scatter?, sd: p.nominal.max(LEAST_SCATTER), ci95: p.ci95 })
            }),
            height_column: None,
        }
    }
}

/// A scatter that a file declares begins at no less: at 0 it could not grow.
const LEAST_SCATTER: f64 = 1e-4;

impl PushModel {
    /// The declared object and rod. Scatter is no law and has no place in the system's parameters.
    pub fn open(&self) -> Pushing {
        let (world, _) = self.world();
        let blocks = self.effects.iter().filter(|b| index_of(&b.kind).is_some());
        let scatter = self.effects.iter().find(|b| b.kind == SCATTER_KIND).and_then(|b| b.parameters.first());
        let declares = PushDeclares {
            kinds: self.effects.iter().map(|b| b.kind.clone()).collect(),
            position_sd_m: self.position_sd_m,
            angle_sd_rad: self.angle_sd_rad,
            scatter_sd_m: scatter.map(|p| p.nominal),
            scatter_ci95_m: scatter.and_then(|p| p.ci95),
        };
        Pushing::new(world, with_effects(&self.parameters, blocks), declares)
    }
}

/// Base parameters, then those of the effects, as they stand in the world's vector.
fn with_effects<'a>(base: &[Parameter], blocks: impl Iterator<Item = &'a EffectBlock>) -> Vec<Parameter> {
    base.iter().chain(blocks.flat_map(|b| &b.parameters)).cloned().collect()
}
