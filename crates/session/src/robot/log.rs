//! Filters a joint log for the inverse formulation: positions, speeds, accelerations and torques on one clock.

use super::draft::DraftJoint;
use super::fault::RobotFault;
use augsim_data::{Column, Dataset, Trajectory, Unit};
use augsim_robot::signals::{Log, Preparation, Segment, choose, prepare};

/// The log of the joints in one trajectory.
pub(super) struct JointLog {
    pub trajectory: String,
    pub group: Option<String>,
    pub log: Log,
}

/// Filters all trajectories with the preparation that the longest one asks for; returns the data and the preparation.
pub(super) fn prepared(
    log: &Dataset,
    logs: &[JointLog],
    joints: &[DraftJoint<'_>],
    notes: &mut Vec<String>,
) -> Result<(Dataset, Preparation), RobotFault> {
    let duration =
        |log: &JointLog| log.log.time_s.last().zip(log.log.time_s.first()).map_or(0.0, |(b, a)| b - a);
    let longest = logs.iter().max_by(|a, b| duration(a).total_cmp(&duration(b)));
    let Some(longest) = longest else { return Err(RobotFault::EmptyLog) };
    let fault = |trajectory: &str, error| RobotFault::Signals {
        trajectory: trajectory.to_owned(),
        file: log.origin().to_string(),
        error,
    };
    let preparation = choose(&longest.log).map_err(|e| fault(&longest.trajectory, e))?;
    let mut trajectories = Vec::new();
    let mut too_short = 0;
    for one in logs {
        let segments = match prepare(&one.log, &preparation) {
            Ok(segments) => segments,
            Err(_) if logs.len() > 1 => {
                too_short += 1;
                continue;
            }
            Err(e) => return Err(fault(&one.trajectory, e)),
        };
        let is_single = segments.len() == 1;
        for (index, segment) in segments.into_iter().enumerate() {
            let id =
                if is_single { one.trajectory.clone() } else { format!("{}-{}", one.trajectory, index + 1) };
            let mut trajectory = Trajectory::new(id, segment.time_s.clone(), series(&segment, joints.len()))?;
            if let Some(group) = &one.group {
                trajectory = trajectory.with_group(group.clone())?;
            }
            trajectories.push(trajectory);
        }
    }
    if too_short > 0 {
        notes.push(format!(
            "{too_short} of {} trajectories are left out, because they are too short for the filter of {:.2} Hz",
            logs.len(),
            preparation.cutoff_hz
        ));
    }
    Ok((Dataset::new(columns(joints)?, trajectories)?, preparation))
}

/// Columns of a filtered log: position, speed and acceleration of every joint, then the torques, which have fewer samples.
fn columns(joints: &[DraftJoint<'_>]) -> Result<Vec<Column>, RobotFault> {
    let mut columns = Vec::new();
    let unit = |text: &str| Unit::parse(text).unwrap_or(Unit::DIMENSIONLESS);
    for joint in joints {
        let base = joint.position_unit();
        columns.push(Column::with_unit(&joint.position, unit(base))?);
        columns.push(Column::with_unit(&joint.speed, unit(&format!("{base}/s")))?);
        columns.push(Column::with_unit(&joint.acceleration, unit(&format!("{base}/s^2")))?);
    }
    for joint in joints {
        columns.push(Column::with_unit(&joint.torque_name(), unit(joint.torque_unit()))?);
    }
    Ok(columns)
}

/// Values of a segment in the order of [`columns`]; a torque is missing where it was not sampled.
fn series(segment: &Segment, joints: usize) -> Vec<Vec<f64>> {
    let of = |rows: &[Vec<f64>], joint: usize| rows.iter().map(|row| row[joint]).collect::<Vec<f64>>();
    let motion = (0..joints).flat_map(|joint| {
        [of(&segment.position, joint), of(&segment.speed, joint), of(&segment.acceleration, joint)]
    });
    let torque = |joint: usize| {
        let mut values = vec![f64::NAN; segment.time_s.len()];
        segment
            .torque_rows
            .iter()
            .zip(&segment.torque)
            .for_each(|(row, torque)| values[*row] = torque[joint]);
        values
    };
    motion.chain((0..joints).map(torque)).collect()
}

/// Root mean square of a column; 0 if the data lack it.
pub(super) fn rms(data: &Dataset, column: &str) -> f64 {
    let Ok(series) = data.series(column) else { return 0.0 };
    let (sum, count) = series.flatten().fold((0.0, 0_usize), |(sum, n), x| (sum + x * x, n + 1));
    (sum / count.max(1) as f64).sqrt()
}
