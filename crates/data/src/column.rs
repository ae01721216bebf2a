//! A named numeric column with its unit.

use crate::error::ColumnError;
use crate::unit::Unit;
use std::fmt;

/// Header name of the trajectory identifier.
pub const TRAJECTORY: &str = "trajectory";
/// Header name of the sample time, s.
pub const TIME: &str = "t_s";
/// Header name of the text label that trajectories may carry (which ball, which surface).
pub const GROUP: &str = "group";

/// Most characters of a column name: names are printed in tables, pages and messages.
const LONGEST_NAME: usize = 256;

/// Name and unit of a numeric column; the name ends in the unit (`height_m`, `velocity_m_s`).
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Column {
    name: String,
    unit: Unit,
}

impl Column {
    /// Column called `name`, with the unit its suffix states.
    ///
    /// ```
    /// use augsim_data::Column;
    /// assert_eq!(Column::new("damping_N_s_per_m")?.unit().symbol(), "N s/m");
    /// let error = Column::new("height").unwrap_err().to_string();
    /// assert!(error.contains("height"), "{error}"); // a name without a unit is refused
    /// # Ok::<(), augsim_data::ColumnError>(())
    /// ```
    ///
    /// # Errors
    /// The name is not made of at most 256 ASCII letters, digits and underscores, is one of the three names the
    /// long form reserves, or ends in no known unit.
    pub fn new(name: &str) -> Result<Self, ColumnError> {
        check_name(name)?;
        let unit =
            Unit::of_column_name(name).ok_or_else(|| ColumnError::UnknownUnit { name: name.into() })?;
        Self::with_unit(name, unit)
    }

    /// Column called `name`, whose unit is known from elsewhere: a model says so.
    ///
    /// # Errors
    /// The errors of [`Column::new`], but for the unit.
    pub fn with_unit(name: &str, unit: Unit) -> Result<Self, ColumnError> {
        check_name(name)?;
        Ok(Column { name: name.to_owned(), unit })
    }

    /// Name, unit suffix included.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Unit of every value in the column.
    pub fn unit(&self) -> Unit {
        self.unit
    }
}

/// Refuses names that are malformed or reserved.
fn check_name(name: &str) -> Result<(), ColumnError> {
    let well_formed = name.len() <= LONGEST_NAME
        && name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if !well_formed {
        return Err(ColumnError::Malformed { name: name.into() });
    }
    if [TRAJECTORY, TIME, GROUP].contains(&name) {
        return Err(ColumnError::Reserved { name: name.into() });
    }
    Ok(())
}

impl fmt::Display for Column {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}
