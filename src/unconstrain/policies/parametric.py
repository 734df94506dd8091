"""`pi(x) = Φ(x) w`: one set of parameters for all states. Source: ICRA 2009, Sec. III-A."""

import numpy as np

from unconstrain.features.full import as_policy_features
from unconstrain.fitting.accumulate import parametric_moments
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import Sight
from unconstrain.fitting.posterior import Posterior, parametric_covariance
from unconstrain.policies.base import Policy


class ParametricPolicy(Policy):
    """The unconstrained policy `pi(x) = W b(x)` behind constrained movements, `w = (H + λI)⁻¹ g`.

    features: any scikit-learn transformer whose output is `b(x)` (`NormalizedRBF`, `SplineTransformer`, ...), shared
        by all actions; policy features (see `features.base`); or None for the linear policy, `b(x) = (x, 1)`.
    risk: "auto" (the inconsistency, which needs only the data; for samples whose constraint is known, given as
        `projections` to `fit`, the error under it), "inconsistency" (whatever is known), "direct" (ordinary regression;
        also the oracle, when fitted to the true policy), or "constrained" (needs the projections of all samples).
    alpha: the weight decay λ of `E(w) + λ‖w‖²`, with E the sum of squared errors over samples; or "cv" to choose
        it by held-out risk among 25 values over five folds of episodes.

    After `fit`: `weights_` (P,), `features_`, `alpha_`, `n_zero_actions_` (how many samples have no direction; the
    inconsistency leaves them out), `n_known_constraints_` (of how many the constraint was known, 0 without
    projections), `n_samples_seen_`; with "cv" `alphas_` and `held_out_risk_`, (25,).

    >>> import numpy as np, unconstrain as uc
    >>> X = np.random.default_rng(0).normal(size=(200, 2))
    >>> Pi = X @ [[-1.0, 0.5], [-0.5, -1.0]]                      # the policy nobody ever sees whole
    >>> N = uc.constraints.projection(np.random.default_rng(1).normal(size=(200, 1, 2)))
    >>> U = np.einsum("nij,nj->ni", N, Pi)                        # what is recorded
    >>> policy = uc.ParametricPolicy().fit(X, U)
    >>> bool(uc.metrics.unconstrained_policy_error(Pi, policy.predict(X)) < 1e-9)
    True
    """

    def __init__(self, features=None, *, risk="auto", alpha=1e-6):
        self.features = features
        self.risk = risk
        self.alpha = alpha

    def _place(self, X: np.ndarray, d: int, weights: np.ndarray) -> None:
        self.features_ = as_policy_features(self.features).fit(X, d, weights)

    def _placed_by_data(self) -> bool:
        return self.features is not None

    def _moments(self, X: np.ndarray, seen: Sight, weights: np.ndarray | None = None) -> Moments:
        return parametric_moments(self.features_, X, seen, weights)

    def _take_up(self, w: np.ndarray) -> None:
        self.weights_ = w

    def _parameters(self) -> np.ndarray:
        return self.weights_

    def _evaluate(self, X: np.ndarray) -> np.ndarray:
        return self.features_.evaluate(X, self.weights_)

    def _deviation(self, X: np.ndarray, P: np.ndarray, posterior: Posterior) -> np.ndarray:
        return parametric_covariance(self.features_, X, P, posterior)
