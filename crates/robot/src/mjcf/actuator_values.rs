//! Attributes of actuators of an MJCF file, which classes and elements state.

use super::joint::Limited;
use crate::description::Drive;
use crate::error::DescriptionError;
use crate::xml::Element;

/// Attributes of an actuator, from its class and its element.
#[derive(Debug, Clone)]
pub(super) struct ActuatorValues {
    /// Whether the gain is constant.
    pub has_fixed_gain: bool,
    /// Whether the bias is affine; `None` for a kind that is not supported.
    pub has_bias: Option<bool>,
    /// Dynamics of the activation.
    pub activation: Activation,
    /// Time constant of the activation, s.
    pub time_constant: f64,
    pub gain: f64,
    pub bias: [f64; 3],
    pub gear: f64,
    pub command_limited: Limited,
    pub command_range: [f64; 2],
    pub force_limited: Limited,
    pub force_range: [f64; 2],
    pub inherited_range: f64,
}

/// Dynamics between the command and the activation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Activation {
    None,
    Filter,
    Other,
}

impl ActuatorValues {
    /// MuJoCo's values where neither class nor element states any.
    pub const DEFAULT: ActuatorValues = ActuatorValues {
        has_fixed_gain: true,
        has_bias: Some(false),
        activation: Activation::None,
        time_constant: 1.0,
        gain: 1.0,
        bias: [0.0; 3],
        gear: 1.0,
        command_limited: Limited::Auto,
        command_range: [0.0; 2],
        force_limited: Limited::Auto,
        force_range: [0.0; 2],
        inherited_range: 0.0,
    };

    /// Replaces what an element states, and what its type implies.
    pub fn apply(&mut self, element: Element) -> Result<(), DescriptionError> {
        self.command_limited = Limited::read(element, "ctrllimited", self.command_limited)?;
        self.command_range = element.vector("ctrlrange")?.unwrap_or(self.command_range);
        self.force_limited = Limited::read(element, "forcelimited", self.force_limited)?;
        self.force_range = element.vector("forcerange")?.unwrap_or(self.force_range);
        if let Some([gear, ..]) = element.numbers("gear", 6)?.as_deref() {
            self.gear = *gear;
        }
        match element.tag() {
            "motor" => self.set_types(false),
            "position" => self.apply_position(element)?,
            "velocity" => {
                let kv = element.number("kv")?.unwrap_or(self.gain);
                self.set_types(true);
                (self.gain, self.bias) = (kv, [0.0, 0.0, -kv]);
            }
            _ => self.apply_general(element)?,
        }
        if element.tag() == "motor" {
            self.gain = 1.0;
        }
        Ok(())
    }

    /// A constant gain without dynamics of the activation, with or without an affine bias.
    pub(super) fn set_types(&mut self, has_bias: bool) {
        self.has_fixed_gain = true;
        self.has_bias = Some(has_bias);
        self.activation = Activation::None;
    }

    pub(super) fn apply_position(&mut self, element: Element) -> Result<(), DescriptionError> {
        let kp = element.number("kp")?.unwrap_or(self.gain);
        let (kv, ratio) = (element.number("kv")?, element.number("dampratio")?);
        if kv.is_some() && ratio.is_some() {
            let problem = format!("{} has both kv and dampratio", element.title());
            return Err(element.error(problem, "keep one of them"));
        }
        for (name, value) in [("kv", kv), ("dampratio", ratio)] {
            if value.is_some_and(|value| value < 0.0) {
                let problem = format!("{} has a negative {name}", element.title());
                return Err(element.error(problem, "give a positive one"));
            }
        }
        self.has_fixed_gain = true;
        self.has_bias = Some(true);
        self.gain = kp;
        // As in MuJoCo, a positive third coefficient of a position loop is a damping ratio.
        self.bias[1] = -kp;
        self.bias[2] = kv.map(|kv| -kv).or(ratio).unwrap_or(self.bias[2]);
        if let Some(time_constant) = element.number("timeconst")? {
            self.time_constant = time_constant;
            self.activation = if time_constant == 0.0 { Activation::None } else { Activation::Filter };
        }
        self.inherited_range = element.number("inheritrange")?.unwrap_or(self.inherited_range);
        Ok(())
    }

    pub(super) fn apply_general(&mut self, element: Element) -> Result<(), DescriptionError> {
        self.has_fixed_gain = match element.attribute("gaintype") {
            None => self.has_fixed_gain,
            Some(kind) => kind == "fixed",
        };
        self.has_bias = match element.attribute("biastype") {
            None => self.has_bias,
            Some("none") => Some(false),
            Some("affine") => Some(true),
            Some(_) => None,
        };
        self.activation = match element.attribute("dyntype") {
            None => self.activation,
            Some("none") => Activation::None,
            Some("filter" | "filterexact") => Activation::Filter,
            Some(_) => Activation::Other,
        };
        // Up to ten numbers, of which the types that are supported use one, three and one.
        if let Some([gain, ..]) = element.numbers("gainprm", 10)?.as_deref() {
            self.gain = *gain;
        }
        for (value, stated) in self.bias.iter_mut().zip(element.numbers("biasprm", 10)?.unwrap_or_default()) {
            *value = stated;
        }
        if let Some([time_constant, ..]) = element.numbers("dynprm", 10)?.as_deref() {
            self.time_constant = *time_constant;
        }
        Ok(())
    }

    /// What the actuator does; `inertia` is that of its joint where it stands, at its reference.
    ///
    /// `None` if no drive of this crate does the same.
    pub(super) fn drive(&self, inertia: impl FnOnce() -> Option<f64>) -> Option<Drive> {
        if !self.has_fixed_gain || self.activation == Activation::Other {
            return None;
        }
        match (self.has_bias?, self.bias) {
            (false, _) if self.gain != 0.0 => Some(Drive::Motor),
            (true, [0.0, b1, b2]) if self.gain == -b1 && self.gain > 0.0 => {
                let kv = if b2 > 0.0 {
                    // mj_setConst: the mass that the actuator feels is M_ii / gear^2.
                    let mass = inertia()? / (self.gear * self.gear);
                    b2 * 2.0 * (self.gain * mass).sqrt()
                } else {
                    -b2
                };
                Some(Drive::Position { kp: self.gain, kv })
            }
            (true, [0.0, 0.0, b2]) if self.gain == -b2 => Some(Drive::Velocity { kv: self.gain }),
            (true, [0.0, 0.0, 0.0]) if self.gain != 0.0 => Some(Drive::Motor),
            _ => None,
        }
    }
}
