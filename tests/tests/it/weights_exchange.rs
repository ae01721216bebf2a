//! Contract: weights are exchanged with PyTorch through safetensors, with PyTorch's names, shapes and
//! layouts. A file that does not fit is rejected with one precise message and changes nothing. New weights
//! are drawn as in PyTorch: uniform within 1 / sqrt(hidden) for a GRU and 1 / sqrt(inputs) for an affine
//! layer, the same for the same seed.

use augsim_data::random_stream;
use augsim_nn::weights::{WeightsError, encode, import};
use augsim_nn::{Gru, Linear, Mlp, Params};
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Parameters of a network of one GRU and one affine layer.
fn net(seed: u64) -> Params<f32> {
    let mut params = Params::new(random_stream(seed, "init", 0));
    Gru::new(&mut params, "gru", 3, 4, 2);
    Linear::new(&mut params, "out", 4, 2);
    params
}

fn folder() -> (TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap_or_else(|e| panic!("{e}"));
    let path = dir.path().join("net.safetensors");
    (dir, path)
}

fn write(path: &Path, params: &Params<f32>) {
    std::fs::write(path, ok(encode(params))).unwrap_or_else(|e| panic!("{e}"));
}

fn ok<R>(result: Result<R, WeightsError>) -> R {
    result.unwrap_or_else(|e| panic!("{e}"))
}

fn read(path: &Path) -> Vec<u8> {
    std::fs::read(path).unwrap_or_else(|e| panic!("{e}"))
}

/// Rewrites a safetensors file; `f` changes or drops each tensor `(name, type, shape, bytes)`.
fn rewrite(
    path: &Path,
    f: impl Fn(String, Dtype, Vec<usize>, Vec<u8>) -> Option<(String, Dtype, Vec<usize>, Vec<u8>)>,
) {
    let bytes = read(path);
    let file = SafeTensors::deserialize(&bytes).unwrap_or_else(|e| panic!("{e}"));
    let tensors: Vec<_> = file
        .iter()
        .filter_map(|(name, v)| f(name.to_owned(), v.dtype(), v.shape().to_vec(), v.data().to_vec()))
        .collect();
    let views = tensors.iter().map(|(name, dtype, extents, data)| {
        (name, TensorView::new(*dtype, extents.clone(), data).unwrap_or_else(|e| panic!("{e}")))
    });
    let bytes = safetensors::serialize(views, None).unwrap_or_else(|e| panic!("{e}"));
    std::fs::write(path, bytes).unwrap_or_else(|e| panic!("{e}"));
}

/// Asserts the whole error message of an import (without the path), and that the parameters are unchanged.
fn refused(path: &Path, text: &str) {
    let mut params = net(2);
    let before = params.clone();
    let error = match import(path, &mut params) {
        Ok(()) => panic!("accepted; expected: {text}"),
        Err(e) => e.to_string(),
    };
    assert_eq!(error, format!("{}: {text}", path.display()));
    assert_eq!(params, before);
}

#[test]
fn a_file_holds_pytorchs_names_extents_and_little_endian_floats() {
    let (_dir, path) = folder();
    let params = net(1);
    write(&path, &params);
    let bytes = read(&path);
    let file = SafeTensors::deserialize(&bytes).unwrap_or_else(|e| panic!("{e}"));
    let mut found: Vec<_> = file.iter().map(|(name, v)| (name, v.shape().to_vec())).collect();
    found.sort();
    let expected: [(&str, &[usize]); 10] = [
        ("gru.bias_hh_l0", &[12]),
        ("gru.bias_hh_l1", &[12]),
        ("gru.bias_ih_l0", &[12]),
        ("gru.bias_ih_l1", &[12]),
        ("gru.weight_hh_l0", &[12, 4]),
        ("gru.weight_hh_l1", &[12, 4]),
        ("gru.weight_ih_l0", &[12, 3]),
        ("gru.weight_ih_l1", &[12, 4]),
        ("out.bias", &[2]),
        ("out.weight", &[2, 4]),
    ];
    assert_eq!(found, expected.map(|(name, extents)| (name, extents.to_vec())));
    for (name, _, values) in params.iter() {
        let view = file.tensor(name).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(view.dtype(), Dtype::F32);
        let stored: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(view.data(), stored, "{name}");
    }
}

#[test]
fn the_layers_of_a_perceptron_are_named_as_in_a_torch_sequential() {
    let mut params = Params::<f32>::new(random_stream(1, "init", 0));
    Mlp::new(&mut params, "step", &[5, 4, 3]);
    let names: Vec<_> = params.iter().map(|(name, extents, _)| (name.to_owned(), extents.to_vec())).collect();
    let expected = [
        ("step.0.weight", vec![4, 5]),
        ("step.0.bias", vec![4]),
        ("step.2.weight", vec![3, 4]),
        ("step.2.bias", vec![3]),
    ];
    assert_eq!(names, expected.map(|(name, extents)| (name.to_owned(), extents)));
}

#[test]
fn weights_come_back_bit_for_bit_and_doubles_are_read_too() {
    let (_dir, path) = folder();
    let params = net(1);
    write(&path, &params);
    let mut back = net(2);
    assert_ne!(back.values(), params.values());
    ok(import(&path, &mut back));
    assert_eq!(back.values(), params.values());

    // As `torch.float64` would have been written.
    rewrite(&path, |name, _, extents, data| {
        let (chunks, _) = data.as_chunks::<4>();
        let data = chunks.iter().flat_map(|c| f64::from(f32::from_le_bytes(*c)).to_le_bytes()).collect();
        Some((name, Dtype::F64, extents, data))
    });
    let mut back = net(2);
    ok(import(&path, &mut back));
    assert_eq!(back.values(), params.values());
}

#[test]
fn a_file_that_does_not_fit_is_refused_whole() {
    let (_dir, path) = folder();
    refused(&path, "No such file or directory (os error 2)");

    let written = || write(&path, &net(1));
    written();
    rewrite(&path, |name, dtype, extents, data| (name != "out.bias").then_some((name, dtype, extents, data)));
    let available = "gru.bias_hh_l0, gru.bias_hh_l1, gru.bias_ih_l0, gru.bias_ih_l1, gru.weight_hh_l0, \
                     gru.weight_hh_l1, gru.weight_ih_l0, gru.weight_ih_l1, out.weight";
    refused(&path, &format!("parameter `out.bias` is missing; the file holds {available}"));

    written();
    rewrite(&path, |name, dtype, extents, data| {
        let name = name.replace("out.", "head.");
        Some((name, dtype, extents, data))
    });
    refused(&path, "tensor `head.bias` does not belong to this net");

    written();
    rewrite(&path, |name, dtype, mut extents, data| {
        if name == "out.weight" {
            extents.reverse();
        }
        Some((name, dtype, extents, data))
    });
    refused(&path, "`out.weight` is [4, 2] of F32, but the net needs [2, 4] of F32 or F64");

    written();
    rewrite(&path, |name, dtype, extents, data| {
        let dtype = if name == "out.bias" { Dtype::I32 } else { dtype };
        Some((name, dtype, extents, data))
    });
    refused(&path, "`out.bias` is [2] of I32, but the net needs [2] of F32 or F64");
}

#[test]
fn a_damaged_file_is_refused() {
    let (_dir, path) = folder();
    write(&path, &net(1));
    let bytes = read(&path);
    for cut in [0, 4, 20, bytes.len() - 1] {
        std::fs::write(&path, &bytes[..cut]).unwrap_or_else(|e| panic!("{e}"));
        let mut params = net(2);
        let text = import(&path, &mut params).map_or_else(|e| e.to_string(), |()| String::new());
        let start = format!("{}: not a usable safetensors file: ", path.display());
        assert!(text.starts_with(&start), "cut at {cut}: {text}");
        assert_eq!(params, net(2));
    }
}

#[test]
fn fresh_weights_are_drawn_as_pytorch_draws_them() {
    let (inputs, hidden) = (7, 100);
    let mut params = Params::<f64>::new(random_stream(5, "init", 0));
    Gru::new(&mut params, "gru", inputs, hidden, 2);
    Linear::new(&mut params, "out", inputs, hidden);
    for (name, _, values) in params.iter() {
        let fan = if name.starts_with("gru") { hidden } else { inputs };
        let bound = 1.0 / (fan as f64).sqrt();
        let n = values.len() as f64;
        let largest = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        assert!(largest <= bound, "{name} leaves its bound");
        // The largest of n uniform |w| is below (1 - 20 / n) of the bound with probability e^-20.
        assert!(largest >= bound * (1.0 - 20.0 / n), "{name} keeps far from its bound");
        // Mean 0 with standard error bound / sqrt(3 n); mean square bound^2 / 3 with standard error
        // bound^2 sqrt(4 / 45 / n). Five of them are met by one seed in a million.
        let mean = values.iter().sum::<f64>() / n;
        assert!(mean.abs() <= 5.0 * bound / (3.0 * n).sqrt(), "{name} has mean {mean}");
        let square = values.iter().map(|v| v * v).sum::<f64>() / n / (bound * bound);
        assert!((square - 1.0 / 3.0).abs() <= 5.0 * (4.0 / 45.0 / n).sqrt(), "{name}: {square}");
    }
}

#[test]
fn the_seed_decides_the_weights() {
    assert_eq!(net(1), net(1));
    assert_ne!(net(1).values(), net(2).values());
}
