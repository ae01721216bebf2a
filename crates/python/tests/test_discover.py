"""Contract: `discover` gives the same bytes from a frame as the command line from the file, reports progress, lets other threads
run, and stops when its caller is interrupted."""

import json
import threading
import time

import pandas
import polars
import pytest

import augsim


@pytest.fixture(scope="module")
def found(sealed):
    frame = pandas.read_csv(sealed / "bounces.csv")
    return augsim.discover(sealed / "model.toml", frame, seed=1, progress=False)


@pytest.fixture(scope="module")
def folder(sealed, augsim_command, tmp_path_factory):
    """Output folder of the command line."""
    out = tmp_path_factory.mktemp("discover")
    augsim_command("discover", sealed / "model.toml", sealed / "bounces.csv", "--seed", 1, "--out", out)
    return out


def test_drag_is_found_in_a_pandas_frame(found):
    assert found.verdict == "explained"
    [effect] = found.effects
    low, high = effect["parameters"]["k_per_m"]["ci95"]
    assert effect["kind"] == "quadratic-drag" and low < 0.031 < high
    assert found.sentence.startswith("The model lacks quadratic-drag (k_per_m = 0.03")
    assert found.error["augmented"]["rmse"] < 0.1 * found.error["calibrated"]["rmse"]


def test_the_bytes_are_those_of_the_command_line(found, folder):
    assert found.json == (folder / "result.json").read_text()
    assert found.model.to_toml() == (folder / "model.toml").read_text()


def test_the_page_is_that_of_the_command_line(sealed, folder, tmp_path):
    found = augsim.discover(sealed / "model.toml", sealed / "bounces.csv", progress=False)
    assert found.to_html(tmp_path / "page.html") == tmp_path / "page.html"
    assert (tmp_path / "page.html").read_text() == (folder / "report.html").read_text()


def test_every_form_of_a_table_is_read_alike(sealed, found):
    path = sealed / "bounces.csv"
    pandas_frame = pandas.read_csv(path)
    text = (sealed / "model.toml").read_text()
    forms = {
        "path": str(path),
        "polars": polars.read_csv(path),
        "dict": {name: column.to_numpy() for name, column in pandas_frame.items()},
        "read": augsim.read(pandas_frame),
        "to_dict": augsim.read(path).to_dict(),
        "records": pandas_frame.to_records(index=False),
        "every second row of a wider frame": pandas_frame.loc[pandas_frame.index.repeat(2)].iloc[::2],
    }
    for name, form in forms.items():
        assert augsim.read(form).to_dict().keys() == augsim.read(path).to_dict().keys(), name
    again = augsim.discover(augsim.Model(text), forms["polars"], progress=False)
    assert again.json == found.json


def test_a_notebook_shows_sentence_table_and_figures(found):
    shown = found._repr_html_()
    assert shown.startswith("<iframe srcdoc=") and "quadratic-drag" in shown
    assert "Error on held-out data" in shown and "&lt;table" in shown and "&lt;svg" in shown
    assert "<script" not in shown and "&lt;script" not in shown
    figures = found.plot()
    assert len(figures) >= 3 and all(svg.startswith("<svg") for svg in figures)
    assert any("held-out trajectories" in title for title in figures.titles)


def test_figures_are_written(found, tmp_path):
    paths = found.plot()[:2].save(tmp_path / "figures")
    assert [p.name for p in paths] == ["1.svg", "2.svg"]
    assert paths[1].read_text() == found.plot()[1]


def test_progress_is_reported_step_by_step(sealed):
    told = []
    augsim.discover(
        sealed / "model.toml", sealed / "bounces.csv", progress=lambda step, share: told.append((step, share))
    )
    steps = [step for step, _ in told]
    assert steps[0] == "finding events and estimating the noise" and "fitting candidate effects" in steps


def test_exceptions_of_progress_are_raised(sealed):
    def refuse(step, share):
        raise KeyError(step)

    with pytest.raises(KeyError, match="finding events"):
        augsim.discover(sealed / "model.toml", sealed / "bounces.csv", progress=refuse)


def test_other_threads_run_meanwhile(sealed):
    beats, done = [], threading.Event()

    def beat():
        while not done.wait(0.005):
            beats.append(time.monotonic())

    thread = threading.Thread(target=beat)
    thread.start()
    begun = time.monotonic()
    augsim.discover(sealed / "model.toml", sealed / "bounces.csv", progress=False)
    seconds = time.monotonic() - begun
    done.set()
    thread.join()
    during = sum(begun < b < begun + seconds for b in beats)
    assert during >= 5, f"{during} beats in {seconds:.2f} s"


def test_an_interrupted_search_comes_back_at_once_and_ends_soon(sealed):
    def interrupt(step, share):
        if step == "fitting candidate effects":
            raise KeyboardInterrupt

    begun = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        augsim.discover(sealed / "model.toml", sealed / "bounces.csv", progress=interrupt)
    assert time.monotonic() - begun < 30

    def is_idle():
        used = time.process_time()
        time.sleep(0.2)
        return time.process_time() - used < 0.05

    # The search runs until its next progress report; then no thread may remain.
    while not is_idle():
        assert time.monotonic() - begun < 60, "the search still runs"


def test_effects_are_allowed_and_excluded_by_name(sealed):
    def effects(**choice):
        found = augsim.discover(sealed / "model.toml", sealed / "bounces.csv", null_runs=0, progress=False, **choice)
        return [effect["kind"] for effect in found.effects]

    assert effects(only=["quadratic-drag", "linear-drag"]) == ["quadratic-drag"]
    assert "quadratic-drag" not in effects(exclude=["quadratic-drag"])
    with pytest.raises(augsim.UsageError, match="is called `quadratic-drak`; did you mean quadratic-drag"):
        effects(only=["quadratic-drak"])
    with pytest.raises(augsim.UsageError, match="no effect is left"):
        effects(only=["magnus"], exclude=["magnus"])
    with pytest.raises(augsim.UsageError, match="lists of names"):
        effects(only="magnus")


def test_groups_are_asked_for_by_name(sealed):
    with pytest.raises(augsim.UsageError, match="--group A: no trajectory is in this group"):
        augsim.discover(sealed / "model.toml", sealed / "bounces.csv", groups=["A"], progress=False)
    with pytest.raises(augsim.UsageError, match="lists of names"):
        augsim.discover(sealed / "model.toml", sealed / "bounces.csv", groups="A", progress=False)


def test_a_system_of_equations_is_discovered_as_by_the_command_line(root, augsim_command, tmp_path):
    system = root / "fixtures" / "systems" / "pendulum"
    frame = pandas.read_csv(system / "swings.csv")
    found = augsim.discover(system / "model.toml", frame, progress=False)
    augsim_command("discover", system / "model.toml", system / "swings.csv", "--seed", 1, "--out", tmp_path)
    assert json.loads(found.json)["sentence"].startswith("The model lacks coulomb")
    assert found.json == (tmp_path / "result.json").read_text()
