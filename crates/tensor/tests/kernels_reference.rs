//! Contract: at every level of this machine the SIMD kernels agree with their reference kernels, with and
//! without an initial state. Shapes include incomplete vectors in batch and features, empty extents and
//! single elements. The reference runs in f64, so the tolerance is that of single-precision sums, about eps *
//! sqrt(T * B).
//!
//! The file is part of this crate and not of the workspace's `tests/`, so that `.ci/neon` has to build only
//! one small crate for an emulated AArch64 machine.

use augsim_tensor::kernels::*;
use augsim_tensor::simd::Level;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

fn normals_f32(seed: u64, n: usize) -> Vec<f32> {
    let rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    Distribution::<f64>::sample_iter(StandardNormal, rng).take(n).map(|v| v as f32).collect()
}

/// The tests below compare the available levels, so they would pass if NEON were not detected.
#[cfg(target_arch = "aarch64")]
#[test]
fn neon_is_available() {
    assert_eq!(Level::available().collect::<Vec<_>>(), [Level::Scalar, Level::Neon]);
}

fn wide(x: &[f32]) -> Vec<f64> {
    x.iter().map(|v| f64::from(*v)).collect()
}

fn assert_close(what: &str, got: &[f32], want: &[f64], tolerance: f64) {
    assert_eq!(got.len(), want.len());
    for (i, (g, w)) in got.iter().zip(want).enumerate() {
        let bound = tolerance * w.abs().max(1.0);
        assert!((f64::from(*g) - w).abs() <= bound, "{what}[{i}]: SIMD {g}, reference {w}");
    }
}

/// Operands of the forward and the backward pass of a GRU layer, for comparing kernels.
struct GruOperands<T> {
    dims: GruDims,
    w_ih: Vec<T>,
    w_hh: Vec<T>,
    b_ih: Vec<T>,
    b_hh: Vec<T>,
    x: Vec<T>,
    h0: Vec<T>,
    dy: Vec<T>,
    dx_fresh: bool,
    dx_inputs: usize,
}

/// Results of the forward and the backward pass of a GRU layer.
struct GruResults<T> {
    y: Vec<T>,
    saved: Vec<T>,
    /// Gradients of all operands, in the order of [`GRADIENTS`].
    grads: Vec<Vec<T>>,
}

const GRADIENTS: [&str; 6] = ["dx", "dh0", "dw_ih", "dw_hh", "db_ih", "db_hh"];

impl GruOperands<f32> {
    /// Draws random operands; with an initial state, the last third of the inputs is not differentiated.
    fn draw(dims: GruDims, seed: u64, initial: bool) -> Self {
        let GruDims { time, input, hidden, batch } = dims;
        let draw = |k: u64, n: usize, scale: f32| -> Vec<f32> {
            normals_f32(seed * 100 + k, n).into_iter().map(|v| v * scale).collect()
        };
        GruOperands {
            dims,
            w_ih: draw(1, 3 * hidden * input, 0.4),
            w_hh: draw(2, 3 * hidden * hidden, 0.4),
            b_ih: draw(3, 3 * hidden, 0.4),
            b_hh: draw(4, 3 * hidden, 0.4),
            x: draw(5, time * input * batch, 1.0),
            h0: if initial { draw(6, hidden * batch, 1.0) } else { Vec::new() },
            dy: draw(7, time * hidden * batch, 1.0),
            dx_fresh: initial,
            dx_inputs: if initial { input - input / 3 } else { input },
        }
    }

    fn wide(&self) -> GruOperands<f64> {
        let [w_ih, w_hh, b_ih, b_hh, x, h0, dy] =
            [&self.w_ih, &self.w_hh, &self.b_ih, &self.b_hh, &self.x, &self.h0, &self.dy].map(|v| wide(v));
        let Self { dims, dx_fresh, dx_inputs, .. } = *self;
        GruOperands { dims, w_ih, w_hh, b_ih, b_hh, x, h0, dy, dx_fresh, dx_inputs }
    }
}

impl<T: Copy + From<f32>> GruOperands<T> {
    /// Runs forward and backward pass with `scratch_len` elements of scratch memory, NaN before each pass.
    fn run(
        &self,
        scratch_len: usize,
        forward: impl Fn(GruForward<'_, T>, &mut [T]),
        backward: impl Fn(GruBackward<'_, T>, &mut [T]),
    ) -> GruResults<T> {
        let Self { dims, w_ih, w_hh, b_ih, b_hh, x, h0, dy, dx_fresh, dx_inputs } = self;
        let (dims, dx_fresh, dx_inputs) = (*dims, *dx_fresh, *dx_inputs);
        let constant = |n: usize, value: f32| vec![T::from(value); n];
        let states = dims.time * dims.hidden * dims.batch;
        let (mut y, mut saved) = (constant(states, 0.0), constant(4 * states, 0.0));
        let mut scratch = constant(scratch_len, f32::NAN);
        let weights = GruWeights { w_ih, w_hh, b_ih, b_hh };
        forward(GruForward { dims, weights, x, h0, y: &mut y, saved: &mut saved }, &mut scratch);
        // Gradients are added to existing values, except fresh ones.
        let mut grads: Vec<Vec<T>> = [x, h0, w_ih, w_hh, b_ih, b_hh].map(|v| constant(v.len(), 0.5)).into();
        let [dx, dh0, dw_ih, dw_hh, db_ih, db_hh] = &mut grads[..] else { unreachable!() };
        scratch.fill(T::from(f32::NAN));
        let args = GruBackward {
            dims,
            weights,
            x,
            h0,
            y: &y,
            saved: &saved,
            dy,
            dx,
            dx_fresh,
            dx_inputs,
            dh0,
            dw_ih,
            dw_hh,
            db_ih,
            db_hh,
        };
        backward(args, &mut scratch);
        // Gradients of inputs that are not differentiated are not defined.
        for (index, v) in grads[0].iter_mut().enumerate() {
            if index / dims.batch % dims.input >= dx_inputs {
                *v = T::from(0.0);
            }
        }
        GruResults { y, saved, grads }
    }
}

fn check_gru(level: Level, dims: GruDims, seed: u64, initial: bool) {
    let GruDims { input, hidden, .. } = dims;
    let operands = GruOperands::draw(dims, seed, initial);
    let found = operands.run(
        gru_simd::scratch(input, hidden),
        |args, scratch| gru_simd::forward_at(level, args, scratch),
        |args, scratch| gru_simd::backward_at(level, args, scratch),
    );
    let expected = operands.wide().run(
        gru_reference::scratch(input, hidden),
        gru_reference::forward,
        gru_reference::backward,
    );
    let label = format!("{level:?} {dims:?} h0 {initial}");
    assert_close(&format!("{label} y"), &found.y, &expected.y, 5e-6);
    assert_close(&format!("{label} saved"), &found.saved, &expected.saved, 2e-5);
    for ((name, found), expected) in GRADIENTS.iter().zip(&found.grads).zip(&expected.grads) {
        assert_close(&format!("{label} {name}"), found, expected, 1e-4);
    }
}

#[test]
fn gru_simd_equals_the_reference() {
    let shapes = [
        (7, 3, 4, 5),
        (1, 1, 1, 1),
        (9, 10, 16, 16),
        (20, 8, 16, 100),
        (17, 5, 7, 33),
        (33, 16, 32, 17),
        (12, 2, 3, 64),
        (8, 13, 9, 1),
        (0, 3, 4, 5),
        (4, 0, 5, 6),
        (4, 3, 5, 0),
        (40, 10, 16, 4),
        (33, 3, 28, 4),
        (70, 0, 4, 4),
        (0, 2, 8, 4),
    ];
    for (i, (time, input, hidden, batch)) in shapes.into_iter().enumerate() {
        for (level, initial) in Level::available().flat_map(|l| [(l, false), (l, true)]) {
            check_gru(level, GruDims { time, input, hidden, batch }, i as u64 + 1, initial);
        }
    }
}

/// Draws random extents from 1 to `limits`.
fn random_extents<const N: usize>(seed: u64, limits: [usize; N]) -> [usize; N] {
    let draws = normals_f32(seed, N);
    let mut draws = draws.into_iter();
    limits.map(|limit| ((draws.next().unwrap_or(0.0).abs() * 1e4) as usize) % limit + 1)
}

#[test]
fn gru_simd_equals_the_reference_on_random_shapes() {
    for seed in 100..120 {
        let [time, input, hidden, batch] = random_extents(seed, [70, 20, 24, 40]);
        for level in Level::available() {
            check_gru(level, GruDims { time, input, hidden, batch }, seed, seed % 2 == 0);
        }
    }
}

fn check_linear(level: Level, dims: LinearDims, seed: u64, fresh: bool, tanh: bool) {
    let LinearDims { time, input, output, batch } = dims;
    let draw = |k: u64, n: usize| normals_f32(seed * 10 + k, n);
    let (w, b) = (draw(1, output * input), draw(2, output));
    let (x, dy) = (draw(3, time * input * batch), draw(4, time * output * batch));
    let mut scratch = vec![f32::NAN; linear_simd::scratch(input, output)];
    let mut y = vec![0.0; dy.len()];
    linear_simd::forward_at(
        level,
        LinearForward { dims, w: &w, b: &b, x: &x, y: &mut y, tanh },
        &mut scratch,
    );
    let (mut dx, mut dw, mut db) = (vec![0.5; x.len()], vec![0.5; w.len()], vec![0.5; b.len()]);
    scratch.fill(f32::NAN);
    let (gx, gw, gb) = (&mut dx, &mut dw, &mut db);
    let args = LinearBackward {
        dims,
        w: &w,
        x: &x,
        y: if tanh { &y } else { &[] },
        dy: &dy,
        dx: gx,
        dx_fresh: fresh,
        dw: gw,
        db: gb,
    };
    linear_simd::backward_at(level, args, &mut scratch);

    let [w, b, x, dy] = [&w, &b, &x, &dy].map(|v| wide(v));
    let mut y64 = vec![0.0; dy.len()];
    linear_reference::forward(LinearForward { dims, w: &w, b: &b, x: &x, y: &mut y64, tanh });
    let (mut dx64, mut dw64, mut db64) = (vec![0.5; x.len()], vec![0.5; w.len()], vec![0.5; b.len()]);
    let (gx, gw, gb) = (&mut dx64, &mut dw64, &mut db64);
    let args = LinearBackward {
        dims,
        w: &w,
        x: &x,
        y: if tanh { &y64 } else { &[] },
        dy: &dy,
        dx: gx,
        dx_fresh: fresh,
        dw: gw,
        db: gb,
    };
    linear_reference::backward(args);
    for (name, got, want) in [("y", &y, &y64), ("dx", &dx, &dx64), ("dw", &dw, &dw64), ("db", &db, &db64)] {
        assert_close(&format!("{level:?} {dims:?} {name}"), got, want, 1e-4);
    }
}

#[test]
fn linear_simd_equals_the_reference() {
    let shapes = [
        [7, 3, 4, 5],
        [1, 1, 1, 1],
        [40, 16, 8, 100],
        [17, 13, 9, 33],
        [3, 4, 2, 0],
        [0, 2, 2, 3],
        [5, 0, 3, 4],
        [6, 3, 0, 4],
    ];
    let random = (200..220).map(|seed| random_extents(seed, [70, 40, 40, 40]));
    for (seed, [time, input, output, batch]) in shapes.into_iter().chain(random).enumerate() {
        for level in Level::available() {
            let dims = LinearDims { time, input, output, batch };
            check_linear(level, dims, seed as u64, seed % 2 == 0, false);
            check_linear(level, dims, seed as u64, seed % 2 == 0, true);
        }
    }
}

/// Running a sequence in several calls with packed weights equals running it whole, bit for bit.
#[test]
fn packed_gru_continues_from_its_last_state() {
    for (level, batch) in Level::available().flat_map(|l| [1, 5, 16, 19].map(|b| (l, b))) {
        let (time, input, hidden) = (45, 6, 10);
        let (w_ih, w_hh) = (normals_f32(1, 3 * hidden * input), normals_f32(2, 3 * hidden * hidden));
        let (b_ih, b_hh) = (normals_f32(3, 3 * hidden), normals_f32(4, 3 * hidden));
        let weights = GruWeights { w_ih: &w_ih, w_hh: &w_hh, b_ih: &b_ih, b_hh: &b_hh };
        let x = normals_f32(5, time * input * batch);
        let mut want = vec![0.0; time * hidden * batch];
        let mut scratch = vec![f32::NAN; gru_simd::scratch(input, hidden)];
        let dims = GruDims { time, input, hidden, batch };
        let args = GruForward { dims, weights, x: &x, h0: &[], y: &mut want, saved: &mut [] };
        gru_simd::forward_at(level, args, &mut scratch);

        let gru = PackedGru::new(level, weights, input, hidden);
        let (mut h, mut got) = (vec![0.0; hidden * batch], vec![0.0; want.len()]);
        let mut scratch = vec![f32::NAN; gru.scratch()];
        for (start, end) in [(0, 1), (1, 2), (2, 40), (40, 45)] {
            let x = &x[start * input * batch..end * input * batch];
            gru.run(x, &mut h, &mut got[start * hidden * batch..end * hidden * batch], &mut scratch);
        }
        assert_eq!(got, want, "{level:?}, batch {batch}");
        assert_eq!(h, want[(time - 1) * hidden * batch..]);
    }
}

/// Pointwise kernels agree with the reference in f64, for every length of the incomplete last vector.
#[test]
fn pointwise_kernels_equal_the_reference() {
    for n in 0..40 {
        let [mq, mp, g] = [1, 2, 3].map(|k| normals_f32(k + 10 * n as u64, n));
        let [sq, sp] = [4, 5].map(|k| -> Vec<f32> {
            normals_f32(k + 10 * n as u64, n).into_iter().map(|v| 0.3 + v.abs()).collect()
        });
        let [mq64, mp64, g64, sq64, sp64] = [&mq, &mp, &g, &sq, &sp].map(|v| wide(v));
        let (mut y, mut y64) = (vec![0.0; n], vec![0.0; n]);
        let (mut d, mut d64) = (vec![vec![0.5; n]; 4], vec![vec![0.5; n]; 4]);
        let check = |what: &str, y: &[f32], y64: &[f64]| assert_close(&format!("{what}, {n}"), y, y64, 3e-5);

        pointwise::gaussian_kl([&mq, &sq, &mp, &sp], &mut y);
        pointwise_reference::gaussian_kl([&mq64[..], &sq64, &mp64, &sp64], &mut y64);
        check("kl", &y, &y64);
        pointwise::gaussian_nll([&mq, &mp, &sp], &mut y);
        pointwise_reference::gaussian_nll([&mq64[..], &mp64, &sp64], &mut y64);
        check("nll", &y, &y64);
        pointwise::softplus(&mq, &mut y);
        pointwise_reference::softplus(&mq64, &mut y64);
        check("softplus", &y, &y64);
        // Gradients are first added to existing values, then, as fresh ones, overwritten.
        for fresh in [false, true] {
            let [a, b, c, e] = &mut d[..] else { unreachable!() };
            pointwise::gaussian_kl_vjp([&mq, &sq, &mp, &sp], &g, [a, b, c, e], [fresh; 4]);
            let [a, b, c, e] = &mut d64[..] else { unreachable!() };
            [&mut *a, &mut *b, &mut *c, &mut *e].into_iter().filter(|_| fresh).for_each(|d| d.fill(0.0));
            pointwise_reference::gaussian_kl_vjp([&mq64[..], &sq64, &mp64, &sp64], &g64, [a, b, c, e]);
            let [a, b, c, _] = &mut d[..] else { unreachable!() };
            pointwise::gaussian_nll_vjp([&mq, &mp, &sp], &g, [a, b, c], [false, fresh, false]);
            pointwise::softplus_vjp(&mq, &g, c, fresh);
            let [a, b, c, _] = &mut d64[..] else { unreachable!() };
            [&mut *b].into_iter().filter(|_| fresh).for_each(|d| d.fill(0.0));
            pointwise_reference::gaussian_nll_vjp([&mq64[..], &mp64, &sp64], &g64, [a, b, c]);
            [&mut *c].into_iter().filter(|_| fresh).for_each(|d| d.fill(0.0));
            pointwise_reference::softplus_vjp(&mq64, &g64, c);
        }
        for (d, d64) in d.iter().zip(&d64) {
            check("gradients", d, d64);
        }
    }
}

/// A NaN of a weight or a state must reach the loss, so that a diverged training run is noticed.
///
/// Vector minimum and maximum may drop a NaN, depending on the order of their operands.
#[test]
fn gru_simd_propagates_nan() {
    let dims = GruDims { time: 3, input: 2, hidden: 5, batch: 19 };
    let draw = |seed: u64, n: usize| normals_f32(seed, n);
    let (w_ih, w_hh, b) = (draw(1, 30), draw(2, 75), draw(3, 15));
    let mut x = draw(4, 3 * 2 * 19);
    let (step, sequence) = (1, 17);
    x[(step * 2 + 1) * 19 + sequence] = f32::NAN;
    let mut scratch = vec![0.0; gru_simd::scratch(2, 5)];
    let weights = GruWeights { w_ih: &w_ih, w_hh: &w_hh, b_ih: &b, b_hh: &b };
    for level in Level::available() {
        let mut y = vec![0.0; 3 * 5 * 19];
        let args = GruForward { dims, weights, x: &x, h0: &[], y: &mut y, saved: &mut [] };
        gru_simd::forward_at(level, args, &mut scratch);
        for (i, y) in y.iter().enumerate() {
            let affected = i % 19 == sequence && i / (5 * 19) >= step;
            assert_eq!(y.is_nan(), affected, "{level:?}: element {i} is {y}");
        }
    }
}
