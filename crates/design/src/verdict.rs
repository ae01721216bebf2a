//! Sequential evidence: e-values that stay valid when one looks after every run.
//!
//! Let p_i be the mixture density of all new recordings under explanation i, and q_j their maximised likelihood under
//! explanation j, formulas (1) and (2) of `evidence.rs`. Then
//!
//! ```text
//! (1)  E_j = sum over i ≠ j of v_i p_i / q_j,    v_i = w_i / sum over k ≠ j of w_k
//! ```
//!
//! is at most a nonnegative martingale of mean 1 over the runs if explanation j is true, at every value of its parameters, by
//! formula (4) of `evidence.rs` (universal inference: Wasserman, Ramdas and Balakrishnan 2020). By Ville's inequality (1939) the probability that E_j ever
//! reaches c is at most 1 / c, at whatever run one stops and whatever was seen before (Robbins 1970; e-values and optional
//! stopping: Grünwald, de Heide and Koolen 2024; Ramdas, Grünwald, Vovk and Shafer 2023). Explanation j is rejected once
//! E_j has reached the required odds.
//!
//! Where even the best explanation has larger prediction errors than its noise, all log densities are divided by the
//! dispersion φ > 1 of its standardised errors (quasi-likelihood: McCullagh 1983). A power E^(1/φ) of an e-value is
//! one too, by Jensen's inequality.

/// Dispersion from which on no explanation predicts the recordings: errors are twice as large as the noise.
///
/// A power 1/4 of the evidence is what independent errors twice as large as assumed would leave.
const MAX_DISPERSION: f64 = 4.0;

/// Evidence of the new recordings so far for one explanation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Logarithm of the prior weight.
    pub log_weight: f64,
    /// Logarithm of the mixture density p of the new recordings, nats.
    pub log_density: f64,
    /// Logarithm of the maximised likelihood q of the new recordings, nats.
    pub log_maximum: f64,
    /// Sum of the squares of the standardised prediction errors.
    pub squares: f64,
    /// Number of these prediction errors.
    pub count: usize,
}

/// What the recordings say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// All explanations but this one, by index, are rejected.
    Enough(usize),
    /// More than one explanation is left.
    More,
    /// No explanation predicts the recordings.
    NoneFits,
}

/// Judgement of the new recordings so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// What the recordings say.
    pub verdict: Verdict,
    /// Indices of the explanations that are not rejected.
    pub left: Vec<usize>,
    /// Logarithm of the e-value against each explanation (1), nats.
    pub log_e_values: Vec<f64>,
    /// Posterior weights of the explanations.
    pub weights: Vec<f64>,
    /// Dispersion φ of the standardised prediction errors of the best explanation; 1 without excess.
    pub dispersion: f64,
}

/// Judges the new recordings so far; an explanation is rejected once its e-value reaches `odds`.
///
/// `rejected` says which explanations an earlier judgement has rejected: they stay rejected.
pub fn judge(tallies: &[Tally], rejected: &[bool], odds: f64) -> Judgement {
    let ratio = |t: &Tally| t.squares / t.count.max(1) as f64;
    let best = tallies.iter().map(ratio).fold(f64::INFINITY, f64::min);
    let dispersion = if best.is_finite() { best.max(1.0) } else { 1.0 };
    let densities: Vec<f64> = tallies.iter().map(|t| t.log_density / dispersion).collect();
    let log_e_value = |j: usize| {
        let others = (0..tallies.len()).filter(|i| *i != j);
        let norm = log_sum(others.clone().map(|i| tallies[i].log_weight));
        log_sum(others.map(|i| tallies[i].log_weight - norm + densities[i]))
            - tallies[j].log_maximum / dispersion
    };
    let log_e_values: Vec<f64> = (0..tallies.len()).map(log_e_value).collect();
    let norm = log_sum(tallies.iter().zip(&densities).map(|(t, e)| t.log_weight + e));
    let weights = tallies.iter().zip(&densities).map(|(t, e)| (t.log_weight + e - norm).exp()).collect();
    let is_left = |j: &usize| !rejected.get(*j).copied().unwrap_or(false) && log_e_values[*j] < odds.ln();
    let left: Vec<usize> = (0..tallies.len()).filter(is_left).collect();
    let verdict = match left[..] {
        _ if dispersion >= MAX_DISPERSION => Verdict::NoneFits,
        [] => Verdict::NoneFits,
        [one] if tallies.len() > 1 => Verdict::Enough(one),
        _ => Verdict::More,
    };
    Judgement { verdict, left, log_e_values, weights, dispersion }
}

/// Logarithm of a sum of exponentials.
pub(crate) fn log_sum(logs: impl Iterator<Item = f64>) -> f64 {
    let logs: Vec<f64> = logs.collect();
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if most == f64::NEG_INFINITY {
        return most;
    }
    most + logs.iter().map(|l| (l - most).exp()).sum::<f64>().ln()
}

#[cfg(test)]
mod tests {
    //! Contract: two explanations are separated at their likelihood ratio; dispersion reduces the evidence; the
    //! probability of a false rejection at any time is bounded.
    use super::*;
    use augsim_data::random_stream;
    use rand_distr::{Distribution, StandardNormal};

    /// Explanations without free parameters: density and maximised likelihood are the same.
    fn tally(log_density: f64, squares: f64) -> Tally {
        Tally { log_weight: 0.0, log_density, log_maximum: log_density, squares, count: 100 }
    }

    #[test]
    fn two_explanations_are_separated_at_the_required_odds() {
        let below = judge(&[tally(0.0, 90.0), tally(-6.8, 110.0)], &[false; 2], 1000.0);
        assert_eq!((below.verdict, below.dispersion), (Verdict::More, 1.0));
        let above = judge(&[tally(0.0, 90.0), tally(-7.0, 110.0)], &[false; 2], 1000.0);
        assert_eq!(above.verdict, Verdict::Enough(0));
        assert!((above.log_e_values[1] - 7.0).abs() < 1e-12 && above.weights[0] > 0.999);
        // Errors of the best explanation 1.3 times the noise: 7 nats count as 7 / 1.69.
        let dispersed = judge(&[tally(0.0, 169.0), tally(-7.0, 190.0)], &[false; 2], 1000.0);
        assert_eq!(dispersed.verdict, Verdict::More);
        assert!((dispersed.log_e_values[1] - 7.0 / 1.69).abs() < 1e-12);
        assert_eq!(
            judge(&[tally(0.0, 500.0), tally(-70.0, 800.0)], &[false; 2], 1000.0).verdict,
            Verdict::NoneFits
        );
    }

    #[test]
    fn looking_after_every_run_rejects_the_truth_in_less_than_the_promised_share() {
        // Truth N(0, 1), rivals N(1, 1) and N(-1, 1), 60 looks: Ville's bound for odds of 20 to 1 is 5 %.
        let mut rejections = 0;
        for sequence in 0..1000 {
            let mut rng = random_stream(7, "ville", sequence);
            let mut tallies = [tally(0.0, 0.0); 3];
            let mut is_rejected = false;
            for _ in 0..60 {
                let x: f64 = StandardNormal.sample(&mut rng);
                for (tally, mean) in tallies.iter_mut().zip([0.0, 1.0, -1.0]) {
                    tally.log_density -= 0.5 * (x - mean) * (x - mean);
                    tally.log_maximum = tally.log_density;
                }
                is_rejected |= judge(&tallies, &[false; 3], 20.0).log_e_values[0] >= 20.0_f64.ln();
            }
            rejections += usize::from(is_rejected);
        }
        assert!((5..=60).contains(&rejections), "{rejections}");
    }
}
