//! Reader of description files of either format.

use crate::description::Robot;
use crate::error::DescriptionError;
use crate::mjcf;
use crate::origins::Origins;
use crate::urdf;
use crate::xml::{Element, Lines, parse};

/// Reads a URDF or MJCF file, which its first element tells apart: `<robot>` or `<mujoco>`.
///
/// `file` is its name for messages.
///
/// # Errors
///
/// Those of [`crate::read_urdf`] and [`crate::read_mjcf`], and a file of another kind.
pub fn read(text: &str, file: &str) -> Result<Robot, DescriptionError> {
    read_with_origins(text, file).map(|(robot, _)| robot)
}

/// Reads a file of either format, and where in the text its links and joints are.
pub(crate) fn read_with_origins(text: &str, file: &str) -> Result<(Robot, Origins), DescriptionError> {
    let document = parse(text, file)?;
    match document.root_element().tag_name().name() {
        "robot" => urdf::read_with_origins(text, file),
        "mujoco" => mjcf::read_with_origins(text, file),
        other => {
            let lines = Lines::new(text);
            let root = Element::new(document.root_element(), file, &lines);
            let problem =
                format!("the first element is <{other}> instead of <robot> (URDF) or <mujoco> (MJCF)");
            Err(root.error(problem, "give a URDF or MJCF file"))
        }
    }
}
