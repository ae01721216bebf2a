"""A net in a control loop."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _augsim
from ._errors import UsageError
from ._model import whole
from ._tables import numbers


class Stepper:
    """One trajectory, one step at a time: state in, distribution of the next state out. :meth:`augsim.Run.stepper` makes it.

    ``mean`` and ``sd``, shape ``[S]``, are the same arrays at every step, which writes over them; nothing is allocated after the
    first. A stepper belongs to one thread at a time; threads take one each.
    """

    def __init__(self, run: Any) -> None:
        self._columns = run.columns
        size = len(self._columns)
        self._state = np.zeros(size)
        #: Mean of the next state, in the units of the run's columns.
        self.mean = np.zeros(size)
        #: Its standard deviation; 0 for the paper's nets, whose draws differ by their latent alone.
        self.sd = np.zeros(size)
        self._inner = _augsim.Stepper(run._inner, self._state, self.mean, self.sd)

    def begin(self, start: Any, index: int = 0) -> None:
        """Begins at ``start``, shape ``[S]``. ``index`` numbers the trajectory: what it draws, and the latent that it keeps, are those
        of ``Run.sample`` with ``n=1`` and ``first=index``."""
        self._take(start)
        self._inner.begin(whole("index", index))

    def step(self, state: Any = None) -> tuple[np.ndarray, np.ndarray]:
        """Mean and standard deviation of the state one step after ``state``, shape ``[S]``, or after that which was given last.

        The paper's nets (Neural, Hybrid) go on from the start of the trajectory by their memory, whatever the state is.
        """
        if state is not None:
            self._take(state)
        self._inner.step(state is not None)
        return self.mean, self.sd

    def _take(self, state: Any) -> None:
        try:
            # A plain array of numbers is copied as it is; assigned to numbers, complex ones would lose a part and masks would go.
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
