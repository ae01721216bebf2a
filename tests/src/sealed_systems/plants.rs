//! Eight plants: the model file that a user would write, and the same equations in Rust.

/// A simulated system: its model file, its true rates, and how it is recorded.
#[derive(Clone, Copy, Debug)]
pub struct Plant {
    /// Name of the plant.
    pub name: &'static str,
    /// Text of the model file, whose nominal parameters differ from the true ones.
    pub model: &'static str,
    /// Number of states of the plant.
    pub states: usize,
    /// True time derivatives of the states, as a function of state and input.
    pub rates: fn(&[f64], f64) -> Vec<f64>,
    /// Measured states: index of the state, and standard deviation of its sensor.
    pub outputs: &'static [(usize, f64)],
    /// `(equation, state)`: index of the equation that gets effects, and of the state integrated from it.
    pub law_equation: (usize, usize),
    /// Whether the equation to which effects are added is a balance of forces; else of flows.
    pub is_force: bool,
    /// Effects that the model already declares with a parameter, so that they cannot be missing.
    pub declares: &'static [&'static str],
    /// Column names of the data table after `trajectory,t_s`: input, then outputs.
    pub header: &'static str,
    /// `(records, samples per record, sampling interval in s)`.
    pub size: (usize, usize, f64),
    /// Largest absolute initial value of each state.
    pub start: &'static [f64],
    /// Middle and half range of the input; both are 0 for a plant without input.
    pub input: (f64, f64),
    /// Position of a stop that limits state 0, and its coefficient of restitution; `None` without a stop.
    pub stop: Option<(f64, f64)>,
    /// RMS of the process noise on the equation to which effects are added, relative to the RMS of its rate.
    pub process_noise: f64,
}

/// Process noise of sets with one long recording: RMS relative to that of the rate.
const PROCESS_NOISE_SHARE: f64 = 0.03;

impl Plant {
    /// Returns the plant recorded in one long recording instead of several, with process noise.
    pub fn as_one_long_recording(self) -> Self {
        let (records, samples, step_s) = self.size;
        Self { size: (1, records * samples, step_s), process_noise: PROCESS_NOISE_SHARE, ..self }
    }
}

/// The eight plants.
pub const PLANTS: [Plant; 8] = [
    Plant {
        name: "pendulum",
        model: "scenario = \"system\"\nname = \"pendulum\"\n[states]\ntheta_rad = { start = \"angle_rad\" }\nomega_rad_s = { start = \"slope(angle_rad)\" }\n[parameters]\ngravity_m_s2 = { nominal = 9.81, frozen = true }\nlength_m = { nominal = 0.2, min = 0.05, max = 1.0 }\ndamping_per_s = { nominal = 0.1, min = 0.0, max = 10.0 }\n[rates]\ntheta_rad = \"omega_rad_s\"\nomega_rad_s = \"-gravity_m_s2 / length_m * sin(theta_rad) - damping_per_s * omega_rad_s\"\n[outputs]\nangle_rad = { value = \"theta_rad\", sd = \"estimate\" }\n",
        states: 2,
        rates: |x, _| vec![x[1], -9.81 / 0.25 * x[0].sin() - 0.15 * x[1]],
        outputs: &[(0, 0.002)],
        law_equation: (1, 0),
        is_force: true,
        declares: &[],
        header: "angle_rad",
        size: (10, 400, 0.01),
        start: &[1.4, 2.0],
        input: (0.0, 0.0),
        stop: None,
        process_noise: 0.0,
    },
    Plant {
        name: "mass with stop",
        model: "scenario = \"system\"\nname = \"mass with stop\"\n[inputs]\nforce_N = { hold = \"zero\" }\n[states]\nx_m = { start = \"position_m\" }\nv_m_s = { start = \"slope(position_m)\" }\n[parameters]\nmass_kg = { nominal = 1.2, frozen = true }\nstiffness_N_per_m = { nominal = 80.0, min = 0.0, max = 1e4 }\ndamping_N_s_per_m = { nominal = 0.5, min = 0.0, max = 100.0 }\nstop_m = { nominal = 0.05, frozen = true }\nrestitution = { nominal = 0.5, min = 0.0, max = 1.0 }\n[rates]\nx_m = \"v_m_s\"\nv_m_s = \"(force_N - stiffness_N_per_m * x_m - damping_N_s_per_m * v_m_s) / mass_kg\"\n[outputs]\nposition_m = { value = \"x_m\", sd = \"estimate\" }\n[[events]]\nname = \"stop\"\nwhen = \"x_m - stop_m\"\ndirection = \"rising\"\nset = { v_m_s = \"-restitution * v_m_s\" }\n",
        states: 2,
        rates: |x, u| vec![x[1], (u - 100.0 * x[0] - 0.8 * x[1]) / 1.2],
        outputs: &[(0, 0.0003)],
        law_equation: (1, 0),
        is_force: true,
        declares: &[],
        header: "force_N,position_m",
        size: (10, 300, 0.01),
        start: &[0.03, 0.3],
        input: (0.0, 5.0),
        stop: Some((0.05, 0.6)),
        process_noise: 0.0,
    },
    Plant {
        name: "cart-pole",
        model: "scenario = \"system\"\nname = \"cart-pole\"\n[inputs]\nmotor_V = { hold = \"zero\" }\n[states]\nx_m = { start = \"cart_m\" }\nv_m_s = { start = \"slope(cart_m)\" }\ntheta_rad = { start = \"pole_rad\" }\nomega_rad_s = { start = \"slope(pole_rad)\" }\n[parameters]\ngravity_m_s2 = { nominal = 9.81, frozen = true }\ncart_kg = { nominal = 0.5, min = 0.05, max = 5.0 }\npole_kg = { nominal = 0.1, frozen = true }\npole_m = { nominal = 0.3, min = 0.05, max = 1.0 }\ngain_N_per_V = { nominal = 1.4, min = 0.0, max = 20.0 }\ncart_damping_N_s_per_m = { nominal = 0.5, min = 0.0, max = 50.0 }\n[let]\nF_N = \"gain_N_per_V * motor_V - cart_damping_N_s_per_m * v_m_s\"\ntotal_kg = \"cart_kg + pole_kg * sin(theta_rad)^2\"\n[rates]\nx_m = \"v_m_s\"\nv_m_s = \"(F_N + pole_kg * sin(theta_rad) * (pole_m * omega_rad_s^2 + gravity_m_s2 * cos(theta_rad))) / total_kg\"\ntheta_rad = \"omega_rad_s\"\nomega_rad_s = \"-(F_N * cos(theta_rad) + pole_kg * pole_m * omega_rad_s^2 * sin(theta_rad) * cos(theta_rad) + (cart_kg + pole_kg) * gravity_m_s2 * sin(theta_rad)) / (pole_m * total_kg)\"\n[outputs]\ncart_m = { value = \"x_m\", sd = \"estimate\" }\npole_rad = { value = \"theta_rad\", sd = \"estimate\" }\n",
        states: 4,
        rates: |x, u| {
            let (s, c, w) = (x[2].sin(), x[2].cos(), x[3]);
            let force = 1.6 * u - 0.8 * x[1];
            let total = 0.6 + 0.1 * s * s;
            let cart = (force + 0.1 * s * (0.35 * w * w + 9.81 * c)) / total;
            let pole = -(force * c + 0.1 * 0.35 * w * w * s * c + 0.7 * 9.81 * s) / (0.35 * total);
            vec![x[1], cart, x[3], pole]
        },
        outputs: &[(0, 0.0005), (2, 0.002)],
        law_equation: (3, 2),
        is_force: true,
        declares: &[],
        header: "motor_V,cart_m,pole_rad",
        size: (8, 300, 0.01),
        start: &[0.1, 0.3, 0.8, 1.0],
        input: (0.0, 3.0),
        stop: None,
        process_noise: 0.0,
    },
    Plant {
        name: "two tanks",
        model: "scenario = \"system\"\nname = \"two tanks\"\n[inputs]\npump_V = { hold = \"zero\" }\n[states]\nupper_V = { start = \"upper_level_V\", min = 0.0 }\nlower_V = { start = \"lower_level_V\", min = 0.0 }\n[parameters]\nk1 = { nominal = 0.05, min = 0.0, max = 1.0, unit = \"V^0.5/s\" }\nk2 = { nominal = 0.05, min = 0.0, max = 1.0, unit = \"V^0.5/s\" }\nk3 = { nominal = 0.05, min = 0.0, max = 1.0, unit = \"V^0.5/s\" }\nk4_per_s = { nominal = 0.04, min = 0.0, max = 1.0 }\n[rates]\nupper_V = \"k4_per_s * pump_V - k1 * sqrt(upper_V)\"\nlower_V = \"k2 * sqrt(upper_V) - k3 * sqrt(lower_V)\"\n[outputs]\nupper_level_V = { value = \"upper_V\", sd = \"estimate\" }\nlower_level_V = { value = \"lower_V\", sd = \"estimate\" }\n",
        states: 2,
        rates: |x, u| {
            let (a, b) = (x[0].max(0.0).sqrt(), x[1].max(0.0).sqrt());
            vec![0.05 * u - 0.06 * a, 0.055 * a - 0.06 * b]
        },
        outputs: &[(0, 0.02), (1, 0.02)],
        law_equation: (1, 1),
        is_force: false,
        declares: &[],
        header: "pump_V,upper_level_V,lower_level_V",
        size: (8, 200, 4.0),
        start: &[6.0, 6.0],
        input: (3.0, 2.0),
        stop: None,
        process_noise: 0.0,
    },
    Plant {
        name: "servo",
        model: "scenario = \"system\"\nname = \"servo\"\n[inputs]\nmotor_V = { hold = \"zero\" }\n[states]\nangle_rad = { start = \"encoder_rad\" }\nspeed_rad_s = { start = \"slope(encoder_rad)\" }\n[parameters]\ngain_rad_per_V_s2 = { nominal = 80.0, min = 0.0, max = 1e4, unit = \"rad/(V s^2)\" }\ndamping_per_s = { nominal = 6.0, min = 0.0, max = 1e3 }\n[rates]\nangle_rad = \"speed_rad_s\"\nspeed_rad_s = \"gain_rad_per_V_s2 * motor_V - damping_per_s * speed_rad_s\"\n[outputs]\nencoder_rad = { value = \"angle_rad\", sd = \"estimate\" }\n",
        states: 2,
        rates: |x, u| vec![x[1], 100.0 * u - 8.0 * x[1]],
        outputs: &[(0, 0.003)],
        law_equation: (1, 0),
        is_force: true,
        declares: &[],
        header: "motor_V,encoder_rad",
        size: (8, 400, 0.005),
        start: &[0.5, 1.0],
        input: (0.0, 1.5),
        stop: None,
        process_noise: 0.0,
    },
    Plant {
        name: "Duffing",
        model: "scenario = \"system\"\nname = \"Duffing\"\n[inputs]\nforce_N = { hold = \"zero\" }\n[states]\nx_m = { start = \"position_m\" }\nv_m_s = { start = \"slope(position_m)\" }\n[parameters]\nmass_kg = { nominal = 1.0, frozen = true }\nstiffness_N_per_m = { nominal = 30.0, min = 0.0, max = 1e4 }\ncubic_N_per_m3 = { nominal = 100.0, min = 0.0, max = 1e6 }\ndamping_N_s_per_m = { nominal = 0.3, min = 0.0, max = 100.0 }\n[rates]\nx_m = \"v_m_s\"\nv_m_s = \"(force_N - stiffness_N_per_m * x_m - cubic_N_per_m3 * x_m^3 - damping_N_s_per_m * v_m_s) / mass_kg\"\n[outputs]\nposition_m = { value = \"x_m\", sd = \"estimate\" }\n",
        states: 2,
        rates: |x, u| vec![x[1], u - 40.0 * x[0] - 150.0 * x[0].powi(3) - 0.4 * x[1]],
        outputs: &[(0, 0.001)],
        law_equation: (1, 0),
        is_force: true,
        declares: &["cubic-stiffness", "z^3"],
        header: "force_N,position_m",
        size: (8, 400, 0.01),
        start: &[0.4, 1.0],
        input: (0.0, 12.0),
        stop: None,
        process_noise: 0.0,
    },
    Plant {
        name: "two-mass drive",
        model: "scenario = \"system\"\nname = \"two-mass drive\"\n[inputs]\ntorque_N_m = { hold = \"zero\" }\n[states]\nmotor_rad = { start = \"motor_angle_rad\" }\nmotor_rad_s = { start = \"slope(motor_angle_rad)\" }\nload_rad = { start = \"load_angle_rad\" }\nload_rad_s = { start = \"slope(load_angle_rad)\" }\n[parameters]\nmotor_inertia = { nominal = 0.01, frozen = true, unit = \"kg m^2\" }\nload_inertia = { nominal = 0.02, min = 0.001, max = 1.0, unit = \"kg m^2\" }\nstiffness = { nominal = 8.0, min = 0.1, max = 1e3, unit = \"N m/rad\" }\nshaft_damping = { nominal = 0.01, min = 0.0, max = 1.0, unit = \"N m s/rad\" }\nload_damping = { nominal = 0.02, min = 0.0, max = 1.0, unit = \"N m s/rad\" }\n[let]\nshaft_N_m = \"stiffness * (motor_rad - load_rad) + shaft_damping * (motor_rad_s - load_rad_s)\"\n[rates]\nmotor_rad = \"motor_rad_s\"\nmotor_rad_s = \"(torque_N_m - shaft_N_m) / motor_inertia\"\nload_rad = \"load_rad_s\"\nload_rad_s = \"(shaft_N_m - load_damping * load_rad_s) / load_inertia\"\n[outputs]\nmotor_angle_rad = { value = \"motor_rad\", sd = \"estimate\" }\nload_angle_rad = { value = \"load_rad\", sd = \"estimate\" }\n",
        states: 4,
        rates: |x, u| {
            let shaft = 10.0 * (x[0] - x[2]) + 0.02 * (x[1] - x[3]);
            vec![x[1], (u - shaft) / 0.01, x[3], (shaft - 0.03 * x[3]) / 0.025]
        },
        outputs: &[(0, 0.002), (2, 0.002)],
        law_equation: (3, 2),
        is_force: true,
        declares: &[],
        header: "torque_N_m,motor_angle_rad,load_angle_rad",
        size: (8, 300, 0.005),
        start: &[0.3, 1.0, 0.3, 1.0],
        input: (0.0, 0.6),
        stop: None,
        process_noise: 0.0,
    },
    Plant {
        name: "thermal lag",
        model: "scenario = \"system\"\nname = \"thermal lag\"\n[inputs]\nheater_W = { hold = \"zero\" }\n[states]\nexcess_K = { start = \"reading_K\" }\n[parameters]\ncapacity_J_per_K = { nominal = 40.0, min = 1.0, max = 1e4 }\nloss_W_per_K = { nominal = 0.4, min = 0.0, max = 100.0 }\n[rates]\nexcess_K = \"(heater_W - loss_W_per_K * excess_K) / capacity_J_per_K\"\n[outputs]\nreading_K = { value = \"excess_K\", sd = \"estimate\" }\n",
        states: 1,
        rates: |x, u| vec![(u - 0.5 * x[0]) / 50.0],
        outputs: &[(0, 0.1)],
        law_equation: (0, 0),
        is_force: false,
        declares: &[],
        header: "heater_W,reading_K",
        size: (8, 300, 5.0),
        start: &[30.0],
        input: (15.0, 15.0),
        stop: None,
        process_noise: 0.0,
    },
];
