//! Which part each column plays, by its name.

use super::Reading;
use super::heading::{Heading, Measures, Scale};
use super::unrecognised::Unrecognised;
use crate::column::{Column, GROUP};

/// A coordinate, before it is known which way is up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Axis {
    X,
    Y,
    Z,
    /// A height that is called so.
    Height,
    PusherX,
    PusherY,
    Theta,
}

impl Axis {
    /// Whether it is a coordinate of what moves, and not of a rod.
    pub fn is_position(self) -> bool {
        matches!(self, Axis::X | Axis::Y | Axis::Z | Axis::Height)
    }
}

/// Role of a column.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Part {
    /// The time; its unit where that is known.
    Time(Option<Scale>),
    Trajectory,
    Group,
    /// A coordinate; its unit where that is known.
    Axis(Axis, Option<Scale>),
    /// A column that keeps or gets this name, and the factor that brings it there.
    Named(String, f64),
    /// Left out.
    Extra,
}

const TIME: [&str; 15] = [
    "time",
    "t",
    "zeit",
    "temps",
    "tiempo",
    "tempo",
    "timestamp",
    "timestamps",
    "stamp",
    "clock",
    "sec",
    "secs",
    "seconds",
    "elapsed",
    "ms",
];
const FRAME: [&str; 7] = ["frame", "frames", "index", "idx", "sample", "image", "bild"];
const TRAJECTORY: [&str; 28] = [
    "trajectory",
    "traj",
    "run",
    "trial",
    "throw",
    "drop",
    "toss",
    "experiment",
    "exp",
    "track",
    "test",
    "take",
    "rep",
    "repetition",
    "shot",
    "series",
    "sequence",
    "seq",
    "episode",
    "recording",
    "particle",
    "versuch",
    "wurf",
    "lauf",
    "messung",
    "durchgang",
    "essai",
    "push",
];
/// Words that number things.
const COUNTING: [&str; 9] = ["id", "no", "nr", "number", "num", "n", "name", "idx", "index"];
/// Words that say of what, or that it is a coordinate.
const OF_WHAT: [&str; 22] = [
    "pos",
    "position",
    "coord",
    "coordinate",
    "coordinates",
    "ball",
    "object",
    "obj",
    "marker",
    "center",
    "centre",
    "com",
    "mass",
    "a",
    "point",
    "raw",
    "tracked",
    "slider",
    "block",
    "world",
    "location",
    "tracker",
];
const HEIGHT: [&str; 10] =
    ["height", "h", "altitude", "elevation", "hoehe", "höhe", "hauteur", "altura", "altezza", "vertical"];
const ROD: [&str; 8] = ["pusher", "rod", "tip", "probe", "finger", "robot", "ee", "effector"];
const ANGLE: [&str; 8] = ["theta", "angle", "yaw", "orientation", "rotation", "winkel", "heading", "th"];

fn is(words: &[&str], of: &[&str]) -> bool {
    !words.is_empty() && words.iter().all(|w| of.contains(w))
}

/// The parts of columns with these headings.
///
/// # Errors
/// A column that the user names is not there.
pub(super) fn roles(headings: &[Heading], reading: &Reading) -> Result<Vec<Part>, Unrecognised> {
    let mut parts: Vec<Part> = headings.iter().map(|_| Part::Extra).collect();
    let mut taken = vec![false; headings.len()];
    let place = |name: &str, option: &'static str| {
        let same = |h: &&Heading| h.raw == name || h.raw.eq_ignore_ascii_case(name);
        headings
            .iter()
            .position(|h| same(&h))
            .or_else(|| headings.iter().position(|h| h.words.join("_") == name.to_lowercase()))
            .ok_or_else(|| {
                let columns = headings.iter().map(|h| h.raw.clone()).collect();
                Unrecognised::NoSuchColumn { option, name: name.to_owned(), columns }
            })
    };
    if let Some(time) = &reading.time {
        let (name, unit) = match time.rsplit_once(':') {
            Some((name, unit)) if Scale::of(unit).is_some() => (name, Scale::of(unit)),
            _ => (time.as_str(), None),
        };
        let at = place(name, "--time")?;
        let own = headings[at].unit.filter(|u| matches!(u.measures, Measures::Time | Measures::Frames));
        (parts[at], taken[at]) = (Part::Time(unit.or(own).or(named_frames(&headings[at]))), true);
    }
    if let Some(name) = &reading.trajectory {
        let at = place(name, "--trajectory")?;
        (parts[at], taken[at]) = (Part::Trajectory, true);
    }
    for renamed in &reading.columns {
        let at = place(&renamed.from, "--columns")?;
        let unit = renamed.unit.as_deref().map_or(headings[at].unit, Scale::given);
        (parts[at], taken[at]) = (Part::Named(renamed.to.clone(), unit.map_or(1.0, |u| u.factor)), true);
    }
    let has = |parts: &[Part], part: &dyn Fn(&Part) -> bool| parts.iter().any(part);
    // The times first, because frames are times only where there are no others.
    for (i, h) in headings.iter().enumerate() {
        let timed = has(&parts, &|p| matches!(p, Part::Time(_)));
        if let Some(part) = time_of(h).filter(|_| !taken[i] && !timed) {
            (parts[i], taken[i]) = (part, true);
        }
    }
    if !has(&parts, &|p| matches!(p, Part::Time(_))) {
        let frames = headings.iter().position(|h| named_frames(h).is_some());
        if let Some(i) = frames.filter(|i| !taken[*i]) {
            (parts[i], taken[i]) = (Part::Time(named_frames(&headings[i])), true);
        }
    }
    let rods = headings.iter().any(|h| h.words.iter().any(|w| ROD.contains(&w.as_str())));
    for (i, h) in headings.iter().enumerate().filter(|(i, _)| !taken[*i]) {
        let part = part_of(h, rods, reading.columns.is_empty());
        let again = match &part {
            Part::Trajectory | Part::Group => parts.contains(&part),
            Part::Axis(axis, _) => has(&parts, &|p| matches!(p, Part::Axis(other, _) if other == axis)),
            Part::Named(name, _) => has(&parts, &|p| matches!(p, Part::Named(other, _) if other == name)),
            _ => false,
        };
        if !again {
            parts[i] = part;
        }
    }
    Ok(parts)
}

fn named_frames(h: &Heading) -> Option<Scale> {
    let words: Vec<&str> = h.words.iter().map(String::as_str).collect();
    let counted = words.iter().all(|w| FRAME.contains(w) || COUNTING.contains(w));
    (counted && words.iter().any(|w| FRAME.contains(w)))
        .then_some(Scale { measures: Measures::Frames, factor: 1.0 })
}

fn time_of(h: &Heading) -> Option<Part> {
    let words: Vec<&str> = h.words.iter().map(String::as_str).collect();
    if !is(&words, &TIME) {
        return None;
    }
    let written = match words[..] {
        ["sec" | "secs" | "seconds"] => Scale::of("s"),
        ["ms"] => Scale::of("ms"),
        _ => h.unit,
    };
    match written {
        Some(unit) if !matches!(unit.measures, Measures::Time | Measures::Frames) => None,
        unit => Some(Part::Time(unit)),
    }
}

fn part_of(h: &Heading, rods: bool, axes: bool) -> Part {
    let words: Vec<&str> = h.words.iter().map(String::as_str).collect();
    if h.raw == GROUP {
        return Part::Group;
    }
    let counted: Vec<&str> = words.iter().copied().filter(|w| !COUNTING.contains(w)).collect();
    if h.unit.is_none() && (is(&counted, &TRAJECTORY) && counted.len() == 1 || words == ["id"]) {
        return Part::Trajectory;
    }
    let bare: Vec<&str> = words.iter().copied().filter(|w| !OF_WHAT.contains(w)).collect();
    let length = h.unit.is_none_or(|u| matches!(u.measures, Measures::Length | Measures::Pixels));
    let rod: Vec<&str> = bare.iter().copied().filter(|w| !ROD.contains(w)).collect();
    let axis = match (&bare[..], &rod[..]) {
        (["x"] | ["horizontal"], _) => Some(Axis::X),
        (["y"], _) => Some(Axis::Y),
        (["z"], _) => Some(Axis::Z),
        (one, _) if is(one, &HEIGHT) => Some(Axis::Height),
        (all, ["x"]) if all.len() > 1 => Some(Axis::PusherX),
        (all, ["y"]) if all.len() > 1 => Some(Axis::PusherY),
        _ => None,
    };
    if let Some(axis) = axis.filter(|_| axes && length) {
        return Part::Axis(axis, h.unit);
    }
    let turns = h.unit.is_none_or(|u| u.measures == Measures::Angle);
    if axes && rods && turns && is(&bare, &ANGLE) {
        return Part::Axis(Axis::Theta, h.unit);
    }
    // Names of the long form keep their meaning: masses, radii, spins, flags.
    match Column::new(&h.raw) {
        Ok(column) => Part::Named(column.name().to_owned(), 1.0),
        Err(_) => Part::Extra,
    }
}
