//! Checks whether a set of throws contains the data that an effect needs.

use super::Axes;
use super::covariates::{area_per_mass_varies, has_spin, has_start_time, radius_m};
use super::effects::all;
use crate::library::{Location, Needs};
use augsim_system::{Parameter, Record};

/// Properties of the declared model that decide which effects can be searched for.
pub(super) struct Preconditions<'a> {
    pub axes: Axes,
    /// Whether the model declares that the ball is released at rest.
    pub released_at_rest: bool,
    /// Whether the model declares a radius of the ball.
    pub has_radius: bool,
    /// Parameters that the model declares.
    pub parameters: &'a [Parameter],
    /// Kinds of the effects that the model declares.
    pub kinds: &'a [String],
}

impl Preconditions<'_> {
    /// Whether discovery can search for the library effect with this index in these records.
    ///
    /// It cannot if the model already has it, an effect that excludes it, or a calibrated parameter with the
    /// same effect.
    pub fn allows(&self, effect: usize, records: &[&Record]) -> bool {
        let library = all::<f64>();
        let Some(spec) = library.get(effect).map(|e| e.spec()) else { return false };
        let is_declared = self.kinds.iter().any(|k| k == spec.kind || spec.excludes.contains(&k.as_str()));
        let is_parameter = self.parameters.iter().any(|p| spec.same_as == Some(p.name.as_str()) && !p.frozen);
        let has_impacts = records.iter().any(|r| !r.events.is_empty());
        let is_horizontal = self.axes != Axes::Vertical;
        let has_data = match spec.needs {
            Needs::Nothing => true,
            Needs::Horizontal => is_horizontal,
            Needs::Slip => {
                let has_radius = self.has_radius || records.iter().all(|r| radius_m(r).is_some());
                is_horizontal && (!has_spin(records) || has_radius)
            }
            Needs::Lateral => self.axes == Axes::Space,
            Needs::Spin => has_spin(records) && is_horizontal,
            Needs::SpinInSpace => has_spin(records) && self.axes == Axes::Space,
            Needs::StartTime => has_start_time(records),
            Needs::AreaPerMass => area_per_mass_varies(records),
            Needs::ReleaseAtRest => self.released_at_rest,
            Needs::Coasting | Needs::PerTrajectory => false,
        };
        has_data && !is_declared && !is_parameter && (spec.location != Location::Impact || has_impacts)
    }
}
