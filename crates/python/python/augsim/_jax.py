"""Functions written with JAX: compiled rates, and exact derivatives by automatic differentiation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ._errors import UsageError
from ._function import Named

#: Least number of points of a call. Calls are filled up to powers of two, because JAX compiles a function again for each number.
LEAST_POINTS = 64


class Compiled:
    """The rates of a function written with ``jax.numpy``, or their derivatives, at many points and in 64-bit numbers.

    Called as the function itself, ``(t, x, u, p)``. Rates have shape ``[state, point]``; derivatives are a tuple by states, inputs and
    parameters, ``[state, …, point]``.
    """

    def __init__(self, function: Callable[..., Any], inputs: list[str], parameters: list[str], derivatives: bool) -> None:
        self.__name__ = getattr(function, "__name__", type(function).__name__)
        self._arguments = (function, inputs, parameters, derivatives)
        try:
            import jax
        except ImportError as cause:
            raise UsageError("jacobian = 'jax': JAX is not installed; run pip install jax, or give a function") from cause
        places = [{name: place for place, name in enumerate(names)} for names in (inputs, parameters)]

        def at_point(t: Any, x: Any, u: Any, p: Any) -> Any:
            rates = function(t, x, Named(places[0], u), Named(places[1], p))
            return jax.numpy.stack([jax.numpy.asarray(rate, dtype=x.dtype) for rate in rates])

        of = jax.jacfwd(at_point, argnums=(1, 2, 3)) if derivatives else at_point
        self._of = jax.jit(jax.vmap(of, in_axes=(0, 1, 1, 1), out_axes=-1))
        self._x64 = jax.enable_x64 if hasattr(jax, "enable_x64") else jax.experimental.enable_x64

    def __reduce__(self) -> Any:
        return Compiled, self._arguments

    def __call__(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        points = np.shape(t)[0]
        rows = [_filled(np.asarray(values, dtype=np.float64), points) for values in (t, x, u, p)]
        with self._x64(True):
            result = self._of(*rows)
        if isinstance(result, tuple):
            return tuple(np.asarray(part)[..., :points] for part in result)
        return np.asarray(result)[..., :points]


def _filled(values: np.ndarray, points: int) -> np.ndarray:
    """Values ``[…, point]`` with the last point repeated up to a power of two."""
    width = max(LEAST_POINTS, 1 << (points - 1).bit_length())
    return np.pad(values, [(0, 0)] * (values.ndim - 1) + [(0, width - points)], mode="edge")
