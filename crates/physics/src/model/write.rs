//! Writer of model files; the `toml` crate formats and escapes all values and user-defined names.

use super::{Model, Release};
use crate::ball::effects::scatter_word;
use augsim_system::{Parameter, Per};
use serde::{Serialize, Serializer};
use std::fmt::Write;

/// Formats a value as TOML: strings quoted, lists and tables in one line.
pub(super) fn value(v: &(impl Serialize + ?Sized)) -> String {
    let mut text = String::new();
    // Cannot fail for numbers, strings, and lists and tables of these.
    match v.serialize(toml::ser::ValueSerializer::new(&mut text)) {
        Ok(_) => text,
        Err(_) => String::new(),
    }
}

/// Inline table of a parameter, as it is written to a model file.
#[derive(Serialize)]
struct Entry<'a> {
    nominal: f64,
    min: f64,
    max: f64,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    frozen: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    per: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ci95: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "<[_]>::is_empty", serialize_with = "as_map")]
    groups: &'a [(String, f64)],
}

/// Serialises pairs of group name and value as a map.
fn as_map<S: Serializer>(groups: &[(String, f64)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(groups.iter().map(|(name, value)| (name, value)))
}

/// Line of a model file that declares the parameter `p`.
pub(super) fn entry(p: &Parameter) -> String {
    let table = Entry {
        nominal: p.nominal,
        min: p.min,
        max: p.max,
        frozen: p.frozen,
        per: match p.per {
            Per::All => None,
            Per::Group => Some("group"),
            Per::Trajectory => Some("trajectory"),
        },
        ci95: p.ci95,
        groups: &p.groups,
    };
    format!("{} = {}\n", p.name, value(&table))
}

/// Text of the model file of a ball model.
pub(super) fn to_toml(model: &Model) -> String {
    let mut s = String::from("scenario = \"ball\"\n\n[parameters]\n");
    for p in model.parameters.iter().filter(|p| model.declared.contains(&p.name)) {
        s.push_str(&entry(p));
    }
    let sensor = [("position_sd_m", model.position_sd_m), ("clock_reference_s", model.clock_reference_s)];
    if sensor.iter().any(|(_, value)| value.is_some()) {
        s.push_str("\n[sensor]\n");
    }
    // Writing to a string cannot fail.
    for (name, number) in sensor {
        if let Some(number) = number {
            let _ = writeln!(s, "{name} = {}", value(&number));
        }
    }
    let release = match model.release {
        Release::Rest => "rest",
        Release::Free => "free",
    };
    let _ = write!(s, "\n[release]\nkind = {}\n", value(release));
    for block in &model.effects {
        let _ = write!(s, "\n[[effect]]\nkind = {}\n", value(&block.kind));
        if let Some(per) = block.scatter {
            let _ = writeln!(s, "per = {}", value(scatter_word(per)));
        }
        if let Some(t) = &block.table {
            let knots: Vec<f64> = block.parameters.iter().map(|p| p.nominal).collect();
            let rows = [
                ("target", value(t.target.name())),
                ("against", value(t.feature.name())),
                ("first", value(&t.first)),
                ("last", value(&t.last)),
                ("values", value(&knots)),
            ];
            for (name, text) in rows {
                let _ = writeln!(s, "{name} = {text}");
            }
        } else {
            block.parameters.iter().for_each(|p| s.push_str(&entry(p)));
        }
    }
    s
}
