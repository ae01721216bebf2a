//! Model files out.

use super::{Model, Parameter, Per, Release};
use std::fmt::Write;

/// The name of a key, quoted where TOML needs it.
fn key(name: &str) -> String {
    if !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-') {
        name.to_string()
    } else {
        format!("{:?}", name)
    }
}

pub(super) fn entry(p: &Parameter) -> String {
    let mut s = format!("{} = {{ nominal = {:?}", p.name, p.nominal);
    let _ = write!(s, ", min = {:?}, max = {:?}", p.min, p.max);
    if p.frozen {
        s.push_str(", frozen = true");
    }
    match p.per {
        Per::All => {}
        Per::Group => s.push_str(", per = \"group\""),
        Per::Trajectory => s.push_str(", per = \"trajectory\""),
    }
    if let Some([low, high]) = p.ci95 {
        let _ = write!(s, ", ci95 = [{low:?}, {high:?}]");
    }
    if !p.groups.is_empty() {
        let groups: Vec<_> = p.groups.iter().map(|(n, v)| format!("{} = {v:?}", key(n))).collect();
        let _ = write!(s, ", groups = {{ {} }}", groups.join(", "));
    }
    s.push_str(" }\n");
    s
}

pub(super) fn to_toml(model: &Model) -> String {
    let mut s = String::from("scenario = \"ball\"\n\n[parameters]\n");
    for p in model.parameters.iter().filter(|p| model.declared.contains(&p.name)) {
        s.push_str(&entry(p));
    }
    let sensor = [("position_sd_m", model.position_sd_m), ("clock_reference_s", model.clock_reference_s)];
    if sensor.iter().any(|(_, value)| value.is_some()) {
        s.push_str("\n[sensor]\n");
    }
    for (name, value) in sensor {
        if let Some(value) = value {
            let _ = writeln!(s, "{name} = {value:?}");
        }
    }
    let release = match model.release {
        Release::Rest => "rest",
        Release::Free => "free",
    };
    let _ = write!(s, "\n[release]\nkind = \"{release}\"\n");
    for block in &model.effects {
        let _ = write!(s, "\n[[effect]]\nkind = \"{}\"\n", block.kind);
        if let Some(per) = block.scatter {
            let _ = writeln!(s, "per = \"{}\"", per.name());
        }
        if let Some(t) = &block.table {
            let values: Vec<_> = block.parameters.iter().map(|p| format!("{:?}", p.nominal)).collect();
            let _ = write!(
                s,
                "target = \"{}\"\nagainst = \"{}\"\nfirst = {:?}\nlast = {:?}\nvalues = [{}]\n",
                t.target.name(),
                t.against.name(),
                t.first,
                t.last,
                values.join(", ")
            );
        } else {
            block.parameters.iter().for_each(|p| s.push_str(&entry(p)));
        }
    }
    s
}
