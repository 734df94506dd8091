"""The report of what recordings determine of a policy."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from unconstrain.arrays import check_actions, check_choice, check_number, check_states, check_widths
from unconstrain.diagnostics.advice import CRITERIA, PlannedRecording, Planner
from unconstrain.diagnostics.bound import bound_directions, compute_bounds
from unconstrain.diagnostics.coverage import Coverage, compute_coverage
from unconstrain.diagnostics.episodes import Contribution, compute_contributions
from unconstrain.diagnostics.foresight import Foresight
from unconstrain.diagnostics.information import Information
from unconstrain.diagnostics.regions import POOL, Region, find_worst_regions, orient
from unconstrain.diagnostics.spectrum import compute_shares
from unconstrain.diagnostics.words import describe, format_report
from unconstrain.errors import DataError, PolicyError
from unconstrain.features.centers import farthest_first
from unconstrain.features.scaling import Scaling
from unconstrain.fitting.in_space import in_units
from unconstrain.fitting.observation import observe
from unconstrain.fitting.posterior import Posterior
from unconstrain.motion import directions as unit_directions
from unconstrain.policies.linear import LinearPolicy
from unconstrain.samples import Samples


class Identifiability:
    """What recordings determine of a policy, as `unconstrain.identifiability` returns it.

    Parameters
    ----------
    policy : LinearPolicy
        Fitted.
    information : Information
        In the recordings, under the policy's features.
    threshold : float
        A direction of the policy counts as undetermined where a smaller share of it was observed.
    samples : Samples, optional
        The recordings, where they are at hand: the samples with motion or a known projection.
    n_silent : int
        How many samples were left out, since they have neither.
    state_names, action_names : sequence of str, optional
        Names of the n states and the d actions; x1, x2, ... and u1, u2, ... by default.
    """

    def __init__(
        self,
        policy: LinearPolicy,
        information: Information,
        threshold: float,
        samples: Samples | None = None,
        n_silent: int = 0,
        state_names: Sequence[str] | None = None,
        action_names: Sequence[str] | None = None,
    ):
        self.policy = policy
        self.information = information
        self.threshold = threshold
        self.samples = samples
        self.n_silent = n_silent
        n, d = policy.n_features_in_, policy.n_actions_
        self.state_names = tuple(state_names or (f"x{i + 1}" for i in range(n)))
        self.action_names = tuple(action_names or (f"u{i + 1}" for i in range(d)))

    @cached_property
    def spectra(self) -> list[np.ndarray]:
        """The generalised eigenvalues of (H, G) of every model, ascending: a list of arrays."""
        return compute_shares(self.information)

    @property
    def spectrum(self) -> np.ndarray:
        """The observed share of each direction of the policy, of all models together, ascending."""
        return np.sort(np.concatenate(self.spectra))

    @property
    def determined_share(self) -> float:
        """Share of the policy's directions of which at least `threshold` was observed, 0 to 1."""
        return self.determined_shares(self.threshold)

    @overload
    def determined_shares(self, thresholds: float) -> float: ...

    @overload
    def determined_shares(self, thresholds: Sequence[float] | np.ndarray) -> np.ndarray: ...

    def determined_shares(self, thresholds: ArrayLike) -> float | np.ndarray:
        """Compute the determined share at other thresholds: the spectrum as a curve.

        Parameters
        ----------
        thresholds : float or array_like of any shape
            Thresholds, 0 to 1.

        Returns
        -------
        float or ndarray
            The share at each, in the shape of `thresholds`.
        """
        values = self.spectrum
        shares = 1.0 - np.searchsorted(values, thresholds) / max(len(values), 1)
        return float(shares) if np.ndim(shares) == 0 else np.asarray(shares)

    @property
    def determined_share_of_models(self) -> np.ndarray:
        """The determined share of every model, (S,): of local models, where the policy is determined."""
        return np.array(
            [np.mean(values >= self.threshold) if len(values) else 0.0 for values in self.spectra]
        )

    @property
    def bound(self) -> float:
        """Bound of the unconstrained policy error, in squared units of the action, a mean over the recorded states.

        It holds for a policy in the model's span, recorded without noise, and is inf where a direction was not
        observed. Without recordings at hand, that of local models is a mean over states weighted by the sum of their
        activations.
        """
        return self._bounds[0]

    @property
    def bound_determined(self) -> float:
        """Bound of the part of the error that lies in determined directions; of the rest nothing is known."""
        return self._bounds[1]

    @property
    def bound_of_directions(self) -> list[np.ndarray]:
        """Bound of the error along each direction, in the order of `spectra`."""
        return bound_directions(self._risks, self.spectra, np.atleast_1d(self.information.moments.weight))

    @cached_property
    def posterior(self) -> Posterior:
        """The distribution of the parameters, given these recordings, as wide as what the fit held out says."""
        moments, calibration = self.information.moments, self.policy.calibration()
        decay = self.policy.model_.decay(moments)
        if calibration is None:
            return Posterior.of(moments, decay=decay)
        return calibration.posterior(moments, decay)

    @cached_property
    def _cautious(self) -> Posterior | None:
        """The posterior if no sample shows more than what lies along its motion, where more was inferred."""
        if self.samples is None or self.policy.solution_.belief is None:
            return None
        model, samples = self.policy.model_, in_units(self.policy.model_.scale, self.samples)
        along = observe("inconsistency", samples.actions, samples.projections)
        moments = model.moments(samples.states, along, samples.weights)
        return Posterior.of(moments, decay=model.decay(moments))

    def covariance(self, X: ArrayLike) -> np.ndarray:
        """Compute how far the policy may be from `predict(X)`.

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
        DataError
            The states do not fit the policy.
        """
        return self.policy.covariance(X, self.posterior)

    def unseen_directions(self, X: ArrayLike, reach: ArrayLike | None = None) -> Coverage:
        """Compute the directions of motion that were observed near states, the least observed first.

        Parameters
        ----------
        X : array_like of shape (Q, n)
            States.
        reach : float or array_like of shape (n,), optional
            Width σ of what "near" means, in units of the states, of all or of each; `self.reach` by default.

        Returns
        -------
        Coverage
            Shares and directions at each state.

        Raises
        ------
        DataError
            The states do not fit the policy, or the report is of moments alone.
        """
        samples = self.require_samples("which directions were observed near a state")
        n = samples.states.shape[1]
        width = self.reach if reach is None else check_widths(reach, "reach", n)
        return compute_coverage(check_states(self.policy, X), samples.states, samples.actions, width)

    @property
    def reach(self) -> np.ndarray:
        """Scott's rule for the recorded states, `s N^(-1/(n+4))` along each, s its standard deviation, (n,).

        It is not the model's width: how far a model generalises is an assumption, what was observed near a state is
        not.
        """
        X = self.require_samples("how far apart the states lie").states
        return Scaling.of(X).spread * len(X) ** (-1.0 / (X.shape[1] + 4))

    def worst_regions(self, k: int = 3) -> list[Region]:
        """Find the recorded states, apart from each other, where the policy is known least.

        Parameters
        ----------
        k : int
            How many at most.

        Returns
        -------
        list of Region
            By the posterior's largest standard deviation, the worst first. The direction of each is that of the motion
            observed least there.

        Raises
        ------
        DataError
            The report is of moments alone.
        """
        samples = self.require_samples("where the policy is known least")
        return find_worst_regions(self.policy, self.posterior, samples, k, self.reach)

    def next_recordings(
        self,
        k: int = 3,
        *,
        candidates: ArrayLike | None = None,
        criterion: str = "A",
        length: float | None = None,
    ) -> list[PlannedRecording]:
        """Choose the recordings to make next.

        Each is followed along its way, as the policy learnt so far foresees it; see `diagnostics.advice`.

        Parameters
        ----------
        k : int
            How many.
        candidates : array_like of shape (C, n), optional
            States where a recording can start, and where the policy matters; recorded ones by default.
        criterion : {"A", "D"}
            "A" lessens the expected error over the candidates, "D" the entropy of the parameters.
        length : float, optional
            Samples in a recording; by default as many as in those there are.

        Returns
        -------
        list of PlannedRecording
            The one that lessens it most first.

        Raises
        ------
        DataError
            The candidates do not fit the policy, or are not given and the report is of moments alone.
        PolicyError
            `k`, `criterion` or `length` is impossible.
        """
        check_choice(criterion, "criterion", CRITERIA)
        if not isinstance(k, int | np.integer) or k < 1:
            raise PolicyError(f"the number of recordings must be a whole number of at least 1, got {k!r}")
        planned = self.planner(candidates, length).choose(int(k), criterion)
        return [replace(one, direction=orient(one.direction)) for one in planned]

    def gains(
        self,
        X: ArrayLike,
        directions: ArrayLike,
        *,
        candidates: ArrayLike | None = None,
        length: float | None = None,
    ) -> np.ndarray:
        """Compute by how much planned recordings would lessen the mean expected squared error over the candidates.

        Parameters
        ----------
        X : array_like of shape (R, n)
            Where each recording starts.
        directions : array_like of shape (R, d)
            The direction along which motion is free in each, of any length.
        candidates : array_like of shape (C, n), optional
            As for `next_recordings`.
        length : float, optional
            As for `next_recordings`.

        Returns
        -------
        ndarray of shape (R,)
            In squared units of the action.

        Raises
        ------
        DataError
            The arrays do not fit together or do not fit the policy.
        """
        X, q = check_states(self.policy, X), check_actions(directions, "directions")
        if q.shape != (len(X), self.policy.n_actions_):
            raise DataError(
                f"there are {len(X)} states, so directions must have shape {(len(X), self.policy.n_actions_)}, one for "
                f"each, got {q.shape}"
            )
        planner = self.planner(candidates, length)
        return planner.gains(X, unit_directions(q)[0]) / len(planner.X)

    def planner(self, candidates: ArrayLike | None = None, length: float | None = None) -> Planner:
        """Make a planner, to choose recordings one after the other by other rules than `next_recordings`.

        Parameters
        ----------
        candidates : array_like of shape (C, n), optional
            As for `next_recordings`.
        length : float, optional
            As for `next_recordings`.

        Returns
        -------
        Planner
            That starts from the posterior of these recordings.

        Raises
        ------
        DataError
            The candidates do not fit the policy, or are not given and the report is of moments alone.
        """
        if candidates is None:
            samples = self.require_samples("where to record")
            X = samples.states
            candidates = farthest_first(X, scaling=Scaling.of(X), n_centers=POOL)[0]
        if length is None:
            episodes = self.episodes
            length = 1.0 if episodes is None else len(episodes) / len(np.unique(episodes))
        length = check_number(length, "length", positive=True)
        foresight = (
            Foresight(self.policy) if self.samples is None else Foresight.of(self.policy, self.samples)
        )
        posteriors = [self.posterior] if self._cautious is None else [self.posterior, self._cautious]
        return Planner(self.policy, posteriors, check_states(self.policy, candidates), length, foresight)

    def contributions(self) -> list[Contribution]:
        """Compute how many of the determined directions each episode holds, and which could be dropped.

        Returns
        -------
        list of Contribution
            One for each episode, the largest first.

        Raises
        ------
        DataError
            The report is of moments alone, or the episodes are not known.
        """
        samples = self.require_samples("which episodes contribute")
        if samples.groups is None:
            raise DataError(
                "which episodes contribute needs to know them: identifiability(policy, X, U, groups=...)"
            )
        return compute_contributions(self.policy, self.information, samples, samples.groups, self.threshold)

    @property
    def episodes(self) -> np.ndarray | None:
        """The episode of each sample, (N,), where they are known."""
        return None if self.samples is None else self.samples.groups

    def require_samples(self, purpose: str) -> Samples:
        """Get the recordings, which a report of moments alone does not have.

        Parameters
        ----------
        purpose : str
            What they are needed to say: "where to record".

        Returns
        -------
        Samples
            Those with motion or a known projection.

        Raises
        ------
        DataError
            The report is of moments alone.
        """
        if self.samples is None:
            raise DataError(f"to say {purpose}, the recordings are needed: identifiability(policy, X, U)")
        return self.samples

    def describe(self, state_names: Sequence[str], action_names: Sequence[str], k: int = 3) -> str:
        """Describe the report in sentences.

        Parameters
        ----------
        state_names, action_names : sequence of str
            Names of the n states and the d actions.
        k : int
            How many regions and recordings to name.

        Returns
        -------
        str
            Several lines.

        Raises
        ------
        DataError
            The report is of moments alone.
        """
        return describe(self, state_names, action_names, k)

    def __repr__(self) -> str:
        lines = [
            f"determined: {self.determined_share:.1%} of {len(self.spectrum)} directions of the policy "
            f"(at least {self.threshold:g} of each observed)",
            f"error bound: {self._relate(self.bound)} in all directions, "
            f"{self._relate(self.bound_determined)} in those determined",
        ]
        if self.policy.model_.n_models > 1:
            shares = self.determined_share_of_models
            lines.insert(
                1, f"local models: {shares.min():.1%} to {shares.max():.1%} determined, {len(shares)} models"
            )
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return format_report(self)

    @property
    def _risks(self) -> np.ndarray:
        """E_i of the policy as it is, summed over samples, of every model (S,)."""
        moments = self.information.moments
        w = self.policy.solution_.w
        return moments.risk(w[..., :, None, None]).reshape(len(self.information))

    @cached_property
    def _bounds(self) -> tuple[float, float]:
        weight = float(np.sum(self.information.moments.weight))
        if self.samples is not None and self.samples.weights is not None:
            reach = self.policy.model_.reach(self.samples.states)
            weight = float(reach.sum(axis=1).min() * np.sum(self.samples.weights))
        return compute_bounds(self._risks, self.spectra, weight, self.threshold)

    def _relate(self, error: float) -> str:
        """Say an error as a share of the mean squared action, or that it is so large that it says nothing."""
        moments = self.information.moments
        motion = float(np.sum(moments.squares) / np.sum(moments.weight))
        if not (np.isfinite(error) and motion):
            return "none"
        if error >= motion:
            return "says nothing, as it is more than the mean squared action itself"
        return f"{error / motion:.3g} of the mean squared action"
