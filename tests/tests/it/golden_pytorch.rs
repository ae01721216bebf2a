//! Contract: in f64 the networks agree with PyTorch to 1e-10: a two-layer GRU and the whole DCVRNN, with
//! outputs, loss, every gradient by name (of inputs, noise and initial states too), the generated
//! trajectories and three steps of Adam. The golden files were written by torch in f64; each says how. Both
//! sides round at 1e-16 and sums have at most a hundred terms, so 1e-10 is far above rounding and far below
//! any error of definition.

use augsim_nn::{Adam, AdamState, Bound, Gru, Params};
use augsim_tensor::{Tape, TensorError, Var};
use augsim_tests::golden::{batch_last, dims, flat, golden};
use augsim_trainer::nets::{Dcvrnn, DcvrnnSizes, Decoder, Tile};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde_json::Value;

const TOLERANCE: f64 = 1e-10;

fn ok<R>(result: Result<R, TensorError>) -> R {
    result.unwrap_or_else(|e| panic!("{e}"))
}

fn assert_close(what: &str, got: &[f64], want: &[f64]) {
    assert_eq!(got.len(), want.len(), "{what}: number of values");
    for (i, (g, w)) in got.iter().zip(want).enumerate() {
        assert!((g - w).abs() <= TOLERANCE * w.abs().max(1.0), "{what}[{i}] = {g}, PyTorch has {w}");
    }
}

fn size(file: &Value, name: &str) -> usize {
    file["shapes"][name].as_u64().map_or_else(|| panic!("shape {name}"), |n| n as usize)
}

/// Makes an empty set of network parameters.
fn store() -> Params<f64> {
    Params::new(Xoshiro256PlusPlus::seed_from_u64(0))
}

/// Sets every parameter to the golden weight of the same name (without `prefix`) and the same shape.
fn set(params: &mut Params<f64>, prefix: &str, weights: &Value) {
    let Value::Object(map) = weights else { panic!("weights are not an object") };
    assert_eq!(params.iter().count(), map.len(), "number of parameters");
    for (name, values) in map {
        let (extents, to) = params
            .get_mut(&format!("{prefix}{name}"))
            .unwrap_or_else(|| panic!("the net has no parameter {prefix}{name}"));
        assert_eq!(extents, dims(values), "{name}");
        to.copy_from_slice(&flat(values));
    }
}

/// Compares the gradient of every parameter with the golden one of the same name.
fn assert_gradients(params: &Params<f64>, tape: &Tape<f64>, bound: &Bound, prefix: &str, want: &Value) {
    let mut flat_grads = vec![0.0; params.values().len()];
    params.gather_grads(tape, bound, &mut flat_grads);
    for (name, ..) in params.iter() {
        let part = params.range_of(name, &flat_grads).unwrap_or_else(|| panic!("{name}"));
        let key = name.strip_prefix(prefix).unwrap_or(name);
        assert!(want[key].is_array(), "no golden gradient of {key}");
        assert_close(&format!("gradient of {name}"), part, &flat(&want[key]));
    }
}

/// Layer `l` of a golden `[layers, batch, hidden]` array, reordered to `[hidden, batch]`.
fn hidden_batch(v: &Value, l: usize) -> Vec<f64> {
    let (d, x) = (dims(&v[l]), flat(&v[l]));
    let (batch, hidden) = (d[0], d[1]);
    (0..hidden).flat_map(|h| (0..batch).map(move |b| b * hidden + h)).map(|at| x[at]).collect()
}

/// Records the inner product of a tensor with constants of the same shape.
fn dot(tape: &mut Tape<f64>, v: Var, with: &[f64]) -> Result<Var, TensorError> {
    let with = tape.constant(tape.shape(v).dims().to_vec().as_slice(), with)?;
    let product = tape.mul(v, with)?;
    tape.sum_all(product)
}

#[test]
fn two_layer_gru() {
    let file = golden("gru_golden.json");
    let [batch, time, input, hidden, layers] = ["B", "T", "I", "H", "layers"].map(|n| size(&file, n));
    let mut params = store();
    let gru = Gru::new(&mut params, "gru", input, hidden, layers);
    set(&mut params, "gru.", &file["weights"]);

    let (mut tape, mut bound) = (Tape::new(), Bound::default());
    ok(params.bind(&mut tape, &mut bound));
    let x = ok(tape.variable(&[time, input, batch], &batch_last(&file["x"])));
    let h0: Vec<Var> =
        (0..layers).map(|l| ok(tape.variable(&[hidden, batch], &hidden_batch(&file["h0"], l)))).collect();
    let mut states = Vec::new();
    let y = ok(gru.forward_layers(&mut tape, &bound, x, &h0, |v| states.push(v)));
    assert_close("y", tape.value(y), &batch_last(&file["y"]));

    // loss = sum(c_y y) + sum(c_h h_n) + sum(y^2) / 2.
    let mut loss = ok(dot(&mut tape, y, &batch_last(&file["c_y"])));
    for (l, states) in states.into_iter().enumerate() {
        let last = ok(tape.slice(states, 0, time - 1, time));
        assert_close("h_n", tape.value(last), &hidden_batch(&file["h_n"], l));
        let part = ok(dot(&mut tape, last, &hidden_batch(&file["c_h"], l)));
        loss = ok(tape.add(loss, part));
    }
    let square = ok(tape.mul(y, y));
    let square = ok(tape.sum_all(square));
    let square = ok(tape.scale(square, 0.5));
    loss = ok(tape.add(loss, square));
    assert_close("loss", tape.value(loss), &flat(&file["loss"]));

    ok(tape.backward(loss));
    assert_gradients(&params, &tape, &bound, "gru.", &file["grad"]);
    assert_close("gradient of x", tape.grad(x), &batch_last(&file["grad"]["x"]));
    for (l, h0) in h0.into_iter().enumerate() {
        assert_close("gradient of h0", tape.grad(h0), &hidden_batch(&file["grad"]["h0"], l));
    }
}

/// The golden DCVRNN: `(golden file, network, weights, batch size, number of times)`.
fn dcvrnn() -> (Value, Dcvrnn, Params<f64>, usize, usize) {
    let file = golden("dcvrnn_golden.json");
    let [batch, time, state, condition, latent, hidden, layers] =
        ["B", "T", "X", "U", "L", "H", "layers"].map(|n| size(&file, n));
    let mut params = store();
    let decoder = Decoder::Fixed;
    let sizes = DcvrnnSizes { state, condition, latent, hidden, layers, sd_floor: 0.0, decoder };
    let net = Dcvrnn::new(&mut params, sizes);
    set(&mut params, "", &file["weights"]);
    (file, net, params, batch, time)
}

/// Compares sums over features of a `[time, feature, batch]` tensor with a golden `[batch, time]` array.
fn assert_sums(what: &str, tape: &mut Tape<f64>, v: Var, want: &Value) {
    let sum = ok(tape.sum(v, 1));
    let (d, x) = (dims(want), flat(want));
    let (batch, time) = (d[0], d[1]);
    let want: Vec<f64> =
        (0..time).flat_map(|t| (0..batch).map(move |b| b * time + t)).map(|at| x[at]).collect();
    assert_close(what, tape.value(sum), &want);
}

#[test]
fn dcvrnn_outputs_loss_and_every_gradient() {
    let (file, net, params, batch, time) = dcvrnn();
    let sizes = net.sizes();
    let (mut tape, mut bound) = (Tape::new(), Bound::default());
    ok(params.bind(&mut tape, &mut bound));
    let inputs = [("x", sizes.state), ("u", sizes.condition), ("eps", sizes.latent)]
        .map(|(name, width)| ok(tape.variable(&[time, width, batch], &batch_last(&file[name]))));
    let passed = ok(net.pass(&mut tape, &bound, inputs));
    let outputs = [
        ("mu_z", passed.posterior.mean),
        ("sigma_z", passed.posterior.sd),
        ("mu_0", passed.prior.mean),
        ("sigma_0", passed.prior.sd),
        ("z", passed.z),
        ("mu_x", passed.mean_x),
    ];
    for (name, v) in outputs {
        assert_close(name, tape.value(v), &batch_last(&file[name]));
    }
    let (kl, rec) = ok(net.parts(&mut tape, inputs[0], passed));
    assert_sums("kl", &mut tape, kl, &file["kl"]);
    assert_sums("rec", &mut tape, rec, &file["rec"]);
    let [kl, rec] = [kl, rec].map(|v| ok(tape.sum_all(v)));
    let total = ok(tape.add(kl, rec));
    let loss = ok(tape.scale(total, 1.0 / batch as f64));
    assert_close("loss", tape.value(loss), &flat(&file["loss"]));

    ok(tape.backward(loss));
    assert_gradients(&params, &tape, &bound, "", &file["grad"]);
    for (name, v) in ["x", "u", "eps"].into_iter().zip(inputs) {
        assert_close(&format!("gradient of {name}"), tape.grad(v), &batch_last(&file["grad"][name]));
    }
}

#[test]
fn dcvrnn_generates_the_same_trajectories() {
    let (file, net, params, batch, time) = dcvrnn();
    let (mut tape, mut bound) = (Tape::new(), Bound::default());
    ok(params.bind_frozen(&mut tape, &mut bound));
    let u = ok(tape.constant(&[time, net.sizes().condition, batch], &batch_last(&file["u"])));
    let eps = ok(tape.constant(&[time, net.sizes().latent, batch], &batch_last(&file["eps"])));
    let (mean, sd) = ok(net.generate(&mut tape, &bound, u, eps));
    assert_close("generate", tape.value(mean), &batch_last(&file["generate"]));
    assert_eq!(sd, None);
}

#[test]
fn three_adam_steps_on_the_dcvrnn() {
    let (file, net, mut params, batch, time) = dcvrnn();
    let [x, u, eps] = ["x", "u", "eps"].map(|name| batch_last(&file[name]));
    let mut state = AdamState::new(params.values().len());
    let mut grads = vec![0.0; params.values().len()];
    let (mut tape, mut bound) = (Tape::new(), Bound::default());
    for want in flat(&file["adam3"]["losses"]) {
        tape.reset();
        ok(params.bind(&mut tape, &mut bound));
        let tile = Tile { time, lanes: batch, x: &x, u: &u, eps: &eps, mask: &[] };
        let loss = ok(net.loss(&mut tape, &bound, tile)).total;
        let loss = ok(tape.scale(loss, 1.0 / batch as f64));
        assert_close("loss before the step", tape.value(loss), &[want]);
        ok(tape.backward(loss));
        params.gather_grads(&tape, &bound, &mut grads);
        Adam::default().step(&mut state, params.values_mut(), &grads, 1e-3);
    }
    for (name, _, values) in params.iter() {
        let what = format!("{name} after three steps");
        assert_close(&what, values, &flat(&file["adam3"]["weights"][name]));
    }
}
