"""Trajectories in memory."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from . import _augsim
from ._tables import source


class Data:
    """Trajectories with the same columns, as returned by :func:`augsim.read`.

    Every function with a data argument accepts it. ``data["height_m"]`` is a column, concatenated over all trajectories.
    """

    def __init__(self, data: Any) -> None:
        self._inner = _augsim.read(source(data))

    @classmethod
    def _of(cls, inner: _augsim.Data) -> Data:
        data = cls.__new__(cls)
        data._inner = inner
        return data

    @property
    def _source(self) -> _augsim.Source:
        return self._inner.source()

    @property
    def columns(self) -> list[str]:
        """Names of the measured columns; each ends in its unit."""
        return [name for name, _ in self._inner.columns()]

    @property
    def units(self) -> dict[str, str]:
        """Symbol of the unit of each column; empty for a dimensionless column."""
        return dict(self._inner.columns())

    @property
    def trajectories(self) -> list[str]:
        """Identifiers, in the order of the file."""
        return [name for name, _, _ in self._inner.trajectories()]

    @property
    def lengths(self) -> list[int]:
        """Number of samples of each trajectory."""
        return [length for _, _, length in self._inner.trajectories()]

    @property
    def groups(self) -> list[str | None]:
        """Group of each trajectory; ``None`` if the data have no column ``group``."""
        return [group for _, group, _ in self._inner.trajectories()]

    def __len__(self) -> int:
        """Number of trajectories."""
        return len(self._inner.trajectories())

    def __getitem__(self, column: str) -> np.ndarray:
        """Values of a column (or ``t_s``, seconds), shape ``[samples]`` over all trajectories; NaN is a missing value."""
        return np.frombuffer(self._inner.series(column))

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """Iterates over trajectories as dicts: ``trajectory``, ``group``, ``t_s`` and the columns, shape ``[samples]`` each."""
        series = {name: self[name] for name in ["t_s", *self.columns]}
        first = 0
        for name, group, length in self._inner.trajectories():
            here = slice(first, first + length)
            first += length
            yield {"trajectory": name, "group": group, **{c: v[here] for c, v in series.items()}}

    def to_dict(self) -> dict[str, Any]:
        """All columns in long form: ``trajectory``, ``group`` if there are groups, ``t_s``, then the measured columns."""
        rows = self._inner.trajectories()
        long: dict[str, Any] = {"trajectory": [name for name, _, n in rows for _ in range(n)]}
        if any(group is not None for _, group, _ in rows):
            long["group"] = [group for _, group, n in rows for _ in range(n)]
        return long | {name: self[name] for name in ["t_s", *self.columns]}

    def to_pandas(self) -> Any:
        """All columns as a pandas frame in long form."""
        import pandas

        return pandas.DataFrame(self.to_dict())

    def to_csv(self, path: str | os.PathLike[str]) -> Path:
        """Writes the trajectories to a file that :func:`augsim.read` and the command line read; returns its path."""
        self._inner.write(os.fspath(path))
        return Path(path)

    def __repr__(self) -> str:
        columns = ", ".join(self.columns)
        return f"<augsim.Data: {len(self)} trajectories, {sum(self.lengths)} samples of {columns}>"


def read(data: Any) -> Data:
    """Reads trajectories.

    ``data`` is a path (CSV plain or gzip, NPZ, a published push file or a folder of them), a pandas or polars frame, or a dict
    of one-dimensional arrays. A table has a row for each sample and the columns of a file: ``trajectory``, ``t_s`` (seconds,
    increasing), and measured columns whose names end in their unit (``height_m``, ``velocity_m_s``, ``theta_rad``, …). NaN is a
    missing value, ``group`` a label. A table is read like the equivalent CSV file, so line 1 in a message is the header.

    Raises :class:`augsim.DataError`, which names the line, the column and a remedy.
    """
    return Data(data)
