"""Component, constraint, policy: from actions alone to a policy learnt with the constraints found in them."""

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.utils.validation import check_is_fitted

from unconstrain.arrays import check_actions, check_groups, check_samples, quote
from unconstrain.constraints.learnt.base import LearntConstraint
from unconstrain.constraints.learnt.component import NullspaceComponent
from unconstrain.errors import PolicyError
from unconstrain.undo import undone_on_failure


class ConstraintChain(RegressorMixin, BaseEstimator):
    """Constraints learnt from the actions, and then the policy with their projections.

    Parameters
    ----------
    constraint : ConstantConstraint or FeatureConstraint
        Finds the constraint.
    policy : policy
        Learns with the projections found.
    component : NullspaceComponent, optional
        Separates a task part that varies first.

    Attributes
    ----------
    policy_ : policy
        As fitted.
    constraints_, components_ : dict
        By condition, as fitted.
    projections_ : ndarray of shape (N, d, d)
        Of the samples.

    Notes
    -----
    The parts learn in this order:

        ũ(x) = N(x) π(x)  from  u      (`component`, where a task part varies; else ũ = u)
        N(x)              from  ũ      (`constraint`)
        π(x)              from  N u, N (`policy`)

    All of them are cloned, never changed.
    """

    def __init__(
        self, constraint: LearntConstraint, policy: Any, component: NullspaceComponent | None = None
    ):
        self.constraint = constraint
        self.policy = policy
        self.component = component

    @undone_on_failure
    def fit(
        self,
        X: ArrayLike,
        U: ArrayLike,
        *,
        groups: ArrayLike | None = None,
        conditions: ArrayLike | None = None,
    ) -> Self:
        """Learn from recordings under one constraint, or under one for each condition.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.
        U : array_like of shape (N, d)
            Actions.
        groups : array_like of shape (N,), optional
            Episodes.
        conditions : array_like of shape (N,), optional
            Samples of one label are under one constraint, and one policy is learnt from all. By default all samples
            are under the same constraint.

        Returns
        -------
        ConstraintChain
            Itself, fitted.

        Raises
        ------
        DataError
            If there is not one condition a sample, and for what its parts refuse.
        """
        X, U = check_samples(self, X, U, reset=True, min_samples=2)
        U, groups = check_actions(U), check_groups(groups, len(X))
        for name in ("constraint", "policy", "component"):
            part = getattr(self, name)
            if not hasattr(part, "fit") and not (part is None and name == "component"):
                raise PolicyError(f"{name} must be an estimator, got {quote(part)}")
        given = check_groups(conditions, len(X), "conditions")
        labels = np.zeros(len(X), dtype=int) if given is None else given
        self.components_, self.constraints_ = {}, {}
        self.projections_ = np.empty((*U.shape, U.shape[1]))
        for label in np.unique(labels).tolist():
            own = labels == label
            episodes = None if groups is None else groups[own]
            component = U[own]
            if self.component is not None:
                self.components_[label] = clone(self.component).fit(X[own], U[own])
                component = self.components_[label].predict(X[own])
            learnt = clone(self.constraint).fit(X[own], component, groups=episodes)
            self.constraints_[label] = learnt
            self.projections_[own] = learnt.predict(X[own])
        # The component as recorded, not as modelled: N takes out the task part, and the model adds nothing to it.
        left = np.einsum("nij,nj->ni", self.projections_, U)
        self.policy_ = clone(self.policy).fit(X, left, groups=groups, projections=self.projections_)
        return self

    def predict(self, X: ArrayLike) -> np.ndarray:
        """Compute actions of the unconstrained policy at states.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, d)
            Actions.
        """
        check_is_fitted(self)
        return self.policy_.predict(X)

    def score(self, X: ArrayLike, U: ArrayLike) -> float:
        """Compute the share of observed motion that the policy explains; see `metrics.explained`.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.
        U : array_like of shape (N, d)
            Actions.

        Returns
        -------
        float
            At most 1.
        """
        check_is_fitted(self)
        return self.policy_.score(X, U)
