"""A constraint that is a mechanism: a drawer, a hinge, a plane, a sphere or a cylinder."""

from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from unconstrain.constraints.learnt.base import LearntConstraint
from unconstrain.constraints.mechanisms import Mechanism, Shape, find_mechanism
from unconstrain.errors import DataError
from unconstrain.undo import undone_on_failure


class MechanismConstraint(LearntConstraint):
    """A constraint ``A(x) u = 0`` of the mechanism that positions moved under.

    States are positions in two or three dimensions, and actions their velocities.

    Parameters
    ----------
    play : float, optional
        How far positions stray from the mechanism: see `constraints.find_mechanism`.

    Attributes
    ----------
    kind_ : str
        "prismatic", "hinge", "plane", "sphere" or "cylinder".
    point_, direction_ : ndarray of shape (d,)
        Where it is: see `constraints.mechanisms.Shape`.
    radius_ : float
        Of a circle, a sphere or a cylinder; zero for others.
    n_constraints_ : int
        Number k of rows.
    shares_ : ndarray of shape (k,)
        Share of motion along each row.
    reason_ : str
        Why so many rows.

    Notes
    -----
    The mechanism is found in the positions, by model comparison; the actions serve for `shares_` and `score`.

    Examples
    --------
    >>> import numpy as np, unconstrain as uc
    >>> angle = np.linspace(0.0, 1.0, 100)
    >>> X = np.column_stack([0.8 * np.cos(angle), 0.8 * np.sin(angle)])
    >>> found = uc.MechanismConstraint().fit(X, np.gradient(X, axis=0))
    >>> found.kind_, round(found.radius_, 3)
    ('hinge', 0.8)
    """

    kind_: str
    point_: np.ndarray
    direction_: np.ndarray
    radius_: float

    def __init__(self, play: float | None = None):
        self.play = play

    @undone_on_failure
    def fit(self, X: ArrayLike, U: ArrayLike, *, groups: ArrayLike | None = None) -> Self:
        """Learn from movements along one mechanism.

        Parameters
        ----------
        X : array_like of shape (N, n)
            Positions, n of 2 or 3, in the order of time.
        U : array_like of shape (N, n)
            Their velocities.
        groups : array_like of shape (N,), optional
            Episodes.

        Returns
        -------
        MechanismConstraint
            Itself, fitted.

        Raises
        ------
        DataError
            If there is no mechanism, or it is at another place in each episode: then there are no rows at a state, and
            `constraints.find_mechanism` gives those of each episode.
        """
        X, U, groups = self._check_samples(X, U, groups)
        if X.shape != U.shape:
            raise DataError(
                "a mechanism is found where actions are the velocities of positions, and these are "
                f"{U.shape[1]} actions at {X.shape[1]} states"
            )
        return self._take(find_mechanism(X, episodes=groups, play=self.play), U, X)

    def _take(self, found: Mechanism, U: np.ndarray, X: np.ndarray) -> Self:
        if found.kind == "none" or not found.shapes:
            raise DataError(
                "no mechanism explains these positions, neither a drawer, a hinge, a plane, a sphere nor a cylinder; "
                "give play= if they may stray further, or find rows of another kind"
            )
        if len(found.shapes) > 1:
            raise DataError(
                f"these positions moved under a {found.kind} at another place in each episode, so that no rows belong "
                "to a state: learn from episodes that have it at one place"
            )
        (shape,) = found.shapes
        self.kind_, self.point_, self.direction_ = shape.kind, shape.point, shape.direction
        self.radius_ = shape.radius if np.isfinite(shape.radius) else 0.0
        A = shape.rows(X)
        self.n_constraints_ = A.shape[1]
        self.shares_ = np.sum(np.einsum("nkd,nd->nk", A, U) ** 2, axis=0) / np.sum(U**2)
        self.reason_ = f"a {found.kind}, which {found.share:.0%} of the path lies on"
        return self

    def evaluate_rows(self, X: np.ndarray) -> np.ndarray:
        """Compute the rows of the mechanism.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            Positions.

        Returns
        -------
        ndarray of shape (N, k, n)
            Orthonormal rows.
        """
        shape = Shape(self.kind_, self.point_, self.direction_, self.radius_)  # type: ignore[arg-type]
        return shape.rows(X)
