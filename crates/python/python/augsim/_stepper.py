"""Step-by-step forecasts for control loops."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _augsim
from ._errors import UsageError
from ._model import whole
from ._tables import numbers


class Stepper:
    """Forecasts one trajectory step by step: current state to distribution of the next state. Made by :meth:`augsim.Run.stepper`.

    ``mean`` and ``sd``, shape ``[S]``, are the same arrays at every step and are overwritten; nothing is allocated after the first
    step. Use a separate stepper in each thread.
    """

    def __init__(self, run: Any) -> None:
        self._columns = run.columns
        size = len(self._columns)
        self._state = np.zeros(size)
        #: Mean of the next state, in the units of the run's columns.
        self.mean = np.zeros(size)
        #: Standard deviation of the next state; 0 for the networks of the paper, whose draws differ in the latent only.
        self.sd = np.zeros(size)
        self._inner = _augsim.Stepper(run._inner, self._state, self.mean, self.sd)

    def begin(self, start: Any, index: int = 0) -> None:
        """Starts a trajectory at ``start``, shape ``[S]``. ``index`` numbers the trajectory: its random draws and latent are those of
        ``Run.sample`` with ``n=1`` and ``first=index``."""
        self._take(start)
        self._inner.begin(whole("index", index))

    def step(self, state: Any = None) -> tuple[np.ndarray, np.ndarray]:
        """Returns mean and standard deviation of the state one step after ``state``, shape ``[S]``, or after the latest given state.

        The networks of the paper (Neural, Hybrid) continue from the start of the trajectory by their memory and ignore the state.
        """
        if state is not None:
            self._take(state)
        self._inner.step(state is not None)
        return self.mean, self.sd

    def _take(self, state: Any) -> None:
        try:
            # Real arrays are copied directly; other types need checks, because complex parts and masks would be lost.
            if type(state) is not np.ndarray or state.dtype.kind not in "fiub":
                state = numbers("state", state)
            if state.shape != self._state.shape:
                raise ValueError("another shape")
            self._state[:] = state
        except (TypeError, ValueError):
            names = ", ".join(self._columns)
            raise UsageError(f"state {state!r}: give {len(self._state)} numbers: {names}") from None
        if not np.isfinite(self._state).all():
            raise UsageError(f"state {state!r}: holds NaN or an infinite number; give finite ones")
