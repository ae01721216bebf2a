"""Contract: simulations follow the physics from named initial states, and wrong arguments raise one exception."""

import json

import numpy as np
import pandas
import pytest

import augsim

BALL = """
scenario = "ball"
[parameters]
gravity_m_s2 = { nominal = 9.81, frozen = true }
restitution = { nominal = 0.5, min = 0.0, max = 1.0 }
"""


@pytest.fixture()
def ball():
    return augsim.Model(BALL)


def test_free_fall_and_rebound_follow_their_laws(ball):
    times = np.linspace(0.0, 1.0, 101)
    made = ball.simulate({"height_m": [1.0, 2.0, 50.0], "velocity_m_s": 0.0}, times)
    assert made.shape == (3, 1, 101, 1) and made.dtype == np.float64
    falling = made[2, 0, :, 0]
    np.testing.assert_allclose(falling, 50.0 - 0.5 * 9.81 * times**2, rtol=1e-12)
    impact = np.sqrt(2 * 1.0 / 9.81)
    after = times[times > impact]
    apex = made[0, 0, times > impact, 0].max()
    assert abs(apex - 0.25) < 1e-3 and len(after) > 20  # e squared of the height, at 10 ms


def test_columns_are_named(ball):
    assert ball.columns({"height_m": 1.0, "velocity_m_s": 0.0}) == ["height_m"]
    plane = {"x_m": 0.0, "z_m": 1.0, "velocity_x_m_s": 1.0, "velocity_z_m_s": 0.0}
    assert ball.columns(plane) == ["x_m", "z_m"]
    flown = ball.simulate(plane, [0.0, 0.1, 0.2])
    np.testing.assert_allclose(flown[0, 0, :, 0], [0.0, 0.1, 0.2], atol=1e-12)


def test_samples_are_drawn_within_intervals_and_repeat_with_their_seed():
    text = BALL.replace("max = 1.0 }", "max = 1.0, ci95 = [0.402, 0.598] }") + "[sensor]\nposition_sd_m = 0.001\n"
    model = augsim.Model(text)
    start, times = {"height_m": 1.0, "velocity_m_s": 0.0}, [0.0, 0.3, 0.7]
    one = model.simulate(start, times, samples=400, seed=3)
    assert one.shape == (1, 400, 3, 1)
    np.testing.assert_array_equal(one, model.simulate(start, times, samples=400, seed=3))
    assert not np.array_equal(one, model.simulate(start, times, samples=400, seed=4))
    before, after = one[0, :, 1, 0].std(), one[0, :, 2, 0].std()
    assert 0.0008 < before < 0.0012  # sensor noise alone
    assert after > 5 * before  # and what is not known of the restitution
    fewer = model.simulate(start, times, samples=100, seed=3)
    np.testing.assert_array_equal(fewer, one[:, :100])


def test_parameters_and_text_go_there_and_back(ball):
    e = ball.parameters["restitution"]
    assert (e.value, e.min, e.max, e.frozen, e.ci95) == (0.5, 0.0, 1.0, False, None)
    assert augsim.Model(ball.to_toml()).parameters == ball.parameters
    assert "restitution = 0.5" in repr(ball)


def test_a_column_of_text_is_not_used(root):
    folder = root / "fixtures/systems/pendulum"
    model = augsim.Model(folder / "model.toml")
    swings = pandas.read_csv(folder / "swings.csv")
    modes = ["free", None] * (len(swings) // 2) + ["free"] * (len(swings) % 2)
    fitted = model.fit(swings.assign(mode=modes))
    assert fitted.model.parameters == model.fit(swings).model.parameters


def test_a_system_of_equations_is_fitted_as_by_the_command_line(root, augsim_command, tmp_path):
    system = root / "fixtures" / "systems" / "pendulum"
    fit = augsim.Model(system / "model.toml").fit(system / "swings.csv")
    augsim_command("fit", system / "model.toml", system / "swings.csv", "--out", tmp_path)
    assert fit.json == (tmp_path / "result.json").read_text()
    assert fit.model.to_toml() == (tmp_path / "model.toml").read_text()
    assert fit.result["schema"] == "augsim.fit/1"


def test_a_pendulum_swings_with_its_period():
    text = """
        scenario = "system"
        [states]
        theta_rad = { start = "theta_rad" }
        omega_rad_s = { start = "slope(theta_rad)" }
        [parameters]
        stiffness_per_s2 = { nominal = 64.0 }
        [rates]
        theta_rad = "omega_rad_s"
        omega_rad_s = "-stiffness_per_s2 * theta_rad"
        [outputs]
        theta_rad = "theta_rad"
    """
    model = augsim.Model(text)
    times = np.linspace(0.0, 2.0, 201)
    made = model.simulate({"theta_rad": [0.1, 0.2], "omega_rad_s": 0.0}, times)
    np.testing.assert_allclose(made[1, 0, :, 0], 0.2 * np.cos(8.0 * times), atol=1e-5)


@pytest.mark.parametrize(
    ("start", "times", "inputs", "sentence"),
    [
        ({}, [0.0], None, "give the initial value of every state"),
        ({"height_m": 1.0}, [0.0], None, "`velocity_m_s` is missing"),
        ({"height_m": 1.0, "velocity_m_s": 0.0, "colour": 1.0}, [0.0], None, "no state of the model"),
        ({"height_m": [1.0, 2.0], "velocity_m_s": [0.0, 0.0, 0.0]}, [0.0], None, "values, but the other states have"),
        ({"height_m": np.nan, "velocity_m_s": 0.0}, [0.0], None, "give a finite number"),
        ({"height_m": 1.0, "velocity_m_s": 0.0}, [], None, "give the times of the samples"),
        ({"height_m": 1.0, "velocity_m_s": 0.0}, [0.0, 0.0], None, "times must be finite and increasing"),
        ({"height_m": 1.0, "velocity_m_s": 0.0}, [[0.0]], None, "give one number, or one dimension"),
        ({"height_m": 1.0, "velocity_m_s": 0.0}, [0.0], {"force_N": [1.0]}, "the model has no such input"),
        ({"height_m": "high", "velocity_m_s": 0.0}, [0.0], None, "give numbers"),
        ({"height_m": np.ones((2, 2)), "velocity_m_s": 0.0}, [0.0], None, "give one number, or one dimension"),
    ],
)
def test_wrong_arguments_are_rejected(ball, start, times, inputs, sentence):
    with pytest.raises(augsim.Error, match=sentence) as raised:
        ball.simulate(start, times, inputs)
    assert isinstance(raised.value, ValueError)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"samples": -1}, "samples = -1"),
        ({"samples": 2**63}, "AUGSIM_LIMIT_CELLS"),
        ({"samples": 1.5}, "give a whole number"),
        ({"seed": 2**64}, "seed = "),
    ],
)
def test_numbers_out_of_range_are_rejected(ball, options, sentence):
    with pytest.raises(augsim.UsageError, match=sentence):
        ball.simulate({"height_m": 1.0, "velocity_m_s": 0.0}, [0.0], **options)


def test_a_wrong_model_names_its_line(tmp_path):
    with pytest.raises(augsim.ModelError, match="model:3"):
        augsim.Model('scenario = "ball"\n[parameters]\ngravity = 9.81\n')
    path = tmp_path / "absent.toml"
    with pytest.raises(augsim.ModelError, match="absent.toml: there is no such file"):
        augsim.Model(path)
    with pytest.raises(augsim.UsageError, match="a model of type int"):
        augsim.Model(3)


def test_fit_takes_equations(ball, sealed):
    with pytest.raises(augsim.UsageError, match="fit needs an equation model"):
        ball.fit(sealed / "bounces.csv")


def test_a_push_moves_the_object():
    model = augsim.Model('scenario = "push"\nobject = "rect1"\n[parameters]\ncontact_friction = 0.25\n')
    times = np.linspace(0.0, 1.0, 51)
    rod = {"pusher_x_m": -0.06 + 0.05 * times, "pusher_y_m": np.zeros_like(times)}
    start = {"x_m": 0.0, "y_m": 0.0, "theta_rad": 0.0}
    made = model.simulate(start, times, rod)
    assert model.columns(start, rod) == ["x_m", "y_m", "theta_rad"]
    assert 0.02 < made[0, 0, -1, 0] < 0.05 and abs(made[0, 0, -1, 1]) < 1e-6
    json.dumps(made.tolist())  # every number is finite
