//! Converter of `mit-push`: the published MIT Push files (Yu, Bauza, Fazeli and Rodriguez, IROS 2016).

use super::Converted;
use crate::error::DataError;
use crate::push::{TrialName, read_push_dataset};
use std::collections::BTreeSet;
use std::path::Path;

/// Part of the TOML model file: radius and friction of the rod from the paper, and measurement noise.
const CONTACT: &str = "\
contact_friction = { nominal = 0.25, min = 0.0, max = 1.0 }
rod_radius_m = { nominal = 0.00475, frozen = true }

[sensor]
position_sd_m = 0.0003
angle_sd_rad = 0.002
";

/// Converts MIT Push files: a folder, a zip archive or a single file.
///
/// There is a model file where all trials push the same object over the same support.
pub(super) fn convert(path: &Path) -> Result<Converted, DataError> {
    let data = read_push_dataset(path)?;
    let mut objects = BTreeSet::new();
    for t in data.trajectories() {
        objects.insert(match TrialName::parse(Path::new(t.id()))? {
            TrialName::Motion(motion) => Some((motion.surface, motion.shape)),
            TrialName::Preliminary { .. } => None,
        });
    }
    let model_toml = match objects.into_iter().collect::<Vec<_>>()[..] {
        [Some((_, shape))] => {
            let name = shape.name();
            Some(format!(
                "scenario = \"push\"\nobject = \"{name}\"\n\n[parameters]\n\
                 c_m = {{ nominal = {}, min = 0.005, max = 0.1 }}\n{CONTACT}",
                shape.uniform_c_m()
            ))
        }
        _ => None,
    };
    Ok(Converted { data, model_toml })
}
