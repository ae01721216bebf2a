//! The integration tests of this workspace, in one binary: each file is a module, so that the workspace is linked once.

/// Location of measured and golden data that are not committed.
#[path = "../../support/shared_data.rs"]
mod shared_data;

/// One set of planar throws, written in twelve file layouts.
#[path = "../../support/throws_as_files.rs"]
mod throws_as_files;

// Helper: the answer of `discover` to a model and a table.
mod common;
mod declared_dry_friction;

// Tensors, gradients and nets against independent values.
mod fleets;
mod golden_pytorch;
mod gradient_operations;
mod sampler;
mod tensor_errors;
mod weights_exchange;

// Training, and predictors that see no future.
mod predictors;
mod push_training;
mod training_contract;

// Published figures.
mod paper_figures;

// Discovery on generated and sealed data.
mod characterisation;
mod discover_bad_input;
mod discover_covariates;
mod discover_empty_cells;
mod discover_frames;
mod discover_push;
mod discover_push_scatter;
mod discover_scatter;
mod discover_sealed;
mod hidden_states;
mod linear_system;
mod not_this_system;
mod own_recordings;
mod sealed_systems;
mod sealed_systems_answers;
mod sensor_or_stop;
mod traps;

// Discovery on measured data.
mod discover_measured;

// Forecasts from a few readings.
mod filter_impact;
mod filter_own;
mod filter_remainder;
mod filter_system;
mod predict_records;

// Checks of suspicious data pass good data.
mod suspicious_data_false_alarms;

// Rules of the source tree.
mod import_circles;
mod packages;
mod reading_order;
mod thresholds;
