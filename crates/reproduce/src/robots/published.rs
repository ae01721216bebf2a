//! Published values of an arm's friction and rotors, read from its files, beside those that a discovery found.

use augsim_discovery::Discovery;
use augsim_session::joints::JointResult;
use serde::Serialize;
use std::collections::BTreeMap;

/// What a published value is, and where a discovery has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Property {
    /// Coulomb friction of a joint, N m.
    Coulomb,
    /// Viscous friction of a joint, N m s/rad.
    Viscous,
    /// Inertia of a joint's rotor, kg m2.
    Rotor,
    /// Coulomb friction of a drive that turns with two joints, N m.
    CoupledCoulomb,
    /// Viscous friction of a drive that turns with two joints, N m s/rad.
    CoupledViscous,
    /// Inertia of a rotor that turns with two joints, kg m2.
    CoupledRotor,
}

impl Property {
    /// Name and unit of the property in tables.
    pub fn words(self) -> (&'static str, &'static str) {
        match self {
            Property::Coulomb => ("Coulomb friction", "N m"),
            Property::Viscous => ("viscous friction", "N m s/rad"),
            Property::Rotor => ("rotor inertia", "kg m2"),
            Property::CoupledCoulomb => ("coupled Coulomb friction", "N m"),
            Property::CoupledViscous => ("coupled viscous friction", "N m s/rad"),
            Property::CoupledRotor => ("coupled rotor inertia", "kg m2"),
        }
    }

    /// Kind of the effect with the property, and the name of its parameter.
    fn effect(self) -> (&'static str, &'static str) {
        match self {
            Property::Coulomb => ("coulomb", "f"),
            Property::Viscous => ("linear-damping", "c"),
            Property::Rotor => ("rotor-inertia", "J"),
            Property::CoupledCoulomb => ("coupled-coulomb", "f"),
            Property::CoupledViscous => ("coupled-damping", "c"),
            Property::CoupledRotor => ("coupled-inertia", "J"),
        }
    }

    /// Ending of the declared parameter with the property, after the name of the joint; empty if none can have it.
    fn parameter(self) -> &'static str {
        match self {
            Property::Coulomb => "_coulomb",
            Property::Viscous => "_viscous",
            Property::Rotor => "_armature_kg_m2",
            _ => "",
        }
    }
}

/// A published value of a joint; of a property of two joints that of the first.
#[derive(Debug, Clone, PartialEq)]
pub struct Published {
    pub joint: String,
    pub property: Property,
    pub value: f64,
}

/// A published value with the found one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Compared {
    pub joint: String,
    pub property: Property,
    pub unit: &'static str,
    pub published: f64,
    /// Found value with its 95 % interval; absent if the discovery found none that the data determine.
    pub found: Option<(f64, [f64; 2])>,
}

/// Finds the counterpart of each published value in a result: a parameter of an effect at the joint, or a declared one.
pub fn compare(list: Vec<Published>, found: &Discovery, joints: &[JointResult]) -> Vec<Compared> {
    let compared = |p: Published| {
        let (kind, parameter) = p.property.effect();
        let of_effect = joints
            .iter()
            .filter(|joint| joint.joint == p.joint)
            .flat_map(|joint| joint.effects.iter().filter(|effect| effect.kind == kind))
            .find_map(|effect| effect.parameters.iter().find(|own| own.name == parameter))
            .map(|own| &own.estimate);
        let ending = p.property.parameter();
        let of_parameter =
            (!ending.is_empty()).then(|| found.parameters.get(&format!("{}{ending}", p.joint))).flatten();
        let estimate = of_effect.or(of_parameter).filter(|estimate| estimate.not_identified.is_none());
        Compared {
            unit: p.property.words().1,
            published: p.value,
            found: estimate.map(|estimate| (estimate.value, estimate.ci95)),
            joint: p.joint,
            property: p.property,
        }
    };
    list.into_iter().map(compared).collect()
}

/// One line for each property: the joints' published and found values.
pub fn lines(list: &[Compared]) -> Vec<String> {
    let mut properties: Vec<Property> = list.iter().map(|c| c.property).collect();
    properties.sort_unstable();
    properties.dedup();
    let line = |property: Property| {
        let (name, unit) = property.words();
        let one = |c: &Compared| {
            let found = c.found.map_or("-".to_owned(), |(value, _)| format!("{value:.3}"));
            format!("{} {} ({found})", c.joint, c.published)
        };
        let values: Vec<String> = list.iter().filter(|c| c.property == property).map(one).collect();
        format!("{name}, published (found), {unit}: {}", values.join(", "))
    };
    properties.into_iter().map(line).collect()
}

/// Reads the lines `key : number` and `key : [number, ...]` of a YAML file, in which each key occurs once.
///
/// Other lines are skipped.
fn yaml_numbers(text: &str) -> BTreeMap<&str, Vec<f64>> {
    let entry = |line: &'_ str| -> Option<(usize, Vec<f64>)> {
        let colon = line.find(':')?;
        let value = line[colon + 1..].trim().trim_start_matches('[').trim_end_matches(']');
        let numbers = value.split(',').map(|n| n.trim().parse::<f64>());
        Some((colon, numbers.collect::<Result<Vec<f64>, _>>().ok()?))
    };
    let lines = text.lines().filter_map(|line| Some((line, entry(line)?)));
    lines
        .map(|(line, (colon, numbers))| (line[..colon].trim_start_matches([' ', '-']).trim(), numbers))
        .collect()
}

/// Reads the published values of the TX40 from the configuration file of its authors.
///
/// The wrist of this arm couples joints 5 and 6, whose coupled values are listed at joint 5.
pub fn tx40(yaml: &str) -> Vec<Published> {
    let numbers = yaml_numbers(yaml);
    let of = |key: &str, property: Property| {
        let values = numbers.get(key).cloned().unwrap_or_default();
        let one = move |(i, value)| Published { joint: format!("joint_{}", i + 1), property, value };
        values.into_iter().enumerate().map(one).collect::<Vec<Published>>()
    };
    let coupled = |key: &str, property: Property| {
        of(key, property).into_iter().map(|p| Published { joint: "joint_5".to_owned(), ..p })
    };
    let mut list = of("fs", Property::Coulomb);
    list.extend(of("fv", Property::Viscous));
    list.extend(of("Ia", Property::Rotor));
    list.extend(coupled("fsm6", Property::CoupledCoulomb));
    list.extend(coupled("fvm6", Property::CoupledViscous));
    list.extend(coupled("Iam6", Property::CoupledRotor));
    list
}
