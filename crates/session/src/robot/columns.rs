//! Finds the columns of a joint log: position, speed, torque, current and command of each joint.

use augsim_data::{Column, Unit};

/// What a column of a joint log measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Signal {
    /// Measured position of the joint, rad or m.
    Position,
    /// Measured speed of the joint, rad/s or m/s.
    Speed,
    /// Torque or force of the drive, N m or N.
    Torque,
    /// Current of the drive, A.
    Current,
    /// Commanded position, rad or m, or commanded speed, rad/s or m/s.
    Command,
}

/// Words in the name of a column that mark a commanded position.
const COMMAND_WORDS: [&str; 12] = [
    "command",
    "cmd",
    "commanded",
    "desired",
    "des",
    "target",
    "reference",
    "ref",
    "setpoint",
    "goal",
    "demand",
    "soll",
];

/// Columns of one joint, by index into the columns of the log.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct JointColumns {
    pub position: Option<usize>,
    pub speed: Option<usize>,
    pub torque: Option<usize>,
    pub current: Option<usize>,
    pub command: Option<usize>,
}

impl JointColumns {
    fn slot(&mut self, signal: Signal) -> &mut Option<usize> {
        match signal {
            Signal::Position => &mut self.position,
            Signal::Speed => &mut self.speed,
            Signal::Torque => &mut self.torque,
            Signal::Current => &mut self.current,
            Signal::Command => &mut self.command,
        }
    }
}

/// What a column measures, from its unit and the words of its name; `None` for any other quantity.
fn signal(column: &Column) -> Option<Signal> {
    let unit =
        |text: &str| Unit::parse(text).is_some_and(|unit| unit.dimensions() == column.unit().dimensions());
    let is_command = words(column.name()).iter().any(|word| COMMAND_WORDS.contains(&word.as_str()));
    let is_angle = column.unit() == Unit::RADIAN;
    match () {
        () if (is_angle || unit("m")) && is_command => Some(Signal::Command),
        () if is_angle || unit("m") => Some(Signal::Position),
        () if is_command && (unit("m/s") || unit("1/s")) => Some(Signal::Command),
        () if is_command => None,
        () if unit("m/s") || unit("1/s") => Some(Signal::Speed),
        () if unit("N m") || unit("N") => Some(Signal::Torque),
        () if unit("A") => Some(Signal::Current),
        () => None,
    }
}

/// Words of a column's name in lower case, without digits at their ends.
fn words(name: &str) -> Vec<String> {
    let word = |w: &str| w.trim_end_matches(|c: char| c.is_ascii_digit()).to_lowercase();
    name.split('_').map(word).collect()
}

/// First whole number in a column's name; `None` if it has none.
fn number(name: &str) -> Option<usize> {
    let digits = name.find(|c: char| c.is_ascii_digit())?;
    let rest = &name[digits..];
    let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    rest[..end].parse().ok()
}

/// Numbers at the ends of the joints' names; `None` if a name has none, or if two are equal.
fn joint_numbers(joints: &[String]) -> Option<Vec<usize>> {
    let at_end = |name: &String| {
        let digits = name.len() - name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        name[name.len() - digits..].parse().ok()
    };
    let numbers = joints.iter().map(at_end).collect::<Option<Vec<usize>>>()?;
    let distinct: std::collections::BTreeSet<usize> = numbers.iter().copied().collect();
    (distinct.len() == numbers.len()).then_some(numbers)
}

/// Assigns the columns of a log to the joints with these names.
///
/// A column belongs to the joint whose name is in its own name. Other columns are numbered: they belong to the joint with
/// the same number at the end of its name, if all joints have one, or else to the joints in their order. A single column of
/// a kind belongs to the only joint.
pub(super) fn assign(columns: &[Column], joints: &[String]) -> Vec<JointColumns> {
    let found: Vec<(usize, Signal)> =
        columns.iter().enumerate().filter_map(|(i, column)| Some((i, signal(column)?))).collect();
    let mut assigned = vec![JointColumns::default(); joints.len()];
    let lower: Vec<String> = joints.iter().map(|name| name.to_lowercase()).collect();
    for signal in [Signal::Position, Signal::Speed, Signal::Torque, Signal::Current, Signal::Command] {
        let of_kind: Vec<usize> = found.iter().filter(|(_, s)| *s == signal).map(|(i, _)| *i).collect();
        let numbers: Vec<usize> = of_kind.iter().filter_map(|i| number(columns[*i].name())).collect();
        let first = numbers.iter().min();
        let by_number = joint_numbers(joints).filter(|joints| joints.iter().all(|n| numbers.contains(n)));
        for &index in &of_kind {
            let name = columns[index].name().to_lowercase();
            // The longest name wins: `arm_10` before `arm_1`.
            let named =
                (0..joints.len()).filter(|j| name.contains(&lower[*j])).max_by_key(|j| lower[*j].len());
            let numbered = || {
                let found = number(&name)?;
                match &by_number {
                    Some(joints) => joints.iter().position(|n| *n == found),
                    None => first.map(|first| found - first),
                }
            };
            let only = || (of_kind.len() == 1 && joints.len() == 1).then_some(0);
            let joint = named.or_else(numbered).or_else(only);
            if let Some(joint) = joint.filter(|j| *j < joints.len()) {
                assigned[joint].slot(signal).get_or_insert(index);
            }
        }
    }
    assigned
}

#[cfg(test)]
mod tests {
    //! Contract: columns are found by the joint's name or by number, from 0 or from 1.
    use super::*;

    fn columns(names: &[&str]) -> Vec<Column> {
        names.iter().map(|name| Column::new(name).unwrap()).collect()
    }

    fn joints(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    #[test]
    fn numbered_columns_belong_to_the_joints_in_order() {
        let log = columns(&["q0_rad", "q1_rad", "dq0_rad_s", "dq1_rad_s", "tau0_N_m", "tau1_N_m"]);
        let found = assign(&log, &joints(&["shoulder", "elbow"]));
        assert_eq!((found[0].position, found[0].speed, found[0].torque), (Some(0), Some(2), Some(4)));
        assert_eq!((found[1].position, found[1].speed, found[1].torque), (Some(1), Some(3), Some(5)));
    }

    #[test]
    fn the_number_of_a_joint_counts_before_its_place() {
        let log = columns(&["q1_rad", "q2_rad", "tau1_N_m", "tau2_N_m"]);
        let found = assign(&log, &joints(&["joint2"]));
        assert_eq!((found[0].position, found[0].torque), (Some(1), Some(3)));
        // Joints whose numbers the columns do not have are taken in order.
        let found = assign(&log, &joints(&["joint_11", "joint_12"]));
        assert_eq!((found[0].position, found[1].position), (Some(0), Some(1)));
    }

    #[test]
    fn names_of_joints_come_before_numbers() {
        let log = columns(&["elbow_2_rad", "shoulder_1_rad", "current_shoulder_A"]);
        let found = assign(&log, &joints(&["shoulder", "elbow"]));
        assert_eq!((found[0].position, found[0].current), (Some(1), Some(2)));
        assert_eq!(found[1].position, Some(0));
    }

    #[test]
    fn a_commanded_angle_is_no_measurement() {
        let log = columns(&["command_rad", "angle_rad"]);
        let found = assign(&log, &joints(&["servo"]));
        assert_eq!((found[0].command, found[0].position), (Some(0), Some(1)));
    }
}
