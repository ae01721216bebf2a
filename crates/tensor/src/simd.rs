//! Choice of the instruction set: the best of this machine, or the one that `AUGSIM_SIMD` requests.

use crate::TensorError;
use crate::kernels::vector::Vector;
use pulp::{Scalar, Simd, WithSimd};
use std::sync::OnceLock;

/// Environment variable that forces an instruction set: `scalar`, `v3` (AVX2, FMA), `v4` (AVX-512) or `neon`.
pub const VARIABLE: &str = "AUGSIM_SIMD";

/// Instruction sets that the kernels support, from the slowest to the fastest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// No SIMD instructions; runs on every machine.
    Scalar,
    /// Neon: 4 lanes of f32 (AArch64).
    Neon,
    /// AVX2 and FMA: 8 lanes of f32.
    V3,
    /// AVX-512: 16 lanes of f32.
    V4,
}

impl Level {
    /// The instruction sets of this machine, from the slowest to the fastest; the last is the default.
    pub fn available() -> impl Iterator<Item = Level> {
        [Level::Scalar, Level::Neon, Level::V3, Level::V4].into_iter().filter(|l| l.is_supported())
    }

    /// Name of the instruction set, as a value of [`VARIABLE`].
    pub fn name(self) -> &'static str {
        match self {
            Level::Scalar => "scalar",
            Level::Neon => "neon",
            Level::V3 => "v3",
            Level::V4 => "v4",
        }
    }

    /// The instruction set that [`VARIABLE`] requests, or the fastest of this machine if it is not set.
    ///
    /// # Errors
    /// [`TensorError::Simd`] if the variable is not the name of a level of this machine.
    pub fn requested() -> Result<Level, TensorError> {
        let best = Level::available().last().unwrap_or(Level::Scalar);
        let Some(text) = std::env::var_os(VARIABLE) else { return Ok(best) };
        let found = Level::available().find(|l| text.to_str() == Some(l.name()));
        found.ok_or_else(|| {
            let names = Level::available().map(Level::name).collect();
            TensorError::Simd { found: text.to_string_lossy().into_owned(), available: names }
        })
    }

    /// The instruction set that this process uses, which is determined at the first call.
    ///
    /// If [`Level::requested`] is an error this is the fastest level; programs report that error when they
    /// start.
    pub fn current() -> Level {
        static CURRENT: OnceLock<Level> = OnceLock::new();
        *CURRENT.get_or_init(|| {
            Level::requested().unwrap_or_else(|_| Level::available().last().unwrap_or(Level::Scalar))
        })
    }

    fn is_supported(self) -> bool {
        match self {
            Level::Scalar => true,
            #[cfg(target_arch = "x86_64")]
            Level::V3 => pulp::x86::V3::try_new().is_some(),
            #[cfg(target_arch = "x86_64")]
            Level::V4 => pulp::x86::V4::try_new().is_some(),
            #[cfg(target_arch = "aarch64")]
            Level::Neon => pulp::aarch64::Neon::try_new().is_some(),
            _ => false,
        }
    }

    /// Runs a plain loop, which the compiler vectorises for this instruction set.
    #[inline]
    pub(crate) fn vectorised<R>(self, f: impl FnOnce() -> R) -> R {
        self.dispatch(f)
    }

    /// Runs a kernel with this instruction set for `lanes` sequences.
    ///
    /// Up to 8 sequences fill at most half of an AVX-512 vector. They run faster on AVX2 vectors, compiled
    /// for AVX-512 to have its 32 registers.
    #[inline]
    pub(crate) fn run<K: Kernel>(self, lanes: usize, kernel: K) {
        match (self, lanes) {
            #[cfg(target_arch = "x86_64")]
            (Level::V3, _) => {
                if let Some(simd) = pulp::x86::V3::try_new() {
                    return Simd::vectorize(simd, KernelOn::<_, _, false>(kernel, simd));
                }
            }
            #[cfg(target_arch = "x86_64")]
            (Level::V4, 0..=8) => {
                if let (Some(wide), Some(narrow)) = (pulp::x86::V4::try_new(), pulp::x86::V3::try_new()) {
                    return Simd::vectorize(wide, KernelOn::<_, _, true>(kernel, narrow));
                }
            }
            #[cfg(target_arch = "x86_64")]
            (Level::V4, _) => {
                if let Some(simd) = pulp::x86::V4::try_new() {
                    return Simd::vectorize(simd, KernelOn::<_, _, true>(kernel, simd));
                }
            }
            #[cfg(target_arch = "aarch64")]
            (Level::Neon, _) => {
                if let Some(simd) = pulp::aarch64::Neon::try_new() {
                    return Simd::vectorize(simd, KernelOn::<_, _, true>(kernel, simd));
                }
            }
            _ => {}
        }
        Simd::vectorize(Scalar, KernelOn::<_, _, false>(kernel, Scalar));
    }

    /// Runs `op` with this instruction set, or without SIMD if the machine does not have it.
    #[inline]
    fn dispatch<Op: WithSimd>(self, op: Op) -> Op::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Level::V3 => {
                if let Some(simd) = pulp::x86::V3::try_new() {
                    return Simd::vectorize(simd, op);
                }
            }
            #[cfg(target_arch = "x86_64")]
            Level::V4 => {
                if let Some(simd) = pulp::x86::V4::try_new() {
                    return Simd::vectorize(simd, op);
                }
            }
            #[cfg(target_arch = "aarch64")]
            Level::Neon => {
                if let Some(simd) = pulp::aarch64::Neon::try_new() {
                    return Simd::vectorize(simd, op);
                }
            }
            _ => {}
        }
        Simd::vectorize(Scalar, op)
    }
}

/// A numerical kernel, generic over the SIMD vector type.
///
/// `MANY_REGISTERS` is true if there are 32 vector registers, false if there are 16.
pub(crate) trait Kernel {
    /// Runs the kernel.
    ///
    /// Implementations must be inlined into the function that is compiled for the instruction set.
    fn run<S: Vector, const MANY_REGISTERS: bool>(self, simd: S);
}

/// A kernel with its vector type, which may be narrower than the widest of the instruction set.
struct KernelOn<K, N, const MANY_REGISTERS: bool>(K, N);

impl<K: Kernel, N: Vector, const MANY_REGISTERS: bool> WithSimd for KernelOn<K, N, MANY_REGISTERS> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.0.run::<N, MANY_REGISTERS>(self.1);
    }
}
