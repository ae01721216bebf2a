//! A net that predicts the inputs of the analytical model instead of its errors (Kloss, Schaal, Bohg 2017): for each stride the ratio c, the
//! contact's friction, where the rod touches and along which normal, all bounded; the model of Lynch, Maekawa and Tanie then says how the
//! object moves. Trained end to end through the model, whose Jacobian comes from dual numbers. The second variant adds a learned error.
//! Deterministic, as published.

use super::contact::{Contact, Misplaced};
use super::strides::{self, RAW, Steps};
use super::{Class, Extents, Kind, Learned, Plan, Trained, operands, zero};
use crate::league::reads::Reads;
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

/// Predicted inputs of the model.
const INPUTS: usize = 4;
/// Largest change of ln c and ln friction, of the contact point in units of c, and of the normal, rad.
const BOUNDS: [f64; INPUTS] = [1.0, 1.5, 0.2, 0.4];

const fn class(with_error: bool) -> Class {
    Class {
        kind: Kind::PredictedParameters { with_error },
        reads: Reads::Contacts,
        plan: Plan { hidden: 32, sd_floor: 0.0, learning_rate: 3e-3 },
        pushing_only: true,
    }
}

pub(crate) static PREDICTED_PARAMETERS: Class = class(false);
pub(crate) static PREDICTED_PARAMETERS_ERROR: Class = class(true);

/// Displacement (m, m, rad) of a stride while the rod goes from `rod` by `travel`, m, for predicted `inputs` before their bounds.
fn displacement<S: Real>(contact: &Contact, rod: [f64; 2], travel: [f64; 2], inputs: [S; INPUTS]) -> [S; 3] {
    let [ratio, friction, shift, turn] = [0, 1, 2, 3].map(|k: usize| inputs[k].tanh() * BOUNDS[k]);
    let c = ratio.exp() * contact.c_m;
    let law = ContactFriction::coulomb(friction.exp() * contact.friction);
    let support = Support::plain(Surface::Ellipsoid { c });
    let moved = Misplaced { shift: shift * contact.c_m, turn };
    contact.displacement(rod, travel, &support, &law, Some(&moved))
}

/// Values `[time, 3, lane]` and Jacobian `[time, 3, INPUTS, lane]` for `inputs [time, INPUTS, lane]` and rows `raw [time, RAW, lane]`, in
/// units of the corrections, which the raw rows hold.
fn differentiated<T: Scalar>(contact: &Contact, inputs: &[T], raw: &[T], lanes: usize) -> (Vec<T>, Vec<T>) {
    let time = raw.len() / (RAW * lanes).max(1);
    let mut values = vec![T::ZERO; time * 3 * lanes];
    let mut jacobian = vec![T::ZERO; time * 3 * INPUTS * lanes];
    for t in 0..time {
        for lane in 0..lanes {
            let raw = |k: usize| raw[(t * RAW + k) * lanes + lane].to_f64();
            let variable =
                |k: usize| Dual::<INPUTS>::variable(inputs[(t * INPUTS + k) * lanes + lane].to_f64(), k);
            let inputs = [0, 1, 2, 3].map(variable);
            let moved = displacement(contact, [raw(0), raw(1)], [raw(2), raw(3)], inputs);
            for (j, moved) in moved.iter().enumerate() {
                let unit = raw(4 + j);
                // Beyond the end of a shorter trajectory the rows are 0, which is no unit.
                let rate = if unit > 0.0 { 1.0 / unit } else { 0.0 };
                values[(t * 3 + j) * lanes + lane] = T::of(moved.value * rate);
                for (k, d) in moved.d.iter().enumerate() {
                    jacobian[((t * 3 + j) * INPUTS + k) * lanes + lane] = T::of(d * rate);
                }
            }
        }
    }
    (values, jacobian)
}

/// The net.
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
        let contact = settings.engine.pushing().map(Contact::of);
        PredictedParameters {
            extents,
            hidden: Mlp::new(params, "step", &[extents.condition - RAW, h, h]),
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
        let seen = self.extents.condition - RAW;
        let features = tape.slice(u, 1, 0, seen)?;
        let raw = tape.slice(u, 1, seen, seen + RAW)?;
        let h = self.hidden.forward(tape, p, features)?;
        let inputs = self.inputs.forward(tape, p, h)?;
        let mut moved = match &self.contact {
            Some(contact) => {
                let (values, jacobian) =
                    differentiated(contact, tape.value(inputs), tape.value(raw), tile.lanes);
                tape.external(inputs, 3, &values, &jacobian)?
            }
            // Settings without a rod are refused before a net is trained.
            None => tape.scale(x, 0.0)?,
        };
        if let Some(error) = &self.error {
            let error = error.forward(tape, p, h)?;
            moved = tape.add(moved, error)?;
        }
        let error = tape.squared_error(x, moved)?;
        let misfit = masked_sum(tape, error, mask)?;
        Ok(LossVars { total: misfit, kl: zero(tape)?, misfit })
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
        Ok(strides::roll(trained, false, task, samples, &mut runner))
    }
}

struct Runner<'a> {
    hidden: MlpRunner,
    inputs: LinearRunner,
    error: Option<LinearRunner>,
    contact: &'a Contact,
    lanes: usize,
}

impl Steps for Runner<'_> {
    fn reads_contacts(&self) -> bool {
        true
    }

    fn draw(&mut self, u: &[f32], _: &mut Xoshiro256PlusPlus, out: &mut [f32]) {
        let (features, raw) = u.split_at(u.len() - RAW * self.lanes);
        let h = self.hidden.run(features, 1);
        let (values, _) = differentiated(self.contact, self.inputs.run(h, 1), raw, self.lanes);
        out.copy_from_slice(&values);
        if let Some(error) = &mut self.error {
            out.iter_mut().zip(error.run(h, 1).iter()).for_each(|(out, e)| *out += *e);
        }
    }
}
