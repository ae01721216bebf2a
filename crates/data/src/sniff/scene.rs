//! Clock, unit of length and direction of up of trajectories that were read.

use super::Reading;
use super::fall::{acceleration, is_fall, rate_of_fall, unit_of_fall};
use super::heading::{Heading, Measures, Scale};
use super::recording::{Recorded, Recording, Target};
use super::roles::{Axis, Part};
use super::rows::Draft;
use super::unrecognised::Unrecognised;
use crate::error::DataError;
use crate::printable::shown;
use crate::statistics::{digits, median};
use std::path::Path;

/// Longest time between samples that is one in seconds, and in milliseconds, where no unit is written.
const STEP_S: f64 = 0.5;
const STEP_MS: f64 = 500.0;
/// First time of a trajectory, in steps, from which its clock did not begin with it.
const LATE: f64 = 1.5;
/// An angle beyond this is none in radians.
const TURN_RAD: f64 = 7.0;
/// Names that mean what the long form means by them.
const SETTLED: [&str; 4] = ["x_m", "y_m", "z_m", "height_m"];

/// Columns of the data set, the kind of the recording, its trajectories with times in s, and what was taken for granted.
type Settled = (Vec<Target>, Recording, Vec<Draft>, Vec<String>);

/// The trajectories on the way to SI.
pub(super) struct Scene<'a> {
    origin: &'a Path,
    reading: &'a Reading,
    first: &'a Recorded,
    all: Vec<Draft>,
    /// Heading and part of each column of values.
    used: Vec<(&'a Heading, &'a Part)>,
    assumed: Vec<String>,
}

impl<'a> Scene<'a> {
    /// `all` in the units of the file, whose columns of values are `used`.
    pub fn new(
        origin: &'a Path,
        reading: &'a Reading,
        first: &'a Recorded,
        all: Vec<Draft>,
        used: Vec<(&'a Heading, &'a Part)>,
    ) -> Self {
        Scene { origin, reading, first, all, used, assumed: Vec::new() }
    }

    /// Tells clock, units and directions.
    ///
    /// # Errors
    /// Something cannot be told, with the option that says it.
    pub fn settled(mut self) -> Result<Settled, DataError> {
        self.clock()?;
        let (columns, recording) = self.columns()?;
        Ok((columns, recording, self.all, self.assumed))
    }

    fn refuse<T>(&self, open: Unrecognised) -> Result<T, DataError> {
        Err(DataError::NotRecognised { path: self.origin.to_owned(), open })
    }

    /// Names of the columns of the file.
    fn names(&self) -> Vec<String> {
        self.first.headings.iter().map(|h| h.raw.clone()).collect()
    }

    /// Brings the times to seconds from the beginning of each trajectory.
    fn clock(&mut self) -> Result<(), DataError> {
        let steps = self.all.iter().flat_map(|d| d.times.windows(2).map(|w| w[1] - w[0]));
        let step = median(&mut steps.collect::<Vec<_>>()).unwrap_or(0.0);
        let whole = self.all.iter().flat_map(|d| &d.times).all(|t| t.fract() == 0.0);
        let column = self.first.parts.iter().position(|p| matches!(p, Part::Time(_)));
        let written = column.and_then(|i| match &self.first.parts[i] {
            Part::Time(scale) => *scale,
            _ => None,
        });
        let frames = column.is_none() || written.is_some_and(|s| s.measures == Measures::Frames);
        let seconds = match written.filter(|_| !frames) {
            Some(scale) => scale.factor,
            None if frames || (whole && step == 1.0) => 1.0 / self.rate(column.is_some())?,
            None if step < STEP_S => 1.0,
            None => {
                let (unit, factor) = match step {
                    s if s < STEP_MS => ("milliseconds", 1e-3),
                    s if s < 1e3 * STEP_MS => ("microseconds", 1e-6),
                    _ => ("nanoseconds", 1e-9),
                };
                self.assumed.push(format!("the time has no unit: steps of {} say {unit}", digits(step)));
                factor
            }
        };
        let as_recorded = column.is_some_and(|i| self.first.headings[i].raw == crate::column::TIME);
        let mut shifted = false;
        for draft in &mut self.all {
            let first = draft.times.first().copied().unwrap_or(0.0);
            let late = !as_recorded && (first.abs() > LATE * step || first < 0.0);
            shifted |= late;
            let zero = if late { first } else { 0.0 };
            // A quotient by a whole rate rounds as the clean number of seconds does.
            let rate = (1.0 / seconds).round();
            let exact = rate > 1.0 && (rate * seconds - 1.0).abs() < 1e-12;
            let to_s = |t: f64| if exact { (t - zero) / rate } else { (t - zero) * seconds };
            draft.times.iter_mut().for_each(|t| *t = to_s(*t));
        }
        if shifted {
            self.assumed.push("times count from the first sample of each trajectory".to_owned());
        }
        Ok(())
    }

    /// Frames a second.
    fn rate(&mut self, numbered: bool) -> Result<f64, DataError> {
        if let Some(rate) = self.reading.rate_hz {
            return Ok(rate);
        }
        if let Some(rate) = self.first.sheet.comments.iter().find_map(|c| rate_in(c)) {
            self.assumed.push(format!("frames are numbered; a comment says {} Hz", digits(rate)));
            return Ok(rate);
        }
        let lengths = self.used.iter().enumerate().filter_map(|(i, (_, p))| match p {
            Part::Axis(a, Some(s)) if a.is_position() && s.measures == Measures::Length => {
                Some((i, s.factor))
            }
            _ => None,
        });
        let falls = lengths.filter_map(|(i, factor)| Some(acceleration(&self.all, i)? * factor));
        let largest = falls.max_by(|a, b| a.abs().total_cmp(&b.abs()));
        if let Some(rate) = largest.and_then(rate_of_fall) {
            self.assumed.push(format!("frames are numbered; the fall says {} Hz", digits(rate)));
            return Ok(rate);
        }
        self.refuse(match numbered {
            true => Unrecognised::NoFrameRate,
            false => Unrecognised::NoTimes { columns: self.names() },
        })
    }

    /// The columns of the data set, and what kind of recording it is.
    fn columns(&mut self) -> Result<(Vec<Target>, Recording), DataError> {
        let mut out: Vec<Target> = Vec::new();
        let mut axes: Vec<(usize, Axis, Option<Scale>)> = Vec::new();
        for (value, (h, part)) in self.used.iter().enumerate() {
            match part {
                Part::Axis(axis, scale) => axes.push((value, *axis, *scale)),
                Part::Named(name, factor) => {
                    out.push(Target { value, from: h.raw.clone(), name: name.clone(), factor: *factor });
                }
                _ => {}
            }
        }
        if let Some((value, ..)) =
            axes.iter().find(|(_, _, s)| s.is_some_and(|s| s.measures == Measures::Pixels))
        {
            return self.refuse(Unrecognised::Pixels { column: self.used[*value].0.raw.clone() });
        }
        let has = |axis: Axis| axes.iter().any(|(_, a, _)| *a == axis);
        if has(Axis::PusherX) && has(Axis::PusherY) && has(Axis::X) && has(Axis::Y) {
            out.splice(0..0, self.pushes(&axes));
            return Ok((out, Recording::Pushes));
        }
        axes.retain(|(_, a, _)| a.is_position());
        let raw = |value: usize| self.used[value].0.raw.as_str();
        let settled = axes.iter().all(|(v, ..)| SETTLED.contains(&raw(*v)))
            && axes.iter().any(|(v, ..)| matches!(raw(*v), "z_m" | "height_m"));
        let positions = if settled {
            let own = |(value, ..): &(usize, Axis, Option<Scale>)| Target {
                value: *value,
                from: raw(*value).to_owned(),
                name: raw(*value).to_owned(),
                factor: 1.0,
            };
            axes.iter().map(own).collect()
        } else {
            self.positions(&axes)?
        };
        let named_fall = |t: &&Target| matches!(t.name.as_str(), "z_m" | "height_m");
        let vertical = positions.iter().chain(&out).find(named_fall).cloned();
        let count = positions.iter().chain(&out).filter(|t| SETTLED.contains(&t.name.as_str())).count();
        out.splice(0..0, positions);
        if out.is_empty() {
            return self.refuse(Unrecognised::NoPositions { columns: self.names() });
        }
        let recording = match vertical {
            None => Recording::Other,
            Some(t) => match acceleration(&self.all, t.value).map(|a| a * t.factor) {
                Some(a) if is_fall(a) => Recording::Falls(count),
                other => Recording::Moves(other),
            },
        };
        Ok((out, recording))
    }

    /// Factor that brings a coordinate to metres: what is written, or what the fall says.
    fn metres(&mut self, axes: &[(usize, Axis, Option<Scale>)]) -> Vec<f64> {
        if axes.iter().all(|(_, _, scale)| scale.is_some()) {
            return axes.iter().map(|(_, _, scale)| scale.map_or(1.0, |s| s.factor)).collect();
        }
        let largest = axes
            .iter()
            .filter(|(_, _, scale)| scale.is_none())
            .filter_map(|(value, ..)| acceleration(&self.all, *value))
            .max_by(|a, b| a.abs().total_cmp(&b.abs()));
        let guess = match largest.and_then(|a| Some((a, unit_of_fall(a)?))) {
            Some((a, (unit, factor))) => {
                let a = digits(a.abs());
                self.assumed.push(format!("lengths have no unit: a fall of {a} per s^2 says {unit}"));
                factor
            }
            None => {
                self.assumed.push("lengths have no unit and nothing falls freely: metres".to_owned());
                1.0
            }
        };
        axes.iter().map(|(_, _, scale)| scale.map_or(guess, |s| s.factor)).collect()
    }

    /// Positions with the vertical one last, upwards.
    fn positions(&mut self, axes: &[(usize, Axis, Option<Scale>)]) -> Result<Vec<Target>, DataError> {
        if axes.is_empty() {
            return Ok(Vec::new());
        }
        let factors = self.metres(axes);
        let falls: Vec<Option<f64>> = axes
            .iter()
            .zip(&factors)
            .map(|((value, ..), factor)| Some(acceleration(&self.all, *value)? * factor))
            .collect();
        let name = |i: usize| self.used[axes[i].0].0.raw.clone();
        let (vertical, downwards) = match &self.reading.up {
            Some(up) => {
                let (wanted, downwards) = match up.strip_prefix('-') {
                    Some(rest) => (rest, true),
                    None => (up.strip_prefix('+').unwrap_or(up), false),
                };
                let is = |i: &usize| {
                    let heading = self.used[axes[*i].0].0;
                    heading.raw.eq_ignore_ascii_case(wanted)
                        || heading.words.join("_") == wanted.to_lowercase()
                };
                match (0..axes.len()).find(is) {
                    Some(i) => (i, downwards),
                    None => {
                        let columns = (0..axes.len()).map(name).collect();
                        return self
                            .refuse(Unrecognised::NoSuchCoordinate { name: wanted.to_owned(), columns });
                    }
                }
            }
            None => {
                let falling = |i: &usize| falls[*i].is_some_and(is_fall);
                let size = |i: &usize| falls[*i].unwrap_or(0.0).abs();
                let by_name = [Axis::Height, Axis::Z, Axis::Y, Axis::X];
                let called = by_name.iter().find_map(|axis| axes.iter().position(|(_, a, _)| a == axis));
                let height = axes.iter().position(|(_, a, _)| *a == Axis::Height);
                let most = (0..axes.len()).filter(falling).max_by(|a, b| size(a).total_cmp(&size(b)));
                let vertical = height.or(most).or(called).unwrap_or(0);
                (vertical, falls[vertical].is_some_and(|a| is_fall(a) && a > 0.0))
            }
        };
        let usual = matches!(axes[vertical].1, Axis::Height | Axis::Z)
            || axes.len() < 3 && axes[vertical].1 == Axis::Y;
        if downwards {
            self.assumed.push(format!("{} counts downwards: up is minus {0}", shown(&name(vertical))));
        } else if !usual && axes.len() > 1 {
            self.assumed.push(format!("{} is the vertical", shown(&name(vertical))));
        }
        let mut out = Vec::new();
        let mut free = ["x_m", "y_m"].into_iter();
        for (i, (value, axis, _)) in axes.iter().enumerate().filter(|(i, _)| *i != vertical) {
            if !self.moves(*value) {
                self.assumed.push(format!("{} never changes and was left out", shown(&name(i))));
                continue;
            }
            // A third axis turns with the vertical one, so that the frame stays right-handed.
            let turned = axes[vertical].1 == Axis::Y && *axis == Axis::Z;
            if let Some(to) = free.next() {
                let factor = if turned { -factors[i] } else { factors[i] };
                out.push(Target { value: *value, from: name(i), name: to.to_owned(), factor });
            }
        }
        let factor = if downwards { -factors[vertical] } else { factors[vertical] };
        let to = if out.is_empty() { "height_m" } else { "z_m" };
        out.push(Target { value: axes[vertical].0, from: name(vertical), name: to.to_owned(), factor });
        Ok(out)
    }

    /// Whether a column changes within a trajectory.
    fn moves(&self, value: usize) -> bool {
        self.all.iter().any(|d| {
            let mut seen = d.values[value].iter().filter(|v| v.is_finite());
            let first = seen.next();
            seen.any(|v| Some(v) != first)
        })
    }

    /// Columns of a push.
    fn pushes(&mut self, axes: &[(usize, Axis, Option<Scale>)]) -> Vec<Target> {
        let known = axes.iter().find_map(|(_, a, s)| s.filter(|_| *a != Axis::Theta));
        if axes.iter().any(|(_, a, s)| s.is_none() && *a != Axis::Theta) {
            let unit = if known.is_some() { "that of the other coordinates" } else { "metres" };
            self.assumed.push(format!("lengths without a unit are in {unit}"));
        }
        let mut out = Vec::new();
        for (value, axis, scale) in axes {
            let name = match axis {
                Axis::PusherX => "pusher_x_m",
                Axis::PusherY => "pusher_y_m",
                Axis::X => "x_m",
                Axis::Y => "y_m",
                Axis::Theta => "theta_rad",
                Axis::Z | Axis::Height => continue,
            };
            let largest =
                self.all.iter().flat_map(|d| &d.values[*value]).fold(0.0, |m: f64, v| m.max(v.abs()));
            let factor = match (axis, scale) {
                (_, Some(scale)) => scale.factor,
                (Axis::Theta, None) if largest > TURN_RAD => {
                    self.assumed.push(format!("angles up to {} are degrees", digits(largest)));
                    std::f64::consts::PI / 180.0
                }
                (Axis::Theta, None) => 1.0,
                (_, None) => known.map_or(1.0, |s| s.factor),
            };
            let from = self.used[*value].0.raw.clone();
            out.push(Target { value: *value, from, name: name.to_owned(), factor });
        }
        out
    }
}

/// Frames a second that a comment states.
fn rate_in(comment: &str) -> Option<f64> {
    let text = comment.to_lowercase();
    if !["fps", "hz", "frame rate", "framerate", "frames per second"].iter().any(|word| text.contains(word)) {
        return None;
    }
    let numbers =
        text.split(|c: char| !(c.is_ascii_digit() || c == '.')).filter_map(|n| n.parse::<f64>().ok());
    { numbers }.find(|rate| (1.0..1e6).contains(rate))
}
