//! An effect that a discovery has added to the declared model of pushing.

use augsim_physics::model::EffectBlock;
use augsim_physics::push::World;
use augsim_physics::push::effects::{all, index_of, nearest_kind};
use serde::{Deserialize, Serialize};

/// An effect of the library with its numbers filled in.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Named", into = "Named")]
pub struct PushEffect {
    /// Place in the library.
    index: usize,
    /// Values of its parameters, in the order of the library.
    values: Vec<f64>,
}

/// What configurations and checkpoints hold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Named {
    kind: String,
    #[serde(default)]
    values: Vec<f64>,
}

impl PushEffect {
    /// The effect of a model file at its nominal values; `None` for the scatter of friction, which is no law and is left
    /// to the net.
    pub fn of(block: &EffectBlock) -> Option<Self> {
        let index = index_of(&block.kind)?;
        Some(PushEffect { index, values: block.parameters.iter().map(|p| p.nominal).collect() })
    }

    /// Its kind.
    pub fn kind(&self) -> &'static str {
        all::<f64>()[self.index].spec().kind
    }

    /// Adds the law to a world and its values to the parameters.
    pub(super) fn enter(&self, world: &mut World, parameters: &mut Vec<f64>) {
        world.add(self.index);
        parameters.extend(&self.values);
    }
}

impl TryFrom<Named> for PushEffect {
    type Error = String;
    fn try_from(Named { kind, values }: Named) -> Result<Self, String> {
        let index = index_of(&kind).ok_or_else(|| {
            format!("there is no effect `{kind}` of pushing; did you mean `{}`?", nearest_kind(&kind))
        })?;
        let names: Vec<&str> = all::<f64>()[index].spec().parameters.iter().map(|p| p.name).collect();
        match names.len() == values.len() {
            true => Ok(PushEffect { index, values }),
            false => Err(format!(
                "effect `{kind}` has {} values; give one each for: {}",
                values.len(),
                names.join(", ")
            )),
        }
    }
}

impl From<PushEffect> for Named {
    fn from(effect: PushEffect) -> Self {
        Named { kind: effect.kind().to_owned(), values: effect.values }
    }
}
