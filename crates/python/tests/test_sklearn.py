"""Contract (issue 53): the estimator fits, predicts and scores, and keeps those rules of scikit-learn that apply to recordings."""

import numpy as np
import pytest

pytest.importorskip("sklearn", reason="scikit-learn is not installed")

from sklearn.base import clone  # noqa: E402
from sklearn.exceptions import NotFittedError  # noqa: E402
from sklearn.utils import estimator_checks as checks  # noqa: E402

import augsim  # noqa: E402
import systems  # noqa: E402
from augsim.sklearn import AugmentedModel  # noqa: E402


def test_an_estimator_fits_predicts_and_scores():
    data, other = systems.PENDULUM.recording(seed=1, samples=101), systems.PENDULUM.recording(seed=2, samples=101)
    estimator = AugmentedModel(systems.PENDULUM.text, null_runs=0)
    with pytest.raises(NotFittedError):
        estimator.predict(data)
    assert estimator.fit(data) is estimator
    assert [effect["kind"] for effect in estimator.discovery_.effects] == ["coulomb"] and estimator.outputs_ == ["angle_rad"]
    forecast = estimator.predict(other)
    assert forecast.shape == (303, 1) and np.isfinite(forecast).all()
    assert estimator.score(other) > 0.99
    with pytest.raises(augsim.UsageError, match="model: there is none"):
        AugmentedModel().fit(data)


def test_parameters_are_those_of_scikit_learn():
    estimator = AugmentedModel(systems.PENDULUM.text, seed=3)
    assert clone(estimator).get_params() == estimator.get_params()
    assert estimator.set_params(null_runs=5).null_runs == 5
    for check in (
        checks.check_parameters_default_constructible,
        checks.check_no_attributes_set_in_init,
        checks.check_get_params_invariance,
        checks.check_set_params,
        checks.check_estimator_repr,
        checks.check_estimator_cloneable,
    ):
        check("AugmentedModel", AugmentedModel())
