"""Contract: `next` designs the runs of the command line, byte for byte; a discovery in memory leads to a plan whose runs decide between
its explanations; wrong arguments are errors that name the remedy."""

import numpy as np
import pytest

import augsim

MODEL = """scenario = "system"
name = "cart"
[inputs]
force_N = { hold = "linear" }
[states]
x_m = { start = 0.0, sd = 0.001 }
v_m_s = { start = 0.0, sd = 0.001 }
[parameters]
m_kg = { nominal = 1.0, frozen = true }
[rates]
x_m = "v_m_s"
v_m_s = "force_N / m_kg"
[outputs]
pos_m = { value = "x_m", sd = "estimate" }
"""
LIMITS = {
    "duration_s": 4.0,
    "sample_s": 0.05,
    "inputs": {"force_N": {"range": [-1.0, 1.0]}},
    "ranges": {"pos_m": [-4.0, 4.0]},
    "starts": {"x_m": 0.0, "v_m_s": 0.0},
}
DISCOVER = {"only": ["coulomb", "linear-damping"], "null_runs": 0, "progress": False}


def cart(times, force, seed):
    """A run of a cart of 1 kg with viscous friction 0.7 N s/m; the position has noise of 1 cm."""
    x, v, rng = 0.0, 0.0, np.random.default_rng(seed)
    positions = [x]
    for k in range(len(times) - 1):
        steps = np.linspace(force[k], force[k + 1], 200, endpoint=False)
        for f in steps:
            v += (times[k + 1] - times[k]) / 200 * (f - 0.7 * v)
            x += (times[k + 1] - times[k]) / 200 * v
        positions.append(x)
    noisy = np.array(positions) + 0.01 * rng.standard_normal(len(times))
    return {"t_s": np.asarray(times), "force_N": np.asarray(force), "pos_m": noisy}


@pytest.fixture(scope="module")
def recordings():
    times = np.arange(61) * 0.02
    return [cart(times, np.full(61, 0.5 + 0.02 * (i % 3)), 100 + i) for i in range(10)]


@pytest.fixture(scope="module")
def found(recordings):
    found = augsim.discover(MODEL, recordings, **DISCOVER)
    assert len(found.result["models"]["rivals"]) == 1
    return found


@pytest.fixture(scope="module")
def plan(found, recordings):
    return found.next(recordings, limits=LIMITS, sequences=50, progress=False)


def test_a_plan_decides_between_the_explanations_of_a_discovery(plan, tmp_path):
    assert plan.verdict == "plan" and plan.promise["is_enough"] and plan.promise["runs"] == 1
    assert "tells linear-damping from coulomb with odds of 1000 to 1" in plan.sentence
    [run] = plan.runs
    assert run["t_s"][-1] == pytest.approx(4.0) and np.abs(run["force_N"]).max() <= 1.0
    heard = plan.listen(cart(run["t_s"], run["force_N"], 40))
    assert heard.verdict == "enough", heard.sentence
    assert [e["name"] for e in heard.explanations if not e["rejected"]] == ["linear-damping"]
    assert "report" not in repr(heard) and heard.sentence in repr(heard)
    assert "odds against it" in heard.to_html(tmp_path / "heard.html").read_text()
    further = heard.next(limits=LIMITS, budget=1, progress=False)
    assert "There is one explanation" in further.sentence


def test_the_bytes_are_those_of_the_command_line(recordings, augsim_command, tmp_path):
    model, data, limits = tmp_path / "model.toml", tmp_path / "first.csv", tmp_path / "limits.toml"
    model.write_text(MODEL)
    lines = [f"r{i},{t},{f},{y}" for i, r in enumerate(recordings) for t, f, y in zip(r["t_s"], r["force_N"], r["pos_m"])]
    data.write_text("\n".join(["trajectory,t_s,force_N,pos_m", *lines]) + "\n")
    limits.write_text(
        "duration_s = 4.0\nsample_s = 0.05\n[inputs.force_N]\nrange = [-1.0, 1.0]\n[ranges]\npos_m = [-4.0, 4.0]\n"
        "[starts]\nx_m = 0.0\nv_m_s = 0.0\n"
    )
    found = tmp_path / "found"
    augsim_command("discover", model, data, "--only", "coulomb,linear-damping", "--null-runs", 0, "--out", found)
    augsim_command("next", found, "--data", data, "--limits", limits, "--sequences", 50, "--out", tmp_path / "plan")
    plan = augsim.next(found, data, limits=LIMITS, sequences=50, progress=False)
    saved = plan.save(tmp_path / "saved")
    for name in ("plan.json", "run-1.csv", "report.html"):
        assert (saved / name).read_text() == (tmp_path / "plan" / name).read_text(), name
    assert augsim.Plan(saved).json == plan.json and len(augsim.Plan(saved).runs) == 1


def test_wrong_arguments_are_errors(found, plan, recordings):
    for options, message in [
        ({"budget": 0}, "from 1 to 50"),
        ({"odds": 1.0}, "above 1"),
        ({"sequences": 3}, "from 20"),
        ({"limits": 3}, "a dict or a file of limits"),
        ({"limits": {"duration_s": "long"}}, "is no number"),
    ]:
        with pytest.raises(augsim.UsageError, match=message):
            found.next(recordings, **options, progress=False)
    with pytest.raises(augsim.UsageError, match="force_N"):
        found.next(recordings, limits={"inputs": {"force": {"range": [0, 1]}}}, progress=False)
    with pytest.raises(augsim.UsageError, match="an explanation of type int"):
        augsim.next(3)
    with pytest.raises(augsim.DataError, match="pos_m"):
        plan.listen({"t_s": [0.0, 0.1], "force_N": [0.0, 0.0]})
