"""Local linear models, each learnt alone, blended by their receptive fields. Source: ICRA 2009, Sec. III-B."""

import numpy as np

from unconstrain.arrays import check_number
from unconstrain.features.centers import place
from unconstrain.fitting.accumulate import local_moments
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import Sight
from unconstrain.fitting.posterior import Posterior, local_covariance
from unconstrain.policies.base import Policy
from unconstrain.receptive import normalized_activations

BLOCK_ROWS = 4096


class LocallyLinearPolicy(Policy):
    """`pi(x) = Σ_m ω_m(x) B_m (x, 1)`, with `ω_m = K_m / Σ_j K_j` and `K_m(x) = exp(-‖x - c_m‖² / 2σ²)`.

    Each B_m minimises the risk with its samples weighted by K_m, whatever the other models do.

    width: σ, in the states' unit. None takes the width at which `n_centers` models reach the coverage, or, for other
        placements, 1.5 times the centres' mean spacing.
    centers: "coverage", "kmeans", "grid", or an array (M, n).
    coverage: every sample has a weight of at least this in some model; with a width given it sets their number.
    n_centers: how many models, where neither a width nor the centres themselves say so.
    risk, alpha: as for `ParametricPolicy`; one λ for all models.
    random_state: for "kmeans".

    After `fit`: `centers_` (M, n), `width_`, `coef_` (M, d, n), `intercept_` (M, d), and what `ParametricPolicy` lists.
    """

    def __init__(
        self,
        *,
        width=None,
        centers="coverage",
        coverage=0.7,
        n_centers=30,
        risk="auto",
        alpha=1e-6,
        random_state=0,
    ):
        self.width = width
        self.centers = centers
        self.coverage = coverage
        self.n_centers = n_centers
        self.risk = risk
        self.alpha = alpha
        self.random_state = random_state

    def _place(self, X: np.ndarray, d: int, weights: np.ndarray) -> None:
        self.centers_, self.width_ = place(
            X,
            self.centers,
            n_centers=self.n_centers,
            width=None if self.width is None else check_number(self.width, "width", positive=True),
            coverage=self.coverage,
            sample_weight=weights,
            random_state=self.random_state,
        )

    def _placed_by_data(self) -> bool:
        return isinstance(self.centers, str) or self.width is None

    def _moments(self, X: np.ndarray, seen: Sight, weights: np.ndarray | None = None) -> Moments:
        return local_moments(self.centers_, self.width_, X, seen, weights)

    def _take_up(self, w: np.ndarray) -> None:
        models = w.reshape(len(w), self.n_actions_, -1)
        self.coef_, self.intercept_ = models[:, :, :-1].copy(), models[:, :, -1].copy()

    def _parameters(self) -> np.ndarray:
        return np.concatenate([self.coef_, self.intercept_[:, :, None]], axis=2).reshape(len(self.coef_), -1)

    def _evaluate(self, X: np.ndarray) -> np.ndarray:
        actions = np.empty((len(X), self.n_actions_))
        slopes = self.coef_.reshape(-1, X.shape[1]).T
        for start in range(0, len(X), BLOCK_ROWS):
            block = X[start : start + BLOCK_ROWS]
            blend = normalized_activations(block, self.centers_, self.width_)
            local = (block @ slopes).reshape(len(block), *self.intercept_.shape) + self.intercept_
            actions[start : start + BLOCK_ROWS] = np.einsum("nm,nmd->nd", blend, local)
        return actions

    def _deviation(self, X: np.ndarray, P: np.ndarray, posterior: Posterior) -> np.ndarray:
        return local_covariance(self.centers_, self.width_, X, P, posterior)
