//! A model with some effects added, and which of its parameters are fitted.

use augsim_physics::effects::EffectSpec;
use augsim_physics::model::PushModel;
use augsim_physics::push::World;
use augsim_physics::push::effects::{index_of, spec_of};
use std::f64::consts::PI;

/// A fitted parameter.
#[derive(Clone, Debug)]
pub(crate) struct Free {
    /// Place in the parameter vector.
    pub index: usize,
    pub name: String,
    pub unit: &'static str,
    pub min: f64,
    pub max: f64,
    /// Kind of the effect it belongs to; none for a declared parameter.
    pub kind: Option<&'static str>,
}

/// A model with effects.
#[derive(Clone, Debug)]
pub(crate) struct Hypothesis {
    pub world: World,
    /// All parameters; the free ones are replaced by fitted values.
    pub values: Vec<f64>,
    pub free: Vec<Free>,
    /// Added kinds.
    pub kinds: Vec<&'static str>,
}

impl Hypothesis {
    pub fn new(model: &PushModel, kinds: &[&'static str]) -> Self {
        let (mut world, mut values) = model.world();
        let mut free = Vec::new();
        // Scatter is no law and has no place in the vector.
        let blocks = model.effects.iter().filter(|b| index_of(&b.kind).is_some());
        let of_effects =
            blocks.flat_map(|b| b.parameters.iter().map(|p| (p, spec_of(&b.kind).map(|s| s.kind))));
        let declared = model.parameters.iter().map(|p| (p, None)).chain(of_effects);
        for (index, (p, kind)) in declared.enumerate() {
            if !p.frozen {
                let unit = if kind.is_none() { base_unit(&p.name) } else { "" };
                free.push(Free { index, name: p.name.clone(), unit, min: p.min, max: p.max, kind });
            }
        }
        for kind in kinds {
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
                };
                free.push(f);
                values.push(p.null);
            }
        }
        Self { world, values, free, kinds: kinds.to_vec() }
    }

    /// Nominal values of the free parameters.
    pub fn start(&self) -> Vec<f64> {
        self.free.iter().map(|f| self.values[f.index].clamp(f.min, f.max)).collect()
    }

    /// The whole vector with `theta` filled in.
    pub fn filled(&self, theta: &[f64]) -> Vec<f64> {
        let mut values = self.values.clone();
        self.free.iter().zip(theta).for_each(|(f, &v)| values[f.index] = v);
        values
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
            if let Some(polar) = Polar::of(kind) {
                let range = self.range_of(kind);
                if let [amount, angle] = &mut theta[range] {
                    polar.bring_round(amount, angle);
                }
            }
        }
        self.free.iter().zip(theta).for_each(|(f, v)| *v = v.clamp(f.min, f.max));
    }
}

fn base_unit(name: &str) -> &'static str {
    match name {
        "c_m" | "rod_radius_m" => "m",
        "mass_kg" => "kg",
        _ => "",
    }
}

/// Effects of an amount and a direction, which has no meaning where the amount vanishes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Polar {
    /// A ratio of two axes: the axis repeats after half a turn, and its inverse is a quarter turn.
    Axis,
    /// A size: the direction repeats after a turn.
    Direction,
}

impl Polar {
    pub fn of(kind: &str) -> Option<Self> {
        match kind {
            "table-anisotropy" | "object-anisotropy" => Some(Polar::Axis),
            "table-tilt" => Some(Polar::Direction),
            _ => None,
        }
    }

    fn bring_round(self, amount: &mut f64, angle: &mut f64) {
        match self {
            Polar::Axis => {
                if *amount > 0.0 && *amount < 1.0 {
                    *amount = 1.0 / *amount;
                    *angle += 0.5 * PI;
                }
                *angle -= (*angle / PI).round() * PI;
            }
            Polar::Direction => {
                if *amount < 0.0 {
                    *amount = -*amount;
                    *angle += PI;
                }
                *angle -= (*angle / (2.0 * PI)).round() * 2.0 * PI;
            }
        }
    }

    /// The values a linear `step` away from `at`, taken along the plane of amount and direction.
    pub fn step(self, at: [f64; 2], step: [f64; 2]) -> [f64; 2] {
        let (turns, zero) = match self {
            Polar::Axis => (2.0, 1.0),
            Polar::Direction => (1.0, 0.0),
        };
        let amount = at[0] - zero;
        let (along, across) = (amount + step[0], amount * turns * step[1]);
        [zero + along.hypot(across), at[1] + across.atan2(along) / turns]
    }
}

/// Values at which a kind is first tried: near its null for a law that is smooth there, at typical sizes otherwise.
pub(crate) fn probes(spec: &EffectSpec) -> Vec<Vec<f64>> {
    let null: Vec<f64> = spec.parameters.iter().map(|p| p.null).collect();
    match spec.kind {
        "table-anisotropy" | "object-anisotropy" => vec![vec![1.02, 0.0]],
        "table-tilt" => vec![vec![0.001, 0.0]],
        "speed-dependent-friction" => vec![vec![0.1, 0.02]],
        _ => vec![null],
    }
}
