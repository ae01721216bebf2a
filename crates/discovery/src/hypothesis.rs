//! A model that may explain the data: the declared one with additions.

use crate::addition::{Addition, KNOTS};
use crate::record::Measured;
use augsim_physics::effects::{ScatterPer, spec_of};
use augsim_physics::model::{EffectBlock, Model, Parameter, Per, Release};
use augsim_physics::system::{Law, System};
use std::sync::Arc;

/// A parameter that is fitted.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Free {
    /// Place in the system's parameter vector.
    pub index: usize,
    pub per: Per,
    pub min: f64,
    pub max: f64,
    /// A size that matters: start and scale.
    pub typical: f64,
    /// Which addition it belongs to; `None` for the declared model.
    pub addition: Option<usize>,
    /// Mean and standard deviation over trajectories, where each has its own value and the law of these is known.
    pub prior: Option<(f64, f64)>,
}

/// The scatter of a hypothesis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scatter {
    pub per: ScatterPer,
    pub sd: f64,
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
    pub release: Release,
    /// Number of groups in the data.
    pub groups: usize,
}

impl Hypothesis {
    /// The declared model with additions; all of its free parameters are free.
    pub fn new(model: &Model, data: &Measured, additions: &[Addition]) -> Self {
        let laws: Vec<Law> = additions.iter().filter_map(Addition::law).collect();
        // Kinds and tables come from this very system: there is none that it refuses.
        let system = data.system.augmented(&laws).unwrap_or_else(|_| data.system.clone());
        let values = system.parameters().iter().map(|p| p.nominal).collect();
        let mut places = system.places().into_iter();
        let blocks = model.effects.iter().filter(|b| b.scatter.is_none());
        let declared = model.parameters.iter().chain(blocks.flat_map(|b| &b.parameters));
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
                typical: p.nominal.abs().max(1e-3),
                addition: None,
                prior: None,
            })
            .collect();
        let mut scatter = model.effects.iter().find_map(|b| {
            let per = b.scatter?;
            Some(Scatter { per, sd: b.parameters.first()?.nominal.max(1e-4) })
        });
        for (number, addition) in additions.iter().enumerate() {
            match addition {
                Addition::Scatter(per) => scatter = Some(Scatter { per: *per, sd: 0.02 }),
                Addition::Kind(kind, per) => {
                    if let (Some(place), Some(spec)) = (places.next(), spec_of(kind)) {
                        for (index, p) in place.zip(spec.parameters) {
                            free.push(Free {
                                index,
                                per: *per,
                                min: p.min,
                                max: p.max,
                                typical: p.typical,
                                addition: Some(number),
                                prior: None,
                            });
                        }
                    }
                }
                Addition::Law(_) => {
                    for index in places.next().unwrap_or_default() {
                        free.push(Free {
                            index,
                            per: Per::All,
                            min: -100.0,
                            max: 100.0,
                            typical: 1.0,
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
            release: model.release,
            groups: data.groups.len(),
        }
    }

    /// Length of theta: the parameters that are common to all trajectories or to a group.
    pub fn theta_len(&self) -> usize {
        self.free.iter().map(|f| self.width(f)).sum()
    }

    /// Entries of theta that a free parameter takes.
    pub fn width(&self, f: &Free) -> usize {
        match f.per {
            Per::All => 1,
            Per::Group => self.groups,
            Per::Trajectory => 0,
        }
    }

    /// Entries of theta that belong to an addition.
    pub fn range_of(&self, addition: usize) -> std::ops::Range<usize> {
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

    /// Start values of theta: nominal for the declared model, `share` of the typical size for additions.
    pub fn theta_start(&self, share: f64) -> Vec<f64> {
        let mut theta = Vec::new();
        for f in &self.free {
            let value = match f.addition {
                None => self.values[f.index],
                Some(_) => share * f.typical,
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

    /// Bounds of each entry of theta.
    pub fn bounds(&self) -> Vec<(f64, f64)> {
        self.free.iter().flat_map(|f| std::iter::repeat_n((f.min, f.max), self.width(f))).collect()
    }

    /// The model file of this hypothesis at `theta` with 95 % intervals `ci95`.
    pub fn to_model(&self, model: &Model, data: &Measured, theta: &[f64], ci95: &[[f64; 2]]) -> Model {
        let mut out = model.clone();
        if data.has_start_time {
            out.clock_reference_s = Some(data.clock_reference_s);
        }
        let mut at = 0;
        let mut put = |f: &Free, p: &mut Parameter| {
            match f.per {
                Per::All => {
                    p.nominal = theta[at];
                    p.ci95 = ci95.get(at).copied();
                }
                Per::Group => {
                    p.per = Per::Group;
                    p.groups = data.groups.iter().cloned().zip(theta[at..].iter().copied()).collect();
                    let mean = theta[at..at + self.groups].iter().sum::<f64>() / self.groups as f64;
                    // Rounding must not carry the mean of values at a bound beyond it.
                    p.nominal = mean.clamp(p.min, p.max);
                }
                Per::Trajectory => {}
            }
            at += self.width(f);
        };
        let declared = out.parameters.len();
        for f in self.free.iter().filter(|f| f.addition.is_none()) {
            if f.index < declared {
                put(f, &mut out.parameters[f.index]);
            } else {
                let flat =
                    out.effects.iter_mut().filter(|b| b.scatter.is_none()).flat_map(|b| &mut b.parameters);
                if let Some(p) = flat.into_iter().nth(f.index - declared) {
                    put(f, p);
                }
            }
        }
        for (number, addition) in self.additions.iter().enumerate() {
            let specs = spec_of(addition.kind()).map_or(&[][..], |s| s.parameters);
            let blank = |name: String, min: f64, max: f64| Parameter {
                name,
                nominal: 0.0,
                min,
                max,
                frozen: false,
                per: Per::All,
                ci95: None,
                groups: Vec::new(),
            };
            let mut block = EffectBlock {
                kind: addition.kind().into(),
                scatter: None,
                table: None,
                parameters: specs.iter().map(|s| blank(s.name.into(), s.min, s.max)).collect(),
            };
            match addition {
                Addition::Scatter(per) => {
                    block.scatter = Some(*per);
                    block.parameters[0].nominal = self.scatter.map_or(0.0, |s| s.sd);
                }
                Addition::Law(table) => {
                    block.table = Some(table.clone());
                    block.parameters = (0..KNOTS).map(|i| blank(format!("knot{i}"), -100.0, 100.0)).collect();
                }
                Addition::Kind(..) => {}
            }
            for (f, p) in self.free.iter().filter(|f| f.addition == Some(number)).zip(&mut block.parameters) {
                put(f, p);
            }
            out.effects.push(block);
        }
        if let (Some(s), Some(b)) = (self.scatter, out.effects.iter_mut().find(|b| b.scatter.is_some())) {
            b.parameters[0].nominal = s.sd;
        }
        // A table in a model file is a list of values, without intervals.
        let tables = out.effects.iter_mut().filter(|b| b.table.is_some());
        tables.flat_map(|b| &mut b.parameters).for_each(|p| p.ci95 = None);
        out
    }
}
