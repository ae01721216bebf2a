//! A net that predicts parameters of the analytical contact model (Kloss, Schaal, Bohg 2017).
//!
//! For each stride it predicts the ratio c, the contact friction, and offsets of contact point and normal,
//! all bounded. The quasi-static model of Lynch, Maekawa and Tanie then gives the motion of the object. The
//! net is trained end to end through the model, whose Jacobian comes from dual numbers. The second variant
//! adds a learned error. Deterministic, as published.

use super::contact::{Contact, ContactOffset};
use super::strides::{self, CorrectionSampler, ROD_MOTION_WIDTH};
use super::{Class, Defaults, Extents, Kind, Learned, Trained, operands, zero};
use crate::league::inputs::ClassInputs;
use crate::nets::tile::{LossVars, Tile, masked_sum};
use crate::settings::Settings;
use crate::{Samples, Task, TrainerError};
use augsim_nn::inference::{LinearRunner, MlpRunner};
use augsim_nn::{Bound, Linear, Mlp, Params};
use augsim_physics::push::surface::Surface;
use augsim_physics::push::{ContactFriction, Support};
use augsim_physics::{Dual, Scalar as Real};
use augsim_tensor::{Scalar, Tape, TensorError};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Number of predicted parameters of the contact model.
const INPUTS: usize = 4;
/// Largest predicted change of ln c, ln friction, contact point (in units of c) and contact normal (rad).
const BOUNDS: [f64; INPUTS] = [1.0, 1.5, 0.2, 0.4];

const fn class(with_error: bool) -> Class {
    Class {
        kind: Kind::PredictedParameters { with_error },
        inputs: ClassInputs::PushStrides,
        defaults: Defaults { hidden: 32, sd_floor: 0.0, learning_rate: 3e-3 },
        is_pushing_only: true,
    }
}

pub(crate) static PREDICTED_PARAMETERS: Class = class(false);
pub(crate) static PREDICTED_PARAMETERS_ERROR: Class = class(true);

/// Computes the object's displacement (m, m, rad) while the rod moves from position `rod` by `travel`, m.
///
/// `inputs` are the outputs of the net; tanh maps them to their bounds.
fn displacement<S: Real>(contact: &Contact, rod: [f64; 2], travel: [f64; 2], inputs: [S; INPUTS]) -> [S; 3] {
    let [ratio, friction, shift, turn] = [0, 1, 2, 3].map(|k: usize| inputs[k].tanh() * BOUNDS[k]);
    let c = ratio.exp() * contact.c_m;
    let friction = ContactFriction::coulomb(friction.exp() * contact.friction);
    let support = Support::plain(Surface::Ellipsoid { c });
    let offset = ContactOffset { shift: shift * contact.c_m, turn };
    contact.displacement(rod, travel, &support, &friction, Some(&offset))
}

/// Computes displacements `[time, 3, lane]` and their Jacobian `[time, 3, INPUTS, lane]` by the inputs.
///
/// For `inputs [time, INPUTS, lane]` and `rod_motion [time, ROD_MOTION_WIDTH, lane]`, whose last columns are
/// the units of the results.
fn displacements_with_jacobian<T: Scalar>(
    contact: &Contact,
    inputs: &[T],
    rod_motion: &[T],
    lanes: usize,
) -> (Vec<T>, Vec<T>) {
    let time = rod_motion.len() / (ROD_MOTION_WIDTH * lanes).max(1);
    let mut values = vec![T::ZERO; time * 3 * lanes];
    let mut jacobian = vec![T::ZERO; time * 3 * INPUTS * lanes];
    for t in 0..time {
        for lane in 0..lanes {
            let value = |k: usize| rod_motion[(t * ROD_MOTION_WIDTH + k) * lanes + lane].to_f64();
            let variable =
                |k: usize| Dual::<INPUTS>::variable(inputs[(t * INPUTS + k) * lanes + lane].to_f64(), k);
            let inputs = [0, 1, 2, 3].map(variable);
            let moved = displacement(contact, [value(0), value(1)], [value(2), value(3)], inputs);
            for (j, moved) in moved.iter().enumerate() {
                let unit = value(4 + j);
                // Beyond the end of a shorter trajectory the rows are 0, and so is the unit.
                let factor = if unit > 0.0 { 1.0 / unit } else { 0.0 };
                values[(t * 3 + j) * lanes + lane] = T::from_f64(moved.value * factor);
                for (k, d) in moved.d.iter().enumerate() {
                    jacobian[((t * 3 + j) * INPUTS + k) * lanes + lane] = T::from_f64(d * factor);
                }
            }
        }
    }
    (values, jacobian)
}

/// The net that predicts contact parameters, with the contact model through which it is trained.
#[derive(Debug, Clone)]
pub struct PredictedParameters {
    extents: Extents,
    hidden: Mlp,
    inputs: Linear,
    error: Option<Linear>,
    contact: Option<Contact>,
}

impl PredictedParameters {
    pub fn new<T: Scalar>(
        settings: &Settings,
        extents: Extents,
        with_error: bool,
        params: &mut Params<T>,
    ) -> Self {
        let h = settings.net.hidden;
        let contact = settings.engine.push_model().map(Contact::from_model);
        PredictedParameters {
            extents,
            hidden: Mlp::new(params, "step", &[extents.condition - ROD_MOTION_WIDTH, h, h]),
            inputs: Linear::new(params, "inputs", h, INPUTS),
            error: with_error.then(|| Linear::new(params, "error", h, 3)),
            contact,
        }
    }
}

impl Learned for PredictedParameters {
    fn is_deterministic(&self) -> bool {
        true
    }

    fn loss<T: Scalar>(
        &self,
        tape: &mut Tape<T>,
        p: &Bound,
        tile: Tile<'_, T>,
    ) -> Result<LossVars, TensorError> {
        let (x, u, mask) = operands(tape, &tile, self.extents)?;
        let width = self.extents.condition - ROD_MOTION_WIDTH;
        let features = tape.slice(u, 1, 0, width)?;
        let rod_motion = tape.slice(u, 1, width, width + ROD_MOTION_WIDTH)?;
        let h = self.hidden.forward(tape, p, features)?;
        let inputs = self.inputs.forward(tape, p, h)?;
        let mut moved = match &self.contact {
            Some(contact) => {
                let (values, jacobian) = displacements_with_jacobian(
                    contact,
                    tape.value(inputs),
                    tape.value(rod_motion),
                    tile.lanes,
                );
                tape.external(inputs, 3, &values, &jacobian)?
            }
            // Unreachable: settings without a rod are rejected before a net is trained.
            None => tape.scale(x, 0.0)?,
        };
        if let Some(error) = &self.error {
            let error = error.forward(tape, p, h)?;
            moved = tape.add(moved, error)?;
        }
        let error = tape.squared_error(x, moved)?;
        let nll = masked_sum(tape, error, mask)?;
        Ok(LossVars { total: nll, kl: zero(tape)?, negative_ln_likelihood: nll })
    }

    fn forecast(
        &self,
        trained: Trained<'_>,
        task: Task<'_>,
        samples: usize,
    ) -> Result<Samples, TrainerError> {
        let Some(contact) = &self.contact else { return Err(crate::Difference::OtherSystem.into()) };
        let linear = |l: Linear| LinearRunner::new(l, trained.params, samples, 1);
        let mut runner = Runner {
            hidden: MlpRunner::new(&self.hidden, trained.params, samples, 1),
            inputs: linear(self.inputs),
            error: self.error.map(linear),
            contact,
            lanes: samples,
        };
        Ok(strides::roll_out(trained, false, task, samples, &mut runner))
    }
}

struct Runner<'a> {
    hidden: MlpRunner,
    inputs: LinearRunner,
    error: Option<LinearRunner>,
    contact: &'a Contact,
    lanes: usize,
}

impl CorrectionSampler for Runner<'_> {
    fn needs_rod_motion(&self) -> bool {
        true
    }

    fn sample(&mut self, u: &[f32], _: &mut Xoshiro256PlusPlus, out: &mut [f32]) {
        let (features, rod_motion) = u.split_at(u.len() - ROD_MOTION_WIDTH * self.lanes);
        let h = self.hidden.run(features, 1);
        let inputs = self.inputs.run(h, 1);
        let (values, _) = displacements_with_jacobian(self.contact, inputs, rod_motion, self.lanes);
        out.copy_from_slice(&values);
        if let Some(error) = &mut self.error {
            out.iter_mut().zip(error.run(h, 1).iter()).for_each(|(out, e)| *out += *e);
        }
    }
}
