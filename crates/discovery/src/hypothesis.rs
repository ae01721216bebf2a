//! A hypothesis: the declared model with additions, and its free parameters.

use crate::addition::Addition;
use crate::group_distribution::spread_of_groups;
use crate::linear::Square;
use crate::record::Measured;
use augsim_system::{
    Addition as Added, Augmentation, Effect, Fitted, FittedValues, ModelTerm, Parameter, Per, Polar, Scatter,
    System,
};
use std::ops::Range;
use std::sync::Arc;

/// Share of a parameter's range within which it counts as being at a bound.
const BOUND_SHARE: f64 = 1e-6;

/// A parameter that fits estimate.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FreeParameter {
    /// Index of the parameter in the system's parameter vector.
    pub index: usize,
    pub per: Per,
    pub min: f64,
    pub max: f64,
    /// Bounds of the parameter in fits; wider than `min` to `max` for angles, which may wrap.
    pub fit_range: (f64, f64),
    /// Typical size of the parameter, used as its scale and initial value.
    pub typical: f64,
    /// Null value of an added parameter, at which the addition has no effect; 0 for a declared parameter.
    pub null: f64,
    /// Index of the addition that the parameter belongs to; `None` for a parameter of the declared model.
    pub addition: Option<usize>,
    /// Mean and standard deviation of the parameter over records. `None` unless each record has its own value
    /// with a known distribution.
    pub prior: Option<(f64, f64)>,
}

impl FreeParameter {
    /// Creates a free parameter of the declared model with one value for all records.
    pub fn new(index: usize, min: f64, max: f64, typical: f64) -> Self {
        let fit_range = (min, max);
        Self { index, per: Per::All, min, max, fit_range, typical, null: 0.0, addition: None, prior: None }
    }
}

/// A model to be fitted: the declared system with additions, nominal values and free parameters.
#[derive(Clone, Debug)]
pub(crate) struct Hypothesis {
    pub system: Arc<dyn System>,
    pub values: Vec<f64>,
    /// Declared parameters with one value per group: index of the parameter, and its values by group.
    pub by_group: Vec<(usize, Vec<f64>)>,
    pub free: Vec<FreeParameter>,
    pub scatter: Option<Scatter>,
    pub additions: Vec<Addition>,
    /// Number of groups of records in the data.
    pub groups: usize,
}

/// Bound of a fitted angle, rad, in both directions; a fit may wrap the angle a few times.
const MAX_ANGLE: f64 = 20.0;

/// Bounds in fits of parameter number `k` of an effect.
///
/// The magnitude of a vector may become negative, which reverses its direction.
fn fit_range(effect: &Effect, k: usize) -> (f64, f64) {
    let p = &effect.parameters[k];
    match (effect.polar, k) {
        (None, _) | (Some(Polar::Axis), 0) => (p.min, p.max),
        (Some(Polar::Direction), 0) => (-p.max, p.max),
        (Some(_), _) => (-MAX_ANGLE, MAX_ANGLE),
    }
}

impl Hypothesis {
    /// Name and bound of the first declared parameter that is at a bound other than 0; `None` if there is none. At a
    /// bound of 0 a term is merely absent.
    pub fn declared_parameter_at_bound(&self, theta: &[f64]) -> Option<(String, f64)> {
        for (f, range) in self.entries() {
            let fitted = &theta[range];
            if f.addition.is_some() || f.per == Per::Trajectory {
                continue;
            }
            let tolerance = BOUND_SHARE * (f.max - f.min);
            for bound in [f.min, f.max].into_iter().filter(|b| *b != 0.0) {
                if fitted.iter().any(|v| (v - bound).abs() <= tolerance) {
                    return Some((self.system.quantity(f.index).name, bound));
                }
            }
        }
        None
    }

    /// Creates the hypothesis of the declared model with these additions.
    pub fn new(data: &Measured, additions: &[Addition]) -> Self {
        let terms: Vec<ModelTerm> = additions.iter().filter_map(Addition::term).collect();
        // Kinds and tables come from this system, so it accepts them.
        let system = data.system.augmented(&terms).unwrap_or_else(|_| data.system.clone());
        let values = system.parameters().iter().map(|p| p.nominal).collect();
        let mut parameter_ranges = system.term_parameter_ranges().into_iter();
        let declared = data.system.parameters().iter().take(data.system.declared_count());
        let declared: Vec<(usize, &Parameter)> = declared.enumerate().collect();
        let grouped = declared.iter().filter(|(_, p)| !p.groups.is_empty());
        let by_group = grouped.map(|(index, p)| (*index, p.values_of(&data.groups))).collect();
        let mut free: Vec<FreeParameter> = declared
            .into_iter()
            .filter(|(_, p)| !p.frozen)
            .map(|(index, p)| FreeParameter {
                per: p.per,
                ..FreeParameter::new(index, p.min, p.max, p.nominal.abs().max(1e-3))
            })
            .collect();
        let mut scatter = data.system.schema().event.as_ref().and_then(|e| e.declared);
        for (number, addition) in additions.iter().enumerate() {
            match addition {
                Addition::Scatter(s) => {
                    let sd = s.effect.parameters.first().map_or(0.0, |p| p.typical);
                    scatter = Some(Scatter { per: s.per, sd, ci95: None });
                }
                Addition::Effect(listed, per) => {
                    if let Some(range) = parameter_ranges.next() {
                        let amplitudes = listed.effect.amplitude_count.unwrap_or(usize::MAX);
                        for (k, (index, p)) in range.zip(&listed.effect.parameters).enumerate() {
                            free.push(FreeParameter {
                                // Shape parameters are shared by all groups.
                                per: if k < amplitudes { *per } else { Per::All },
                                fit_range: fit_range(&listed.effect, k),
                                null: p.null,
                                addition: Some(number),
                                ..FreeParameter::new(index, p.min, p.max, p.typical)
                            });
                        }
                    }
                }
                Addition::Split(split) => {
                    free.iter_mut().filter(|f| f.index == split.index).for_each(|f| f.per = Per::Group)
                }
                Addition::Table(table) => {
                    for index in parameter_ranges.next().unwrap_or_default() {
                        let knot = &system.parameters()[index];
                        free.push(FreeParameter {
                            addition: Some(number),
                            ..FreeParameter::new(index, knot.min, knot.max, table.target.typical)
                        });
                    }
                }
            }
        }
        Self {
            system,
            values,
            by_group,
            free,
            scatter,
            additions: additions.to_vec(),
            groups: data.groups.len(),
        }
    }

    /// Length of theta, the vector of parameters that are shared by all records or by a group.
    pub fn theta_len(&self) -> usize {
        self.free.iter().map(|f| self.width(f)).sum()
    }

    /// Number of entries in theta (the shared parameters) of a free parameter: one, one per group, or 0 for
    /// one value per record.
    pub fn width(&self, f: &FreeParameter) -> usize {
        match f.per {
            Per::All => 1,
            Per::Group => self.groups,
            Per::Trajectory => 0,
        }
    }

    /// The free parameters, each with the range of its entries in theta (the vector of shared parameters).
    pub fn entries(&self) -> impl Iterator<Item = (&FreeParameter, Range<usize>)> {
        let mut end = 0;
        self.free.iter().map(move |f| {
            let start = end;
            end += self.width(f);
            (f, start..end)
        })
    }

    /// Range in theta (the shared parameters) of the parameters of the addition with this number. For
    /// groupwise values it is the range of the declared parameter.
    pub fn entries_of_addition(&self, addition: usize) -> Range<usize> {
        if let Some(Addition::Split(split)) = self.additions.get(addition) {
            return self.entries_of_parameter(split.index).unwrap_or(0..0);
        }
        let mut ranges = self.entries().filter(|(f, _)| f.addition == Some(addition)).map(|(_, range)| range);
        match ranges.next() {
            Some(first) => first.start..ranges.last().map_or(first.end, |last| last.end),
            None => self.theta_len()..self.theta_len(),
        }
    }

    /// Entries of theta (the shared parameters) of the coefficients of addition number `addition`, each with its
    /// null value. Shape parameters have no null value; tables have no effect where they are 0.
    pub fn coefficients_of_addition(&self, addition: usize) -> Vec<(usize, f64)> {
        let amplitudes = match &self.additions[addition] {
            Addition::Effect(listed, _) => listed.effect.amplitude_count.unwrap_or(usize::MAX),
            Addition::Table(_) => usize::MAX,
            Addition::Scatter(_) | Addition::Split(_) => 0,
        };
        let of_addition = self.entries().filter(|(f, _)| f.addition == Some(addition)).take(amplitudes);
        of_addition.flat_map(|(f, range)| range.map(|i| (i, f.null))).collect()
    }

    /// Range in theta (the shared parameters) of the free parameter with the system's index `index`; `None`
    /// if it is frozen or has one value per record.
    pub fn entries_of_parameter(&self, index: usize) -> Option<Range<usize>> {
        let (_, range) = self.entries().find(|(f, _)| f.index == index)?;
        (!range.is_empty()).then_some(range)
    }

    /// Number of entries in theta (the shared parameters) of the declared model's parameters, which come
    /// first.
    pub fn declared_entries(&self) -> usize {
        self.free.iter().filter(|f| f.addition.is_none()).map(|f| self.width(f)).sum()
    }

    /// Initial theta (the shared parameters): nominal values of the declared model, and additions at the
    /// fraction `share` of the way from their null values to their typical sizes.
    pub fn initial_theta(&self, share: f64) -> Vec<f64> {
        let mut theta = Vec::new();
        for f in &self.free {
            let value = match f.addition {
                None => self.values[f.index],
                Some(_) => f.null + share * (f.typical - f.null),
            };
            match self.by_group.iter().find(|(index, _)| *index == f.index) {
                Some((_, values)) if f.per == Per::Group => {
                    theta.extend(values.iter().map(|v| v.clamp(f.min, f.max)))
                }
                _ => theta.extend(std::iter::repeat_n(value.clamp(f.min, f.max), self.width(f))),
            }
        }
        theta
    }

    /// Declared values of all parameters of the system for a record of `group`.
    pub fn values_of(&self, group: usize) -> Vec<f64> {
        let mut values = self.values.clone();
        for (index, by_group) in &self.by_group {
            values[*index] = by_group[group];
        }
        values
    }

    /// Values of all parameters of the system for a record of `group`, with the shared parameters from
    /// `theta`.
    pub fn values_at(&self, theta: &[f64], group: usize) -> Vec<f64> {
        let mut values = self.values_of(group);
        for (f, range) in self.entries() {
            match f.per {
                Per::All => values[f.index] = theta[range.start],
                Per::Group => values[f.index] = theta[range.start + group],
                Per::Trajectory => {}
            }
        }
        values
    }

    /// Lower and upper bound of each entry of theta (the shared parameters) in results.
    pub fn result_bounds(&self) -> Vec<(f64, f64)> {
        self.free.iter().flat_map(|f| std::iter::repeat_n((f.min, f.max), self.width(f))).collect()
    }

    /// Copies the fitted values `theta` of additions that hypothesis `other` also has into this hypothesis's
    /// theta, `to`.
    pub fn copy_additions(&self, to: &mut [f64], other: &Hypothesis, theta: &[f64]) {
        for (number, addition) in self.additions.iter().enumerate() {
            if let Some(known) = other.additions.iter().position(|a| a == addition) {
                to[self.entries_of_addition(number)]
                    .copy_from_slice(&theta[other.entries_of_addition(known)]);
            }
        }
    }

    /// Converts the declared parameters in `theta` of hypothesis `other` to this hypothesis. A common value
    /// is copied to all groups; groupwise values become their mean.
    pub fn declared_from(&self, other: &Hypothesis, theta: &[f64]) -> Vec<f64> {
        let mut out = Vec::new();
        for f in self.free.iter().filter(|f| f.addition.is_none()) {
            let (width, known) = (self.width(f), other.entries_of_parameter(f.index));
            let known = known.map_or(&[][..], |place| &theta[place]);
            match known.len() {
                0 => out.extend(std::iter::repeat_n(self.values[f.index].clamp(f.min, f.max), width)),
                n if n == width => out.extend(known),
                n => out.extend(std::iter::repeat_n(known.iter().sum::<f64>() / n as f64, width)),
            }
        }
        out
    }

    /// Maps magnitudes and angles in `theta` (the shared parameters) to equivalent values within their
    /// bounds. Returns whether anything changed.
    pub fn normalise_directions(&self, theta: &mut [f64]) -> bool {
        let original = theta.to_vec();
        for (number, addition) in self.additions.iter().enumerate() {
            let polar = addition.listed().and_then(|effect| effect.polar);
            if let (Some(polar), [amount, angle]) = (polar, &mut theta[self.entries_of_addition(number)]) {
                polar.normalise(amount, angle);
            }
        }
        theta != original
    }

    /// Lower and upper bound of each entry of theta (the shared parameters) in fits.
    pub fn fit_bounds(&self) -> Vec<(f64, f64)> {
        self.free.iter().flat_map(|f| std::iter::repeat_n(f.fit_range, self.width(f))).collect()
    }

    /// Contents of the augmented model file: fitted values `theta` with 95 % intervals `ci95` and their
    /// `covariance`, and the additions.
    pub fn augmentation(
        &self,
        data: &Measured,
        theta: &[f64],
        ci95: &[[f64; 2]],
        covariance: &Square,
    ) -> Augmentation {
        let mut out = Augmentation {
            clock_reference_s: data.clock_reference_s,
            scatter_sd: self.scatter.map(|s| s.sd),
            ..Augmentation::default()
        };
        let mut fitted: Vec<Vec<Fitted>> = vec![Vec::new(); self.additions.len()];
        for (f, Range { start: next, .. }) in self.entries() {
            let values = match f.per {
                Per::All => Some(FittedValues::One(theta[next])),
                Per::Group => {
                    let groups = next..next + data.groups.len();
                    let by_group = data.groups.iter().cloned().zip(theta[groups.clone()].iter().copied());
                    let estimates = groups.filter_map(|i| Some((theta[i], *ci95.get(i)?)));
                    let sd = spread_of_groups(estimates);
                    Some(FittedValues::ByGroup { values: by_group.collect(), sd })
                }
                Per::Trajectory => None,
            };
            if let Some(values) = values {
                let one = Fitted { values, ci95: ci95.get(next).copied().filter(|[low, high]| low < high) };
                match f.addition {
                    None => out.declared.push((f.index, one)),
                    Some(number) => fitted[number].push(one),
                }
            }
        }
        let declared = self.entries().filter(|(f, _)| f.addition.is_none()).map(|(_, range)| range);
        let terms = (0..self.additions.len()).filter(|n| self.additions[*n].term().is_some());
        let ranges: Vec<Range<usize>> = declared.chain(terms.map(|n| self.entries_of_addition(n))).collect();
        // Values by group are written as their mean, which this matrix does not describe.
        if self.entries().all(|(f, _)| f.per == Per::All) {
            let entries: Vec<usize> = ranges.into_iter().flatten().collect();
            let row = |i: &usize| entries.iter().map(|j| covariance.at(*i, *j)).collect();
            out.covariance = entries.iter().map(row).collect();
        }
        for (addition, values) in self.additions.iter().zip(fitted) {
            out.additions.extend(match (addition, addition.term()) {
                (Addition::Scatter(s), _) => Some(Added::Scatter(s.per, self.scatter.map_or(0.0, |s| s.sd))),
                (_, Some(law)) => Some(Added::Term(law, values)),
                (_, None) => None,
            });
        }
        out
    }
}
