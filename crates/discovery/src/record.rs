//! One measured trajectory, ready for fits.

use crate::DiscoveryError;
use crate::tally::Tally;
use augsim_data::Dataset;
use augsim_physics::ball::{Axes, Covariates};
use augsim_physics::model::Model;
use augsim_physics::system::{Record as SystemRecord, System};
use std::sync::Arc;

/// One trajectory: times, positions by channel, and what is known about the whole of it.
#[derive(Clone, Debug)]
pub(crate) struct Record {
    /// Seconds since the release; only samples that enter fits.
    pub times: Vec<f64>,
    /// `y[channel][sample]`, m; NaN where not measured.
    pub y: Vec<Vec<f64>>,
    /// `weight[channel][sample]` = 1/σ, 1/m; 0 where not measured or masked.
    pub weight: Vec<Vec<f64>>,
    /// Time between two measured samples of a channel from which their noise is independent, s.
    pub memory_s: f64,
    pub covariates: Covariates,
    pub radius_m: Option<f64>,
    pub group: usize,
    /// Rough impact times, s.
    pub impacts: Vec<f64>,
    /// Sample ranges of the arcs between impacts, margins left out.
    pub arcs: Vec<std::ops::Range<usize>>,
    /// Speed ratios at the rough impacts.
    pub ratios: Vec<f64>,
    /// Rough position and velocity at the start time.
    pub start: ([f64; 3], [f64; 3]),
}

impl Record {
    /// Whether the noise of sample `k` of a channel is correlated with that of `before`, the measured one before it: at most
    /// one sample was lost in between. Lost is what was not recorded, what has an empty cell, and what was masked.
    pub fn follows(&self, before: usize, k: usize) -> bool {
        self.times[k] - self.times[before] < self.memory_s
    }

    /// Rough states at the start time, in the order of the ball's schema: positions, then velocities, of as many axes as there
    /// are channels. A planned record has no measurements that would tell how many these are.
    pub fn rough_start(&self, channels: usize) -> Vec<f64> {
        let axes: &[usize] = match channels {
            1 => &[2],
            2 => &[0, 2],
            _ => &[0, 1, 2],
        };
        let (position, velocity) = self.start;
        axes.iter().map(|&a| position[a]).chain(axes.iter().map(|&a| velocity[a])).collect()
    }

    /// The record as the system knows it.
    pub fn seen(&self) -> SystemRecord {
        let c = &self.covariates;
        let [x, y, z] = c.spin_rad_s;
        let radius = self.radius_m.unwrap_or(f64::NAN);
        SystemRecord {
            times: self.times.clone(),
            covariates: vec![c.clock_s, x, y, z, c.area_per_mass_m2_kg, radius],
            ..SystemRecord::default()
        }
    }
}

/// All trajectories of a data set with what they have in common.
#[derive(Clone, Debug)]
pub(crate) struct Measured {
    pub name: String,
    pub axes: Axes,
    /// What the model declares.
    pub system: Arc<dyn System>,
    pub records: Vec<Record>,
    pub groups: Vec<String>,
    pub has_spin: bool,
    pub has_start_time: bool,
    /// Session time that the clocks of the records count from, s.
    pub clock_reference_s: f64,
    /// Work done on these trajectories and their copies.
    pub tally: Arc<Tally>,
}

impl Measured {
    /// Takes the columns that the ball world knows from a data set; others are ignored. The session clock counts from the
    /// model's reference or, without it, from the mean of the start times.
    pub fn from_dataset(data: &Dataset, model: &Model) -> Result<Self, DiscoveryError> {
        let clock_reference_s = model.clock_reference_s;
        let name = data.origin().to_string();
        let (axes, columns) =
            channels(data).ok_or_else(|| DiscoveryError::NoPosition { data: name.clone() })?;
        let indices = columns.iter().map(|c| data.column_index(c)).collect::<Result<Vec<_>, _>>()?;
        for (column, &i) in columns.iter().zip(&indices) {
            let mut seen =
                data.trajectories().iter().flat_map(|t| t.column(i)).copied().filter(|v| v.is_finite());
            let first = seen.next();
            if first.is_none() || seen.all(|v| Some(v) == first) {
                let column = column.to_string();
                return Err(DiscoveryError::Constant { data: name, column });
            }
        }
        let constant = |column: &str, t: &augsim_data::Trajectory| {
            let i = data.column_index(column).ok()?;
            t.column(i).iter().copied().find(|v| v.is_finite())
        };
        let start_times: Vec<_> =
            data.trajectories().iter().filter_map(|t| constant("start_time_s", t)).collect();
        let has_start_time = start_times.len() == data.trajectories().len() && !start_times.is_empty();
        let mean =
            if has_start_time { start_times.iter().sum::<f64>() / start_times.len() as f64 } else { 0.0 };
        let clock_reference_s = clock_reference_s.filter(|_| has_start_time).unwrap_or(mean);
        let mut groups: Vec<String> =
            data.trajectories().iter().filter_map(|t| t.group().map(String::from)).collect();
        groups.sort();
        groups.dedup();
        let mut records = Vec::new();
        for t in data.trajectories() {
            let (radius_m, mass_kg) = (constant("radius_m", t), constant("mass_kg", t));
            let covariates = Covariates {
                area_per_mass_m2_kg: match (radius_m, mass_kg) {
                    (Some(r), Some(m)) if m > 0.0 => std::f64::consts::PI * r * r / m,
                    _ => 0.0,
                },
                clock_s: constant("start_time_s", t).map_or(0.0, |s| s - clock_reference_s),
                spin_rad_s: [
                    constant("spin_x_rad_s", t).unwrap_or(0.0),
                    constant("spin_rad_s", t).or(constant("spin_y_rad_s", t)).unwrap_or(0.0),
                    constant("spin_z_rad_s", t).unwrap_or(0.0),
                ],
            };
            let group = t.group().and_then(|g| groups.iter().position(|x| x == g));
            // A row in which no position was measured says nothing: it is as if it had not been written.
            let rows: Vec<usize> =
                (0..t.len()).filter(|&k| indices.iter().any(|&i| t.column(i)[k].is_finite())).collect();
            let measured = |column: &[f64]| rows.iter().map(|&k| column[k]).collect::<Vec<_>>();
            records.push(Record {
                times: measured(t.time_s()),
                y: indices.iter().map(|&i| measured(t.column(i))).collect(),
                weight: Vec::new(),
                memory_s: 0.0,
                covariates,
                radius_m,
                group: group.unwrap_or(0),
                impacts: Vec::new(),
                arcs: Vec::new(),
                ratios: Vec::new(),
                start: ([0.0; 3], [0.0; 3]),
            });
        }
        if groups.is_empty() {
            groups.push(String::new());
        }
        let has_spin = records.iter().any(|r| r.covariates.spin_rad_s != [0.0; 3]);
        let (system, tally) = (Arc::new(model.open(axes)), Arc::default());
        Ok(Self { name, axes, system, records, groups, has_spin, has_start_time, clock_reference_s, tally })
    }

    /// The number of each trajectory's group.
    pub fn group_of(&self) -> Vec<usize> {
        self.records.iter().map(|r| r.group).collect()
    }

    /// The same description with no records.
    pub fn without_records(&self) -> Self {
        Self {
            name: self.name.clone(),
            groups: self.groups.clone(),
            records: Vec::new(),
            tally: self.tally.clone(),
            system: self.system.clone(),
            ..*self
        }
    }

    /// Whether any trajectory shows an impact.
    pub fn has_impacts(&self) -> bool {
        self.records.iter().any(|r| !r.impacts.is_empty())
    }
}

fn channels(data: &Dataset) -> Option<(Axes, &'static [&'static str])> {
    let has = |c: &str| data.has_column(c);
    if has("x_m") && has("y_m") && has("z_m") {
        Some((Axes::Space, &["x_m", "y_m", "z_m"]))
    } else if has("x_m") && has("z_m") {
        Some((Axes::Plane, &["x_m", "z_m"]))
    } else if has("height_m") {
        Some((Axes::Vertical, &["height_m"]))
    } else if has("z_m") {
        Some((Axes::Vertical, &["z_m"]))
    } else {
        None
    }
}
