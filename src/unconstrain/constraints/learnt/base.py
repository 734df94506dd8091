"""What learnt constraints share: rows give projections, and projections a score."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from sklearn.base import BaseEstimator, clone
from sklearn.utils.validation import check_is_fitted

from unconstrain import metrics as risk
from unconstrain.arrays import check_actions, check_groups, check_samples, check_states
from unconstrain.errors import DataError, PolicyError, PolicyFileError
from unconstrain.fitting.solve import splits
from unconstrain.policies import persistence


class LearntConstraint(BaseEstimator, ABC):
    """Base of the estimators of constraints. A subclass says what its orthonormal rows are at given states."""

    n_constraints_: int
    n_actions_: int
    shares_: np.ndarray
    reason_: str

    def rows(self, X) -> np.ndarray:
        """Constraint rows A(x) at states X (N, n), orthonormal at each: (N, k, d), with ``A u ≈ 0``.

        A row is zero where the constraint vanishes or its direction is not determined.
        """
        check_is_fitted(self)
        return self._rows(check_states(self, X))

    def predict(self, X) -> np.ndarray:
        """Nullspace projections ``N = I - AᵀA`` at states X (N, n): (N, d, d), to be given to ``policy.fit``."""
        A = self.rows(X)
        return np.eye(self.n_actions_) - A.swapaxes(1, 2) @ A

    def score(self, X, U) -> float:
        """Share of the motion that the constraint lets through, ``1 - Σ ‖u - N u‖² / Σ ‖u‖²``, at most 1.

        Of constraints with the same number of rows the higher is the better; with more rows it can only fall.
        Raises `DataError` where nothing moves.
        """
        actions = check_actions(U)
        motion = float(np.mean(np.sum(actions**2, axis=1)))
        if motion == 0.0:
            raise DataError("all actions are zero: there is no motion to compare a constraint with")
        return 1.0 - risk.projected_observation_error(actions, self.predict(X)) / motion

    def save(self, path: str | Path) -> None:
        """Write the constraint to `path` (customarily `.skops`), to be read by `load_constraint`. Holds no pickle.

        A task Jacobian of your own is saved by the name of its function, and has to be importable where it is read.
        """
        check_is_fitted(self)
        persistence.save(self, path)

    @abstractmethod
    def _rows(self, X: np.ndarray) -> np.ndarray:
        """Orthonormal rows (N, k, d) at checked states."""

    def _checked(self, X, U, groups) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        X, U = check_samples(self, X, U, reset=True)
        actions = check_actions(U)
        d = actions.shape[1]
        if d < 2:
            raise DataError(
                "a constraint needs two or more actions: with one, it would leave no motion at all"
            )
        if len(actions) < d:
            raise DataError(
                f"{len(actions)} samples are fewer than the {d} actions: which directions never move cannot be told; "
                "give more samples"
            )
        if not actions.any():
            raise DataError(
                "all actions are zero: which directions never move cannot be told; give samples that move"
            )
        self.n_actions_ = d
        return X, actions, check_groups(groups, len(X))

    def _asked(self, n_constraints) -> int | None:
        if n_constraints is None:
            return None
        whole = isinstance(n_constraints, int | np.integer) and not isinstance(n_constraints, bool)
        if not whole or not 1 <= n_constraints < self.n_actions_:
            raise PolicyError(
                f"n_constraints must be a whole number from 1 to {self.n_actions_ - 1}, one below the actions' "
                f"{self.n_actions_}, or None, got {n_constraints!r}"
            )
        return int(n_constraints)


def held_out_projections(constraint: LearntConstraint, X: np.ndarray, U: np.ndarray, groups) -> np.ndarray:
    """Projections (N, d, d) at every sample by copies of `constraint` fitted to the folds it is not in.

    X (N, n), U (N, d), groups (N,): episodes or blocks, held out whole.
    """
    N = np.empty((*U.shape, U.shape[1]))
    for train, test in splits(len(X), groups):
        N[test] = clone(constraint).fit(X[train], U[train], groups=groups[train]).predict(X[test])
    return N


def load_constraint(path: str | Path, *, trusted: Sequence[str] = ()) -> LearntConstraint:
    """The constraint that `constraint.save(path)` wrote; all else as for `load_policy`.

    Raises `PolicyFileError` for any other file.
    """
    loaded = persistence.load_policy(path, trusted=trusted)
    if not isinstance(loaded, LearntConstraint):
        raise PolicyFileError(
            f"{path} holds a {type(loaded).__name__}, not a constraint: load it with load_policy"
        )
    return loaded
