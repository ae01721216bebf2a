"""What long work tells: one line that changes, in terminals and notebooks; nothing anywhere else."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

Progress = Callable[[str, "float | None"], None]


class Line:
    """A line on standard error that is written over."""

    def __init__(self) -> None:
        self._begun = time.monotonic()
        self._width = 0

    def __call__(self, step: str, share: float | None) -> None:
        done = "" if share is None else f"{100 * share:3.0f} %  "
        text = f"{time.monotonic() - self._begun:5.1f} s  {done}{step}"
        sys.stderr.write("\r" + text.ljust(self._width))
        sys.stderr.flush()
        self._width = len(text)

    def clear(self) -> None:
        """Takes the line away."""
        if self._width:
            sys.stderr.write("\r" + " " * self._width + "\r")
            sys.stderr.flush()


def shown(progress: bool | Progress) -> Any:
    """Whom to tell: nobody, a line where somebody looks, or the caller's function."""
    if callable(progress):
        return progress
    return Line() if progress and (_is_notebook() or sys.stderr.isatty()) else None


def cleared(told: Any) -> None:
    """Takes the line away, if there is one."""
    if isinstance(told, Line):
        told.clear()


def _is_notebook() -> bool:
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return type(shell).__name__ == "ZMQInteractiveShell"
