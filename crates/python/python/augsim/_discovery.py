"""Search for the effects that a model lacks."""

from __future__ import annotations

import html
import json
import os
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

from . import _augsim, _progress
from ._errors import UsageError
from ._model import Model, _opened, explained, whole
from ._tables import source


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
    """Result of :func:`augsim.discover`. A notebook shows the sentence, the table of errors and the first figures."""

    def __init__(self, inner: _augsim.Discovery) -> None:
        self._inner = inner

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

    def plot(self) -> Figures:
        """The figures of the report."""
        return Figures(self._inner.figures())

    def _repr_html_(self) -> str:
        return _frame(self._inner.excerpt(), 720)

    def __repr__(self) -> str:
        return f"<augsim.Discovery: {self.verdict}. {self.sentence}>"


def _frame(page: str, height: int) -> str:
    """Embeds a page in an iframe to isolate its styles."""
    text = html.escape(page, quote=True)
    return f'<iframe srcdoc="{text}" style="width:100%;height:{height}px;border:0"></iframe>'


def discover(
    model: Model | str | os.PathLike[str],
    data: Any,
    *,
    seed: int = 1,
    groups: Sequence[str] | None = None,
    null_runs: int = 19,
    only: Sequence[str] = (),
    exclude: Sequence[str] = (),
    accept: Sequence[str] = (),
    progress: bool | _progress.Progress = True,
) -> Discovery:
    """Finds the effects that a declared model lacks, with the same result as ``augsim discover`` for the same seed.

    ``model`` is a path, the text of a model file or a :class:`Model`; ``data`` is any argument of :func:`read`. ``groups`` selects
    the trajectories of these groups, ``null_runs`` is the number of simulated recordings without a missing effect on which the
    selection is repeated (at most 1000). ``only`` names the effects of the library to try, without formulas and values by group,
    and ``exclude`` those not to try; with both, the effects of ``only`` that ``exclude`` does not name are tried. ``accept`` names
    data checks to ignore. ``progress`` shows the step in a terminal or a
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
                source(data),
                seed=whole("seed", seed),
                groups=[str(group) for group in groups or ()],
                null_runs=whole("null_runs", null_runs),
                only=[str(effect) for effect in only],
                exclude=[str(effect) for effect in exclude],
                accept=[str(check) for check in accept],
                progress=reporter,
            )
    finally:
        _progress.clear(reporter)
    return Discovery(found)
