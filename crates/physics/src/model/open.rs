//! Construction of a system from a model file.

use super::{EffectBlock, Model, PushModel};
use crate::ball::{Axes, Ball, BallDeclaration};
use crate::push::effects::{SCATTER_KIND, index_of};
use crate::push::{PushDeclaration, Pushing};
use augsim_system::{Parameter, Scatter};

impl Model {
    /// Builds the ball, observed along `axes`; the random scatter is not among the system's parameters.
    pub fn open(&self, axes: Axes) -> Ball {
        self.open_with(axes, self.declares())
    }

    /// Builds the ball for data whose only position column is `height_column`.
    pub fn open_height(&self, height_column: &str) -> Ball {
        self.open_with(
            Axes::Vertical,
            BallDeclaration { height_column: Some(height_column.into()), ..self.declares() },
        )
    }

    fn open_with(&self, axes: Axes, declares: BallDeclaration) -> Ball {
        let (world, _) = self.world(axes);
        let blocks = self.effects.iter().filter(|b| b.scatter.is_none());
        Ball::new(world, with_effects(&self.parameters, blocks), self.release, declares)
    }

    /// What the file declares besides parameters and simulated effects: bounces, floor, noise, scatter.
    fn declares(&self) -> BallDeclaration {
        BallDeclaration {
            bounces: self.declared.iter().any(|p| p == "restitution"),
            floor: self.declared.iter().any(|p| p == "floor_height_m"),
            kinds: self.effects.iter().map(|b| b.kind.clone()).collect(),
            position_sd_m: self.position_sd_m,
            scatter: self.effects.iter().find_map(|b| {
                let p = b.parameters.first()?;
                Some(Scatter { per: b.scatter?, sd: p.nominal.max(MIN_SCATTER_SD), ci95: p.ci95 })
            }),
            height_column: None,
        }
    }
}

/// Lower bound of the start value of a declared scatter: from 0 the fit could not increase it.
const MIN_SCATTER_SD: f64 = 1e-4;

impl PushModel {
    /// Builds the object and rod; the random scatter is not among the system's parameters.
    pub fn open(&self) -> Pushing {
        let (world, _) = self.world();
        let blocks = self.effects.iter().filter(|b| index_of(&b.kind).is_some());
        let scatter = self.effects.iter().find(|b| b.kind == SCATTER_KIND).and_then(|b| b.parameters.first());
        let declares = PushDeclaration {
            effect_kinds: self.effects.iter().map(|b| b.kind.clone()).collect(),
            position_sd_m: self.position_sd_m,
            angle_sd_rad: self.angle_sd_rad,
            scatter_sd_m: scatter.map(|p| p.nominal),
            scatter_ci95_m: scatter.and_then(|p| p.ci95),
        };
        Pushing::new(world, with_effects(&self.parameters, blocks), declares)
    }
}

/// Parameters of the system: base parameters, then those of the effects.
fn with_effects<'a>(base: &[Parameter], blocks: impl Iterator<Item = &'a EffectBlock>) -> Vec<Parameter> {
    base.iter().chain(blocks.flat_map(|b| &b.parameters)).cloned().collect()
}
