//! Units of what the numbers of inner parameters are multiples of.

use crate::model::Model;
use augsim_data::{Dimensions, Unit};

/// Text of the model that a name of a row stands for.
pub(super) fn meant(name: &str, names: &[(&'static str, String)]) -> String {
    names.iter().find(|(n, _)| *n == name).map_or_else(|| name.to_owned(), |(_, text)| text.clone())
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
