//! Experiment designs: contact, angle, speed and travel of each push.

use crate::push::Object;
use augsim_data::random_stream;
use rand::Rng;
use serde::Serialize;

/// Experiment design: contacts, angles, speeds and travel of a set of pushes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PushDesign {
    /// The design of the MIT set, in random order.
    ///
    /// 11 contacts per side (40 around an ellipse), 9 angles from -80 to 80 degrees, 10 speeds and 8
    /// accelerations, 5 cm of travel: 7,128 pushes of a rectangle.
    Mit,
    /// The same push is repeated: on side 0 at 70 % of its length, along the normal.
    ///
    /// Speed 20 mm/s, travel 15 cm.
    Repeat,
    /// Contact, angle, start pose and speed (10 to 50 mm/s) are random; travel 10 cm.
    Random,
}

/// One commanded push: contact, angle, speed and travel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PlannedPush {
    /// Index of the pushed side of the object.
    pub side: usize,
    /// Position of the contact along the side, 0 to 1.
    pub fraction: f64,
    /// Angle between the direction of the push and the inward normal, rad.
    pub angle_rad: f64,
    /// Speed of the rod, m/s: constant, or the highest speed if accelerated.
    pub speed_m_s: f64,
    /// Acceleration of the rod from rest, m/s²; 0 for constant speed.
    pub acceleration_m_s2: f64,
    /// Travel of the rod beyond the nominal contact, m.
    pub travel_m: f64,
}

/// Speeds of the rod in the MIT set, m/s.
const SPEEDS: [f64; 10] = [0.01, 0.02, 0.05, 0.075, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5];
/// Accelerations of the rod in the MIT set, m/s².
const ACCELERATIONS: [f64; 8] = [0.1, 0.2, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5];
/// Number of push angles of the MIT set.
const ANGLE_COUNT: usize = 9;

/// A uniform random number in `[low, high)`, with 53 random bits.
pub(super) fn uniform(rng: &mut impl Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * ((rng.next_u64() >> 11) as f64 * 2.0_f64.powi(-53))
}

impl PushDesign {
    /// The first `count` pushes of this design on `object`.
    ///
    /// Push i of a random set depends only on the seed and i. A smaller MIT set is the beginning of a larger
    /// one; a set larger than the design repeats it.
    pub fn plan(self, object: &Object, count: usize, seed: u64) -> Vec<PlannedPush> {
        match self {
            PushDesign::Mit => mit(object, count, seed),
            PushDesign::Repeat => {
                let push = PlannedPush {
                    side: 0,
                    fraction: 0.7,
                    angle_rad: 0.0,
                    speed_m_s: 0.02,
                    acceleration_m_s2: 0.0,
                    travel_m: 0.15,
                };
                vec![push; count]
            }
            PushDesign::Random => (0..count as u64).map(|i| random(object, seed, i)).collect(),
        }
    }
}

/// Draws push `index` of the random design.
fn random(object: &Object, seed: u64, index: u64) -> PlannedPush {
    let mut rng = random_stream(seed, "push-layout", index);
    let side = (uniform(&mut rng, 0.0, object.sides() as f64) as usize).min(object.sides() - 1);
    let limit = 70.0_f64.to_radians();
    PlannedPush {
        side,
        fraction: uniform(&mut rng, 0.05, 0.95),
        angle_rad: uniform(&mut rng, -limit, limit),
        speed_m_s: 0.01 * 5.0_f64.powf(uniform(&mut rng, 0.0, 1.0)),
        acceleration_m_s2: 0.0,
        travel_m: 0.1,
    }
}

/// The first `count` pushes of the MIT design, in an order given by the seed.
fn mit(object: &Object, count: usize, seed: u64) -> Vec<PlannedPush> {
    let contacts = if object.sides() == 1 { 40 } else { 11 };
    let fraction_divisor = if object.sides() == 1 { contacts } else { contacts - 1 } as f64;
    let mut cells = Vec::new();
    for side in 0..object.sides() {
        for contact in 0..contacts {
            for angle in 0..ANGLE_COUNT {
                let cell = |speed_m_s: f64, acceleration_m_s2: f64| PlannedPush {
                    side,
                    fraction: contact as f64 / fraction_divisor,
                    angle_rad: (-80.0 + 20.0 * angle as f64).to_radians(),
                    speed_m_s,
                    acceleration_m_s2,
                    travel_m: 0.05,
                };
                cells.extend(SPEEDS.iter().map(|&v| cell(v, 0.0)));
                // The speed that an acceleration reaches at the end of the travel.
                cells.extend(ACCELERATIONS.iter().map(|&a| cell((2.0 * a * 0.05_f64).sqrt(), a)));
            }
        }
    }
    // Fisher-Yates shuffle.
    let mut rng = random_stream(seed, "push-order", 0);
    for i in (1..cells.len()).rev() {
        let j = (uniform(&mut rng, 0.0, (i + 1) as f64) as usize).min(i);
        cells.swap(i, j);
    }
    (0..count).map(|i| cells[i % cells.len()]).collect()
}
