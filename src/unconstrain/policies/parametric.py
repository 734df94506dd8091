"""`π(x) = Φ(x) w`: one set of parameters for all states.

References
----------
Howard et al., ICRA 2009, Sec. III-A.
"""

from typing import Any

import numpy as np

from unconstrain.features.base import Features, LinearInState, fit_features
from unconstrain.features.full import as_features
from unconstrain.fitting.global_model import GlobalModel
from unconstrain.fitting.in_space import InSpace
from unconstrain.fitting.model import LinearModel
from unconstrain.policies.linear import LinearPolicy
from unconstrain.spaces import Space


class ParametricPolicy(LinearPolicy):
    """The unconstrained policy `π(x) = Φ(x) w` behind constrained movements, `w` of least risk and weight decay.

    Parameters
    ----------
    features : transformer, Features, or None
        Any scikit-learn transformer whose output is `b(x)` (`NormalizedRBF`, `SplineTransformer`, ...), shared by all
        actions; a feature map (see `features.base`); or None for the linear policy, `b(x) = (x, 1)`.
    risk : {"adaptive", "corrected", "inconsistency", "direct"}
        "adaptive" infers which samples were free and how noisy the actions are; it learns from the whole action of
        free samples, and from the others as far as they show the policy (`fitting.contact`). "inconsistency" learns
        from each action along its own direction, as published. "corrected" does too, but takes away what noise adds, in
        one pass (`fitting.corrected`). All three make use of the projections that are known. "direct" is ordinary
        regression.
    alpha : "cv" or float
        The weight decay λ, a pure number: relative to what the samples say on the mean of the parameters, whatever the
        units (`fitting.decay`). Intercepts hardly decay. "cv" chooses it by held-out risk among 25 values over five
        folds of episodes.
    space : Space, optional
        What the states are; see `unconstrain.spaces`. By default what the demonstrations say, or numbers.
    scale : "auto" or array_like of shape (d,), optional
        What a length of one is along each action: lengths, angles and noise are those of `u_i / s_i`. "auto" takes how
        far the states spread along each. By default actions count as they are, but where some are angles, and others
        are not, the spread of all of a unit decides.
    noise : float, optional
        Standard deviation of the actions' noise, in their unit, where it is known; by default what `Demonstrations` say
        of velocities that were differentiated. With "adaptive" the noise that is inferred is not below it, with
        "corrected" that much is taken away; the other risks do not look at it.

    Attributes
    ----------
    weights_ : ndarray of shape (P,)
        The parameters w of the fitted features; those of linear ones are functions of the standardised state.
    coef_, intercept_ : ndarray of shape (d, n) and (d,)
        The linear policy `coef_ @ x + intercept_`, in the states' units; not there for other features.
    features_ : Features
        The fitted feature map.
    alpha_ : float
        The λ used.
    alphas_, held_out_risk_ : ndarray of shape (25,)
        The candidates and their held-out risk, with `alpha="cv"`.
    n_samples_seen_, n_zero_actions_, n_known_constraints_ : int
        How many samples were learnt from, how many of them have no direction, and of how many the projection was known.
    noise_ : float
        With the adaptive or the corrected risk: noise of the actions in their unit.
    speed_noise_, free_share_ : float
        With the adaptive risk: noise of the speed as a share of it, and share of samples that were free.
    log_likelihood_ : float
        With the adaptive risk: of a held-out sample.
    log_likelihoods_ : dict of str to float
        That, and those of "all free", "all constrained" and other runs.
    history_ : list of dict
        With the adaptive risk: what each pass found.

    Examples
    --------
    >>> import numpy as np, unconstrain as uc
    >>> X = np.random.default_rng(0).normal(size=(200, 2))
    >>> Pi = X @ [[-1.0, 0.5], [-0.5, -1.0]]                      # the unconstrained policy
    >>> N = uc.constraints.projection(np.random.default_rng(1).normal(size=(200, 1, 2)))
    >>> U = np.einsum("nij,nj->ni", N, Pi)                        # what is recorded
    >>> policy = uc.ParametricPolicy().fit(X, U)
    >>> bool(uc.metrics.unconstrained_policy_error(Pi, policy.predict(X)) < 1e-9)
    True
    """

    def __init__(
        self,
        features: Any = None,
        *,
        risk: str = "adaptive",
        alpha: float | str = "cv",
        space: Space | None = None,
        scale: Any = None,
        noise: float | None = None,
    ):
        self.features = features
        self.risk = risk
        self.alpha = alpha
        self.space = space
        self.scale = scale
        self.noise = noise

    def place(self, X: np.ndarray, d: int, sample_weight: np.ndarray) -> LinearModel:
        """Fit the features.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States, checked.
        d : int
            Dimension of the actions.
        sample_weight : ndarray of shape (N,)
            Weight of each sample.

        Returns
        -------
        GlobalModel
            Fitted, without parameters.

        Raises
        ------
        PolicyError
            `features` is not a feature map, or does not fit these dimensions.
        """
        features = fit_features(as_features(self.features), X, d, sample_weight)
        return GlobalModel(features, X.shape[1], d)

    @property
    def weights_(self) -> np.ndarray:
        """The parameters w, (P,)."""
        return self.solution_.w

    @property
    def features_(self) -> Features:
        """The fitted feature map."""
        return self.model_.features

    @property
    def coef_(self) -> np.ndarray:
        """The slopes of a linear policy, (d, n), in the states' units."""
        return self._linear[0]

    @property
    def intercept_(self) -> np.ndarray:
        """The action of a linear policy at the states' origin, (d,)."""
        return self._linear[1]

    @property
    def _linear(self) -> tuple[np.ndarray, np.ndarray]:
        features = None if isinstance(self.model_, InSpace) else self.model_.features
        linear = features.linear(self.solution_.w) if isinstance(features, LinearInState) else None
        if linear is None:
            raise AttributeError("coef_ and intercept_ are there only for the linear policy, features=None")
        return linear
