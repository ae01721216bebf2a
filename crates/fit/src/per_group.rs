//! A system in which some parameters have one value per group of records.
//!
//! A fit sees the value of each group as a parameter of its own; a simulation gets those of the record's group.

use crate::outcome::{Calibration, GroupCalibration};
use augsim_system::{Parameter, Record, Schema, Seed, Simulate, Simulated, SimulationError, Task};

/// A parameter of the fit: its index in the system, and its group if it has one value per group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place {
    parameter: usize,
    group: Option<usize>,
}

/// A system whose parameters `by_group` are repeated for each group of records.
#[derive(Debug)]
pub struct PerGroup<'a> {
    system: &'a dyn Simulate,
    parameters: Vec<Parameter>,
    places: Vec<Place>,
}

impl<'a> PerGroup<'a> {
    /// Gives the parameters with the indices `by_group` one value for each of `groups`, the names of the groups.
    ///
    /// The group of a record is its index in `groups`. A group without records keeps its declared values.
    pub fn new(system: &'a dyn Simulate, by_group: &[usize], groups: &[String], records: &[Record]) -> Self {
        let (mut parameters, mut places) = (Vec::new(), Vec::new());
        for (index, p) in system.parameters().iter().enumerate() {
            if !by_group.contains(&index) {
                parameters.push(p.clone());
                places.push(Place { parameter: index, group: None });
                continue;
            }
            for (group, (name, value)) in groups.iter().zip(p.values_of(groups)).enumerate() {
                parameters.push(Parameter {
                    name: format!("{}[{name}]", p.name),
                    nominal: value,
                    frozen: p.frozen || !records.iter().any(|r| r.group == group),
                    ..p.clone()
                });
                places.push(Place { parameter: index, group: Some(group) });
            }
        }
        Self { system, parameters, places }
    }

    /// Values of the system's parameters for a record of `group`, from the parameters of the fit.
    fn values_for(&self, values: &[f64], group: usize) -> Vec<f64> {
        let mut own: Vec<f64> = self.system.parameters().iter().map(|p| p.nominal).collect();
        let is_own = |place: &Place| place.group.is_none_or(|g| g == group);
        for (place, value) in self.places.iter().zip(values).filter(|(place, _)| is_own(place)) {
            own[place.parameter] = *value;
        }
        own
    }

    /// Seeds of the system for a record of `group`, and for each seed of the fit its place among them; `None` for the
    /// value of another group, on which the record does not depend.
    fn seeds_for(&self, seeds: &[Seed], group: usize) -> (Vec<Seed>, Vec<Option<usize>>) {
        let mut own = Vec::with_capacity(seeds.len());
        let place_of = |seed: &Seed| {
            let seed = match seed {
                Seed::Parameter(p) => {
                    let place = self.places.get(*p)?;
                    Some(Seed::Parameter(place.parameter))
                        .filter(|_| place.group.is_none_or(|g| g == group))?
                }
                other => *other,
            };
            own.push(seed);
            Some(own.len() - 1)
        };
        let places = seeds.iter().map(place_of).collect();
        (own, places)
    }

    /// Converts a calibration of this system to one of the original system's parameters. A parameter with values by
    /// group gets their mean, without a standard error.
    pub fn collected(&self, found: Calibration) -> Calibration {
        let count = self.system.parameters().len();
        let of =
            |parameter: usize| (0..self.places.len()).filter(move |i| self.places[*i].parameter == parameter);
        let shared = |parameter: usize| of(parameter).find(|i| self.places[*i].group.is_none());
        let mean = |parameter: usize| {
            let values: Vec<f64> = of(parameter).map(|i| found.values[i]).collect();
            values.iter().sum::<f64>() / values.len().max(1) as f64
        };
        let covariance = |i: usize, j: usize| match (shared(i), shared(j)) {
            (Some(i), Some(j)) => found.covariance[i][j],
            _ => 0.0,
        };
        let groups = (0..count).filter(|p| shared(*p).is_none()).map(|parameter| GroupCalibration {
            parameter,
            values: of(parameter).map(|i| found.values[i]).collect(),
            standard_errors: of(parameter).map(|i| found.standard_errors[i]).collect(),
        });
        let gauges = found.gauges.iter().map(|gauge| {
            let mut parameters: Vec<usize> =
                gauge.parameters.iter().map(|i| self.places[*i].parameter).collect();
            parameters.sort_unstable();
            parameters.dedup();
            crate::Gauge { parameters, ..gauge.clone() }
        });
        Calibration {
            values: (0..count).map(mean).collect(),
            standard_errors: (0..count).map(|p| shared(p).and_then(|i| found.standard_errors[i])).collect(),
            covariance: (0..count).map(|i| (0..count).map(|j| covariance(i, j)).collect()).collect(),
            at_bound: (0..count).map(|p| of(p).any(|i| found.at_bound[i])).collect(),
            groups: groups.collect(),
            gauges: gauges.collect(),
            ..found
        }
    }
}

/// Copies a simulation with the derivatives of the system into one with those of the fit.
fn copy_result(from: &Simulated, places: &[Option<usize>], out: &mut Simulated) {
    out.reset(from.samples(), from.channels(), places.len(), 0);
    for k in 0..from.samples() {
        for c in 0..from.channels() {
            let slopes = from.slopes(k, c);
            out.set_row(k, c, from.value(k, c), places.iter().map(|place| place.map_or(0.0, |i| slopes[i])));
        }
    }
    from.event_times().iter().for_each(|time_s| out.push_event(*time_s, []));
}

impl Simulate for PerGroup<'_> {
    fn schema(&self) -> &Schema {
        self.system.schema()
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn simulate(&self, task: &Task<'_>, out: &mut Simulated) -> Result<(), SimulationError> {
        let mut results = self.simulate_batch(std::slice::from_ref(task), std::slice::from_mut(out));
        results.pop().unwrap_or(Ok(()))
    }

    fn simulate_batch(&self, tasks: &[Task<'_>], out: &mut [Simulated]) -> Vec<Result<(), SimulationError>> {
        let values: Vec<Vec<f64>> =
            tasks.iter().map(|t| self.values_for(t.parameters, t.record.group)).collect();
        let seeds: Vec<_> = tasks.iter().map(|t| self.seeds_for(t.seeds, t.record.group)).collect();
        let own = tasks.iter().zip(&values).zip(&seeds);
        let own: Vec<Task<'_>> =
            own.map(|((task, parameters), (seeds, _))| Task { parameters, seeds, ..task.clone() }).collect();
        let mut simulated = vec![Simulated::default(); out.len()];
        let results = self.system.simulate_batch(&own, &mut simulated);
        for ((result, simulated), ((_, places), out)) in
            results.iter().zip(&simulated).zip(seeds.iter().zip(out))
        {
            if result.is_ok() {
                copy_result(simulated, places, out);
            }
        }
        results
    }

    fn simd_batch_size(&self) -> usize {
        self.system.simd_batch_size()
    }

    fn start_mean(&self, record: &Record, state: usize, parameters: &[f64], start: &[f64]) -> f64 {
        self.system.start_mean(record, state, &self.values_for(parameters, record.group), start)
    }

    fn resolution(&self, channel: usize) -> f64 {
        self.system.resolution(channel)
    }
}
