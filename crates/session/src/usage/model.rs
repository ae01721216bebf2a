//! Kinds of models that a request does not support.

use std::fmt;

/// Why a request does not support a model.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum ModelFault {
    /// A net, which cannot be exported as formulas.
    NetExported,
    /// A net, which cannot be simulated.
    NetSimulated,
    /// A ball or a push where `simulate` needs an equation model.
    BuiltInSimulated,
    /// A ball or a push without initial states and times.
    BuiltInWithoutTimes,
    /// A ball or a push where `fit` needs an equation model.
    BuiltInFitted,
    /// An effect of a ball that has no short formula.
    BallEffectExported { kind: String },
    /// An effect of pushing that has no short formula.
    PushEffectExported { kind: String },
}

impl fmt::Display for ModelFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ModelFault::NetExported => "is a trained net, which cannot be exported as formulas",
            ModelFault::NetSimulated => "is a trained net; `augsim predict` gives its forecasts",
            ModelFault::BuiltInSimulated => {
                "simulate needs an equation model (scenario = \"system\"); use --scenario to generate drops and pushes"
            }
            ModelFault::BuiltInWithoutTimes => {
                "a ball or a push needs initial states and times; give trajectories that have them: --like DATA"
            }
            ModelFault::BuiltInFitted => {
                "fit needs an equation model (scenario = \"system\"); use augsim discover for a ball or pushes"
            }
            ModelFault::BallEffectExported { kind } => {
                return write!(
                    f,
                    "the effect `{kind}` has no short formula to export; use `--as latex`, which names it, or `augsim simulate`, which \
                     runs it"
                );
            }
            ModelFault::PushEffectExported { kind } => {
                return write!(
                    f,
                    "the effect `{kind}` cannot be exported as a program; use `--as latex` for its formula, or `augsim simulate` and \
                     `augsim predict`, which run it"
                );
            }
        })
    }
}
