//! Models of a kind that a request does not take.

use std::fmt;

/// Why a request does not take a model.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum ModelFault {
    /// A net, of which no law can be written out.
    NetExported,
    /// A net, which is not simulated.
    NetSimulated,
    /// A ball or a push where `simulate` takes equations.
    BuiltInSimulated,
    /// A ball or a push without starts and times.
    BuiltInWithoutTimes,
    /// A ball or a push where `fit` takes equations.
    BuiltInFitted,
    /// An effect of a ball without a short law.
    BallEffectExported { kind: String },
    /// An effect of pushing without a short law.
    PushEffectExported { kind: String },
    /// The slope of an output, which no program can know.
    SlopeExported,
}

impl fmt::Display for ModelFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ModelFault::NetExported => "is a trained net, which has no law to write out",
            ModelFault::NetSimulated => "is a trained net; `augsim predict` gives its forecasts",
            ModelFault::BuiltInSimulated => {
                "simulate takes models of equations (scenario = \"system\"); drops and pushes come by --scenario"
            }
            ModelFault::BuiltInWithoutTimes => {
                "a ball or a push needs starts and times; name trajectories that have them: --like DATA"
            }
            ModelFault::BuiltInFitted => {
                "fit takes models of equations (scenario = \"system\"); use augsim discover for a ball or pushes"
            }
            ModelFault::SlopeExported => {
                "the slope of an output cannot be written out as a program; `--as latex` writes the formulas, and `augsim \
                 simulate` runs them"
            }
            ModelFault::BallEffectExported { kind } => {
                return write!(
                    f,
                    "the effect `{kind}` has no short law to write out; `--as latex` names it, and `augsim simulate` runs it"
                );
            }
            ModelFault::PushEffectExported { kind } => {
                return write!(
                    f,
                    "the effect `{kind}` has no short law to write out; `--as latex` has its formula, and `augsim simulate` \
                     and `augsim predict` run it"
                );
            }
        })
    }
}
