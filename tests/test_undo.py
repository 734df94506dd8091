"""A fit that fails leaves its estimator as it was."""

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.undo import undone_on_failure

X = np.random.default_rng(0).normal(size=(40, 2))


def one_direction(d):
    return np.outer(np.sin(X[:, 0]) + 2.0, np.arange(1.0, d + 1.0))


@pytest.mark.parametrize(
    "estimator",
    [
        uc.ConstantConstraint(1),
        uc.FeatureConstraint(),
        uc.NullspaceComponent(),
        uc.ConstraintChain(uc.ConstantConstraint(1), uc.ParametricPolicy(alpha=0.1)),
    ],
    ids=lambda estimator: type(estimator).__name__,
)
@pytest.mark.parametrize("fitted", [False, True])
def test_an_estimator_whose_fit_fails_is_as_it_was(estimator, fitted):
    if fitted:
        estimator.fit(X, one_direction(2))
    before = dict(vars(estimator))
    three = np.ones((40, 3))
    with pytest.raises(uc.errors.UnconstrainError):
        estimator.fit(three, np.zeros((40, 4)))
    assert vars(estimator).keys() == before.keys()
    assert all(vars(estimator)[name] is value for name, value in before.items())


def test_receptive_fields_that_are_not_placed_are_where_they_were():
    rbf = uc.NormalizedRBF(4).fit(X)
    before = dict(vars(rbf))
    with pytest.raises(uc.errors.UnconstrainError):
        rbf.fit(np.ones((5, 3)), sample_weight=np.zeros(5))
    assert vars(rbf) == before


def test_what_succeeds_is_kept():
    class Counter:
        count = 0

        @undone_on_failure
        def add(self, number: int) -> int:
            """Add a number."""
            self.count += number
            self.last = number
            return 1 // number

    counter = Counter()
    with pytest.raises(ZeroDivisionError):
        counter.add(0)
    assert vars(counter) == {}
    assert counter.add(1) == 1
    with pytest.raises(ZeroDivisionError):
        counter.add(0)
    assert (counter.count, counter.last) == (1, 1)
    assert Counter.add.__doc__ == "Add a number."
