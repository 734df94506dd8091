"""What learnt constraints share: rows give projections, and projections a score."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, clone
from sklearn.utils.validation import check_is_fitted

from unconstrain import metrics
from unconstrain.arrays import check_actions, check_groups, check_names, check_samples, check_states, quote
from unconstrain.constraints.learnt.lines import equation, mean_line
from unconstrain.errors import DataError, PolicyError
from unconstrain.fitting.solve import splits
from unconstrain.storage import Kind, load_object, save_object

LARGEST_DIMENSION = 10**4


class LearntConstraint(BaseEstimator, ABC):
    """Base of the estimators of constraints: a subclass fits, and says what its orthonormal rows are at given states.

    Attributes
    ----------
    n_constraints_ : int
        Number k of rows.
    n_actions_ : int
        Dimension d of the actions.
    shares_ : ndarray
        Shares of motion along each row, and along the other directions where they were looked at, ascending.
    reason_ : str
        Why so many rows.
    """

    n_constraints_: int
    n_actions_: int
    shares_: np.ndarray
    reason_: str

    @abstractmethod
    def fit(self, X: ArrayLike, U: ArrayLike, *, groups: ArrayLike | None = None) -> Self:
        """Learn from actions that were all under one constraint.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.
        U : array_like of shape (N, d)
            Actions, d > 1.
        groups : array_like of shape (N,), optional
            Episodes.

        Returns
        -------
        LearntConstraint
            Itself, fitted.
        """

    @abstractmethod
    def evaluate_rows(self, X: np.ndarray) -> np.ndarray:
        """Compute the rows at states that were checked already; `rows` is what users call.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, k, d)
            Orthonormal rows.
        """

    def rows(self, X: ArrayLike) -> np.ndarray:
        """Compute the constraint rows at states.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, k, d)
            ``A(x)`` with ``A u ≈ 0``, orthonormal at each state. A row is zero where the constraint vanishes or its
            direction is not determined.
        """
        check_is_fitted(self)
        return self.evaluate_rows(check_states(self, X))

    def predict(self, X: ArrayLike) -> np.ndarray:
        """Compute the nullspace projections at states, to be given to ``policy.fit(..., projections=)``.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, d, d)
            ``N = I - AᵀA``.
        """
        A = self.rows(X)
        return np.eye(self.n_actions_) - A.swapaxes(1, 2) @ A

    def score(self, X: ArrayLike, U: ArrayLike) -> float:
        """Compute the share of the motion that the constraint lets through.

        Of constraints with the same number of rows the higher is the better; with more rows it can only fall.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.
        U : array_like of shape (N, d)
            Actions, of any magnitude.

        Returns
        -------
        float
            ``1 - Σ ‖u - N u‖² / Σ ‖u‖²``, at most 1.

        Raises
        ------
        DataError
            If nothing moves.
        """
        actions = check_actions(U)
        largest = np.abs(actions).max(initial=0.0)
        if largest == 0.0:
            raise DataError("all actions are zero: there is no motion to compare a constraint with")
        actions = actions / largest
        motion = float(np.mean(np.sum(actions**2, axis=1)))
        return 1.0 - metrics.projected_observation_error(actions, self.predict(X)) / motion

    def describe(self, X: ArrayLike, action_names: Sequence[str]) -> str:
        """State the rows as equations between the actions, and why there are so many.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States, over which rows that vary are averaged.
        action_names : sequence of str
            Names of the d actions.

        Returns
        -------
        str
            Several lines.
        """
        check_is_fitted(self)
        names = check_names(action_names, "action_names", self.n_actions_)
        lines = [f"rows: {self.n_constraints_} ({self.reason_})"]
        A = self.rows(X)
        for j in range(A.shape[1]):
            mean = mean_line(A[:, j])
            turned = np.degrees(np.arccos(np.clip(np.abs(A[:, j] @ mean), 0.0, 1.0)))
            lines.append(
                f"  {equation(mean, names)}   on average; it turns by {np.median(turned):.0f}° (median)"
            )
        return "\n".join(lines)

    def save(self, path: str | Path) -> None:
        """Write the constraint to a file that `load_constraint` reads. Nothing in it is code.

        A task Jacobian of your own is saved by the name of its function; give `load_constraint` the function again.

        Parameters
        ----------
        path : path-like
            Customarily it ends in ``.skops``. An existing file is replaced.

        Raises
        ------
        UnconstrainError
            The place cannot be written to, or the constraint holds something that cannot be saved, such as a lambda.
        """
        check_is_fitted(self)
        save_object(path, Kind.CONSTRAINT, self, _check_usable)

    def _check_samples(
        self, X: ArrayLike, U: ArrayLike, groups: ArrayLike | None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        X, U = check_samples(self, X, U, reset=True)
        U = check_actions(U)
        d = U.shape[1]
        if d < 2:
            raise DataError(
                "a constraint needs two or more actions: with one, it would leave no motion at all"
            )
        if len(U) < d:
            raise DataError(
                f"{len(U)} samples are fewer than the {d} actions: which directions never move cannot be told; "
                "give more samples"
            )
        if not U.any():
            raise DataError(
                "all actions are zero: which directions never move cannot be told; give samples that move"
            )
        self.n_actions_ = d
        return X, U, check_groups(groups, len(X))

    def _check_number_of_rows(self, n_constraints: int | None) -> int | None:
        if n_constraints is None:
            return None
        whole = isinstance(n_constraints, int | np.integer) and not isinstance(n_constraints, bool)
        if not whole or not 1 <= n_constraints < self.n_actions_:
            raise PolicyError(
                f"n_constraints must be a whole number from 1 to {self.n_actions_ - 1}, one below the actions' "
                f"{self.n_actions_}, or None, got {quote(n_constraints)}"
            )
        return int(n_constraints)


def held_out_projections(
    constraint: LearntConstraint, X: np.ndarray, U: np.ndarray, groups: np.ndarray
) -> np.ndarray:
    """Predict projections at every sample by copies of a constraint fitted to the folds it is not in.

    Parameters
    ----------
    constraint : LearntConstraint
        Is cloned, never changed.
    X : ndarray of shape (N, n)
        States.
    U : ndarray of shape (N, d)
        Actions.
    groups : ndarray of shape (N,)
        Episodes or blocks, held out whole.

    Returns
    -------
    ndarray of shape (N, d, d)
        Nullspace projections.
    """
    N = np.empty((*U.shape, U.shape[1]))
    for train, test in splits(len(X), groups):
        N[test] = clone(constraint).fit(X[train], U[train], groups=groups[train]).predict(X[test])
    return N


def load_constraint(path: str | Path, *, trusted: Iterable[Any] = ()) -> LearntConstraint:
    """Read a constraint that `constraint.save(path)` wrote.

    Nothing in the file is run, whoever wrote it.

    Parameters
    ----------
    path : path-like
        The file.
    trusted : iterable of classes and functions, optional
        Those of your own that the constraint holds, such as a task Jacobian. The file has only their names, so give
        the classes and functions themselves.

    Returns
    -------
    LearntConstraint
        A fitted one, found to answer.

    Raises
    ------
    ArchiveError
        The file is missing, damaged, not a constraint, or from a newer release, or holds something that is not trusted.
    """
    return load_object(
        path, Kind.CONSTRAINT, LearntConstraint, _check_usable, trusted=trusted, loader="load_constraint"
    )


def _check_usable(constraint: LearntConstraint) -> None:
    check_is_fitted(constraint)
    n, d = constraint.n_features_in_, constraint.n_actions_
    if not all(isinstance(each, int) and 0 < each <= LARGEST_DIMENSION for each in (n, d)):
        raise TypeError("it has no dimensions")
    projections = constraint.predict(np.zeros((1, n)))
    if projections.shape != (1, d, d):
        raise TypeError(f"its projections have shape {projections.shape}")
    if not np.isfinite(projections).all():
        raise ValueError("its projections are not finite")
