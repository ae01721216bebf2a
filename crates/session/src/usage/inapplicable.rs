//! Settings that mean nothing for what was asked.

use std::fmt;

/// A setting that has nothing to act on.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum Inapplicable {
    /// `--data` of `effects`, for a model that is built in.
    SizesOfBuiltIn,
    /// `--seen` without `--protocol filtered`.
    SeenUnfiltered,
    /// `--protocol reconstruction` for a net of pushes.
    ReconstructedPushes,
    /// `--require-pos-m` for a model of equations.
    PositionOfEquations,
    /// `--require-pos-m` for a system that measures no position.
    PositionUnmeasured,
    /// `--net` for a reproduction that does not train one alone.
    NetAlone,
    /// `--scenario` for a reproduction that has one only.
    OneScenario,
    /// `--scenario flights` of the league.
    FlightsOfLeague,
    /// `--scenario flights` without measured flights.
    FlightsUnmeasured { folder: &'static str },
    /// `--frame-clock` for stamps that tell no frames.
    NoFrames { input: String },
    /// `--start` or `--check` for a ball or a push.
    StartOfBuiltIn,
    /// `--library none` for a ball or a push.
    FormulasOfBuiltIn,
    /// `--residual-of` for a recipe that reads no physics.
    PhysicsOfBlind { recipe: &'static str },
    /// `--sensor-sd` of a column that `--seen-columns` leaves out.
    SensorOfUnseen { word: String, column: String },
    /// A net beside a model of equations in memory.
    NetOfEquations,
    /// A net of a ball or of pushes where equations are needed.
    NoEquations,
    /// A reconstruction by a net of equations.
    ReconstructedEquations,
    /// A net of equations where a start is measured.
    StartOfEquations,
}

impl fmt::Display for Inapplicable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Inapplicable::SizesOfBuiltIn => {
                "--data gives sizes to models of equations; effects of the ball and of pushing have their own"
            }
            Inapplicable::SeenUnfiltered => "--seen is for --protocol filtered; add it, or leave --seen out",
            Inapplicable::ReconstructedPushes => {
                "nets of pushes only forecast; leave out --protocol reconstruction"
            }
            Inapplicable::PositionOfEquations => {
                "--require-pos-m is for runs of nets; a system of equations may measure no position"
            }
            Inapplicable::PositionUnmeasured => "--require-pos-m: this system measures no position in m",
            Inapplicable::NetAlone => "--net: only `reproduce push` trains one net alone; leave it out",
            Inapplicable::OneScenario => {
                "--scenario: only `reproduce league` and `reproduce filtered` have several; leave it out"
            }
            Inapplicable::FlightsOfLeague => {
                "--scenario flights: the league is of ball and push; leave it out, or choose one of these"
            }
            Inapplicable::StartOfBuiltIn => {
                "--start and --check are for models of equations (scenario = \"system\")"
            }
            Inapplicable::FormulasOfBuiltIn => {
                "--library none: formulas are looked for in models of equations only; leave it out"
            }
            Inapplicable::NoEquations => "the net corrects no system of equations; its start is measured",
            Inapplicable::ReconstructedEquations => {
                "--protocol reconstruction: nets of equations only forecast; leave it out"
            }
            Inapplicable::StartOfEquations => {
                "states of a system of equations are not measured: `augsim evaluate RUN` and `augsim predict RUN` start its nets from \
                 the first samples (--burn-in)"
            }
            Inapplicable::NetOfEquations => {
                "a net corrects a system of equations from its file: write the model, and give the path"
            }
            Inapplicable::PhysicsOfBlind { recipe } => {
                return write!(
                    f,
                    "the recipe of {recipe} reads no physics; leave out --residual-of, or choose a hybrid"
                );
            }
            Inapplicable::FlightsUnmeasured { folder } => {
                return write!(
                    f,
                    "--scenario flights: these are measured; give the folder of `{folder}` with --data"
                );
            }
            Inapplicable::NoFrames { input } => {
                return write!(
                    f,
                    "--frame-clock: the time stamps of {input} lie on no frames of one length; leave it out"
                );
            }
            Inapplicable::SensorOfUnseen { word, column } => {
                return write!(f, "--sensor-sd {word}: --seen-columns leaves {column} out");
            }
        })
    }
}
