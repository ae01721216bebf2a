"""Models to start from, for recordings in any layout."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import _augsim
from ._data import Data
from ._errors import UsageError
from ._model import Model
from ._tables import source


@dataclass(frozen=True)
class Start:
    """Result of :func:`start`."""

    #: The recordings, with columns in SI units.
    data: Data
    #: The model file: a ball, pushes, or drafted equations to be replaced; ``None`` if no column varies.
    model: Model | None
    #: Text of the model file with its comments.
    text: str | None
    #: What the recordings show, such as ``throws in a plane``.
    recording: str
    #: Assumptions about layout, units and columns.
    assumptions: list[str]
    #: Height of the floor on which an object bounces, m; ``None`` without impacts.
    floor_height_m: float | None
    #: Columns that drafted equations take as inputs.
    inputs: list[str]
    #: Columns that drafted equations predict.
    outputs: list[str]

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Writes ``data.csv`` and ``model.toml`` into a folder, which is made if it does not exist."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        self.data.to_csv(folder / "data.csv")
        if self.text is not None:
            (folder / "model.toml").write_text(self.text, encoding="utf-8")
        return folder


def start(
    data: Any,
    *,
    time: str | None = None,
    trajectory: str | None = None,
    columns: Mapping[str, str] | None = None,
    up: str | None = None,
    sep: str | None = None,
    decimal: str | None = None,
    rate_hz: float | None = None,
    name: str = "system",
) -> Start:
    """Reads recordings in any layout and drafts a model to start from, as ``augsim start`` does.

    ``data`` is a path, a list of paths, or any other argument of :func:`augsim.read`. The other arguments are for files, and what
    is not given is inferred: ``time`` names the time column, with its unit after a colon (``"clock:ms"``), ``trajectory`` the column of
    identifiers, ``columns`` maps names in the file to names with units, and the unit in the file after a colon (``{"x": "x_m:cm"}``), ``up`` is the
    coordinate that points upwards (``"-y"``: downwards), ``sep`` and ``decimal`` are characters, ``rate_hz`` is the frame rate, needed
    where times are frame numbers or absent. ``name`` is that of the system, for data in memory.

    Raises :class:`augsim.DataError`, :class:`augsim.UsageError`.
    """
    paths = _paths(data)
    if paths is None:
        given = {"time": time, "trajectory": trajectory, "columns": columns, "up": up, "sep": sep, "decimal": decimal, "rate_hz": rate_hz}
        for option, value in given.items():
            if value is not None:
                raise UsageError(f"{option} is for files; rename the columns of data in memory, such as 'height_m' and 't_s'")
        made = _augsim.start_table(source(data, name), name)
    else:
        mapped = [f"{old}={new}" for old, new in (columns or {}).items()]
        layout = (_character("sep", sep), _character("decimal", decimal), time, trajectory, mapped, up, None if rate_hz is None else float(rate_hz))
        made = _augsim.start_files(paths, layout)
    inner, text, recording, assumptions, floor, inputs, outputs = made
    model = None if text is None else Model(text)
    return Start(Data._of(inner), model, text, recording, assumptions, floor, inputs, outputs)


def _paths(data: Any) -> list[Path] | None:
    """The paths of recordings in files; ``None`` for data in memory."""
    if isinstance(data, (str, os.PathLike)):
        return [Path(data)]
    if isinstance(data, Sequence) and data and all(isinstance(path, (str, os.PathLike)) for path in data):
        return [Path(path) for path in data]
    return None


def _character(name: str, value: str | None) -> str | None:
    if value is not None and (not isinstance(value, str) or len(value) != 1):
        raise UsageError(f"{name} = {value!r}: give one character")
    return value
