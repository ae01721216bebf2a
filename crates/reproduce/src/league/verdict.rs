//! Pairs of models of which one is significantly better: bootstrap over trajectories, every model on the same ones.

use super::rows::Scored;
use augsim_data::random_stream;
use rand_distr::{Distribution, StandardUniform};
use serde::Serialize;

/// Draws of the bootstrap.
const DRAWS: usize = 2000;
/// The model that the others are compared with.
const OURS: &str = "Hybrid+";
/// Rows that do not compete: nobody has them to forecast with.
const ASIDE: [&str; 2] = ["(the data)", "Exact law"];

/// A sentence on a test set.
#[derive(Debug, Serialize)]
pub struct Verdict {
    pub set: String,
    /// Model with the least deciding score.
    pub best: String,
    /// Models that are significantly better than Hybrid+, and those that chance cannot tell from it.
    pub better_than_ours: Vec<String>,
    pub tied_with_ours: Vec<String>,
    pub sentence: String,
}

/// Fills in the intervals of all rows, and says for each set how Hybrid+ stands.
pub fn verdicts(rows: &mut [Scored], sets: &[String], seed: u64) -> Vec<Verdict> {
    for scored in rows.iter_mut().filter(|s| s.row.model != ASIDE[0]) {
        scored.row.crps_ci95 = Some(interval(&scored.crps, seed));
    }
    sets.iter().filter_map(|set| verdict(rows, set, seed)).collect()
}

fn verdict(rows: &[Scored], set: &str, seed: u64) -> Option<Verdict> {
    let here: Vec<&Scored> =
        rows.iter().filter(|s| s.row.set == set && !ASIDE.contains(&s.row.model.as_str())).collect();
    let ours = here.iter().find(|s| s.row.model == OURS)?;
    let best = here.iter().min_by(|a, b| a.mean_crps().total_cmp(&b.mean_crps()))?;
    let (mut better, mut tied, mut worse) = (Vec::new(), Vec::new(), Vec::new());
    for other in here.iter().filter(|s| s.row.model != OURS) {
        let differences: Vec<f64> = other.crps.iter().zip(&ours.crps).map(|(a, b)| a - b).collect();
        let [low, high] = interval(&differences, seed);
        let list = match (low > 0.0, high < 0.0) {
            (true, _) => &mut worse,
            (_, true) => &mut better,
            _ => &mut tied,
        };
        list.push(other.row.model.clone());
    }
    let sentence = sentence(set, &best.row.model, worse.len(), &tied, &better);
    Some(Verdict {
        set: set.to_owned(),
        best: best.row.model.clone(),
        better_than_ours: better,
        tied_with_ours: tied,
        sentence,
    })
}

/// How Hybrid+ stands on a set: against so many models that are significantly worse, those that chance cannot tell from it, and
/// those that are significantly better.
fn sentence(set: &str, best: &str, worse: usize, tied: &[String], better: &[String]) -> String {
    let (tied, better) = (tied.join(", "), better.join(", "));
    if best != OURS {
        let mut parts = vec![format!("On {set} {best} has the least CRPS")];
        parts.extend((!better.is_empty()).then(|| format!("{OURS} is significantly worse than {better}")));
        parts.extend(
            (!tied.is_empty()).then(|| format!("chance may explain the difference of {OURS} to {tied}")),
        );
        parts.push(format!("{OURS} is significantly better than the other {worse}"));
        return parts.join("; ") + ".";
    }
    match tied.is_empty() {
        true => {
            format!("On {set} {OURS} has the least CRPS, significantly less than each of the other {worse}.")
        }
        false => format!(
            "On {set} {OURS} has the least CRPS: chance may explain the difference to {tied}, not that to each of the other {worse}."
        ),
    }
}

/// 95 % interval of the mean: bootstrap over the values.
fn interval(values: &[f64], seed: u64) -> [f64; 2] {
    let n = values.len();
    let mut rng = random_stream(seed, "league-bootstrap", 0);
    let mut means: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let mut place = || -> usize {
                let unit: f64 = StandardUniform.sample(&mut rng);
                (unit * n as f64) as usize
            };
            (0..n).map(|_| values[place()]).sum::<f64>() / n.max(1) as f64
        })
        .collect();
    means.sort_by(f64::total_cmp);
    [0.025, 0.975].map(|q| means[(q * (DRAWS - 1) as f64) as usize])
}

#[cfg(test)]
mod tests {
    //! Contract: a constant gain is significant, one that chance makes is not; a sentence names whom Hybrid+ does not beat.
    use super::*;

    #[test]
    fn intervals_hold_what_chance_makes() {
        let noisy: Vec<f64> = (0..40).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let [low, high] = interval(&noisy, 1);
        assert!(low < 0.0 && high > 0.0, "{low} {high}");
        let gained: Vec<f64> = noisy.iter().map(|v| v + 1.0).collect();
        assert!(interval(&gained, 1)[0] > 0.0);
        assert_eq!(interval(&[2.0; 5], 1), [2.0, 2.0]);
    }

    #[test]
    fn sentences_name_whom_hybrid_plus_does_not_beat() {
        let names = |list: &[&str]| -> Vec<String> { list.iter().map(|name| (*name).to_owned()).collect() };
        assert_eq!(
            sentence("test", OURS, 3, &[], &[]),
            "On test Hybrid+ has the least CRPS, significantly less than each of the other 3."
        );
        let tied = sentence("test", OURS, 3, &names(&["PETS", "VRNN"]), &[]);
        assert!(tied.contains("chance may explain the difference to PETS, VRNN,"), "{tied}");
        let beaten = sentence("test", "PETS", 2, &names(&["VRNN"]), &names(&["PETS"]));
        let expected = "On test PETS has the least CRPS; Hybrid+ is significantly worse than PETS; chance may explain the difference of \
                        Hybrid+ to VRNN; Hybrid+ is significantly better than the other 2.";
        assert_eq!(beaten, expected);
    }
}
