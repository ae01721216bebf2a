"""Contract: tables are read like files; any content gives data or one clear exception, and never a panic."""

import random

import numpy as np
import pandas
import polars
import pytest

import augsim


def table(**changes):
    """Two drops of three samples."""
    columns = {
        "trajectory": ["a"] * 3 + ["b"] * 3,
        "t_s": [0.0, 0.1, 0.2] * 2,
        "height_m": [1.0, 0.95, 0.8, 2.0, 1.95, 1.8],
    }
    return {name: value for name, value in (columns | changes).items() if value is not None}


def test_a_table_has_columns_units_and_trajectories():
    data = augsim.read(table(group=["steel"] * 3 + ["glass"] * 3))
    assert data.columns == ["height_m"] and data.units == {"height_m": "m"}
    assert data.trajectories == ["a", "b"] and data.groups == ["steel", "glass"] and data.lengths == [3, 3]
    assert len(data) == 2 and "2 trajectories, 6 samples of height_m" in repr(data)
    np.testing.assert_array_equal(data["height_m"], table()["height_m"])
    first, second = data
    assert second["trajectory"] == "b"
    np.testing.assert_array_equal(second["t_s"], [0.0, 0.1, 0.2])
    back = augsim.read(data.to_pandas())
    np.testing.assert_array_equal(back["height_m"], data["height_m"])


def test_numbers_of_every_kind_are_numbers():
    heights = [1, 2, 3, 4, 5, 6]
    for kind in (np.int8, np.uint64, np.float32, np.float16, bool, object):
        data = augsim.read(table(height_m=np.array(heights, dtype=kind)))
        np.testing.assert_array_equal(data["height_m"], np.array(heights, dtype=kind).astype(float))
    wide = np.arange(12.0)[::-2]
    assert not wide.flags.c_contiguous
    np.testing.assert_array_equal(augsim.read(table(height_m=wide))["height_m"], wide)
    assert augsim.read(table(trajectory=[1.0] * 3 + [2.0] * 3)).trajectories == ["1", "2"]


def test_missing_values_are_gaps():
    for missing in (None, float("nan"), pandas.NA):
        frame = pandas.DataFrame(table(height_m=[1.0, missing, 0.8, 2.0, 1.9, 1.8]))
        values = augsim.read(frame)["height_m"]
        assert np.isnan(values[1]) and np.isfinite(values).sum() == 5
    assert np.isnan(augsim.read(polars.DataFrame(table(height_m=[1.0, None, 0.8, 2.0, 1.9, 1.8])))["height_m"][1])
    masked = np.ma.masked_array([1.0, 9999.0, 0.8, 2.0, 1.9, 1.8], mask=[0, 1, 0, 0, 0, 0])
    values = augsim.read(table(height_m=masked))["height_m"]
    assert np.isnan(values[1]) and np.isfinite(values).sum() == 5


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (3, "data of type int"),
        ({}, "no columns"),
        (pandas.DataFrame(), "no columns"),
        (pandas.DataFrame(columns=["trajectory", "t_s", "height_m"]), "no data rows|header"),
        (table(height_m=None), "column"),
        (table(t_s=None), "t_s"),
        (table(trajectory=None), "trajectory"),
        (table(height_m=[1.0]), "has 1 values, but"),
        (table(height_m=np.ones((6, 2))), "an array of 6×2 values"),
        (table(height_m=[[1.0], [2.0, 3.0], 1, 1, 1, 1]), "lengths|numbers"),
        (table(height_m=["high"] * 6), "height_m"),
        (table(mode=["free"] * 6), "put text labels into a column called `group`"),
        (table(height_m=np.array(["2020-01-01"] * 6, dtype="datetime64[s]")), "give numbers"),
        (table(height_m=np.ones(6, dtype=complex)), "give numbers"),
        (table(height_m=[1.0, np.inf, 1, 1, 1, 1]), "row 1: inf is no measurement"),
        (table(t_s=[0.0, np.nan, 0.2] * 2), "t_s"),
        (table(t_s=[0.0, 0.2, 0.1] * 2), "t_s"),
        (table(trajectory=["a", None, "a", "b", "b", "b"]), "row 1: no value"),
        (table(trajectory=["a", "b", "a", "b", "a", "b"]), "trajectory"),
        (table(height=[1.0] * 6), "unit"),
        (table(**{"7": [1.0] * 6}), "name"),
        ({3: [1.0]}, "names of columns are text"),
        (pandas.DataFrame([[1.0, 2.0]], columns=["t_s", "t_s"]), "twice"),
    ],
)
def test_invalid_data_are_rejected(data, sentence):
    with pytest.raises(augsim.DataError, match=sentence):
        augsim.read(data)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(augsim.DataError, match="absent.csv"):
        augsim.read(tmp_path / "absent.csv")


def random_cells(draw):
    """A column of random content."""
    rows = draw.choice([0, 1] + [6] * 12)
    kinds = [
        lambda: [draw.uniform(-2, 2) for _ in range(rows)],
        lambda: [draw.choice([draw.uniform(-2, 2), None, float("nan")]) for _ in range(rows)],
        lambda: [draw.choice([0.0, 1e308, -1e308, 5e-324, float("nan"), float("inf"), None]) for _ in range(rows)],
        lambda: [draw.choice(["a", "b", "", " ", "1", "nan", "\x00", "\x1b[1m", "ä" * 300, '"', "a,b"]) for _ in range(rows)],
        lambda: np.array([draw.randrange(-5, 5) for _ in range(rows)]).astype(draw.choice(["i1", "u2", "f2", ">f8", "c16", "?"])),
        lambda: np.zeros((rows, draw.randrange(3))),
        lambda: [draw.choice([[], {}, object(), b"x", 10**400, True]) for _ in range(rows)],
        lambda: sorted(draw.uniform(0, 1) for _ in range(rows)),
        lambda: np.array(["2020-01-01"] * rows, dtype="datetime64[D]"),
        lambda: draw.choice([None, 3, "text", object()]),
    ]
    return draw.choice(kinds)()


def test_no_table_causes_a_panic():
    names = ["trajectory", "group", "t_s", "height_m", "velocity_m_s", "x_m", "theta_rad", "height", "", "a b", "ß_m", "spin_rad_s"]
    draw = random.Random(20261122)
    outcomes = {"data": 0, "refused": 0}
    model = augsim.Model('scenario = "ball"\n[parameters]\ngravity_m_s2 = 9.81\n')
    for _ in range(1500):
        columns = table() if draw.random() < 0.8 else {}
        for name in draw.sample(names[3:] if draw.random() < 0.5 else names, draw.randrange(1, 3)):
            columns[name] = random_cells(draw)
        try:
            data = augsim.read(columns)
        except augsim.Error as error:
            outcomes["refused"] += 1
            assert str(error) and "\x1b" not in str(error)
            continue
        outcomes["data"] += 1
        assert len(data) >= 1 and sum(data.lengths) == len(data["t_s"])
        if outcomes["data"] % 10 == 0:
            try:
                augsim.discover(model, data, progress=False)
            except augsim.Error as error:
                assert str(error)
    assert min(outcomes.values()) > 50, outcomes
