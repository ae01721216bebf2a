"""Models whose rates, or whose steps, a function of Python computes."""

from __future__ import annotations

import atexit
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from . import _augsim, _declared, _trace
from ._errors import ModelError, UsageError
from ._function import TRIAL_POINTS, Function
from ._jax import Compiled

# A thread that called Python after its end would abort the program.
atexit.register(_augsim.end_functions)

#: Typical size of a quantity without one of its own, below which the step of a finite difference does not shrink.
DEFAULT_SIZE = 0.01


def from_rates(
    function: Callable[..., Any],
    *,
    states: Any,
    parameters: Any,
    outputs: Any,
    inputs: Any = None,
    name: str | None = None,
    jacobian: Callable[..., Any] | str | None = None,
    scales: Mapping[str, float] | None = None,
    trace: bool = True,
    more: Mapping[str, Any] | None = None,
) -> _augsim.Model:
    """See :meth:`augsim.Model.from_rates`."""
    if jacobian == "jax":
        places = [list(_declared.declared(what, value)) for what, value in (("inputs", inputs), ("parameters", parameters))]
        function, jacobian = Compiled(function, *places, False), Compiled(function, *places, True)
    wrapped = _wrapped(function, name, (states, inputs, parameters, None), jacobian, scales)
    trial = _trial(wrapped, _declared.declared("parameters", parameters))
    rates = wrapped.try_out(trial)
    known = _kinematics(wrapped.names[0], trial, rates)
    sections = _sections(wrapped.name, (states, parameters, outputs, inputs), known, more)
    formulas = _trace.formulas(wrapped, trial, rates) if trace and wrapped.is_vectorised else None
    if formulas is not None:
        equations = sections | {"rates": dict(zip(wrapped.names[0], formulas))}
        try:
            return _augsim.Model.parse(_declared.text(equations))
        except ModelError:
            # A formula that a model file does not take, such as one with inconsistent units; the function takes it.
            pass
    if jacobian is None:
        wrapped.check_differences(trial, rates)
    sections["external"] = {"function": wrapped.name}
    return _augsim.Model.external(_declared.text(sections), wrapped)


def from_step(
    function: Callable[..., Any],
    *,
    dt: float,
    states: Any,
    parameters: Any,
    outputs: Any,
    inputs: Any = None,
    forces: Mapping[str, tuple[str, str]] | None = None,
    name: str | None = None,
    scales: Mapping[str, float] | None = None,
    more: Mapping[str, Any] | None = None,
) -> _augsim.Model:
    """See :meth:`augsim.Model.from_step`."""
    if not isinstance(dt, (int, float)) or not 0.0 < dt < float("inf"):
        raise UsageError(f"dt = {dt!r}: give the length of a step in seconds")
    coordinates = {force: list(pair) for force, pair in _declared.declared("forces", forces).items()}
    wrapped = _wrapped(function, name, (states, inputs, parameters, coordinates), None, scales, float(dt))
    for force, pair in coordinates.items():
        if len(pair) != 2 or any(state not in wrapped.names[0] for state in pair):
            raise UsageError(f"forces: `{force}` = {pair!r}: give the states that are its position and speed, in this order")
    trial = _trial(wrapped, _declared.declared("parameters", parameters))
    wrapped.check_differences(trial, wrapped.try_out(trial))
    known = {position: speed for position, speed in coordinates.values()}
    sections = _sections(wrapped.name, (states, parameters, outputs, inputs), known, more)
    sections["rates"] = {state: f"external_rate({state})" for state in wrapped.names[0]}
    sections["external"] = {"function": wrapped.name, "step_s": float(dt)}
    if coordinates:
        sections["external"]["forces"] = coordinates
    return _augsim.Model.external(_declared.text(sections), wrapped)


def _wrapped(
    function: Any,
    name: str | None,
    given: tuple[Any, Any, Any, Any],
    jacobian: Any,
    scales: Mapping[str, float] | None,
    step_s: float | None = None,
) -> Function:
    for what, value in (("the function", function), ("jacobian", jacobian)):
        if not callable(value) and not (what == "jacobian" and value is None):
            call = "f(t, x, u, p)" if step_s is None else "f(x, u, p, dt)"
            raise UsageError(f"{what} is of type {type(value).__name__}; give a function {call}")
    name = name or getattr(function, "__name__", type(function).__name__)
    whats = ("states", "inputs", "parameters", "forces")
    names = tuple(list(_declared.declared(what, value)) for what, value in zip(whats, given))
    states, inputs, parameters, forces = names
    if not states:
        raise UsageError("states: there are none; name the states in the order of the rows of x")
    sizes = dict(scales or {})
    for unknown in sizes.keys() - {*states, *inputs, *parameters, *forces}:
        raise UsageError(f"scales: the model has no quantity `{unknown}`")
    nominal = {p: abs(_declared.parameter(p, v)["nominal"]) for p, v in _declared.declared("parameters", given[2]).items()}
    typical = [1.0]
    for quantity in (*states, *inputs, *parameters, *forces):
        default = nominal.get(quantity) or DEFAULT_SIZE
        typical.append(float(sizes.get(quantity, default)))
    return Function(function, name, (states, inputs, parameters, forces), jacobian, typical, step_s)


def _trial(wrapped: Function, parameters: Mapping[str, Any]) -> np.ndarray:
    """Points at which a function is tried: states, inputs and forces of their typical sizes, parameters near nominal."""
    random = np.random.default_rng(0)
    states, inputs, names, forces = wrapped.names
    sizes = np.array(wrapped.typical_sizes)[:, None]
    first, last = 1 + len(states) + len(inputs), 1 + len(states) + len(inputs) + len(names)
    trial = sizes * random.uniform(-1.0, 1.0, (len(sizes), TRIAL_POINTS))
    large = [size[0] == DEFAULT_SIZE for size in sizes]
    trial[large] *= 1.0 / DEFAULT_SIZE
    trial[0] = np.linspace(0.0, 1.0, TRIAL_POINTS)
    nominal = np.array([_declared.parameter(name, parameters[name])["nominal"] for name in names], dtype=float)
    trial[first:last] = nominal[:, None] * random.uniform(0.95, 1.05, (len(names), TRIAL_POINTS))
    return trial


def _kinematics(states: list[str], trial: np.ndarray, rates: np.ndarray) -> dict[str, str]:
    """States whose rate is another state, with that state, as the trial points show it."""
    found = {}
    for row, state in enumerate(states):
        for other, speed in enumerate(states):
            if other != row and np.array_equal(rates[row], trial[1 + other]):
                found[state] = speed
    return found


def _sections(
    name: str, given: tuple[Any, Any, Any, Any], known: Mapping[str, str], more: Mapping[str, Any] | None
) -> dict[str, Any]:
    states, parameters, outputs, inputs = (
        _declared.declared(what, value) for what, value in zip(("states", "parameters", "outputs", "inputs"), given)
    )
    tables = {output: _declared.setting(value, "value") for output, value in outputs.items()}
    for output, table in tables.items():
        table.setdefault("value", output)
    if not tables:
        raise UsageError("outputs: there are none; name the columns of the data, such as outputs={'angle_rad': 'theta_rad'}")
    measured = {table["value"]: output for output, table in reversed(tables.items())}
    positions = {speed: state for state, speed in known.items()}
    starts = {}
    for state, value in states.items():
        table = _declared.setting(value, "start")
        if "start" not in table:
            if state in measured:
                table["start"] = measured[state]
            elif positions.get(state) in measured:
                table["start"] = f"slope({measured[positions[state]]})"
            else:
                table["start"] = 0.0
        starts[state] = table
    sections: dict[str, Any] = {
        "scenario": "system",
        "name": name,
        "states": starts,
        "inputs": {input: _declared.setting(value, "hold") for input, value in inputs.items()},
        "parameters": {p: _declared.parameter(p, value) for p, value in parameters.items()},
        "rates": {state: known.get(state, f"external_rate({state})") for state in states},
        "outputs": {output: {"sd": "estimate", **table} for output, table in tables.items()},
    }
    for section, value in (more or {}).items():
        if section not in _declared.MORE_SECTIONS:
            raise UsageError(f"{section!r} is no section that can be added; there are: {', '.join(_declared.MORE_SECTIONS)}")
        if value:
            sections[section] = value
    return {key: value for key, value in sections.items() if value not in ({}, [])}
