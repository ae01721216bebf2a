//! A named numeric column with its unit.

use crate::error::ColumnError;
use crate::unit::Unit;
use std::fmt;

/// Header name of the column of trajectory identifiers.
pub const TRAJECTORY: &str = "trajectory";
/// Header name of the column of sample times, s.
pub const TIME: &str = "t_s";
/// Header name of the column of group labels of trajectories (such as the ball or the surface).
pub const GROUP: &str = "group";

/// Maximum length of a column name, because names are printed in tables, pages and messages.
const MAX_NAME_LENGTH: usize = 256;

/// Name and unit of a numeric column; the name ends in the unit (`height_m`, `velocity_m_s`).
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Column {
    name: String,
    unit: Unit,
}

impl Column {
    /// Creates the column `name` with the unit that the suffix of the name states.
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
    /// The name has other characters than ASCII letters, digits and underscores, more than 256 of them or no
    /// letter at the beginning; it is one of the three reserved names; or it does not end in a known unit.
    pub fn new(name: &str) -> Result<Self, ColumnError> {
        check_name(name)?;
        let unit =
            Unit::from_column_name(name).ok_or_else(|| ColumnError::UnknownUnit { name: name.into() })?;
        Self::with_unit(name, unit)
    }

    /// Creates the column `name` with a given unit, such as the one that a model declares.
    ///
    /// # Errors
    /// The errors of [`Column::new`] other than an unknown unit.
    pub fn with_unit(name: &str, unit: Unit) -> Result<Self, ColumnError> {
        check_name(name)?;
        Ok(Column { name: name.to_owned(), unit })
    }

    /// Name of the column, including the unit suffix.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Unit of the column's values.
    pub fn unit(&self) -> Unit {
        self.unit
    }
}

/// Checks that a column name is well formed and not reserved (`trajectory`, `t_s`, `group`).
fn check_name(name: &str) -> Result<(), ColumnError> {
    let well_formed = name.len() <= MAX_NAME_LENGTH
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
