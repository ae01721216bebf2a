"""Trained networks."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from . import _augsim, _progress
from ._data import Data
from ._discovery import Discovery
from ._errors import UsageError
from ._model import Model, whole
from ._stepper import Stepper
from ._tables import numbers, source


class Run:
    """A trained network: the result of :func:`train`, or a run directory of ``augsim train``.

    Forecasts use only the first state and, for systems with actions, the actions.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self._inner = _augsim.read_run(os.fspath(folder))

    @classmethod
    def _of(cls, inner: _augsim.Run) -> Run:
        run = cls.__new__(cls)
        run._inner = inner
        return run

    @property
    def columns(self) -> list[str]:
        """Names of the state columns S; each ends in its unit."""
        return self._inner.columns()[0]

    @property
    def action_columns(self) -> list[str]:
        """Names of the action columns A; ``t_s`` is the time of the sample. Empty for systems without actions."""
        return self._inner.columns()[1]

    @property
    def recipe(self) -> str:
        """Name of the network in tables."""
        return self._inner.settings()[0]

    @property
    def iterations(self) -> int:
        """Number of training iterations."""
        return self._inner.settings()[1]

    @property
    def seed(self) -> int:
        """Seed of the training, and default seed of forecasts."""
        return self._inner.settings()[2]

    @property
    def parameters(self) -> int:
        """Number of parameters."""
        return self._inner.settings()[3]

    @property
    def notes(self) -> list[str]:
        """Notes about ignored parts of the model and suspicious data."""
        return self._inner.notes

    def sample(self, start: Any, actions: Any, n: int, seed: int | None = None, first: int = 0) -> np.ndarray:
        """Draws samples of forecasts: an array ``[batch, sample, time, S]`` of 32-bit floats, in the units of :attr:`columns`.

        ``start`` has first states, shape ``[batch, S]`` or ``[S]``. ``actions`` has the actions at every sample, shape
        ``[batch, time, A]``, or ``[time, A]`` for the whole batch; for systems without actions, the number of samples. The first
        sample is the start. Trajectory ``i`` of the batch has the random stream of trajectory ``first + i`` of a data set, as in
        ``augsim predict``.
        """
        begin = np.atleast_2d(numbers("start", start))
        if begin.ndim != 2 or begin.shape[1] != len(self.columns):
            raise UsageError(f"start: an array of shape {np.shape(start)}; give [batch, {len(self.columns)}]: {', '.join(self.columns)}")
        width = len(self.action_columns)
        if isinstance(actions, (int, np.integer)):
            if width:
                raise UsageError(f"actions: give an array [time, {width}]: {', '.join(self.action_columns)}")
            acted = np.empty((1, whole("actions", actions), 0))
        else:
            acted = numbers("actions", actions)
            acted = acted[np.newaxis] if acted.ndim == 2 else acted
        if acted.ndim != 3 or acted.shape[2] != width or acted.shape[0] not in (1, len(begin)):
            raise UsageError(f"actions: an array of shape {np.shape(actions)}; give [{len(begin)}, time, {width}] or [time, {width}]")
        for name, array in (("start", begin), ("actions", acted)):
            if not np.isfinite(array).all():
                raise UsageError(f"{name}: holds NaN or an infinite number; give finite ones")
        if len(begin) == 0 or acted.shape[1] == 0:
            raise UsageError("start and actions: there is none; give at least one trajectory and one sample")
        drawn = None if seed is None else whole("seed", seed)
        shape, n = (len(begin), acted.shape[1]), whole("n", n)
        memory = self._inner.sample(begin, acted, shape, n, drawn, whole("first", first))
        return np.frombuffer(memory, dtype=np.float32).reshape(len(begin), n, shape[1], begin.shape[1])

    def predict(self, data: Any, samples: int = 100) -> Data:
        """Forecasts each trajectory from its first state, as ``augsim predict`` does: mean, median, 50 and 90 % bands."""
        return Data._of(self._inner.predict(source(data), whole("samples", samples)))

    def stepper(self) -> Stepper:
        """Returns a stepper for control loops: current state to distribution of the next state. Networks of pushes need the whole path
        of the pusher, so they have no stepper."""
        return Stepper(self)

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Writes the run directory, for ``augsim predict`` and :class:`Run`; returns its path."""
        self._inner.save(os.fspath(folder))
        return Path(folder)

    def __repr__(self) -> str:
        return f"<augsim.Run: {self.recipe} of {self.parameters} parameters, {self.iterations} iterations, on {', '.join(self.columns)}>"


def train(
    data: Any,
    recipe: str = "hybrid-plus",
    residual_of: str | os.PathLike[str] | Model | Discovery | None = None,
    *,
    iterations: int = 10_000,
    seed: int = 1,
    accept: Sequence[str] = (),
    progress: bool | _progress.Progress = True,
) -> Run:
    """Trains a network on measured trajectories, with the same weights as ``augsim train`` for the same seed.

    ``recipe`` is a value of ``augsim train --recipe``; the error of an unknown one lists all. The network corrects
    ``residual_of``: a :class:`Model`, the augmented one of a :class:`Discovery`, the path of a model file or of the folder of
    ``augsim discover``, or ``"pybullet-ball"``, the ball of the paper's experiment. There is no default system, so one of them is required.
    Other Python threads continue to run, and Ctrl-C stops the training.
    """
    if isinstance(accept, str):
        raise UsageError("accept is a list of names; write ['name'] for one")
    reporter = _progress.reporter_for(progress)
    try:
        run = _augsim.train(
            source(data),
            recipe=recipe,
            residual_of=_corrected(residual_of),
            iterations=whole("iterations", iterations),
            seed=whole("seed", seed),
            accept=[str(check) for check in accept],
            progress=reporter,
        )
    finally:
        _progress.clear(reporter)
    return Run._of(run)


def _corrected(residual_of: Any) -> Any:
    if isinstance(residual_of, Discovery):
        residual_of = residual_of.model
    if isinstance(residual_of, Model):
        return residual_of._inner
    return None if residual_of is None else os.fspath(residual_of)
