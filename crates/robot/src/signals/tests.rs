//! Contract: on simulated logs with known accelerations, the chosen cutoff is nearly the best one, whatever the noise and the
//! clock; the filter has no delay and keeps linear relations.
//!
//! The motion is a sum of sines (Swevers 1997); the best cutoff is found by a scan with the true acceleration.
use super::filter::{LowPass, decimation, highest_cutoff, second_difference, transient_s};
use super::*;
use crate::test_random::Random;
use approx::assert_relative_eq;
use std::f64::consts::PI;

/// Sum of sines: harmonics of 0.1 Hz with amplitudes that fall with the square of the frequency.
struct Motion(Vec<(f64, f64, f64)>);

impl Motion {
    fn new(seed: u64, harmonics: usize, amplitude: f64) -> Motion {
        let mut random = Random(seed);
        let sine = |k: usize| (amplitude / (k * k) as f64, 0.2 * PI * k as f64, 2.0 * PI * random.uniform());
        Motion((1..=harmonics).map(sine).collect())
    }

    fn position(&self, t: f64) -> f64 {
        self.0.iter().map(|(a, w, p)| a * (w * t + p).sin()).sum()
    }

    fn acceleration(&self, t: f64) -> f64 {
        self.0.iter().map(|(a, w, p)| -a * w * w * (w * t + p).sin()).sum()
    }
}

#[derive(Debug, Clone, Copy)]
enum Sensor {
    Exact,
    White(f64),
    Encoder(u32),
}

impl Sensor {
    fn read(self, value: f64, random: &mut Random) -> f64 {
        match self {
            Sensor::Exact => value,
            Sensor::White(sd) => value + sd * random.normal(),
            Sensor::Encoder(bits) => {
                let step = 2.0 * PI / f64::from(1_u32 << bits);
                (value / step).round() * step
            }
        }
    }
}

const TORQUE_NOISE: f64 = 5e-4;

fn uniform_clock(interval: f64, duration: f64) -> Vec<f64> {
    (0..(duration / interval) as usize).map(|i| 10.0 + i as f64 * interval).collect()
}

/// Log of joints with this motion, with torques of 0.5 times the acceleration plus 3 times the position.
///
/// The torques have noise unless the sensor is exact.
fn log(time_s: Vec<f64>, joints: &[(&Motion, Sensor)]) -> Log {
    let mut random = Random(99);
    let position: Vec<Vec<f64>> = time_s
        .iter()
        .map(|t| {
            joints.iter().map(|(motion, sensor)| sensor.read(motion.position(*t), &mut random)).collect()
        })
        .collect();
    let torque_noise = |sensor: &Sensor| if matches!(sensor, Sensor::Exact) { 0.0 } else { TORQUE_NOISE };
    let torque = time_s
        .iter()
        .map(|t| {
            joints
                .iter()
                .map(|(motion, sensor)| {
                    0.5 * motion.acceleration(*t)
                        + 3.0 * motion.position(*t)
                        + torque_noise(sensor) * random.normal()
                })
                .collect()
        })
        .collect();
    let names = (1..=joints.len()).map(|k| format!("joint{k}")).collect();
    Log { joints: names, time_s, position, torque }
}

/// A preparation whose first filter has the cutoff of the second, so that the motion has the cutoff that was chosen.
fn with_one_cutoff(with: &Preparation) -> Preparation {
    Preparation { motion_cutoff_hz: with.cutoff_hz, motion_trim_s: with.trim_s, ..with.clone() }
}

/// Root mean square error of a joint's prepared acceleration; the last 2 s of each end do not count, at any cutoff.
fn acceleration_error(log: &Log, with: &Preparation, joint: usize, motion: &Motion) -> f64 {
    // 100 samples a second suffice for a mean.
    let motion_decimation = (0.01 / with.interval_s) as usize;
    let with = &Preparation { motion_decimation, decimation: motion_decimation, ..with_one_cutoff(with) };
    let (first, last) = (log.time_s[0] + 2.0, log.time_s[log.time_s.len() - 1] - 2.0);
    let (mut sum, mut count) = (0.0, 0);
    for segment in prepare(log, with).expect("long enough") {
        for (t, row) in
            segment.time_s.iter().zip(&segment.acceleration).filter(|(t, _)| (first..last).contains(*t))
        {
            sum += (row[joint] - motion.acceleration(*t)).powi(2);
            count += 1;
        }
    }
    (sum / f64::from(count)).sqrt()
}

/// Error at the chosen cutoff over the smallest error of a scan of cutoffs.
fn error_over_best(log: &Log, motion: &Motion) -> f64 {
    let chosen = choose(log).expect("motion");
    let highest = highest_cutoff(chosen.interval_s);
    let scan = (0..40).map(|k| highest * 0.87_f64.powi(k)).filter(|cutoff| *cutoff > 0.7);
    let best = scan
        .map(|cutoff| acceleration_error(log, &chosen.with_cutoff(cutoff), 0, motion))
        .fold(f64::INFINITY, f64::min);
    acceleration_error(log, &chosen, 0, motion) / best
}

#[test]
fn the_acceleration_is_nearly_as_good_as_at_the_best_cutoff() {
    for (interval, duration) in [(1e-3, 20.0), (2e-4, 10.0), (5e-3, 20.0)] {
        for (harmonics, amplitude) in [(20, 1.0), (60, 0.5), (10, 0.3)] {
            let motion = Motion::new(1, harmonics, amplitude);
            for sensor in [Sensor::White(1e-3), Sensor::White(1e-5), Sensor::Encoder(12), Sensor::Encoder(16)]
            {
                let log = log(uniform_clock(interval, duration), &[(&motion, sensor)]);
                let ratio = error_over_best(&log, &motion);
                assert!(ratio < 1.3, "{interval} s, {harmonics} harmonics, {sensor:?}: {ratio}");
            }
        }
    }
}

#[test]
fn several_crests_of_a_slow_encoder_are_not_taken_for_motion() {
    // Logs in which the spectrum of the rounding has a second crest, when the motion passes the steps at two typical rates.
    for (seed, harmonics, amplitude) in [(101, 20, 1.0), (102, 10, 0.3)] {
        let motion = Motion::new(seed, harmonics, amplitude);
        let log = log(uniform_clock(2e-4, 10.0), &[(&motion, Sensor::Encoder(14))]);
        let ratio = error_over_best(&log, &motion);
        assert!(ratio < 1.3, "{seed}: {ratio}");
    }
}

#[test]
fn a_jittered_clock_with_lost_samples_costs_little() {
    let motion = Motion::new(2, 30, 0.6);
    let mut random = Random(5);
    let mut time = Vec::new();
    let mut t = 0.0;
    while t < 20.0 {
        time.push(t);
        // Mostly 0.7 to 1.3 ms; one interval in a hundred loses up to 7 samples.
        let lost = if random.uniform() < 0.01 { (7.0 * random.uniform()).ceil() } else { 0.0 };
        t += 1e-3 * (0.7 + 0.6 * random.uniform() + lost);
    }
    let jittered = log(time, &[(&motion, Sensor::White(1e-4))]);
    let uniform = log(uniform_clock(1e-3, 20.0), &[(&motion, Sensor::White(1e-4))]);
    let ratio = error_over_best(&jittered, &motion);
    assert!(ratio < 1.3, "{ratio}");
    let chosen = [choose(&jittered).expect("motion"), choose(&uniform).expect("motion")];
    assert_eq!(
        prepare(&jittered, &chosen[0]).expect("long enough").len(),
        1,
        "no gap is so long that it splits the log"
    );
    let error = |log: &Log, with: &Preparation| acceleration_error(log, with, 0, &motion);
    assert!(error(&jittered, &chosen[0]) < 1.3 * error(&uniform, &chosen[1]));
}

#[test]
fn steps_of_friction_widen_the_band_until_acceleration_and_torque_err_alike() {
    let motion = Motion::new(12, 10, 0.6);
    let mut log = log(uniform_clock(1e-3, 20.0), &[(&motion, Sensor::White(2e-4))]);
    let smooth = choose(&log).expect("motion").cutoff_hz;
    let friction = |t: f64| if motion.position(t + 1e-4) > motion.position(t - 1e-4) { 2.0 } else { -2.0 };
    let mut random = Random(13);
    log.torque = log.time_s.iter().map(|t| vec![friction(*t) + 0.05 * random.normal()]).collect();
    let chosen = choose(&log).expect("motion");
    assert!(chosen.cutoff_hz > 2.0 * smooth, "{} Hz, with a smooth torque {smooth} Hz", chosen.cutoff_hz);
    let square = |value: &dyn Fn(f64) -> f64| {
        log.time_s.iter().map(|t| value(*t).powi(2)).sum::<f64>() / log.time_s.len() as f64
    };
    let (acceleration, torque) = (square(&|t| motion.acceleration(t)), square(&friction));
    let error = |cutoff: f64| {
        let with = Preparation { trim_s: 1.5, ..with_one_cutoff(&chosen.with_cutoff(cutoff)) };
        let with = Preparation { motion_decimation: 5, decimation: 5, ..with };
        let segment = &prepare(&log, &with).expect("long enough")[0];
        let rows = segment.torque_rows.iter().zip(&segment.torque);
        let sum: f64 = rows
            .map(|(row, f)| {
                let (t, a) = (segment.time_s[*row], segment.acceleration[*row][0]);
                (a - motion.acceleration(t)).powi(2) / acceleration + (f[0] - friction(t)).powi(2) / torque
            })
            .sum();
        (sum / segment.torque.len() as f64).sqrt()
    };
    let best = (0..40).map(|k| error(60.0 * 0.9_f64.powi(k))).fold(f64::INFINITY, f64::min);
    assert!(error(chosen.cutoff_hz) < 1.1 * best, "{} {best}", error(chosen.cutoff_hz));
    assert!(error(0.5 * chosen.cutoff_hz) > 1.2 * best && error(2.0 * chosen.cutoff_hz) > 1.2 * best);
}

#[test]
fn noise_and_acceleration_error_are_estimated() {
    for (interval, noise) in [(1e-3, 1e-3), (1e-3, 1e-4), (5e-3, 1e-4)] {
        let motion = Motion::new(3, 40, 0.5);
        let log = log(uniform_clock(interval, 20.0), &[(&motion, Sensor::White(noise))]);
        let chosen = choose(&log).expect("motion");
        assert_relative_eq!(chosen.noise[0].position, noise, max_relative = 0.1);
        assert_relative_eq!(chosen.noise[0].torque, TORQUE_NOISE, max_relative = 0.1);
        let scale = (log.time_s.iter().map(|t| motion.acceleration(*t).powi(2)).sum::<f64>()
            / log.time_s.len() as f64)
            .sqrt();
        let error = acceleration_error(&log, &chosen, 0, &motion) / scale;
        let ratio = chosen.noise[0].acceleration_error / error;
        assert!((0.6..1.7).contains(&ratio), "predicted over true error: {ratio}");
    }
}

#[test]
fn a_log_without_noise_keeps_the_widest_band() {
    let motion = Motion::new(4, 20, 1.0);
    let log = log(uniform_clock(5e-3, 20.0), &[(&motion, Sensor::Exact)]);
    let chosen = choose(&log).expect("motion");
    assert!(chosen.cutoff_hz > 0.9 * highest_cutoff(5e-3), "{}", chosen.cutoff_hz);
    assert_eq!(chosen.decimation, 2);
    assert!(chosen.noise[0].acceleration_error < 1e-3);
}

#[test]
fn one_cutoff_serves_joints_of_different_noise_and_ignores_a_joint_that_rests() {
    let (slow, fast, rest) =
        (Motion::new(5, 10, 0.3), Motion::new(6, 60, 0.5), Motion(vec![(0.0, 1.0, 0.0)]));
    let clock = || uniform_clock(2e-3, 20.0);
    let alone =
        |motion: &Motion| choose(&log(clock(), &[(motion, Sensor::White(1e-4))])).expect("motion").cutoff_hz;
    let sensor = Sensor::White(1e-4);
    let both = choose(&log(clock(), &[(&slow, sensor), (&fast, sensor)])).expect("motion");
    assert!(alone(&slow) < both.cutoff_hz && both.cutoff_hz <= alone(&fast) * 1.05);
    let resting = choose(&log(clock(), &[(&fast, sensor), (&rest, sensor)])).expect("motion");
    assert_relative_eq!(resting.cutoff_hz, alone(&fast), max_relative = 0.1);
    assert!(resting.noise[1].acceleration_error >= 1.0);
    assert_eq!(choose(&log(clock(), &[(&rest, sensor)])), Err(SignalError::NoMotion));
}

/// Passes a column of the motion through the second filter, at the samples of the torques.
fn low_passed(column: &[f64], segment: &Segment, with: &Preparation) -> Vec<f64> {
    let distance_s = with.interval_s * with.motion_decimation as f64;
    let weights = LowPassResponse::new(with.cutoff_hz).weights(distance_s);
    let reach = weights.len() / 2;
    let at = |row: &usize| weights.iter().zip(&column[row - reach..]).map(|(w, x)| w * x).sum();
    segment.torque_rows.iter().map(at).collect()
}

#[test]
fn a_linear_relation_of_torque_and_position_stays_exact() {
    let motion = Motion::new(7, 30, 0.5);
    let mut log = log(uniform_clock(1e-3, 10.0), &[(&motion, Sensor::White(1e-3))]);
    log.torque = log.position.iter().map(|row| vec![4.0 * row[0] - 2.0]).collect();
    let chosen = choose(&log).expect("motion");
    for segment in prepare(&log, &chosen).expect("long enough") {
        let position: Vec<f64> = segment.position.iter().map(|row| row[0]).collect();
        for (position, torque) in low_passed(&position, &segment, &chosen).iter().zip(&segment.torque) {
            assert_relative_eq!(torque[0], 4.0 * position - 2.0, epsilon = 2e-4);
        }
    }
}

#[test]
fn coulomb_friction_that_passes_the_filter_explains_the_filtered_torque() {
    let motion = Motion::new(14, 10, 0.6);
    let mut log = log(uniform_clock(1e-3, 20.0), &[(&motion, Sensor::White(1e-4))]);
    let friction = |speed: f64| 2.0 * speed.signum();
    let speed = |t: f64| (motion.position(t + 1e-4) - motion.position(t - 1e-4)) / 2e-4;
    log.torque = log.time_s.iter().map(|t| vec![friction(speed(*t))]).collect();
    let with = choose(&log).expect("motion").with_cutoff(3.0);
    let segment = &prepare(&log, &with).expect("long enough")[0];
    let modelled: Vec<f64> = segment.speed.iter().map(|row| friction(row[0])).collect();
    let filtered = low_passed(&modelled, segment, &with);
    let rms = |model: &dyn Fn(usize) -> f64| {
        let square = |i: usize| (segment.torque[i][0] - model(i)).powi(2);
        ((0..filtered.len()).map(square).sum::<f64>() / filtered.len() as f64).sqrt()
    };
    let unfiltered = |i: usize| friction(segment.speed[segment.torque_rows[i]][0]);
    let (with_filter, without) = (rms(&|i| filtered[i]), rms(&unfiltered));
    let share = with_filter / without;
    assert!(
        (0.04..0.07).contains(&share),
        "twice or half the samples of the motion change this share: {share}"
    );
}

#[test]
fn filtered_positions_and_derivatives_have_no_delay() {
    // A delay of d seconds would change the position by d times the speed: the regression of the difference on the speed.
    let motion = Motion::new(8, 20, 1.0);
    let log = log(uniform_clock(1e-3, 20.0), &[(&motion, Sensor::Exact)]);
    let chosen = choose(&log).expect("motion").with_cutoff(20.0);
    let segment = &prepare(&log, &chosen).expect("long enough")[0];
    let delay = |found: &[Vec<f64>], truth: &dyn Fn(f64) -> f64| {
        let (mut product, mut square) = (0.0, 0.0);
        for (t, row) in segment.time_s.iter().zip(found) {
            let rate = (truth(t + 1e-4) - truth(t - 1e-4)) / 2e-4;
            product += (truth(*t) - row[0]) * rate;
            square += rate * rate;
        }
        product / square
    };
    let speed = |t: f64| (motion.position(t + 1e-4) - motion.position(t - 1e-4)) / 2e-4;
    assert!(delay(&segment.position, &|t| motion.position(t)).abs() < 1e-6);
    assert!(delay(&segment.speed, &speed).abs() < 1e-6);
    assert!(delay(&segment.acceleration, &|t| motion.acceleration(t)).abs() < 1e-6);
}

#[test]
fn the_filter_equals_that_of_scipy() {
    // scipy 1.16: sosfiltfilt(butter(4, 12, fs=100, output="sos"), x, padlen=24)
    let x: Vec<f64> = (0..60).map(|i| f64::from((i * 37) % 101) / 50.0 - 1.0 + 0.05 * f64::from(i)).collect();
    let filtered = LowPass::new(12.0, 0.01).filter(&x);
    let golden = [
        (0, -0.9998515123168237),
        (1, -0.5642096910601521),
        (17, 1.056947182568221),
        (30, 1.7364845751218296),
        (58, 3.0789077745849207),
        (59, 3.190001005671497),
    ];
    for (i, value) in golden {
        assert_relative_eq!(filtered[i], value, epsilon = 1e-12);
    }
}

#[test]
fn trimmed_ends_hold_a_thousandth_of_the_transient() {
    // A parabola: its acceleration of 1 is wrong at the ends alone.
    let (interval, cutoff) = (1e-3, 5.0);
    let x: Vec<f64> = (0..4000).map(|i| 0.5 * (f64::from(i) * interval).powi(2)).collect();
    let filtered = LowPass::new(cutoff, interval).filter(&x);
    let error = |i: usize| (second_difference(&filtered, i, interval) - 1.0).abs();
    let largest_after = |time: f64| ((time / interval) as usize..2000).map(error).fold(0.0, f64::max);
    assert!(largest_after(transient_s(cutoff)) < 3e-3);
    assert!(largest_after(0.5 * transient_s(cutoff)) > 1e-2, "half the time would not be enough");
    assert!(largest_after(2.0 * transient_s(cutoff)) < 1e-5, "twice the time would be wasted");
}

#[test]
fn decimation_keeps_independent_samples() {
    // White noise of the position: correlation of neighbouring accelerations after decimation.
    let (interval, cutoff) = (1e-3, 10.0);
    let mut random = Random(11);
    let x: Vec<f64> = (0..400_000).map(|_| random.normal()).collect();
    let filtered = LowPass::new(cutoff, interval).filter(&x);
    let correlation = |step: usize| {
        let a: Vec<f64> = (1000..filtered.len() - 1000)
            .step_by(step)
            .map(|i| second_difference(&filtered, i, interval))
            .collect();
        a.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / a.iter().map(|a| a * a).sum::<f64>()
    };
    let step = decimation(cutoff, interval);
    assert_eq!(step, 34);
    assert!(correlation(step).abs() < 0.3, "{}", correlation(step));
    assert!(correlation(step / 2).abs() > 0.4, "{}", correlation(step / 2));
    // Twice the step would put the band that holds most of the power above half the sample rate.
    assert!(1.0 / (2.0 * interval * 2.0 * step as f64) < cutoff);
}

#[test]
fn a_long_gap_gives_two_segments_on_the_clock_of_the_log() {
    let motion = Motion::new(9, 20, 1.0);
    let mut time = uniform_clock(1e-3, 8.0);
    time.extend(uniform_clock(1e-3, 8.0).iter().map(|t| t + 9.5));
    let log = log(time, &[(&motion, Sensor::White(1e-4))]);
    let chosen = choose(&log).expect("motion");
    let segments = prepare(&log, &chosen).expect("long enough");
    assert_eq!(segments.len(), 2);
    for (segment, start) in segments.iter().zip([10.0, 19.5]) {
        assert_relative_eq!(segment.time_s[0], start + chosen.motion_trim_s, epsilon = 1e-3);
        let [first, second] = [0, 1].map(|k| segment.time_s[segment.torque_rows[k]]);
        let begin = start + chosen.motion_trim_s + chosen.trim_s;
        assert_relative_eq!(first, begin, epsilon = (chosen.motion_decimation + 1) as f64 * 1e-3);
        assert_relative_eq!(second - first, 1.0 / chosen.rate_hz, epsilon = 1e-9);
        for (t, row) in segment.time_s.iter().zip(&segment.position) {
            assert_relative_eq!(row[0], motion.position(*t), epsilon = 1e-3);
        }
    }
}

#[test]
fn errors_name_channel_joint_and_row() {
    let motion = Motion::new(10, 20, 1.0);
    let good = log(uniform_clock(1e-2, 20.0), &[(&motion, Sensor::White(1e-4)), (&motion, Sensor::Exact)]);
    let message = |change: &dyn Fn(&mut Log)| {
        let mut log = good.clone();
        change(&mut log);
        choose(&log).expect_err("refused").to_string()
    };
    assert_eq!(
        message(&|log| log.torque[6][1] = f64::NAN),
        "row 7: the torque of joint `joint2` is not a finite number"
    );
    assert!(
        message(&|log| log.time_s[3] = log.time_s[2]).starts_with("row 4: the time 10.02 s is not later")
    );
    assert!(message(&|log| log.time_s[3] = f64::NAN).starts_with("row 4: the time is not a finite number"));
    assert!(message(&|log| log.position[8].truncate(1)).contains("row 9 has 1 values"));
    assert!(message(&|log| log.torque.truncate(100)).contains("the torque has 100 rows"));
    let short = |log: &mut Log| {
        log.time_s.truncate(20);
        log.position.truncate(20);
        log.torque.truncate(20);
    };
    assert_eq!(message(&short), "the log has 20 samples; at least 64 are needed");
    let mut log = good.clone();
    short(&mut log);
    let error = prepare(&log, &choose(&good).expect("motion")).expect_err("too short").to_string();
    assert!(error.contains("use a longer log or a higher cutoff"), "{error}");
}
