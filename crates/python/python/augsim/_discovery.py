"""Search for the effects that a model lacks."""

from __future__ import annotations

import html
import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import timedelta
from functools import cached_property
from pathlib import Path
from typing import Any

from . import _augsim, _progress
from ._data import Data
from ._errors import UsageError
from ._model import Model, _opened, explained, frame, scores, whole
from ._tables import source


#: Files in the folder of a discovery.
RESULT, MODEL, REPORT = "result.json", "model.toml", "report.html"


class Figures(Sequence[str]):
    """The figures of a report as SVG documents. A notebook shows them."""

    def __init__(self, figures: list[tuple[str, str]]) -> None:
        self._figures = figures

    @property
    def titles(self) -> list[str]:
        """Titles, in the order of the report."""
        return [title for title, _ in self._figures]

    def __len__(self) -> int:
        return len(self._figures)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return Figures(self._figures[index])
        return self._figures[index][1]

    def __iter__(self) -> Iterator[str]:
        return (svg for _, svg in self._figures)

    def save(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Writes ``1.svg``, ``2.svg``, … into a folder, which is made if it does not exist; returns their paths."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        paths = [folder / f"{number}.svg" for number in range(1, len(self) + 1)]
        for path, svg in zip(paths, self):
            path.write_text(svg, encoding="utf-8")
        return paths

    def _repr_html_(self) -> str:
        # Separate frames, because element ids and styles of figures would collide.
        frames = (_frame(f"<title>{html.escape(title)}</title>{svg}", 460) for title, svg in self._figures)
        return "".join(frames)


class Discovery:
    """Result of :func:`augsim.discover`. A notebook shows the sentence, the table of errors and the first figures.

    ``Discovery(folder)`` opens the folder of ``augsim discover`` or of :meth:`save`.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self._inner: Any = _Saved(Path(folder))

    @classmethod
    def _of(cls, inner: Any) -> Discovery:
        found = cls.__new__(cls)
        found._inner = inner
        return found

    @cached_property
    def json(self) -> str:
        """``result.json`` of ``augsim discover``, byte for byte."""
        return self._inner.json()

    @cached_property
    def result(self) -> dict[str, Any]:
        """The same as a dict."""
        return json.loads(self.json)

    @property
    def verdict(self) -> str:
        """The verdict in one word, such as ``explained`` or ``nothing-to-add``."""
        return self.result["verdict"]

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        return self.result["sentence"]

    @property
    def effects(self) -> list[dict[str, Any]]:
        """Established effects, sorted by their error reduction: ``kind``, ``parameters`` (``value``, ``ci95``,
        ``unit``), ``share``, ``inclusion``, ``q_value``, …"""
        return self.result["effects"]

    @property
    def leads(self) -> list[dict[str, Any]]:
        """Findings that are not established: ``kind``, ``inclusion``, ``chance``, ``why``, ``next``."""
        return self.result.get("leads", [])

    @property
    def error(self) -> dict[str, Any]:
        """Errors on held-out trajectories, in ``unit``: ``declared``, ``calibrated``, ``augmented``, ``noise_floor``, ``reduction``,
        each with ``rmse`` and ``ci95``."""
        return self.result["error"]

    @property
    def warnings(self) -> list[str]:
        """Warnings about suspicious data."""
        return [warning["text"] for warning in self.result.get("warnings", [])]

    @cached_property
    def model(self) -> Model:
        """The augmented model."""
        return Model._of(self._inner.model())

    def to_html(self, path: str | os.PathLike[str]) -> Path:
        """Writes the report as a self-contained page and returns its path."""
        path = Path(path)
        path.write_text(self._inner.page(path.parent), encoding="utf-8")
        return path

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Writes ``result.json``, ``model.toml`` and ``report.html`` into a folder, which is made if it does not exist."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / RESULT).write_text(self.json, encoding="utf-8")
        (folder / MODEL).write_text(self.model.to_toml(), encoding="utf-8")
        self.to_html(folder / REPORT)
        return folder

    def predict(self, data: Any, *, burn_in: int = 5, samples: int = 400, seed: int = 1) -> Data:
        """Predicts trajectories with the augmented model; see :meth:`augsim.Model.predict`."""
        return self.model.predict(data, burn_in=burn_in, samples=samples, seed=seed)

    def residuals(self, data: Any, *, burn_in: int = 5) -> dict[str, Any]:
        """Measured minus predicted values of the augmented model; see :meth:`augsim.Model.residuals`."""
        return self.model.residuals(data, burn_in=burn_in)

    def evaluate(self, data: Any, *, burn_in: int = 5, samples: int = 400, seed: int = 1) -> Any:
        """Errors of the declared, the calibrated and the augmented model on ``data``, as :meth:`augsim.Model.evaluate` gives them.

        Column ``model`` names the model. Give recordings that the discovery has not seen: errors on others are too small.
        """
        columns: dict[str, list[Any]] = {}
        for name, model in self._models().items():
            scored = scores(model, data, burn_in, samples, seed)
            for column, values in ({"model": [name] * len(scored["rmse"])} | scored).items():
                columns.setdefault(column, []).extend(values)
        return frame(columns)

    def _models(self) -> dict[str, Model]:
        """The declared, the calibrated and the augmented model."""
        function = self.model._inner.function()
        texts = self.result.get("models", {})
        models = {}
        for name in ("declared", "calibrated"):
            if text := texts.get(f"{name}_toml"):
                opened = _augsim.Model.external(text, function) if function else _augsim.Model.parse(text, self._inner.place())
                models[name] = Model._of(opened)
        return models | {"augmented": self.model}

    def next(self, data: Any = None, **options: Any) -> Any:
        """Designs the runs that separate the named model from its live rivals: a :class:`augsim.Plan`.

        ``data`` are the recordings of the discovery; without them the parameters are distributed as their intervals say. ``options``
        are those of :func:`augsim.next`: ``limits`` (s, and the units of the names), ``budget`` (runs), ``odds``, ``sequences``, ``seed``.
        """
        from ._next import next as design

        return design(self, data, is_fitted_to_data=True, **options)

    def summary(self) -> Any:
        """The parameters of the established effects as a pandas frame with a row each, or as a dict of lists without pandas."""
        rows = [(e["kind"], name, p) for e in self.effects for name, p in e["parameters"].items()]
        intervals = [p.get("ci95") or (float("nan"), float("nan")) for _, _, p in rows]
        return frame(
            {
                "effect": [kind for kind, _, _ in rows],
                "parameter": [name for _, name, _ in rows],
                "value": [p.get("value") for _, _, p in rows],
                "low": [low for low, _ in intervals],
                "high": [high for _, high in intervals],
                "unit": [p.get("unit", "") for _, _, p in rows],
            }
        )

    def plot(self, ax: Any = None) -> Any:
        """The figures of the report; with a matplotlib ``ax``, the errors of the models as bars on it, and returns the axes."""
        if ax is None:
            return Figures(self._inner.figures())
        names = [name for name in ("declared", "calibrated", "augmented") if name in self.error]
        values = [self.error[name]["rmse"] for name in names]
        ends = [self.error[name].get("ci95") or (value, value) for name, value in zip(names, values)]
        reach = [[max(v - low, 0.0) for v, (low, _) in zip(values, ends)], [max(high - v, 0.0) for v, (_, high) in zip(values, ends)]]
        ax.bar(names, values, yerr=reach, capsize=4)
        ax.set_ylabel(f"error on held-out trajectories in {self.error['unit']}")
        return ax

    def __reduce__(self) -> Any:
        if isinstance(self._inner, _Saved):
            return Discovery, (self._inner.folder,)
        inner = self._inner
        return _unpickled, (inner.json(), self.model, inner.place(), inner.page(""), inner.excerpt(), inner.figures())

    def _repr_html_(self) -> str:
        return _frame(self._inner.excerpt(), 720)

    def __repr__(self) -> str:
        return f"<augsim.Discovery: {self.verdict}. {self.sentence}>"


class _Saved:
    """The folder of a discovery, in place of the discovery itself."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        missing = [name for name in (RESULT, MODEL) if not (folder / name).is_file()]
        if missing:
            raise UsageError(f"{folder}: there is no {' and no '.join(missing)}; give the folder of a discovery")

    def json(self) -> str:
        return (self.folder / RESULT).read_text(encoding="utf-8")

    def model(self) -> _augsim.Model:
        return _augsim.Model.read(self.folder / MODEL)

    def place(self) -> str:
        return str(self.folder / MODEL)

    def page(self, _folder: str | os.PathLike[str]) -> str:
        try:
            return (self.folder / REPORT).read_text(encoding="utf-8")
        except FileNotFoundError as cause:
            raise UsageError(f"{self.folder}: there is no {REPORT}; run the discovery again") from cause

    def excerpt(self) -> str:
        return f"<p>{html.escape(json.loads(self.json())['sentence'])}</p>"

    def figures(self) -> list[tuple[str, str]]:
        raise UsageError(f"{self.folder}: the figures are in {self.folder / REPORT}; discover() returns them one by one")


@dataclass(frozen=True)
class _Kept:
    """Parts of a pickled discovery, in place of the discovery itself."""

    text: str
    augmented: Model
    declared_file: str
    html: str
    excerpt_html: str
    drawn: list[tuple[str, str]]

    def json(self) -> str:
        return self.text

    def model(self) -> _augsim.Model:
        return self.augmented._inner

    def place(self) -> str:
        return self.declared_file

    def page(self, _folder: str | os.PathLike[str]) -> str:
        return self.html

    def excerpt(self) -> str:
        return self.excerpt_html

    def figures(self) -> list[tuple[str, str]]:
        return self.drawn


def _unpickled(*parts: Any) -> Discovery:
    return Discovery._of(_Kept(*parts))


def _frame(page: str, height: int) -> str:
    """Embeds a page in an iframe to isolate its styles."""
    text = html.escape(page, quote=True)
    return f'<iframe srcdoc="{text}" style="width:100%;height:{height}px;border:0"></iframe>'


def _duration(limit: float | timedelta | None) -> timedelta | None:
    if limit is None or isinstance(limit, timedelta):
        return limit
    try:
        return timedelta(seconds=limit)
    except (TypeError, ValueError, OverflowError) as cause:
        raise UsageError(f"time_limit = {limit!r}: give seconds") from cause


def discover(
    model: Model | str | os.PathLike[str],
    data: Any,
    *,
    seed: int = 1,
    groups: Sequence[str] | None = None,
    null_runs: int = 19,
    library: bool = True,
    only: Sequence[str] = (),
    exclude: Sequence[str] = (),
    accept: Sequence[str] = (),
    time_limit: float | timedelta | None = None,
    threads: int | None = None,
    title: str | None = None,
    progress: bool | _progress.Progress = True,
) -> Discovery:
    """Finds the effects that a declared model lacks, with the same result as ``augsim discover`` for the same seed.

    ``model`` is a path, the text of a model file or a :class:`Model`; ``data`` is any argument of :func:`read`. ``groups`` selects
    the trajectories of these groups, ``null_runs`` is the number of simulated recordings without a missing effect on which the
    selection is repeated (at most 1000). ``only`` names the effects of the library to try, without formulas and values by group,
    and ``exclude`` those not to try; with both, the effects of ``only`` that ``exclude`` does not name are tried. ``accept`` names
    data checks to ignore. ``library=False`` searches formulas alone. After ``time_limit`` (seconds) the search ends with the best
    model so far. ``threads`` is the number of threads, by default that of the cores, and 1 if a function of yours
    is called; the result does not depend on it. ``title`` is the name of data in memory in the report. ``progress`` shows the step in a terminal or a
    notebook; a callable gets the text of the step and the completed fraction (or ``None``). Other Python threads continue to run,
    and Ctrl-C stops the search.

    Raises :class:`augsim.DataError`, :class:`augsim.ModelError`, :class:`augsim.NumericalError` or :class:`augsim.UsageError`.
    """
    if any(isinstance(names, str) for names in (groups, only, exclude, accept)):
        raise UsageError("groups, only, exclude and accept are lists of names; write ['name'] for one")
    reporter = _progress.reporter_for(progress)
    opened = _opened(model)
    try:
        with explained(opened):
            found = _augsim.discover(
                opened,
                source(data, "table" if title is None else str(title)),
                seed=whole("seed", seed),
                groups=[str(group) for group in groups or ()],
                null_runs=whole("null_runs", null_runs),
                library=bool(library),
                only=[str(effect) for effect in only],
                exclude=[str(effect) for effect in exclude],
                accept=[str(check) for check in accept],
                time_limit=_duration(time_limit),
                threads=None if threads is None else max(whole("threads", threads), 1),
                progress=reporter,
            )
    finally:
        _progress.clear(reporter)
    return Discovery._of(found)
