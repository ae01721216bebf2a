"""A user's function for the rates of a model, in the form in which the engine calls it."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from ._errors import ModelError

#: Number of points at which a function is tried when a model is made; no model in use has as many states.
TRIAL_POINTS = 13
#: Largest relative difference between the rates of a point alone and of the same point among others.
BATCH_TOLERANCE = 1e-9


#: Relative steps of the engine's finite differences: central ones, and one-sided ones of a costly function.
CENTRAL_STEP, ONE_SIDED_STEP = 2.0**-17, 2.0**-24
#: Largest change of a derivative, relative to the largest one, when the step is eight times as long.
STEP_TOLERANCE = 1e-3


class Named(Sequence[Any]):
    """Values of inputs or parameters, by name (``p["length_m"]``) or by position (``p[0]``).

    For a function of many points each value is an array ``[point]``, otherwise a number.
    """

    __slots__ = ("_places", "_values")

    def __init__(self, places: dict[str, int], values: np.ndarray) -> None:
        self._places = places
        self._values = values

    def __getitem__(self, key: Any) -> Any:
        if isinstance(key, str):
            try:
                return self._values[self._places[key]]
            except KeyError:
                known = ", ".join(self._places) or "none"
                raise KeyError(f"no value is called {key!r}; there are: {known}") from None
        return self._values[key]

    def __len__(self) -> int:
        return len(self._values)

    def __iter__(self) -> Iterator[Any]:
        return iter(self._values)

    def __array__(self, dtype: Any = None, copy: Any = None) -> np.ndarray:
        return np.array(self._values, dtype=dtype)

    def __repr__(self) -> str:
        return "{" + ", ".join(f"{name!r}: {self._values[place]!r}" for name, place in self._places.items()) + "}"


class Function:
    """Calls ``function(t, x, u, p)``, which returns the rates, or ``function(x, u, p, dt)``, which returns the next states.

    ``names`` are those of the states, inputs, parameters and forces. In ``u`` the forces come after the inputs. The engine passes
    the arguments as bytes of an array ``[argument, point]``: time, states, inputs, parameters, forces; and gets rates: those of
    a step are ``(next - x) / dt``.
    """

    def __init__(
        self,
        function: Callable[..., Any],
        name: str,
        names: tuple[list[str], list[str], list[str], list[str]],
        jacobian: Callable[..., Any] | None,
        typical_sizes: list[float],
        step_s: float | None = None,
    ) -> None:
        self.function = function
        self.name = name
        self.names = names
        self.jacobian = jacobian
        self.typical_sizes = typical_sizes
        #: Length of a step, s; ``None`` for a function that returns rates.
        self.step_s = step_s
        self.is_vectorised = True
        #: Where the function first returned NaN or an infinite number for finite arguments; ``None`` if it never did.
        self.first_failure: str | None = None
        states, inputs, parameters, forces = names
        self._inputs = {input: index for index, input in enumerate([*inputs, *forces])}
        self._parameters = {parameter: index for index, parameter in enumerate(parameters)}

    @property
    def states(self) -> int:
        """Number of states."""
        return len(self.names[0])

    @property
    def has_derivatives(self) -> bool:
        """Whether the user gave a Jacobian."""
        return self.jacobian is not None

    @property
    def is_costly(self) -> bool:
        """Whether finite differences are one-sided: a simulator computes points one after the other."""
        return self.step_s is not None or not self.is_vectorised

    def rates(self, points: int, buffer: Any) -> bytes:
        """The bytes of the rates ``[state, point]``."""
        arguments = np.frombuffer(buffer).reshape(-1, points)
        # A function that changed its arguments would change the start of its own step.
        arguments.flags.writeable = False
        rates = self.of(arguments)
        if self.first_failure is None and not np.isfinite(rates).all():
            self._note_failure(arguments, rates)
        return rates.tobytes()

    def of(self, arguments: np.ndarray) -> np.ndarray:
        """The rates ``[state, point]`` for arguments ``[argument, point]``."""
        with np.errstate(all="ignore"):
            if self.is_vectorised:
                return self._rates_at(arguments)
            rates = np.empty((self.states, arguments.shape[1]))
            for point in range(arguments.shape[1]):
                rates[:, point] = self._rates_at(arguments[:, point])
            return rates

    def _rates_at(self, arguments: np.ndarray) -> np.ndarray:
        """The rates at many points ``[argument, point]``, or at one ``[argument]``."""
        t, x, u, p = self._split(arguments)
        points = None if arguments.ndim == 1 else arguments.shape[1]
        if self.step_s is None:
            return self._checked(self._called(self.function, t, x, u, p), points)
        return (self._checked(self._called(self.function, x, u, p, self.step_s), points) - x) / self.step_s

    def derivatives(self, points: int, buffer: Any) -> bytes:
        """The bytes of the derivatives ``[state, argument, point]``, from the user's Jacobian."""
        arguments = np.frombuffer(buffer).reshape(-1, points)
        into = np.zeros((self.states, len(arguments), points))
        with np.errstate(all="ignore"):
            if self.is_vectorised:
                self._put(self._called(self.jacobian, *self._split(arguments)), into)
            else:
                for point in range(points):
                    self._put(self._called(self.jacobian, *self._split(arguments[:, point])), into[:, :, point])
        return into.tobytes()

    def _split(self, arguments: np.ndarray) -> tuple[Any, np.ndarray, Named, Named]:
        states, inputs, parameters, forces = map(len, self.names)
        first_input, first_parameter = 1 + states, 1 + states + inputs
        first_force = first_parameter + parameters
        u = arguments[first_input:first_parameter]
        if forces:
            u = np.concatenate([u, arguments[first_force:]])
        return (
            arguments[0],
            arguments[1:first_input],
            Named(self._inputs, u),
            Named(self._parameters, arguments[first_parameter:first_force]),
        )

    def _called(self, function: Any, *arguments: Any) -> Any:
        try:
            return function(*arguments)
        except Exception as error:
            x = arguments[0 if self.step_s is not None else 1]
            error.add_note(f"augsim called {self.name} with x of shape {np.shape(x)}")
            raise

    def _checked(self, rates: Any, points: int | None) -> np.ndarray:
        """The rates as an array ``[state, point]``, or ``[state]`` if ``points`` is ``None``."""
        shape = (self.states,) if points is None else (self.states, points)
        if isinstance(rates, (list, tuple)) and len(rates) == self.states:
            array = np.empty(shape)
            for index, rate in enumerate(rates):
                try:
                    array[index] = rate
                except (TypeError, ValueError) as cause:
                    state = self.names[0][index]
                    raise ModelError(f"{self.name} returned for `{state}` {rate!r:.80}: {cause}; {self._wanted(shape)}") from cause
            return array
        try:
            array = np.asarray(rates, dtype=np.float64)
        except (TypeError, ValueError) as cause:
            raise ModelError(f"{self.name} returned {type(rates).__name__}: {cause}; {self._wanted(shape)}") from cause
        if array.shape != shape:
            found = "None" if rates is None else f"an array of shape {array.shape}"
            raise ModelError(f"{self.name} returned {found}; {self._wanted(shape)}")
        return np.ascontiguousarray(array)

    def _wanted(self, shape: tuple[int, ...]) -> str:
        states = ", ".join(self.names[0])
        at = "" if len(shape) == 1 else f" at {shape[1]} points"
        what = "rates" if self.step_s is None else "next values"
        return f"it must return the {what} of {states}{at}, an array of shape {shape}"

    def _put(self, jacobian: Any, into: np.ndarray) -> None:
        """Writes a Jacobian ``(by states, by inputs, by parameters)`` to ``[state, argument, …]``."""
        states, inputs, parameters, forces = map(len, self.names)
        parts = jacobian if isinstance(jacobian, tuple) else (jacobian,)
        wanted = [states, inputs + forces, parameters]
        needed = max((index + 1 for index, count in enumerate(wanted) if count), default=1)
        if not needed <= len(parts) <= 3:
            raise ModelError(
                f"jacobian of {self.name} returned {len(parts)} arrays; return a tuple of the derivatives of the rates by "
                f"states, inputs and parameters, arrays [state, …, point]"
            )
        first_parameter = 1 + states + inputs
        for index, (part, count) in enumerate(zip(parts, wanted)):
            shape = (states, count, *into.shape[2:])
            try:
                array = np.broadcast_to(np.asarray(part, dtype=np.float64), shape)
            except (TypeError, ValueError) as cause:
                name = ("states", "inputs", "parameters")[index]
                raise ModelError(f"jacobian of {self.name}, derivatives by {name}: {cause}; return an array of shape {shape}") from cause
            if index == 0:
                into[:, 1 : 1 + states] = array
            elif index == 1:
                into[:, 1 + states : first_parameter] = array[:, :inputs]
                into[:, first_parameter + parameters :] = array[:, inputs:]
            else:
                into[:, first_parameter : first_parameter + parameters] = array

    def _note_failure(self, arguments: np.ndarray, rates: np.ndarray) -> None:
        failed = np.isfinite(arguments).all(axis=0) & ~np.isfinite(rates).all(axis=0)
        if failed.any():
            point = int(np.argmax(failed))
            states, inputs, parameters, forces = self.names
            state = states[int(np.argmax(~np.isfinite(rates[:, point])))]
            names = ["t", *states, *inputs, *parameters, *forces]
            values = ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, arguments[:, point]))
            self.first_failure = f"{self.name} returned a rate of `{state}` that is not finite at {values}"

    def check_differences(self, trial: np.ndarray, rates: np.ndarray) -> None:
        """Checks that finite differences at the points ``trial``, with ``rates``, hardly depend on their step."""
        states, inputs, parameters, forces = self.names
        finite = np.isfinite(rates).all(axis=0)
        for row, name in enumerate(["t", *states, *inputs, *parameters, *forces]):
            size = np.maximum(np.abs(trial[row]), self.typical_sizes[row])
            step = (ONE_SIDED_STEP if self.is_costly else CENTRAL_STEP) * size
            near, far = (self._difference(trial, rates, row, length) for length in (step, 8.0 * step))
            largest = np.abs(near[:, finite]).max(axis=1, initial=0.0) + 1e-6 * np.abs(rates[:, finite]).max(initial=0.0) / size.max()
            # Where the function has a kink the differences disagree as well, but not at most of the points.
            change = np.nanmedian(np.abs(far - near)[:, finite], axis=1) if finite.any() else np.zeros(len(rates))
            if row > 0 and (change > STEP_TOLERANCE * largest).any():
                state = states[int(np.argmax(change / (largest + 1e-300)))]
                raise ModelError(
                    f"the finite difference of the rate of `{state}` by `{name}` in {self.name} depends on its step of {step.max():.1g}; "
                    f"give the typical size of `{name}` in scales, or a jacobian, and remove random numbers from the function"
                )

    def _difference(self, trial: np.ndarray, rates: np.ndarray, row: int, step: np.ndarray) -> np.ndarray:
        moved = trial.copy()
        moved[row] = trial[row] + step
        up = self.of(moved)
        if self.is_costly:
            return (up - rates) / step
        moved[row] = trial[row] - step
        return (up - self.of(moved)) / (2.0 * step)

    def try_out(self, trial: np.ndarray) -> np.ndarray:
        """Finds out whether the function takes many points at once; returns the rates at the points ``trial``.

        Raises the exception of the function if it takes neither many points nor one.
        """
        trial.flags.writeable = False
        problem: Exception
        try:
            together = self.of(trial)
            alone = np.concatenate([self.of(trial[:, [point]]) for point in range(3)], axis=1)
            scale = np.abs(alone) + np.abs(together[:, :3]) + 1e-300
            if not (np.abs(alone - together[:, :3]) > BATCH_TOLERANCE * scale).any():
                return together
            problem = ModelError(
                f"the rates that {self.name} returns for a point depend on the other points of the batch; compute each column of "
                "x by itself"
            )
        except Exception as error:
            problem = error
        self.is_vectorised = False
        try:
            rates = self.of(trial)
        except Exception:
            self.is_vectorised = True
            raise problem from None
        warnings.warn(
            f"{self.name} computes one point at a time, which is slow ({type(problem).__name__} for many points: {problem}); "
            "write it with numpy for arrays x of shape [state, point]",
            stacklevel=4,
        )
        return rates
