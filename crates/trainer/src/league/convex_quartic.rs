//! The convex force-motion model (Zhou, Paolini, Bagnell, Mason, ICRA 2016): which wrench the support exerts is a level set of a convex
//! polynomial of the fourth degree instead of an ellipsoid. The published fit reads forces; recordings of poses have none, so that the
//! polynomial and the contact's friction are fitted to the motion of strides, through the contact.
//!
//! The second variant is its stochastic form (Zhou, Bagnell, Mason 2017): each roll-out draws the forms of the polynomial from a Wishart
//! law about the fitted ones and the contact's friction from a log-normal law. How narrow both are is what scores best, by the ranked
//! probability score of the ends of training pushes.

use super::contact::Contact;
use super::strides::{self, RAW, Steps, contacts};
use super::{Class, Fitted, Kind, Plan, Trained};
use crate::league::reads::Reads;
use crate::least_squares::{Block, Descent};
use crate::score::crps_of;
use crate::settings::Settings;
use crate::{Samples, Sequence, Sequences, Task, TrainerError};
use augsim_data::random_stream;
use augsim_nn::Params;
use augsim_physics::push::surface::Surface;
use augsim_physics::push::surface::quartic::{Quartic, TERMS};
use augsim_physics::push::{ContactFriction, Support};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use std::sync::Arc;

/// Numbers of a triangular factor of a form.
const FACTOR: usize = 6;
/// Numbers that are fitted: the factors, and the logarithm of the contact's friction.
const UNKNOWNS: usize = TERMS * FACTOR + 1;
/// Most strides that they are fitted to.
const STRIDES: usize = 1500;
/// Pushes and draws by which the laws of the stochastic form are chosen.
const CHOICE: (usize, usize) = (40, 16);
/// Degrees of freedom of the Wishart law and deviations of the logarithm of the contact's friction that are tried.
const FREEDOMS: [usize; 6] = [5, 10, 20, 50, 150, 500];
const DEVIATIONS: [f64; 4] = [0.0, 0.1, 0.25, 0.5];
/// Added to the diagonal of each form, so that none is singular.
const RIDGE: f64 = 1e-3;
const DESCENT: Descent = Descent { nudge: 1e-4, reach: 0.3, iterations: 25 };

const fn class(make: fn(&Settings) -> Result<Arc<dyn Fitted>, TrainerError>) -> Class {
    Class {
        kind: Kind::Fitted(make),
        reads: Reads::Contacts,
        plan: Plan { hidden: 1, sd_floor: 0.0, learning_rate: 1.0 },
        pushing_only: true,
    }
}

pub(crate) static CONVEX_QUARTIC: Class = class(|_| Ok(Arc::new(ConvexQuartic { drawn: false })));
pub(crate) static CONVEX_QUARTIC_DRAWN: Class = class(|_| Ok(Arc::new(ConvexQuartic { drawn: true })));

#[derive(Debug)]
struct ConvexQuartic {
    /// Whether each roll-out draws a polynomial.
    drawn: bool,
}

type Form = [[f64; 3]; 3];

/// The form of a triangular factor.
fn form(factor: &[f64]) -> Form {
    let l = [[factor[0], 0.0, 0.0], [factor[1], factor[2], 0.0], [factor[3], factor[4], factor[5]]];
    let dot = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| dot(&l[i], &l[j]) + if i == j { RIDGE } else { 0.0 }))
}

/// Another factor of a form about that of `factor`, of a Wishart law with this many degrees of freedom: the columns of `L G / √n`.
fn drawn_form(factor: &[f64], freedom: usize, rng: &mut Xoshiro256PlusPlus) -> Form {
    let mut gram = [[0.0; 3]; 3];
    for _ in 0..freedom {
        let g: [f64; 3] = std::array::from_fn(|_| StandardNormal.sample(rng));
        let v = [
            factor[0] * g[0],
            factor[1] * g[0] + factor[2] * g[1],
            factor[3] * g[0] + factor[4] * g[1] + factor[5] * g[2],
        ];
        for i in 0..3 {
            for j in 0..3 {
                gram[i][j] += v[i] * v[j] / freedom as f64;
            }
        }
    }
    (0..3).for_each(|i| gram[i][i] += RIDGE);
    gram
}

/// The support and the contact of a roll-out.
struct Law {
    quartic: Quartic,
    friction: f64,
}

impl Law {
    fn of(values: &[f64], c_m: f64) -> Self {
        let quartic = Quartic::new(c_m, std::array::from_fn(|k| form(&values[FACTOR * k..])));
        Law { quartic, friction: values[UNKNOWNS - 1].exp() }
    }

    fn drawn(
        values: &[f64],
        c_m: f64,
        (freedom, deviation): (usize, f64),
        rng: &mut Xoshiro256PlusPlus,
    ) -> Self {
        let forms = std::array::from_fn(|k| drawn_form(&values[FACTOR * k..], freedom, rng));
        let noise: f64 = StandardNormal.sample(rng);
        Law { quartic: Quartic::new(c_m, forms), friction: (values[UNKNOWNS - 1] + deviation * noise).exp() }
    }

    /// Displacement (m, m, rad) in the object's frame while the rod goes from `rod` by `travel`, m.
    fn displacement(&self, contact: &Contact, rod: [f64; 2], travel: [f64; 2]) -> [f64; 3] {
        let support = Support::plain(Surface::Quartic { quartic: &self.quartic });
        contact.displacement(rod, travel, &support, &ContactFriction::coulomb(self.friction), None)
    }
}

/// The laws of the samples of a roll-out, one a lane.
struct Laws<'a> {
    contact: &'a Contact,
    each: Vec<Law>,
}

impl Steps for Laws<'_> {
    fn reads_contacts(&self) -> bool {
        true
    }

    fn draw(&mut self, u: &[f32], _: &mut Xoshiro256PlusPlus, out: &mut [f32]) {
        let lanes = self.each.len();
        let raw = &u[u.len() - RAW * lanes..];
        for (lane, law) in self.each.iter().enumerate() {
            let at = |k: usize| f64::from(raw[k * lanes + lane]);
            let moved = law.displacement(self.contact, [at(0), at(1)], [at(2), at(3)]);
            (0..3).for_each(|j| out[j * lanes + lane] = (moved[j] / at(4 + j)) as f32);
        }
    }
}

impl ConvexQuartic {
    fn contact(settings: &Settings) -> Result<Contact, TrainerError> {
        settings.engine.pushing().map(Contact::of).ok_or_else(|| crate::Difference::OtherSystem.into())
    }

    /// Mean over pushes of the score of their ends, in units of the ends' spread.
    fn score(
        trained: Trained<'_>,
        contact: &Contact,
        values: &[f64],
        width: (usize, f64),
        pushes: &[&Sequence],
    ) -> f64 {
        let samples = CHOICE.1;
        let one = |(index, q): (usize, &&Sequence)| -> f64 {
            let mut rng = random_stream(trained.settings.seed, "convex-quartic-choice", index as u64);
            let each = (0..samples).map(|_| Law::drawn(values, contact.c_m, width, &mut rng)).collect();
            let task = Task { start: q.state(0), actions: &q.actions, time: q.time, index: index as u64 };
            let ends = strides::roll(trained, false, task, samples, &mut Laws { contact, each }).values;
            let last = q.state(q.time - 1);
            let column = |j: usize| {
                let mut x = ends[((q.time - 1) * 3 + j) * samples..][..samples].to_vec();
                x.sort_unstable_by(f32::total_cmp);
                crps_of(&x, last[j]) * if j == 2 { contact.c_m } else { 1.0 }
            };
            (0..3).map(column).sum()
        };
        let all: Vec<f64> = pushes.par_iter().enumerate().map(one).collect();
        all.iter().sum::<f64>() / all.len() as f64
    }
}

impl Fitted for ConvexQuartic {
    fn parameters(&self) -> Vec<(&'static str, usize)> {
        vec![("forms", TERMS * FACTOR), ("friction", 1), ("freedom", 1), ("deviation", 1)]
    }

    fn is_deterministic(&self) -> bool {
        !self.drawn
    }

    fn fit(&self, settings: &Settings, train: &Sequences) -> Result<(Vec<f64>, f64), TrainerError> {
        let contact = Self::contact(settings)?;
        let strides: Vec<_> = train.items.iter().flat_map(contacts).collect();
        if strides.is_empty() {
            return Err(TrainerError::NoTrajectories { what: "the training set" });
        }
        let every = strides.len().div_ceil(STRIDES);
        let at = |values: &[f64]| -> Vec<Block> {
            let law = Law::of(values, contact.c_m);
            let residual = |s: &strides::RodWay| -> Block {
                let moved = law.displacement(&contact, s.rod, s.travel);
                let unit = [1.0, 1.0, contact.c_m];
                (0..3).map(|j| unit[j] * (moved[j] - s.moved[j])).collect()
            };
            strides.par_iter().step_by(every).map(residual).collect()
        };
        // From near the declared ellipsoid, with terms that differ, since alike they would stay so.
        let mut start = vec![0.85, 0.0, 0.85, 0.0, 0.0, 0.85, 0.5, 0.05, 0.45, -0.05, 0.05, 0.55];
        start.push(contact.friction.max(1e-3).ln());
        let found = DESCENT.run(start, &at);
        let (mut values, loss) = (found.values, found.loss);
        let (mut freedom, mut deviation) = (FREEDOMS[FREEDOMS.len() - 1], 0.0);
        if self.drawn {
            let scales = Reads::Contacts.fit(settings, train);
            let params = Params::<f32>::new(random_stream(settings.seed, "convex-quartic-choice", 0));
            let trained = Trained { settings, scales: &scales, params: &params };
            let step = train.items.len().div_ceil(CHOICE.0);
            let pushes: Vec<&Sequence> = train.items.iter().step_by(step).collect();
            let mut least = f64::INFINITY;
            for n in FREEDOMS {
                for sd in DEVIATIONS {
                    let score = Self::score(trained, &contact, &values, (n, sd), &pushes);
                    if score < least {
                        (least, freedom, deviation) = (score, n, sd);
                    }
                }
            }
        }
        values.extend([freedom as f64, deviation]);
        Ok((values, loss))
    }

    fn forecast(
        &self,
        trained: Trained<'_>,
        task: Task<'_>,
        samples: usize,
    ) -> Result<Samples, TrainerError> {
        let contact = Self::contact(trained.settings)?;
        let values: Vec<f64> = trained.params.values().iter().map(|v| f64::from(*v)).collect();
        let mut rng = random_stream(trained.settings.seed, "convex-quartic", task.index);
        let width = (values[UNKNOWNS] as usize, values[UNKNOWNS + 1]);
        let each = (0..samples).map(|_| match self.drawn {
            true => Law::drawn(&values, contact.c_m, width, &mut rng),
            false => Law::of(&values, contact.c_m),
        });
        let mut laws = Laws { contact: &contact, each: each.collect() };
        Ok(strides::roll(trained, false, task, samples, &mut laws))
    }
}
