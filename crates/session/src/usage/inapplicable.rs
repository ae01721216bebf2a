//! Settings that do not apply to the request.

use std::fmt;

/// Why a setting does not apply to the request.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum Inapplicable {
    /// `effects --data` was given for a built-in model, whose effects have fixed scales.
    SizesOfBuiltIn,
    /// `--seen` was given without `--protocol filtered`.
    PrefixUnfiltered,
    /// `--protocol reconstruction` was given for a net of pushes, which can only forecast.
    ReconstructedPushes,
    /// `--require-pos-m` was given for an equation model, which need not measure a position.
    PositionOfEquations,
    /// `--require-pos-m` was given for a system that measures no position.
    PositionUnmeasured,
    /// `--net` was given for a reproduction that cannot train a single net.
    NetAlone,
    /// `--scenario` was given for a reproduction with only one scenario.
    OneScenario,
    /// A pool of recordings was given for a reproduction other than `next`.
    PoolOfReproduction,
    /// `--scenario flights` was given for the league, which has only ball and push.
    FlightsOfLeague,
    /// `--scenario flights` was given without the folder of the measured flights.
    FlightsUnmeasured { folder: &'static str },
    /// `--frame-clock` was given for time stamps without a constant frame period.
    NoFrames { input: String },
    /// `--start` or `--check` was given for a ball or a push; they are for equation models.
    StartOfBuiltIn,
    /// `--library none` was given for a ball or a push; formulas are searched for equation models only.
    FormulasOfBuiltIn,
    /// `evaluate A B` was given an option that is for one model.
    OptionOfTwoModels,
    /// `evaluate A B` was given a net of a ball or of pushes, which starts from other samples than a model file.
    NetBesideModel,
    /// `evaluate A B` was given models that predict no quantity in common.
    NothingInCommon,
    /// `--only` or `--exclude` was given with `--library none`.
    EffectsWithoutLibrary,
    /// `--exclude` names every effect of `--only`.
    EveryEffectExcluded,
    /// `--residual-of` was given for a recipe that uses no physics.
    PhysicsOfPlainNet { recipe: &'static str },
    /// `--sensor-sd` was given for a column that `--seen-columns` leaves out.
    SensorOfUnobserved { word: String, column: String },
    /// A net was requested for an equation model in memory; it needs the model file.
    NetOfEquations,
    /// A net of a ball or of pushes was given where a net of an equation model is needed.
    NoEquations,
    /// A reconstruction was requested of a net of an equation model, which can only forecast.
    ReconstructedEquations,
    /// A net of an equation model was given where measured initial states are needed.
    StartOfEquations,
}

impl fmt::Display for Inapplicable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Inapplicable::SizesOfBuiltIn => {
                "--data sets the scales of effects for equation models only; the effects of the ball and of pushing have fixed scales; leave it out"
            }
            Inapplicable::PrefixUnfiltered => "--seen is for --protocol filtered; add that option, or leave --seen out",
            Inapplicable::ReconstructedPushes => {
                "nets of pushes can only forecast; leave out --protocol reconstruction"
            }
            Inapplicable::PositionOfEquations => {
                "--require-pos-m is for runs of nets; an equation model need not measure a position"
            }
            Inapplicable::PositionUnmeasured => "--require-pos-m: this system measures no position in m",
            Inapplicable::NetAlone => "--net: only `reproduce push` trains one net alone; leave it out",
            Inapplicable::OneScenario => "--scenario is for `reproduce league` and `filtered` only; leave it out",
            Inapplicable::PoolOfReproduction => "POOL is for `reproduce next` only; give data with --data",
            Inapplicable::FlightsOfLeague => {
                "--scenario flights: the league has only ball and push; choose one of these, or leave it out"
            }
            Inapplicable::StartOfBuiltIn => {
                "--start and --check are for equation models (scenario = \"system\")"
            }
            Inapplicable::FormulasOfBuiltIn => {
                "--library none: formulas are searched for equation models only; leave it out"
            }
            Inapplicable::OptionOfTwoModels => {
                "--protocol and --require-pos-m are for one model; leave them out, or score the models one after the other"
            }
            Inapplicable::NetBesideModel => {
                "a net of a ball or of pushes starts from other samples than a model file; score the two one after the other"
            }
            Inapplicable::NothingInCommon => {
                "the two models predict no quantity of the same name and unit, so they cannot be compared"
            }
            Inapplicable::EffectsWithoutLibrary => {
                "--only and --exclude choose effects of the library, and --library none tries none of them; leave one of these options out"
            }
            Inapplicable::EveryEffectExcluded => {
                "--exclude names every effect that --only names, so no effect is left; leave one of these options out, or name other effects"
            }
            Inapplicable::NoEquations => {
                "this net was not trained on an equation model, so it needs measured initial states"
            }
            Inapplicable::ReconstructedEquations => {
                "--protocol reconstruction: nets of equation models can only forecast; leave it out"
            }
            Inapplicable::StartOfEquations => {
                "the states of an equation model are not measured; use `augsim evaluate RUN` or `augsim predict RUN`, which fit the \
                 initial state to the first samples (--burn-in)"
            }
            Inapplicable::NetOfEquations => {
                "a net for an equation model needs the model file: write the model to a file, and give its path"
            }
            Inapplicable::PhysicsOfPlainNet { recipe } => {
                return write!(
                    f,
                    "the recipe of {recipe} uses no physics; leave out --residual-of, or choose a hybrid recipe"
                );
            }
            Inapplicable::FlightsUnmeasured { folder } => {
                return write!(
                    f,
                    "--scenario flights: these are measured data; give the folder that contains `{folder}` with --data"
                );
            }
            Inapplicable::NoFrames { input } => {
                return write!(
                    f,
                    "--frame-clock: the time stamps of {input} have no constant frame period; leave it out"
                );
            }
            Inapplicable::SensorOfUnobserved { word, column } => {
                return write!(
                    f,
                    "--sensor-sd {word}: {column} is not observed; add it to --seen-columns, or leave this option out"
                );
            }
        })
    }
}
