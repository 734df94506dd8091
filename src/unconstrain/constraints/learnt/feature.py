"""Constraints that depend on the state: rows linear in features, found as generalised eigenvectors.

A row ``r(x) = Φ(x)ᵀ λ`` is a policy that never moves along any action: the features
of policies (`features.base`) serve here as well, and ``r(x)·u = v(x, u)·λ``. The share of motion along the row,

    μ(λ) = Σ_n (r(x_n)·u_n)² / Σ_n ‖r(x_n)‖² ‖u_n‖²  =  λᵀH λ / λᵀG λ,

is a quotient of two sums over samples; its minimum is the smallest generalised eigenvector of ``H λ = μ G λ``. A
further row is found the same way in what is at right angles, at each state, to the rows found before (deflation).

One thing is left: if r is a row then so is f(x) r(x), for any f that the features can express, and only its length
differs. Among rows that fit alike the one of even length is wanted, for a row that passes through zero has no direction
there. So r minimises

    μ(r) - μ_1 ‖r‖² + ρ · mean ‖r(x_n) - t_n‖²   over λ and unit vectors t_n,

μ_1 the smallest eigenvalue, by turns in t, which is ``r / ‖r‖``, and in λ, which in the basis of eigenvectors is
``c_j = ρ / (μ_j - μ_1 + ρ) · mean e_j(x_n)·t_n``. With a single μ_j near μ_1 this is that eigenvector. ρ is chosen by
the share of motion along the unit row on held-out episodes.
"""

from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from unconstrain.arrays import check_number
from unconstrain.constraints.learnt.base import LearntConstraint
from unconstrain.constraints.learnt.jacobian import JacobianFeatures
from unconstrain.constraints.learnt.spectrum import count_constrained, format_shares
from unconstrain.features.base import Features, fit_features
from unconstrain.features.full import as_features
from unconstrain.fitting.solve import EpisodeFolds
from unconstrain.motion import root_mean_square
from unconstrain.undo import undone_on_failure

RHOS = np.array([1e-10, 1e-8, 1e-7, 1e-6, 1e-4, 1e-2, 1e-1])
RESOLUTION = 1e-10
"""Combinations of features whose rows are this much shorter (in squares) than the longest are rounding."""
DAMPED = 1e-3
"""Eigenvectors that ρ would damp below this are left out."""
NUMBERS = 40_000_000
"""Samples times actions times features used, at most; of more samples every second, third, ... is taken."""
TURNS, SETTLED = 20, 1e-4
SAMPLES_TO_EVEN = 2000
"""A row's length is evened out in so many turns and on so many samples at most: it is a choice among equals."""


class FeatureConstraint(LearntConstraint):
    """A constraint ``A(x) u = 0`` whose rows ``A(x) = Λ Φ(x)`` are linear in features of the state.

    Parameters
    ----------
    features : callable, transformer or feature map, optional
        What the rows are combined from. A function that returns a task Jacobian J (N, m, d) at states X (N, n): then
        Λ (k, m) says which task coordinates are constrained. A scikit-learn transformer b, by default
        ``b(x) = (x, 1)``: then ``Φ(x) = b(x) ⊗ I``, any direction that varies as b does. Or a feature map:
        `PotentialFeatures(PolynomialFeatures(2))`, say, makes the row a gradient: the constraint is a quadric surface.
    n_constraints : int, optional
        Number k of rows. None reads it off the shares of motion, as `ConstantConstraint` does, which needs actions
        that differ at like states: features flexible enough make any one movement look constrained but along itself.
    alpha : float or "cv"
        Weight ρ on rows of even length (see Notes); "cv" chooses it by held-out episodes.

    Attributes
    ----------
    weights_ : ndarray of shape (k, P)
        The rows' parameters.
    features_ : feature map
        As fitted.
    n_constraints_ : int
        Number k of rows.
    shares_ : ndarray
        Share of motion along each row, on held-out episodes, and, with ``n_constraints=None``, along the rest.
    alphas_ : ndarray of shape (k,)
        ρ of each row.
    reason_ : str
        Why so many rows.

    Notes
    -----
    A row is the smallest generalised eigenvector of two moments; the module says how, and how ρ chooses among the
    rows that fit alike.

    References
    ----------
    The problem is that of Lin, Howard, Vijayakumar, ICRA 2015, who search angles by nonlinear least squares, and of
    Armesto, Bosga, Ivan, Vijayakumar, ICRA 2017, who take eigenvectors.
    """

    weights_: np.ndarray
    features_: Features
    alphas_: np.ndarray

    def __init__(
        self,
        features: object = None,
        n_constraints: int | None = 1,
        alpha: float | str = "cv",
    ):
        self.features = features
        self.n_constraints = n_constraints
        self.alpha = alpha

    @undone_on_failure
    def fit(self, X: ArrayLike, U: ArrayLike, *, groups: ArrayLike | None = None) -> Self:
        """Learn from actions that were all under one constraint.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.
        U : array_like of shape (N, d)
            Actions, d > 1.
        groups : array_like of shape (N,), optional
            Episodes, held out whole; without them contiguous blocks are.

        Returns
        -------
        FeatureConstraint
            Itself, fitted.

        Raises
        ------
        DataError
            If the actions span everything, are all zero, or are fewer than d.
        PolicyError
            For bad options.
        """
        X, U, groups = self._check_samples(X, U, groups)
        asked = self._check_number_of_rows(self.n_constraints)
        rhos = RHOS if self.alpha == "cv" else np.array([check_number(self.alpha, "alpha", positive=True)])
        U = U / root_mean_square(U)
        weights = np.sum(U**2, axis=1)
        self.features_ = fit_features(_as_row_features(self.features), X, self.n_actions_, weights)
        n_parameters = self.features_.along(X[:1], U[:1]).shape[1]
        fold = EpisodeFolds().assign(groups, len(X))
        step = -(-len(X) * self.n_actions_ * n_parameters // NUMBERS)
        X, U, fold, weights = X[::step], U[::step], fold[::step], weights[::step]
        phi = np.stack(
            [self.features_.along(X, np.broadcast_to(e, U.shape)) for e in np.eye(self.n_actions_)], axis=1
        )
        found, shares, chosen = [], [], []
        before = np.zeros((len(X), 0, self.n_actions_))
        for _ in range(asked or self.n_actions_ - 1):
            problem = _Problem(phi, U, weights, fold, before)
            rho, share = problem.choose(rhos)
            found.append(problem.solve(rho))
            shares.append(share)
            chosen.append(rho)
            before = np.concatenate([before, _orthonormal(phi @ found[-1], before)[:, None]], axis=1)
        if asked is None:
            shares.append(float(np.sum(_remove(U, before) ** 2) / np.sum(U**2)))
            self.n_constraints_, self.reason_ = count_constrained(np.array(shares))
        else:
            self.n_constraints_ = asked
            self.reason_ = f"as asked; shares of motion {format_shares(np.array(shares))}"
        self.weights_ = np.array(found[: self.n_constraints_])
        self.shares_, self.alphas_ = np.array(shares), np.array(chosen[: self.n_constraints_])
        return self

    @property
    def constrained_features_(self) -> np.ndarray:
        """How far each of the P features is constrained, (P,), from 0 to 1: the diagonal of the projection on Λ's rows.

        With a task Jacobian: which of its rows are held fixed. 1 for a row that is, 0 for one that is free.
        """
        Q, _ = np.linalg.qr(self.weights_.T)
        return np.sum(Q**2, axis=1)

    def evaluate_rows(self, X: np.ndarray) -> np.ndarray:
        """Combine the features to rows, each at right angles to those before.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, k, d)
            Orthonormal rows.
        """
        rows = np.zeros((len(X), 0, self.n_actions_))
        for w in self.weights_:
            rows = np.concatenate([rows, _orthonormal(self.features_.evaluate(X, w), rows)[:, None]], axis=1)
        return rows


class _Problem:
    """One row: its moments by fold, and the parameters they give.

    phi (N, d, P): features along each action; before (N, j, d): rows found so far, unit and at right angles.
    """

    def __init__(
        self, phi: np.ndarray, U: np.ndarray, weights: np.ndarray, fold: np.ndarray, before: np.ndarray
    ):
        self.phi, self.U, self.weights, self.fold, self.before = phi, U, weights, fold, before
        self.folds = np.unique(fold)
        free = phi - before.swapaxes(1, 2) @ (before @ phi)
        along = (U[:, None] @ free)[:, 0]
        spread = free * np.sqrt(weights)[:, None, None]
        parts = [(along[fold == k], spread[fold == k].reshape(-1, phi.shape[2])) for k in self.folds]
        self.H = np.stack([V.T @ V for V, _ in parts])
        self.G = np.stack([R.T @ R for _, R in parts])

    def solve(self, rho: float) -> np.ndarray:
        """Find the row's parameters λ (P,) from all samples."""
        everything = np.ones(len(self.U), dtype=bool)
        return self._solve(np.array([rho]), self.H.sum(axis=0), self.G.sum(axis=0), everything)[:, 0]

    def choose(self, rhos: np.ndarray) -> tuple[float, float]:
        """Choose the ρ with the least share of motion along the unit row on held-out folds; and that share."""
        along = np.zeros(len(rhos))
        for i, k in enumerate(self.folds):
            out = self.fold == k
            H, G, train = self.H[0], self.G[0], out
            if len(self.folds) > 1:
                H, G, train = (
                    np.delete(self.H, i, axis=0).sum(axis=0),
                    np.delete(self.G, i, axis=0).sum(axis=0),
                    ~out,
                )
            for j, w in enumerate(self._solve(rhos, H, G, train).T):
                unit = _orthonormal(self.phi[out] @ w, self.before[out])
                along[j] += np.sum(np.einsum("nd,nd->n", unit, self.U[out]) ** 2)
        # Of shares alike to a part in a thousand (or rounding), the row of most even length.
        shares = along / np.sum(self.weights)
        best = int(np.flatnonzero(shares <= 1.001 * shares.min() + 1e-25)[-1])
        return float(rhos[best]), float(shares[best])

    def _solve(self, rhos: np.ndarray, H: np.ndarray, G: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Find λ for each ρ, (P, R), from moments H and G (P, P) of the samples `own` (N,)."""
        lengths, E = np.linalg.eigh(G)
        keep = lengths > RESOLUTION * lengths[-1]
        W = E[:, keep] / np.sqrt(lengths[keep])
        shares, C = np.linalg.eigh(W.T @ H @ W)
        directions = W @ C

        index = np.flatnonzero(own & (self.weights > 0))
        index = index[:: max(1, len(index) // SAMPLES_TO_EVEN)]
        weights, U = self.weights[index], self.U[index]
        # Rows of the eigenvectors that the largest ρ can make use of, (J, N, d), of mean square length 1.
        useful = directions[:, (shares - shares[0]) * DAMPED <= max(rhos)]
        rows = self.phi[index] @ useful
        rows -= self.before[index].swapaxes(1, 2) @ (self.before[index] @ rows)
        rows = np.moveaxis(rows, 2, 0) * np.sqrt(np.sum(self.weights[own]))
        solutions = []
        for rho in rhos:
            damping = rho / (shares[: len(rows)] - shares[0] + rho)
            taken = damping > DAMPED
            solutions.append(useful[:, taken] @ _even(rows[taken], damping[taken], weights, U))
        return np.stack(solutions, axis=1)


def _even(rows: np.ndarray, damping: np.ndarray, weights: np.ndarray, U: np.ndarray) -> np.ndarray:
    """Find the coefficients (J,) of the combination of rows (J, N, d) of the most even length, damped (J,)."""
    if len(rows) == 1:
        return np.ones(1)
    flat = rows.reshape(len(rows), -1)
    weighted = (damping[:, None] * flat) * np.repeat(weights / np.sum(weights), rows.shape[2])
    # From the smallest eigenvector's own directions, and from the one direction least moved in.
    first = np.zeros(len(rows))
    first[0] = 1.0
    constant = np.linalg.eigh(U.T @ U)[1][:, 0]
    best, least = first, np.inf
    for c in (first, weighted @ np.tile(constant, rows.shape[1])):
        for _ in range(TURNS):
            t = _normalize((c @ flat).reshape(rows.shape[1:]))
            new = weighted @ t.ravel()
            done = np.linalg.norm(new - c) <= SETTLED * np.linalg.norm(new)
            c = new
            if done:
                break
        length = np.linalg.norm((c @ flat).reshape(rows.shape[1:]), axis=1)
        if not length.any():
            continue
        # Unevenness: what a unit row would still be missing, in shares of its mean square.
        uneven = 1.0 - (weights @ length) ** 2 / (np.sum(weights) * (weights @ length**2))
        if uneven < least:
            best, least = c, uneven
    return best


def _orthonormal(raw: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Make rows (N, d) unit and at right angles to rows `before` (N, j, d); zero where nothing is left of them."""
    row = _remove(_remove(raw, before), before)  # twice is enough for rounding
    length = np.linalg.norm(row, axis=1, keepdims=True)
    whole = np.linalg.norm(raw, axis=1, keepdims=True)
    return np.divide(row, length, out=np.zeros_like(row), where=length > 1e-12 * np.maximum(whole, 1e-300))


def _remove(rows: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Remove what of rows (N, d) lies along unit rows `before` (N, j, d)."""
    return rows - np.einsum("nkd,nk->nd", before, np.einsum("nkd,nd->nk", before, rows))


def _normalize(rows: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    return np.divide(rows, length, out=np.zeros_like(rows), where=length > 0)


def _as_row_features(given: object) -> Features:
    """Make a feature map of rows: a function is a Jacobian; anything that can be fitted is as for a policy."""
    if callable(given) and not hasattr(given, "fit"):
        return JacobianFeatures(given)
    return as_features(given)
