//! A two-link arm that is simulated: its elbow has Coulomb friction that the description file lacks.

use super::declared::{Declared, request};
use super::published::{Property, Published};

use augsim_data::{Column, Dataset, Trajectory, random_stream};
use augsim_robot::{Numbers, Tree, inverse_dynamics};
use augsim_session::robot::Free;
use rand_distr::{Distribution, StandardNormal};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

const DESCRIPTION: &str = include_str!("../../robots/two-link-planar.urdf");
/// Coulomb friction of the elbow that the description lacks, N m.
const ELBOW_COULOMB: f64 = 0.4;
/// Speed at which the simulated Coulomb friction reaches 76 % of its value, rad/s.
const COULOMB_WIDTH: f64 = 0.02;
/// Viscous friction, N m s/rad, and Coulomb friction, N m, that the description states of shoulder and elbow.
const DECLARED: [[f64; 2]; 2] = [[0.35, 0.5], [0.12, 0.0]];
/// Standard deviation of the noise of the torques, N m; that of the positions is [`POSITION_SD`], rad.
const TORQUE_SD: f64 = 0.05;
const POSITION_SD: f64 = 2e-5;
/// Number of samples, and time between them, s.
const SAMPLES: usize = 5000;
const STEP_S: f64 = 0.004;
/// Amplitudes, rad, and frequencies, Hz, of the sinusoids that each joint moves by.
const MOTION: [[(f64, f64); 3]; 2] =
    [[(0.8, 0.23), (0.3, 0.61), (0.15, 1.07)], [(0.9, 0.31), (0.35, 0.73), (0.15, 1.31)]];

/// Declares the arm from its description and a simulated log.
pub fn two_links() -> Result<Declared, String> {
    let file = "two-link-planar.urdf";
    Ok(Declared {
        description: DESCRIPTION.to_owned(),
        file,
        log: log().map_err(|e| e.to_string())?,
        request: request(file, "a simulation", Free::default()),
        published: vec![Published {
            joint: "elbow".to_owned(),
            property: Property::Coulomb,
            value: ELBOW_COULOMB,
        }],
    })
}

/// Simulates the log: positions and torques with noise.
fn log() -> anyhow::Result<Dataset> {
    let robot = augsim_robot::read(DESCRIPTION, "two-link-planar.urdf")?;
    let tree = Tree::new(&robot, &["shoulder", "elbow"].map(str::to_owned), &BTreeMap::new())?;
    let numbers = &mut Numbers;
    let parameters = tree.body_parameters(numbers, &tree.link_parameters(&robot));
    let mut rng = random_stream(11, "two-link arm", 0);
    let mut noise = |sd: f64| -> f64 {
        let normal: f64 = StandardNormal.sample(&mut rng);
        sd * normal
    };
    let times: Vec<f64> = (0..SAMPLES).map(|k| STEP_S * k as f64).collect();
    let mut values: Vec<Vec<f64>> = vec![Vec::new(); 4];
    for t in &times {
        let motion = MOTION.map(|sinusoids| {
            sinusoids.iter().fold([0.0; 3], |[q, v, a], (amplitude, frequency)| {
                let rate = TAU * frequency;
                let (sin, cos) = (rate * t).sin_cos();
                [q + amplitude * sin, v + amplitude * rate * cos, a - amplitude * rate * rate * sin]
            })
        });
        let [q, v, a] = [0, 1, 2].map(|order| motion.map(|joint| joint[order]));
        let gravity = [0.0, 0.0, -9.806_65];
        let rigid = inverse_dynamics(numbers, &tree, &parameters, gravity, &q, &v, &a);
        for joint in 0..2 {
            let [viscous, declared] = DECLARED[joint];
            let coulomb = declared + if joint == 1 { ELBOW_COULOMB } else { 0.0 };
            let torque = rigid[joint] + viscous * v[joint] + coulomb * (v[joint] / COULOMB_WIDTH).tanh();
            values[joint].push(q[joint] + noise(POSITION_SD));
            values[2 + joint].push(torque + noise(TORQUE_SD));
        }
    }
    let names = ["shoulder_rad", "elbow_rad", "shoulder_N_m", "elbow_N_m"];
    let columns = names.iter().map(|name| Column::new(name)).collect::<Result<Vec<Column>, _>>()?;
    Ok(Dataset::new(columns, vec![Trajectory::new("1", times, values)?])?)
}
