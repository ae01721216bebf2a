"""Contract (issue 20): any arguments give a result of the documented shape or one exception of augsim. Arguments are
drawn at random from right ones and from each kind of wrong one: shapes, types, NaN, strides, empty arrays, numbers out of range. A
panic of Rust would be a RuntimeError, and fails here."""

import numpy as np
import pytest

import augsim
from augsim import generate

DRAWS = 400
REFUSED = (augsim.Error, TypeError, ValueError, OverflowError)


@pytest.fixture(scope="module")
def ball():
    return augsim.Model('scenario = "ball"\n[parameters]\ngravity_m_s2 = 9.81\nrestitution = 0.5\n')


@pytest.fixture(scope="module")
def run():
    return augsim.train(generate.drops(8, samples=20), "hybrid", "pybullet-ball", iterations=1, progress=False)


def array_or_not(random, size):
    """Mostly a valid array of this size, otherwise an invalid value."""
    right = random.normal(size=size) + 2.0
    wrong = [
        lambda: right.astype(np.float32),
        lambda: np.asfortranarray(np.stack([right, right]))[0],
        lambda: np.repeat(right, 2)[::2],
        lambda: right[::-1],
        lambda: right.astype(complex),
        lambda: right.astype(object),
        lambda: right.astype("datetime64[s]"),
        lambda: np.where(random.random(size) < 0.3, np.nan, right),
        lambda: np.full(size, np.inf),
        lambda: np.full(size, 1e308),
        lambda: right[:-1],
        lambda: np.append(right, 1.0),
        lambda: right[np.newaxis],
        lambda: np.empty((0,)),
        lambda: np.empty((3, 0, 2)),
        lambda: float(right[0]),
        lambda: right.tolist(),
        lambda: [None] * size,
        lambda: "high",
        lambda: b"\x00\xff",
        lambda: None,
        lambda: {"height_m": right},
        lambda: np.array("1.0"),
        lambda: np.ma.masked_array(right, mask=True),
    ]
    return right if random.random() < 0.4 else wrong[random.integers(len(wrong))]()


def number_or_not(random, right):
    """Mostly a valid number, otherwise an invalid one or one out of range."""
    wrong = [0, -1, 2**31, 2**63, 2**64, 2**70, 1.5, np.nan, "3", None, True, np.int8(3), np.float32(3.0), [3]]
    return right if random.random() < 0.6 else wrong[random.integers(len(wrong))]


def times_or_not(random):
    """Mostly increasing times."""
    return np.linspace(0.0, 1.0, 5) if random.random() < 0.6 else array_or_not(random, 5)


def answered(call, shape_of):
    """Whether the call returned a result, whose shape is checked; exceptions must have a message."""
    try:
        made = call()
    except REFUSED as error:
        assert str(error).strip(), repr(error)
        return False
    shape_of(made)
    return True


def test_simulations_have_their_shape_or_are_refused(ball):
    random = np.random.default_rng(1)
    done = 0
    for _ in range(DRAWS):
        start = {"height_m": array_or_not(random, 3), "velocity_m_s": array_or_not(random, 3)}
        times, samples, seed = times_or_not(random), number_or_not(random, 2), number_or_not(random, 1)

        def shape(made, times=times):
            assert made.ndim == 4 and made.shape[2] == np.size(times) and made.shape[3] == 1 and np.isfinite(made).all()

        done += answered(lambda: ball.simulate(start, times, samples=samples, seed=seed), shape)
    assert DRAWS / 20 < done < DRAWS / 1.5, done


def test_samples_have_their_shape_or_are_refused(run):
    random = np.random.default_rng(2)
    done = 0
    for _ in range(DRAWS):
        start, steps = array_or_not(random, 2), number_or_not(random, 6)
        n, seed, first = number_or_not(random, 3), number_or_not(random, 1), number_or_not(random, 0)

        def shape(made):
            assert made.ndim == 4 and made.shape[3] == 2 and made.dtype == np.float32

        done += answered(lambda: run.sample(start, steps, n, seed=seed, first=first), shape)
    assert DRAWS / 20 < done < DRAWS / 1.5, done


def test_steps_have_their_shape_or_are_refused(run):
    random = np.random.default_rng(3)
    stepper = run.stepper()
    stepper.begin([4.5, 0.0])
    done = 0
    for _ in range(DRAWS):
        state = array_or_not(random, 2)

        def shape(made):
            assert [one.shape for one in made] == [(2,), (2,)]

        done += answered(lambda: stepper.step(state), shape)
    assert DRAWS / 5 < done < DRAWS, done
