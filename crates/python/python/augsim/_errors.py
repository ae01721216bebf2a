"""Exceptions with the messages of the command line."""


class Error(Exception):
    """Base class of all errors of augsim. The text names the cause and a remedy."""


class UsageError(Error, ValueError):
    """Invalid arguments, or arguments that do not match the model or the data (exit code 2)."""


class DataError(Error, ValueError):
    """Invalid data, or data that do not match the model (exit code 3)."""


class ModelError(Error, ValueError):
    """Invalid model file. The text names the file, line and key (exit code 3)."""


class NumericalError(Error, ArithmeticError):
    """Numerical overflow, or a diverged fit or training (exit code 4)."""


for _class in (Error, UsageError, DataError, ModelError, NumericalError):
    _class.__module__ = "augsim"
