//! Groups of columns that enter the linear problem together: an addition at one grid point of its shape
//! parameters.

use crate::addition::Addition;
use augsim_system::{Augment, Per, Polar, Start};
use std::ops::Range;

/// Columns of the linear problem for an addition at one grid point of its shape parameters (widths,
/// thresholds, delays, periods).
#[derive(Clone, Debug)]
pub(crate) struct ColumnGroup {
    pub addition: Addition,
    /// Parameter values of the addition at which the columns are computed.
    pub point: Vec<f64>,
    /// Range of the addition's columns in the linear problem.
    pub columns: Range<usize>,
    pub kind: ColumnKind,
}

/// What the columns of an addition contain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ColumnKind {
    /// Derivatives of the predictions with respect to the addition's parameters, at their null values.
    Slopes,
    /// Change of the predictions at a point where the addition acts, and the derivatives there.
    Change,
    /// Derivatives of the predictions with respect to groupwise values of a declared parameter.
    Split,
    /// Derivatives of the predictions with respect to the parameters of an addition that the fitted set
    /// contains.
    Fitted,
}

impl ColumnGroup {
    /// Whether the additions of two groups of columns can be in one set.
    pub fn is_compatible_with(&self, other: &Self) -> bool {
        !self.addition.excludes(&other.addition)
            && !other.addition.excludes(&self.addition)
            && self.addition != other.addition
    }

    /// Whether these coefficients of the columns give parameter values within the allowed range.
    pub fn is_feasible(&self, coefficients: &[f64]) -> bool {
        let Addition::Effect(listed, per) = &self.addition else { return true };
        let effect = &listed.effect;
        match self.kind {
            ColumnKind::Change => coefficients.first().is_some_and(|c| *c > 0.0),
            ColumnKind::Split => true,
            ColumnKind::Slopes | ColumnKind::Fitted
                if *per == Per::Group || effect.polar == Some(Polar::Direction) =>
            {
                true
            }
            ColumnKind::Slopes | ColumnKind::Fitted => {
                let amounts = effect.amplitude_count.unwrap_or(usize::MAX);
                let each = effect.parameters.iter().zip(coefficients).take(amounts);
                // A null at the edge of the range makes a parameter one-sided.
                each.into_iter().all(|(p, c)| !(p.null <= p.min && *c < 0.0 || p.null >= p.max && *c > 0.0))
            }
        }
    }

    /// Initial parameter values for a fit of the addition, from the coefficients of its columns.
    pub fn start(&self, coefficients: &[f64]) -> Vec<f64> {
        let Addition::Effect(listed, _) = &self.addition else { return coefficients.to_vec() };
        // Coefficients are offsets from the nulls, one for each group with groupwise values; shape
        // parameters keep their grid values, one for all groups.
        let amounts = listed.effect.amplitude_count.unwrap_or(usize::MAX).min(self.point.len()).max(1);
        let groups = coefficients.len() / amounts;
        let estimate = || -> Vec<f64> {
            let width = |k: usize| if k < amounts { groups } else { 1 };
            let nulls = self.point.iter().enumerate().flat_map(|(k, v)| std::iter::repeat_n(*v, width(k)));
            let moved = coefficients.iter().copied().chain(std::iter::repeat(0.0));
            nulls.zip(moved).map(|(v, c)| v + c).collect()
        };
        match (self.kind, &listed.effect.start) {
            (ColumnKind::Change, _) => {
                let each = self.point.iter().zip(&coefficients[1..]).zip(&listed.effect.parameters);
                each.map(|((point, step), p)| (point + step).clamp(p.min, p.max)).collect()
            }
            (_, Start::At(values)) => values.clone(),
            (_, Start::Within(bounds)) => {
                estimate().iter().zip(bounds).map(|(v, [low, high])| v.clamp(*low, *high)).collect()
            }
            _ => estimate(),
        }
    }
}

/// Points at which an addition is linearised: its null values, with the shape parameters on their grids.
pub(crate) fn null_points(system: &dyn Augment, addition: &Addition) -> Vec<Vec<f64>> {
    match addition {
        Addition::Effect(listed, _) if !addition.is_structural() => system.null_points(listed.index),
        Addition::Table(_) => vec![vec![0.0; addition.size()]],
        _ => Vec::new(),
    }
}

/// Points at which an addition acts and its whole change of the predictions is computed. There are such
/// points for thresholds and for effects that are singular at their null values.
pub(crate) fn acting_points(system: &dyn Augment, addition: &Addition) -> Vec<Vec<f64>> {
    let Addition::Effect(listed, Per::All) = addition else { return Vec::new() };
    let effect = &listed.effect;
    if addition.is_structural() {
        return vec![probe(effect)];
    }
    system.scan_points(listed.index)
}

/// Parameter values at which an effect is first simulated: its null values, or near them where it is singular
/// there.
pub(crate) fn probe(effect: &augsim_system::Effect) -> Vec<f64> {
    if effect.first_simulated_at.is_empty() {
        effect.parameters.iter().map(|p| p.null).collect()
    } else {
        effect.first_simulated_at.clone()
    }
}
