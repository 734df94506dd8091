"""A policy learnt on one surface and tried on the other: which state explains wiping, and what constraints add."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import unconstrain as uc
from reproduction.real.wiping_contacts import Wipe
from reproduction.real.wiping_recordings import (
    FILES,
    POSITION,
    RELEASE,
    SURFACES,
    THRESHOLD,
    WHERE,
    clean_forces,
    read,
)
from unconstrain import constraints
from unconstrain.evaluation import compare_risks, evaluate_held_out
from unconstrain.evaluation.verdict import Verdict

Array = NDArray[np.float64]

STEP = 8
"""Every eighth sample is used, 12 a second: a stroke takes a second or more."""
WINDOW = 11
"""Samples over which contact normals are averaged, 0.1 s."""

TOLD, INFERRED, DIRECT = "told by force", "inferred", "direct"
WAYS = (TOLD, INFERRED, DIRECT)
PAIRS = (("rim", "rim"), ("fender", "fender"), ("rim", "fender"), ("fender", "rim"))

STATES: dict[str, dict[str, Any]] = {
    "position": {},
    "position relative to the start": {"relative_to": "start"},
    "position and velocity (`--order 2`)": {"order": 2},
    "both, relative to the start": {"order": 2, "relative_to": "start"},
}
STROKE = "place and speed along the stroke of each wipe, in its own amplitudes and periods"


@dataclass(frozen=True)
class Error:
    """Mean squared errors of the whole action, as shares of what standing still would make.

    Parameters
    ----------
    whole : float
        Of the policy's action.
    under : float or None
        Of what the surface leaves of the policy's action where the force tells the constraint; None where none is told.
    """

    whole: float
    under: float | None


@dataclass(frozen=True)
class Samples:
    """What one surface gives to learn from, or to be tried on.

    Parameters
    ----------
    states : ndarray of shape (N, n)
    actions : ndarray of shape (N, d)
    groups : ndarray of shape (N,)
        What is held out together: episodes, or wipes.
    projections : ndarray of shape (N, d, d) or None
        Of forces; None where actions are accelerations, which forces say nothing of.
    """

    states: Array
    actions: Array
    groups: NDArray[np.int64]
    projections: Array | None = None

    def take(self, rows: NDArray[np.bool_]) -> "Samples":
        """Return some of the samples."""
        known = None if self.projections is None else self.projections[rows]
        return Samples(self.states[rows], self.actions[rows], self.groups[rows], known)


def project(folder: Path) -> dict[str, Array]:
    """Return the projections (N, 3, 3) that forces tell, of each surface; NaN where the sensor had stopped."""
    _, clean = clean_forces(folder)
    told = {}
    for name in SURFACES:
        demos, f = read(folder, name).demos, clean[name]
        N = constraints.from_forces(
            np.nan_to_num(f), THRESHOLD, release=RELEASE, actions=demos.actions, window=WINDOW,
            episodes=demos.episodes,
        )  # fmt: skip
        N[np.isnan(f[:, 0])] = np.nan
        told[name] = N
    return told


def of_state(folder: Path, name: str, options: dict[str, Any], told: Array) -> Samples:
    """Read a surface with one kind of state."""
    demos = uc.load(folder / FILES.format(name), state=POSITION, **WHERE, **options)
    rows = np.arange(0, len(demos), STEP)
    known = told[rows] if "order" not in options else None
    return Samples(demos.states[rows], demos.actions[rows], demos.episodes[rows], known)


def along_strokes(folder: Path, name: str, wipes: list[Wipe]) -> Samples:
    """Take of each wipe the place and the speed along its longest axis, in units of its amplitude and frequency."""
    demos = uc.load(folder / FILES.format(name), state=POSITION, order=2, **WHERE)
    parts: list[tuple[Array, Array]] = []
    groups = []
    for number, wipe in enumerate(wipe for wipe in wipes if wipe.surface == name):
        rows = wipe.rows[::STEP]
        x, v = (demos.states[rows][:, columns] @ wipe.axes[0] for columns in (slice(0, 3), slice(3, 6)))
        x = x - x.mean()
        frequency = v.std() / x.std()
        speed = x.std() * frequency
        parts.append(
            (
                np.stack([x / x.std(), v / speed], axis=1),
                (demos.actions[rows] @ wipe.axes[0])[:, None] / (speed * frequency),
            )
        )
        groups.append(np.full(len(rows), number))
    X, U = (np.concatenate(values) for values in zip(*parts, strict=True))
    return Samples(X, U, np.concatenate(groups))


def compare(
    folder: Path, wipes: list[Wipe], progress: Callable[[str], None]
) -> dict[tuple[str, str, str, str], Error]:
    """Measure errors by state, way, and surfaces learnt and tried on; on the same, of episodes (or wipes) held out."""
    told = project(folder)
    errors = {}
    for state in (*STATES, STROKE):
        progress(f"wiping: {state}")
        samples = {
            name: along_strokes(folder, name, wipes)
            if state == STROKE
            else of_state(folder, name, STATES[state], told[name])
            for name in SURFACES
        }
        for learnt, tried in PAIRS:
            for way in WAYS:
                if way != TOLD or samples[learnt].projections is not None:
                    errors[state, way, learnt, tried] = _try(samples[learnt], samples[tried], way)
    return errors


def find_verdict(folder: Path, name: str) -> Verdict:
    """Return what `unconstrain fit` says of a policy of position learnt on a surface."""
    demos = uc.load(folder / FILES.format(name), state=POSITION, **WHERE).select(slice(None, None, STEP))
    compared = compare_risks(uc.LocallyLinearPolicy(), demos, groups=demos.folds())
    if compared.better is not None:
        compared = compared.taking(compared.better)
    return evaluate_held_out(compared, demos).verdict


def _try(learnt: Samples, tried: Samples, way: str) -> Error:
    if learnt is not tried:
        return _error(_predict(learnt, tried, way), tried)
    predicted = np.empty_like(tried.actions)
    for label in np.unique(learnt.groups):
        own = learnt.groups == label
        predicted[own] = _predict(learnt.take(~own), learnt.take(own), way)
    return _error(predicted, tried)


def _predict(learnt: Samples, tried: Samples, way: str) -> Array:
    policy = uc.LocallyLinearPolicy(risk="direct" if way == DIRECT else "adaptive")
    several = len(np.unique(learnt.groups)) > 1
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that few or no constraints were told is what is measured here
        policy.fit(
            learnt.states,
            learnt.actions,
            groups=learnt.groups if several else None,
            projections=learnt.projections if way == TOLD else None,
        )
    return np.asarray(policy.predict(tried.states)).reshape(tried.actions.shape)


def _error(P: Array, tried: Samples) -> Error:
    U, N = tried.actions, tried.projections
    still = float(np.sum(U**2))
    under = None
    if N is not None:
        known = ~np.isnan(N[:, 0, 0])
        left = P.copy()
        left[known] = np.einsum("nij,nj->ni", N[known], P[known])
        under = float(np.sum((U - left) ** 2)) / still
    return Error(float(np.sum((U - P) ** 2)) / still, under)
