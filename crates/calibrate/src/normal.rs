//! Cost and normal equations of all windows.

use crate::windows::{Problem, Shot};
use augsim_physics::system::{Offsets, Seed, Simulated, SimulationError, Task};
use rayon::prelude::*;

/// Misfits beyond this many of their scale count in proportion and not by their square.
const KNEE: f64 = 4.0;

/// Standard deviation of normal numbers in the median of their sizes.
const OF_MEDIAN: f64 = 1.482_602_218_505_602;

/// One window's part: square matrices in rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Part {
    /// `[parameter][parameter]`
    pub a: Vec<f64>,
    /// `[parameter][state]`
    pub b: Vec<f64>,
    /// `[state][state]`
    pub c: Vec<f64>,
    /// Gradient by parameters, downhill.
    pub g: Vec<f64>,
    /// Gradient by the start, downhill.
    pub h: Vec<f64>,
    pub cost: f64,
    /// Sums of squared misfits and counts, by channel.
    pub squares: Vec<(f64, usize)>,
    /// Sizes of the misfits of each channel.
    pub sizes: Vec<Vec<f64>>,
    /// Sums of products of neighbouring misfits over their scale, and of their squares.
    pub neighbours: (f64, f64),
}

/// Parts of all windows, in their order.
#[derive(Clone, Debug)]
pub(crate) struct Normal {
    pub parts: Vec<Part>,
    pub cost: f64,
}

impl Normal {
    /// Root mean square misfit of each channel, in its unit.
    pub fn rms(&self, channels: usize) -> Vec<f64> {
        let of = |channel: usize| {
            let all = self.parts.iter().filter_map(|p| p.squares.get(channel));
            let (sum, count) = all.fold((0.0, 0), |(s, n), (square, k)| (s + square, n + k));
            (sum / f64::from(u32::try_from(count).unwrap_or(u32::MAX)).max(1.0)).sqrt()
        };
        (0..channels).map(of).collect()
    }

    /// Scale of the misfits of each channel, in its unit: by their median, so that a few wild samples do not stretch it, but
    /// at least a quarter of their root mean square, because where a system rests most misfits are next to nothing.
    pub fn scales(&self, channels: usize) -> Vec<f64> {
        let rms = self.rms(channels);
        let scale = |(channel, rms): (usize, f64)| {
            let mut sizes: Vec<f64> =
                self.parts.iter().filter_map(|p| p.sizes.get(channel)).flatten().copied().collect();
            let middle = sizes.len() / 2;
            if sizes.is_empty() {
                return rms;
            }
            let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
            (OF_MEDIAN * *median).max(0.25 * rms)
        };
        rms.into_iter().enumerate().map(scale).collect()
    }

    /// Number of measured values.
    pub fn count(&self) -> usize {
        self.parts.iter().flat_map(|p| &p.squares).map(|(_, count)| count).sum()
    }

    /// Correlation of neighbouring misfits.
    pub fn correlation(&self) -> f64 {
        let sums = self.parts.iter().fold((0.0, 0.0), |(a, b), p| (a + p.neighbours.0, b + p.neighbours.1));
        if sums.1 > 0.0 { (sums.0 / sums.1).clamp(0.0, 0.9999) } else { 0.0 }
    }
}

/// Where normal equations are wanted: values of all parameters, windows with their starts, and the scale of the misfit of each
/// channel, in its unit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place<'a> {
    pub values: &'a [f64],
    pub shots: &'a [Shot],
    pub sd: &'a [f64],
}

impl Problem<'_> {
    /// Costs at several places with their normal equations. Windows of all of them share the passes of the system: those of one
    /// place alone may be too few to fill one.
    ///
    /// # Errors
    /// Of each place its own: the first window that cannot be simulated.
    pub fn normals(&self, places: &[Place<'_>]) -> Vec<Result<Normal, SimulationError>> {
        let parameters = self.free.iter().map(|p| Seed::Parameter(*p));
        let seeds: Vec<Seed> = parameters.chain(self.states.iter().map(|s| Seed::Start(*s))).collect();
        let all: Vec<(&Place<'_>, &Shot)> =
            places.iter().flat_map(|place| place.shots.iter().map(move |shot| (place, shot))).collect();
        let run = |windows: &[(&Place<'_>, &Shot)]| -> Vec<Result<Part, SimulationError>> {
            let tasks: Vec<Task<'_>> = windows
                .iter()
                .map(|(place, shot)| Task {
                    parameters: place.values,
                    record: &self.records[shot.record],
                    window: shot.samples.clone(),
                    start: &shot.start,
                    offsets: Offsets::None,
                    seeds: &seeds,
                })
                .collect();
            let mut out = vec![Simulated::default(); tasks.len()];
            let done = self.system.simulate_all(&tasks, &mut out);
            let parts = done.into_iter().zip(windows).zip(&out);
            parts.map(|((done, (place, shot)), out)| done.map(|()| self.part(shot, out, place.sd))).collect()
        };
        // Few long windows keep every thread busy, too.
        let shared = all.len().div_ceil(rayon::current_num_threads());
        let each = self.system.side_by_side().min(shared).max(1);
        let parts: Vec<Result<Part, SimulationError>> = all.par_chunks(each).flat_map_iter(run).collect();
        let mut parts = parts.into_iter();
        let of_place = |place: &Place<'_>| {
            let own: Vec<_> = parts.by_ref().take(place.shots.len()).collect();
            let parts: Vec<Part> = own.into_iter().collect::<Result<_, _>>()?;
            // In the order of the windows, so that threads change no bit.
            let cost = parts.iter().map(|p| p.cost).sum();
            Ok(Normal { parts, cost })
        };
        places.iter().map(of_place).collect()
    }

    fn part(&self, shot: &Shot, out: &Simulated, sd: &[f64]) -> Part {
        let (p, n) = (self.free.len(), self.states.len());
        let channels = self.schema().channels.len();
        let mut part = Part {
            a: vec![0.0; p * p],
            b: vec![0.0; p * n],
            c: vec![0.0; n * n],
            g: vec![0.0; p],
            h: vec![0.0; n],
            squares: vec![(0.0, 0); channels],
            sizes: vec![Vec::new(); channels],
            ..Part::default()
        };
        let record = &self.records[shot.record];
        for (channel, declared) in self.schema().channels.iter().enumerate() {
            let sd = sd[channel];
            let mut before = None;
            for k in 0..out.samples() {
                let measured = record.values[channel][shot.samples.start + k];
                if !measured.is_finite() {
                    before = None;
                    continue;
                }
                let mut misfit = measured - out.value(k, channel);
                if let Some(period) = declared.period {
                    misfit -= period * (misfit / period).round();
                }
                let scaled = misfit / sd;
                let weight = if scaled.abs() > KNEE { KNEE / scaled.abs() } else { 1.0 };
                part.cost +=
                    if scaled.abs() > KNEE { KNEE * (2.0 * scaled.abs() - KNEE) } else { scaled * scaled };
                part.squares[channel].0 += misfit * misfit;
                part.squares[channel].1 += 1;
                part.sizes[channel].push(misfit.abs());
                if let Some(before) = before {
                    part.neighbours.0 += scaled * before;
                    part.neighbours.1 += scaled * scaled;
                }
                before = Some(scaled);
                if p + n > 0 {
                    part.add(&out.slopes(k, channel)[..p + n], (p, n), weight / sd, scaled / sd * weight, sd);
                }
            }
        }
        for (index, state) in self.states.iter().enumerate() {
            if let Some((mean, sd)) = self.prior(shot, *state) {
                let off = (mean - shot.start[*state]) / sd;
                part.cost += off * off;
                if n > 0 {
                    part.c[index * n + index] += 1.0 / (sd * sd);
                    part.h[index] += off / sd;
                }
            }
        }
        part
    }
}

impl Part {
    /// Adds a row of derivatives with its misfit.
    fn add(&mut self, row: &[f64], (p, n): (usize, usize), weight: f64, pull: f64, sd: f64) {
        let (by_parameters, by_start) = row.split_at(p);
        for (i, x) in by_parameters.iter().enumerate() {
            let scaled = weight / sd * x;
            self.g[i] += pull * x;
            for (to, y) in self.a[i * p..=i * p + i].iter_mut().zip(by_parameters) {
                *to += scaled * y;
            }
            for (to, y) in self.b[i * n..(i + 1) * n].iter_mut().zip(by_start) {
                *to += scaled * y;
            }
        }
        for (i, x) in by_start.iter().enumerate() {
            let scaled = weight / sd * x;
            self.h[i] += pull * x;
            for (to, y) in self.c[i * n..=i * n + i].iter_mut().zip(by_start) {
                *to += scaled * y;
            }
        }
    }
}
