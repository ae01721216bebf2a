//! The instruction set that the kernels run on: the best of this machine, or the one that
//! `AUGSIM_SIMD` asks for.

use crate::TensorError;
use crate::kernels::vector::Vector;
use pulp::{Scalar, Simd, WithSimd};
use std::sync::OnceLock;

/// Environment variable that forces a level: `scalar`, `v3` (AVX2 and FMA), `v4` (AVX-512) or `neon`.
pub const VARIABLE: &str = "AUGSIM_SIMD";

/// Instruction sets with kernels of their own, from the slowest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// One value at a time, whatever the machine.
    Scalar,
    /// 4 lanes (AArch64).
    Neon,
    /// 8 lanes: AVX2 and FMA.
    V3,
    /// 16 lanes: AVX-512.
    V4,
}

impl Level {
    /// All levels that this machine can run, from the slowest; the last is the default.
    pub fn available() -> impl Iterator<Item = Level> {
        [Level::Scalar, Level::Neon, Level::V3, Level::V4].into_iter().filter(|l| l.runs_here())
    }

    /// Name, as [`VARIABLE`] takes it.
    pub fn name(self) -> &'static str {
        match self {
            Level::Scalar => "scalar",
            Level::Neon => "neon",
            Level::V3 => "v3",
            Level::V4 => "v4",
        }
    }

    /// The level that [`VARIABLE`] asks for, or the machine's best where it is not set.
    ///
    /// # Errors
    /// [`TensorError::Simd`] if it names no level that this machine can run.
    pub fn requested() -> Result<Level, TensorError> {
        let best = Level::available().last().unwrap_or(Level::Scalar);
        let Some(text) = std::env::var_os(VARIABLE) else { return Ok(best) };
        let found = Level::available().find(|l| text.to_str() == Some(l.name()));
        found.ok_or_else(|| {
            let names = Level::available().map(Level::name).collect();
            TensorError::Simd { found: text.to_string_lossy().into_owned(), available: names }
        })
    }

    /// The level of this process: [`Level::requested`] when first asked, the best level where that is an
    /// error (the program reports it at its start).
    pub fn current() -> Level {
        static CURRENT: OnceLock<Level> = OnceLock::new();
        *CURRENT.get_or_init(|| {
            Level::requested().unwrap_or_else(|_| Level::available().last().unwrap_or(Level::Scalar))
        })
    }

    fn runs_here(self) -> bool {
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

    /// Runs a loop compiled for this level.
    #[inline]
    pub(crate) fn vectorised<R>(self, f: impl FnOnce() -> R) -> R {
        self.dispatch(f)
    }

    /// Runs a kernel at this level for that many sequences: where they fill at most half of a wide vector,
    /// narrow vectors cost less (with the wide level's registers).
    #[inline]
    pub(crate) fn run<K: Kernel>(self, lanes: usize, kernel: K) {
        match (self, lanes) {
            #[cfg(target_arch = "x86_64")]
            (Level::V3, _) => {
                if let Some(simd) = pulp::x86::V3::try_new() {
                    return Simd::vectorize(simd, On::<_, _, false>(kernel, simd));
                }
            }
            #[cfg(target_arch = "x86_64")]
            (Level::V4, 0..=8) => {
                if let (Some(wide), Some(narrow)) = (pulp::x86::V4::try_new(), pulp::x86::V3::try_new()) {
                    return Simd::vectorize(wide, On::<_, _, true>(kernel, narrow));
                }
            }
            #[cfg(target_arch = "x86_64")]
            (Level::V4, _) => {
                if let Some(simd) = pulp::x86::V4::try_new() {
                    return Simd::vectorize(simd, On::<_, _, true>(kernel, simd));
                }
            }
            #[cfg(target_arch = "aarch64")]
            (Level::Neon, _) => {
                if let Some(simd) = pulp::aarch64::Neon::try_new() {
                    return Simd::vectorize(simd, On::<_, _, true>(kernel, simd));
                }
            }
            _ => {}
        }
        Simd::vectorize(Scalar, On::<_, _, false>(kernel, Scalar));
    }

    /// Runs `op` at this level, or the scalar one where the machine has no such level.
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

/// A kernel, generic over the vector. `ROOMY`: there are 32 vector registers, not 16.
pub(crate) trait Kernel {
    /// Does the work. To be inlined into the function that is compiled for the instruction set.
    fn run<S: Vector, const ROOMY: bool>(self, simd: S);
}

/// A kernel on vectors that the dispatched level has; they may be narrower than its own.
struct On<K, N, const ROOMY: bool>(K, N);

impl<K: Kernel, N: Vector, const ROOMY: bool> WithSimd for On<K, N, ROOMY> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.0.run::<N, ROOMY>(self.1);
    }
}
