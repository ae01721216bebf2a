//! Significant differences in CRPS between models, by a paired bootstrap over trajectories.

use super::rows::Scored;
use augsim_data::random_stream;
use rand_distr::{Distribution, StandardUniform};
use serde::Serialize;

/// Number of bootstrap draws for each interval.
const BOOTSTRAP_DRAWS: usize = 2000;
/// Name of the model with which the others are compared.
const REFERENCE_MODEL: &str = "Hybrid+";
/// Names of rows that do not compete, because they are not available for forecasts.
const NOT_COMPETING: [&str; 2] = ["(the data)", "Exact law"];

/// Comparison of all models with Hybrid+ on one test set.
#[derive(Debug, Serialize)]
pub struct Verdict {
    pub set: String,
    /// Name of the model with the smallest CRPS.
    pub best: String,
    /// Models that are significantly better than Hybrid+; next field: those without a significant difference.
    pub better_than_ours: Vec<String>,
    pub tied_with_ours: Vec<String>,
    pub sentence: String,
}

/// Computes the CRPS intervals of all rows, and compares all models with Hybrid+ on each test set.
pub fn verdicts(rows: &mut [Scored], sets: &[String], seed: u64) -> Vec<Verdict> {
    for scored in rows.iter_mut().filter(|s| s.row.model != NOT_COMPETING[0]) {
        scored.row.crps_ci95 = Some(interval(&scored.crps, seed));
    }
    sets.iter().filter_map(|set| verdict(rows, set, seed)).collect()
}

fn verdict(rows: &[Scored], set: &str, seed: u64) -> Option<Verdict> {
    let here: Vec<&Scored> =
        rows.iter().filter(|s| s.row.set == set && !NOT_COMPETING.contains(&s.row.model.as_str())).collect();
    let ours = here.iter().find(|s| s.row.model == REFERENCE_MODEL)?;
    let best = here.iter().min_by(|a, b| a.mean_crps().total_cmp(&b.mean_crps()))?;
    let (mut better, mut tied, mut worse) = (Vec::new(), Vec::new(), Vec::new());
    for other in here.iter().filter(|s| s.row.model != REFERENCE_MODEL) {
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

/// States in words how Hybrid+ compares with the other models on a test set.
///
/// It names the number of significantly worse models, those without a significant difference, and those that
/// are significantly better.
fn sentence(set: &str, best: &str, worse: usize, tied: &[String], better: &[String]) -> String {
    let (tied, better) = (tied.join(", "), better.join(", "));
    if best != REFERENCE_MODEL {
        let mut parts = vec![format!("On {set} {best} has the least CRPS")];
        parts.extend(
            (!better.is_empty()).then(|| format!("{REFERENCE_MODEL} is significantly worse than {better}")),
        );
        parts.extend(
            (!tied.is_empty())
                .then(|| format!("the difference of {REFERENCE_MODEL} to {tied} is not significant")),
        );
        parts.push(format!("{REFERENCE_MODEL} is significantly better than the other {worse}"));
        return parts.join("; ") + ".";
    }
    match tied.is_empty() {
        true => {
            format!(
                "On {set} {REFERENCE_MODEL} has the least CRPS, significantly less than each of the other {worse}."
            )
        }
        false => format!(
            "On {set} {REFERENCE_MODEL} has the least CRPS; the difference to {tied} is not significant, that to each of the other {worse} is."
        ),
    }
}

/// Returns the 95 % bootstrap interval of the mean of `values`.
fn interval(values: &[f64], seed: u64) -> [f64; 2] {
    let n = values.len();
    let mut rng = random_stream(seed, "league-bootstrap", 0);
    let mut means: Vec<f64> = (0..BOOTSTRAP_DRAWS)
        .map(|_| {
            let mut place = || -> usize {
                let unit: f64 = StandardUniform.sample(&mut rng);
                (unit * n as f64) as usize
            };
            (0..n).map(|_| values[place()]).sum::<f64>() / n.max(1) as f64
        })
        .collect();
    means.sort_by(f64::total_cmp);
    [0.025, 0.975].map(|q| means[(q * (BOOTSTRAP_DRAWS - 1) as f64) as usize])
}

#[cfg(test)]
mod tests {
    //! Contract: a constant gain is significant, a random one is not; the sentence names all models that Hybrid+ does not outperform.
    use super::*;

    #[test]
    fn intervals_of_random_gains_contain_zero() {
        let noisy: Vec<f64> = (0..40).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let [low, high] = interval(&noisy, 1);
        assert!(low < 0.0 && high > 0.0, "{low} {high}");
        let gained: Vec<f64> = noisy.iter().map(|v| v + 1.0).collect();
        assert!(interval(&gained, 1)[0] > 0.0);
        assert_eq!(interval(&[2.0; 5], 1), [2.0, 2.0]);
    }

    #[test]
    fn names_all_models_that_hybrid_plus_does_not_outperform() {
        let names = |list: &[&str]| -> Vec<String> { list.iter().map(|name| (*name).to_owned()).collect() };
        assert_eq!(
            sentence("test", REFERENCE_MODEL, 3, &[], &[]),
            "On test Hybrid+ has the least CRPS, significantly less than each of the other 3."
        );
        let tied = sentence("test", REFERENCE_MODEL, 3, &names(&["PETS", "VRNN"]), &[]);
        assert!(tied.contains("the difference to PETS, VRNN is not significant"), "{tied}");
        let beaten = sentence("test", "PETS", 2, &names(&["VRNN"]), &names(&["PETS"]));
        let expected = "On test PETS has the least CRPS; Hybrid+ is significantly worse than PETS; the difference of Hybrid+ \
                        to VRNN is not significant; Hybrid+ is significantly better than the other 2.";
        assert_eq!(beaten, expected);
    }
}
