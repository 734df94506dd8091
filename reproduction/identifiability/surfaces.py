"""A finger on two surfaces: whether the report finds that it could not move along the normal."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reproduction.recordings import CURVED, FLAT, surface_file
from unconstrain.diagnostics import identifiability
from unconstrain.policies import LocallyLinearPolicy
from unconstrain.receptive import activations
from unconstrain.recordings import load

Array = NDArray[np.float64]

NAMES = {FLAT: "flat surface", CURVED: "curved surface"}

EVERY = 10
"""Samples of a recording to one that is judged."""


@dataclass(frozen=True)
class Surface:
    """One of the surfaces, at every `EVERY`-th sample recorded on it.

    Attributes
    ----------
    name : str
        In words.
    points : ndarray of shape (Q, 3)
        The samples.
    normals : ndarray of shape (Q, 3)
        Of the plane through this recording's points nearby.
    unseen : ndarray of shape (Q, 3)
        The direction least moved in there, by the report on both recordings together.
    shares : ndarray of shape (Q,)
        Of the motion along it.
    posterior_angles : ndarray of shape (Q,)
        Between the normal and the direction in which the policy deviates most, in degrees.
    """

    name: str
    points: Array
    normals: Array
    unseen: Array
    shares: Array
    posterior_angles: Array

    @property
    def angles(self) -> Array:
        """Angles between normal and least-seen direction, in degrees (Q,)."""
        return _angles(self.normals, self.unseen)


def examine_surfaces(folder: Path) -> list[Surface]:
    """Examine both recordings of a folder, with one policy and one report on both."""
    files = [surface_file(folder, name) for name in NAMES]
    demos = load(files, state=[1, 2, 3], time="rosbagTimestamp", max_speed=1, min_duration=1)
    policy = LocallyLinearPolicy(risk="inconsistency", alpha="cv").fit(
        demos.states, demos.actions, groups=demos.blocks(5)
    )
    report = identifiability(policy, demos.states, demos.actions)
    of_sample = np.array([label.split("/")[0] for label in demos.episode_labels])[demos.episodes]
    result = []
    for file, name in NAMES.items():
        own = demos.states[of_sample == Path(file).stem]
        points = own[::EVERY]
        seen = report.unseen_directions(points)
        worst = np.linalg.eigh(report.covariance(points))[1][:, :, -1]
        normals = fit_normals(own, points, report.reach)
        result.append(
            Surface(name, points, normals, seen.directions[:, 0], seen.shares[:, 0], _angles(normals, worst))
        )
    return result


def fit_normals(cloud: Array, at: Array, reach: float | Array) -> Array:
    """Fit planes to the points (N, 3) around each of `at` (Q, 3), by total least squares; their normals (Q, 3)."""
    weights = activations(at, cloud, reach)
    weights /= weights.sum(axis=1, keepdims=True)
    apart = cloud[None] - (weights @ cloud)[:, None]
    return np.linalg.eigh(np.einsum("qn,qni,qnj->qij", weights, apart, apart))[1][:, :, 0]


def _angles(a: Array, b: Array) -> Array:
    return np.degrees(np.arccos(np.minimum(np.abs(np.sum(a * b, axis=1)), 1.0)))
