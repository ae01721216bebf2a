//! Checks that recorded pushes can be calibrated at all, and the messages for those that cannot.

use super::path::{Motion, Path, Recorded};
use super::{PushDeclaration, ROD_RADIUS_INDEX, World};
use augsim_system::{Objection, Parameter, Record};
use thiserror::Error;

/// Largest gap between rod and outline, m, that counts as contact.
///
/// Markers, clocks and outlines are off by a few millimetres.
const MAX_CONTACT_GAP_M: f64 = 5e-3;
/// Minimum number of third differences of poses, over all pushes, to estimate the noise.
const MIN_NOISE_SAMPLES: usize = 20;

/// Reason why recorded pushes cannot be calibrated.
#[derive(Debug, Error)]
enum Reason {
    #[error(
        "the rod never comes nearer to {object} than {:.1} mm, so it pushes nothing; check the outline, `rod_radius_m`, the coordinate frames of rod and object, and that the recorded pose is that of the area centroid",
        1e3 * closest_m
    )]
    NoContact { object: String, closest_m: f64 },
    #[error(
        "too few consecutive poses to estimate the measurement noise; declare `position_sd_m` and `angle_sd_rad` under [sensor]"
    )]
    NoNoise,
    #[error(
        "a push has fewer than two recorded poses or rod positions; remove it or record it at a higher rate"
    )]
    TooShort,
}

/// Error for a push with too few samples.
pub(super) fn too_short() -> Objection {
    Objection::new(Reason::TooShort)
}

/// Reason why these pushes cannot be calibrated; `None` if they can.
pub(super) fn objection(
    world: &World,
    parameters: &[Parameter],
    declares: &PushDeclaration,
    records: &[Record],
) -> Option<Objection> {
    let radius = parameters.get(ROD_RADIUS_INDEX).map_or(0.0, |p| p.nominal);
    let gaps = records.iter().flat_map(|record| contact_gaps(world, radius, record));
    let closest_m = gaps.fold(f64::INFINITY, f64::min);
    if closest_m >= MAX_CONTACT_GAP_M {
        let object = world.object().name.clone();
        return Some(Objection::new(Reason::NoContact { object, closest_m }));
    }
    let differences: usize = records.iter().map(|r| r.times.len().saturating_sub(3)).sum();
    let noise_is_declared = declares.position_sd_m.is_some() && declares.angle_sd_rad.is_some();
    (differences < MIN_NOISE_SAMPLES && !noise_is_declared).then(|| Objection::new(Reason::NoNoise))
}

/// Gaps between rod and object at the measured poses of one push, m; empty for malformed records.
fn contact_gaps(world: &World, radius: f64, record: &Record) -> Vec<f64> {
    let (Some(rod), [x, y, angle]) = (record.inputs.first(), &record.values[..]) else { return Vec::new() };
    let path = match &rod.values[..] {
        [x, y] => Recorded::new(&rod.times, x, y),
        _ => None,
    };
    let Some(path) = path else { return Vec::new() };
    let gap = |k: usize| {
        let time = record.times[k];
        let rod: [f64; 2] = path.piece(time).position(time);
        let (dx, dy) = (rod[0] - x[k], rod[1] - y[k]);
        let (s, c) = angle[k].sin_cos();
        world.object().outline.nearest([c * dx + s * dy, c * dy - s * dx]).distance - radius
    };
    (0..record.times.len()).map(gap).filter(|gap| gap.is_finite()).collect()
}
