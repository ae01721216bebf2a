//! Plans judged by recordings without noise: what each drawn truth says against each rival after the planned runs.
//!
//! The log odds are those of the judgement, ln p_i - ln q_j of `evidence.rs`, with full refits of the rival to the earlier
//! recordings and all planned runs together. They include what the truth pays for its unknown parameters.

use crate::candidate::Experiment;
use crate::draw::noise_free_run;
use crate::error::DesignError;
use crate::evidence::Evidence;
use crate::explanation::Explanation;
use augsim_system::Record;
use rayon::prelude::*;

/// A sequence of recordings without noise, of one truth with drawn parameters.
#[derive(Clone)]
struct Sequence {
    /// Index of the truth.
    truth: usize,
    /// Values of all parameters of the truth.
    values: Vec<f64>,
    /// Evidence of each explanation after the recordings.
    evidence: Vec<Evidence>,
}

/// Sequences of all truths and draws.
pub(crate) struct NoiseFree<'a> {
    explanations: &'a [Explanation],
    sequences: Vec<Sequence>,
    /// Log odds of each truth against each rival, nats, `[truth][rival][draw]`; empty lists on the diagonal.
    pub log_odds: Vec<Vec<Vec<f64>>>,
}

impl<'a> NoiseFree<'a> {
    /// No planned run yet; `draws` has the parameter values of each truth, `[truth][draw]`.
    pub fn new(explanations: &'a [Explanation], evidence: &[Evidence], draws: &[Vec<Vec<f64>>]) -> Self {
        let of_truth = |(truth, draws): (usize, &Vec<Vec<f64>>)| -> Vec<Sequence> {
            let part = |(k, evidence): (usize, &Evidence)| match k == truth {
                true => evidence.density_only(),
                false => evidence.maximum_only(),
            };
            let evidence: Vec<Evidence> = evidence.iter().enumerate().map(part).collect();
            let sequence =
                |values: &Vec<f64>| Sequence { truth, values: values.clone(), evidence: evidence.clone() };
            draws.iter().map(sequence).collect()
        };
        Self::judged(explanations, draws.iter().enumerate().flat_map(of_truth).collect())
    }

    /// Sequences with their log odds.
    fn judged(explanations: &'a [Explanation], sequences: Vec<Sequence>) -> Self {
        let count = explanations.len();
        let mut log_odds = vec![vec![Vec::new(); count]; count];
        for sequence in &sequences {
            let of_truth = sequence.evidence[sequence.truth].log_density();
            for j in (0..count).filter(|j| *j != sequence.truth) {
                log_odds[sequence.truth][j].push(of_truth - sequence.evidence[j].log_maximum());
            }
        }
        Self { explanations, sequences, log_odds }
    }

    /// The sequences with one more run.
    ///
    /// # Errors
    /// The run cannot be simulated or judged.
    pub fn with_run(&self, experiment: &Experiment) -> Result<Self, DesignError> {
        let record = experiment.record("design");
        let extended = |sequence: &Sequence| -> Result<Sequence, DesignError> {
            let truth = &self.explanations[sequence.truth];
            let values = noise_free_run(truth, &sequence.values, experiment)?;
            let recording = Record { values, ..record.clone() };
            let mut sequence = sequence.clone();
            for evidence in &mut sequence.evidence {
                evidence.add(&recording)?;
            }
            Ok(sequence)
        };
        let sequences = self.sequences.par_iter().map(extended).collect::<Result<_, _>>()?;
        Ok(Self::judged(self.explanations, sequences))
    }
}
