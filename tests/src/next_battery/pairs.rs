//! Twelve pairs of explanations that recordings under small or constant inputs do not distinguish.

/// A pair of explanations with the same inputs and outputs.
pub struct Pair {
    /// Name of the pair.
    pub name: &'static str,
    /// Names and ranges of the inputs, with their first, small values.
    pub inputs: &'static [Input],
    /// Further states after position and speed, parameters, and rates of both explanations.
    pub models: [Body; 2],
    /// State that is measured, and the range that no run may leave.
    pub output: (&'static str, [f64; 2]),
    /// Standard deviation of process noise on the last rate, in its unit; 0 without any.
    pub process_sd: f64,
}

/// An input.
pub struct Input {
    /// Name of the input.
    pub name: &'static str,
    /// Smallest and largest value.
    pub range: [f64; 2],
    /// Value in the first recordings.
    pub first: f64,
}

/// Equations of one explanation.
pub struct Body {
    /// Start of each state: at rest, known to a small error.
    pub states: &'static str,
    /// Name and true value of each parameter.
    pub parameters: &'static [(&'static str, f64)],
    /// Rate of each state.
    pub rates: &'static str,
    /// Measured quantity.
    pub output: &'static str,
}

const FORCE: Input = Input { name: "force_N", range: [-2.0, 2.0], first: 0.7 };
const VOLTAGE: Input = Input { name: "u_V", range: [-6.0, 6.0], first: 2.0 };
const MASS: &str = "x_m = { start = 0.0, sd = 0.001 }\nv_m_s = { start = 0.0, sd = 0.001 }\n";
const MASS_RATES: &str = "x_m = \"v_m_s\"\n";

/// A mass on a rail whose position is measured; `v_m_s` is its last state.
const fn mass(parameters: &'static [(&'static str, f64)], rates: &'static str) -> Body {
    Body { states: MASS, parameters, rates, output: "x_m" }
}

/// All pairs.
pub const PAIRS: [Pair; 12] = [
    Pair {
        name: "dry / viscous friction",
        inputs: &[FORCE],
        models: [
            mass(&[("m_kg", 1.0), ("f_N", 0.4)], "v_m_s = \"(force_N - f_N * tanh(v_m_s / w_m_s)) / m_kg\""),
            mass(
                &[("m_kg", 1.0), ("c_N_s_per_m", 0.7)],
                "v_m_s = \"(force_N - c_N_s_per_m * v_m_s) / m_kg\"",
            ),
        ],
        output: ("pos_m", [-4.0, 4.0]),
        process_sd: 0.0,
    },
    Pair {
        name: "quadratic / cubic drag",
        inputs: &[FORCE],
        models: [
            mass(
                &[("m_kg", 1.0), ("c_kg_per_m", 0.6)],
                "v_m_s = \"(force_N - c_kg_per_m * v_m_s * abs(v_m_s)) / m_kg\"",
            ),
            mass(
                &[("m_kg", 1.0), ("c_kg_s_per_m2", 0.6)],
                "v_m_s = \"(force_N - c_kg_s_per_m2 * v_m_s^3) / m_kg\"",
            ),
        ],
        output: ("pos_m", [-4.0, 4.0]),
        process_sd: 0.0,
    },
    Pair {
        name: "sensor lag / input lag",
        inputs: &[FORCE],
        models: [
            Body {
                states: "x_m = { start = 0.0, sd = 0.001 }\nv_m_s = { start = 0.0, sd = 0.001 }\ny_m = { start = 0.0, sd = 0.001 }\n",
                parameters: &[("m_kg", 1.0), ("c_kg_per_m", 0.8), ("lag_s", 0.25)],
                rates: "y_m = \"(x_m - y_m) / lag_s\"\nv_m_s = \"(force_N - c_kg_per_m * v_m_s * abs(v_m_s)) / m_kg\"",
                output: "y_m",
            },
            Body {
                states: "x_m = { start = 0.0, sd = 0.001 }\nv_m_s = { start = 0.0, sd = 0.001 }\nf_N = { start = 0.0, sd = 0.001 }\n",
                parameters: &[("m_kg", 1.0), ("c_kg_per_m", 0.8), ("lag_s", 0.25)],
                rates: "f_N = \"(force_N - f_N) / lag_s\"\nv_m_s = \"(f_N - c_kg_per_m * v_m_s * abs(v_m_s)) / m_kg\"",
                output: "x_m",
            },
        ],
        output: ("pos_m", [-4.0, 4.0]),
        process_sd: 0.0,
    },
    Pair {
        name: "load-dependent / plain friction",
        inputs: &[FORCE, Input { name: "load_N", range: [1.0, 6.0], first: 3.0 }],
        models: [
            mass(
                &[("m_kg", 1.0), ("mu", 0.13)],
                "v_m_s = \"(force_N - mu * load_N * tanh(v_m_s / w_m_s)) / m_kg\"",
            ),
            mass(
                &[("m_kg", 1.0), ("f_N", 0.4), ("unused_per_N", 0.0)],
                "v_m_s = \"(force_N - f_N * (1.0 + unused_per_N * load_N) * tanh(v_m_s / w_m_s)) / m_kg\"",
            ),
        ],
        output: ("pos_m", [-4.0, 4.0]),
        process_sd: 0.0,
    },
    Pair {
        name: "linear / stiffening spring",
        inputs: &[FORCE],
        models: [
            mass(
                &[("m_kg", 0.5), ("c_N_s_per_m", 0.5), ("k_N_per_m", 2.0)],
                "v_m_s = \"(force_N - c_N_s_per_m * v_m_s - k_N_per_m * x_m) / m_kg\"",
            ),
            mass(
                &[("m_kg", 0.5), ("c_N_s_per_m", 0.5), ("k_N_per_m3", 12.0)],
                "v_m_s = \"(force_N - c_N_s_per_m * v_m_s - k_N_per_m3 * x_m^3) / m_kg\"",
            ),
        ],
        output: ("pos_m", [-2.0, 2.0]),
        process_sd: 0.0,
    },
    Pair {
        name: "dead zone of the input / dry friction",
        inputs: &[FORCE],
        models: [
            mass(
                &[("m_kg", 1.0), ("c_N_s_per_m", 0.5), ("zone_N", 0.25)],
                "v_m_s = \"(deadzone(force_N, zone_N) - c_N_s_per_m * v_m_s) / m_kg\"",
            ),
            mass(
                &[("m_kg", 1.0), ("c_N_s_per_m", 0.5), ("f_N", 0.25)],
                "v_m_s = \"(force_N - c_N_s_per_m * v_m_s - f_N * tanh(v_m_s / w_m_s)) / m_kg\"",
            ),
        ],
        output: ("pos_m", [-4.0, 4.0]),
        process_sd: 0.0,
    },
    Pair {
        name: "saturating input / quadratic drag",
        inputs: &[FORCE],
        models: [
            mass(
                &[("m_kg", 1.0), ("c_N_s_per_m", 0.4), ("limit_N", 1.2)],
                "v_m_s = \"(limit_N * tanh(force_N / limit_N) - c_N_s_per_m * v_m_s) / m_kg\"",
            ),
            mass(
                &[("m_kg", 1.0), ("c_N_s_per_m", 0.3), ("d_kg_per_m", 0.2)],
                "v_m_s = \"(force_N - c_N_s_per_m * v_m_s - d_kg_per_m * v_m_s * abs(v_m_s)) / m_kg\"",
            ),
        ],
        output: ("pos_m", [-4.0, 4.0]),
        process_sd: 0.0,
    },
    Pair {
        name: "viscous friction / quadratic drag",
        inputs: &[FORCE],
        models: [
            mass(
                &[("m_kg", 1.0), ("c_N_s_per_m", 0.6)],
                "v_m_s = \"(force_N - c_N_s_per_m * v_m_s) / m_kg\"",
            ),
            mass(
                &[("m_kg", 1.0), ("d_kg_per_m", 0.7)],
                "v_m_s = \"(force_N - d_kg_per_m * v_m_s * abs(v_m_s)) / m_kg\"",
            ),
        ],
        output: ("pos_m", [-4.0, 4.0]),
        process_sd: 0.05,
    },
    Pair {
        name: "offset force / asymmetric damping",
        inputs: &[FORCE],
        models: [
            mass(
                &[("m_kg", 1.0), ("c_N_s_per_m", 0.6), ("bias_N", 0.15)],
                "v_m_s = \"(force_N - bias_N - c_N_s_per_m * v_m_s) / m_kg\"",
            ),
            mass(
                &[("m_kg", 1.0), ("c_N_s_per_m", 0.5), ("a_N_s_per_m", 0.3)],
                "v_m_s = \"(force_N - c_N_s_per_m * v_m_s - a_N_s_per_m * max(v_m_s, 0.0)) / m_kg\"",
            ),
        ],
        output: ("pos_m", [-4.0, 4.0]),
        process_sd: 0.0,
    },
    Pair {
        name: "spring / position-dependent gain",
        inputs: &[FORCE],
        models: [
            mass(
                &[("m_kg", 1.0), ("c_N_s_per_m", 1.0), ("k_N_per_m", 0.3)],
                "v_m_s = \"(force_N - c_N_s_per_m * v_m_s - k_N_per_m * x_m) / m_kg\"",
            ),
            mass(
                &[("m_kg", 1.0), ("c_N_s_per_m", 1.0), ("a_per_m", 0.3)],
                "v_m_s = \"(force_N * (1.0 - a_per_m * x_m) - c_N_s_per_m * v_m_s) / m_kg\"",
            ),
        ],
        output: ("pos_m", [-2.5, 2.5]),
        process_sd: 0.0,
    },
    Pair {
        name: "linear / quartic heat loss",
        inputs: &[Input { name: "p_W", range: [0.0, 40.0], first: 10.0 }],
        models: [
            Body {
                states: "rise_K = { start = 0.0, sd = 0.001 }\n",
                parameters: &[("c_J_per_K", 1.0), ("h_W_per_K", 0.4)],
                rates: "rise_K = \"(p_W - h_W_per_K * rise_K) / c_J_per_K\"",
                output: "rise_K",
            },
            Body {
                states: "rise_K = { start = 0.0, sd = 0.001 }\n",
                parameters: &[("c_J_per_K", 1.0), ("h_W_per_K", 0.3), ("b_per_K", 0.008)],
                rates: "rise_K = \"(p_W - h_W_per_K * rise_K * (1.0 + b_per_K * rise_K)) / c_J_per_K\"",
                output: "rise_K",
            },
        ],
        output: ("warm_K", [-1.0, 80.0]),
        process_sd: 0.3,
    },
    Pair {
        name: "back-EMF / viscous friction and resistance law",
        inputs: &[VOLTAGE],
        models: [
            Body {
                states: "w_rad_s = { start = 0.0, sd = 0.001 }\n",
                parameters: &[("k_rad_per_V_s2", 4.0), ("d_per_s", 1.0)],
                rates: "w_rad_s = \"k_rad_per_V_s2 * u_V - d_per_s * w_rad_s\"",
                output: "w_rad_s",
            },
            Body {
                states: "w_rad_s = { start = 0.0, sd = 0.001 }\n",
                parameters: &[("k_rad_per_V_s2", 4.0), ("d_per_s", 0.6), ("e_per_rad", 0.05)],
                rates: "w_rad_s = \"k_rad_per_V_s2 * u_V - d_per_s * w_rad_s - e_per_rad * w_rad_s * abs(w_rad_s)\"",
                output: "w_rad_s",
            },
        ],
        output: ("speed_rad_s", [-30.0, 30.0]),
        process_sd: 0.0,
    },
];

impl Pair {
    /// Text of the model file of explanation `which`, with measurement noise `sd` and these parameter values.
    pub fn text(&self, which: usize, sd: f64, values: &[f64]) -> String {
        let body = &self.models[which];
        let inputs: String =
            self.inputs.iter().map(|i| format!("{} = {{ hold = \"linear\" }}\n", i.name)).collect();
        let parameter = |((name, _), value): (&(&str, f64), &f64)| match *value {
            0.0 => format!("{name} = {{ nominal = 0.0, frozen = true }}\n"),
            value => {
                format!("{name} = {{ nominal = {value}, min = {}, max = {} }}\n", 0.2 * value, 5.0 * value)
            }
        };
        let mut parameters: String = body.parameters.iter().zip(values).map(parameter).collect();
        parameters += "w_m_s = { nominal = 0.05, frozen = true }\n";
        let (states, rates) = match body.states.contains("v_m_s") {
            true => (self.noisy(body.states), format!("{MASS_RATES}{}", body.rates)),
            false => (self.noisy(body.states), body.rates.to_owned()),
        };
        format!(
            "scenario = \"system\"\nname = \"{}\"\n[inputs]\n{inputs}[states]\n{states}[parameters]\n{parameters}[rates]\n{rates}\n[outputs]\n{} = \
             {{ value = \"{}\", sd = {sd} }}\n",
            ["first", "second"][which],
            self.output.0,
            body.output
        )
    }

    /// Whether the only states are position and speed of a mass, without process noise.
    pub fn is_of_a_mass_alone(&self) -> bool {
        self.models.iter().all(|m| m.states == MASS && m.output == "x_m") && self.process_sd == 0.0
    }

    /// The text of an explanation of a mass alone, changed so that it estimates position and speed at the start of a run from its
    /// first samples.
    pub fn with_estimated_starts(&self, text: &str) -> String {
        let estimated =
            format!("x_m = {{ start = \"{0}\" }}\nv_m_s = {{ start = \"slope({0})\" }}\n", self.output.0);
        text.replace(MASS, &estimated)
    }

    /// The states with process noise on the speed, or else on the first state.
    fn noisy(&self, states: &str) -> String {
        if self.process_sd == 0.0 {
            return states.to_owned();
        }
        let shaken =
            format!("{{ start = 0.0, sd = 0.001, shaken = {{ sd = {}, memory_s = 0.3 }} }}", self.process_sd);
        let place = if states.contains("v_m_s") { "v_m_s = " } else { "rise_K = " };
        states.replace(&format!("{place}{{ start = 0.0, sd = 0.001 }}"), &format!("{place}{shaken}"))
    }
}
