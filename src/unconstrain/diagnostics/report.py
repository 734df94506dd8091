"""What recordings determine of a policy, in one object."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from sklearn.utils.validation import check_is_fitted

from unconstrain.arrays import (
    check_actions,
    check_choice,
    check_groups,
    check_number,
    check_states,
    check_weights,
)
from unconstrain.diagnostics import bound as bounding
from unconstrain.diagnostics import information as informing
from unconstrain.diagnostics.advice import CRITERIA, Planner, Recording
from unconstrain.diagnostics.coverage import Coverage, coverage
from unconstrain.diagnostics.episodes import Contribution, contributions
from unconstrain.diagnostics.information import Information
from unconstrain.diagnostics.spectrum import THRESHOLD, shares_seen
from unconstrain.diagnostics.words import described
from unconstrain.errors import DataError, PolicyError
from unconstrain.features.centers import farthest_first
from unconstrain.fitting.moments import Moments
from unconstrain.fitting.observation import observe
from unconstrain.fitting.posterior import Posterior
from unconstrain.motion import directions as units
from unconstrain.policies.base import Policy

POOL = 200
"""Candidate states for the next recording, spread over the recorded ones, where none are given."""


def identifiability(
    policy: Policy, X=None, U=None, *, groups=None, sample_weight=None, projections=None, threshold=THRESHOLD
) -> "Identifiability":
    """How far recordings determine a policy of this model, where they do not, and what to record next.

    policy: fitted; its features, centres and parameters are used, its λ is not.
    X (N, n), U (N, d): recordings, usually those it was fitted to. Without them the report is about all that the policy
        has learnt from, by its moments alone (streams, clusters); then what needs states asks for them.
    groups: episode labels (N,), for `contributions()`.
    sample_weight: (N,). projections: N (N, d, d), as in `fit`.
    threshold: a direction of which less than this share was seen is called undetermined.

    >>> import numpy as np, unconstrain as uc
    >>> X = np.random.default_rng(0).normal(size=(100, 2))
    >>> U = -X * [1.0, 0.0]                                          # never moves along the second axis
    >>> report = uc.identifiability(uc.ParametricPolicy().fit(X, U), X, U)
    >>> report.determined_share
    0.5
    >>> report.unseen_directions(X[:1]).directions[0, 0].round(6).tolist()
    [0.0, 1.0]

    Raises `DataError` for bad recordings, and where nothing moves; `PolicyError` where moments alone do not suffice.
    """
    if not isinstance(policy, Policy):
        raise PolicyError(f"identifiability is about a policy of unconstrain, got {type(policy).__name__}")
    check_is_fitted(policy)
    threshold = check_number(threshold, "threshold", positive=True)
    if (X is None) != (U is None):
        raise DataError("give states and actions both, or neither: identifiability(policy, X, U)")
    if X is None:
        return Identifiability(policy, informing.of_fit(policy), threshold)
    information, counted = informing.of_recordings(policy, X, U, sample_weight, projections)
    X = check_states(policy, X)
    groups, weights = check_groups(groups, len(X)), check_weights(sample_weight, X)
    N = None if projections is None else np.asarray(projections, dtype=np.float64)[counted]
    U = check_actions(U)[counted]
    recordings = Recordings(X[counted], U, weights[counted], None if groups is None else groups[counted], N)
    return Identifiability(policy, information, threshold, recordings, len(counted) - len(U))


@dataclass(frozen=True)
class Recordings:
    """The samples that count: states (N, n), actions (N, d), weights (N,), and episodes (N,), projections if given."""

    X: np.ndarray
    U: np.ndarray
    weights: np.ndarray
    episodes: np.ndarray | None
    projections: np.ndarray | None


@dataclass(frozen=True)
class Region:
    """Somewhere the policy is not known: at `state` (n,), where motion along `direction` (d,) was seen least.

    deviation: standard deviation of the policy along the direction; speed: of the prediction; in units of the action.
    seen: share of the motion near the state that went along the direction; 1/d where all directions were seen alike.
    """

    state: np.ndarray
    direction: np.ndarray
    deviation: float
    speed: float
    seen: float


class Identifiability:
    """What recordings determine of a policy; made by `identifiability`. See `spectrum`, `bound`, `uncertainty`."""

    def __init__(
        self,
        policy: Policy,
        information: Information,
        threshold: float,
        recordings: Recordings | None = None,
        n_silent: int = 0,
    ):
        self.policy = policy
        self.information = information
        self.threshold = threshold
        self.recordings = recordings
        self.n_silent = n_silent
        """Samples that say nothing: without motion."""

    @cached_property
    def spectra(self) -> list[np.ndarray]:
        """The generalised eigenvalues of (H, G), ascending, of every model: a list of arrays."""
        return shares_seen(self.information)

    @property
    def spectrum(self) -> np.ndarray:
        """Those of all models together, ascending: for each direction of the policy, what share of it was seen."""
        return np.sort(np.concatenate(self.spectra))

    @property
    def determined_share(self) -> float:
        """Share of the policy's directions of which at least `threshold` was seen, 0 to 1."""
        return self.determined_shares(self.threshold)

    def determined_shares(self, thresholds):
        """Return the share for each of several thresholds, in an array of their shape: the spectrum as a curve."""
        values = self.spectrum
        shares = 1.0 - np.searchsorted(values, thresholds) / max(len(values), 1)
        return float(shares) if np.ndim(shares) == 0 else shares

    @property
    def determined_share_of_models(self) -> np.ndarray:
        """The share for every model, (S,): of a locally linear policy, where it is determined."""
        return np.array(
            [np.mean(values >= self.threshold) if len(values) else 0.0 for values in self.spectra]
        )

    @property
    def bound(self) -> float:
        """What UPE can be at most, in squared units of the action, a mean over the recorded states; inf is nothing.

        For a policy in the model's span, recorded without noise: see `bound`. Without recordings at hand, local models'
        is a mean over states weighted by the sum of their activations.
        """
        return self._bounds[0]

    @property
    def bound_determined(self) -> float:
        """The same for the part of the error that lies in determined directions; of the rest nothing is known."""
        return self._bounds[1]

    @property
    def bound_of_directions(self) -> list[np.ndarray]:
        """The same for every direction by itself, in the order of `spectra`."""
        return bounding.per_direction(self._risks, self.spectra, self.information.moments.weight)

    @cached_property
    def posterior(self) -> Posterior:
        """Of the parameters, from these recordings: see `uncertainty`."""
        seen = self.information.moments
        if not self._local:  # a single model has no leading axis
            seen = Moments(seen.H[0], seen.g[0], seen.squares[0], seen.weight[0], seen.n_samples)
        return Posterior.of(seen)

    def covariance(self, X) -> np.ndarray:
        """How far the policy may be from `predict(X)`, second moments (N, d, d) at states X (N, n)."""
        X = check_states(self.policy, X)
        return self.policy.covariance(X, self.posterior)

    def unseen_directions(self, X, reach: float | None = None) -> Coverage:
        """Near each state of X (Q, n), the directions of motion, least seen first: see `coverage`.

        reach: σ of what "near" means, in units of the states; by default `self.reach`.
        """
        near = self.recordings_for("which directions were seen near a state")
        width = self.reach if reach is None else check_number(reach, "reach", positive=True)
        return coverage(check_states(self.policy, X), near.X, near.U, width)

    @property
    def reach(self) -> float:
        """Scott's rule for the recorded states, `s N^(-1/(n+4))`, s the root of their mean variance over dimensions.

        Not the model's width: how far a model generalises is an assumption, what was seen near a state is not.
        """
        X = self.recordings_for("how far apart the states lie").X
        spread = float(np.sqrt(np.mean(np.var(X, axis=0))))
        return spread * len(X) ** (-1.0 / (X.shape[1] + 4)) or 1.0

    def worst_regions(self, k: int = 3) -> list[Region]:
        """Return the k recorded states, apart from each other, where the policy is known least, the worst first.

        Ordered by the posterior's largest standard deviation. The direction is that of the motion least seen there.
        """
        near = self.recordings_for("where the policy is known least")
        pool, radius = farthest_first(near.X, n_centers=POOL)
        covariance = self.covariance(pool)
        speeds = np.linalg.norm(check_actions(self.policy.predict(pool)), axis=1)
        order = np.argsort(np.linalg.eigvalsh(covariance)[:, -1])[::-1]
        chosen: list[int] = []
        for i in order.tolist():
            apart = min((np.linalg.norm(pool[i] - pool[j]) for j in chosen), default=np.inf)
            if len(chosen) < k and apart > max(2 * radius, 2 * self.reach):
                chosen.append(i)
        seen = self.unseen_directions(pool[chosen])
        result = []
        for i, share, q in zip(chosen, seen.shares[:, 0], seen.directions[:, 0], strict=True):
            deviation = float(np.sqrt(max(q @ covariance[i] @ q, 0.0)))
            result.append(Region(pool[i], _oriented(q), deviation, float(speeds[i]), float(share)))
        return result

    def next_recordings(
        self, k: int = 3, *, candidates=None, criterion: str = "A", length=None
    ) -> list[Recording]:
        """Return the k recordings to make next, the most telling first: see `advice`.

        candidates: states (C, n) where one could begin, and where the policy matters; by default recorded ones.
        criterion: "A", to lessen the expected error over the candidates, or "D", to lessen the entropy.
        length: samples in a recording; by default as in those there are.
        """
        check_choice(criterion, "criterion", CRITERIA)
        if not isinstance(k, int | np.integer) or k < 1:
            raise PolicyError(f"the number of recordings must be a whole number of at least 1, got {k!r}")
        found = self.planner(candidates, length).next(int(k), criterion)
        return [Recording(one.state, _oriented(one.direction), one.deviation, one.gain) for one in found]

    def gains(self, X, directions, *, candidates=None, length=None) -> np.ndarray:
        """By how much planned recordings would lessen the mean expected squared error over the candidates.

        X (C, n): where each begins; directions (C, d): along which it moves. Returns (C,).
        """
        X, q = check_states(self.policy, X), check_actions(directions, "directions")
        if q.shape != (len(X), self.policy.n_actions_):
            raise DataError(
                f"there are {len(X)} states, so directions must have shape {(len(X), self.policy.n_actions_)}, one for "
                f"each, got {q.shape}"
            )
        planner = self.planner(candidates, length)
        return planner.gains(X, units(q)[0]) / len(planner.X)

    def planner(self, candidates=None, length=None) -> Planner:
        """For recordings chosen one after the other by other rules than `next_recordings`."""
        if candidates is None:
            candidates = farthest_first(self.recordings_for("where to record").X, n_centers=POOL)[0]
        if length is None:
            known = self.recordings.episodes if self.recordings is not None else None
            length = 1.0 if known is None else len(known) / len(np.unique(known))
        repeats = check_number(length, "length", positive=True)
        return Planner(self.policy, self.posterior, check_states(self.policy, candidates), repeats)

    def contributions(self) -> list[Contribution]:
        """How many of the determined directions each episode holds, and which could go: see `episodes`."""
        near = self.recordings_for("which episodes contribute")
        if near.episodes is None:
            raise DataError(
                "which episodes contribute needs to know them: identifiability(policy, X, U, groups=...)"
            )
        observation = observe("inconsistency", near.U, near.projections)
        args = (self.policy, self.information, near.X, observation, near.weights, near.episodes)
        return contributions(*args, self.threshold)

    def __repr__(self) -> str:
        lines = [
            f"determined: {self.determined_share:.1%} of {len(self.spectrum)} directions of the policy "
            f"(at least {self.threshold:g} of each seen)",
            f"error bound: {_measured(self.bound, self._motion)} in all directions, "
            f"{_measured(self.bound_determined, self._motion)} in those determined",
        ]
        if self._local:
            shares = self.determined_share_of_models
            lines.insert(
                1, f"local models: {shares.min():.1%} to {shares.max():.1%} determined, {len(shares)} models"
            )
        return "\n".join(lines)

    def describe(self, state_names: Sequence[str], action_names: Sequence[str], k: int = 3) -> str:
        """Return the report in sentences, with the user's own names of states and actions."""
        return described(self, state_names, action_names, k)

    @property
    def _local(self) -> bool:
        return self.policy.solution_.w.ndim > 1

    @property
    def _risks(self) -> np.ndarray:
        """E_i of the policy as it is, summed over samples, of every model (S,)."""
        seen = self.information.moments
        w = self.policy.solution_.w.reshape(len(self.information), -1)
        return seen.risk(w[:, :, None, None])[:, 0]

    @cached_property
    def _bounds(self) -> tuple[float, float]:
        weight = float(np.sum(self.information.moments.weight))
        if self.recordings is not None:
            reach = self.policy.model_.reach(self.recordings.X)
            weight = float(reach.sum(axis=1).min() * np.sum(self.recordings.weights))
        return bounding.bounds(self._risks, self.spectra, weight, self.threshold)

    @property
    def _motion(self) -> float:
        """Mean squared action, that errors are compared with."""
        seen = self.information.moments
        return float(np.sum(seen.squares) / np.sum(seen.weight))

    def recordings_for(self, what: str) -> Recordings:
        """Return the recordings that are needed to say `what`. Raises `DataError` for a report of moments alone."""
        if self.recordings is None:
            raise DataError(f"to say {what}, the recordings are needed: identifiability(policy, X, U)")
        return self.recordings


def _oriented(direction: np.ndarray) -> np.ndarray:
    """Turn a line, which has no sign, so that its largest part is positive."""
    return direction * (np.sign(direction[np.argmax(np.abs(direction))]) or 1.0)


def _measured(error: float, motion: float) -> str:
    return f"{error / motion:.3g} of the mean squared action" if np.isfinite(error) and motion else "none"
