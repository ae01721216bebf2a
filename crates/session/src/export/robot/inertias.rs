//! Inertias of the links whose parameters a model has, as a description file can state them.

use super::projection::{Projection, project};
use super::{first_joint, link_name};
use augsim_data::digits;
use augsim_equations::Model;
use augsim_equations::model::RobotModel;
use augsim_robot::consistency::raise_to_consistent;
use augsim_robot::{Changes, inertia_of};

/// Share of a link's largest second moment that rounding may change.
const ROUNDING: f64 = 1e-9;

/// Relative difference of parameters that rounding explains.
const EQUAL: f64 = 1e-12;

/// Adds the inertias of the links that differ from the description file.
///
/// The values of a fit are written as they are if a real body can have those of each link. Otherwise the nearest inertias of
/// real bodies that keep the identified combinations are written, with a note.
///
/// # Errors
/// No such inertias can be found.
pub(super) fn change(model: &Model, robot: &RobotModel, changes: &mut Changes) -> anyhow::Result<()> {
    let file = robot.tree.link_parameters(&robot.description);
    let Some(properties) = model.robot_properties(&model.nominals()) else { return Ok(()) };
    let mut links = properties.links;
    let changed: Vec<usize> = (0..links.len()).filter(|k| !is_equal(&links[*k], &file[*k])).collect();
    let impossible: Vec<usize> = changed.iter().copied().filter(|k| !is_possible(&links[*k])).collect();
    if !impossible.is_empty() {
        let projection = project(model, robot, &changed)?;
        let name = |k: &usize| link_name(&robot.description, robot.tree.links[*k].link).to_owned();
        let names: Vec<String> = impossible.iter().map(name).collect();
        changes.notes.push((first_joint(robot), note(&names, &projection)));
        for (link, parameters) in projection.links {
            links[link] = parameters;
        }
    }
    for (k, attached) in robot.tree.links.iter().enumerate() {
        if is_equal(&links[k], &file[k]) {
            continue;
        }
        changes.inertias.extend(inertia_of(&links[k]).map(|inertia| (attached.link, inertia)));
    }
    Ok(())
}

/// Whether two lists of parameters agree within rounding: mass, moments and tensor, each beside its largest element.
fn is_equal(a: &[f64; 10], b: &[f64; 10]) -> bool {
    [0..1, 1..4, 4..10].into_iter().all(|part| {
        let (a, b) = (&a[part.clone()], &b[part]);
        let size = a.iter().chain(b).fold(0.0_f64, |largest, value| largest.max(value.abs()));
        a.iter().zip(b).all(|(a, b)| (a - b).abs() <= EQUAL * size)
    })
}

/// Whether a real body, thin ones included, can have these parameters.
fn is_possible(parameters: &[f64; 10]) -> bool {
    let moments = parameters[4..].iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    parameters[0] > 0.0
        && raise_to_consistent(parameters, 0.0, 0.0).is_some_and(|raised| {
            raised.iter().zip(parameters).all(|(a, b)| (a - b).abs() <= ROUNDING * moments)
        })
}

/// What the user must know of inertias that are not those of the model.
fn note(names: &[String], projection: &Projection) -> String {
    let [deviation, limit] = [projection.chi_square, projection.limit].map(digits);
    let count = projection.combinations;
    let verdict = if projection.chi_square <= projection.limit {
        "keep the identified combinations within their uncertainty"
    } else {
        "come closest to the identified combinations, which real bodies cannot have within their uncertainty: torques differ from \
         those of the model"
    };
    let unknown = if projection.has_covariance {
        ""
    } else {
        "; the model file has no covariance, so that 1 % of each combination counts as its uncertainty"
    };
    format!(
        "the fit identified combinations of inertial parameters, and the values of {} alone are those of no real body. The \
         inertias in this file are those of real bodies near the original file that {verdict} (squared deviation {deviation} in \
         units of the uncertainty, of {count} combinations; 95 % of estimates are below {limit}{unknown})",
        names.join(", ")
    )
}
