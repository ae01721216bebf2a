//! New values in an MJCF file.

use super::edits::Edits;
use super::number::{number, numbers};
use super::{Changes, Target};
use crate::description::Inertia;
use crate::error::DescriptionError;
use crate::rotation::add;
use crate::xml::Element;

/// Attributes of `<inertial>` that `fullinertia` replaces.
const REPLACED: [&str; 6] = ["diaginertia", "quat", "axisangle", "xyaxes", "zaxis", "euler"];

/// Puts the changes into the file.
pub(super) fn edit(target: &Target, changes: &Changes, edits: &mut Edits) -> Result<(), DescriptionError> {
    let mut inertias = changes.inertias.clone();
    let geoms_counted = !inertias.is_empty() && keep_explicit_inertias(target, &mut inertias, edits);
    for (link, inertia) in &inertias {
        let Some(body) = target.elements.links[*link] else {
            let name = &target.robot.links[*link].name;
            let problem =
                format!("link `{name}` has no <body> of its own, so that its inertia cannot be stated");
            return Err(DescriptionError::of_file(&target.robot.file, problem, "change that of the body"));
        };
        let original = &target.robot.links[*link];
        // The values of an <inertial> that did not count are not those of the robot.
        let old = original.inertia.filter(|_| !geoms_counted);
        let in_body = Inertia { centre_m: add(inertia.centre_m, original.shift_m), ..*inertia };
        match body.child("inertial") {
            Some(inertial) => change_inertial(inertial, old.as_ref(), inertia, &in_body, edits),
            None => edits.insert(body, &inertial_element(&in_body), true),
        }
    }
    for (joint, change) in &changes.joints {
        let Some(element) = target.elements.joints[*joint] else { continue };
        let values = [
            ("damping", change.damping),
            ("frictionloss", change.friction_loss),
            ("armature", change.armature),
            ("stiffness", change.stiffness),
        ];
        for (name, value) in values.iter().filter_map(|(name, value)| value.map(|value| (name, value))) {
            edits.set_number(element, name, value);
        }
    }
    Ok(())
}

/// An `<inertial>` in the frame of the body.
pub(super) fn inertial_element(inertia: &Inertia) -> String {
    format!(
        "<inertial pos=\"{}\" mass=\"{}\" fullinertia=\"{}\"/>",
        numbers(&inertia.centre_m),
        number(inertia.mass_kg),
        numbers(&inertia.inertia_kg_m2)
    )
}

/// With `inertiafromgeom="true"` the file's `<inertial>` would not count: it becomes `auto`, and the bodies whose `<inertial>`
/// did not count so far are given the inertia that did. Returns whether the file has this setting.
fn keep_explicit_inertias(target: &Target, inertias: &mut Vec<(usize, Inertia)>, edits: &mut Edits) -> bool {
    let compilers = target.root.children().filter(|child| child.tag() == "compiler");
    let settings: Vec<Element> =
        compilers.filter(|compiler| compiler.attribute("inertiafromgeom").is_some()).collect();
    if settings.last().and_then(|last| last.attribute("inertiafromgeom")) != Some("true") {
        return false;
    }
    settings.iter().for_each(|compiler| edits.set(*compiler, "inertiafromgeom", "auto"));
    for (link, element) in target.elements.links.iter().enumerate() {
        let is_changed = inertias.iter().any(|(changed, _)| *changed == link);
        let has_inertial = element.is_some_and(|body| body.child("inertial").is_some());
        if let (false, true, Some(inertia)) = (is_changed, has_inertial, target.robot.links[link].inertia) {
            inertias.push((link, inertia));
        }
    }
    true
}

/// Changes the numbers of an `<inertial>` that differ; `in_body` is the new inertia in the frame of the body.
fn change_inertial(
    inertial: Element,
    old: Option<&Inertia>,
    new: &Inertia,
    in_body: &Inertia,
    edits: &mut Edits,
) {
    edits.set_number(inertial, "mass", new.mass_kg);
    if old.is_none_or(|old| old.centre_m != new.centre_m) {
        edits.set_vector(inertial, "pos", in_body.centre_m);
    }
    if old.is_none_or(|old| old.inertia_kg_m2 != new.inertia_kg_m2) {
        REPLACED.iter().for_each(|name| edits.remove(inertial, name));
        edits.set(inertial, "fullinertia", &numbers(&new.inertia_kg_m2));
    }
}
