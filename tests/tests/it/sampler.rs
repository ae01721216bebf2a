//! Contract: sampling without a tape equals sampling on the autodiff tape (same kernels, equal up to rounding
//! of the fused head), in blocks of any length, single steps too. A sampler that is reset starts anew. The
//! result is a function of conditions and random draws only.

use augsim_data::random_stream;
use augsim_nn::{Bound, Params};
use augsim_tensor::{Tape, TensorError};
use augsim_tests::random::normals_f32;
use augsim_trainer::nets::{Dcvrnn, DcvrnnSampler, DcvrnnSizes, Decoder};

fn ok<R>(result: Result<R, TensorError>) -> R {
    result.unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn a_sampler_is_the_tape_in_blocks_of_any_length() {
    let (time, state, condition, latent) = (50, 2, 4, 4);
    for (decoder, lanes) in [(Decoder::Fixed, 16), (Decoder::Learned, 5), (Decoder::Learned, 1)] {
        let mut params = Params::<f32>::new(random_stream(1, "init", 0));
        let sizes = DcvrnnSizes { state, condition, latent, hidden: 16, layers: 2, sd_floor: 1e-3, decoder };
        let net = Dcvrnn::new(&mut params, sizes);
        let (u, eps) = (normals_f32(2, time * condition * lanes), normals_f32(3, time * latent * lanes));

        let (mut tape, mut bound) = (Tape::new(), Bound::default());
        ok(params.bind_frozen(&mut tape, &mut bound));
        let taped_u = ok(tape.constant(&[time, condition, lanes], &u));
        let taped_eps = ok(tape.constant(&[time, latent, lanes], &eps));
        let (mean, sd) = ok(net.generate(&mut tape, &bound, taped_u, taped_eps));
        let (want, want_sd) = (tape.value(mean), sd.map(|sd| tape.value(sd)));

        let mut sampler = DcvrnnSampler::new(&net, &params, lanes, 32);
        for block in [1, 7, 32] {
            sampler.reset();
            let (mut got, mut got_sd) = (Vec::new(), Vec::new());
            let rows = u.chunks(block * condition * lanes).zip(eps.chunks(block * latent * lanes));
            for (u, eps) in rows {
                let predicted = sampler.advance(u, eps);
                got.extend_from_slice(predicted.mean);
                got_sd.extend_from_slice(predicted.sd.unwrap_or(&[]));
            }
            let close = |got: &[f32], want: &[f32]| {
                assert_eq!(got.len(), want.len());
                let worst = got.iter().zip(want).map(|(g, w)| (g - w).abs()).fold(0.0, f32::max);
                assert!(worst <= 2e-6, "{decoder:?}, {lanes} lanes, blocks of {block}: off by {worst}");
            };
            close(&got, want);
            close(&got_sd, want_sd.unwrap_or(&[]));
        }
    }
}
