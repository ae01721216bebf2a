"""Trajectories that our generators make: for examples, and for trying things out. The same seed gives the bytes of
``augsim simulate``."""

from __future__ import annotations

from . import _augsim
from ._data import Data
from ._model import Model, whole

__all__ = ["drops", "pushes"]


def drops(trajectories: int, *, samples: int = 400, seed: int = 1) -> Data:
    """Drops of the paper's law: ``height_m`` and ``velocity_m_s`` at 60 Hz, a restitution of its own for each drop."""
    return Data._of(_augsim.drops(whole("trajectories", trajectories), whole("samples", samples), whole("seed", seed)))


def pushes(trajectories: int, *, surface: str = "abs", shape: str = "rect1", seed: int = 1) -> tuple[Data, Model]:
    """Pushes of the virtual laboratory, laid out as the MIT set, and the model that is declared for them.

    The data hide a friction map of each push's own, another limit surface and contact friction, and inertia above 50 mm/s.
    """
    data, model = _augsim.pushes(whole("trajectories", trajectories), surface, shape, whole("seed", seed))
    return Data._of(data), Model._of(model)
