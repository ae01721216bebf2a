//! A model with some effects added, and which of its parameters are fitted.

use augsim_physics::effects::Polar;
use augsim_physics::model::{Per, PushModel};
use augsim_physics::push::effects::{index_of, spec_of};
use augsim_physics::push::{BASE_PARAMETERS, World};

/// Kinds of additions that are no effect: a declared parameter, in the order of [`BASE_PARAMETERS`], has its own value in each
/// group.
const PER_GROUP: [&str; BASE_PARAMETERS.len()] = [
    "c_m per group",
    "contact_friction per group",
    "rod_radius_m per group",
    "support_friction per group",
    "mass_kg per group",
];

/// The kind of a base parameter with a value for each group.
pub(crate) fn kind_per_group(base: usize) -> &'static str {
    PER_GROUP[base]
}

/// The base parameter of a kind in which it has a value for each group.
pub(crate) fn base_per_group(kind: &str) -> Option<usize> {
    PER_GROUP.iter().position(|k| *k == kind)
}

/// A kind of addition by name; scatter is none, but a property of what is left.
pub(crate) fn kind_of(name: &str) -> Option<&'static str> {
    index_of(name)
        .and_then(|_| spec_of(name))
        .map(|s| s.kind)
        .or_else(|| base_per_group(name).map(kind_per_group))
}

/// How many parameters a kind adds, one at least.
pub(crate) fn size_of(kind: &str, groups: usize) -> usize {
    let own = match spec_of(kind) {
        Some(spec) => spec.parameters.len(),
        None => groups.saturating_sub(1),
    };
    own.max(1)
}

/// A fitted parameter.
#[derive(Clone, Debug)]
pub(crate) struct Free {
    /// Place in the parameter vector.
    pub index: usize,
    pub name: String,
    pub unit: &'static str,
    pub min: f64,
    pub max: f64,
    /// Kind of the addition it belongs to; none for a declared parameter.
    pub kind: Option<&'static str>,
    /// Not a value, but by how much that of this group differs from that of the first, which stands before it.
    pub group: Option<usize>,
    /// Where fits begin.
    pub nominal: f64,
    /// Where an added parameter changes nothing.
    pub null: f64,
}

/// How many of a kind's parameters say how much of it there is: the others are its direction or its scale.
pub(crate) fn amounts(kind: &str) -> usize {
    spec_of(kind).and_then(|s| s.amounts).unwrap_or(usize::MAX)
}

/// A model with effects.
#[derive(Clone, Debug)]
pub(crate) struct Hypothesis {
    pub world: World,
    /// All parameters; the free ones are replaced by fitted values.
    pub values: Vec<f64>,
    /// Frozen parameters that have values by group: the place of each in the vector, and its values by group number.
    by_group: Vec<(usize, Vec<f64>)>,
    pub free: Vec<Free>,
    /// Added kinds.
    pub kinds: Vec<&'static str>,
}

impl Hypothesis {
    /// `groups` are those of the data.
    pub fn new(model: &PushModel, groups: &[String], kinds: &[&'static str]) -> Self {
        let (mut world, mut values) = model.world();
        let (mut free, mut by_group) = (Vec::new(), Vec::new());
        // Scatter is no law and has no place in the vector.
        let blocks = model.effects.iter().filter(|b| index_of(&b.kind).is_some());
        let of_effects =
            blocks.flat_map(|b| b.parameters.iter().map(|p| (p, spec_of(&b.kind).map(|s| s.kind))));
        let declared = model.parameters.iter().map(|p| (p, None)).chain(of_effects);
        for (index, (p, kind)) in declared.enumerate() {
            if !p.frozen {
                let unit = if kind.is_none() { base_unit(&p.name) } else { "" };
                let (name, min, max) = (p.name.clone(), p.min, p.max);
                free.push(Free {
                    index,
                    name,
                    unit,
                    min,
                    max,
                    kind,
                    group: None,
                    nominal: p.nominal,
                    null: 0.0,
                });
            }
        }
        for (index, p) in model.parameters.iter().enumerate().filter(|(_, p)| p.per == Per::Group) {
            let of = p.values_of(groups);
            let Some(at) = free.iter().position(|f| f.index == index) else {
                by_group.push((index, of));
                continue;
            };
            free[at].nominal = of.first().copied().unwrap_or(p.nominal);
            let first = free[at].clone();
            free.extend(first.differences(groups.len(), None, |g| of[g] - first.nominal));
        }
        for kind in kinds {
            let base = base_per_group(kind).and_then(|index| free.iter().position(|f| f.index == index));
            if let Some(first) = base.map(|at| free[at].clone()) {
                free.extend(first.differences(groups.len(), Some(kind), |_| 0.0));
            }
            let (Some(index), Some(spec)) = (index_of(kind), spec_of(kind)) else { continue };
            world.add(index);
            for p in spec.parameters {
                let f = Free {
                    index: values.len(),
                    name: p.name.into(),
                    unit: p.unit,
                    min: p.min,
                    max: p.max,
                    kind: Some(spec.kind),
                    group: None,
                    nominal: p.null,
                    null: p.null,
                };
                free.push(f);
                values.push(p.null);
            }
        }
        Self { world, values, by_group, free, kinds: kinds.to_vec() }
    }

    /// Nominal values of the free parameters.
    pub fn start(&self) -> Vec<f64> {
        self.free.iter().map(|f| f.nominal.clamp(f.min, f.max)).collect()
    }

    /// The whole vector, for a push of `group`, with `theta` filled in.
    pub fn filled(&self, theta: &[f64], group: usize) -> Vec<f64> {
        let mut values = self.values.clone();
        for (index, by_group) in &self.by_group {
            values[*index] = by_group[group];
        }
        for (f, &v) in self.free.iter().zip(theta) {
            match f.group {
                None => values[f.index] = v,
                Some(of) if of == group => values[f.index] += v,
                Some(_) => {}
            }
        }
        values
    }

    /// For each free parameter which of the derivatives of a push of `group` is its own: differences between groups share that
    /// of the value that they differ from. None where the push does not know the parameter.
    pub fn lanes(&self, group: usize) -> Vec<Option<usize>> {
        let own: Vec<&Free> = self.free.iter().filter(|f| f.group.is_none()).collect();
        let lane = |f: &Free| own.iter().position(|o| o.index == f.index);
        self.free.iter().map(|f| if f.group.is_none_or(|of| of == group) { lane(f) } else { None }).collect()
    }

    /// How many derivatives a push needs.
    pub fn lane_count(&self) -> usize {
        self.free.iter().filter(|f| f.group.is_none()).count()
    }

    /// Where the parameters of an added kind stand in theta.
    pub fn range_of(&self, kind: &str) -> std::ops::Range<usize> {
        let is = |f: &Free| f.kind == Some(kind);
        let first = self.free.iter().position(is).unwrap_or(self.free.len());
        first..first + self.free[first..].iter().take_while(|f| is(f)).count()
    }

    /// Values within bounds; an angle of an axis or a direction is brought round.
    pub fn admit(&self, theta: &mut [f64]) {
        for kind in &self.kinds {
            if let Some(polar) = polar(kind) {
                let range = self.range_of(kind);
                if let [amount, angle] = &mut theta[range] {
                    polar.bring_round(amount, angle);
                }
            }
        }
        for (i, f) in self.free.iter().enumerate() {
            theta[i] = theta[i].clamp(f.min, f.max);
            let of = self.free[..i].iter().position(|o| f.group.is_some() && o.index == f.index);
            if let Some(of) = of {
                let o = &self.free[of];
                theta[i] = theta[i].clamp(o.min - theta[of], o.max - theta[of]);
            }
        }
    }
}

impl Free {
    /// What the values of the other groups differ by from this one, which becomes that of the first.
    fn differences(
        &self,
        groups: usize,
        kind: Option<&'static str>,
        nominal: impl Fn(usize) -> f64,
    ) -> Vec<Free> {
        let range = self.max - self.min;
        (1..groups)
            .map(|group| Free {
                kind,
                group: Some(group),
                min: -range,
                max: range,
                nominal: nominal(group),
                null: 0.0,
                ..self.clone()
            })
            .collect()
    }
}

fn base_unit(name: &str) -> &'static str {
    match name {
        "c_m" | "rod_radius_m" => "m",
        "mass_kg" => "kg",
        _ => "",
    }
}

/// Values at which a kind is first tried: its null, or near it for a law that is singular there.
pub(crate) fn probe(kind: &str, groups: usize) -> Vec<f64> {
    match spec_of(kind) {
        Some(spec) if spec.probe.is_empty() => spec.parameters.iter().map(|p| p.null).collect(),
        Some(spec) => spec.probe.to_vec(),
        None => vec![0.0; groups.saturating_sub(1)],
    }
}

/// The polar pair that the parameters of a kind are.
pub(crate) fn polar(kind: &str) -> Option<Polar> {
    spec_of(kind).and_then(|s| s.polar)
}
