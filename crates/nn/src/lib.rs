//! Layers, losses, optimiser, checkpoints and PyTorch weight exchange.
