//! A model that may explain the data: the declared one with additions.

use crate::addition::Addition;
use crate::record::Measured;
use augsim_physics::effects::Polar;
use augsim_physics::model::{Parameter, Per};
use augsim_physics::system::{
    Addition as Added, Augmentation, Effect, Fitted, FittedValues, Law, Scatter, System,
};
use std::sync::Arc;

/// A parameter that is fitted.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Free {
    /// Place in the system's parameter vector.
    pub index: usize,
    pub per: Per,
    pub min: f64,
    pub max: f64,
    /// Bounds within which fits move: a direction may turn as far as it likes.
    pub room: (f64, f64),
    /// A size that matters: start and scale.
    pub typical: f64,
    /// Where an added parameter changes nothing; 0 for a declared one.
    pub null: f64,
    /// Which addition it belongs to; `None` for the declared model.
    pub addition: Option<usize>,
    /// Mean and standard deviation over trajectories, where each has its own value and the law of these is known.
    pub prior: Option<(f64, f64)>,
}

impl Free {
    /// A parameter of the declared model, one value for all.
    pub fn declared(index: usize, min: f64, max: f64, typical: f64) -> Self {
        let room = (min, max);
        Self { index, per: Per::All, min, max, room, typical, null: 0.0, addition: None, prior: None }
    }
}

/// A system, nominal values and what is free in them. The values by group stand beside them.
#[derive(Clone, Debug)]
pub(crate) struct Hypothesis {
    pub system: Arc<dyn System>,
    pub values: Vec<f64>,
    /// Declared parameters that have values by group: the place of each in the vector, and its values by group number.
    pub by_group: Vec<(usize, Vec<f64>)>,
    pub free: Vec<Free>,
    pub scatter: Option<Scatter>,
    pub additions: Vec<Addition>,
    /// Number of groups in the data.
    pub groups: usize,
}

/// Turns that a fitted direction may take, rad.
const MOST_TURN: f64 = 20.0;

/// Bounds in fits of parameter `k` of an effect. An amount with a direction may pass its null: the other side is the opposite
/// direction.
fn room(effect: &Effect, k: usize) -> (f64, f64) {
    let p = &effect.parameters[k];
    match (effect.polar, k) {
        (None, _) | (Some(Polar::Axis), 0) => (p.min, p.max),
        (Some(Polar::Direction), 0) => (-p.max, p.max),
        (Some(_), _) => (-MOST_TURN, MOST_TURN),
    }
}

impl Hypothesis {
    /// The declared model with additions; all of its free parameters are free.
    pub fn new(data: &Measured, additions: &[Addition]) -> Self {
        let laws: Vec<Law> = additions.iter().filter_map(Addition::law).collect();
        // Kinds and tables come from this very system: there is none that it refuses.
        let system = data.system.augmented(&laws).unwrap_or_else(|_| data.system.clone());
        let values = system.parameters().iter().map(|p| p.nominal).collect();
        let mut places = system.places().into_iter();
        let declared = data.system.parameters().iter().take(data.system.declared());
        let declared: Vec<(usize, &Parameter)> = declared.enumerate().collect();
        let grouped = declared.iter().filter(|(_, p)| !p.groups.is_empty());
        let by_group = grouped.map(|(index, p)| (*index, p.values_of(&data.groups))).collect();
        let mut free: Vec<Free> = declared
            .into_iter()
            .filter(|(_, p)| !p.frozen)
            .map(|(index, p)| Free {
                index,
                per: p.per,
                min: p.min,
                max: p.max,
                room: (p.min, p.max),
                typical: p.nominal.abs().max(1e-3),
                null: 0.0,
                addition: None,
                prior: None,
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
                    if let Some(place) = places.next() {
                        for (k, (index, p)) in place.zip(&listed.effect.parameters).enumerate() {
                            free.push(Free {
                                index,
                                per: *per,
                                min: p.min,
                                max: p.max,
                                room: room(&listed.effect, k),
                                typical: p.typical,
                                null: p.null,
                                addition: Some(number),
                                prior: None,
                            });
                        }
                    }
                }
                Addition::Split(split) => {
                    free.iter_mut().filter(|f| f.index == split.index).for_each(|f| f.per = Per::Group)
                }
                Addition::Table(table) => {
                    for index in places.next().unwrap_or_default() {
                        let knot = &system.parameters()[index];
                        free.push(Free {
                            index,
                            per: Per::All,
                            min: knot.min,
                            max: knot.max,
                            room: (knot.min, knot.max),
                            typical: table.target.usual,
                            null: 0.0,
                            addition: Some(number),
                            prior: None,
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

    /// Length of theta: the parameters that are common to all trajectories or to a group.
    pub fn theta_len(&self) -> usize {
        self.free.iter().map(|f| self.width(f)).sum()
    }

    /// Number of entries of theta that a free parameter takes: one, or one for each group.
    pub fn width(&self, f: &Free) -> usize {
        match f.per {
            Per::All => 1,
            Per::Group => self.groups,
            Per::Trajectory => 0,
        }
    }

    /// Entries of theta that belong to an addition; those of a declared parameter that it gives a value for each group.
    pub fn range_of(&self, addition: usize) -> std::ops::Range<usize> {
        if let Some(Addition::Split(split)) = self.additions.get(addition) {
            return self.entries_of(split.index).unwrap_or(0..0);
        }
        let mut at = 0;
        let (mut first, mut last) = (usize::MAX, 0);
        for f in &self.free {
            let width = self.width(f);
            if f.addition == Some(addition) {
                first = first.min(at);
                last = at + width;
            }
            at += width;
        }
        if first == usize::MAX { at..at } else { first..last }
    }

    /// Entries of theta of the free parameter `index`; `None` if it is frozen or each trajectory's own.
    pub fn entries_of(&self, index: usize) -> Option<std::ops::Range<usize>> {
        let mut at = 0;
        for f in &self.free {
            if f.index == index {
                return (self.width(f) > 0).then_some(at..at + self.width(f));
            }
            at += self.width(f);
        }
        None
    }

    /// Entries of theta that belong to the declared model: they come first.
    pub fn range_of_declared(&self) -> usize {
        self.free.iter().filter(|f| f.addition.is_none()).map(|f| self.width(f)).sum()
    }

    /// Start values of theta: nominal for the declared model, `share` of the way from the null to the typical size for additions.
    pub fn theta_start(&self, share: f64) -> Vec<f64> {
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

    /// The system's parameters for a trajectory of `group` as far as the model declares them.
    pub fn values_of(&self, group: usize) -> Vec<f64> {
        let mut values = self.values.clone();
        for (index, by_group) in &self.by_group {
            values[*index] = by_group[group];
        }
        values
    }

    /// Parameter values of a group with the entries of `theta` in their places.
    pub fn values_at(&self, theta: &[f64], group: usize) -> Vec<f64> {
        let mut values = self.values_of(group);
        let mut at = 0;
        for f in &self.free {
            match f.per {
                Per::All => values[f.index] = theta[at],
                Per::Group => values[f.index] = theta[at + group],
                Per::Trajectory => {}
            }
            at += self.width(f);
        }
        values
    }

    /// The bounds of each entry of theta that results keep to.
    pub fn limits(&self) -> Vec<(f64, f64)> {
        self.free.iter().flat_map(|f| std::iter::repeat_n((f.min, f.max), self.width(f))).collect()
    }

    /// Gives the entries of additions that another hypothesis has as well the values that they have there.
    pub fn carry_additions(&self, to: &mut [f64], other: &Hypothesis, theta: &[f64]) {
        for (number, addition) in self.additions.iter().enumerate() {
            if let Some(known) = other.additions.iter().position(|a| a == addition) {
                to[self.range_of(number)].copy_from_slice(&theta[other.range_of(known)]);
            }
        }
    }

    /// Entries of the declared parameters as another hypothesis has them: a value for all becomes that of each group, and
    /// values by group their mean.
    pub fn declared_from(&self, other: &Hypothesis, theta: &[f64]) -> Vec<f64> {
        let mut out = Vec::new();
        for f in self.free.iter().filter(|f| f.addition.is_none()) {
            let (width, known) = (self.width(f), other.entries_of(f.index));
            let known = known.map_or(&[][..], |place| &theta[place]);
            match known.len() {
                0 => out.extend(std::iter::repeat_n(self.values[f.index].clamp(f.min, f.max), width)),
                n if n == width => out.extend(known),
                n => out.extend(std::iter::repeat_n(known.iter().sum::<f64>() / n as f64, width)),
            }
        }
        out
    }

    /// Brings directions to the values that say the same within their bounds. Whether anything changed.
    pub fn bring_round(&self, theta: &mut [f64]) -> bool {
        let before = theta.to_vec();
        for (number, addition) in self.additions.iter().enumerate() {
            let polar = addition.listed().and_then(|effect| effect.polar);
            if let (Some(polar), [amount, angle]) = (polar, &mut theta[self.range_of(number)]) {
                polar.bring_round(amount, angle);
            }
        }
        theta != before
    }

    /// Bounds of each entry of theta in fits.
    pub fn bounds(&self) -> Vec<(f64, f64)> {
        self.free.iter().flat_map(|f| std::iter::repeat_n(f.room, self.width(f))).collect()
    }

    /// The contents of the augmented model file: the values `theta` with 95 % intervals `ci95`, and the additions.
    pub fn augmentation(&self, data: &Measured, theta: &[f64], ci95: &[[f64; 2]]) -> Augmentation {
        let mut out = Augmentation {
            clock_reference_s: data.clock_reference_s,
            scatter_sd: self.scatter.map(|s| s.sd),
            ..Augmentation::default()
        };
        let mut added: Vec<Vec<Fitted>> = vec![Vec::new(); self.additions.len()];
        let mut at = 0;
        for f in &self.free {
            let values = match f.per {
                Per::All => Some(FittedValues::One(theta[at])),
                Per::Group => {
                    let each = data.groups.iter().cloned().zip(theta[at..].iter().copied());
                    Some(FittedValues::ByGroup(each.collect()))
                }
                Per::Trajectory => None,
            };
            if let Some(values) = values {
                let fitted = Fitted { values, ci95: ci95.get(at).copied().filter(|[low, high]| low < high) };
                match f.addition {
                    None => out.declared.push((f.index, fitted)),
                    Some(number) => added[number].push(fitted),
                }
            }
            at += self.width(f);
        }
        for (addition, values) in self.additions.iter().zip(added) {
            out.additions.extend(match (addition, addition.law()) {
                (Addition::Scatter(s), _) => Some(Added::Scatter(s.per, self.scatter.map_or(0.0, |s| s.sd))),
                (_, Some(law)) => Some(Added::Law(law, values)),
                (_, None) => None,
            });
        }
        out
    }
}
