"""Converts data arguments for the extension: pandas and polars frames, dicts of arrays, paths."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import _augsim
from ._errors import DataError

#: Columns of labels; all others are numeric.
LABELS = ("trajectory", "group")


def source(data: Any, title: str = "table") -> _augsim.Source:
    """Makes a source from a path, a frame, a list of frames, a dict of arrays, or the result of :func:`augsim.read`.

    ``title`` names a table in messages and reports.
    """
    existing = getattr(data, "_source", None)
    if isinstance(existing, _augsim.Source):
        return existing
    if isinstance(data, (str, os.PathLike)):
        return _augsim.Source.file(os.fspath(data))
    if isinstance(data, (list, tuple)) and data:
        data = _joined(data)
    if isinstance(data, Mapping):
        names: list[Any] = list(data.keys())
    elif hasattr(data, "columns") and hasattr(data, "__getitem__"):
        names = list(data.columns)
    elif isinstance(data, np.ndarray) and data.dtype.names:
        names = list(data.dtype.names)
    else:
        kind = type(data).__name__
        raise DataError(f"data of type {kind}: give a path, a pandas or polars frame, or a dict of arrays")
    for name in names:
        if not isinstance(name, str):
            raise DataError(f"the table's column {name!r}: names of columns are text, such as 'height_m'")
        if names.count(name) > 1:
            raise DataError(f"the table has the column `{name}` twice; rename one")
    columns = [(name, _column(name, data[name])) for name in names]
    if "trajectory" not in names and columns:
        # A table of one run.
        columns.insert(0, ("trajectory", ["1"] * len(columns[0][1])))
    return _augsim.Source.columns(title, columns)


def _joined(tables: Sequence[Any]) -> dict[str, Any]:
    """One table of several runs, each a frame or a dict; runs without a column `trajectory` are numbered."""
    runs = []
    for number, table in enumerate(tables, start=1):
        names = list(table.keys()) if isinstance(table, Mapping) else list(getattr(table, "columns", ()))
        if not names:
            raise DataError(f"run {number} of the list is of type {type(table).__name__}: give a frame or a dict of arrays")
        run = {name: _values(table[name]) for name in names}
        if runs and set(run) - {"trajectory"} != set(runs[0]) - {"trajectory"}:
            raise DataError(f"run {number} of the list has the columns {', '.join(map(str, names))}; give the same in every run")
        if "trajectory" not in run:
            run = {"trajectory": np.full(len(run[names[0]]), str(number))} | run
        runs.append(run)
    return {name: np.concatenate([run[name] for run in runs]) for name in runs[0]}


def _values(cells: Any) -> np.ndarray:
    return np.asanyarray(cells.to_numpy() if hasattr(cells, "to_numpy") else cells)


def _column(name: str, cells: Any) -> list[str] | np.ndarray:
    cells = cells.to_numpy() if hasattr(cells, "to_numpy") else cells
    try:
        values = np.asanyarray(cells)
    except ValueError as cause:
        raise DataError(f"the table's column `{name}`: rows of different lengths; give one value a row") from cause
    if values.ndim != 1:
        shape = "×".join(map(str, values.shape)) or "no"
        raise DataError(f"the table's column `{name}`: an array of {shape} values; give one value a row")
    if name in LABELS:
        return [_label(name, row, value) for row, value in enumerate(values.tolist())]
    if values.dtype.kind in "UT" or values.dtype.kind == "O" and any(isinstance(value, str) for value in values):
        # Text, such as a mode of operation. What needs numbers says so.
        return ["" if _is_missing(value) or value != value else str(value) for value in values.tolist()]
    if values.dtype.kind == "m":
        # Time differences are read in seconds.
        values = np.where(np.isnat(values), np.nan, values / np.timedelta64(1, "s"))
    return numbers(f"the table's column `{name}`", values)


def _label(name: str, row: int, value: Any) -> str:
    if isinstance(value, float) and value.is_integer():
        return str(int(value))
    if value is None or value != value:
        raise DataError(f"the table's column `{name}`, row {row}: no value; every row needs one")
    if isinstance(value, bytes):
        raise DataError(f"the table's column `{name}`, row {row}: bytes; give text or numbers")
    return str(value)


def numbers(place: str, values: Any) -> np.ndarray:
    """Converts values of any shape to a contiguous array of floats; missing values become NaN."""
    try:
        array = np.asarray(values)
    except ValueError as cause:
        raise DataError(f"{place}: rows of different lengths; give one value a row") from cause
    if array.dtype.kind == "O":
        array = np.array([np.nan if _is_missing(v) else v for v in array.ravel()], dtype=object).reshape(array.shape)
    elif array.dtype.kind not in "fiub":
        raise DataError(f"{place}: values of type {array.dtype}; give numbers")
    try:
        array = np.ascontiguousarray(array, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as cause:
        raise DataError(f"{place}: {cause}; give numbers") from cause
    # `asarray` ignores masks; masked values are missing.
    return np.where(values.mask, np.nan, array) if isinstance(values, np.ma.MaskedArray) else array


def _is_missing(value: Any) -> bool:
    return value is None or type(value).__name__ == "NAType"
