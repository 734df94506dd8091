"""What the policies share: options become a model, samples are added up, and the sums are solved."""

import warnings
from abc import abstractmethod
from collections.abc import Callable
from copy import copy
from dataclasses import replace
from os import PathLike
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted

from unconstrain import metrics
from unconstrain.arrays import (
    check_actions,
    check_choice,
    check_number,
    check_states,
    check_weights,
)
from unconstrain.atomic import as_path
from unconstrain.constraints.nullspace import constrain
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError, PolicyError
from unconstrain.fitting.accumulator import NO_DIRECTION, Accumulator, Solution, find_informative_samples
from unconstrain.fitting.calibration import Calibration
from unconstrain.fitting.contact import Belief, infer
from unconstrain.fitting.in_space import InSpace, find_scale, in_units
from unconstrain.fitting.inference import infer_contact
from unconstrain.fitting.model import Model
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import RISKS, Observation, observe
from unconstrain.fitting.posterior import Posterior
from unconstrain.fitting.region import Region, find_apart, find_unit, unite
from unconstrain.motion import moving
from unconstrain.policies.inputs import check_input
from unconstrain.samples import Samples
from unconstrain.spaces import Numbers, Space

if TYPE_CHECKING:
    from unconstrain.deploy.compiled import CompiledPolicy
    from unconstrain.stability import Cycle, Stability
    from unconstrain.stopping import Movement


class Policy(RegressorMixin, BaseEstimator):
    """Base of the estimators `u = π(x)` that are linear in their parameters.

    A subclass has its options, and `place`, which turns them into a model.

    Attributes
    ----------
    model_ : Model
        What was fixed before any sample was added: features, centres, widths.
    solution_ : Solution
        The parameters, and what their choice was based on.
    accumulator_ : Accumulator
        The sums they were solved from. A policy loaded from a file has them only where it was saved with
        `resumable=True`.
    determined_share_ : float or None
        Share of the policy that the recordings it was compared on determine, where `evaluate_held_out` has looked.
    stability_ : Stability, Cycle or None
        What makes the policy end at a goal, or go round and round, in one that `stabilized` returned.
    """

    risk: str
    alpha: float | str
    space: Space | None
    scale: Any
    noise: float | None
    model_: Model
    solution_: Solution
    accumulator_: Accumulator
    actions_are_scalars_: bool
    n_features_in_: int
    stability_: "Stability | Cycle | None" = None
    determined_share_: float | None = None

    @abstractmethod
    def place(self, X: np.ndarray, d: int, sample_weight: np.ndarray) -> Model:
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
        Model
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
            Episode labels, the folds for `alpha="cv"`; without them contiguous blocks are the folds.
        sample_weight : array_like of shape (N,), optional
            Multiplies each sample's squared error.
        projections : array_like of shape (N, d, d), optional
            The nullspace projection of each sample, all NaN where it is not known.

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
            An option is impossible.
        """
        fresh = self._without_stability()
        samples, scalars = check_input(fresh, X, y, groups, sample_weight, projections, first=True)
        given = (X.space, X.noise) if isinstance(X, Demonstrations) else (None, None)
        accumulator = fresh.start(samples, *given)
        if self.risk == "adaptive":
            accumulator = infer_contact(accumulator, lambda wanted: wanted.add(samples))
        else:
            accumulator.add(samples)
        return self._adopt_from(fresh, accumulator, scalars)

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
        return self._adopt_from(fresh, accumulator, self.actions_are_scalars_)

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
        X, U, weights = samples.states, samples.actions, samples.weights
        moves = moving(U)
        counted = find_informative_samples(self.risk, samples, moves)
        shows = (
            counted if self.risk == "direct" else find_informative_samples("inconsistency", samples, moves)
        )
        if not shows.any():
            raise DataError(NO_DIRECTION)
        weights = np.ones(len(X)) if weights is None else weights
        space = self.space or space or Numbers(X.shape[1])
        _check_in_space(space, X)
        scale = find_scale(self.scale, space, X, U.shape[1])
        # Of actions in several units the noise in units of the scale is at least that of the largest.
        sure = noise if noise is None or scale is None else noise / float(scale.max())
        known = float((sure if self.noise is None else self.noise) or 0.0) ** 2
        base = None if space.is_flat else space.find_base(X[counted])
        Z = X[counted] if space.is_flat else space.embed(X[counted], base)
        model = self.place(Z, U.shape[1], weights[counted])
        if not (space.is_flat and scale is None):
            model = InSpace(model, space, base, scale)
        return Accumulator(model, self.risk, self.alpha, noise=known, unit=find_unit(Z, model.width))

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
            raise PolicyError(
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
        fresh.n_features_in_ = accumulator.model.n_states
        return self._adopt_from(fresh, accumulator, scalar_actions)

    def predict(
        self, X: ArrayLike, return_std: bool = False, return_cov: bool = False
    ) -> Any:  # an array, or two of them
        """Predict actions of the unconstrained policy.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.
        return_std : bool
            Return also how far the policy may be from that, as standard deviations of the actions' shape.
        return_cov : bool
            Return also the covariances of all actions. Not both.

        Returns
        -------
        U : ndarray of shape (N, d)
            Or (N,), where the policy was fitted to actions of that shape.
        spread : ndarray of shape (N, d) or (N, d, d)
            Where asked for; see `fitting.posterior`. Of a stabilised policy, that of the policy it was made of.

        Raises
        ------
        DataError
            The states are not finite or not of the dimension learnt.
        PolicyError
            Both spreads are asked for, or the policy was saved without its sums.
        """
        check_is_fitted(self)
        if return_std and return_cov:
            raise PolicyError(
                "ask for return_std or return_cov, not both: the deviations are the roots of the covariance's diagonal"
            )
        X = check_states(self, X)
        scaled = self.model_.evaluate(X, self.solution_.w)
        actions = self._in_own_units(scaled)
        if self.stability_ is not None:
            actions = self.stability_.stabilize(X, actions)
        if not (return_std or return_cov):
            return actions[:, 0] if self.actions_are_scalars_ else actions
        covariance = self._in_own_units(self.model_.covariance(X, scaled, self.posterior()))
        spread = covariance if return_cov else np.sqrt(np.maximum(np.einsum("njj->nj", covariance), 0.0))
        if self.actions_are_scalars_:
            return actions[:, 0], spread.reshape(len(X))
        return actions, spread

    def predict_constrained(self, X: ArrayLike, projections: np.ndarray) -> np.ndarray:
        """Predict actions under constraints: what these leave of the policy's own, in the metric that it was learnt in.

        A stabilised policy makes its Lyapunov function fall within what is left; where nothing that is left can do so
        the action is zero.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.
        projections : ndarray of shape (N, d, d)
            Onto the motion that the constraints leave.

        Returns
        -------
        ndarray of shape (N, d)
            Actions.

        Raises
        ------
        DataError
            The states are not finite or not of the dimension learnt.
        """
        check_is_fitted(self)
        X = check_states(self, X)
        own = self._in_own_units(self.model_.evaluate(X, self.solution_.w))
        if self.stability_ is not None:
            return self.stability_.stabilize(X, own, projections)
        return constrain(projections, own, self.model_.scale)

    def stabilized(
        self,
        goal: ArrayLike,
        demos: Demonstrations | ArrayLike | None = None,
        *,
        hold: float | None = None,
    ) -> Self:
        """Return a policy that ends at a goal, or goes round, and changes this one's actions as little as that takes.

        A Lyapunov function V, with the goal as its only critical point, is fitted to what this policy does in the
        recorded region. The other policy's actions are this one's wherever they make V fall already, and elsewhere the
        nearest that do; see `unconstrain.stability`.

        With "cycle" a closed curve and the time that each part of it takes are found in the recordings. The other
        policy's actions are this one's wherever they lead nearer to the curve, at a pace within 5 % of the recorded
        one, and elsewhere the nearest that do, exactly for actions that are held for `hold`.

        Parameters
        ----------
        goal : array_like of shape (n,), "end" or "cycle"
            Where movements end; "end" for the mean of where the episodes of `demos` end. For a policy learnt relative
            to its goal it is the origin of the states. "cycle" for movements that go round and round.
        demos : Demonstrations, or array_like of shape (N, n), optional
            What was learnt from, or other states of the region in which movements begin. Without it V is fitted to
            what the policy does at its centres, where it has these.
        hold : float, optional
            The longest time for which an action is held (for a cycle the time), in seconds: by default the usual time
            between the samples of `demos`, or 0.02. V falls over every such step, for which actions are slowed down
            where they turn too fast for it. `rollout` with a longer `dt` holds them for that.

        Returns
        -------
        Policy
            A copy. Learning on (`partial_fit`) keeps goal and V; `fit` forgets them.

        Raises
        ------
        DataError
            The goal is no state, or "end" or "cycle" without demonstrations, or these do not go round and round.
        PolicyError
            Actions are not velocities of the states, or nothing says where the policy was learnt.
        """
        from unconstrain.policies.stabilizing import learn_stability

        check_is_fitted(self)
        stable = copy(self)
        stable.stability_ = learn_stability(self._without_stability(), goal, demos, hold)
        return stable

    def held_for(self, seconds: float) -> Self:
        """Return this policy for actions that are held for a time, where it was made stable for another.

        Parameters
        ----------
        seconds : float
            Above zero.

        Returns
        -------
        Policy
            This one where it is not stabilised.

        Raises
        ------
        PolicyError
            Nothing that is held for so long can follow its cycle.
        """
        if self.stability_ is None:
            return self
        held = copy(self)
        held.stability_ = self.stability_.held_for(float(seconds))
        return held

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

    def distance(self, X: ArrayLike) -> np.ndarray:
        """Compute how far states lie from those that were learnt from.

        Recorded states are kept as the boxes of a grid that they lie in, few enough for a small file.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N,)
            From the nearest box, in `distance_unit_`; zero for every state that was learnt from.

        Raises
        ------
        DataError
            The states are not finite or not of the dimension learnt.
        """
        check_is_fitted(self)
        return self.region().distance(self.model_.lay_out(check_states(self, X)))

    def region(self) -> Region:
        """Return where the states that were learnt from lie, as features see them.

        Returns
        -------
        Region
            At most 512 boxes.
        """
        check_is_fitted(self)
        return unite(self.solution_.regions)

    def usual_distance(self) -> float:
        """Compute how far a movement may lead from recorded states until it leaves what was recorded.

        Returns
        -------
        float
            As far as recordings lead from each other: half of the folds of `alpha="cv"` lead farther from all others.
            At least one, in `distance_unit_`.
        """
        check_is_fitted(self)
        return max(1.0, find_apart(self.solution_.regions))

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

    def free_probability(
        self,
        X: ArrayLike | Demonstrations,
        y: ArrayLike | None = None,
        *,
        groups: ArrayLike | None = None,
        projections: ArrayLike | None = None,
    ) -> np.ndarray:
        """Compute how surely nothing was in the way of each sample, by what this policy has learnt.

        Parameters
        ----------
        X : array_like of shape (N, n), or Demonstrations
            States, in the order of time within each episode.
        y : array_like of shape (N, d) or (N,)
            Actions.
        groups : array_like of shape (N,), optional
            Episode labels; without them each sample is judged by itself.
        projections : array_like of shape (N, d, d), optional
            The nullspace projections that are known, all NaN where one is not.

        Returns
        -------
        ndarray of shape (N,)
            Probabilities; 0 or 1 where the projection is known.

        Raises
        ------
        DataError
            Arrays are not finite or do not fit together.
        PolicyError
            The policy was learnt by another risk than the adaptive one.
        """
        check_is_fitted(self)
        belief = self._belief("free_probability")
        samples, _ = check_input(copy(self), X, y, groups, None, projections, first=False)
        return infer(self.model_, belief, in_units(self.model_.scale, samples)).free

    def observe(self, samples: Samples) -> Observation:
        """Say what samples show of the policy: as inferred, or else along their motion.

        Parameters
        ----------
        samples : Samples
            Checked.

        Returns
        -------
        Observation
            Of N samples.
        """
        belief, samples = self.solution_.belief, in_units(self.model_.scale, samples)
        if belief is not None:
            return infer(self.model_, belief, samples).expand()
        return observe("inconsistency", samples.actions, samples.projections)

    def score(
        self,
        X: ArrayLike,
        y: ArrayLike,
        sample_weight: ArrayLike | None = None,
        *,
        groups: ArrayLike | None = None,
    ) -> float:
        """Compute the share of what recordings show that the policy explains.

        `1 - Σ [γ ‖u - p‖² + (1 - γ) (r - ûᵀp)²] / Σ ‖u‖²`: the whole action counts where nothing was in the way, and
        what lies along the motion elsewhere. γ is the inferred probability with the adaptive risk; with "direct" all
        samples are taken as free, with "inconsistency" none.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.
        y : array_like of shape (N, d) or (N,)
            Actions.
        sample_weight : array_like of shape (N,), optional
            Weight of each sample, 1 by default.
        groups : array_like of shape (N,), optional
            Episode labels, along which contact is inferred; without them each sample is judged by itself.

        Returns
        -------
        float
            At most 1.

        Raises
        ------
        DataError
            Nothing moves.
        """
        check_is_fitted(self)
        U = self.scaled(check_actions(y))
        P = self.scaled(check_actions(self.predict(X), "predictions"))
        if self.solution_.belief is not None:
            free = self.free_probability(X, y, groups=groups)
        else:
            free = np.full(len(U), float(self.risk == "direct"))
        if sample_weight is not None:
            root = np.sqrt(check_weights(sample_weight, U))[:, None]
            U, P = U * root, P * root
        return metrics.explained(U, P, free)

    def rollout(
        self,
        start: ArrayLike,
        steps: int = 500,
        dt: float = 0.02,
        constraint: Any = None,
        *,
        stop_when: Callable[[np.ndarray], ArrayLike] | None = None,
        beyond: float | None = None,
        limits: Any = None,
    ) -> "Movement":
        """Follow the policy through time, freely or under a constraint; see `simulation.rollout`.

        Parameters
        ----------
        start : array_like of shape (n,) or (S, n)
            One start, or several that are followed side by side.
        steps : int
            Number of steps.
        dt : float
            Duration of a step, in seconds.
        constraint : array_like of shape (k, n) or callable, optional
            Rows `A` with `A u = 0`, or a function that returns them for states (S, n).
        stop_when : callable, optional
            Is given the current states (S, n); where it says true a movement ends.
        beyond : float, optional
            How far from recorded states a movement may lead before it is stopped, in `distance_unit_`; by default
            `usual_distance`, infinite for anywhere. A stabilised policy may lead anywhere, since it leads back.
        limits : sequence of n pairs, or mapping from str to pairs, optional
            The least and the largest value that each state may have, or by name of those that have limits.

        Returns
        -------
        Movement
            Demonstrations: states, actions and time of every movement. Its `stopped` says which had to stop, where and
            why, of which there is a warning too.

        Raises
        ------
        PolicyError, DataError, UnconstrainError
            As for `simulation.rollout`.
        """
        from unconstrain.simulation import rollout

        return rollout(self, start, steps, dt, constraint, stop_when=stop_when, beyond=beyond, limits=limits)

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

    def compile(self) -> "CompiledPolicy":
        """Compile the fitted policy for a control loop.

        `step = policy.compile()`, then `step(x)` for states (n,) or (N, n).

        Returns
        -------
        CompiledPolicy
            A small immutable callable that does not need scikit-learn and agrees with `predict` to 1e-12 of the largest
            term either adds up, which is checked here.

        Raises
        ------
        PolicyError
            The features cannot be compiled.
        """
        check_is_fitted(self)
        step = self.model_.compile(self.solution_.w)
        if self.stability_ is not None:
            from unconstrain.deploy.compiled import Cyclic, Stabilized
            from unconstrain.stability import Cycle

            stable = self.stability_
            step = Cyclic(step, stable) if isinstance(stable, Cycle) else Stabilized(step, stable)
        step.check_agreement(self.predict)
        return step

    def to_onnx(self, path: str | PathLike[str]) -> None:
        """Write the policy as an ONNX model: input "x" (batch, n), output "u" (batch, d), float64.

        Parameters
        ----------
        path : path
            The file; an existing one is replaced.

        Raises
        ------
        PolicyError
            The extra `onnx` is not installed, or the policy is neither linear, nor of normalised RBFs, nor locally
            linear.
        """
        from unconstrain.deploy import onnx

        onnx.save(self.compile(), as_path(path))

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
        check_is_fitted(self)
        solution = self.solution_ if self.risk == "direct" else self.solution_.record.regression
        if solution is None:
            return None
        other = self._without_stability()
        other.risk, other.solution_ = "direct", replace(solution, regions=self.solution_.regions)
        if hasattr(other, "accumulator_"):
            del other.accumulator_
        return other

    def scaled(self, U: np.ndarray) -> np.ndarray:
        """Divide actions by the scale, so that their lengths and angles are those that the policy was learnt by.

        Parameters
        ----------
        U : ndarray of shape (N, d)
            Actions.

        Returns
        -------
        ndarray of shape (N, d)
            `U` itself where there is no scale.
        """
        scale = self.model_.scale
        return U if scale is None else U / scale

    def check_options(self) -> None:
        """Raise `PolicyError` for a risk, a weight decay or a noise that is none."""
        check_choice(self.risk, "risk", RISKS)
        if isinstance(self.alpha, str):
            check_choice(self.alpha, "alpha, where it is not a number,", ("cv",))
        else:
            check_number(self.alpha, "alpha", positive=False)
        if self.noise is not None:
            check_number(self.noise, "noise", positive=False)

    @property
    def n_actions_(self) -> int:
        """Dimension of the actions, d."""
        return self.model_.n_actions

    @property
    def space_(self) -> Space:
        """What the states are that were learnt from."""
        return self.model_.space if isinstance(self.model_, InSpace) else Numbers(self.model_.n_states)

    @property
    def scale_(self) -> np.ndarray:
        """What a length of one is along each action, (d,): ones, unless `scale` or the states say otherwise."""
        scale = self.model_.scale
        return np.ones(self.n_actions_) if scale is None else scale

    @property
    def distance_unit_(self) -> str:
        """What `distance` counts in: widths of receptive fields, or, of a policy without these, half the spread."""
        return "half-spreads" if self.model_.width is None else "receptive fields"

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
    def noise_(self) -> float:
        """Standard deviation σ of the recorded actions about what policy and constraints say, in units of `scale_`."""
        if np.isfinite(self.solution_.noise):
            return float(np.sqrt(self.solution_.noise))
        if self.solution_.belief is None:
            raise AttributeError('noise_ is there only after a fit with risk="adaptive" or risk="corrected"')
        return float(np.sqrt(self.solution_.belief.noise.action))

    @property
    def speed_noise_(self) -> float:
        """Standard deviation τ of the speed, as a share of the policy; 0 where that explains nothing more."""
        return float(np.sqrt(self._belief("speed_noise_").noise.speed))

    @property
    def free_share_(self) -> float:
        """Share of the samples learnt from in whose way nothing was, as inferred or known."""
        self._belief("free_share_")
        return self.solution_.free_share

    @property
    def log_likelihood_(self) -> float:
        """Log-likelihood of a sample, held out with `alpha="cv"`; `log_likelihoods_` has others to compare it with."""
        return next(iter(self.log_likelihoods_.values()))

    @property
    def log_likelihoods_(self) -> dict[str, float]:
        """Log-likelihoods by what was assumed: what was chosen, then "all free", "all constrained" and others."""
        self._belief("log_likelihoods_")
        return dict(self.solution_.record.log_likelihoods)

    @property
    def history_(self) -> list[dict[str, Any]]:
        """What each pass found: of which run it was, log-likelihood of a sample, noise, share of free samples."""
        self._belief("history_")
        return list(self.solution_.record.history)

    @property
    def n_samples_seen_(self) -> int:
        """How many samples the policy has learnt from, including those without motion."""
        return self.solution_.n_samples

    @property
    def n_zero_actions_(self) -> int:
        """How many of them have no direction; the inconsistency leaves them out."""
        return self.solution_.n_zero

    @property
    def n_known_constraints_(self) -> int:
        """Of how many of them the projection was known."""
        return self.solution_.n_known

    @property
    def moments_(self) -> list[Moments | None]:
        """The moments by fold, those of the corrected risk for `noise_`; None where a fold has no samples."""
        return self.resume().by_fold()

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.target_tags.single_output = True
        tags.target_tags.multi_output = True
        return tags

    def __sklearn_is_fitted__(self) -> bool:
        return "solution_" in vars(self)

    def _without_stability(self) -> Self:
        fresh = copy(self)
        if fresh.stability_ is not None:
            fresh.stability_ = None
        fresh.determined_share_ = None
        return fresh

    def _in_own_units(self, scaled: np.ndarray) -> np.ndarray:
        """Return actions (N, d), or covariances (N, d, d), in the unit of each action."""
        scale = self.model_.scale
        if scale is None:
            return scaled
        return scaled * (scale if scaled.ndim == 2 else np.outer(scale, scale))

    def _belief(self, name: str) -> Belief:
        belief = self.solution_.belief
        if belief is None:
            message = f'{name} is there only after a fit with risk="adaptive"'
            raise PolicyError(message) if name == "free_probability" else AttributeError(message)
        return belief

    def _adopt_from(self, fresh: Self, accumulator: Accumulator, scalars: bool) -> Self:
        """Become the policy that was prepared on a copy. Nothing here changes before all of it has succeeded."""
        fresh.model_, fresh.accumulator_ = accumulator.model, accumulator
        fresh.solution_, fresh.actions_are_scalars_ = accumulator.solve(), scalars
        if fresh.solution_.doubt:
            warnings.warn(fresh.solution_.doubt, stacklevel=3)
        for name, value in vars(fresh).items():
            setattr(self, name, value)
        if not hasattr(fresh, "feature_names_in_") and hasattr(self, "feature_names_in_"):
            del self.feature_names_in_
        return self


def _check_in_space(space: Any, X: np.ndarray) -> None:
    """Raise an error where states (N, n) are not of the space."""
    if not isinstance(space, Space):
        raise PolicyError(f"space must be a kind of state of unconstrain.spaces, got {space!r:.60}")
    if space.n_states != X.shape[1]:
        raise PolicyError(
            f"states have {X.shape[1]} numbers, and those of the space {space.n_states}: {space.words}"
        )
    faults = space.faults(X)
    if faults.any():
        raise DataError(f"the states of sample {int(np.argmax(faults))} are none of these: {space.words}")


def _where_chosen(value: np.ndarray | None, name: str) -> np.ndarray:
    if value is None:
        raise AttributeError(f'{name} is there only after a fit with alpha="cv"')
    return value
