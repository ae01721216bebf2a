//! Kinds of models that a request does not support.

use crate::next::NextFault;
use std::fmt;

/// Why a request does not support a model.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum ModelFault {
    /// The model is a net, which cannot be exported as formulas.
    NetExported,
    /// The model has no robot, which an export as URDF or MJCF needs.
    NoRobotExported,
    /// An FMU is to be printed, but it is an archive.
    FmuWithoutFile,
    /// The model is a ball or a push, which cannot be exported as an FMU.
    BuiltInFmu,
    /// The model is a net, which cannot be simulated.
    NetSimulated,
    /// The model is a ball or a push, but `simulate` needs an equation model.
    BuiltInSimulated,
    /// The model is a ball or a push, and the request gives no initial states and times.
    BuiltInWithoutTimes,
    /// The model is a ball or a push, but `fit` needs an equation model.
    BuiltInFitted,
    /// The ball model has an effect without a short formula, which cannot be exported.
    BallEffectExported { kind: String },
    /// The pushing model has an effect without a short formula, which cannot be exported.
    PushEffectExported { kind: String },
    /// The next experiment cannot be designed or judged for the model, folder or file of limits.
    Next(NextFault),
}

impl fmt::Display for ModelFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ModelFault::NetExported => "is a trained net, which cannot be exported as formulas",
            ModelFault::NoRobotExported => {
                "has no [robot] section, so there is no robot to export as URDF or MJCF; use --as latex, python, c or fmu, or make a \
                 model of a robot with `augsim model from-robot`"
            }
            ModelFault::FmuWithoutFile => "an FMU is an archive, which is not printed; name its file with --out, as in --out MODEL.fmu",
            ModelFault::BuiltInFmu => {
                "only equation models (scenario = \"system\") can be exported as an FMU; use --as c or --as python for a ball or pushes"
            }
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
            ModelFault::Next(fault) => return fault.fmt(f),
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
