//! The convex force-motion model (Zhou, Paolini, Bagnell, Mason, ICRA 2016).
//!
//! The limit surface of the support friction is a level set of a convex quartic polynomial instead of an
//! ellipsoid.
//!
//! The polynomial is H(F) = sum over k of (F' A_k F)^2 (`Quartic`), with A_k = L_k L_k' + ridge and L_k lower
//! triangular. The published fit uses measured forces. Recordings of poses have none, so here the factors and
//! the contact friction are fitted to the displacements of strides through the contact model, by robust least
//! squares.
//!
//! The second variant is stochastic (Zhou, Bagnell, Mason 2017): each roll-out draws the forms from a Wishart
//! distribution around the fitted ones, and the contact friction from a log-normal distribution. The degrees
//! of freedom and the standard deviation are those with the lowest CRPS of the final poses of training
//! pushes.

use super::contact::Contact;
use super::strides::{self, CorrectionSampler, ROD_MOTION_WIDTH, rod_motions};
use super::{Class, Defaults, Fitted, Kind, Trained};
use crate::league::inputs::ClassInputs;
use crate::least_squares::{Block, LevenbergMarquardt};
use crate::score::crps_from_samples;
use crate::settings::Settings;
use crate::{Samples, Sequence, Sequences, Task, TrainerError};
use augsim_data::random_stream;
use augsim_nn::Params;
use augsim_physics::push::surface::Surface;
use augsim_physics::push::surface::quartic::{QUADRATIC_FORMS, Quartic};
use augsim_physics::push::{ContactFriction, Support};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use std::sync::Arc;

/// Number of entries of the triangular factor of a quadratic form.
const FACTOR: usize = 6;
/// Number of fitted values: the factors of the quadratic forms, and the logarithm of the contact friction.
const UNKNOWNS: usize = QUADRATIC_FORMS * FACTOR + 1;
/// Maximum number of strides (short motions of the rod) in the fit.
const MAX_STRIDES: usize = 1500;
/// Number of training pushes on which the spreads of the stochastic variant are chosen.
const SPREAD_PUSHES: usize = 40;
/// Number of samples per push when the spreads are chosen.
const SPREAD_SAMPLES: usize = 16;
/// Candidate degrees of freedom of the Wishart distribution of the quadratic forms.
const DEGREES_OF_FREEDOM: [usize; 6] = [5, 10, 20, 50, 150, 500];
/// Candidate standard deviations of the logarithm of the random contact friction.
const FRICTION_DEVIATIONS: [f64; 4] = [0.0, 0.1, 0.25, 0.5];
/// Added to the diagonal of each quadratic form, so that no form is singular.
const RIDGE: f64 = 1e-3;
/// Options of the least-squares fit of limit surface and friction.
const DESCENT: LevenbergMarquardt =
    LevenbergMarquardt { difference_step: 1e-4, max_change: 0.3, max_iterations: 25 };

const fn class(make: fn(&Settings) -> Result<Arc<dyn Fitted>, TrainerError>) -> Class {
    Class {
        kind: Kind::Fitted(make),
        inputs: ClassInputs::PushStrides,
        defaults: Defaults { hidden: 1, sd_floor: 0.0, learning_rate: 1.0 },
        is_pushing_only: true,
    }
}

pub(crate) static CONVEX_QUARTIC: Class = class(|_| Ok(Arc::new(ConvexQuartic { is_stochastic: false })));
pub(crate) static CONVEX_QUARTIC_DRAWN: Class =
    class(|_| Ok(Arc::new(ConvexQuartic { is_stochastic: true })));

#[derive(Debug)]
struct ConvexQuartic {
    /// Whether each roll-out draws a random limit surface instead of using the fitted one.
    is_stochastic: bool,
}

/// Symmetric 3 x 3 matrix of a quadratic form of force and moment.
type Form = [[f64; 3]; 3];

/// Computes the quadratic form L L' + ridge of a triangular factor L.
fn form(factor: &[f64]) -> Form {
    let l = [[factor[0], 0.0, 0.0], [factor[1], factor[2], 0.0], [factor[3], factor[4], factor[5]]];
    let dot = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| dot(&l[i], &l[j]) + if i == j { RIDGE } else { 0.0 }))
}

/// Draws a quadratic form L G (L G)' / n + ridge from the Wishart distribution with mean L L'.
///
/// n is the number of degrees of freedom, and G is `[3, n]` with standard normal entries.
fn draw_form(factor: &[f64], degrees: usize, rng: &mut Xoshiro256PlusPlus) -> Form {
    let mut gram = [[0.0; 3]; 3];
    for _ in 0..degrees {
        let g: [f64; 3] = std::array::from_fn(|_| StandardNormal.sample(rng));
        let v = [
            factor[0] * g[0],
            factor[1] * g[0] + factor[2] * g[1],
            factor[3] * g[0] + factor[4] * g[1] + factor[5] * g[2],
        ];
        for i in 0..3 {
            for j in 0..3 {
                gram[i][j] += v[i] * v[j] / degrees as f64;
            }
        }
    }
    (0..3).for_each(|i| gram[i][i] += RIDGE);
    gram
}

/// Friction of a roll-out: limit surface of the support, and contact friction.
struct FrictionModel {
    quartic: Quartic,
    friction: f64,
}

impl FrictionModel {
    /// Builds the friction model at the fitted values.
    fn fitted(values: &[f64], c_m: f64) -> Self {
        let quartic = Quartic::new(c_m, std::array::from_fn(|k| form(&values[FACTOR * k..])));
        FrictionModel { quartic, friction: values[UNKNOWNS - 1].exp() }
    }

    /// Draws a friction model around the fitted values; the spread is (degrees of freedom, sd of ln friction).
    fn draw(
        values: &[f64],
        c_m: f64,
        (degrees, deviation): (usize, f64),
        rng: &mut Xoshiro256PlusPlus,
    ) -> Self {
        let forms = std::array::from_fn(|k| draw_form(&values[FACTOR * k..], degrees, rng));
        let noise: f64 = StandardNormal.sample(rng);
        FrictionModel {
            quartic: Quartic::new(c_m, forms),
            friction: (values[UNKNOWNS - 1] + deviation * noise).exp(),
        }
    }

    /// Computes the object's displacement (m, m, rad) while the rod moves from position `rod` by `travel`, m.
    fn displacement(&self, contact: &Contact, rod: [f64; 2], travel: [f64; 2]) -> [f64; 3] {
        let support = Support::plain(Surface::Quartic { quartic: &self.quartic });
        contact.displacement(rod, travel, &support, &ContactFriction::coulomb(self.friction), None)
    }
}

/// Friction models of a roll-out's samples, one per lane.
struct ModelPerLane<'a> {
    contact: &'a Contact,
    models: Vec<FrictionModel>,
}

impl CorrectionSampler for ModelPerLane<'_> {
    fn needs_rod_motion(&self) -> bool {
        true
    }

    fn sample(&mut self, u: &[f32], _: &mut Xoshiro256PlusPlus, out: &mut [f32]) {
        let lanes = self.models.len();
        let rod_motion = &u[u.len() - ROD_MOTION_WIDTH * lanes..];
        for (lane, model) in self.models.iter().enumerate() {
            let value = |k: usize| f64::from(rod_motion[k * lanes + lane]);
            let displacement = model.displacement(self.contact, [value(0), value(1)], [value(2), value(3)]);
            (0..3).for_each(|j| out[j * lanes + lane] = (displacement[j] / value(4 + j)) as f32);
        }
    }
}

impl ConvexQuartic {
    /// Builds the contact model of the run's engine.
    fn contact(settings: &Settings) -> Result<Contact, TrainerError> {
        settings
            .engine
            .push_model()
            .map(Contact::from_model)
            .ok_or_else(|| crate::Difference::OtherSystem.into())
    }

    /// Computes the mean over pushes of the CRPS of the final pose, m.
    ///
    /// The score is summed over the columns; that of the angle is multiplied by c.
    fn final_pose_score(
        trained: Trained<'_>,
        contact: &Contact,
        values: &[f64],
        spread: (usize, f64),
        pushes: &[&Sequence],
    ) -> f64 {
        let samples = SPREAD_SAMPLES;
        let score_of = |(index, q): (usize, &&Sequence)| -> f64 {
            let mut rng = random_stream(trained.settings.seed, "convex-quartic-choice", index as u64);
            let draw = |_| FrictionModel::draw(values, contact.c_m, spread, &mut rng);
            let models = (0..samples).map(draw).collect();
            let task = Task { start: q.state(0), actions: &q.actions, time: q.time, index: index as u64 };
            let mut sampler = ModelPerLane { contact, models };
            let forecast = strides::roll_out(trained, false, task, samples, &mut sampler).values;
            let last = q.state(q.time - 1);
            let column = |j: usize| {
                let mut x = forecast[((q.time - 1) * 3 + j) * samples..][..samples].to_vec();
                x.sort_unstable_by(f32::total_cmp);
                crps_from_samples(&x, last[j]) * if j == 2 { contact.c_m } else { 1.0 }
            };
            (0..3).map(column).sum()
        };
        let scores: Vec<f64> = pushes.par_iter().enumerate().map(score_of).collect();
        scores.iter().sum::<f64>() / scores.len() as f64
    }
}

impl Fitted for ConvexQuartic {
    fn parameters(&self) -> Vec<(&'static str, usize)> {
        vec![("forms", QUADRATIC_FORMS * FACTOR), ("friction", 1), ("freedom", 1), ("deviation", 1)]
    }

    fn is_deterministic(&self) -> bool {
        !self.is_stochastic
    }

    fn fit(&self, settings: &Settings, train: &Sequences) -> Result<(Vec<f64>, f64), TrainerError> {
        let contact = Self::contact(settings)?;
        let strides: Vec<_> = train.items.iter().flat_map(rod_motions).collect();
        if strides.is_empty() {
            return Err(TrainerError::NoTrajectories { what: "the training set" });
        }
        let stride = strides.len().div_ceil(MAX_STRIDES);
        let residuals = |values: &[f64]| -> Vec<Block> {
            let model = FrictionModel::fitted(values, contact.c_m);
            let residual = |s: &strides::RodMotion| -> Block {
                let displacement = model.displacement(&contact, s.rod, s.travel);
                let unit = [1.0, 1.0, contact.c_m];
                (0..3).map(|j| unit[j] * (displacement[j] - s.displacement[j])).collect()
            };
            strides.par_iter().step_by(stride).map(residual).collect()
        };
        // Start near the declared ellipsoid, but with unequal terms: by symmetry equal terms would stay
        // equal.
        let mut start = vec![0.85, 0.0, 0.85, 0.0, 0.0, 0.85, 0.5, 0.05, 0.45, -0.05, 0.05, 0.55];
        start.push(contact.friction.max(1e-3).ln());
        let found = DESCENT.run(start, &residuals);
        let (mut values, loss) = (found.values, found.loss);
        let mut spread = (DEGREES_OF_FREEDOM[DEGREES_OF_FREEDOM.len() - 1], 0.0);
        if self.is_stochastic {
            let scales = ClassInputs::PushStrides.fit(settings, train);
            let params = Params::<f32>::new(random_stream(settings.seed, "convex-quartic-choice", 0));
            let trained = Trained { settings, scales: &scales, params: &params };
            let step = train.items.len().div_ceil(SPREAD_PUSHES);
            let pushes: Vec<&Sequence> = train.items.iter().step_by(step).collect();
            let mut least = f64::INFINITY;
            let candidates =
                DEGREES_OF_FREEDOM.into_iter().flat_map(|n| FRICTION_DEVIATIONS.map(|sd| (n, sd)));
            for candidate in candidates {
                let score = Self::final_pose_score(trained, &contact, &values, candidate, &pushes);
                if score < least {
                    (least, spread) = (score, candidate);
                }
            }
        }
        values.extend([spread.0 as f64, spread.1]);
        Ok((values, loss))
    }

    fn forecast(
        &self,
        trained: Trained<'_>,
        task: Task<'_>,
        samples: usize,
    ) -> Result<Samples, TrainerError> {
        let contact = Self::contact(trained.settings)?;
        let values = trained.values();
        let mut rng = random_stream(trained.settings.seed, "convex-quartic", task.index);
        let spread = (values[UNKNOWNS] as usize, values[UNKNOWNS + 1]);
        let models = (0..samples).map(|_| match self.is_stochastic {
            true => FrictionModel::draw(&values, contact.c_m, spread, &mut rng),
            false => FrictionModel::fitted(&values, contact.c_m),
        });
        let mut sampler = ModelPerLane { contact: &contact, models: models.collect() };
        Ok(strides::roll_out(trained, false, task, samples, &mut sampler))
    }
}
