//! Calibration, residuals, structure tests and the search for missing effects.
