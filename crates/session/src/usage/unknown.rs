//! Errors of unknown names, which list the known ones.

use augsim_data::escaped_short;
use std::fmt;
use std::path::PathBuf;

/// Error: a name in the request is unknown; the variant says of what.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(missing_docs, reason = "Display shows them")]
pub enum UnknownName {
    /// No converter of published data sets has this name.
    Converter { name: String, known: Vec<&'static str> },
    /// No library of effects and no effect has this name.
    Effect { name: String, nearest: Vec<&'static str> },
    /// No candidate effect of this model has this name.
    EffectOn { name: String, model: PathBuf, nearest: Vec<String> },
    /// The effect is known, but cannot be applied to this model.
    PlaceOfEffect { kind: String, model: PathBuf },
    /// No built-in model file has this name.
    Model { name: String },
    /// The discovery in this folder has no figure of this name.
    Figure { folder: PathBuf, name: String, known: Vec<String> },
    /// No pushed object has this name.
    Object { name: String, known: &'static [&'static str] },
    /// No support sheet for pushed objects has this name.
    Surface { name: String, known: Vec<&'static str> },
    /// The equation model has no input with the name in `--input`.
    OptionInput { name: String, known: Vec<String> },
    /// The equation model has no state with the name in `--start`.
    OptionState { name: String, known: Vec<String> },
    /// There is no column with the name in `option`.
    Column { option: &'static str, name: String, known: Vec<String> },
    /// No trajectory is in the group with this name.
    Group { name: String, data: String, known: Vec<String> },
    /// No recipe of a net has this name.
    Recipe { name: String, known: Vec<&'static str> },
    /// No data check has this name.
    Check { name: String, known: Vec<&'static str> },
}

impl fmt::Display for UnknownName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        use UnknownName as Name;
        match self {
            Name::Converter { name, known } => write!(
                f,
                "no converter is called `{name}`; there are {}; use it as: augsim data convert SET IN OUT.csv",
                known.join(", ")
            ),
            Name::Effect { name, nearest } => write!(
                f,
                "no library and no effect is called `{}`; did you mean {}? augsim effects lists all",
                escaped_short(name),
                nearest.join(" or ")
            ),
            Name::EffectOn { name, model, nearest } => {
                let (name, model) = (escaped_short(name), model.display());
                write!(f, "no effect for {model} is called `{name}`; ")?;
                if !nearest.is_empty() {
                    write!(f, "did you mean {}? ", nearest.join(" or "))?;
                }
                write!(f, "augsim effects --for {model} lists all")
            }
            Name::PlaceOfEffect { kind, model } => write!(
                f,
                "the effect `{kind}` cannot be applied to {0}; augsim effects --for {0} lists the effects that can",
                model.display()
            ),
            Name::Model { name } => write!(f, "no model is called {name}"),
            Name::Figure { folder, name, known } => {
                write!(f, "{}: has no figure `{name}`; it has {}", folder.display(), known.join(", "))
            }
            Name::Object { name, known } => {
                write!(f, "there is no object `{}`; choose one of {}", escaped_short(name), known.join(", "))
            }
            Name::Surface { name, known } => {
                write!(f, "there is no surface `{}`; choose one of {}", escaped_short(name), known.join(", "))
            }
            Name::OptionInput { name, known } => {
                write!(f, "--input {name}: the model has no such input; it has {}", names_or_none(known))
            }
            Name::OptionState { name, known } => {
                write!(f, "--start {name}: the model has no such state; it has {}", names_or_none(known))
            }
            Name::Column { option, name, known } => {
                write!(f, "{option} {name}: there is no such column; the columns are {}", known.join(", "))
            }
            Name::Group { name, data, known } => {
                write!(f, "--group {name}: no trajectory is in this group; ")?;
                match &known[..] {
                    [] => write!(f, "{data} has no column `group`; leave --group out"),
                    known => write!(f, "{data} has {}", known.join(", ")),
                }
            }
            Name::Recipe { name, known } => write!(f, "recipe {name}: there are {}", known.join(", ")),
            Name::Check { name, known } => {
                write!(f, "accept: no check is called {name}; there are {}", known.join(", "))
            }
        }
    }
}

/// Joins names with commas for a message; `none` if there are none.
pub(super) fn names_or_none(names: &[String]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}
