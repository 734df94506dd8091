"""Component, constraint, policy: from actions alone to a policy learnt with the constraints found in them."""

import numpy as np
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.utils.validation import check_is_fitted

from unconstrain.arrays import check_actions, check_groups, check_samples
from unconstrain.errors import DataError


class ConstraintChain(RegressorMixin, BaseEstimator):
    """Learns the constraints, then the policy with their projections:

        ũ(x) = N(x) π(x)  from  u      (`component`, where a task part varies; else ũ = u)
        N(x)              from  ũ      (`constraint`)
        π(x)              from  N u, N (`policy`, risk "auto")

    Recordings under different constraints are told apart by `conditions` in `fit`: each has a constraint of its own,
    and the policy is learnt from all of them.

    constraint: a `ConstantConstraint` or `FeatureConstraint`. policy: a policy. component: a `NullspaceComponent`, or
        None. All are cloned, never changed.

    After `fit`: `policy_`; `constraints_` and `components_`, by condition; `projections_` (N, d, d), of the samples.
    """

    def __init__(self, constraint, policy, component=None):
        self.constraint = constraint
        self.policy = policy
        self.component = component

    def fit(self, X, U, *, groups=None, conditions=None):
        """Learn from states X (N, n) and actions U (N, d).

        groups: episodes (N,). conditions: labels (N,) of samples under the same constraint; all are, by default.

        Raises what its parts raise.
        """
        X, y = check_samples(self, X, U, reset=True, min_samples=2)
        U, groups = check_actions(y), check_groups(groups, len(X))
        labels = np.zeros(len(X), dtype=int) if conditions is None else np.asarray(conditions)
        if labels.shape != (len(X),):
            raise DataError(
                f"conditions must hold one label a sample, {len(X)} in all, got shape {labels.shape}"
            )
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

    def predict(self, X) -> np.ndarray:
        """Actions of the unconstrained policy, (N, d), at states X (N, n)."""
        check_is_fitted(self)
        return self.policy_.predict(X)

    def score(self, X, U) -> float:
        """Share of observed motion explained by the policy; see `ParametricPolicy.score`."""
        check_is_fitted(self)
        return self.policy_.score(X, U)
