"""Contract: steps match samples, arrays are not reallocated, and each thread has a separate stepper."""

import gc
import resource
import threading

import numpy as np
import pytest

import augsim
from augsim import generate


@pytest.fixture(scope="module")
def drops():
    return generate.drops(24, samples=80, seed=7)


@pytest.fixture(scope="module", params=["neural", "hybrid", "hybrid-plus"])
def run(request, drops):
    return augsim.train(drops, request.param, "pybullet-ball", iterations=10, seed=3, progress=False)


def test_generated_drops_are_those_of_the_command_line(drops, augsim_command, tmp_path):
    path = tmp_path / "drops.csv"
    augsim_command("simulate", "--trajectories", 24, "--samples", 80, "--seed", 7, "--out", path)
    np.testing.assert_array_equal(drops["height_m"], augsim.read(path)["height_m"])


def test_steps_are_those_of_samples(run):
    stepper, start, time = run.stepper(), [4.5, -0.3], 60
    path = run.sample(start, time, 1, first=5)[0, 0]
    stepper.begin(start, index=5)
    if run.recipe == "Hybrid+":
        # A sample adds one draw to each step's mean: in units of the deviation these are standard normal.
        z = [(path[t + 1] - mean) / sd for t in range(time - 1) for mean, sd in [stepper.step(path[t])]]
        assert abs(np.mean(z)) < 0.5 and 0.7 < np.std(z) < 1.3
    else:
        for t in range(1, time):
            mean, sd = stepper.step()
            np.testing.assert_array_equal(mean.astype(np.float32), path[t])
            assert not sd.any()


def test_arrays_stay_where_they_are(run):
    stepper = run.stepper()
    stepper.begin([4.5, 0.0])
    mean, sd = stepper.step()
    first = mean.copy()
    again, _ = stepper.step([2.0, 1.0])
    assert again is mean and stepper.sd is sd
    assert not np.array_equal(first, mean)


def test_memory_is_flat(run):
    stepper, state = run.stepper(), np.array([4.5, 0.0])
    stepper.begin(state)

    def resident():
        gc.collect()
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    # A million calls of the net that planners use; the others share its memory.
    calls = 1_000_000 if run.recipe == "Hybrid+" else 50_000
    for _ in range(2_000):
        stepper.step(state)
    before = resident()
    for _ in range(calls):
        stepper.step(state)
    assert resident() - before < 1024, f"kB more after {calls} steps"


def test_eight_threads_step_at_once(run):
    def path():
        stepper = run.stepper()
        stepper.begin([4.5, 0.0], index=2)
        return np.array([stepper.step()[0].copy() for _ in range(300)])

    expected, made = path(), [None] * 8
    threads = [threading.Thread(target=lambda i=i: made.__setitem__(i, path())) for i in range(8)]
    [t.start() for t in threads]
    [t.join() for t in threads]
    for one in made:
        np.testing.assert_array_equal(one, expected)


@pytest.mark.parametrize("state", [[1.0], [1.0, 2.0, 3.0], 4.5, "high", [np.nan, 0.0], [[1.0, 2.0]], [None, 1.0], []])
def test_invalid_states_are_rejected(run, state):
    stepper = run.stepper()
    with pytest.raises(augsim.UsageError, match="give 2 numbers: height_m, velocity_m_s|give finite ones"):
        stepper.step(state)
    with pytest.raises(augsim.UsageError):
        stepper.begin(state)


def test_pushes_are_sampled_instead():
    data, declared = generate.pushes(6, seed=3)
    run = augsim.train(data, "hybrid-plus", declared, iterations=2, progress=False)
    with pytest.raises(augsim.DataError, match="forecast whole trajectories with this one"):
        run.stepper()
    push = next(iter(data))
    actions = np.column_stack([push["pusher_x_m"], push["pusher_y_m"], push["t_s"]])
    assert run.action_columns == ["pusher_x_m", "pusher_y_m", "t_s"]
    start = [push[c][0] for c in run.columns]
    made = run.sample(start, actions, 7)
    assert made.shape == (1, 7, len(actions), 3) and np.isfinite(made).all()
    np.testing.assert_allclose(made[0, :, 0], np.broadcast_to(np.float32(start), (7, 3)))
