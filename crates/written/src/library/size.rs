//! Units of what the numbers of inner parameters are multiples of.

use crate::model::Model;
use augsim_data::{Dimensions, Unit};

/// Text of the model that a name of a row stands for.
pub(super) fn meant(name: &str, names: &[(&'static str, String)]) -> String {
    names.iter().find(|(n, _)| *n == name).map_or_else(|| name.to_owned(), |(_, text)| text.clone())
}

/// The quantity that the numbers of a parameter are multiples of, in words and in the names of the model.
/// Nothing for a pure number.
pub(super) fn size_words(of: &str, names: &[(&'static str, String)]) -> Option<String> {
    let inner = |prefix: &str| Some(meant(of.strip_prefix(prefix)?.strip_suffix(')')?, names));
    let rms = |name: &str| format!("the root mean square of {}", meant(name, names));
    Some(match of {
        "1" => return None,
        "step" => "the time between samples".to_owned(),
        "1/step" => "the sampling rate".to_owned(),
        "duration" => "the length of a record".to_owned(),
        "turn" => "one turn a record".to_owned(),
        "rate" => format!("{} over {}", rms("v"), rms("x")),
        _ => match (inner("range("), inner("span("), inner("peak("), of.strip_prefix("1/")) {
            (Some(name), ..) => format!("the way from the least to the largest {name}"),
            (_, Some(name), ..) => format!("the range of {name}"),
            (_, _, Some(name), _) => format!("the largest {name}"),
            (.., Some(name)) => format!("one over {}", rms(name)),
            _ => rms(of),
        },
    })
}

/// Unit of what a parameter is measured in.
pub(crate) fn size_unit(of: &str, names: &[(&'static str, String)], model: &Model) -> Option<Unit> {
    let inner = ["range(", "span(", "peak("].iter().find_map(|p| of.strip_prefix(p)?.strip_suffix(')'));
    let of_name = |name: &str| -> Option<Dimensions> {
        let tree = model.tree_of(&meant(name, names))?;
        crate::model::dimensions_of(model, &tree)
    };
    let dimensions = match of {
        "1" => Dimensions::NONE,
        "step" | "duration" | "t" => Dimensions::TIME,
        "1/step" | "turn" | "rate" => Dimensions::NONE / Dimensions::TIME,
        _ => match (inner, of.strip_prefix("1/")) {
            (Some(name), _) => of_name(name)?,
            (None, Some(name)) => Dimensions::NONE / of_name(name)?,
            (None, None) => {
                // As its name states it, so that rad stays rad.
                let name = meant(of, names);
                let declared = model.state(&name).and_then(|i| model.states[i].unit);
                let input = model.inputs.iter().find(|i| i.name == name).and_then(|i| i.unit);
                match declared.or(input) {
                    Some(unit) => return Some(unit),
                    None => of_name(of)?,
                }
            }
        },
    };
    if dimensions.is_pure() {
        return Some(Unit::DIMENSIONLESS);
    }
    Unit::of_dimensions(dimensions)
}
