"""What all policies share: an estimator that learns from states and actions, predicts, and is followed."""

from abc import abstractmethod
from collections.abc import Callable
from copy import copy
from dataclasses import replace
from os import PathLike
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
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
from unconstrain.errors import PolicyError
from unconstrain.fitting.accumulator import Solution
from unconstrain.fitting.contact import Belief, infer, infer_free
from unconstrain.fitting.in_space import InSpace, in_units
from unconstrain.fitting.model import Model
from unconstrain.fitting.observation import Observation, observe
from unconstrain.fitting.region import Region, find_apart, unite
from unconstrain.policies.inputs import check_input
from unconstrain.samples import Samples
from unconstrain.spaces import Numbers, Space
from unconstrain.waiting import stage

if TYPE_CHECKING:
    from unconstrain.deploy.compiled import CompiledPolicy
    from unconstrain.stability import Cycle, Stability
    from unconstrain.stopping import Movement


class Policy(RegressorMixin, BaseEstimator):
    """Base of the estimators `u = π(x)`.

    A subclass has its options, and `learn`, which turns samples into a model and what was found out with it.

    Attributes
    ----------
    model_ : Model
        What gives actions for states and parameters: dimensions, space of the states, scale of the actions.
    solution_ : Solution
        The parameters, and what their choice was based on.
    determined_share_ : float or None
        Share of the policy that the recordings it was compared on determine, where `evaluate_held_out` has looked.
    stability_ : Stability, Cycle or None
        What makes the policy end at a goal, or go round and round, in one that `stabilized` returned.
    """

    risks: ClassVar[tuple[str, ...]] = ("adaptive", "inconsistency", "direct")
    why_no_stream: ClassVar[str] = "needs all samples at once, and a stream is read block by block"
    """What to say to whoever gives a policy of this kind to `fit_stream`."""
    keeps_order: ClassVar[bool] = False
    """Whether an episode whose rows come back after others counts as another. A stream cannot put them together, so
    for policies that learn from streams that is so in memory too."""

    risk: str
    space: Space | None
    scale: Any
    noise: float | None
    model_: Model
    solution_: Solution
    actions_are_scalars_: bool
    n_features_in_: int
    stability_: "Stability | Cycle | None" = None
    determined_share_: float | None = None

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
            Episode labels, which are held out whole; without them contiguous blocks are.
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
        return self._fit(X, y, groups, sample_weight, projections, type(self).learn)

    @abstractmethod
    def learn(self, samples: Samples, space: Space | None, noise: float | None) -> None:
        """Set what is learnt, `model_` and `solution_`, on a fresh copy that `fit` then becomes.

        Parameters
        ----------
        samples : Samples
            Checked.
        space : Space, optional
            That the samples' states belong to, where it is known.
        noise : float, optional
            Standard deviation of the actions' noise, where it is known.

        Raises
        ------
        DataError
            There is nothing to learn from.
        PolicyError
            An option is impossible.
        """

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
            Where asked for; see `covariance`. Of a stabilised policy, that of the policy it was made of.

        Raises
        ------
        DataError
            The states are not finite or not of the dimension learnt.
        PolicyError
            Both spreads are asked for, or the policy cannot tell them.
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
        covariance = self.covariance(X)
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

    def covariance(self, X: ArrayLike) -> np.ndarray:
        """Compute how far the true policy may be from `predict`.

        Parameters
        ----------
        X : array_like of shape (N, n)
            States.

        Returns
        -------
        ndarray of shape (N, d, d)
            Second moments of the deviation, in squared units of the action.

        Raises
        ------
        PolicyError
            Policies of this kind do not tell.
        """
        raise PolicyError(
            f"a {type(self).__name__} does not tell how sure it is: a LocallyLinearPolicy, a ParametricPolicy and a "
            "GaussianProcessPolicy do"
        )

    def prepare_covariance(self) -> Callable[[np.ndarray], np.ndarray]:
        """Return `covariance`, with what does not hang on the states computed beforehand.

        Returns
        -------
        callable
            From states (N, n) to second moments (N, d, d).
        """
        return self.covariance

    def usual_speed(self) -> float:
        """Compute the root mean square length of the actions learnt from, in units of `scale_`.

        Returns
        -------
        float
            Above zero.
        """
        check_is_fitted(self)
        return self.solution_.usual_speed

    @stage("making it stable")
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

    @stage("telling which samples were free")
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
        samples, order = in_units(self.model_.scale, samples), self._order(samples)
        if order is None:
            return infer_free(self.model_, belief, samples)
        free = np.empty(len(order))
        free[order] = infer_free(self.model_, belief, samples.select(order))
        return free

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
        """Write the fitted policy to a file, whole or not at all; `load_policy` reads it.

        Parameters
        ----------
        path : path
            An existing file is replaced.
        resumable : bool
            Keep what learning on needs, where policies of this kind can.

        Raises
        ------
        UnconstrainError
            The place cannot be written to, or the policy holds something that cannot be saved, such as a lambda.
        """
        from unconstrain.policies.saving import save_policy

        check_is_fitted(self)
        save_policy(self, path)

    def ordinary_regression(self) -> Self | None:
        """Return ordinary regression by the same kind of policy to the same samples, to be held against this one.

        Returns
        -------
        Policy or None
            That predicts, but cannot learn on; None where it is not known.
        """
        check_is_fitted(self)
        solution = self.solution_ if self.risk == "direct" else self.solution_.record.regression
        if solution is None:
            return None
        other = self._without_stability()
        other.risk, other.solution_ = "direct", replace(solution, regions=self.solution_.regions)
        return other

    def check_options(self) -> None:
        """Raise `PolicyError` for a risk or a noise that is none."""
        check_choice(self.risk, "risk", self.risks)
        if self.noise is not None:
            check_number(self.noise, "noise", positive=False)

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

    def _html_repr(self) -> str:
        """Return what notebooks show: what was found out, above scikit-learn's diagram of the options."""
        diagram: str = super()._html_repr()
        if not self.__sklearn_is_fitted__():
            return diagram
        from unconstrain.policies.inferred import to_html

        return to_html(self) + diagram

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.target_tags.single_output = True
        tags.target_tags.multi_output = True
        return tags

    def __sklearn_is_fitted__(self) -> bool:
        return "solution_" in vars(self)

    @stage("fitting")
    def _fit(
        self, X: Any, y: Any, groups: Any, sample_weight: Any, projections: Any, learn: Callable[..., None]
    ) -> Self:
        """Check what `fit` was given, and let a copy learn as `learn` does, which this policy then becomes."""
        fresh = self._without_stability()
        samples, scalars = check_input(fresh, X, y, groups, sample_weight, projections, first=True)
        space, noise = (X.space, X.noise) if isinstance(X, Demonstrations) else (None, None)
        fresh.actions_are_scalars_ = scalars
        order = self._order(samples)
        samples = samples if order is None else samples.select(order)
        learn(fresh, samples, space, noise)
        return self._become(fresh)

    def _order(self, samples: Samples) -> NDArray[np.intp] | None:
        return None if self.keeps_order else samples.order()

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

    def _become(self, fresh: Self) -> Self:
        """Become the policy that was prepared on a copy. Nothing here changes before all of it has succeeded."""
        for name, value in vars(fresh).items():
            setattr(self, name, value)
        if not hasattr(fresh, "feature_names_in_") and hasattr(self, "feature_names_in_"):
            del self.feature_names_in_
        return self
