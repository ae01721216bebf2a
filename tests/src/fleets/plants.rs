//! Plants of the fleets, with the model files that a user would write for them.

/// Rates of a plant's states, for the states, the input, the parameters and the amount of the effect that the model lacks.
type Rate = fn(&[f64], f64, &[f64], f64) -> Vec<f64>;

/// A plant of which a fleet has many units.
#[derive(Debug, Clone, Copy)]
pub struct FleetPlant {
    /// Name of the plant.
    pub name: &'static str,
    /// Text of the model file, with rough nominal values.
    pub model: &'static str,
    /// Name and mean true value of each parameter.
    pub parameters: &'static [(&'static str, f64)],
    /// Rates of the states.
    pub rate: Rate,
    /// Kind of the effect that the model may lack.
    pub effect: &'static str,
    /// Amount of that effect.
    pub effect_amount: f64,
    /// Name of the input's column.
    pub input_column: &'static str,
    /// Smallest and largest value of the input.
    pub input: [f64; 2],
    /// Name of the output's column.
    pub output_column: &'static str,
    /// Index of the measured state.
    pub measured: usize,
    /// Initial state of every run.
    pub start: &'static [f64],
    /// Number of samples of a run.
    pub samples: usize,
    /// Time between samples, s.
    pub step_s: f64,
    /// Standard deviation of the noise, as a share of that of the output.
    pub noise: f64,
}

/// Sign function that is smooth over a width of 0.01, as the friction of the rig.
fn smooth_sign(speed: f64) -> f64 {
    (speed / 0.01).tanh()
}

/// The plants; fleets take turns.
pub const FLEETS: [FleetPlant; 4] = [
    FleetPlant {
        name: "heater",
        model: "scenario = \"system\"\nname = \"heater\"\n[inputs]\nheater_W = { hold = \"zero\" }\n[parameters]\ngain_K_per_W = { nominal = 0.5, min = 0.05, max = 5.0 }\n\
                time_constant_s = { nominal = 60.0, min = 5.0, max = 600.0 }\n[states]\ntemperature_K = { start = \"reading_K\" }\n[rates]\n\
                temperature_K = \"(gain_K_per_W * heater_W - temperature_K) / time_constant_s\"\n[outputs]\nreading_K = \"temperature_K\"\n",
        parameters: &[("gain_K_per_W", 0.7), ("time_constant_s", 80.0)],
        rate: |x, u, p, a| vec![(p[0] * u - x[0] - a * x[0] * x[0].abs()) / p[1]],
        effect: "leak-square",
        effect_amount: 0.015,
        input_column: "heater_W",
        input: [0.0, 60.0],
        output_column: "reading_K",
        measured: 0,
        start: &[5.0],
        samples: 150,
        step_s: 5.0,
        noise: 0.01,
    },
    FleetPlant {
        name: "motor",
        model: "scenario = \"system\"\nname = \"motor\"\n[inputs]\ntorque_N_m = { hold = \"zero\" }\n[parameters]\ninertia_kg_m2 = { nominal = 0.02, min = 0.001, max = 0.5 }\n\
                friction_N_m_s = { nominal = 0.02, min = 0.0, max = 1.0 }\n[states]\nangle_rad = { start = \"encoder_rad\" }\n\
                omega_rad_s = { start = \"slope(encoder_rad)\" }\n[rates]\nangle_rad = \"omega_rad_s\"\n\
                omega_rad_s = \"(torque_N_m - friction_N_m_s * omega_rad_s) / inertia_kg_m2\"\n[outputs]\nencoder_rad = \"angle_rad\"\n",
        parameters: &[("inertia_kg_m2", 0.03), ("friction_N_m_s", 0.05)],
        rate: |x, u, p, a| vec![x[1], (u - p[1] * x[1] - a * smooth_sign(x[1])) / p[0]],
        effect: "coulomb",
        effect_amount: 0.06,
        input_column: "torque_N_m",
        input: [-0.6, 0.6],
        output_column: "encoder_rad",
        measured: 0,
        start: &[0.0, 0.0],
        samples: 200,
        step_s: 0.05,
        noise: 0.002,
    },
    FleetPlant {
        name: "oscillator",
        model: "scenario = \"system\"\nname = \"oscillator\"\n[inputs]\npush_m_s2 = { hold = \"zero\" }\n[parameters]\nstiffness_per_s2 = { nominal = 15.0, min = 1.0, max = 200.0 }\n\
                damping_per_s = { nominal = 0.5, min = 0.0, max = 20.0 }\ngain = { nominal = 1.0, min = 0.1, max = 10.0 }\n[states]\n\
                x_m = { start = \"x_seen_m\" }\nv_m_s = { start = \"slope(x_seen_m)\" }\n[rates]\nx_m = \"v_m_s\"\n\
                v_m_s = \"gain * push_m_s2 - stiffness_per_s2 * x_m - damping_per_s * v_m_s\"\n[outputs]\nx_seen_m = \"x_m\"\n",
        parameters: &[("stiffness_per_s2", 20.0), ("damping_per_s", 0.8), ("gain", 1.2)],
        rate: |x, u, p, a| vec![x[1], p[2] * u - p[0] * x[0] - p[1] * x[1] - a * x[0].powi(3)],
        effect: "cubic-stiffness",
        effect_amount: 60.0,
        input_column: "push_m_s2",
        input: [-6.0, 6.0],
        output_column: "x_seen_m",
        measured: 0,
        start: &[0.1, 0.0],
        samples: 250,
        step_s: 0.04,
        noise: 0.01,
    },
    FleetPlant {
        name: "tank",
        model: "scenario = \"system\"\nname = \"tank\"\n[inputs]\npump = { hold = \"zero\" }\n[parameters]\npump_gain_m_s = { nominal = 0.002, min = 0.0001, max = 0.1 }\n\
                outflow = { nominal = 0.02, min = 0.001, max = 0.5, unit = \"m^0.5/s\" }\n[states]\nlevel_m = { start = \"gauge_m\", min = 0.0 }\n[rates]\n\
                level_m = \"pump_gain_m_s * pump - outflow * sqrt(level_m)\"\n[outputs]\ngauge_m = \"level_m\"\n",
        parameters: &[("pump_gain_m_s", 0.003), ("outflow", 0.025)],
        rate: |x, u, p, a| vec![p[0] * u - p[1] * x[0].max(0.0).sqrt() - a * x[0]],
        effect: "leak",
        effect_amount: 0.01,
        input_column: "pump",
        input: [0.0, 8.0],
        output_column: "gauge_m",
        measured: 0,
        start: &[0.15],
        samples: 200,
        step_s: 2.0,
        noise: 0.01,
    },
];
