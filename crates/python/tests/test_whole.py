"""Contract (issue 53): models, data and results are used from Python without files: set, saved, opened, pickled, predicted, exported."""

import json
import pickle
import warnings
import zipfile
from datetime import timedelta

import numpy as np
import pandas
import pytest

import augsim
import systems


def two_states(t, x, u, p):
    return [x[1], -p["stiffness_per_s2"] * x[0]]


ARGUMENTS = {
    "states": ["x_m", "v_m_s"],
    "parameters": {"stiffness_per_s2": (30.0, 1.0, 100.0)},
    "outputs": ["x_m"],
}


@pytest.fixture(scope="module")
def data():
    return systems.PENDULUM.recording(samples=101)


@pytest.fixture(scope="module")
def found(data):
    return augsim.discover(augsim.Model(systems.PENDULUM.text), data, null_runs=0, title="three swings", progress=False)


def test_a_parameter_is_set_in_the_model_and_in_its_text():
    model = augsim.Model(systems.PENDULUM.text)
    model.parameters["length_m"] = 1.5
    assert model.parameters["length_m"].value == 1.5 and "nominal = 1.5" in model.to_toml()
    with pytest.raises(augsim.UsageError, match=r"length_m` = 7 is outside its bounds \[0.1, 2\]"):
        model.parameters["length_m"] = 7.0
    with pytest.raises(augsim.UsageError, match="no parameter `lenght_m`"):
        model.parameters["lenght_m"] = 1.0
    with pytest.raises(augsim.UsageError, match="give a number"):
        model.parameters["length_m"] = "long"
    ball = augsim.Model('scenario = "ball"\n[parameters]\ngravity_m_s2 = 9.81\nrestitution = 0.5\n')
    with pytest.raises(augsim.UsageError, match="only those of a model of equations"):
        ball.parameters["restitution"] = 0.4


@pytest.mark.parametrize("trace", [True, False])
def test_a_model_is_pickled_with_its_function(trace):
    model = augsim.Model.from_rates(two_states, trace=trace, **ARGUMENTS)
    model.parameters["stiffness_per_s2"] = 64.0
    start, times = {"x_m": 0.1, "v_m_s": 0.0}, np.linspace(0.0, 1.0, 51)
    again = pickle.loads(pickle.dumps(model))
    np.testing.assert_array_equal(again.simulate(start, times), model.simulate(start, times))
    np.testing.assert_allclose(model.simulate(start, times)[0, 0, :, 0], 0.1 * np.cos(8.0 * times), atol=1e-4)


def test_a_discovery_is_saved_and_opened(found, data, tmp_path):
    folder = found.save(tmp_path / "found")
    again = augsim.Discovery(folder)
    assert again.json == found.json and again.verdict == found.verdict
    assert again.model.to_toml() == found.model.to_toml() == augsim.Model(folder).to_toml()
    assert again.to_html(tmp_path / "page.html").read_text() == (folder / "report.html").read_text()
    assert "three swings" in (folder / "report.html").read_text()
    with pytest.raises(augsim.UsageError, match="no result.json and no model.toml"):
        augsim.Discovery(tmp_path)


def test_predictions_and_residuals_are_those_of_the_augmented_model(found, data):
    forecast = found.predict(data, samples=100)
    assert "q05_angle_rad" in forecast.columns and len(forecast) == 3
    left = found.residuals(data)
    assert list(left) == ["trajectory", "t_s", "angle_rad"]
    assert np.nanstd(left["angle_rad"]) < 0.02
    declared = augsim.Model(systems.PENDULUM.text).residuals(data)
    assert np.nanstd(declared["angle_rad"]) > 3 * np.nanstd(left["angle_rad"])


def test_summaries_are_frames(found):
    effects = found.summary()
    assert list(effects["effect"].unique()) == ["coulomb"]
    row = effects[effects["parameter"] == "f"].iloc[0]
    assert row["low"] < row["value"] < row["high"] and row["value"] == pytest.approx(0.4, rel=0.1)
    parameters = found.model.summary()
    assert "length_m" in list(parameters["parameter"])


def test_errors_are_drawn_on_axes(found):
    pyplot = pytest.importorskip("matplotlib.figure", reason="matplotlib is not installed")
    ax = pyplot.Figure().subplots()
    assert found.plot(ax=ax) is ax
    assert len(ax.patches) == 3 and "rad" in ax.get_ylabel()


def test_a_model_is_exported_as_files(found, tmp_path):
    text = found.model.export("python")
    assert found.model.export("python", tmp_path / "law.py") == [tmp_path / "law.py"]
    assert (tmp_path / "law.py").read_text() == text
    compile(text, "law.py", "exec")
    assert found.model.export("c", tmp_path / "new" / "law.c") == [tmp_path / "new" / "law.c", tmp_path / "new" / "law.h"]
    assert "law_step" in (tmp_path / "new" / "law.h").read_text()
    with warnings.catch_warnings():
        # Without a C compiler the FMU has sources only, and says so.
        warnings.simplefilter("ignore")
        [unit] = found.model.export("fmu", tmp_path / "law.fmu")
    with zipfile.ZipFile(unit) as archive:
        assert "modelDescription.xml" in archive.namelist()
    with pytest.raises(augsim.UsageError, match="no language is called 'fortran'; there are: python, c, latex, fmu"):
        found.model.export("fortran")
    with pytest.raises(augsim.UsageError, match="FMU"):
        found.model.export("fmu")
    called = augsim.Model.from_rates(two_states, trace=False, **ARGUMENTS)
    with pytest.raises(augsim.ModelError, match="the Python function `two_states`, which cannot be exported"):
        called.export("c")


def test_models_are_compared_on_new_recordings(found, augsim_command, tmp_path):
    fresh = augsim.Data(systems.PENDULUM.recording(seed=2, samples=101))
    errors = found.evaluate(fresh)
    assert list(errors["model"]) == ["declared", "calibrated", "augmented"] and set(errors["unit"]) == {"rad"}
    rmse = dict(zip(errors["model"], errors["rmse"]))
    assert rmse["augmented"] < 0.01 < rmse["calibrated"] <= rmse["declared"]
    folder = found.save(tmp_path / "found")
    text = augsim_command("evaluate", folder, "--data", fresh.to_csv(tmp_path / "fresh.csv"), "--json")
    for row, expected in zip(errors.itertuples(), json.loads(text)["rows"], strict=True):
        assert (row.model, row.measure, row.rmse, row.r2) == tuple(expected[k] for k in ("model", "measure", "rmse", "r2"))
        assert [row.low, row.high] == expected["ci95"] and row.coverage90 == expected["coverage90"]
    again = augsim.Discovery(folder).evaluate(fresh)
    pandas.testing.assert_frame_equal(again, errors)
    short = {name: values[:3] for name, values in fresh.to_dict().items()}
    with pytest.raises(augsim.DataError, match="after the first 5, which the initial state"):
        found.model.evaluate(short)


def test_a_discovery_is_pickled(found, data, tmp_path):
    again = pickle.loads(pickle.dumps(found))
    assert again.json == found.json and again.model.to_toml() == found.model.to_toml()
    assert list(again.plot()) == list(found.plot()) and again.plot().titles == found.plot().titles
    assert again.to_html(tmp_path / "page.html").read_text().startswith("<!DOCTYPE html>")
    np.testing.assert_array_equal(again.residuals(data)["angle_rad"], found.residuals(data)["angle_rad"])
    opened = augsim.Discovery(found.save(tmp_path / "found"))
    assert pickle.loads(pickle.dumps(opened)).sentence == found.sentence


def test_a_model_is_calibrated_by_a_function(data):
    fitted = augsim.fit(systems.PENDULUM.text, data)
    assert fitted.json == augsim.Model(systems.PENDULUM.text).fit(data).json


def test_recordings_in_any_layout_give_a_model_to_start_from(root, augsim_command, tmp_path):
    throws = root / "fixtures" / "recordings" / "throws.txt"
    begun = augsim.start(throws)
    assert begun.recording == "throws in a plane" and begun.model.scenario == "ball" and begun.assumptions
    folder = begun.save(tmp_path / "begun")
    augsim_command("start", throws, "--out", tmp_path / "same")
    for name in ("data.csv", "model.toml"):
        assert (folder / name).read_text() == (tmp_path / "same" / name).read_text(), name

    heated = {"t_s": np.arange(50.0), "heater_W": np.arange(50) % 20 * 1.0, "block_K": 300 + np.sin(np.arange(50) / 9)}
    begun = augsim.start(heated, name="heated block")
    assert (begun.inputs, begun.outputs, begun.recording) == (["heater_W"], ["block_K"], "other data")
    assert 'name = "heated block"' in begun.text and begun.model.fit(begun.data).result["rows"]

    raw = tmp_path / "raw.csv"
    raw.write_text("clock,height\n" + "".join(f"{20 * k},{100 - 0.1 * k}\n" for k in range(50)))
    begun = augsim.start(raw, time="clock:ms", columns={"height": "level_m:cm"})
    assert begun.data["t_s"][1] == pytest.approx(0.02) and begun.data["level_m"][0] == pytest.approx(1.0)
    with pytest.raises(augsim.UsageError, match="columns: `furlong` is not a known unit"):
        augsim.start(raw, columns={"height": "level_m:furlong"})
    with pytest.raises(augsim.UsageError, match="rate_hz = -1"):
        augsim.start(raw, rate_hz=-1.0)
    with pytest.raises(augsim.UsageError, match="up is for files"):
        augsim.start(heated, up="z")
    with pytest.raises(augsim.DataError, match="absent.csv"):
        augsim.start(tmp_path / "absent.csv")


def test_runs_are_read_from_lists_without_numbers_of_trajectories(data):
    whole = pandas.DataFrame(data)
    runs = [part.drop(columns="trajectory").reset_index(drop=True) for _, part in whole.groupby("trajectory")]
    read = augsim.read(runs)
    assert read.trajectories == ["1", "2", "3"]
    np.testing.assert_array_equal(read["angle_rad"], whole["angle_rad"])
    assert augsim.read(runs[0]).trajectories == ["1"]
    with pytest.raises(augsim.DataError, match="run 2 of the list has the columns t_s; give the same"):
        augsim.read([runs[0], {"t_s": [0.0]}])
    with pytest.raises(augsim.DataError, match="run 1 of the list is of type int"):
        augsim.read([1])


def test_time_differences_are_seconds(data):
    run = pandas.DataFrame(data)[:101].drop(columns="trajectory")
    run["t_s"] = pandas.to_timedelta(run["t_s"], unit="s")
    np.testing.assert_allclose(augsim.read(run)["t_s"], data["t_s"][:101], atol=1e-9)


def test_limits_of_a_discovery(data):
    model = augsim.Model(systems.PENDULUM.text)
    one = augsim.discover(model, data, null_runs=0, threads=1, progress=False)
    two = augsim.discover(model, data, null_runs=0, threads=2, progress=False)
    assert one.json == two.json
    formulas = augsim.discover(model, data, null_runs=0, library=False, progress=False)
    assert formulas.effects and all(e["kind"] != "coulomb" for e in formulas.effects)
    short = augsim.discover(model, data, time_limit=timedelta(seconds=0.05), progress=False)
    assert short.verdict
    with pytest.raises(augsim.UsageError, match="time_limit = 'soon': give seconds"):
        augsim.discover(model, data, time_limit="soon")


def test_a_robot_is_made_as_by_the_command_line(root, augsim_command, tmp_path):
    example = root / "fixtures" / "robots" / "example"
    model = augsim.from_robot(example / "arm.urdf", example / "log.csv", tmp_path / "arm", free=["viscous"])
    augsim_command("model", "from-robot", example / "arm.urdf", example / "log.csv", "--free", "viscous", "--out", tmp_path / "same")
    for name in ("model.toml", "data.csv", "arm.urdf"):
        written = (tmp_path / "arm" / name).read_text(), (tmp_path / "same" / name).read_text()
        assert written[0] == written[1], name
    assert model.to_toml() == (tmp_path / "arm" / "model.toml").read_text()
    with pytest.raises(augsim.UsageError, match="there is no group 'masses'; there are: inertias, armature, viscous"):
        augsim.from_robot(example / "arm.urdf", example / "log.csv", tmp_path, free=["masses"])
    with pytest.raises(augsim.DataError, match="absent.urdf"):
        augsim.from_robot(tmp_path / "absent.urdf", example / "log.csv", tmp_path)
