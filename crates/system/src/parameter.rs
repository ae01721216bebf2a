//! A model parameter: value, bounds, scope and fitted interval.

use crate::effect::EffectParameter;

/// Scope of a parameter's value: all trajectories, a group, or a single trajectory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Per {
    /// The parameter has one value for all trajectories.
    #[default]
    All,
    /// The parameter has one value per `group` (object) in the data.
    Group,
    /// The parameter has one value per trajectory, which is estimated but not reported (nuisance parameter).
    Trajectory,
}

/// Half width of the 95 % interval of a standard normal distribution: 1.96 standard deviations.
pub const NORMAL_95: f64 = 1.959_963_984_540_054;

/// A parameter of a model, with its bounds and, after a fit, its interval.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name of the parameter, with the unit as suffix.
    pub name: String,
    /// Declared (or fitted) value of the parameter.
    pub nominal: f64,
    /// Lower bound of the parameter.
    pub min: f64,
    /// Upper bound of the parameter.
    pub max: f64,
    /// Whether the parameter is fixed at its nominal value, not calibrated.
    pub frozen: bool,
    /// Scope of the parameter's value.
    pub per: Per,
    /// 95 % confidence interval from a fit; `None` without one.
    pub ci95: Option<[f64; 2]>,
    /// Name of each group and its value, from a fit with `per = "group"`; empty without one.
    pub groups: Vec<(String, f64)>,
    /// Whether the parameter is the value of a table at a knot. A model file has one list of them for all groups.
    pub is_knot: bool,
}

impl Parameter {
    /// Standard deviation of the parameter from its 95 % interval; `None` if frozen or without a finite interval.
    pub fn standard_deviation(&self) -> Option<f64> {
        let [low, high] = self.ci95.filter(|_| !self.frozen)?;
        let sd = (high - low) / (2.0 * NORMAL_95);
        sd.is_finite().then_some(sd)
    }

    /// Values of the parameter for `groups`, in their order; a group without a value gets the nominal one.
    pub fn values_of(&self, groups: &[String]) -> Vec<f64> {
        let entry = |name: &String| self.groups.iter().find(|(n, _)| n == name);
        groups.iter().map(|name| entry(name).map_or(self.nominal, |(_, v)| *v)).collect()
    }

    /// Creates the parameter of an added effect, at its null value.
    pub fn added(p: &EffectParameter) -> Self {
        Self::free(p.name.clone(), p.null, p.min, p.max)
    }

    /// Creates the parameter for the value of a table at knot `i`, counted from 0; its null value is 0.
    pub fn knot(i: usize) -> Self {
        let knot = Self::free(format!("knot{i}"), 0.0, -MAX_KNOT_VALUE, MAX_KNOT_VALUE);
        Self { is_knot: true, ..knot }
    }

    /// Creates a parameter that is calibrated, with one value for all records.
    ///
    /// ```
    /// use augsim_system::Parameter;
    /// let p = Parameter::free("b_per_s".into(), 0.1, 0.0, 5.0);
    /// assert!(!p.frozen && (p.min..=p.max).contains(&p.nominal));
    /// ```
    pub fn free(name: String, nominal: f64, min: f64, max: f64) -> Self {
        let (frozen, per) = (false, Per::All);
        Self { name, nominal, min, max, frozen, per, ci95: None, groups: Vec::new(), is_knot: false }
    }
}

/// Maximum absolute value of a table at a knot, in the unit of the table's target.
const MAX_KNOT_VALUE: f64 = 100.0;

/// Error: a parameter has a value for a group that the data do not have.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownGroup {
    /// Name of the parameter.
    pub parameter: String,
    /// Name of the unknown group.
    pub group: String,
}

/// Finds the first group value of these parameters whose group is not in `groups`; `None` if all are known.
pub fn unknown_group<'p>(
    mut parameters: impl Iterator<Item = &'p Parameter>,
    groups: &[&str],
) -> Option<UnknownGroup> {
    parameters.find_map(|p| {
        let (group, _) = p.groups.iter().find(|(name, _)| !groups.contains(&name.as_str()))?;
        Some(UnknownGroup { parameter: p.name.clone(), group: group.clone() })
    })
}
