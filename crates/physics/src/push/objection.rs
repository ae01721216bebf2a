//! Why no answer can come of some pushes.

use super::path::{Motion, Path, Recorded};
use super::{PushDeclares, ROD_RADIUS, World};
use crate::model::Parameter;
use crate::system::{Objection, Record};
use thiserror::Error;

/// Rod to outline, m, within which a push counts as one with contact: markers, clocks and outlines are off by a few mm.
const CONTACT_M: f64 = 5e-3;
/// Fewest poses in a row, over all pushes, from which noise is estimated.
const FEWEST_POSES: usize = 20;

#[derive(Debug, Error)]
enum Reason {
    #[error(
        "the rod never comes nearer to {object} than {:.1} mm, so nothing is pushed; check the outline, `rod_radius_m`, the frames of rod and object, and that the pose is that of the area centroid",
        1e3 * closest_m
    )]
    NoContact { object: String, closest_m: f64 },
    #[error(
        "too few poses in a row to estimate their noise; declare `position_sd_m` and `angle_sd_rad` under [sensor]"
    )]
    NoNoise,
    #[error("too few poses of a push, or positions of its rod, were recorded")]
    TooShort,
}

/// The objection to a push of which nothing can be made.
pub(super) fn too_short() -> Objection {
    Objection::new(Reason::TooShort)
}

/// Why no answer can come of these pushes.
pub(super) fn objection(
    world: &World,
    parameters: &[Parameter],
    declares: &PushDeclares,
    records: &[Record],
) -> Option<Objection> {
    let radius = parameters.get(ROD_RADIUS).map_or(0.0, |p| p.nominal);
    let gaps = records.iter().flat_map(|record| gaps(world, radius, record));
    let closest_m = gaps.fold(f64::INFINITY, f64::min);
    if closest_m >= CONTACT_M {
        let object = world.object().name.clone();
        return Some(Objection::new(Reason::NoContact { object, closest_m }));
    }
    let differences: usize = records.iter().map(|r| r.times.len().saturating_sub(3)).sum();
    let declared = declares.position_sd_m.is_some() && declares.angle_sd_rad.is_some();
    (differences < FEWEST_POSES && !declared).then(|| Objection::new(Reason::NoNoise))
}

/// Gaps between rod and object at the measured poses, m.
fn gaps(world: &World, radius: f64, record: &Record) -> Vec<f64> {
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
