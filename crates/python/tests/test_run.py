"""Contract: weights, samples and bands from Python are those of the command line, for any batch and number of threads."""

import json
import threading

import numpy as np
import pytest

import augsim

ITERATIONS = 20
PAPER = "pybullet-ball"


@pytest.fixture(scope="module")
def drops(augsim_command, tmp_path_factory):
    """Simulated drops."""
    path = tmp_path_factory.mktemp("drops") / "drops.csv"
    augsim_command("simulate", "--trajectories", 24, "--seed", 7, "--out", path)
    return path


@pytest.fixture(scope="module", params=["hybrid-plus", "hybrid", "neural"])
def both(request, drops, augsim_command, tmp_path_factory):
    """A run from Python, and the folder of the same run from the command line."""
    run = augsim.train(augsim.read(drops), request.param, PAPER, iterations=ITERATIONS, seed=3, progress=False)
    folder = tmp_path_factory.mktemp("run")
    words = ["train", "--data", drops, "--pybullet-ball", "--recipe", request.param, "--iterations", ITERATIONS, "--seed", 3]
    augsim_command(*words, "--out", folder)
    return run, folder


def test_the_weights_are_those_of_the_command_line(both, tmp_path):
    run, folder = both
    saved = run.save(tmp_path / "run")
    for name in ("weights.safetensors", "checkpoint.bin"):
        assert (saved / name).read_bytes() == (folder / name).read_bytes(), name
    with pytest.raises(augsim.UsageError, match="already contains a run"):
        run.save(saved)
    again = augsim.Run(saved)
    assert (again.recipe, again.iterations, again.seed) == (run.recipe, ITERATIONS, 3)


def test_bands_are_those_of_the_command_line(both, drops, augsim_command, tmp_path):
    run, folder = both
    augsim_command("predict", folder, "--data", drops, "--samples", 10, "--out", tmp_path / "bands.csv")
    theirs, ours = augsim.read(tmp_path / "bands.csv"), run.predict(drops, samples=10)
    assert ours.columns == theirs.columns and len(ours) == 24
    for name in theirs.columns:
        np.testing.assert_array_equal(ours[name], theirs[name])


def test_samples_do_not_depend_on_the_batch(both, drops):
    run, _ = both
    starts = [[next(iter(t[c])) for c in run.columns] for t in augsim.read(drops)]
    time = augsim.read(drops).lengths[0]
    all_at_once = run.sample(starts, time, 10)
    assert all_at_once.shape == (24, 10, time, 2) and all_at_once.dtype == np.float32
    alone = run.sample(starts[5], time, 10, first=5)
    np.testing.assert_array_equal(alone[0], all_at_once[5])
    # The mean of the samples is that of the band.
    band = list(run.predict(drops, samples=10))[5]["mean_height_m"]
    np.testing.assert_allclose(alone[0, :, :, 0].astype(float).mean(axis=0), band, rtol=1e-12)


def test_another_seed_draws_anew(both, drops):
    run, _ = both
    start = [4.5, 0.0]
    own, same, other = (run.sample(start, 30, 4, seed=seed) for seed in (None, 3, 4))
    np.testing.assert_array_equal(own, same)
    assert not np.array_equal(own, other)


def test_eight_threads_at_once_get_what_one_gets(both):
    run, _ = both
    expected = run.sample([4.5, 0.0], 60, 20)
    made = [None] * 8

    def work(place):
        for _ in range(5):
            made[place] = run.sample([4.5, 0.0], 60, 20)

    threads = [threading.Thread(target=work, args=(place,)) for place in range(8)]
    [t.start() for t in threads]
    [t.join() for t in threads]
    for one in made:
        np.testing.assert_array_equal(one, expected)


@pytest.mark.parametrize(
    ("start", "actions", "n", "sentence"),
    [
        ([1.0], 10, 1, "give \\[batch, 2\\]: height_m, velocity_m_s"),
        ([[1.0, np.nan]], 10, 1, "start: holds NaN"),
        ([1.0, 0.0], np.zeros((10, 3)), 1, "give \\[1, time, 0\\]"),
        ([1.0, 0.0], 0, 1, "at least one"),
        ([1.0, 0.0], 10, 0, "give at least one"),
        ([1.0, 0.0], 10, 2**60, "AUGSIM_LIMIT_CELLS"),
        (np.zeros((0, 2)), 10, 1, "at least one"),
        ("high", 10, 1, "give numbers"),
    ],
)
def test_wrong_arguments_are_rejected(both, start, actions, n, sentence):
    with pytest.raises(augsim.Error, match=sentence):
        both[0].sample(start, actions, n)


def test_progress_and_refusals_of_training(drops):
    told = []
    augsim.train(drops, "hybrid-plus", PAPER, iterations=20, progress=lambda step, share: told.append((step, share)))
    assert told[-1][0].startswith("iteration 20 of 20, loss ") and told[-1][1] == 1.0
    with pytest.raises(augsim.UsageError, match="recipe magic"):
        augsim.train(drops, "magic", PAPER, progress=False)
    with pytest.raises(augsim.UsageError, match="iterations = 0"):
        augsim.train(drops, "hybrid", PAPER, iterations=0, progress=False)
    with pytest.raises(augsim.DataError, match="velocity_m_s"):
        columns = augsim.read(drops).to_dict()
        del columns["velocity_m_s"]
        augsim.train(columns, "hybrid", PAPER, progress=False)
    with pytest.raises(augsim.UsageError, match="no physics model is given"):
        augsim.train(drops, progress=False)


def test_a_network_corrects_a_discovered_model(drops, augsim_command, tmp_path):
    model = tmp_path / "model.toml"
    text = augsim.Model('scenario = "ball"\n[parameters]\ngravity_m_s2 = 9.81\nrestitution = 0.65\n').to_toml()
    model.write_text(text)
    run = augsim.train(drops, "hybrid", tmp_path, iterations=10, seed=2, progress=False)
    words = ["train", "--data", drops, "--recipe", "hybrid", "--residual-of", tmp_path, "--iterations", 10, "--seed", 2]
    summary = augsim_command(*words, "--out", tmp_path / "run", "--json")
    assert json.loads(summary)["parameters"] == run.parameters
    saved = run.save(tmp_path / "saved")
    assert (saved / "checkpoint.bin").read_bytes() == (tmp_path / "run" / "checkpoint.bin").read_bytes()
