"""The policy as a Gaussian process: a regression that says how sure it is, and needs few movements.

References
----------
Rasmussen, Williams, Gaussian Processes for Machine Learning, 2006.
"""

from copy import copy
from dataclasses import replace
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils.validation import check_is_fitted

from unconstrain.arrays import check_states
from unconstrain.errors import PolicyError
from unconstrain.features.full import FullFeatures
from unconstrain.fitting.accumulator import Accumulator, Record, Solution
from unconstrain.fitting.global_model import GlobalModel
from unconstrain.fitting.in_space import in_units
from unconstrain.fitting.model import Model
from unconstrain.fitting.region import find_unit
from unconstrain.gaussian_process.evidence import adapt, candidates
from unconstrain.gaussian_process.inducing import InducingFeatures
from unconstrain.gaussian_process.learning import Learnt, Problem, learn_adaptively, learn_published
from unconstrain.gaussian_process.model import GaussianProcessModel
from unconstrain.gaussian_process.process import Process
from unconstrain.policies.base import Policy
from unconstrain.policies.setting import settle
from unconstrain.samples import Samples
from unconstrain.spaces import Space

AUTO = "auto"
FIXED_DECAY = 1e-4
"""Weight decay of inducing features where there is but one fold, so none to choose it by."""


class GaussianProcessPolicy(Policy):
    """The unconstrained policy behind constrained movements, as a Gaussian process `qᵀπ(x) ~ GP(0, k)`.

    It learns from what each sample shows along directions: a free sample in all d, a constrained one along its
    motion, one whose projection is known behind that. Kernel, widths, amplitudes and noise are those of largest
    marginal likelihood, found from up to 500 observed numbers that lie far apart. Up to 4,000 numbers the posterior
    is exact, beyond it rests on 1,400 inducing ones, up to 10^5 samples; `approximation_` says which. There is no
    `partial_fit`.

    Parameters
    ----------
    kernel : "auto" or Kernel
        "auto" chooses by marginal likelihood among a smooth policy about a linear one, the same with a cubic
        polynomial, and, where each action belongs to a state, the gradient of a smooth potential about a quadratic
        one. Or a kernel of pairs (x, q) made of `uc.kernels` (`Separable`, `CurlFree`, `CurlFreeQuadratic`) by sums
        and products, or any kernel of scikit-learn on states, which all actions then share. It sees standardised
        states, and actions in units of their root mean square; its hyperparameters are where the search starts. The
        noise is found beside it.
    risk : {"adaptive", "inconsistency", "direct"}
        "adaptive" infers which samples were free and how noisy the actions are; see `fitting.contact`. "inconsistency"
        learns from each action along its own direction, as published, which noise biases. Both make use of the
        projections that are known. "direct" is ordinary regression.
    space : Space, optional
        What the states are; see `unconstrain.spaces`. By default what the demonstrations say, or numbers.
    scale : "auto" or array_like of shape (d,), optional
        What a length of one is along each action; see `ParametricPolicy`.
    noise : float, optional
        Standard deviation of the actions' noise, in their unit, where it is known; the noise that is found is not
        below it.

    Attributes
    ----------
    kernel_ : Kernel
        With the hyperparameters found.
    kernel_name_ : str
        Which of the candidates it is: "smooth", "cubic", "potential", or "given".
    approximation_ : str
        On what the posterior rests, in a sentence.
    widening_ : float
        How many times wider the covariance was made because errors on held-out folds repeat from sample to sample.
    noise_, speed_noise_, free_share_, log_likelihood_, log_likelihoods_, history_
        With the adaptive risk, as of `ParametricPolicy`.

    Examples
    --------
    >>> import numpy as np, unconstrain as uc
    >>> X = np.random.default_rng(0).normal(size=(60, 2))
    >>> Pi = np.stack([-X[:, 0], np.sin(X[:, 1])], axis=1)         # the unconstrained policy
    >>> N = uc.constraints.projection(np.random.default_rng(1).normal(size=(60, 1, 2)))
    >>> U = np.einsum("nij,nj->ni", N, Pi)                         # what is recorded
    >>> policy = uc.GaussianProcessPolicy(risk="inconsistency").fit(X, U)
    >>> P, deviation = policy.predict(X, return_std=True)
    >>> bool(np.abs(P - Pi).max() < 0.05), deviation.shape
    (True, (60, 2))
    """

    def __init__(
        self,
        kernel: Any = AUTO,
        *,
        risk: str = "adaptive",
        space: Space | None = None,
        scale: Any = None,
        noise: float | None = None,
    ):
        self.kernel = kernel
        self.risk = risk
        self.space = space
        self.scale = scale
        self.noise = noise

    def learn(self, samples: Samples, space: Space | None, noise: float | None) -> None:
        """Find the kernel, infer which samples were free, and condition on all; see `Policy.learn`."""
        setting = settle(self, samples, space, noise)
        d = samples.actions.shape[1]
        samples = in_units(setting.scale, samples)
        X = samples.states
        Z = np.asarray(X, dtype=np.float64) if setting.space.is_flat else setting.space.embed(X, setting.base)
        samples = samples._replace(states=Z, actions=samples.actions.astype(np.float64, copy=False))
        if samples.weights is not None and not samples.weights.all():
            samples = samples.select(samples.weights > 0)
        unit = find_unit(setting.states, None)
        counted = _count(samples, self.risk, unit)
        problem = Problem(samples, self._kernels(Z.shape[1], d), setting.noise**2)
        model = GaussianProcessModel(Z.shape[1], d)

        def make_inference(features: InducingFeatures) -> tuple[Model, Accumulator]:
            linear = GlobalModel(features, Z.shape[1], d)
            alpha = "cv" if len(np.unique(problem.fold)) > 1 else FIXED_DECAY
            return linear, Accumulator(linear, "adaptive", alpha, noise=problem.noise, unit=unit)

        if self.risk == "adaptive":
            learnt = learn_adaptively(problem, model, make_inference)
        else:
            learnt = learn_published(problem, self.risk)
        self.model_ = setting.wrap(model)
        self.kernel_name_, self.log_marginal_likelihood_ = (
            learnt.evidence.name,
            learnt.evidence.log_likelihood,
        )
        self.solution_ = _solve(learnt, counted, problem)

    def covariance(self, X: ArrayLike) -> np.ndarray:
        """Compute how far the true policy may be from `predict`: the posterior's covariance, `widening_` times.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, d, d)
            In squared units of the action.

        Raises
        ------
        PolicyError
            The policy was saved without what says how sure it is.
        """
        check_is_fitted(self)
        X = check_states(self, X)
        if self._process.whitener is None:
            raise PolicyError(
                "this policy was saved without what tells how sure it is: save it with resumable=True to keep that"
            )
        return self._in_own_units(self._process.covariance(self.model_.lay_out(X)))

    def save(self, path: str | PathLike[str], *, resumable: bool = False) -> None:
        """Write the policy to a file that `load_policy` reads. Nothing in it is code.

        Parameters
        ----------
        path : path
            Customarily it ends in ``.skops``. An existing file is replaced.
        resumable : bool
            Keep also what tells how sure the policy is, of as many numbers as rows squared. Without it the policy
            that is read back predicts only.

        Raises
        ------
        UnconstrainError
            The place cannot be written to, or the policy holds something that cannot be saved.
        """
        from unconstrain.policies.saving import save_policy

        check_is_fitted(self)
        kept = copy(self)
        if not resumable:
            kept.solution_ = replace(self.solution_, w=self._process.without_variances())
        save_policy(kept, path)

    @property
    def kernel_(self) -> Any:
        """The kernel with its hyperparameters, for standardised states and actions in units of `usual_speed()`."""
        return self._process.kernel

    @property
    def widening_(self) -> float:
        """How many times wider the covariance was made, by what was held out."""
        return self._process.widening

    @property
    def approximation_(self) -> str:
        """On what the posterior rests, in a sentence."""
        rows = len(self._process.coefficients)
        if self._process.is_exact:
            return f"the posterior is exact, on {rows} observed numbers"
        return f"the posterior is approximated, on {rows} inducing numbers"

    @property
    def _process(self) -> Process:
        process: Process = self.solution_.w
        return process

    def _kernels(self, n_states: int, n_actions: int) -> dict[str, Any]:
        if isinstance(self.kernel, str) and self.kernel == AUTO:
            return candidates(n_states, n_actions)
        return {"given": adapt(self.kernel, n_states, n_actions)}


def _count(samples: Samples, risk: str, unit: np.ndarray) -> Accumulator:
    """Count samples and find where they lie, with the checks of every fit."""
    d = samples.actions.shape[1]
    model = GlobalModel(FullFeatures().fit(samples.states, d), samples.states.shape[1], d)
    seen = "direct" if risk == "direct" else "inconsistency"
    counted = Accumulator(model, seen, "cv", unit=unit)
    counted.add(samples)
    return counted


def _solve(learnt: Learnt, counted: Accumulator, problem: Problem) -> Solution:
    total = counted.total
    regression = None
    if learnt.regression is not None and not total.n_known:
        regression = Solution(learnt.regression, n_samples=total.n_samples)
    solution = Solution(
        learnt.process,
        n_samples=total.n_samples,
        n_zero=total.n_zero,
        n_known=total.n_known,
        regions=total.regions,
        usual_speed=problem.size,
    )
    if learnt.belief is None or learnt.tally is None:
        return solution
    return replace(
        solution,
        belief=learnt.belief,
        free_share=learnt.tally.free_share,
        evidence=learnt.tally.evidence,
        record=Record(dict(learnt.log_likelihoods or {}), learnt.history, regression=regression),
    )
