//! Declared parameters.

use crate::system::effect::EffectParameter;

/// The scope of one value of a parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Per {
    /// One value for all trajectories.
    #[default]
    All,
    /// One value for each `group` (object) in the data.
    Group,
    /// One value for each trajectory: a nuisance, fitted and not reported.
    Trajectory,
}

/// Standard deviations from the middle of a normal law to the ends of its 95 % interval.
pub const NORMAL_95: f64 = 1.959_963_984_540_054;

/// A declared parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name with its unit.
    pub name: String,
    /// The declared value.
    pub nominal: f64,
    /// Lower bound.
    pub min: f64,
    /// Upper bound.
    pub max: f64,
    /// Not calibrated.
    pub frozen: bool,
    /// The scope of one value.
    pub per: Per,
    /// 95 % interval, when a fit has put it here.
    pub ci95: Option<[f64; 2]>,
    /// Values by group, when a fit with `per = "group"` has put them here.
    pub groups: Vec<(String, f64)>,
}

impl Parameter {
    /// Standard deviation that its 95 % interval stands for, in its unit; `None` without a finite interval, and for one that is
    /// not calibrated.
    pub fn standard_deviation(&self) -> Option<f64> {
        let [low, high] = self.ci95.filter(|_| !self.frozen)?;
        let sd = (high - low) / (2.0 * NORMAL_95);
        sd.is_finite().then_some(sd)
    }

    /// A parameter of a law that was added, at the value at which the law vanishes.
    pub fn added(p: &EffectParameter) -> Self {
        Self::free(p.name.clone(), p.null, p.min, p.max)
    }

    /// The value of a table at its knot `i`, from 0.
    pub fn knot(i: usize) -> Self {
        Self::free(format!("knot{i}"), 0.0, -MOST_OF_A_KNOT, MOST_OF_A_KNOT)
    }

    /// A parameter to calibrate, one value for all records.
    ///
    /// ```
    /// use augsim_physics::model::Parameter;
    /// let p = Parameter::free("b_per_s".into(), 0.1, 0.0, 5.0);
    /// assert!(!p.frozen && (p.min..=p.max).contains(&p.nominal));
    /// ```
    pub fn free(name: String, nominal: f64, min: f64, max: f64) -> Self {
        let (frozen, per) = (false, Per::All);
        Self { name, nominal, min, max, frozen, per, ci95: None, groups: Vec::new() }
    }
}

/// Bound of the values of a table, in the unit of what it adds to.
const MOST_OF_A_KNOT: f64 = 100.0;
