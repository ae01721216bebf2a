//! Inertias of an MJCF file: the element `inertial`, and what the compiler's settings make of inertias.

use augsim_linear::{Mat, symmetric_eigen};

use super::orientation::{Orientation, read_placement};
use super::settings::Settings;
use crate::description::{Inertia, Robot};
use crate::error::DescriptionError;
use crate::rotation::{rotate_tensor, tensor, transpose};
use crate::xml::Element;

/// Reads `inertial`, in the frame of the body.
pub(super) fn read_inertial(element: Element, settings: &Settings) -> Result<Inertia, DescriptionError> {
    let missing = |name: &str| {
        element.error(format!("<inertial> has no attribute `{name}`"), format!("add {name}=\"...\""))
    };
    let mass_kg = element.number("mass")?.ok_or_else(|| missing("mass"))?;
    let centre_m = element.vector("pos")?.ok_or_else(|| missing("pos"))?;
    let full = element.vector::<6>("fullinertia")?;
    if full.is_some() && Orientation::is_stated(element) {
        let problem = "<inertial> has fullinertia and an orientation";
        return Err(
            element.error(problem, "remove the orientation: fullinertia is along the axes of the body")
        );
    }
    let inertia_kg_m2 = match full {
        Some(full) => full,
        None => {
            let [xx, yy, zz] = element.vector("diaginertia")?.unwrap_or([0.0; 3]);
            let placement = read_placement(element, settings)?;
            rotate_tensor(&placement.rotation, [xx, yy, zz, 0.0, 0.0, 0.0])
        }
    };
    Ok(Inertia { mass_kg, centre_m, inertia_kg_m2 })
}

/// Applies the compiler's bounds, balance and total mass to the inertias of all bodies; the base is not one.
pub(super) fn apply_settings(robot: &mut Robot, is_body: &[bool], settings: &Settings) {
    let has_bounds = settings.min_mass > 0.0 || settings.min_inertia > 0.0;
    let bodies = || (0..is_body.len()).filter(|link| is_body[*link]);
    for link in bodies() {
        let shift = robot.links[link].shift_m;
        let inertia = &mut robot.links[link].inertia;
        if inertia.is_none() && has_bounds {
            let centre_m = shift.map(|component| -component);
            *inertia = Some(Inertia { mass_kg: 0.0, centre_m, inertia_kg_m2: [0.0; 6] });
        }
        let Some(inertia) = inertia else { continue };
        inertia.mass_kg = inertia.mass_kg.max(settings.min_mass);
        if settings.min_inertia > 0.0 || settings.balances_inertia {
            inertia.inertia_kg_m2 = bound(inertia.inertia_kg_m2, settings);
        }
    }
    let total: f64 =
        bodies().filter_map(|link| robot.links[link].inertia).map(|inertia| inertia.mass_kg).sum();
    if settings.total_mass > 0.0 && total > 0.0 {
        let factor = settings.total_mass / total;
        for inertia in robot.links.iter_mut().filter_map(|link| link.inertia.as_mut()) {
            inertia.mass_kg *= factor;
            inertia.inertia_kg_m2 = inertia.inertia_kg_m2.map(|moment| moment * factor);
        }
    }
}

/// The tensor with the compiler's smallest principal moment, balanced if no body has it.
fn bound(values: [f64; 6], settings: &Settings) -> [f64; 6] {
    let matrix = tensor(values);
    let Some(eigen) = symmetric_eigen(&Mat::from_fn(3, 3, |i, j| matrix[i][j])) else { return values };
    let mut moments: [f64; 3] = std::array::from_fn(|k| eigen.values[k].max(settings.min_inertia));
    let [a, b, c] = moments;
    if settings.balances_inertia && (a + b < c || a + c < b || b + c < a) {
        moments = [(a + b + c) / 3.0; 3];
    }
    if moments.iter().zip(&eigen.values).all(|(bounded, value)| bounded == value) {
        return values;
    }
    let columns: [[f64; 3]; 3] = std::array::from_fn(|k| std::array::from_fn(|i| eigen.vectors[(i, k)]));
    rotate_tensor(&transpose(&columns), [moments[0], moments[1], moments[2], 0.0, 0.0, 0.0])
}
