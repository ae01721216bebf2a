//! Infers time unit, unit of length, direction of up and kind of recording, and converts to SI.

use super::RecognitionOptions;
use super::calendar::{Written, calendar_unit};
use super::clock::Clock;
use super::fall::{acceleration, is_fall, rate_of_fall, unit_of_fall};
use super::heading::{ColumnUnit, Heading, Quantity};
use super::recording::{RecordedFile, RecordingKind, Target};
use super::roles::{Axis, Role};
use super::rows::Draft;
use super::unrecognised::Unrecognised;
use crate::error::DataError;
use crate::escape_control_characters::escaped_short;
use crate::statistics::{digits, median};
use std::path::Path;

/// Largest first time of a trajectory, in median time steps, at which its times are not shifted to begin at 0.
const MAX_FIRST_TIME: f64 = 1.5;
/// Largest value at which angles without a unit are read as radians; 7 is a little more than one turn.
const MAX_ANGLE_RAD: f64 = 7.0;
/// Names of position columns in the long form.
const LONG_FORM_POSITIONS: [&str; 4] = ["x_m", "y_m", "z_m", "height_m"];

/// Result of [`Scene::resolve`]: columns of the data set, kind of motion, trajectories (times in s), and notes.
type Resolved = (Vec<Target>, RecordingKind, Vec<Draft>, Vec<String>);

/// Coordinate: index of its column of values, its axis, and its unit (`None` where the file states none).
type Coordinate = (usize, Axis, Option<ColumnUnit>);

/// Trajectories of all files, from which units, vertical direction and kind of motion are inferred.
pub(super) struct Scene<'a> {
    origin: &'a Path,
    reading: &'a RecognitionOptions,
    first: &'a RecordedFile,
    drafts: Vec<Draft>,
    /// Heading and role of each column of values.
    used: Vec<(&'a Heading, &'a Role)>,
    notes: Vec<String>,
}

impl<'a> Scene<'a> {
    /// Creates the state of the inference for `drafts`, whose columns of values are `used`; `first` is the first file.
    pub fn new(
        origin: &'a Path,
        reading: &'a RecognitionOptions,
        first: &'a RecordedFile,
        drafts: Vec<Draft>,
        used: Vec<(&'a Heading, &'a Role)>,
    ) -> Self {
        Scene { origin, reading, first, drafts, used, notes: Vec::new() }
    }

    /// Infers time unit, units of length and vertical direction, and converts the times to seconds.
    ///
    /// # Errors
    /// A property cannot be inferred; the message names the option that states it.
    pub fn resolve(mut self) -> Result<Resolved, DataError> {
        self.convert_times()?;
        let (columns, recording) = self.columns()?;
        Ok((columns, recording, self.drafts, self.notes))
    }

    fn refuse<T>(&self, reason: Unrecognised) -> Result<T, DataError> {
        Err(DataError::NotRecognised { path: self.origin.to_owned(), reason })
    }

    /// Names of the columns of the file.
    fn names(&self) -> Vec<String> {
        self.first.headings.iter().map(|h| h.raw.clone()).collect()
    }

    /// Converts the times to seconds, and shifts those of a trajectory with a late start to begin at 0.
    fn convert_times(&mut self) -> Result<(), DataError> {
        let steps = self.drafts.iter().flat_map(|d| d.times.windows(2).map(|w| w[1] - w[0]));
        let step = median(&mut steps.collect::<Vec<_>>()).unwrap_or(0.0);
        let is_whole = self.drafts.iter().flat_map(|d| &d.times).all(|t| t.fract() == 0.0);
        let column = self.first.roles.iter().position(|p| matches!(p, Role::Time(_)));
        let written = column.and_then(|i| match &self.first.roles[i] {
            Role::Time(unit) => *unit,
            _ => None,
        });
        let is_in_frames = column.is_none() || written.is_some_and(|u| u.quantity == Quantity::Frames);
        let mut clock = match is_in_frames {
            true => Clock { unit_s: 1.0, is_absolute: false, note: None },
            false => self.clock(column, written)?,
        };
        // Whole numbers with steps of 1 may be frame numbers, of which a fall or a comment shows the rate.
        let may_be_frames =
            column.is_none() || written.is_none() && is_whole && step == 1.0 && !clock.is_absolute;
        if is_in_frames || may_be_frames {
            match self.frame_rate(column.is_some()) {
                Ok(rate) => clock = Clock { unit_s: 1.0 / rate, is_absolute: false, note: None },
                Err(cause) if is_in_frames => return Err(cause),
                Err(_) => {}
            }
        }
        self.notes.extend(clock.note.clone());
        let is_long_form = column.is_some_and(|i| self.first.headings[i].raw == crate::column::TIME);
        let mut shifted = false;
        for draft in &mut self.drafts {
            let first = draft.times.first().copied().unwrap_or(0.0);
            let is_late = !is_long_form && (first.abs() > MAX_FIRST_TIME * step || first < 0.0);
            shifted |= is_late && !clock.is_absolute;
            let zero = if is_late || clock.is_absolute { first } else { 0.0 };
            draft.times.iter_mut().for_each(|t| *t = clock.seconds(*t, zero));
        }
        if shifted {
            self.notes.push("times count from the first sample of each trajectory".to_owned());
        }
        Ok(())
    }

    /// Infers the clock of the time column, from the stated unit `unit` or from the numbers.
    fn clock(&self, column: Option<usize>, unit: Option<ColumnUnit>) -> Result<Clock, DataError> {
        let heading = column.map(|i| &self.first.headings[i]);
        let name = heading.map_or("", |h| h.raw.as_str());
        let runs: Vec<&[f64]> = self.drafts.iter().map(|d| d.times.as_slice()).collect();
        let written = self.drafts.first().map_or(Written::Number, |d| d.written);
        let unit_text = heading.map_or("", |h| h.unit_text.as_str());
        let mut clock = match Clock::of_column((name, unit_text), unit, written, &runs) {
            Ok(clock) => clock,
            Err(reason) => return self.refuse(reason),
        };
        clock.is_absolute |= heading.is_some_and(|h| calendar_unit(h).is_some());
        Ok(clock)
    }

    /// Finds the frame rate, Hz: from the user's option, from a comment in the file, or from free fall.
    ///
    /// `has_frames` states whether the file has a column of frame numbers.
    fn frame_rate(&mut self, has_frames: bool) -> Result<f64, DataError> {
        if let Some(rate) = self.reading.rate_hz {
            return Ok(rate);
        }
        if let Some(rate) = self.first.sheet.comments.iter().find_map(|c| rate_in_comment(c)) {
            self.notes
                .push(format!("times are frame numbers; a comment in the file states {} Hz", digits(rate)));
            return Ok(rate);
        }
        let lengths = self.used.iter().enumerate().filter_map(|(i, (_, p))| match p {
            Role::Axis(a, Some(s)) if a.is_position() && s.quantity == Quantity::Length => {
                Some((i, s.factor()))
            }
            _ => None,
        });
        let falls = lengths.filter_map(|(i, factor)| Some(acceleration(&self.drafts, i)? * factor));
        let largest = falls.max_by(|a, b| a.abs().total_cmp(&b.abs()));
        if let Some(rate) = largest.and_then(rate_of_fall) {
            self.notes.push(format!("times are frame numbers; free fall implies {} Hz", digits(rate)));
            return Ok(rate);
        }
        self.refuse(match has_frames {
            true => Unrecognised::NoFrameRate,
            false => Unrecognised::NoTimes { columns: self.names() },
        })
    }

    /// Determines the columns of the data set and the kind of motion.
    fn columns(&mut self) -> Result<(Vec<Target>, RecordingKind), DataError> {
        let mut out: Vec<Target> = Vec::new();
        let mut axes: Vec<Coordinate> = Vec::new();
        for (value, (h, role)) in self.used.iter().enumerate() {
            match role {
                Role::Axis(axis, unit) => axes.push((value, *axis, *unit)),
                Role::Named(name, conversion) => {
                    let (factor, offset) = (conversion.factor(), conversion.offset());
                    out.push(Target { value, from: h.raw.clone(), name: name.clone(), factor, offset });
                }
                _ => {}
            }
        }
        if let Some((value, ..)) =
            axes.iter().find(|(_, _, s)| s.is_some_and(|s| s.quantity == Quantity::Pixels))
        {
            return self.refuse(Unrecognised::Pixels { column: self.used[*value].0.raw.clone() });
        }
        self.drop_axes_without_fall(&mut axes, &mut out);
        let has = |axis: Axis| axes.iter().any(|(_, a, _)| *a == axis);
        if has(Axis::PusherX) && has(Axis::PusherY) && has(Axis::X) && has(Axis::Y) {
            out.splice(0..0, self.push_columns(&axes));
            return Ok((out, RecordingKind::Pushes));
        }
        axes.retain(|(_, a, _)| a.is_position());
        let raw = |value: usize| self.used[value].0.raw.as_str();
        // Columns that are named as in the long form keep their names, units and directions.
        let is_long_form = axes.iter().all(|(v, ..)| LONG_FORM_POSITIONS.contains(&raw(*v)))
            && axes.iter().any(|(v, ..)| matches!(raw(*v), "z_m" | "height_m"));
        let positions = if is_long_form {
            let unchanged = |(value, ..): &Coordinate| Target {
                value: *value,
                from: raw(*value).to_owned(),
                name: raw(*value).to_owned(),
                factor: 1.0,
                offset: 0.0,
            };
            axes.iter().map(unchanged).collect()
        } else {
            self.positions(&axes)?
        };
        let is_vertical = |t: &&Target| matches!(t.name.as_str(), "z_m" | "height_m");
        let vertical = positions.iter().chain(&out).find(is_vertical).cloned();
        let is_position = |t: &&Target| LONG_FORM_POSITIONS.contains(&t.name.as_str());
        let count = positions.iter().chain(&out).filter(is_position).count();
        out.splice(0..0, positions);
        if out.is_empty() {
            return self.refuse(Unrecognised::NoPositions { columns: self.names() });
        }
        let recording = match vertical {
            None => RecordingKind::Other,
            Some(t) => match acceleration(&self.drafts, t.value).map(|a| a * t.factor) {
                Some(a) if is_fall(a) => RecordingKind::Falls(count),
                other => RecordingKind::Moves(other),
            },
        };
        Ok((out, recording))
    }

    /// For a table without a header, drops the assumption that columns are coordinates if none falls freely.
    fn drop_axes_without_fall(&mut self, axes: &mut Vec<Coordinate>, out: &mut Vec<Target>) {
        let falls =
            |value: usize| acceleration(&self.drafts, value).is_some_and(|a| unit_of_fall(a).is_some());
        if self.first.sheet.names.is_some() || axes.iter().any(|(value, ..)| falls(*value)) {
            return;
        }
        for (value, ..) in axes.drain(..) {
            let from = self.used[value].0.raw.clone();
            out.push(Target { value, name: format!("column_{from}"), from, factor: 1.0, offset: 0.0 });
        }
    }

    /// Factors that convert the coordinates to metres, from their units or from free fall.
    fn metres(&mut self, axes: &[Coordinate]) -> Vec<f64> {
        if axes.iter().all(|(_, _, unit)| unit.is_some()) {
            return axes.iter().map(|(_, _, unit)| unit.map_or(1.0, |u| u.factor())).collect();
        }
        let largest = axes
            .iter()
            .filter(|(_, _, unit)| unit.is_none())
            .filter_map(|(value, ..)| acceleration(&self.drafts, *value))
            .max_by(|a, b| a.abs().total_cmp(&b.abs()));
        let guess = match largest.and_then(|a| Some((a, unit_of_fall(a)?))) {
            Some((a, (unit, factor))) => {
                let a = digits(a.abs());
                self.notes.push(format!("lengths have no unit; free fall at {a} per s^2 implies {unit}"));
                factor
            }
            None => {
                self.notes
                    .push("lengths have no unit and nothing falls freely; metres are assumed".to_owned());
                1.0
            }
        };
        axes.iter().map(|(_, _, unit)| unit.map_or(guess, |u| u.factor())).collect()
    }

    /// Determines the columns of positions in metres, the vertical one last and positive upwards.
    fn positions(&mut self, axes: &[Coordinate]) -> Result<Vec<Target>, DataError> {
        if axes.is_empty() {
            return Ok(Vec::new());
        }
        let factors = self.metres(axes);
        let falls: Vec<Option<f64>> = axes
            .iter()
            .zip(&factors)
            .map(|((value, ..), factor)| Some(acceleration(&self.drafts, *value)? * factor))
            .collect();
        let (vertical, is_downward) = match &self.reading.up {
            Some(up) => self.vertical_from_option(up, axes)?,
            None => vertical_from_fall(axes, &falls),
        };
        let name = |i: usize| self.used[axes[i].0].0.raw.clone();
        let is_usual = matches!(axes[vertical].1, Axis::Height | Axis::Z)
            || axes.len() < 3 && axes[vertical].1 == Axis::Y;
        if is_downward {
            self.notes.push(format!("{} grows downwards: up is minus {0}", escaped_short(&name(vertical))));
        } else if !is_usual && axes.len() > 1 {
            self.notes.push(format!("{} is the vertical coordinate", escaped_short(&name(vertical))));
        }
        let mut out = Vec::new();
        let mut horizontal_names = ["x_m", "y_m"].into_iter();
        for (i, (value, axis, _)) in axes.iter().enumerate().filter(|(i, _)| *i != vertical) {
            if !self.moves(*value) {
                self.notes.push(format!("{} never changes and was left out", escaped_short(&name(i))));
                continue;
            }
            // Where y is vertical, z changes its sign, so that the frame remains right-handed.
            let is_reversed = axes[vertical].1 == Axis::Y && *axis == Axis::Z;
            if let Some(to) = horizontal_names.next() {
                let factor = if is_reversed { -factors[i] } else { factors[i] };
                out.push(Target { value: *value, from: name(i), name: to.to_owned(), factor, offset: 0.0 });
            }
        }
        let factor = if is_downward { -factors[vertical] } else { factors[vertical] };
        let to = if out.is_empty() { "height_m" } else { "z_m" };
        out.push(Target {
            value: axes[vertical].0,
            from: name(vertical),
            name: to.to_owned(),
            factor,
            offset: 0.0,
        });
        Ok(out)
    }

    /// Index of the vertical coordinate that the option `--up` names, and whether it grows downwards.
    fn vertical_from_option(&self, up: &str, axes: &[Coordinate]) -> Result<(usize, bool), DataError> {
        let (wanted, is_downward) = match up.strip_prefix('-') {
            Some(name) => (name, true),
            None => (up.strip_prefix('+').unwrap_or(up), false),
        };
        let heading = |i: usize| self.used[axes[i].0].0;
        let is_wanted = |i: &usize| {
            heading(*i).raw.eq_ignore_ascii_case(wanted)
                || heading(*i).words.join("_") == wanted.to_lowercase()
        };
        match (0..axes.len()).find(is_wanted) {
            Some(i) => Ok((i, is_downward)),
            None => {
                let columns = (0..axes.len()).map(|i| heading(i).raw.clone()).collect();
                self.refuse(Unrecognised::NoSuchCoordinate { name: wanted.to_owned(), columns })
            }
        }
    }

    /// Whether a column changes within a trajectory.
    fn moves(&self, value: usize) -> bool {
        self.drafts.iter().any(|d| {
            let mut measured = d.values[value].iter().filter(|v| v.is_finite());
            let first = measured.next();
            measured.any(|v| Some(v) != first)
        })
    }

    /// Determines the columns of a recording of pushes.
    fn push_columns(&mut self, axes: &[Coordinate]) -> Vec<Target> {
        let known = axes.iter().find_map(|(_, a, unit)| unit.filter(|_| *a != Axis::Theta));
        if axes.iter().any(|(_, a, unit)| unit.is_none() && *a != Axis::Theta) {
            let unit = if known.is_some() { "the unit of the other coordinates" } else { "metres" };
            self.notes.push(format!("lengths without a unit are assumed to be in {unit}"));
        }
        let mut out = Vec::new();
        for (value, axis, unit) in axes {
            let name = match axis {
                Axis::PusherX => "pusher_x_m",
                Axis::PusherY => "pusher_y_m",
                Axis::X => "x_m",
                Axis::Y => "y_m",
                Axis::Theta => "theta_rad",
                Axis::Z | Axis::Height => continue,
            };
            let largest =
                self.drafts.iter().flat_map(|d| &d.values[*value]).fold(0.0, |m: f64, v| m.max(v.abs()));
            let factor = match (axis, unit) {
                (_, Some(unit)) => unit.factor(),
                (Axis::Theta, None) if largest > MAX_ANGLE_RAD => {
                    self.notes
                        .push(format!("angles have no unit; values up to {} imply degrees", digits(largest)));
                    std::f64::consts::PI / 180.0
                }
                (Axis::Theta, None) => 1.0,
                (_, None) => known.map_or(1.0, |s| s.factor()),
            };
            let from = self.used[*value].0.raw.clone();
            out.push(Target { value: *value, from, name: name.to_owned(), factor, offset: 0.0 });
        }
        out
    }
}

/// Finds the vertical coordinate: its index in `axes`, and whether it grows downwards.
///
/// `accelerations` are those of the coordinates, m/s². A coordinate called height is preferred, then the one with the
/// largest acceleration of free fall, then z, y and x.
fn vertical_from_fall(axes: &[Coordinate], accelerations: &[Option<f64>]) -> (usize, bool) {
    let falls = |i: &usize| accelerations[*i].is_some_and(is_fall);
    let size = |i: &usize| accelerations[*i].unwrap_or(0.0).abs();
    let by_name = [Axis::Height, Axis::Z, Axis::Y, Axis::X];
    let named = by_name.iter().find_map(|axis| axes.iter().position(|(_, a, _)| a == axis));
    let height = axes.iter().position(|(_, a, _)| *a == Axis::Height);
    let falling = (0..axes.len()).filter(falls).max_by(|a, b| size(a).total_cmp(&size(b)));
    let vertical = height.or(falling).or(named).unwrap_or(0);
    (vertical, accelerations[vertical].is_some_and(|a| is_fall(a) && a > 0.0))
}

/// Frame rate, Hz, that a comment in a file states; `None` without one.
fn rate_in_comment(comment: &str) -> Option<f64> {
    let text = comment.to_lowercase();
    if !["fps", "hz", "frame rate", "framerate", "frames per second"].iter().any(|word| text.contains(word)) {
        return None;
    }
    let numbers =
        text.split(|c: char| !(c.is_ascii_digit() || c == '.')).filter_map(|n| n.parse::<f64>().ok());
    { numbers }.find(|rate| (1.0..1e6).contains(rate))
}
