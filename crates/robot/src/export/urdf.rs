//! New values in a URDF file.

use super::edits::Edits;
use super::number::{number, numbers};
use super::{Changes, JointChange, Target};
use crate::description::Inertia;
use crate::xml::Element;

/// Names of the elements of the tensor, in the order of [`Inertia::inertia_kg_m2`].
pub(super) const TENSOR: [&str; 6] = ["ixx", "iyy", "izz", "ixy", "ixz", "iyz"];

/// Puts the changes into the file; armature and stiffness become comments.
pub(super) fn edit(target: &Target, changes: &Changes, edits: &mut Edits) {
    for (link, inertia) in &changes.inertias {
        let Some(element) = target.elements.links[*link] else { continue };
        match element.child("inertial") {
            Some(inertial) => change_inertial(inertial, target.robot.links[*link].inertia, inertia, edits),
            None => edits.insert(element, &inertial_element(inertia), true),
        }
    }
    for (joint, change) in &changes.joints {
        if let Some(element) = target.elements.joints[*joint] {
            change_joint(element, &target.robot.joints[*joint].name, change, edits);
        }
    }
}

/// An `<inertial>` in one line.
pub(super) fn inertial_element(inertia: &Inertia) -> String {
    let values: Vec<String> = TENSOR
        .iter()
        .zip(inertia.inertia_kg_m2)
        .map(|(name, value)| format!("{name}=\"{}\"", number(value)))
        .collect();
    format!(
        "<inertial><origin xyz=\"{}\" rpy=\"0 0 0\"/><mass value=\"{}\"/><inertia {}/></inertial>",
        numbers(&inertia.centre_m),
        number(inertia.mass_kg),
        values.join(" ")
    )
}

/// Changes the numbers of an `<inertial>` that differ.
fn change_inertial(inertial: Element, old: Option<Inertia>, new: &Inertia, edits: &mut Edits) {
    let tensor_changes = old.is_none_or(|old| old.inertia_kg_m2 != new.inertia_kg_m2);
    match inertial.child("origin") {
        Some(origin) => {
            if new.centre_m != [0.0; 3] || origin.attribute("xyz").is_some() {
                edits.set_vector(origin, "xyz", new.centre_m);
            }
            // The new tensor is along the axes of the link.
            if tensor_changes && origin.attribute("rpy").is_some() {
                edits.set_vector(origin, "rpy", [0.0; 3]);
            }
        }
        None if new.centre_m != [0.0; 3] => {
            edits.insert(
                inertial,
                &format!("<origin xyz=\"{}\" rpy=\"0 0 0\"/>", numbers(&new.centre_m)),
                true,
            );
        }
        None => {}
    }
    if let Some(mass) = inertial.child("mass") {
        edits.set_number(mass, "value", new.mass_kg);
    }
    if !tensor_changes {
        return;
    }
    match inertial.child("inertia") {
        Some(tensor) => {
            for (name, value) in TENSOR.iter().zip(new.inertia_kg_m2) {
                if value != 0.0 || tensor.attribute(name).is_some() {
                    edits.set_number(tensor, name, value);
                }
            }
        }
        None => {
            let values = TENSOR
                .iter()
                .zip(new.inertia_kg_m2)
                .map(|(name, value)| format!("{name}=\"{}\"", number(value)));
            edits.insert(inertial, &format!("<inertia {}/>", values.collect::<Vec<_>>().join(" ")), false);
        }
    }
}

/// Changes the friction of a joint.
fn change_joint(element: Element, name: &str, change: &JointChange, edits: &mut Edits) {
    let stated = [("damping", change.damping), ("friction", change.friction_loss)];
    let stated: Vec<(&str, f64)> =
        stated.iter().filter_map(|(name, value)| value.map(|value| (*name, value))).collect();
    match element.child("dynamics") {
        Some(dynamics) => stated.iter().for_each(|(name, value)| edits.set_number(dynamics, name, *value)),
        None if !stated.is_empty() => {
            let values: Vec<String> =
                stated.iter().map(|(name, value)| format!("{name}=\"{}\"", number(*value))).collect();
            edits.insert(element, &format!("<dynamics {}/>", values.join(" ")), false);
        }
        None => {}
    }
    let others = [("armature", change.armature), ("stiffness", change.stiffness)];
    for (quantity, value) in
        others.iter().filter_map(|(quantity, value)| value.map(|value| (quantity, value)))
    {
        edits.comment_before(
            element,
            &format!("joint {name}: {quantity} {}, which URDF cannot state", number(value)),
        );
    }
}
