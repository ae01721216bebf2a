//! Contract: designed runs separate dry from viscous friction better than random ones, within all limits, with the same
//! bits on any number of threads; explanations that no input separates are not promised to be.

use super::{explanation, white};
use augsim_data::random_stream;
use augsim_design::{
    Evidence, Explanation, InputLimits, Limits, PosteriorSample, Request, design, draw_values, nominal_run,
    promise, random_run,
};
use std::collections::BTreeMap;

const HEAD: &str = "scenario = \"system\"\nname = \"mass\"\n[inputs]\nforce_N = { hold = \"linear\" }\n[states]\nx_m = { start = 0.0 }\n\
    v_m_s = { start = 0.0 }\n[parameters]\nm_kg = { nominal = 1.0, min = 0.2, max = 5.0 }\nw_m_s = { nominal = 0.05, frozen = true }\n\
    c = { nominal = 0.5, min = 0.05, max = 5.0, unit = \"UNIT\" }\n[rates]\nx_m = \"v_m_s\"\nv_m_s = \"(force_N - FRICTION) / m_kg\"\n\
    [outputs]\npos_m = { value = \"x_m\", sd = 0.1 }\n";

fn mass(name: &str, unit: &str, friction: &str) -> Explanation {
    let text = HEAD.replace("UNIT", unit).replace("FRICTION", friction);
    explanation(name, &text, &[0.05, 0.05], white(0.1))
}

fn dry_and_viscous() -> [Explanation; 2] {
    [mass("dry", "N", "c * tanh(v_m_s / w_m_s)"), mass("viscous", "N*s/m", "c * v_m_s")]
}

fn limits() -> Limits {
    let force =
        InputLimits { name: "force_N".into(), range: [-1.5, 1.0], rate_per_s: Some(4.0), energy: Some(1.2) };
    let ranges = BTreeMap::from([("pos_m".to_owned(), [-0.5, 0.5]), ("v_m_s".to_owned(), [-0.8, 0.8])]);
    Limits { inputs: vec![force], ranges, starts: BTreeMap::new(), duration_s: 3.0, step_s: 0.05 }
}

/// Evidence before any recording.
fn evidence(explanations: &[Explanation]) -> Vec<Evidence> {
    explanations.iter().map(Evidence::new).collect()
}

fn samples(explanations: &[Explanation]) -> Vec<PosteriorSample> {
    explanations.iter().map(PosteriorSample::normal).collect()
}

fn request<'a>(
    (explanations, evidence, samples): (&'a [Explanation], &'a [Evidence], &'a [PosteriorSample]),
    limits: &'a Limits,
) -> Request<'a> {
    Request { explanations, evidence, samples, limits, budget: 1, odds: 1000.0, seed: 5 }
}

#[test]
fn a_designed_run_separates_better_than_random_ones_and_keeps_all_limits() {
    let (live, limits) = (dry_and_viscous(), limits());
    let (evidence, samples) = (evidence(&live), samples(&live));
    let request = request((&live, &evidence, &samples), &limits);
    let run = design(&request).unwrap().swap_remove(0);
    let hardest = |odds: &[Vec<f64>]| odds[0][1].min(odds[1][0]);
    let random: f64 =
        (0..10).map(|k| hardest(&random_run(&request, k).unwrap().log_odds)).sum::<f64>() / 10.0;
    assert!(hardest(&run.log_odds) > 1.3 * random, "{} {random}", hardest(&run.log_odds));
    let force = &run.experiment.inputs[0];
    assert!(force.iter().all(|f| (-1.5..=1.0).contains(f)));
    assert!(force.windows(2).all(|w| (w[1] - w[0]).abs() <= 4.0 * 0.05 + 1e-9));
    assert!(force.iter().map(|f| f * f * 0.05).sum::<f64>() <= 1.2);
    for e in &live {
        for k in 0..200 {
            let mut drawn = e.clone();
            drawn.values = draw_values(e, &mut random_stream(5, "limit draws", k));
            let pos = nominal_run(&drawn, &run.experiment).unwrap();
            // The draws with which limits were checked; others may exceed them by little.
            let most = if k < 64 { 0.5 } else { 0.6 };
            assert!(pos[0].iter().all(|x| x.abs() <= most), "{k} {:?}", pos[0]);
        }
    }
}

#[test]
fn designs_and_promises_are_the_same_on_any_number_of_threads() {
    let (live, limits) = (dry_and_viscous(), limits());
    let (evidence, samples) = (evidence(&live), samples(&live));
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let run = design(&request((&live, &evidence, &samples), &limits)).unwrap().swap_remove(0);
            let promised = promise(&evidence, &samples, &[&run.experiment], 2, 1000.0, 20, 5);
            (run.experiment, promised)
        })
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn explanations_that_are_the_same_are_not_promised_to_be_separated() {
    // The second is the first with another name of its parameter.
    let live = [mass("first", "N*s/m", "c * v_m_s"), mass("second", "N*s/m", "c * v_m_s")];
    let (evidence, samples, limits) = (evidence(&live), samples(&live), limits());
    let run = design(&request((&live, &evidence, &samples), &limits)).unwrap().swap_remove(0);
    let promised = promise(&evidence, &samples, &[&run.experiment], 3, 1000.0, 40, 5);
    assert!(!promised.is_enough && promised.share() == 0.0);
    assert!(promised.log_odds() < 1.0, "{}", promised.log_odds());
}
