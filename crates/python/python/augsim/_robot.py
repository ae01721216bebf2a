"""Models of robots from their descriptions."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from . import _augsim
from ._errors import UsageError
from ._model import Model
from ._tables import source

#: Groups of properties that can be freed.
FREE = ("inertias", "armature", "viscous")


def from_robot(
    robot: str | os.PathLike[str],
    log: Any,
    folder: str | os.PathLike[str],
    *,
    joints: Sequence[str] = (),
    position: Mapping[str, str] | None = None,
    torque: Mapping[str, str] | None = None,
    formulation: str | None = None,
    gravity: Sequence[float] | None = None,
    free: Sequence[str] = (),
) -> Model:
    """Makes the model of a robot from its URDF or MJCF file and a log of its joints, as ``augsim model from-robot`` does.

    ``log`` is any argument of :func:`augsim.read`. Writes ``model.toml``, ``data.csv`` (the filtered log) and a copy of the description
    into ``folder``; ``augsim.discover(model, folder / "data.csv")`` then finds what the joints lack. ``joints`` are those that
    move, ``position`` and ``torque`` expressions of columns for joints (``{"joint1": "0.01 * current_A"}``), ``formulation`` is
    ``"inverse"``, ``"forward"`` or ``None`` (as the log has torques or commands), ``gravity`` three numbers in m/s^2 in the frame of the base, and
    ``free`` names what a fit may change of the description: ``"inertias"``, ``"armature"``, ``"viscous"``.
    """
    for name, value in (("joints", joints), ("free", free)):
        if isinstance(value, str):
            raise UsageError(f"{name} is a list of names; write [{value!r}] for one")
    for group in free:
        if group not in FREE:
            raise UsageError(f"free: there is no group {group!r}; there are: {', '.join(FREE)}")
    if formulation not in (None, "inverse", "forward"):
        raise UsageError(f"formulation = {formulation!r}: give 'inverse', 'forward' or None")
    if gravity is not None and len(gravity) != 3:
        raise UsageError(f"gravity = {gravity!r}: give three numbers, such as (0.0, 0.0, -9.81)")
    model, _ = _augsim.from_robot(
        os.fspath(robot),
        source(log),
        os.fspath(folder),
        joints=list(joints),
        positions=list((position or {}).items()),
        torques=list((torque or {}).items()),
        is_forward=None if formulation is None else formulation == "forward",
        gravity=None if gravity is None else tuple(float(g) for g in gravity),
        free=tuple(group in free for group in FREE),
    )
    return Model._of(model)
