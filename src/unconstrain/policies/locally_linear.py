"""Local models, each learnt alone, blended by their receptive fields.

References
----------
Howard et al., ICRA 2009, Sec. III-B.
"""

from typing import Any

import numpy as np

from unconstrain.arrays import check_choice
from unconstrain.features.base import Features, fit_features
from unconstrain.features.centers import place_centers
from unconstrain.features.full import as_features
from unconstrain.fitting.in_space import InSpace
from unconstrain.fitting.local_models import PRIORS, LocalModels
from unconstrain.fitting.model import LinearModel
from unconstrain.policies.linear import LinearPolicy
from unconstrain.spaces import Space


class LocallyLinearPolicy(LinearPolicy):
    """The policy `π(x) = Σ_m ω_m(x) B_m (x, 1)`, with `ω_m = K_m / Σ_j K_j` and `K_m(x) = exp(-‖x - c_m‖² / 2σ²)`.

    Each B_m minimises the risk with its samples weighted by K_m, whatever the other models do. Where those samples are
    silent, it says what the prior says.

    Parameters
    ----------
    features : transformer, Features, or None
        What each local model is made of, as for `ParametricPolicy`; None for the linear features `(x, 1)`.
    width : float or array_like of shape (n,), optional
        Width σ, in the states' unit: one for all states, or one for each. None takes the width at which `n_centers`
        models reach the coverage, or, for other placements, 1.5 times the centres' mean spacing, with distances in
        units of each state's spread.
    centers : {"coverage", "kmeans", "grid"} or array_like of shape (M, n)
        Where the models lie.
    coverage : float
        Every sample has a weight of at least this in some model; with a width given it sets their number.
    n_centers : int
        How many models, where neither a width nor the centres themselves say so.
    risk : {"adaptive", "corrected", "inconsistency", "direct"}
        As for `ParametricPolicy`.
    alpha : "cv" or float
        As for `ParametricPolicy`; one λ for all models.
    noise : float, optional
        As for `ParametricPolicy`.
    prior : {"global", "zero"}
        What each model decays to: the policy of the same features fitted to all data together, or zero, as published.
    random_state : int, optional
        For "kmeans".
    space : Space, optional
        What the states are; see `unconstrain.spaces`. By default what the demonstrations say, or numbers.
    scale : "auto" or array_like of shape (d,), optional
        What a length of one is along each action: lengths, angles and noise are those of `u_i / s_i`. "auto" takes how
        far the states spread along each. By default actions count as they are, but where some are angles, and others
        are not, the spread of all of a unit decides.

    Attributes
    ----------
    centers_ : ndarray of shape (M, n)
        The centres of the receptive fields, as the space lays states out.
    width_ : ndarray of shape (n,)
        Their width σ along each state, in its unit.
    weights_ : ndarray of shape (M, P)
        The parameters of each model.
    coef_ : ndarray of shape (M, d, n)
        Slopes of linear models, in the states' units; not there for other features.
    intercept_ : ndarray of shape (M, d)
        Offsets of linear models, at the states' origin.
    alpha_, alphas_, held_out_risk_, n_samples_seen_, n_zero_actions_, n_known_constraints_, noise_, speed_noise_,
    free_share_, log_likelihood_, log_likelihoods_, history_
        As for `ParametricPolicy`.
    """

    def __init__(
        self,
        features: Any = None,
        *,
        width: Any = None,
        centers: Any = "coverage",
        coverage: float = 0.7,
        n_centers: int = 30,
        risk: str = "adaptive",
        alpha: float | str = "cv",
        noise: float | None = None,
        prior: str = "global",
        random_state: int | None = 0,
        space: Space | None = None,
        scale: Any = None,
    ):
        self.features = features
        self.width = width
        self.centers = centers
        self.coverage = coverage
        self.n_centers = n_centers
        self.risk = risk
        self.alpha = alpha
        self.noise = noise
        self.prior = prior
        self.random_state = random_state
        self.space = space
        self.scale = scale

    def place(self, X: np.ndarray, d: int, sample_weight: np.ndarray) -> LinearModel:
        """Place the centres and fit the features.

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
        LocalModels
            Fitted, without parameters.

        Raises
        ------
        PolicyError
            The options place no centres, or the features do not fit these dimensions.
        """
        centers, width = place_centers(
            X,
            self.centers,
            n_centers=self.n_centers,
            width=self.width,
            coverage=self.coverage,
            sample_weight=sample_weight,
            random_state=self.random_state,
        )
        features = fit_features(as_features(self.features), X, d, sample_weight)
        return LocalModels(features, centers, width, d, self.prior)

    def check_options(self) -> None:
        """Raise `PolicyError` for a risk, a weight decay or a prior that is none."""
        super().check_options()
        check_choice(self.prior, "prior", PRIORS)

    @property
    def features_(self) -> Features:
        """The fitted feature map of each model."""
        return self.model_.features

    @property
    def centers_(self) -> np.ndarray:
        """The centres of the receptive fields, (M, n)."""
        return self._places.centers

    @property
    def width_(self) -> np.ndarray:
        """The width σ of the receptive fields along each state, in its unit, (n,)."""
        return np.broadcast_to(self._places.width, self._places.n_states)

    @property
    def weights_(self) -> np.ndarray:
        """The parameters of each model, (M, P)."""
        return self.solution_.w

    @property
    def coef_(self) -> np.ndarray:
        """The slopes of linear models, (M, d, n)."""
        return self._linear[0]

    @property
    def intercept_(self) -> np.ndarray:
        """The offsets of linear models, (M, d)."""
        return self._linear[1]

    @property
    def _places(self) -> LocalModels:
        model = self.model_.model if isinstance(self.model_, InSpace) else self.model_
        assert isinstance(model, LocalModels)
        return model

    @property
    def _linear(self) -> tuple[np.ndarray, np.ndarray]:
        own = self._places if self._places is self.model_ else None
        linear = None if own is None else own.linear_parameters(self.solution_.w)
        if linear is None:
            raise AttributeError("coef_ and intercept_ are there only for linear local models, features=None")
        return linear
