"""A finger on two surfaces: does the report find what the finger could not do, move along the normal?"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from unconstrain.diagnostics import identifiability
from unconstrain.policies import LocallyLinearPolicy
from unconstrain.receptive import activations
from unconstrain.recordings import load

Array = NDArray[np.float64]

FILES = tuple(Path("../shared/data") / f"{name}_circle.csv" for name in ("planer", "curve"))
"""Recorded fingertips; not part of the project (see the README beside them)."""

NAMES = {"planer_circle": "flat surface", "curve_circle": "curved surface"}
EVERY = 10


@dataclass(frozen=True)
class Surface:
    """One of the surfaces, at every `EVERY`-th sample recorded on it.

    points (Q, 3); normals (Q, 3): of the plane through this recording's points nearby; unseen (Q, 3): the direction
    least seen there by the report on both recordings together; shares (Q,): of the motion along it;
    posterior_angles (Q,): between the normal and the direction in which the policy deviates most, in degrees.
    """

    name: str
    points: Array
    normals: Array
    unseen: Array
    shares: Array
    posterior_angles: Array

    @property
    def angles(self) -> Array:
        """Between normal and least-seen direction, in degrees (Q,)."""
        return _angles(self.normals, self.unseen)


def surfaces() -> list[Surface]:
    """Both, from one policy and one report on both recordings."""
    demos = load(FILES, state=[1, 2, 3], time="rosbagTimestamp", max_speed=1, min_duration=1)
    policy = LocallyLinearPolicy(alpha="cv").fit(demos.states, demos.actions, groups=demos.blocks(5))
    report = identifiability(policy, demos.states, demos.actions)
    of_sample = np.array([label.split("/")[0] for label in demos.episode_labels])[demos.episodes]
    result = []
    for label, name in NAMES.items():
        own = demos.states[of_sample == label]
        points = own[::EVERY]
        seen = report.unseen_directions(points)
        worst = np.linalg.eigh(report.covariance(points))[1][:, :, -1]
        flat = normals(own, points, report.reach)
        result.append(
            Surface(name, points, flat, seen.directions[:, 0], seen.shares[:, 0], _angles(flat, worst))
        )
    return result


def normals(cloud: Array, at: Array, reach: float) -> Array:
    """Of the planes through the points (N, 3) around each of `at` (Q, 3), by total least squares: (Q, 3)."""
    weights = activations(at, cloud, reach)
    weights /= weights.sum(axis=1, keepdims=True)
    apart = cloud[None] - (weights @ cloud)[:, None]
    return np.linalg.eigh(np.einsum("qn,qni,qnj->qij", weights, apart, apart))[1][:, :, 0]


def _angles(a: Array, b: Array) -> Array:
    return np.degrees(np.arccos(np.minimum(np.abs(np.sum(a * b, axis=1)), 1.0)))
