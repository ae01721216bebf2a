//! Dense tensors, a reverse-mode tape and fused sequence kernels.
