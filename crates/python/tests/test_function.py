"""Contract (issue 53): a function of Python is a declared model like a file. It finds the same effects and values, and whatever it
does wrong is one clear exception; nothing hangs."""

import pickle
import textwrap
import threading
import time

import numpy as np
import pytest

import augsim
import systems
from interrupting import seconds_to_stop

#: Longest time in s from Ctrl-C to the exception.
PROMPT = 2.0

SMALL = {"states": ["x_m"], "parameters": {"rate_per_s": (1.0, 0.1, 10.0)}, "outputs": ["x_m"], "trace": False}


def decay(t, x, u, p):
    return -p["rate_per_s"] * x


@pytest.fixture(scope="module")
def decays():
    """Two decays with a rate of 2 per second."""
    times = np.linspace(0.0, 2.0, 61)
    random = np.random.default_rng(5)
    runs = [start * np.exp(-2.0 * times) + random.normal(0.0, 0.003, 61) for start in (1.0, 2.0)]
    return {"trajectory": np.repeat([0, 1], 61), "t_s": np.tile(times, 2), "x_m": np.concatenate(runs)}


def jax_decay(t, x, u, p):
    return -p["rate_per_s"] * x


def values(found):
    return {name: parameter.value for name, parameter in found.model.parameters.items()}


@pytest.mark.parametrize("name", systems.ALL)
def test_a_function_of_formulas_is_read_as_its_model_file(name):
    system = systems.ALL[name]
    data = system.recording()
    function = augsim.Model.from_rates(system.function, **system.arguments)
    assert "external_rate" not in function.to_toml()
    of_file, of_function = (augsim.discover(model, data, null_runs=0) for model in (augsim.Model(system.text), function))
    assert [effect["kind"] for effect in of_function.effects] == [effect["kind"] for effect in of_file.effects] != []
    assert values(of_function) == pytest.approx(values(of_file), rel=1e-3)


@pytest.mark.parametrize("name", systems.ALL)
def test_a_function_that_is_called_simulates_and_fits_as_its_model_file(name):
    system = systems.ALL[name]
    data = system.recording(samples=61)
    function = augsim.Model.from_rates(system.function, trace=False, **system.arguments)
    assert "external_rate" in function.to_toml()
    file = augsim.Model(system.text)
    start = dict(zip(system.arguments["states"], system.starts[0]))
    times = np.linspace(0.0, 1.0, 51)
    inputs = {name: given(times) for name, given in system.inputs.items()}
    np.testing.assert_allclose(
        function.simulate(start, times, inputs), file.simulate(start, times, inputs), rtol=1e-9, atol=1e-9
    )
    if name != "arm":  # its fit takes a minute
        assert values(function.fit(data)) == pytest.approx(values(file.fit(data)), rel=1e-4)


def test_the_pendulum_as_a_called_function_finds_its_friction():
    system = systems.PENDULUM
    data = system.recording(samples=101)
    function = augsim.Model.from_rates(system.function, trace=False, **system.arguments)
    rivals = ["coulomb", "linear-damping", "quadratic-damping"]
    of_file, found = (augsim.discover(model, data, only=rivals, null_runs=0) for model in (augsim.Model(system.text), function))
    assert [effect["kind"] for effect in found.effects] == ["coulomb"] == [effect["kind"] for effect in of_file.effects]
    assert values(found) == pytest.approx(values(of_file), rel=1e-3)
    assert "coulomb" in found._repr_html_()
    assert found.model.simulate({"theta_rad": 1.0, "omega_rad_s": 0.0}, [0.0, 0.5]).shape == (1, 1, 2, 1)


def test_a_jacobian_is_used_in_place_of_differences(decays):
    calls = []

    def jacobian(t, x, u, p):
        calls.append(x.shape)
        ones = np.ones_like(x)
        return (-p["rate_per_s"] * ones)[:, None], np.empty((1, 0, x.shape[1])), (-x)[:, None]

    with_jacobian = augsim.Model.from_rates(decay, jacobian=jacobian, **SMALL).fit(decays)
    without = augsim.Model.from_rates(decay, **SMALL).fit(decays)
    assert calls and values(with_jacobian) == pytest.approx(values(without), rel=1e-6)
    assert values(without)["rate_per_s"] == pytest.approx(2.0, rel=0.02)


def test_a_function_of_jax_is_compiled_and_differentiated(decays):
    jax = pytest.importorskip("jax", reason="JAX is not installed")
    parameters = {"rate_per_s": (1.0, 0.1, 10.0), "bend_per_m": (0.3, 0.0, 1.0)}
    arguments = SMALL | {"parameters": parameters}

    def bent(t, x, u, p):
        return [jax.numpy.where(x[0] > 0.0, -p["rate_per_s"] * x[0] * (1.0 + p["bend_per_m"] * x[0] ** 2), 0.0)]

    def same(t, x, u, p):
        return [np.where(x[0] > 0.0, -p["rate_per_s"] * x[0] * (1.0 + p["bend_per_m"] * x[0] ** 2), 0.0)]

    model = augsim.Model.from_rates(bent, jacobian="jax", **arguments)
    fitted = model.fit(decays)
    assert values(fitted) == pytest.approx(values(augsim.Model.from_rates(same, **arguments).fit(decays)), rel=1e-4, abs=1e-5)
    derivatives = model._inner.function().jacobian(np.zeros(1), np.array([[2.0]]), np.empty((0, 1)), np.array([[1.5], [0.3]]))
    np.testing.assert_allclose([float(part.sum()) for part in derivatives], [-1.5 * (1 + 0.9 * 4), 0.0, -2.0 * 2.2 - 1.5 * 8], rtol=1e-14)
    again = pickle.loads(pickle.dumps(augsim.Model.from_rates(jax_decay, jacobian="jax", **SMALL)))
    assert values(again.fit(decays))["rate_per_s"] == pytest.approx(2.0, rel=0.01)


def test_a_function_of_one_point_is_accepted_and_said_to_be_slow(decays):
    def one(t, x, u, p):
        return [-p[0] * float(x[0])]

    with pytest.warns(UserWarning, match="one computes one point at a time, which is slow"):
        model = augsim.Model.from_rates(one, **SMALL)
    fitted = augsim.Model.from_rates(decay, **SMALL).fit(decays)
    assert values(model.fit(decays)) == pytest.approx(values(fitted), rel=1e-9)


def test_steps_are_repeated_exactly():
    def step(x, u, p, dt):
        speed = x[1] + dt * (u["force_N"] - p["stiffness_per_s2"] * x[0] + u["push_N"])
        return [x[0] + dt * speed, speed]

    model = augsim.Model.from_step(
        step,
        dt=0.01,
        states=["x_m", "v_m_s"],
        inputs={"force_N": "zero"},
        forces={"push_N": ("x_m", "v_m_s")},
        parameters={"stiffness_per_s2": 30.0},
        outputs=["x_m"],
    )
    times = np.linspace(0.0, 1.0, 21)
    force = np.sin(3.0 * times)
    made = model.simulate({"x_m": 0.1, "v_m_s": 0.0}, times, {"force_N": force})[0, 0, :, 0]
    x, expected = np.array([0.1, 0.0]), [0.1]
    for value in force[:-1]:
        for _ in range(5):
            x = np.array(step(x, {"force_N": value, "push_N": 0.0}, {"stiffness_per_s2": 30.0}, 0.01))
        expected.append(x[0])
    np.testing.assert_allclose(made, expected, rtol=1e-12)


def test_an_exception_of_the_function_is_raised_with_its_place(decays):
    calls, is_broken = [], False

    def fails(t, x, u, p):
        calls.append(0)
        if is_broken:
            raise ZeroDivisionError("no wind")
        return decay(t, x, u, p)

    model = augsim.Model.from_rates(fails, **SMALL)
    is_broken = True
    for work in (lambda: model.fit(decays), lambda: augsim.discover(model, decays), lambda: model.simulate({"x_m": 1.0}, [0, 1])):
        calls.clear()
        with pytest.raises(ZeroDivisionError, match="no wind") as raised:
            work()
        assert "augsim called fails" in raised.value.__notes__[0]
        assert len(calls) == 1, "after an exception the function is not called again"
    is_broken = False
    assert model.simulate({"x_m": 1.0}, [0.0, 0.1]).shape == (1, 1, 2, 1), "the model can be used again"


@pytest.mark.parametrize(
    ("function", "sentence"),
    [
        (lambda t, x, u, p: None, "returned None; it must return the rates of x_m at 13 points"),
        (lambda t, x, u, p: np.zeros((2, x.shape[-1])), r"an array of shape \(2, 13\)"),
        (lambda t, x, u, p: ["high"], "returned for `x_m` 'high'"),
        (lambda t, x, u, p: {"x_m": 1.0}, "returned dict"),
        (lambda t, x, u, p: x - x.mean(axis=1, keepdims=True), "depend on the other points"),
    ],
)
def test_a_wrong_result_is_one_error_when_the_model_is_made(function, sentence):
    with pytest.raises(augsim.ModelError, match=sentence):
        augsim.Model.from_rates(function, **{**SMALL, "states": ["x_m"]})


def test_a_result_that_becomes_wrong_is_one_error(decays):
    calls = []

    def changes(t, x, u, p):
        calls.append(0)
        return decay(t, x, u, p) if len(calls) < 50 else np.zeros((3, 3))

    with pytest.raises(augsim.ModelError, match=r"an array of shape \(3, 3\)"):
        augsim.Model.from_rates(changes, **SMALL).fit(decays)


def test_rates_that_are_not_finite_are_one_error_that_says_where(decays):
    def undefined(t, x, u, p):
        return np.where(x < 5.0, np.nan, x)

    model = augsim.Model.from_rates(undefined, **SMALL)
    for work in (lambda: model.fit(decays), lambda: augsim.discover(model, decays)):
        with pytest.raises(augsim.Error, match="undefined returned a rate of `x_m` that is not finite at t = "):
            work()


def test_a_function_that_changes_its_arguments_is_one_error(decays):
    def careless(t, x, u, p):
        x *= -1.0
        return x

    with pytest.raises(ValueError, match="read-only"):
        augsim.Model.from_rates(careless, **SMALL)


def test_differences_that_depend_on_their_step_are_one_error():
    def rippled(t, x, u, p):
        return decay(t, x, u, p) + 1e-4 * np.sin(1e9 * x)

    with pytest.raises(augsim.ModelError, match="rate of `x_m` by `x_m` in rippled depends on its step of 7e-06; give the typical size"):
        augsim.Model.from_rates(rippled, **SMALL)
    with_jacobian = lambda t, x, u, p: ((-p["rate_per_s"] + 0.0 * x)[:, None], np.empty((1, 0, x.shape[1])), (-x)[:, None])  # noqa: E731
    assert augsim.Model.from_rates(rippled, jacobian=with_jacobian, **SMALL).scenario == "system"


def test_names_that_do_not_exist_are_named():
    with pytest.raises(KeyError, match="no value is called 'lenght_m'; there are: rate_per_s"):
        augsim.Model.from_rates(lambda t, x, u, p: x * p["lenght_m"], **SMALL)
    with pytest.raises(augsim.UsageError, match="scales: the model has no quantity `y_m`"):
        augsim.Model.from_rates(decay, scales={"y_m": 1.0}, **SMALL)
    with pytest.raises(augsim.UsageError, match="no section that can be added"):
        augsim.Model.from_rates(decay, rate={}, **SMALL)
    with pytest.raises(augsim.UsageError, match="give a function"):
        augsim.Model.from_rates("decay", **SMALL)


def test_a_function_that_prints_and_sleeps_is_only_slower(decays, capfd):
    def chatty(t, x, u, p):
        time.sleep(1e-5)
        print("called")
        return decay(t, x, u, p)

    fitted = augsim.Model.from_rates(chatty, **SMALL).fit(decays)
    assert values(fitted) == values(augsim.Model.from_rates(decay, **SMALL).fit(decays))
    assert capfd.readouterr().out.startswith("called\n")


def test_a_function_that_uses_its_own_model_is_one_error(decays):
    models = []

    def nested(t, x, u, p):
        if models:
            models[0].simulate({"x_m": 1.0}, [0.0, 1.0])
        return -p["rate_per_s"] * x

    models.append(augsim.Model.from_rates(nested, **SMALL))
    for operation in (lambda: models[0].fit(decays), lambda: models[0].simulate({"x_m": 1.0}, [0.0, 1.0])):
        with pytest.raises(augsim.UsageError, match="the function of a model uses this model"):
            operation()


def test_only_one_thread_calls_a_function(decays):
    callers, calls = set(), set()

    def watched(t, x, u, p):
        callers.add(threading.get_ident())
        call = (np.asarray(t).tobytes(), x.tobytes(), np.asarray(p).tobytes())
        assert not is_fitting or call not in calls, "a call is not repeated"
        calls.add(call)
        return decay(t, x, u, p)

    is_fitting = False
    model = augsim.Model.from_rates(watched, **SMALL)
    callers.clear()
    calls.clear()
    is_fitting = True
    model.fit(decays)
    assert len(callers) == 1


def test_threads_get_the_same_results(decays):
    model = augsim.Model.from_rates(decay, **SMALL)
    expected = model.fit(decays).json
    found = []
    threads = [threading.Thread(target=lambda: found.append(model.fit(decays).json)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60.0)
        assert not thread.is_alive()
    assert found == [expected] * 4


def test_the_file_of_a_called_function_says_that_the_function_is_missing(decays):
    text = augsim.Model.from_rates(decay, **SMALL).to_toml()
    with pytest.raises(augsim.ModelError, match="the Python function `decay`, which is not in the file"):
        augsim.Model(text).fit(decays)


@pytest.mark.parametrize("body", ["time.sleep(0.2)", "time.sleep(1e-4)", "sum(range(20000))"])
def test_ctrl_c_stops_a_function(body):
    program = textwrap.dedent(
        f"""
        import time, numpy as np, augsim
        def slow(t, x, u, p):
            {body}
            return -p["rate_per_s"] * x * (1.0 + 0.0 * np.abs(x))
        model = augsim.Model.from_rates(
            slow, states=["x_m"], parameters={{"rate_per_s": (1.0, 0.1, 10.0)}}, outputs=["x_m"], trace=False)
        times = np.linspace(0.0, 2.0, 2001)
        data = {{"trajectory": np.zeros(2001), "t_s": times, "x_m": np.exp(-2 * times) + 0.01 * np.sin(1e4 * times)}}
        print("ready", flush=True)
        try:
            augsim.discover(model, data, progress=False)
            print("finished", flush=True)
        except KeyboardInterrupt:
            print("stopped", flush=True)
        """
    )
    seconds = seconds_to_stop(program, 0.7)
    assert seconds < PROMPT, f"{seconds:.2f} s"
