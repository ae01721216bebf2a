//! Which effects throws can speak about.

use super::Axes;
use super::covariates::{area_per_mass_varies, has_spin, has_start_time, radius_m};
use crate::effects::{Location, Needs, all};
use crate::model::Parameter;
use crate::system::Record;

/// The declared model, as far as it decides what is looked for.
pub(super) struct Possible<'a> {
    pub axes: Axes,
    /// The ball is released at rest.
    pub held: bool,
    /// The model has a radius.
    pub radius_declared: bool,
    /// The declared parameters.
    pub parameters: &'a [Parameter],
    /// Kinds that the model declares.
    pub kinds: &'a [String],
}

impl Possible<'_> {
    /// Whether these records can speak about the library's effect of this index, and the model does not have it already.
    pub fn allows(&self, effect: usize, records: &[&Record]) -> bool {
        let library = all::<f64>();
        let Some(spec) = library.get(effect).map(|e| e.spec()) else { return false };
        let declared = self.kinds.iter().any(|k| k == spec.kind || spec.excludes.contains(&k.as_str()));
        let known = self.parameters.iter().any(|p| spec.same_as == Some(p.name.as_str()) && !p.frozen);
        let impacts = records.iter().any(|r| !r.events.is_empty());
        let horizontal = self.axes != Axes::Vertical;
        let possible = match spec.needs {
            Needs::Nothing => true,
            Needs::Horizontal => horizontal,
            Needs::Slip => {
                let radius = self.radius_declared || records.iter().all(|r| radius_m(r).is_some());
                horizontal && (!has_spin(records) || radius)
            }
            Needs::Lateral => self.axes == Axes::Space,
            Needs::Spin => has_spin(records) && horizontal,
            Needs::SpinInSpace => has_spin(records) && self.axes == Axes::Space,
            Needs::StartTime => has_start_time(records),
            Needs::AreaPerMass => area_per_mass_varies(records),
            Needs::ReleaseAtRest => self.held,
            Needs::Coasting | Needs::OfEach => false,
        };
        possible && !declared && !known && (spec.location != Location::Impact || impacts)
    }
}
