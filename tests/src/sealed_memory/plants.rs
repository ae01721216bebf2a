//! Six plants: the model file that a user would write, and the same equations in Rust; and the sets drawn of them.

use super::effects::Memory;

/// A simulated system: its model file, its true rates, and how it is recorded.
#[derive(Clone, Copy, Debug)]
pub struct Plant {
    /// Name of the plant.
    pub name: &'static str,
    /// Text of the model file, whose nominal parameters differ from the true ones.
    pub model: &'static str,
    /// True rates of the declared states, as a function of states and input.
    pub rates: fn(&[f64], f64) -> Vec<f64>,
    /// True output, as a function of states and input.
    pub output: fn(&[f64], f64) -> f64,
    /// Standard deviation of the measurement noise.
    pub noise: f64,
    /// State whose rate gets effects: the speed of a mass, or a level.
    pub equation: usize,
    /// Column names of the data table after `trajectory,t_s`: input, if any, then the output.
    pub header: &'static str,
    /// `(records, samples per record, sampling interval in s)`.
    pub size: (usize, usize, f64),
    /// Middle and half range of the initial value of each state.
    pub start: &'static [(f64, f64)],
    /// Middle and half range of the input; both are 0 for a plant without input.
    pub input: (f64, f64),
    /// Samples for which the input is constant.
    pub hold: usize,
    /// Typical time constant, s; those of effects are shares of it.
    pub time_constant_s: f64,
    /// Whether the equations are linear.
    pub is_linear: bool,
}

/// A plant, by index into [`PLANTS`], and the effect that its model lacks.
pub type Case = (usize, Memory);

/// The six plants.
pub const PLANTS: [Plant; 6] = [
    Plant {
        name: "slider",
        model: "scenario = \"system\"\nname = \"slider\"\n[inputs]\nforce_N = { hold = \"zero\" }\n[states]\nx_m = { start = \"position_m\" }\nv_m_s = { start = \"slope(position_m)\" }\n[parameters]\nmass_kg = { nominal = 1.0, frozen = true }\nstiffness_N_per_m = { nominal = 30.0, min = 0.0, max = 1e4 }\ndamping_N_s_per_m = { nominal = 0.8, min = 0.0, max = 100.0 }\n[rates]\nx_m = \"v_m_s\"\nv_m_s = \"(force_N - stiffness_N_per_m * x_m - damping_N_s_per_m * v_m_s) / mass_kg\"\n[outputs]\nposition_m = { value = \"x_m\", sd = \"estimate\" }\n",
        rates: |x, u| vec![x[1], u - 40.0 * x[0] - 1.2 * x[1]],
        output: |x, _| x[0],
        noise: 0.0005,
        equation: 1,
        header: "force_N,position_m",
        size: (8, 400, 0.01),
        start: &[(0.0, 0.1), (0.0, 0.3)],
        input: (0.0, 6.0),
        hold: 25,
        time_constant_s: 0.16,
        is_linear: true,
    },
    Plant {
        name: "rotor",
        model: "scenario = \"system\"\nname = \"rotor\"\n[inputs]\nmotor_V = { hold = \"zero\" }\n[states]\nspeed_rad_s = { start = \"tacho_rad_s\" }\n[parameters]\ngain_rad_per_V_s2 = { nominal = 80.0, min = 0.0, max = 1e4, unit = \"rad/(V s^2)\" }\ndamping_per_s = { nominal = 6.0, min = 0.0, max = 1e3 }\n[rates]\nspeed_rad_s = \"gain_rad_per_V_s2 * motor_V - damping_per_s * speed_rad_s\"\n[outputs]\ntacho_rad_s = { value = \"speed_rad_s\", sd = \"estimate\" }\n",
        rates: |x, u| vec![100.0 * u - 4.0 * x[0]],
        output: |x, _| x[0],
        noise: 0.2,
        equation: 0,
        header: "motor_V,tacho_rad_s",
        size: (8, 400, 0.005),
        start: &[(0.0, 40.0)],
        input: (0.0, 3.0),
        hold: 20,
        time_constant_s: 0.25,
        is_linear: true,
    },
    Plant {
        name: "heated block",
        model: "scenario = \"system\"\nname = \"heated block\"\n[inputs]\nheater_W = { hold = \"zero\" }\n[states]\ntemp_K = { start = \"sensor_K\" }\n[parameters]\ncapacity_J_per_K = { nominal = 80.0, min = 1.0, max = 1e4 }\ntau_s = { nominal = 100.0, min = 1.0, max = 1e4 }\nroom_K = { nominal = 20.0, min = -50.0, max = 100.0 }\n[rates]\ntemp_K = \"heater_W / capacity_J_per_K - (temp_K - room_K) / tau_s\"\n[outputs]\nsensor_K = { value = \"temp_K\", sd = \"estimate\" }\n",
        rates: |x, u| vec![u / 100.0 - (x[0] - 22.0) / 120.0],
        output: |x, _| x[0],
        noise: 0.05,
        equation: 0,
        header: "heater_W,sensor_K",
        size: (6, 250, 4.0),
        start: &[(30.0, 8.0)],
        input: (25.0, 25.0),
        hold: 20,
        time_constant_s: 120.0,
        is_linear: true,
    },
    Plant {
        name: "cell",
        model: "scenario = \"system\"\nname = \"cell\"\n[inputs]\ncurrent_A = { hold = \"zero\" }\n[states]\npair_V = { start = 0.0 }\n[parameters]\nrest_V = { nominal = 3.6, min = 0.0, max = 10.0 }\nseries_Ohm = { nominal = 0.04, min = 0.0, max = 1.0 }\npair_Ohm = { nominal = 0.02, min = 0.0, max = 1.0 }\ntau_s = { nominal = 50.0, min = 0.1, max = 1e4 }\n[rates]\npair_V = \"(pair_Ohm * current_A - pair_V) / tau_s\"\n[outputs]\nterminal_V = { value = \"rest_V - series_Ohm * current_A - pair_V\", sd = \"estimate\" }\n",
        rates: |x, u| vec![(0.03 * u - x[0]) / 60.0],
        output: |x, u| 3.7 - 0.05 * u - x[0],
        noise: 0.001,
        equation: 0,
        header: "current_A,terminal_V",
        size: (6, 300, 2.0),
        start: &[(0.0, 0.05)],
        input: (0.0, 5.0),
        hold: 15,
        time_constant_s: 60.0,
        is_linear: true,
    },
    Plant {
        name: "tank",
        model: "scenario = \"system\"\nname = \"tank\"\n[inputs]\npump_V = { hold = \"zero\" }\n[states]\nlevel_V = { start = \"gauge_V\", min = 0.0 }\n[parameters]\npump_per_s = { nominal = 0.2, min = 0.0, max = 10.0 }\noutflow = { nominal = 0.2, min = 0.0, max = 10.0, unit = \"V^0.5/s\" }\n[rates]\nlevel_V = \"pump_per_s * pump_V - outflow * sqrt(level_V)\"\n[outputs]\ngauge_V = { value = \"level_V\", sd = \"estimate\" }\n",
        rates: |x, u| vec![0.25 * u - 0.25 * x[0].max(0.0).sqrt()],
        output: |x, _| x[0],
        noise: 0.03,
        equation: 0,
        header: "pump_V,gauge_V",
        size: (6, 300, 1.0),
        start: &[(10.0, 6.0)],
        input: (3.0, 2.0),
        hold: 25,
        time_constant_s: 25.0,
        is_linear: false,
    },
    Plant {
        name: "cooling body",
        model: "scenario = \"system\"\nname = \"cooling body\"\n[states]\ntemp_K = { start = \"sensor_K\" }\n[parameters]\ntau_s = { nominal = 80.0, min = 1.0, max = 1e4 }\nroom_K = { nominal = 20.0, min = -50.0, max = 100.0 }\n[rates]\ntemp_K = \"(room_K - temp_K) / tau_s\"\n[outputs]\nsensor_K = { value = \"temp_K\", sd = \"estimate\" }\n",
        rates: |x, _| vec![(24.0 - x[0]) / 100.0],
        output: |x, _| x[0],
        noise: 0.02,
        equation: 0,
        header: "sensor_K",
        size: (8, 150, 3.0),
        start: &[(24.0, 30.0)],
        input: (0.0, 0.0),
        hold: 1,
        time_constant_s: 100.0,
        is_linear: true,
    },
];

/// Sets with a hidden state or a delay, which take turns.
pub const MEMORY_CASES: [Case; 25] = [
    (0, Memory::ElasticMode),
    (1, Memory::InputLag),
    (2, Memory::SecondMass),
    (3, Memory::SecondRc),
    (4, Memory::InputLag),
    (5, Memory::SecondMass),
    (0, Memory::BoucWen),
    (1, Memory::ElasticMode),
    (2, Memory::SensorLag),
    (3, Memory::SensorLag),
    (4, Memory::SecondMass),
    (0, Memory::Dahl),
    (1, Memory::SensorLag),
    (2, Memory::LossySecondMass),
    (3, Memory::InputLag),
    (4, Memory::SensorLag),
    (0, Memory::InputLag),
    (5, Memory::SensorLag),
    (1, Memory::InputDelay),
    (2, Memory::InputLag),
    (4, Memory::InputDelay),
    (0, Memory::SensorLag),
    (2, Memory::InputDelay),
    (0, Memory::LuGre),
    (0, Memory::InputDelay),
];

/// Sets without a hidden state, which take turns: complete models, and models that lack a static law.
pub const NULL_CASES: [Case; 20] = [
    (0, Memory::None),
    (1, Memory::None),
    (2, Memory::None),
    (3, Memory::None),
    (4, Memory::None),
    (5, Memory::None),
    (0, Memory::Static("cubic stiffness")),
    (1, Memory::Static("quadratic loss")),
    (2, Memory::Static("radiation")),
    (3, Memory::Static("cubic loss")),
    (4, Memory::Static("linear loss")),
    (5, Memory::Static("radiation")),
    (0, Memory::Static("quadratic loss")),
    (1, Memory::Static("dry friction")),
    (2, Memory::Static("saturated input")),
    (3, Memory::Static("saturated input")),
    (4, Memory::Static("saturated input")),
    (5, Memory::None),
    (0, Memory::Static("dry friction")),
    (1, Memory::Static("saturated input")),
];
