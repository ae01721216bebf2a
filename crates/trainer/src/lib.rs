//! The DCVRNN, the model classes, the training loop, metrics and tables.
