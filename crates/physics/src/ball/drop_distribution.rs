//! Generator of the data of the published bouncing-ball experiment.
//!
//! Each trajectory has a random drop height of the underside, uniform on 4 to 5 m, and a random restitution,
//! normal with mean 0.5 and standard deviation 0.1. It consists of 400 samples at 60 Hz of the PyBullet
//! scheme on `plane.urdf` without damping. The predictor that the experiment calls "physics" has restitution
//! 0.65 and Bullet's damping. Of all settings that were tried, these reproduce the published table best.

use super::bullet::{BulletBall, Ground};
use super::score::ScoreError;
use augsim_data::{DataError, Dataset, Limit, Source, Trajectory, random_stream};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Names of the columns of the generated data.
const COLUMNS: [&str; 2] = ["height_m", "velocity_m_s"];

/// Tolerance of sample times, s. Files may be rounded to 1e-5 s, and a step is 0.017 s.
const TIME_TOLERANCE_S: f64 = 1e-4;

/// Distribution of drops: drop height, restitution, and simulation settings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DropDistribution {
    /// Range of the uniformly distributed drop height of the ball's underside, m.
    pub drop_height_m: [f64; 2],
    /// Mean of the normally distributed restitution.
    pub restitution_mean: f64,
    /// Standard deviation of the normally distributed restitution.
    pub restitution_sd: f64,
    /// Ground, ball and time step of the simulation. The restitution of this field is not used.
    pub ball: BulletBall,
    /// Number of samples of each trajectory, including the initial state.
    pub samples: usize,
}

impl Default for DropDistribution {
    fn default() -> Self {
        DropDistribution {
            drop_height_m: [4.0, 5.0],
            restitution_mean: 0.5,
            restitution_sd: 0.1,
            ball: BulletBall { ground: Ground::PlaneUrdf, damping: 0.0, ..BulletBall::default() },
            samples: 400,
        }
    }
}

/// Random values of one trajectory: drop height and restitution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Drop {
    /// Height of the ball's underside at release, m.
    pub drop_height_m: f64,
    /// Combined restitution of ball and ground.
    pub restitution: f64,
}

impl DropDistribution {
    /// Draws a restitution from N(mean, sd); Bullet's `max(0, -e v)` makes a negative one act as 0.
    pub fn draw_restitution(&self, rng: &mut impl Rng) -> f64 {
        let standard: f64 = StandardNormal.sample(rng);
        self.restitution_mean + self.restitution_sd * standard
    }

    /// Draws the drop height and the restitution of one trajectory.
    pub fn draw(&self, rng: &mut impl Rng) -> Drop {
        let [low, high] = self.drop_height_m;
        // 53 random bits: a uniformly distributed multiple of 2^-53 in [0, 1).
        let unit = (rng.next_u64() >> 11) as f64 * 2.0_f64.powi(-53);
        Drop { drop_height_m: low + (high - low) * unit, restitution: self.draw_restitution(rng) }
    }

    /// Generates trajectories (columns `height_m` of the underside, `velocity_m_s`) and their random values.
    ///
    /// Trajectory i depends only on the seed and i, not on the number of trajectories or threads.
    ///
    /// ```
    /// use augsim_physics::ball::drop_distribution::DropDistribution;
    /// let distribution = DropDistribution::default();
    /// let (data, drops) = distribution.generate(3, 7).expect("three drops");
    /// assert_eq!((data.trajectories().len(), drops.len()), (3, 3));
    /// assert!(drops.iter().all(|drop| (4.0..=5.0).contains(&drop.drop_height_m)));
    /// assert_eq!(data.trajectories()[0].column(0)[0], drops[0].drop_height_m);
    /// ```
    ///
    /// # Errors
    /// [`DataError`] if there are no samples, a height is infinite, or a [`Limit`] is exceeded.
    pub fn generate(&self, trajectories: usize, seed: u64) -> Result<(Dataset, Vec<Drop>), DataError> {
        let (count, samples) = (trajectories as u64, self.samples as u64);
        Limit::Trajectories
            .check(count)
            .and_then(|()| Limit::Samples.check(samples))
            .and_then(|()| {
                Limit::Cells.check(count.saturating_mul(samples).saturating_mul(COLUMNS.len() as u64))
            })
            .map_err(|cause| DataError::Limit { origin: Source::Memory, cause })?;
        let drops: Vec<Drop> = (0..trajectories as u64)
            .map(|index| self.draw(&mut random_stream(seed, "paper-law", index)))
            .collect();
        Ok((self.simulate(&drops)?, drops))
    }

    /// Simulates trajectories with given drop heights and restitutions.
    ///
    /// # Errors
    /// Those of [`generate`](Self::generate).
    pub fn simulate(&self, drops: &[Drop]) -> Result<Dataset, DataError> {
        let time_s: Vec<f64> = (0..self.samples).map(|i| i as f64 * self.ball.step_s).collect();
        let simulate = |(index, drop): (usize, &Drop)| {
            let ball = BulletBall { restitution: drop.restitution, ..self.ball };
            let path = ball.simulate_underside(drop.drop_height_m, 0.0, self.samples);
            Trajectory::new(index.to_string(), time_s.clone(), path.into())
        };
        let rows = drops.par_iter().enumerate().map(simulate).collect::<Result<_, _>>()?;
        Dataset::from_names(&COLUMNS, rows)
    }
}

/// The "physics" predictor of the experiment: restitution 0.65, Bullet's damping, `plane.urdf`, 60 Hz.
pub fn published_predictor() -> BulletBall {
    BulletBall::default()
}

/// Predicts `height_m` and `velocity_m_s` of each trajectory from its first sample.
///
/// # Errors
/// [`ScoreError`] if a column is missing, the first sample is missing, or samples are not at the engine's
/// steps.
pub fn rollout(engine: &BulletBall, dataset: &Dataset) -> Result<Dataset, ScoreError> {
    let height = dataset.column_index("height_m")?;
    let velocity = dataset.column_index("velocity_m_s")?;
    check_rate(dataset, engine.step_s)?;
    let predict = |t: &Trajectory| {
        let (height_m, velocity_m_s) = (t.column(height)[0], t.column(velocity)[0]);
        if height_m.is_nan() || velocity_m_s.is_nan() {
            return Err(ScoreError::Gap { trajectory: t.id().to_owned() });
        }
        let path = engine.simulate_underside(height_m, velocity_m_s, t.len());
        Ok(Trajectory::new(t.id(), t.time_s().to_vec(), path.into())?)
    };
    let rows = dataset.trajectories().par_iter().map(predict).collect::<Result<_, _>>()?;
    Ok(Dataset::from_names(&["height_m", "velocity_m_s"], rows)?)
}

/// Checks that samples are `step_s` apart.
///
/// # Errors
/// [`ScoreError::OtherRate`] with the first trajectory and sample that are not.
pub fn check_rate(dataset: &Dataset, step_s: f64) -> Result<(), ScoreError> {
    for t in dataset.trajectories() {
        let start = t.time_s()[0];
        let first_off = t
            .time_s()
            .iter()
            .enumerate()
            .position(|(i, time)| (time - start - i as f64 * step_s).abs() > TIME_TOLERANCE_S);
        if let Some(sample) = first_off {
            let trajectory = t.id().to_owned();
            return Err(ScoreError::OtherRate { trajectory, sample, step_s });
        }
    }
    Ok(())
}
