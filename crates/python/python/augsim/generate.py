"""Generated trajectories for examples and tests. The same seed gives the same data as ``augsim simulate``."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _augsim
from ._data import Data
from ._errors import UsageError
from ._model import Model, whole
from ._tables import numbers

__all__ = ["Laboratory", "drops", "pushes"]


def drops(trajectories: int, *, samples: int = 400, seed: int = 1) -> Data:
    """Generates the drops of the paper: ``height_m`` and ``velocity_m_s`` at 60 Hz, with a random restitution per drop."""
    return Data._of(_augsim.drops(whole("trajectories", trajectories), whole("samples", samples), whole("seed", seed)))


def pushes(trajectories: int, *, surface: str = "abs", shape: str = "rect1", seed: int = 1) -> tuple[Data, Model]:
    """Generates pushes in the layout of the MIT set in the virtual laboratory, and their declared model.

    The model lacks the friction map of each push, the true limit surface and contact friction, and inertia above 50 mm/s.
    """
    data, model = _augsim.pushes(whole("trajectories", trajectories), surface, shape, whole("seed", seed))
    return Data._of(data), Model._of(model)


class Laboratory:
    """The virtual laboratory, for single pushes with the same hidden effects as ``pushes``. ``surface`` is one of ``abs``,
    ``delrin``, ``plywood``, ``pu``; ``shape`` is an object of the MIT set."""

    def __init__(self, surface: str = "abs", shape: str = "rect1", *, seed: int = 1) -> None:
        self._inner = _augsim.Laboratory(surface, shape, whole("seed", seed))

    def pushed(self, start: Any, times: Any, rod: Any, index: int) -> np.ndarray:
        """Returns the true poses of the object, shape ``[T, 3]`` (``x_m``, ``y_m``, ``theta_rad``), at ``times`` (s, shape ``[T]``), from ``start``, shape
        ``[3]``, while the pusher is at ``rod`` (m, shape ``[T, 2]``). ``index`` numbers the push: each push has a different friction map."""
        pose, seconds, places = numbers("start", start), numbers("times", times), numbers("rod", rod)
        if pose.shape != (3,) or not np.isfinite(pose).all():
            raise UsageError(f"start: an array of shape {pose.shape}; give x_m, y_m, theta_rad, finite")
        if seconds.ndim != 1 or places.shape != (len(seconds), 2):
            raise UsageError(f"rod: an array of shape {places.shape}; give [time, 2] for the times, which are [time]")
        x, y = np.ascontiguousarray(places[:, 0]), np.ascontiguousarray(places[:, 1])
        memory = self._inner.pushed(pose, seconds, x, y, whole("index", index))
        return np.frombuffer(memory, dtype=np.float64).reshape(-1, 3)
