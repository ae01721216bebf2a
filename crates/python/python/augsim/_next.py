"""The next experiment: designed to separate the explanations of the data, and judged when it has come."""

from __future__ import annotations

import json
import math
import os
import tempfile
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from . import _augsim, _progress
from ._discovery import Discovery
from ._errors import UsageError
from ._model import whole
from ._tables import source

#: Files in the folder of a plan.
PLAN, REPORT = "plan.json", "report.html"


class Plan:
    """Designed runs with the odds that they are promised to reach; from :func:`augsim.next` or :meth:`augsim.Discovery.next`.

    ``Plan(folder)`` opens the folder of ``augsim next``, of ``augsim listen`` or of :meth:`save`.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self._inner = _augsim.Plan.read(folder)

    @classmethod
    def _of(cls, inner: _augsim.Plan) -> Plan:
        plan = cls.__new__(cls)
        plan._inner = inner
        return plan

    @cached_property
    def json(self) -> str:
        """``plan.json`` of ``augsim next`` or ``augsim listen``, byte for byte for the same paths."""
        return self._inner.json()

    @cached_property
    def result(self) -> dict[str, Any]:
        """The same as a dict: ``explanations``, ``plan``, ``promise``, ``heard``, … Log odds and log densities are in nats."""
        return json.loads(self.json)

    @property
    def sentence(self) -> str:
        """The plan with its promise, or what the recordings say, in a sentence or two."""
        return self.result["sentence"]

    @property
    def verdict(self) -> str:
        """``plan`` (no run was heard), ``enough`` (one explanation is left), ``more``, or ``none-fits``."""
        return self.result["verdict"]

    @property
    def explanations(self) -> list[dict[str, Any]]:
        """The explanations: ``name``, ``weight``, ``log_e_value`` (evidence against it, nats), ``rejected``, ``model_toml``, …"""
        return self.result["explanations"]

    @property
    def promise(self) -> dict[str, Any] | None:
        """What is promised: ``runs``, ``is_enough``, ``share`` (of simulated cases), ``log_odds`` (nats); ``None`` for one explanation."""
        return self.result["promise"]

    @cached_property
    def runs(self) -> list[dict[str, np.ndarray]]:
        """Inputs of the designed runs: for each a dict of arrays ``[time]``, ``t_s`` in seconds and each input in its unit."""
        return [_columns(text) for _, text in self._inner.files()]

    def listen(self, data: Any) -> Plan:
        """Judges new recordings, one after the other, as ``augsim listen`` does; ``data`` is any argument of :func:`augsim.read`.

        The result has the verdict and the weights; its ``next`` designs further runs.
        """
        return Plan._of(self._inner.listen(source(data)))

    def next(
        self,
        *,
        limits: str | os.PathLike[str] | Mapping[str, Any] | None = None,
        budget: int = 4,
        odds: float = 1000.0,
        sequences: int = 200,
        seed: int = 1,
        progress: bool | _progress.Progress = True,
    ) -> Plan:
        """Designs the next runs from what is known after the recordings that were heard; see :func:`augsim.next`."""
        return next(self, limits=limits, budget=budget, odds=odds, sequences=sequences, seed=seed, progress=progress)

    def to_html(self, path: str | os.PathLike[str]) -> Path:
        """Writes the page of the plan, or of the judgement, and returns its path."""
        path, page = Path(path), self._inner.page()
        if page is None:
            raise UsageError(f"the folder of the plan has no {REPORT}; design the runs again with augsim.next")
        path.write_text(page, encoding="utf-8")
        return path

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Writes ``plan.json``, the inputs ``run-1.csv``, … and ``report.html`` into a folder, which is made if it does not exist."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / PLAN).write_text(self.json, encoding="utf-8")
        for name, text in self._inner.files():
            (folder / name).write_text(text, encoding="utf-8")
        self.to_html(folder / REPORT)
        return folder

    def __repr__(self) -> str:
        return f"<augsim.Plan: {self.verdict}. {self.sentence}>"


def next(
    explanations: Any,
    data: Any = None,
    *,
    limits: str | os.PathLike[str] | Mapping[str, Any] | None = None,
    budget: int = 4,
    odds: float = 1000.0,
    sequences: int = 200,
    seed: int = 1,
    is_fitted_to_data: bool = False,
    progress: bool | _progress.Progress = True,
) -> Plan:
    """Designs the runs that separate explanations of the data, and promises their odds, as ``augsim next`` does.

    ``explanations`` is a :class:`Discovery`, a :class:`Plan`, a folder of a discovery, fit or plan, a fitted model file, or a list of these. ``data``
    are the recordings so far, any argument of :func:`read`, from which the parameters are estimated again, unless
    ``is_fitted_to_data`` says that the models were fitted to them; without data the parameters are distributed as the models say.
    ``limits`` is a file of limits or a dict with its tables: ``duration_s``, ``sample_s`` (s), ``inputs``, ``ranges``, ``starts`` (in the units
    of their names). ``budget`` is the largest number of runs, ``odds`` the required odds to 1 against every other explanation,
    ``sequences`` the number of simulated sequences for each explanation, from which the odds are promised.

    Raises :class:`augsim.DataError`, :class:`augsim.ModelError`, :class:`augsim.NumericalError` or :class:`augsim.UsageError`.

    >>> plan = augsim.next(found, recordings, limits={"duration_s": 8.0, "inputs": {"force_N": {"range": [-1.5, 1.5]}}})
    >>> plan.sentence, plan.runs[0]["force_N"]
    >>> heard = plan.listen(new_recording)
    >>> heard.verdict
    """
    given = list(explanations) if isinstance(explanations, (list, tuple)) else [explanations]
    if not isinstance(odds, (int, float)) or not 1.0 < odds < math.inf:
        raise UsageError(f"odds = {odds!r}: give a number above 1")
    options = {name: whole(name, value) for name, value in (("budget", budget), ("sequences", sequences), ("seed", seed))}
    for name, (least, most) in {"budget": (1, 50), "sequences": (20, 100_000)}.items():
        if not least <= options[name] <= most:
            raise UsageError(f"{name} = {options[name]}: give a whole number from {least} to {most}")
    reporter = _progress.reporter_for(progress)
    with tempfile.TemporaryDirectory() as scratch:
        folders = [_folder(one, Path(scratch) / str(k)) for k, one in enumerate(given)]
        try:
            planned = _augsim.next(
                folders,
                None if data is None else source(data),
                is_fitted_to_data=is_fitted_to_data,
                limits=_limits(limits, Path(scratch)),
                odds=float(odds),
                progress=reporter,
                **options,
            )
        finally:
            _progress.clear(reporter)
    return Plan._of(planned)


def _folder(explanation: Any, scratch: Path) -> Path:
    """Path of an explanation; a discovery in memory is written to `scratch`."""
    if isinstance(explanation, Discovery):
        return explanation.save(scratch)
    if isinstance(explanation, Plan):
        scratch.mkdir()
        (scratch / PLAN).write_text(explanation.json, encoding="utf-8")
        return scratch
    if isinstance(explanation, (str, os.PathLike)):
        return Path(explanation)
    kind = type(explanation).__name__
    raise UsageError(f"an explanation of type {kind}: give an augsim.Discovery, an augsim.Plan, a folder of a discovery, fit or plan, or a model file")


def _limits(limits: Any, scratch: Path) -> Path | None:
    """Path of a file of limits; a dict is written to `scratch`."""
    if limits is None or isinstance(limits, (str, os.PathLike)):
        return None if limits is None else Path(limits)
    if not isinstance(limits, Mapping):
        raise UsageError(f"limits of type {type(limits).__name__}: give a dict or a file of limits")
    path = scratch / "limits.toml"
    path.write_text("".join(f"{json.dumps(str(name))} = {_toml(value)}\n" for name, value in limits.items()), encoding="utf-8")
    return path


def _toml(value: Any) -> str:
    """A value of a file of limits as TOML: numbers, lists, tables in one line."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{json.dumps(str(name))} = {_toml(v)}" for name, v in value.items()) + " }"
    if isinstance(value, (Sequence, np.ndarray)) and not isinstance(value, str):
        return "[" + ", ".join(_toml(v) for v in value) + "]"
    try:
        return repr(float(value))
    except (TypeError, ValueError):
        raise UsageError(f"limits: {value!r} is no number; give numbers, lists of two numbers, and dicts of these") from None


def _columns(text: str) -> dict[str, np.ndarray]:
    """Columns of a CSV file of inputs."""
    head, *lines = text.splitlines()
    rows = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    return {name: rows[:, k].copy() for k, name in enumerate(head.split(","))}
