"""Any regressor of scikit-learn's interface as a policy.

References
----------
Howard et al., ICRA 2009, Sec. III: "the proposed risk functional can be used in conjunction with many standard
regression techniques".
"""

from dataclasses import replace
from typing import Any

import numpy as np
from sklearn.base import BaseEstimator, is_regressor
from sklearn.utils.validation import check_is_fitted

from unconstrain.arrays import check_choice, check_whole
from unconstrain.errors import DataError, PolicyError
from unconstrain.fitting.accumulator import Record, Solution
from unconstrain.fitting.foreign import as_multi_output, find_weight_option
from unconstrain.fitting.halves import Halves
from unconstrain.fitting.in_space import in_units
from unconstrain.fitting.observation import unknown
from unconstrain.fitting.region import Region, find_unit
from unconstrain.fitting.regression import Regressed, Regression, Trend
from unconstrain.fitting.solve import EpisodeFolds
from unconstrain.motion import moving
from unconstrain.policies.base import Policy
from unconstrain.policies.completing import FITS_A_ROUND, Completed, Completing
from unconstrain.policies.setting import settle
from unconstrain.progress import begin, reporting
from unconstrain.samples import Samples
from unconstrain.spaces import Space

PRIORS = ("linear", "zero")

FEWEST_SAMPLES = 2

FEWEST_FITS = 20
"""A round each of all free and three runs, episodes held out of these, and two fits to all samples, and two more."""


class RegressorPolicy(Policy):
    """The unconstrained policy by any regression technique: trees, boosting, neighbours, kernels, networks.

    What a sample does not show of the policy is completed by what the regressor itself predicts, `y = p + Q(u -
    p)`, and the regressor is fitted again, some dozen times (`fitting.completion`). Each sample is completed by a
    regressor that has not seen it: every round fits one to each half of the samples.

    Parameters
    ----------
    regressor : estimator
        Any regressor of scikit-learn's interface, as it is; it is cloned, never changed. One that takes a single target
        is fitted to each action by itself. One that descends and has `warm_start`, such as a network, goes on from
        round to round.
    risk : {"adaptive", "inconsistency", "direct"}
        "adaptive" infers which samples were free and how noisy the actions are; "inconsistency" takes none for free;
        both make use of the projections that are known. "direct" is ordinary regression, in one fit.
    prior : {"linear", "zero"}
        What the regressor learns the rest of, and what therefore remains of the policy in directions that no sample
        shows, and far from all samples: the linear policy that `ParametricPolicy` learns by the same risk, or zero, the
        regressor alone. With the latter too the rounds begin at the linear policy.
    max_fits : int
        How often the regressor is fitted at most, to halves of the samples mostly; at least 20. Fewer are enough where
        rounds gain nothing.
    space : Space, optional
        What the states are; see `unconstrain.spaces`. By default what the demonstrations say, or numbers.
    scale : "auto" or array_like of shape (d,), optional
        What a length of one is along each action; see `ParametricPolicy`.
    noise : float, optional
        Standard deviation of the actions' noise, in their unit, where it is known: the noise that is inferred is not
        below it.
    random_state : int, optional
        By which samples are dealt out into halves. Of the regressor, give it to the regressor itself.
    verbose : bool
        Show the fits on standard error as they go.

    Attributes
    ----------
    regressor_ : estimator
        Fitted, to what the prior leaves of the completed actions.
    n_fits_ : int
        How often a regressor was fitted.
    noise_, speed_noise_, free_share_, log_likelihood_, log_likelihoods_, history_ : see `Policy`
        With the adaptive risk, from held-out predictions. So the noise contains what the regressor misses.

    Examples
    --------
    >>> import numpy as np, unconstrain as uc
    >>> from sklearn.ensemble import ExtraTreesRegressor
    >>> X = np.random.default_rng(0).uniform(-1, 1, size=(1000, 2))
    >>> Pi = np.sin(3 * X)                                        # the unconstrained policy
    >>> N = uc.constraints.projection(np.random.default_rng(1).normal(size=(1000, 1, 2)))
    >>> U = np.einsum("nij,nj->ni", N, Pi)                        # what is recorded
    >>> policy = uc.RegressorPolicy(ExtraTreesRegressor(min_samples_leaf=3, random_state=0)).fit(X, U)
    >>> bool(uc.metrics.unconstrained_policy_error(Pi, policy.predict(X)) < 0.15 * Pi.var(axis=0).sum())
    True
    """

    def __init__(
        self,
        regressor: Any,
        *,
        risk: str = "adaptive",
        prior: str = "linear",
        max_fits: int = 50,
        space: Space | None = None,
        scale: Any = None,
        noise: float | None = None,
        random_state: int | None = 0,
        verbose: bool = False,
    ):
        self.regressor = regressor
        self.risk = risk
        self.prior = prior
        self.max_fits = max_fits
        self.space = space
        self.scale = scale
        self.noise = noise
        self.random_state = random_state
        self.verbose = verbose

    def learn(self, samples: Samples, space: Space | None, noise: float | None) -> None:
        """Complete the actions round by round, and fit the regressor to them; see `Policy.learn`."""
        setting = settle(self, samples, space, noise)
        shown = in_units(setting.scale, samples)
        if not setting.counted.all():
            shown = shown.select(np.flatnonzero(setting.counted))
        if len(shown.actions) < FEWEST_SAMPLES:
            raise DataError(
                f"only one of {len(samples.actions)} samples moves, and the others say nothing of the policy"
            )
        shown = shown._replace(states=setting.states)
        d = shown.actions.shape[1]
        regressor = as_multi_output(self.regressor, d)
        if shown.weights is not None and find_weight_option(regressor) is None:
            raise PolicyError(
                f"a {type(self.regressor).__name__} does not take sample weights: leave them out, or choose a "
                "regressor whose fit takes sample_weight"
            )
        halves = Halves(regressor, shown.states, shown.weights, np.random.default_rng(self.random_state))
        model = Regression(shown.states.shape[1], d)
        with reporting(self.verbose, "fits") as report:

            def tell(name: str, n_fits: int) -> None:
                begin(report, name)
                report(n_fits, self.max_fits)

            completing = Completing(
                shown,
                halves,
                self.prior == "linear",
                # Ordinary regression and the policy itself are fitted to all samples in the end.
                self.max_fits - FITS_A_ROUND,
                setting.noise,
                tell,
            )
            completed, regression = self._complete(completing)
            tell("all samples", halves.n_fits)
            w = _fit(halves, completed.targets, completed.trend)
        self.model_ = setting.wrap(model)
        self.n_fits_ = halves.n_fits
        self.solution_ = replace(
            _conclude(samples, shown, completed, w),
            record=Record(completed.log_likelihoods, completed.history, regression=regression),
        )

    def check_options(self) -> None:
        """Raise `PolicyError` for an option that is none."""
        super().check_options()
        check_choice(self.prior, "prior", PRIORS)
        check_whole(self.max_fits, "max_fits", least=FEWEST_FITS)
        if self.random_state is not None:
            check_whole(self.random_state, "random_state", least=0)
        if not hasattr(self.regressor, "fit") or isinstance(self.regressor, type):
            raise PolicyError(
                f"regressor must be an estimator, such as ExtraTreesRegressor(), got {self.regressor!r:.60}"
            )
        name = type(self.regressor).__name__
        if not isinstance(self.regressor, BaseEstimator):
            raise PolicyError(f"a {name} is no estimator of scikit-learn's: derive it from BaseEstimator")
        if not is_regressor(self.regressor):
            raise PolicyError(f"a {name} is no regressor: actions are numbers")

    @property
    def regressor_(self) -> Any:
        """The fitted regressor."""
        check_is_fitted(self)
        return self.solution_.w.regressor

    def _complete(self, completing: Completing) -> tuple[Completed, Solution | None]:
        """Return the completed actions, and, where it is another, ordinary regression of the same samples."""
        samples, halves = completing.samples, completing.halves
        if self.risk == "inconsistency":
            return completing.follow_risk(), None
        linear = completing.learn_linear("direct")
        trend = linear if completing.has_trend else None
        if self.risk == "direct":
            return Completed(samples.actions, trend), None
        completed = completing.infer(linear)
        w = _fit(halves, samples.actions, trend)
        return completed, Solution(w, n_samples=len(samples.actions))


def _fit(halves: Halves, targets: np.ndarray, trend: Trend | None) -> Regressed:
    """Fit the regressor to all samples."""
    rest = targets if trend is None else targets - trend(halves.states)
    return Regressed(halves.finish(rest), trend)


def _conclude(recorded: Samples, shown: Samples, completed: Completed, w: Regressed) -> Solution:
    """Say what the policy was learnt from, and what was found out."""
    U, Z = shown.actions, shown.states
    fold = EpisodeFolds().assign(shown.groups, len(Z))
    unit = find_unit(Z, None)
    solution = Solution(
        w,
        n_samples=len(recorded.actions),
        n_zero=int(np.count_nonzero(~moving(recorded.actions))),
        n_known=0 if recorded.projections is None else int(np.sum(~unknown(recorded.projections))),
        regions=tuple(
            Region.of(Z[fold == k], unit) if (fold == k).any() else None for k in range(1 + fold.max())
        ),
        usual_speed=float(np.sqrt(np.average(np.einsum("nd,nd->n", U, U), weights=shown.weights))),
    )
    if completed.belief is None or completed.tally is None:
        return solution
    return replace(
        solution,
        belief=replace(completed.belief, w=w),
        free_share=completed.tally.free_share,
        evidence=completed.tally.evidence,
    )
