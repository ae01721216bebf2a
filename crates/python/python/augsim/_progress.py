"""Progress of long work: one updated line in terminals and notebooks, nothing elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

Progress = Callable[[str, "float | None"], None]


class Line:
    """A line on standard error that is overwritten."""

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
        """Removes the line."""
        if self._width:
            sys.stderr.write("\r" + " " * self._width + "\r")
            sys.stderr.flush()


def reporter_for(progress: bool | Progress) -> Any:
    """Returns the progress reporter: the given callable, a line in terminals and notebooks, or ``None``."""
    if callable(progress):
        return progress
    return Line() if progress and (_is_notebook() or sys.stderr.isatty()) else None


def clear(reporter: Any) -> None:
    """Removes the progress line, if there is one."""
    if isinstance(reporter, Line):
        reporter.clear()


def _is_notebook() -> bool:
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return type(shell).__name__ == "ZMQInteractiveShell"
