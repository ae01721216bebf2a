//! Sizes that numbers in library rows are multiples of: their units, and their description for users.

use crate::model::Model;
use augsim_data::{Dimensions, Unit};

/// The text of the model that replaces a name in a library row; the name itself if none does.
pub(super) fn resolve_name(name: &str, names: &[(&'static str, String)]) -> String {
    names.iter().find(|(n, _)| *n == name).map_or_else(|| name.to_owned(), |(_, text)| text.clone())
}

/// Describes for users the quantity whose size a parameter's numbers are multiples of; `None` for a pure number.
pub(super) fn describe_size(of: &str, names: &[(&'static str, String)]) -> Option<String> {
    let inner = |prefix: &str| Some(resolve_name(of.strip_prefix(prefix)?.strip_suffix(')')?, names));
    let rms = |name: &str| format!("the root mean square of {}", resolve_name(name, names));
    Some(match of {
        "1" => return None,
        "step" => "the time between samples".to_owned(),
        "1/step" => "the sampling rate".to_owned(),
        "duration" => "the length of a record".to_owned(),
        "turn" => "one oscillation per record".to_owned(),
        "reversal" => {
            format!("the distance {} passes between samples at a reversal", resolve_name("x", names))
        }
        "rate" => format!("{} over {}", rms("v"), rms("x")),
        _ => match (inner("range("), inner("span("), inner("peak("), of.strip_prefix("1/")) {
            (Some(name), ..) => format!("the range of {name} above its smallest value"),
            (_, Some(name), ..) => format!("the range of {name}"),
            (_, _, Some(name), _) => format!("the largest {name}"),
            (.., Some(name)) => format!("one over {}", rms(name)),
            _ => rms(of),
        },
    })
}

/// Unit of the quantity whose size a parameter's numbers are multiples of.
pub(crate) fn size_unit(of: &str, names: &[(&'static str, String)], model: &Model) -> Option<Unit> {
    let argument = ["range(", "span(", "peak("].iter().find_map(|p| of.strip_prefix(p)?.strip_suffix(')'));
    let dimensions_of_name = |name: &str| -> Option<Dimensions> {
        let tree = model.tree_of(&resolve_name(name, names))?;
        crate::model::dimensions_of(model, &tree)
    };
    let dimensions = match of {
        "1" => Dimensions::NONE,
        "step" | "duration" | "t" => Dimensions::TIME,
        "1/step" | "turn" | "rate" => Dimensions::NONE / Dimensions::TIME,
        _ => match (argument, of.strip_prefix("1/")) {
            (Some(name), _) => dimensions_of_name(name)?,
            (None, Some(name)) => Dimensions::NONE / dimensions_of_name(name)?,
            (None, None) => {
                // The declared unit is kept, so that rad does not become a pure number.
                let name = resolve_name(of, names);
                let declared = model.state(&name).and_then(|i| model.states[i].unit);
                let input = model.inputs.iter().find(|i| i.name == name).and_then(|i| i.unit);
                match declared.or(input) {
                    Some(unit) => return Some(unit),
                    None => dimensions_of_name(of)?,
                }
            }
        },
    };
    if dimensions.is_pure() {
        return Some(Unit::DIMENSIONLESS);
    }
    Unit::from_dimensions(dimensions)
}
