//! Evidence of a plan: the explanations after the earlier recordings, and after the runs that were heard.

use super::explanation::{Tuning, compile};
use super::source::Source;
use super::state::{Explained, State};
use augsim_design::{Evidence, Explanation};
use augsim_system::Record;

/// Maximum number of samples of the earlier recordings that take part in tests of the explanations.
///
/// It bounds the time of a judgement, which simulates them several times. A test stays valid with fewer: the choice
/// depends on the number of recordings and samples alone.
const MAX_EARLIER_SAMPLES: usize = 20_000;

/// Recordings for tests of the explanations: all of them, or else evenly chosen ones, and of these the first samples.
pub(super) fn tested_records(records: &[Record]) -> Vec<Record> {
    let samples: usize = records.iter().map(|r| r.times.len()).sum();
    let step = samples.div_ceil(MAX_EARLIER_SAMPLES).min(records.len() / 2).max(1);
    let mut chosen: Vec<Record> = records.iter().step_by(step).cloned().collect();
    let most = MAX_EARLIER_SAMPLES / chosen.len().max(1);
    if samples > MAX_EARLIER_SAMPLES {
        for record in &mut chosen {
            record.times.truncate(most);
            record.values.iter_mut().for_each(|column| column.truncate(most));
        }
    }
    chosen
}

/// Evidence of the runs that a plan has heard, for each explanation; integration steps are chosen on `tuning`.
///
/// # Errors
/// An explanation cannot be compiled, or not be simulated over a recording.
pub(super) fn evidence_of(state: &State, tuning: &Tuning) -> anyhow::Result<Vec<Evidence>> {
    let [earlier, heard] = [state.earlier_records(), state.heard_records()];
    let evidence = |source: Source| -> anyhow::Result<Evidence> {
        let (explanation, _) = compile(&source, tuning)?;
        let mut evidence = Evidence::after(&explanation, &earlier)?;
        evidence.add_all(&heard)?;
        Ok(evidence)
    };
    state.planned_sources()?.into_iter().map(evidence).collect()
}

/// The explanations that a plan has not rejected, with their weights and evidence after the runs that were heard.
///
/// # Errors
/// As [`evidence_of`].
pub(super) fn live_evidence(
    state: &State,
    tuning: &Tuning,
) -> anyhow::Result<(Vec<Explanation>, Vec<Evidence>)> {
    let live = |(evidence, explained): (Evidence, &Explained)| {
        let log_weight = explained.log_weight + explained.log_density / state.dispersion;
        (!explained.rejected).then(|| (Explanation { log_weight, ..evidence.updated() }, evidence))
    };
    Ok(evidence_of(state, tuning)?.into_iter().zip(&state.explanations).filter_map(live).unzip())
}

#[cfg(test)]
mod tests {
    //! Contract: tests of the explanations use all earlier recordings of up to 20,000 samples, and evenly chosen ones of more.
    use super::*;

    fn recordings(count: usize, samples: usize) -> Vec<Record> {
        let record = |k: usize| Record {
            id: k.to_string(),
            times: (0..samples).map(|i| i as f64).collect(),
            values: vec![vec![0.0; samples]],
            ..Record::default()
        };
        (0..count).map(record).collect()
    }

    #[test]
    fn tests_use_up_to_twenty_thousand_samples() {
        let size = |count, samples| {
            let tested = tested_records(&recordings(count, samples));
            assert!(tested.iter().all(|r| r.values[0].len() == r.times.len()));
            (tested.len(), tested.first().map_or(0, |r| r.times.len()))
        };
        assert_eq!(size(20, 1000), (20, 1000));
        assert_eq!(size(40, 1000), (20, 1000));
        // Two recordings are two halves; the first samples of each are used.
        assert_eq!(size(2, 30_000), (2, 10_000));
        assert_eq!(size(0, 0), (0, 0));
        assert_eq!(tested_records(&recordings(40, 1000))[1].id, "2");
    }
}
