"""Reads the formulas that a function computes, by calling it with symbols instead of numbers.

numpy passes operations on arrays of objects on to their elements, so that a function of ordinary arithmetic and elementary
functions returns expressions. A function that needs numbers (a condition, a solver, a call of another library) raises
:class:`NoFormula` or a ``TypeError`` instead.
"""

from __future__ import annotations

import numbers
from collections.abc import Callable
from typing import Any

import numpy as np

from ._function import Function, Named

#: Largest relative difference between the rates of the function and those of its formulas.
TOLERANCE = 1e-11
#: Maximum length of all formulas together, in characters; the formulas repeat what they share.
MAX_CHARACTERS = 20_000

#: Elementary functions of numpy, with their names in a model file.
FUNCTIONS = {
    "sin": "sin",
    "cos": "cos",
    "tan": "tan",
    "arcsin": "asin",
    "arccos": "acos",
    "arctan": "atan",
    "sinh": "sinh",
    "cosh": "cosh",
    "tanh": "tanh",
    "exp": "exp",
    "log": "ln",
    "sqrt": "sqrt",
    "cbrt": "cbrt",
    "absolute": "abs",
}


class NoFormula(TypeError):
    """The function needs the number that a symbol stands for."""


class Symbol:
    """An expression in the names of a model, with its values at the trial points."""

    __slots__ = ("level", "text", "values")
    #: Symbols are never equal to anything, so that no condition can depend on one.
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, text: str, values: Any, level: int) -> None:
        if len(text) > MAX_CHARACTERS:
            raise NoFormula("the formula is too long")
        self.text = text
        self.values = values
        #: Binding strength of the last operation: 1 sum, 2 product, 3 power, 4 name or call.
        self.level = level

    def _in(self, level: int) -> str:
        return self.text if self.level >= level else f"({self.text})"

    def __bool__(self) -> bool:
        raise NoFormula("a condition on a symbol")

    def __float__(self) -> float:
        raise NoFormula("a number is needed")

    __int__ = __index__ = __complex__ = __float__

    def _compared(self, other: Any) -> bool:
        raise NoFormula("a comparison with a symbol")

    __eq__ = __ne__ = __lt__ = __le__ = __gt__ = __ge__ = _compared  # type: ignore[assignment]

    def __neg__(self) -> Symbol:
        return Symbol(f"-{self._in(3)}", -self.values, 1)

    def __pos__(self) -> Symbol:
        return self

    def __abs__(self) -> Symbol:
        return self._call("absolute")

    def _call(self, name: str) -> Symbol:
        return Symbol(f"{FUNCTIONS[name]}({self.text})", getattr(np, name)(self.values), 4)

    def _pair(self, name: str, other: Any, text: str) -> Symbol:
        second = _symbol(other)
        return Symbol(f"{text}({self.text}, {second.text})", getattr(np, name)(self.values, second.values), 4)

    def arctan2(self, other: Any) -> Symbol:
        return self._pair("arctan2", other, "atan2")

    def hypot(self, other: Any) -> Symbol:
        return self._pair("hypot", other, "hypot")


def _symbol(value: Any) -> Symbol:
    """A symbol as it is; a number as a symbol."""
    if isinstance(value, Symbol):
        return value
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Real):
        raise NoFormula(f"a value of type {type(value).__name__}")
    number = float(value)
    if not np.isfinite(number):
        raise NoFormula("a number that is not finite")
    return Symbol(repr(number) if number >= 0.0 else f"({number!r})", np.float64(number), 4)


def _operator(sign: str, level: int, compute: Callable[[Any, Any], Any]) -> tuple[Any, Any]:
    """The method of a binary operator, and that of the operator with its operands swapped."""

    def combined(left: Symbol, right: Symbol) -> Symbol:
        # A power binds to the right; the second operand of a difference or quotient needs brackets at the same level.
        first, second = (4, 4) if sign == "^" else (level, level + 1)
        text = f"{left._in(first)} {sign} {right._in(second)}"
        return Symbol(text, compute(left.values, right.values), level)

    def method(self: Symbol, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else combined(self, _symbol(other))

    def swapped(self: Symbol, other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else combined(_symbol(other), self)

    return method, swapped


for _name, _sign, _level, _compute in (
    ("add", "+", 1, lambda a, b: a + b),
    ("sub", "-", 1, lambda a, b: a - b),
    ("mul", "*", 2, lambda a, b: a * b),
    ("truediv", "/", 2, lambda a, b: a / b),
    ("pow", "^", 3, lambda a, b: a**b),
):
    _method, _swapped = _operator(_sign, _level, _compute)
    setattr(Symbol, f"__{_name}__", _method)
    setattr(Symbol, f"__r{_name}__", _swapped)
for _name in FUNCTIONS:
    setattr(Symbol, _name, lambda self, _name=_name: self._call(_name))


def formulas(function: Function, trial: np.ndarray, rates: np.ndarray) -> list[str] | None:
    """The formula of each rate in the names of the model; ``None`` if the function has none that agree with ``rates``.

    ``trial`` are arguments ``[argument, point]``, and ``rates`` what the function returned for them.
    """
    states, inputs, parameters, _ = function.names
    names = ["t", *states, *inputs, *parameters]
    symbols = np.array([[Symbol(name, trial[index], 4)] for index, name in enumerate(names)], dtype=object)
    first_input, first_parameter = 1 + len(states), 1 + len(states) + len(inputs)
    try:
        with np.errstate(all="ignore"):
            returned = function.function(
                symbols[0],
                symbols[1:first_input],
                Named({name: index for index, name in enumerate(inputs)}, symbols[first_input:first_parameter]),
                Named({name: index for index, name in enumerate(parameters)}, symbols[first_parameter:]),
            )
            found = [_symbol(np.asarray(row, dtype=object).reshape(-1)[0]) for row in returned]
    except Exception:
        # Whatever a function does with symbols, it is called with numbers then.
        return None
    if len(found) != len(states) or sum(len(symbol.text) for symbol in found) > MAX_CHARACTERS:
        return None
    for symbol, expected in zip(found, rates):
        values = np.broadcast_to(symbol.values, expected.shape)
        size = np.abs(expected) + np.nanmax(np.abs(values), initial=0.0)
        both_undefined = np.isnan(values) & np.isnan(expected)
        if not (both_undefined | (np.abs(values - expected) <= TOLERANCE * size)).all():
            return None
    return [symbol.text for symbol in found]
