//! Trajectories with named columns and units: readers, writers, splits, normalisation.
