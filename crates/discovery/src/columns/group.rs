//! Columns of a linear problem that enter it together: an addition at one point of its shape.

use crate::addition::Addition;
use augsim_physics::effects::Polar;
use augsim_physics::model::Per;
use augsim_physics::system::{Start, System};
use std::ops::Range;

/// An addition at one point: where its shape parameters (widths, thresholds, delays, periods) stand.
#[derive(Clone, Debug)]
pub(crate) struct Group {
    pub addition: Addition,
    /// Values of its parameters that the columns are made at.
    pub point: Vec<f64>,
    /// Its columns.
    pub columns: Range<usize>,
    pub effect: Effect,
}

/// Kind of a group's columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Effect {
    /// Derivatives with respect to its parameters, at a point where it changes nothing.
    Slopes,
    /// The change that it makes at a point where it acts, and derivatives with respect to its parameters there.
    Change,
    /// Derivatives with respect to values of a declared parameter by group.
    Split,
    /// Derivatives with respect to the parameters of an addition of the fitted set.
    Fitted,
}

impl Group {
    /// Whether two groups may stand in one set.
    pub fn goes_with(&self, other: &Self) -> bool {
        !self.addition.excludes(&other.addition)
            && !other.addition.excludes(&self.addition)
            && self.addition != other.addition
    }

    /// Whether these coefficients of its columns make values that its parameters can have.
    pub fn allows(&self, coefficients: &[f64]) -> bool {
        let Addition::Effect(listed, per) = &self.addition else { return true };
        let effect = &listed.effect;
        match self.effect {
            Effect::Change => coefficients.first().is_some_and(|c| *c > 0.0),
            Effect::Split => true,
            Effect::Slopes | Effect::Fitted
                if *per == Per::Group || effect.polar == Some(Polar::Direction) =>
            {
                true
            }
            Effect::Slopes | Effect::Fitted => {
                let amounts = effect.amounts.unwrap_or(usize::MAX);
                let each = effect.parameters.iter().zip(coefficients).take(amounts);
                // One-sided where the null is the lowest value.
                each.into_iter().all(|(p, c)| !(p.null <= p.min && *c < 0.0 || p.null >= p.max && *c > 0.0))
            }
        }
    }

    /// Values from which a fit of the addition begins, by the coefficients of its columns.
    pub fn start(&self, coefficients: &[f64]) -> Vec<f64> {
        let Addition::Effect(listed, _) = &self.addition else { return coefficients.to_vec() };
        // Amounts move from their nulls by the coefficients, one for each group where they have values by group; shape parameters stay.
        let amounts = listed.effect.amounts.unwrap_or(usize::MAX).min(self.point.len()).max(1);
        let groups = coefficients.len() / amounts;
        let estimate = || -> Vec<f64> {
            let nulls = self.point.iter().flat_map(|v| std::iter::repeat_n(*v, groups));
            let moved = coefficients.iter().copied().chain(std::iter::repeat(0.0));
            nulls.zip(moved).map(|(v, c)| v + c).collect()
        };
        match (self.effect, &listed.effect.start) {
            (Effect::Change, _) => {
                let each = self.point.iter().zip(&coefficients[1..]).zip(&listed.effect.parameters);
                each.map(|((at, step), p)| (at + step).clamp(p.min, p.max)).collect()
            }
            (_, Start::At(values)) => values.clone(),
            (_, Start::Within(bounds)) => {
                estimate().iter().zip(bounds).map(|(v, [low, high])| v.clamp(*low, *high)).collect()
            }
            _ => estimate(),
        }
    }
}

/// The points at which an addition is linearised: at its nulls, its shape parameters on their grids.
pub(crate) fn null_points(system: &dyn System, addition: &Addition) -> Vec<Vec<f64>> {
    match addition {
        Addition::Effect(listed, _) if !addition.is_structural() => system.null_points(listed.index),
        Addition::Table(_) => vec![vec![0.0; addition.size()]],
        _ => Vec::new(),
    }
}

/// The points at which an addition acts and its change is taken as a whole: thresholds, and laws that are singular at their null.
pub(crate) fn acting_points(system: &dyn System, addition: &Addition) -> Vec<Vec<f64>> {
    let Addition::Effect(listed, Per::All) = addition else { return Vec::new() };
    let effect = &listed.effect;
    if addition.is_structural() {
        return vec![probe(effect)];
    }
    system.scan_points(listed.index)
}

/// Values at which an effect is first simulated: its nulls, or near them for a law that is singular there.
pub(crate) fn probe(effect: &augsim_physics::system::Effect) -> Vec<f64> {
    if effect.probe.is_empty() {
        effect.parameters.iter().map(|p| p.null).collect()
    } else {
        effect.probe.clone()
    }
}
