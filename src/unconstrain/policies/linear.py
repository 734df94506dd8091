"""Policies that are linear in their parameters: options become a model, samples are added up, the sums are solved."""

import warnings
from abc import abstractmethod
from collections.abc import Callable
from copy import copy
from dataclasses import replace
from functools import partial
from os import PathLike
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils.validation import check_is_fitted

from unconstrain.arrays import check_choice, check_number, check_states
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, PolicyError
from unconstrain.fitting.accumulator import Accumulator
from unconstrain.fitting.at_hand import AtHand, is_at_hand
from unconstrain.fitting.calibration import Calibration
from unconstrain.fitting.in_space import LinearInSpace
from unconstrain.fitting.inference import FREE, infer_contact
from unconstrain.fitting.model import LinearModel
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import RISKS
from unconstrain.fitting.posterior import Posterior
from unconstrain.fitting.region import find_unit
from unconstrain.fitting.wide.held import is_wide
from unconstrain.policies.base import Policy
from unconstrain.policies.inputs import check_input
from unconstrain.policies.missing import MissingSumsError
from unconstrain.policies.setting import settle
from unconstrain.samples import Samples
from unconstrain.spaces import Space
from unconstrain.waiting import stage


class LinearPolicy(Policy):
    """Base of the estimators that are linear in their parameters, `π(x) = Φ(x) w`.

    A subclass has its options, and `place`, which turns them into a model.

    Attributes
    ----------
    model_ : LinearModel
        What was fixed before any sample was added: features, centres, widths.
    accumulator_ : Accumulator
        The sums that the parameters were solved from. A policy loaded from a file has them only where it was saved
        with `resumable=True`.
    """

    risks: ClassVar[tuple[str, ...]] = RISKS
    keeps_order: ClassVar[bool] = True

    alpha: float | str
    model_: LinearModel
    accumulator_: Accumulator

    @abstractmethod
    def place(self, X: np.ndarray, d: int, sample_weight: np.ndarray) -> LinearModel:
        """Fix what depends on data.

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
        LinearModel
            That samples are summed under.

        Raises
        ------
        PolicyError
            An option is impossible.
        """

    def fit(
        self,
        X: ArrayLike | Demonstrations,
        y: ArrayLike | None = None,
        *,
        groups: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
        projections: ArrayLike | None = None,
        start: Policy | None = None,
    ) -> Self:
        """Learn from states and actions.

        Parameters
        ----------
        X : array_like of shape (N, n), or Demonstrations
            States. Demonstrations bring their actions, their episodes (where there are several) as `groups`, the
            projections they know, and the noise of actions that were differentiated, unless these are given.
        y : array_like of shape (N, d) or (N,)
            Actions.
        groups : array_like of shape (N,), optional
            Episode labels, which are held out whole; without them contiguous blocks are.
        sample_weight : array_like of shape (N,), optional
            Multiplies each sample's squared error.
        projections : array_like of shape (N, d, d), optional
            The nullspace projection of each sample, all NaN where it is not known.
        start : Policy, optional
            With the adaptive risk: a policy of the same kind that was learnt from most of these samples, such as this
            one before another episode was recorded: `policy.fit(demos, start=policy)`. Contact is inferred from what
            it has found, in a few passes, and anew where that would not be as good (`fitting.at_hand`); all else is
            placed and solved as without it.

        Returns
        -------
        self
            Fitted.

        Raises
        ------
        DataError
            Arrays are not finite or do not fit together, nothing moves though the risk needs directions, or a known
            projection does not let its sample's own action through.
        PolicyError
            An option is impossible, or `start` is no policy to go on from.
        """
        at_hand = None if start is None else _at_hand(self, start)
        learn = partial(type(self).learn, at_hand=at_hand)
        return self._fit(X, y, groups, sample_weight, projections, learn)

    def learn(
        self,
        samples: Samples,
        space: Space | None,
        noise: float | None,
        at_hand: AtHand | None = None,
    ) -> None:
        """Add the samples up, as often as the risk needs, and solve the sums; see `Policy.learn`."""
        accumulator = self.start(samples, space, noise)
        if at_hand is not None and len(at_hand.scale) != accumulator.model.n_actions:
            raise PolicyError(
                f"start= is a policy of {len(at_hand.scale)} actions, and these samples have "
                f"{accumulator.model.n_actions}"
            )
        if self.risk != "corrected":  # which takes noise away from moments
            accumulator.holds = is_wide(
                accumulator.model,
                samples.states[:1],
                whole=self.risk == "direct",
                chooses_alpha=self.alpha == "cv",
            )
        if self.risk == "adaptive":
            accumulator = infer_contact(accumulator, lambda wanted: wanted.add(samples), at_hand)
        else:
            accumulator.add(samples)
        _settle(self, accumulator)

    @stage("fitting")
    def partial_fit(
        self,
        X: ArrayLike | Demonstrations,
        y: ArrayLike | None = None,
        *,
        groups: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
        projections: ArrayLike | None = None,
    ) -> Self:
        """Learn from more samples; the result is that of one `fit` on all samples so far.

        With the adaptive risk it is not: which of the new samples were free is inferred by the policy as it is before
        them, once, and what earlier ones were taken for stays. So begin with enough of them, or fit anew.

        That is exact whatever the pieces when λ is a number and nothing is placed by the data (linear features,
        centres and width given). Centres and other data-dependent features are placed by the first piece and kept; with
        `alpha="cv"` give `groups`, whose episodes stay in their fold from piece to piece.

        Parameters
        ----------
        X : array_like of shape (N, n), or Demonstrations
            States.
        y : array_like of shape (N, d) or (N,)
            Actions.
        groups : array_like of shape (N,), optional
            Episode labels.
        sample_weight : array_like of shape (N,), optional
            Weight of each sample, 1 by default.
        projections : array_like of shape (N, d, d), optional
            The nullspace projection of each sample, all NaN where it is not known.

        Returns
        -------
        self
            Fitted.

        Raises
        ------
        DataError, PolicyError
            As for `fit`; the policy then stays as it was.
        """
        if not hasattr(self, "model_"):
            return self.fit(X, y, groups=groups, sample_weight=sample_weight, projections=projections)
        accumulator = self.resume()
        fresh = copy(self)
        samples, _ = check_input(fresh, X, y, groups, sample_weight, projections, first=False)
        accumulator.longest = max(accumulator.longest, accumulator.total.longest)
        accumulator.record = replace(accumulator.record, regression=None)  # to which nothing was added
        fresh.determined_share_ = None
        accumulator.add(samples)
        if accumulator.total.misjudged:
            raise DataError(
                f"an action is {accumulator.total.longest:.3g} long, and beside it some that were learnt from, of "
                f"length {accumulator.total.shortest:.3g}, do not move: leave it out, or fit anew to all together"
            )
        _settle(fresh, accumulator)
        return self._become(fresh)

    def start(self, samples: Samples, space: Space | None = None, noise: float | None = None) -> Accumulator:
        """Make an accumulator for this policy's options, its model placed by some samples.

        Parameters
        ----------
        samples : Samples
            Checked. Those without motion or a known projection do not count in placing.
        space : Space, optional
            That the samples' states belong to; numbers by default. The policy's own, if it has one, comes first.
        noise : float, optional
            Standard deviation of the actions' noise, where it is known of these recordings; the policy's own option
            takes its place.

        Returns
        -------
        Accumulator
            Empty.

        Raises
        ------
        PolicyError
            An option is impossible.
        DataError
            None of the samples says anything.
        """
        self.check_options()
        setting = settle(self, samples, space, noise)
        counted = setting.counted
        weights = np.ones(len(counted)) if samples.weights is None else samples.weights
        model = self.place(setting.states, samples.actions.shape[1], weights[counted])
        unit = find_unit(setting.states, model.width)
        return Accumulator(
            setting.wrap(model, LinearInSpace), self.risk, self.alpha, noise=setting.noise**2, unit=unit
        )

    def resume(self) -> Accumulator:
        """Copy the sums that this policy was solved from, to add to them.

        Returns
        -------
        Accumulator
            With the same sums.

        Raises
        ------
        PolicyError
            The policy was saved without them.
        """
        check_is_fitted(self)
        if not hasattr(self, "accumulator_"):
            raise MissingSumsError(
                "this policy was saved without the sums it was solved from: save it with resumable=True to go on "
                "learning, or to know how sure it is"
            )
        accumulator = self.accumulator_.copy()
        accumulator.belief = self.solution_.belief
        return accumulator

    def finish(self, accumulator: Accumulator, *, scalar_actions: bool = False) -> Self:
        """Solve what was added up elsewhere, and become that policy.

        Parameters
        ----------
        accumulator : Accumulator
            From `start` or `resume`.
        scalar_actions : bool
            Whether `predict` returns actions of shape (N,).

        Returns
        -------
        self
            Fitted.

        Raises
        ------
        DataError
            There is nothing to learn from; the policy then stays as it was.
        """
        fresh = self._without_stability()
        fresh.n_features_in_, fresh.actions_are_scalars_ = accumulator.model.n_states, scalar_actions
        _settle(fresh, accumulator)
        return self._become(fresh)

    def posterior(self) -> Posterior:
        """Compute the distribution of the parameters and the noise of the actions, by an eigendecomposition.

        With the adaptive risk the noise is that which was inferred, for as many samples as are independent, and the
        covariance is as wide as held-out samples say (`fitting.calibration`). With the corrected risk the noise is what
        the noise that was found makes of the residuals. With the others it is estimated: each sample is taken to show
        one number, or d where nothing is projected. One whose projection is known may show
        more, which moments do not count; the noise is then overestimated, and deviations err on the side of caution.

        Returns
        -------
        Posterior
            See `fitting.posterior`.

        Raises
        ------
        PolicyError
            The policy was saved without its sums.
        """
        moments = self.resume().moments()
        decay = self.model_.decay(moments)
        if self.risk == "corrected":
            return Posterior.of(moments, decay=decay, noise=self.solution_.residual)
        calibration = self.calibration()
        if calibration is not None:
            return calibration.posterior(moments, decay)
        return Posterior.of(moments, self.n_actions_ if self.risk == "direct" else 1, decay)

    def calibration(self) -> Calibration | None:
        """Measure on held-out folds how wide the posterior has to be.

        Returns
        -------
        Calibration or None
            With the adaptive risk, what was held out says; of a policy that was saved without its sums, the noise
            alone. None with other risks, whose noise is estimated with the posterior.
        """
        check_is_fitted(self)
        belief = self.solution_.belief
        if belief is None:
            return None
        if not hasattr(self, "accumulator_"):
            return Calibration(belief.noise.action / self.solution_.evidence)
        return Calibration.of(self.resume(), self.solution_)

    def covariance(self, X: ArrayLike, posterior: Posterior | None = None) -> np.ndarray:
        """Compute how far the true policy may be from `predict`.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.
        posterior : Posterior, optional
            By default that of the samples learnt from.

        Returns
        -------
        ndarray of shape (N, d, d)
            Second moments of the deviation, in squared units of the action.
        """
        check_is_fitted(self)
        X = check_states(self, X)
        scaled = self.model_.evaluate(X, self.solution_.w)
        posterior = self.posterior() if posterior is None else posterior
        return self._in_own_units(self.model_.covariance(X, scaled, posterior))

    def prepare_covariance(self) -> Callable[[np.ndarray], np.ndarray]:
        """Return `covariance` by the posterior of the samples learnt from; see `Policy.prepare_covariance`."""
        return partial(self.covariance, posterior=self.posterior())

    def usual_speed(self) -> float:
        """Compute the root mean square length of the actions learnt from, in units of `scale_`.

        Returns
        -------
        float
            Above zero.

        Raises
        ------
        PolicyError
            The policy was saved without its sums.
        """
        moments = self.resume().moments()
        whole = moments if moments.everywhere is None else moments.everywhere
        return float(np.sqrt(np.sum(whole.squares) / np.sum(whole.weight)))

    def save(self, path: str | PathLike[str], *, resumable: bool = False) -> None:
        """Write the policy to a file that `load_policy` reads. Nothing in it is code.

        Parameters
        ----------
        path : path
            Customarily it ends in ``.skops``. An existing file is replaced.
        resumable : bool
            Keep the sums too. Without them the file is small, and the policy that is read back predicts, but cannot
            learn on (`partial_fit`), tell how sure it is (`return_std`), or be solved anew (`solved`).

        Raises
        ------
        UnconstrainError
            The place cannot be written to, or the policy holds something that cannot be saved, such as a lambda.
        """
        from unconstrain.policies.saving import save_policy

        check_is_fitted(self)
        kept = copy(self)
        if not resumable and hasattr(kept, "accumulator_"):
            del kept.accumulator_
        save_policy(kept, path)

    def solved(self, *, without: int | None = None) -> Self:
        """Solve anew for `alpha`, if asked without the samples of one fold, in a copy of this policy.

        Parameters
        ----------
        without : int, optional
            The fold left out. With `alpha="cv"` λ is then chosen among the others.

        Returns
        -------
        Policy
            The solved copy.

        Raises
        ------
        DataError
            Nothing is left to learn from.
        PolicyError
            The policy was saved without its sums.

        Notes
        -----
        It costs no pass over the data: it is what makes cross-validation of a whole policy cheap.
        """
        accumulator = self.resume()
        left = copy(self)
        left.solution_ = accumulator.solve(self.alpha, without)
        return left

    def ordinary_regression(self) -> Self | None:
        """Return ordinary regression by the same model to the same samples, to be held against this policy.

        Returns
        -------
        Policy or None
            That predicts, but cannot learn on. None where it is not known: with other risks than "adaptive" and
            "direct", unless `compare_risks` has made it, and after `partial_fit`.
        """
        other = super().ordinary_regression()
        if other is not None and hasattr(other, "accumulator_"):
            del other.accumulator_
        return other

    def check_options(self) -> None:
        """Raise `PolicyError` for a risk, a weight decay or a noise that is none."""
        super().check_options()
        if isinstance(self.alpha, str):
            check_choice(self.alpha, "alpha, where it is not a number,", ("cv",))
        else:
            check_number(self.alpha, "alpha", positive=False)

    @property
    def alpha_(self) -> float:
        """The weight decay λ that was used, a pure number; see `fitting.decay`."""
        return self.solution_.alpha

    @property
    def alphas_(self) -> np.ndarray:
        """The candidates for λ, (25,), where it was chosen."""
        return _where_chosen(self.solution_.alphas, "alphas_")

    @property
    def held_out_risk_(self) -> np.ndarray:
        """The held-out risk of each candidate for λ, (25,), in squared units of the action, where it was chosen."""
        return _where_chosen(self.solution_.held_out_risk, "held_out_risk_")

    @property
    def moments_(self) -> list[Moments | None]:
        """The moments by fold, those of the corrected risk for `noise_`; None where a fold has no samples."""
        return self.resume().by_fold()


def _settle(policy: LinearPolicy, accumulator: Accumulator) -> None:
    """Let a policy be what is solved from the sums."""
    policy.model_, policy.accumulator_ = accumulator.model, accumulator
    policy.solution_ = accumulator.solve()
    if policy.solution_.doubt:
        warnings.warn(policy.solution_.doubt, stacklevel=4)


def _at_hand(policy: LinearPolicy, start: Policy) -> AtHand:
    """Make of a fitted policy what inference can go on from."""
    if policy.risk != "adaptive":
        raise PolicyError(
            f'start= is for risk="adaptive", and this policy has risk="{policy.risk}", which needs no start: fit anew, '
            "or add what is new with partial_fit"
        )
    if type(start) is not type(policy) or not is_at_hand(start):
        raise PolicyError(
            f'start= needs a {type(policy).__name__} that was fitted with risk="adaptive", got {start!r:.60}'
        )
    solution = start.solution_
    model, w, scale = start.model_, solution.w, start.scale_
    belief, record = solution.belief, solution.record
    assert belief is not None
    return AtHand(
        lambda X: model.evaluate(check_states(start, X), w) * scale,
        belief,
        scale,
        solution.alpha,
        start.log_likelihood_,
        solution.n_samples,
        record.n_anew or solution.n_samples,
        next(iter(record.log_likelihoods)) == FREE,
    )


def _where_chosen(value: np.ndarray | None, name: str) -> np.ndarray:
    if value is None:
        raise AttributeError(f'{name} is there only after a fit with alpha="cv"')
    return value
