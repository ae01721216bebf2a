"""Model files."""

from __future__ import annotations

import json
import math
import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, overload

import numpy as np

from . import _augsim
from ._data import Data, read
from ._errors import Error, UsageError
from ._tables import numbers, source


#: Languages and formats of :meth:`Model.export`.
LANGUAGES = ("python", "c", "latex", "fmu", "urdf", "mjcf")


@dataclass(frozen=True)
class Parameter:
    """A parameter of a model; its name ends in its unit."""

    name: str
    value: float
    min: float
    max: float
    #: Whether fits keep it fixed.
    frozen: bool
    #: 95 % interval from a fit, or ``None``.
    ci95: tuple[float, float] | None


@dataclass(frozen=True)
class Fit:
    """Result of :meth:`Model.fit`."""

    #: The model with the calibrated values.
    model: Model
    #: ``result.json`` of ``augsim fit``.
    json: str

    @property
    def result(self) -> dict[str, Any]:
        """The same as a dict: ``parameters``, ``rows`` (residual RMSE of each output), ``windows``, ``gauges``, …"""
        return json.loads(self.json)


class Model:
    """A model file of a ball, of pushing, or of equations.

    ``model`` is a path, the folder of a discovery, or the text of a model file (anything with a line break). Raises :class:`augsim.ModelError`, which names the
    line, the key and a remedy.
    """

    def __init__(self, model: str | os.PathLike[str]) -> None:
        self._inner = _opened(model)

    @classmethod
    def _of(cls, inner: _augsim.Model) -> Model:
        model = cls.__new__(cls)
        model._inner = inner
        return model

    @classmethod
    def from_rates(
        cls,
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
        **more: Any,
    ) -> Model:
        """Makes a model whose rates are ``function(t, x, u, p)``, an array ``[state, point]``.

        ``t`` is an array ``[point]`` of times in s, ``x`` an array ``[state, point]``; ``u`` and ``p`` have an array ``[point]`` for
        each input and parameter, by name (``p["length_m"]``) or position. A function of one point (numbers and ``x`` of shape
        ``[state]``) is accepted as well, with a warning: it is slow.

        ``states``, ``inputs`` and ``outputs`` are lists of names or dicts, with the settings of a model file as values: a start
        (``{"theta_rad": "angle_rad"}``), an interpolation (``{"volt_V": "zero"}``), an expression of the states (``{"angle_rad":
        "theta_rad"}``), or a dict of several. ``parameters`` is a dict of numbers, ``(nominal, min, max)`` or dicts. Further
        sections of a model file are keywords: ``let``, ``tables``, ``events``, ``candidate``, ``numerics``.

        A function of arithmetic and elementary functions of numpy (no conditions, no solvers, no other libraries) is read as
        formulas: the model is then that of a model file, as fast, with exact derivatives, and can be exported. Any other function is
        called for every step; so is every function with ``trace=False``.

        ``jacobian(t, x, u, p)`` returns the derivatives of the rates by states, inputs and parameters, a tuple of arrays
        ``[state, …, point]``. Without it, derivatives are finite differences, whose steps are relative, and at least those of the
        typical sizes in ``scales`` (by name; 0.01 for states and inputs, the value for parameters). For a function that is written with
        ``jax.numpy``, ``jacobian="jax"`` compiles it and differentiates it exactly; it is then written for one point.
        """
        from ._from_function import from_rates

        return cls._of(
            from_rates(
                function,
                states=states,
                parameters=parameters,
                outputs=outputs,
                inputs=inputs,
                name=name,
                jacobian=jacobian,
                scales=scales,
                trace=trace,
                more=more,
            )
        )

    @classmethod
    def from_step(
        cls,
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
        **more: Any,
    ) -> Model:
        """Makes a model of a simulator that steps: ``function(x, u, p, dt)`` returns the states after ``dt`` seconds.

        ``x`` and the result are arrays ``[state, point]``; ``u`` has the inputs, then the ``forces``, and ``p`` the parameters, as in
        :meth:`from_rates`, whose other arguments are the same. An interval between samples is a whole number of steps of ``dt``.

        ``forces`` names generalised forces that the function takes in ``u``, each with the states that are position and speed of
        its coordinate: ``{"shoulder_N_m": ("q1_rad", "w1_rad_s")}``. They are 0 in the declared model, and effects such as friction
        are added to them. Without forces, effects are added to the rates ``(next - x) / dt``.
        """
        from ._from_function import from_step

        return cls._of(
            from_step(
                function,
                dt=dt,
                states=states,
                parameters=parameters,
                outputs=outputs,
                inputs=inputs,
                forces=forces,
                name=name,
                scales=scales,
                more=more,
            )
        )

    @property
    def scenario(self) -> str:
        """``ball``, ``push`` or ``system``."""
        return self._inner.scenario()

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Declared parameters by name, then those of the effects in the model.

        ``model.parameters["mass_kg"] = 2.0`` sets the value of a parameter of a model of equations; its fitted interval goes.
        """
        return Parameters(self)

    def summary(self) -> Any:
        """The parameters as a pandas frame with a row each, or as a dict of lists without pandas."""
        return frame(
            {
                "parameter": [p.name for p in self.parameters.values()],
                "value": [p.value for p in self.parameters.values()],
                "low": [p.ci95[0] if p.ci95 else math.nan for p in self.parameters.values()],
                "high": [p.ci95[1] if p.ci95 else math.nan for p in self.parameters.values()],
                "frozen": [p.frozen for p in self.parameters.values()],
            }
        )

    @overload
    def export(self, language: str) -> str: ...

    @overload
    def export(self, language: str, path: str | os.PathLike[str]) -> list[Path]: ...

    def export(self, language: str, path: str | os.PathLike[str] | None = None) -> str | list[Path]:
        """The model as a program (``python`` or ``c``), a document (``latex``), an FMU (``fmu``), or the description of its robot (``urdf``, ``mjcf``).

        Returns the text; with a ``path``, writes that file and those beside it (the header of C code), and returns their paths. An
        FMU needs a path. What the export leaves out is a warning. A model whose rates are a function of Python that could not be
        read as formulas cannot be exported.
        """
        exported = self._inner.export(language) if path is None else self._inner.export_to(language, os.fspath(path))
        if exported is None:
            raise UsageError(f"no language is called {language!r}; there are: {', '.join(LANGUAGES)}")
        if isinstance(exported, str):
            return exported
        paths, notes = exported
        for note in notes:
            warnings.warn(note, stacklevel=2)
        return paths

    def evaluate(self, data: Any, *, burn_in: int = 5, samples: int = 400, seed: int = 1) -> Any:
        """Errors of predictions of ``data`` as a pandas frame with a row for each measure, or as a dict of lists without pandas.

        Predictions are those of :meth:`predict`, and only values after the first ``burn_in`` samples count. ``rmse`` and its 95 %
        interval ``low``, ``high`` over trajectories are in ``unit``; ``fit_percent`` is 100 (1 - error / standard deviation), ``r2`` the
        coefficient of determination, ``coverage50`` and ``coverage90`` are the shares of the values in the 50 % and 90 % bands. Give
        recordings to which the model was not fitted.
        """
        return frame(scores(self, data, burn_in, samples, seed))

    def predict(self, data: Any, *, burn_in: int = 5, samples: int = 400, seed: int = 1) -> Data:
        """Predicts every trajectory of ``data`` with bands, as ``augsim predict`` does.

        Initial states of models of equations are fitted to the first ``burn_in`` samples. For each column ``angle_rad`` of the data
        the result has ``mean_angle_rad``, ``median_angle_rad``, and the ends of the 50 % and 90 % bands, ``q25_…``, ``q75_…``,
        ``q05_…`` and ``q95_…``, from ``samples`` draws.
        """
        with explained(self._inner):
            return Data._of(self._inner.predict(source(data), **_prediction_options(burn_in, samples, seed)))

    def residuals(self, data: Any, *, burn_in: int = 5) -> dict[str, Any]:
        """Measured minus predicted values, in long form like :meth:`augsim.Data.to_dict`; predictions start as in :meth:`predict`."""
        measured, predicted = read(data), self.predict(data, burn_in=burn_in, samples=2)
        columns = [name.removeprefix("mean_") for name in predicted.columns if name.startswith("mean_")]
        long = {name: values for name, values in measured.to_dict().items() if name in ("trajectory", "group", "t_s")}
        return long | {name: measured[name] - predicted[f"mean_{name}"] for name in columns}

    def __reduce__(self) -> Any:
        return _unpickled, (self.to_toml(), self._inner.function())

    def to_toml(self) -> str:
        """The text of the model file."""
        return self._inner.to_toml()

    def fit(self, data: Any, accept: Sequence[str] = ()) -> Fit:
        """Calibrates the declared parameters of a model of equations, as ``augsim fit`` does.

        ``accept`` names data checks to ignore.
        """
        if isinstance(accept, str):
            raise UsageError("accept is a list of names; write ['name'] for one")
        with explained(self._inner):
            fitted, found = self._inner.fit(source(data), accept=[str(check) for check in accept])
        return Fit(Model._of(fitted), found)

    def simulate(
        self,
        start: Mapping[str, Any],
        times: Any,
        inputs: Mapping[str, Any] | None = None,
        samples: int = 0,
        seed: int = 1,
    ) -> np.ndarray:
        """Simulates trajectories from initial states: an array ``[batch, sample, time, column]`` in the units of the columns.

        ``start`` has the initial value of each state by name, one number or an array ``[batch]``: ``height_m`` and
        ``velocity_m_s`` of a ball that moves up and down, ``x_m``, ``z_m``, ``velocity_x_m_s``, ``velocity_z_m_s`` of one in a
        plane (and ``y_m``, ``velocity_y_m_s`` in space), ``x_m``, ``y_m``, ``theta_rad`` of a pushed object, the states of a
        model of equations; and known constants of a trajectory, such as ``spin_rad_s``. ``times`` are seconds, increasing,
        shape ``[time]``. ``inputs`` has the values of each input at these times (``pusher_x_m`` and ``pusher_y_m`` of a push),
        shape ``[time]``, the same for the whole batch. The columns are those of :meth:`columns`.

        ``samples=0`` gives one sample with the nominal values. Otherwise parameters are drawn from the intervals of the fit,
        declared random effects are drawn, and the declared measurement noise is added.
        """
        return self._simulated(start, times, inputs, samples, seed)[0]

    def columns(self, start: Mapping[str, Any], inputs: Mapping[str, Any] | None = None) -> list[str]:
        """Names of the columns that :meth:`simulate` returns for this start, in order."""
        first = {name: np.asarray(values).ravel()[:2] for name, values in (inputs or {}).items()}
        times = np.arange(max([len(v) for v in first.values()], default=1), dtype=float)
        return self._simulated(start, times, first, 0, 1)[1]

    def _simulated(
        self, start: Mapping[str, Any], times: Any, inputs: Mapping[str, Any] | None, samples: int, seed: int
    ) -> tuple[np.ndarray, list[str]]:
        rows = {name: _one_dimension(f"start `{name}`", value) for name, value in start.items()}
        batch = max((len(values) for values in rows.values()), default=0)
        wide = [(name, np.repeat(v, batch) if len(v) == 1 else v) for name, v in rows.items()]
        streams = [(name, _one_dimension(f"input `{name}`", value)) for name, value in (inputs or {}).items()]
        samples, seed = whole("samples", samples), whole("seed", seed)
        with explained(self._inner):
            memory, shape, columns = self._inner.simulate(wide, _one_dimension("times", times), streams, samples, seed)
        return np.frombuffer(memory).reshape(*shape, len(columns)), columns

    def __repr__(self) -> str:
        free = ", ".join(f"{p.name} = {p.value:g}" for p in self.parameters.values() if not p.frozen)
        return f"<augsim.Model: {self.scenario}{'; ' if free else ''}{free}>"


class Parameters(dict[str, Parameter]):
    """Parameters of a model by name; a new value changes the model."""

    def __init__(self, model: Model) -> None:
        super().__init__((row[0], Parameter(*row)) for row in model._inner.parameters())
        self._model = model

    def __setitem__(self, name: str, value: Any) -> None:
        if self._model.scenario != "system":
            raise UsageError(f"parameter `{name}`: only those of a model of equations can be set; change the text of the model")
        if name not in self:
            raise UsageError(f"the model has no parameter `{name}`; it has: {', '.join(self)}")
        try:
            number = float(value)
        except (TypeError, ValueError):
            raise UsageError(f"parameter `{name}` = {value!r}: give a number") from None
        if not self[name].min <= number <= self[name].max:
            raise UsageError(f"parameter `{name}` = {number:g} is outside its bounds [{self[name].min:g}, {self[name].max:g}]")
        self._model._inner = self._model._inner.with_parameters([(name, number)])
        super().update({row[0]: Parameter(*row) for row in self._model._inner.parameters()})

    def __reduce__(self) -> Any:
        return dict, (list(self.items()),)


def _prediction_options(burn_in: int, samples: int, seed: int) -> dict[str, int]:
    return {name: whole(name, value) for name, value in (("burn_in", burn_in), ("samples", samples), ("seed", seed))}


def scores(model: Model, data: Any, burn_in: int, samples: int, seed: int) -> dict[str, list[Any]]:
    """Columns of :meth:`Model.evaluate`."""
    with explained(model._inner):
        rows = json.loads(model._inner.evaluate(source(data), **_prediction_options(burn_in, samples, seed)))
    for row in rows:
        row["low"], row["high"] = row["ci95"]

    def column(name: str) -> list[Any]:
        # JSON has no NaN.
        return [math.nan if row[name] is None else row[name] for row in rows]

    names = ("measure", "rmse", "low", "high", "unit", "fit_percent", "r2", "coverage50", "coverage90")
    return {name: column(name) for name in names}


def fit(model: Model | str | os.PathLike[str], data: Any, accept: Sequence[str] = ()) -> Fit:
    """Calibrates the declared parameters of a model of equations, as ``augsim fit`` does; see :meth:`Model.fit`.

    ``model`` is a path, the text of a model file or a :class:`Model`.
    """
    return Model._of(_opened(model)).fit(data, accept)


def _unpickled(text: str, function: Any) -> Model:
    return Model._of(_augsim.Model.parse(text) if function is None else _augsim.Model.external(text, function))


def frame(columns: dict[str, list[Any]]) -> Any:
    """A pandas frame of these columns, or the columns themselves where pandas is not installed."""
    try:
        import pandas
    except ImportError:
        return columns
    return pandas.DataFrame(columns)


def _opened(model: Any) -> _augsim.Model:
    if isinstance(model, Model):
        return model._inner
    if isinstance(model, str) and "\n" in model:
        return _augsim.Model.parse(model)
    if isinstance(model, (str, os.PathLike)):
        path = Path(model)
        return _augsim.Model.read(path / "model.toml" if path.is_dir() else path)
    raise UsageError(f"a model of type {type(model).__name__}: give a path, the text of a model file, or an augsim.Model")


@contextmanager
def explained(model: _augsim.Model) -> Iterator[None]:
    """Adds to an error where the function of the model first returned a number that is not finite."""
    function = model.function()
    if function is not None:
        function.first_failure = None
    try:
        yield
    except Error as error:
        if function is None or function.first_failure is None:
            raise
        raise type(error)(f"{error}; {function.first_failure}") from None


def _one_dimension(place: str, values: Any) -> np.ndarray:
    array = np.atleast_1d(numbers(place, values))
    if array.ndim != 1:
        raise UsageError(f"{place}: an array of shape {array.shape}; give one number, or one dimension")
    return array


def whole(name: str, value: Any) -> int:
    """Checks that a value is an integer from 0 to 2^64 - 1."""
    try:
        number = value.__index__()
    except AttributeError:
        raise UsageError(f"{name} = {value!r}: give a whole number") from None
    if not 0 <= number < 2**64:
        raise UsageError(f"{name} = {number}: give a whole number from 0 to 2^64 - 1")
    return number
