//! Three plants: their model files, the same equations in Rust, and the defects that a set may have.

use super::kinds::{Kind, Trap};
use std::fmt::Write as _;

/// State vector: two states of the plant (the heater uses one) and a hidden one.
pub type State = [f64; 3];

/// Number of samples by which the input acts late if a delay is declared.
pub const DECLARED_DELAY: usize = 3;

/// An effect that both the true system and its model have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    /// Dry friction or an analogous effect, smoothed by `tanh`.
    Smooth,
    /// Dry friction or an analogous effect with `sign`, not smoothed.
    Sign,
    /// The input that acts on the plant saturates.
    Saturation,
    /// The range of the first sensor is smaller than the motion, so that its values saturate.
    SensorRange,
    /// The input acts `DECLARED_DELAY` samples late.
    Delay,
}

/// True conditions of a plant during one sampling interval.
#[derive(Clone, Copy, Debug)]
pub struct Conditions {
    /// True values of the three parameters.
    pub parameters: [f64; 3],
    /// Influence of the surroundings: force of a tilt, N, excess room temperature, K, or inflow, V/s.
    pub surroundings: f64,
    /// Disturbance added to the rate of the disturbed state, in the unit of that rate.
    pub push: f64,
    /// Whether a hidden state is coupled to the other states.
    pub has_hidden_lag: bool,
    /// Effect that the true system has and the model declares; `None` for other sets.
    pub law: Option<Law>,
}

/// A parameter of a plant, with its true value and its line of the model file.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    name: &'static str,
    /// True value of the parameter.
    pub truth: f64,
    nominal: f64,
    max: f64,
    unit: Option<&'static str>,
}

/// A simulated system: its model file, its true rates, and how it is recorded.
#[derive(Clone, Copy, Debug)]
pub struct Plant {
    /// Name of the plant.
    pub name: &'static str,
    /// Column name of the input in the data file.
    pub input: &'static str,
    /// `(column name, expression in the model file)` of each output.
    pub outputs: [(&'static str, &'static str); 2],
    /// Whether both outputs are measured in every set.
    pub has_two_outputs: bool,
    /// The three free parameters of the model.
    pub parameters: [Parameter; 3],
    /// True time derivatives of the states, as a function of state, input and conditions.
    pub rates: fn(&State, f64, &Conditions) -> State,
    /// True values of both outputs, as a function of state and parameters.
    pub measured: fn(&State, &[f64; 3]) -> [f64; 2],
    /// Standard deviation of the measurement noise of each output.
    pub sd: [f64; 2],
    /// Values of the outputs from which proportional errors are counted.
    pub zero: [f64; 2],
    /// Mean sampling interval of the recordings, s.
    pub step_s: f64,
    /// Middle and half range of the input, in its unit.
    pub drive: (f64, f64),
    /// Middle and half range of each initial state.
    pub start: [(f64, f64); 2],
    /// Index of the state whose rate process noise and bumps disturb.
    pub pushed: usize,
    /// Value of `Conditions::surroundings` in the one recording in which they differ.
    pub other_surroundings: f64,
    /// Controller in closed loop: (middle, half range) of the reference, proportional gain, integral gain.
    pub control: ((f64, f64), f64, f64),
    /// Lower and upper end of the first sensor's range, used if the model declares it.
    pub range: [f64; 2],
    states: &'static str,
    /// Model lines of the known parameters of every set, and of those added if dry friction is declared.
    known: [&'static str; 2],
    /// Rate expressions of the model, with `{u}` for the input and `{-dry}` or `{+dry}` for dry friction.
    rate_lines: &'static str,
    /// Dry friction: its coefficient, its argument, and the name and value of the width of its smoothing.
    dry: (Parameter, &'static str, (&'static str, f64)),
    limit: Parameter,
}

/// Makes a parameter without a unit.
const fn parameter(name: &'static str, truth: f64, nominal: f64, max: f64) -> Parameter {
    Parameter { name, truth, nominal, max, unit: None }
}

/// Returns the parameter with a unit.
const fn with_unit(parameter: Parameter, unit: &'static str) -> Parameter {
    Parameter { unit: Some(unit), ..parameter }
}

impl Parameter {
    /// Line of the model file for this parameter; a frozen one has its true value.
    fn line(&self, is_frozen: bool) -> String {
        let unit = self.unit.map(|unit| format!(", unit = \"{unit}\"")).unwrap_or_default();
        if is_frozen {
            return format!("{} = {{ nominal = {}, frozen = true{unit} }}\n", self.name, self.truth);
        }
        format!("{} = {{ nominal = {}, min = 0.0, max = {:?}{unit} }}\n", self.name, self.nominal, self.max)
    }
}

impl Plant {
    /// True values of the three parameters.
    pub fn truth(&self) -> [f64; 3] {
        self.parameters.map(|p| p.truth)
    }

    /// Number of outputs that a set of this kind measures.
    pub fn measured_outputs(&self, kind: &Kind) -> usize {
        if self.has_two_outputs || kind.needs_two_outputs() { 2 } else { 1 }
    }

    /// Text of the model file for a data set with the peculiarity `kind`.
    pub fn model(&self, kind: &Kind) -> String {
        let law = if let Trap::Declared(law) = kind.trap { Some(law) } else { None };
        let has_dry_law = matches!(law, Some(Law::Smooth | Law::Sign));
        let delay = match law {
            Some(Law::Delay) => format!(", delay_s = {:?}", DECLARED_DELAY as f64 * self.step_s),
            _ => String::new(),
        };
        let mut text = format!(
            "scenario = \"system\"\nname = \"{}\"\n[inputs]\n{} = {{ hold = \"zero\"{delay} }}\n[states]\n{}[parameters]\n",
            self.name, self.input, self.states
        );
        for p in self.parameters {
            text += &p.line(kind.trap == Trap::Frozen);
        }
        text += self.known[0];
        let (amount, argument, (width, value)) = self.dry;
        let mut dry = String::new();
        let mut u = self.input.to_owned();
        if has_dry_law {
            text += &amount.line(false);
            text += self.known[1];
            dry = format!("{} * sign({argument})", amount.name);
        }
        if law == Some(Law::Smooth) {
            let _ = writeln!(text, "{width} = {{ nominal = {value:?}, frozen = true }}");
            dry = format!("{} * tanh(({argument}) / {width})", amount.name);
        }
        if law == Some(Law::Saturation) {
            text += &self.limit.line(false);
            u = format!("clamp({}, -{limit}, {limit})", self.input, limit = self.limit.name);
        }
        let minus = if has_dry_law { format!(" - {dry}") } else { String::new() };
        let plus = if has_dry_law { format!(" + {dry}") } else { String::new() };
        let lines = self.rate_lines.replace("{u}", &u).replace("{-dry}", &minus).replace("{+dry}", &plus);
        let _ = write!(text, "[rates]\n{lines}[outputs]\n");
        for (i, (name, value)) in self.outputs.iter().take(self.measured_outputs(kind)).enumerate() {
            let range = match law {
                Some(Law::SensorRange) if i == 0 => format!(", range = {:?}", self.range),
                _ => String::new(),
            };
            let _ = writeln!(text, "{name} = {{ value = \"{value}\", sd = \"estimate\"{range} }}");
        }
        text
    }

    /// Input that acts on the plant: saturated if the true system has that effect, else `u`.
    fn saturated_input(&self, u: f64, conditions: &Conditions) -> f64 {
        if conditions.law != Some(Law::Saturation) {
            return u;
        }
        u.clamp(-self.limit.truth, self.limit.truth)
    }

    /// Dry friction at its argument (such as a speed); 0 if the true system has none.
    fn dry_law(&self, argument: f64, conditions: &Conditions) -> f64 {
        let (amount, _, (_, width)) = self.dry;
        match conditions.law {
            Some(Law::Smooth) => amount.truth * (argument / width).tanh(),
            Some(Law::Sign) if argument != 0.0 => amount.truth * argument.signum(),
            _ => 0.0,
        }
    }
}

const SPRING: Plant = Plant {
    name: "mass on a spring",
    input: "force_N",
    outputs: [("position_m", "x_m"), ("speed_m_per_s", "v_m_s")],
    has_two_outputs: false,
    parameters: [
        parameter("mass_kg", 1.3, 1.0, 100.0),
        parameter("stiffness_N_per_m", 60.0, 50.0, 1e5),
        parameter("damping_N_s_per_m", 0.9, 0.6, 1e3),
    ],
    rates: spring_rates,
    measured: |x, _| [x[0], x[1]],
    sd: [0.0005, 0.005],
    zero: [0.0, 0.0],
    step_s: 0.01,
    drive: (0.0, 4.0),
    start: [(0.0, 0.06), (0.0, 0.3)],
    pushed: 1,
    other_surroundings: 0.8,
    control: ((0.0, 0.06), 60.0, 50.0),
    range: [-0.05, 0.05],
    states: "x_m = { start = \"position_m\" }\nv_m_s = { start = \"slope(position_m)\" }\n",
    known: ["", ""],
    rate_lines: "x_m = \"v_m_s\"\nv_m_s = \"({u} - stiffness_N_per_m * x_m - damping_N_s_per_m * v_m_s{-dry}) / mass_kg\"\n",
    dry: (parameter("dry_N", 0.6, 0.4, 100.0), "v_m_s", ("width_m_s", 0.02)),
    limit: parameter("limit_N", 2.5, 3.0, 100.0),
};

fn spring_rates(x: &State, u: f64, now: &Conditions) -> State {
    let [mass, stiffness, damping] = now.parameters;
    // The hidden part is a spring of 25 N/m in series with a damper, with a relaxation time of 0.15 s.
    let hidden = if now.has_hidden_lag { x[0] - x[2] } else { 0.0 };
    let dry = SPRING.dry_law(x[1], now);
    let force = SPRING.saturated_input(u, now) - stiffness * x[0] - damping * x[1] - dry - 25.0 * hidden
        + now.surroundings;
    [x[1], force / mass + now.push, hidden / 0.15]
}

const HEATER: Plant = Plant {
    name: "heater",
    input: "heat_W",
    outputs: [("sensor_K", "temp_K"), ("flux_W", "loss_W_per_K * (temp_K - room_K) + spill_W")],
    has_two_outputs: false,
    parameters: [
        parameter("capacity_J_per_K", 50.0, 40.0, 1e5),
        parameter("loss_W_per_K", 0.5, 0.4, 1e3),
        parameter("spill_W", 2.0, 1.5, 1e3),
    ],
    rates: heater_rates,
    measured: |x, p| [x[0], p[1] * (x[0] - ROOM_K) + p[2]],
    sd: [0.1, 0.1],
    zero: [ROOM_K, 0.0],
    step_s: 5.0,
    drive: (16.0, 14.0),
    start: [(310.0, 15.0), (0.0, 0.0)],
    pushed: 0,
    other_surroundings: 4.0,
    control: ((315.0, 12.0), 2.0, 0.01),
    range: [280.0, 322.0],
    states: "temp_K = { start = \"sensor_K\" }\n",
    known: [
        "room_K = { nominal = 293.15, frozen = true }\n",
        "switch_K = { nominal = 315.0, frozen = true }\n",
    ],
    rate_lines: "temp_K = \"({u} - loss_W_per_K * (temp_K - room_K) - spill_W{-dry}) / capacity_J_per_K\"\n",
    dry: (parameter("fan_W", 2.0, 1.5, 100.0), "temp_K - switch_K", ("width_K", 2.0)),
    limit: parameter("limit_W", 22.0, 25.0, 1e3),
};

/// Room temperature, K.
const ROOM_K: f64 = 293.15;

fn heater_rates(x: &State, u: f64, now: &Conditions) -> State {
    let [capacity, loss, spill] = now.parameters;
    // The hidden part is a block of 40 J/K coupled by 0.4 W/K, with a time constant of 100 s.
    let hidden = if now.has_hidden_lag { 0.4 * (x[0] - x[2]) } else { 0.0 };
    let dry = HEATER.dry_law(x[0] - 315.0, now);
    let heat =
        HEATER.saturated_input(u, now) - loss * (x[0] - ROOM_K - now.surroundings) - spill - dry - hidden;
    [heat / capacity + now.push, 0.0, hidden / 40.0]
}

const TANKS: Plant = Plant {
    name: "two tanks",
    input: "pump_V",
    outputs: [("upper_level_V", "upper_V"), ("lower_level_V", "lower_V")],
    has_two_outputs: true,
    parameters: [
        with_unit(parameter("gain_per_s", 0.05, 0.04, 100.0), "1/s"),
        with_unit(parameter("k1", 0.06, 0.05, 100.0), "V^0.5/s"),
        with_unit(parameter("k2", 0.065, 0.05, 100.0), "V^0.5/s"),
    ],
    rates: tank_rates,
    measured: |x, _| [x[0], x[1]],
    sd: [0.02, 0.02],
    zero: [0.0, 0.0],
    step_s: 4.0,
    drive: (2.5, 1.5),
    start: [(4.0, 1.5), (4.0, 1.5)],
    pushed: 0,
    other_surroundings: 0.02,
    control: ((4.0, 1.5), 1.0, 0.01),
    range: [0.0, 4.5],
    states: "upper_V = { start = \"upper_level_V\", min = 0.0 }\nlower_V = { start = \"lower_level_V\", min = 0.0 }\n",
    known: ["", ""],
    rate_lines: "upper_V = \"gain_per_s * {u} - k1 * sqrt(upper_V){-dry}\"\nlower_V = \"k1 * sqrt(upper_V) - k2 * sqrt(lower_V){+dry}\"\n",
    dry: (parameter("valve_V_per_s", 0.015, 0.01, 10.0), "upper_V - lower_V", ("width_V", 0.2)),
    limit: parameter("limit_V", 3.2, 3.6, 100.0),
};

fn tank_rates(x: &State, u: f64, now: &Conditions) -> State {
    let [gain, k1, k2] = now.parameters;
    let (upper, lower) = (k1 * x[0].max(0.0).sqrt(), k2 * x[1].max(0.0).sqrt());
    // The hidden part is a side tank with 1.5 times the area of the upper one, behind a pipe of 0.02 1/s.
    let hidden = if now.has_hidden_lag { 0.02 * (x[0] - x[2]) } else { 0.0 };
    let dry = TANKS.dry_law(x[0] - x[1], now);
    let inflow = gain * TANKS.saturated_input(u, now) + now.surroundings + now.push;
    [inflow - upper - dry - hidden, upper - lower + dry, hidden / 1.5]
}

/// The three plants.
pub const PLANTS: [Plant; 3] = [SPRING, HEATER, TANKS];
