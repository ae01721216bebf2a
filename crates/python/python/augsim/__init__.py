"""augsim: find the effects that a physics model lacks from measured trajectories; forecast with bands; control loops.

>>> import augsim
>>> found = augsim.discover("model.toml", frame)   # a pandas or polars frame, a dict of arrays, or a path
>>> found.sentence, found.model.to_toml()

The engine is that of the command line: the same inputs and seed give identical results.
"""

from . import generate
from ._augsim import __version__
from ._data import Data, read
from ._discovery import Discovery, Figures, discover
from ._errors import DataError, Error, ModelError, NumericalError, UsageError
from ._model import Fit, Model, Parameter, Parameters, fit
from ._next import Plan, next
from ._robot import from_robot
from ._run import Run, train
from ._start import Start, start
from ._stepper import Stepper

__all__ = [
    "Data",
    "DataError",
    "Discovery",
    "Error",
    "Figures",
    "Fit",
    "Model",
    "ModelError",
    "NumericalError",
    "Parameter",
    "Parameters",
    "Plan",
    "Run",
    "Start",
    "Stepper",
    "UsageError",
    "__version__",
    "discover",
    "fit",
    "from_robot",
    "generate",
    "next",
    "read",
    "start",
    "train",
]
