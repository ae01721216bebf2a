//! Contract: the scatter between recordings with the same inputs is that of the model's errors. What follows from
//! different starts is no scatter, and what a complete model leaves is not common to the repeats. An effect is named only if
//! the repeats share it.

use crate::answers::answer;
use augsim_data::random_stream;
use augsim_discovery::Verdict;
use augsim_session::DataFrom;
use rand_distr::{Distribution, StandardNormal};
use std::fmt::Write;

const MODEL: &str = "scenario = \"system\"\n[states]\nexcess_K = { start = \"reading_K\" }\n[inputs]\nheater_W = { hold = \"zero\" }\n\
    [parameters]\nloss_per_s = { nominal = 0.15, min = 0.01, max = 1.0 }\ngain_K_per_J = { nominal = 0.8, min = 0.1, max = 5.0 }\n\
    [rates]\nexcess_K = \"gain_K_per_J * heater_W - loss_per_s * excess_K\"\n[outputs]\nreading_K = { value = \"excess_K\", sd = \"estimate\" }\n";
const STEP_S: f64 = 0.5;
const NOISE_K: f64 = 0.1;
/// Number of integration steps per sample.
const STEPS: u32 = 10;

/// Power of the heater in each tenth of a recording, W.
const POWERS_W: [f64; 10] = [0.4, 2.3, 1.1, 1.8, 0.6, 2.4, 0.9, 1.5, 0.3, 2.0];

/// Simulates five recordings of a heated block with the same steps of the heater. Each begins by `step_K` further above the
/// surroundings. `losses` are the coefficients of a loss with the square of the excess in each recording, 1/(K s), which the
/// model lacks.
#[expect(non_snake_case, reason = "unit of the step")]
fn table(step_K: f64, losses: [f64; 5]) -> DataFrom {
    let mut csv = "trajectory,t_s,heater_W,reading_K\n".to_owned();
    for (j, loss) in (0..5_u32).zip(losses) {
        let mut rng = random_stream(8, "repeats", u64::from(j));
        let mut excess = step_K * f64::from(j);
        for k in 0..200_u32 {
            let power = POWERS_W[k as usize / 20];
            let noise: f64 = StandardNormal.sample(&mut rng);
            // Writing to a string cannot fail.
            let _ = writeln!(csv, "{j},{},{power},{}", STEP_S * f64::from(k), excess + NOISE_K * noise);
            for _ in 0..STEPS {
                let rate = 0.8 * power - (0.15 + loss * f64::abs(excess)) * excess;
                excess += STEP_S / f64::from(STEPS) * rate;
            }
        }
    }
    DataFrom::Table { name: "repeats".into(), csv: csv.into_bytes().into() }
}

#[test]
fn different_starts_are_no_scatter() {
    let found = answer(MODEL, &table(10.0, [0.0; 5]));
    let repeats = &found.repeats[0];
    assert_eq!(
        (&*repeats.output, &*repeats.unit, repeats.recordings, repeats.sets),
        ("reading_K", "K", 5, 1)
    );
    assert!((0.09..0.11).contains(&repeats.sd), "{repeats:?}");
    // Errors of the fitted initial states fade slowly and do not average out over time.
    assert!(repeats.common < 0.05, "{repeats:?}");
    assert!(
        found.notes.iter().any(|note| note.contains("5 recordings have the same inputs")),
        "{:?}",
        found.notes
    );
}

#[test]
fn only_what_repeats_share_is_named() {
    let shared = answer(MODEL, &table(2.0, [0.01; 5]));
    let named: Vec<&str> = shared.effects.iter().map(|effect| &*effect.kind).collect();
    assert_eq!(named, ["leak-square"]);
    // A loss that differs from repeat to repeat does not follow from the inputs. A lag imitates it in each repeat.
    let different = answer(MODEL, &table(2.0, [0.004, 0.001, -0.003, -0.002, 0.003]));
    assert_eq!((&different.effects[..], different.verdict), (&[][..], Verdict::Unknown));
    let leads: Vec<&str> = different.leads.iter().map(|lead| &*lead.why).collect();
    assert!(leads.contains(&"within the scatter between recordings with the same inputs"), "{leads:?}");
}
