"""An estimator of scikit-learn: fits the effects that a declared model lacks, and predicts with them. Needs scikit-learn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from sklearn.base import BaseEstimator
from sklearn.utils.validation import check_is_fitted

from ._data import read
from ._discovery import discover
from ._errors import UsageError


class AugmentedModel(BaseEstimator):
    """A declared model, with the effects that recordings show that it lacks.

    ``fit(X)`` searches for the effects in ``X``, any argument of :func:`augsim.read`; ``predict(X)`` returns the mean forecasts of the
    outputs, an array ``[sample, output]`` over all trajectories of ``X``, whose initial states are fitted to their first ``burn_in``
    samples; ``score(X)`` is the coefficient of determination of these forecasts. ``model`` is any model of :func:`augsim.discover`,
    whose options the other parameters are. After ``fit``, ``discovery_`` is the :class:`augsim.Discovery`, ``model_`` its model, and
    ``outputs_`` names the columns of a prediction.
    """

    def __init__(
        self,
        model: Any = None,
        *,
        seed: int = 1,
        null_runs: int = 19,
        only: Sequence[str] = (),
        exclude: Sequence[str] = (),
        burn_in: int = 5,
    ) -> None:
        self.model = model
        self.seed = seed
        self.null_runs = null_runs
        self.only = only
        self.exclude = exclude
        self.burn_in = burn_in

    def fit(self, X: Any, y: None = None) -> AugmentedModel:
        """Searches for the effects that the model lacks in the recordings ``X``; ``y`` is ignored."""
        if self.model is None:
            raise UsageError("model: there is none; give a path, the text of a model file, or an augsim.Model")
        options = {"seed": self.seed, "null_runs": self.null_runs, "only": self.only, "exclude": self.exclude}
        self.discovery_ = discover(self.model, X, progress=False, **options)
        self.model_ = self.discovery_.model
        self.outputs_ = self._means(X)[0]
        return self

    def predict(self, X: Any) -> np.ndarray:
        """Mean forecasts of the outputs, ``[sample, output]``."""
        check_is_fitted(self)
        return self._means(X)[1]

    def score(self, X: Any, y: None = None) -> float:
        """Coefficient of determination of the forecasts, the mean over the outputs; 1 for forecasts without error."""
        forecast, measured = self.predict(X), read(X)
        scores = []
        for column, name in enumerate(self.outputs_):
            values = measured[name]
            spread = np.nansum((values - np.nanmean(values)) ** 2)
            scores.append(1.0 - np.nansum((values - forecast[:, column]) ** 2) / spread)
        return float(np.mean(scores))

    def _means(self, X: Any) -> tuple[list[str], np.ndarray]:
        forecast = self.model_.predict(X, burn_in=self.burn_in, samples=2, seed=self.seed)
        names = [name.removeprefix("mean_") for name in forecast.columns if name.startswith("mean_")]
        return names, np.column_stack([forecast[f"mean_{name}"] for name in names])
