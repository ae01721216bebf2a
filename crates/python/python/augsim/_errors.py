"""Exceptions, with the sentences of the command line."""


class Error(Exception):
    """Something that augsim cannot do; the text says why, and what to do about it."""


class UsageError(Error, ValueError):
    """What was asked for makes no sense, or not together with the model or the data (exit code 2)."""


class DataError(Error, ValueError):
    """Data that are wrong or do not go with the model (exit code 3)."""


class ModelError(Error, ValueError):
    """A model file that is wrong; the text names file, line and key (exit code 3)."""


class NumericalError(Error, ArithmeticError):
    """Numbers that overflowed, or a fit or a training that diverged (exit code 4)."""


for _class in (Error, UsageError, DataError, ModelError, NumericalError):
    _class.__module__ = "augsim"
