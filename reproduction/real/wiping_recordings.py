"""Wiping on two surfaces, read as the library reads it: positions, velocities, rotations of the hand, forces."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import unconstrain as uc
from unconstrain import constraints
from unconstrain.demonstrations import Demonstrations
from unconstrain.spaces import Rotation

Array = NDArray[np.float64]

SURFACES = ("rim", "fender")
FILES = "wiping/demos_{}_processed_data.mat"
THRESHOLD, RELEASE = 12.0, 10.0
"""Newtons. Chosen by eye on these recordings: the hand that leads the arm is felt up to 8 N, wiping from 12 N."""
MARGIN = 20
"""Samples beside a contact that are not taken for free, 0.2 s."""

POSITION = ["X[0]", "X[1]", "X[2]"]
FORCE = ["X[7]", "X[8]", "X[9]"]
MATRIX = [f"H[{i}]" for i in (0, 1, 2, 4, 5, 6, 8, 9, 10)]
WHERE: dict[str, Any] = {"time": "time", "episode": "episode"}


@dataclass(frozen=True)
class Surface:
    """What was recorded on one surface.

    Parameters
    ----------
    name : str
    demos : Demonstrations
        Positions and velocities, with the forces as the sensor gave them.
    rotations : ndarray of shape (N, 3, 3)
        Of the hand.
    stuck : ndarray of shape (N,), bool
        Where the force sensor had stopped.
    """

    name: str
    demos: Demonstrations
    rotations: Array
    stuck: NDArray[np.bool_]


@cache
def read(folder: Path, name: str) -> Surface:
    """Read what was recorded on a surface.

    Parameters
    ----------
    folder : Path
        Of recordings.
    name : str
        Of `SURFACES`.

    Returns
    -------
    Surface
    """
    file = folder / FILES.format(name)
    demos = uc.load(file, state=POSITION, force=FORCE, force_threshold=THRESHOLD, **WHERE)
    turned = uc.load(file, state=MATRIX, rotation=MATRIX, **WHERE)
    assert isinstance(turned.space, Rotation)
    assert demos.forces is not None
    rotations = turned.space.rotations(turned.states).as_matrix()
    return Surface(name, demos, rotations, constraints.find_stuck(demos.forces, episodes=demos.episodes))


def clean_forces(folder: Path, threshold: float = THRESHOLD) -> tuple[constraints.Payload, dict[str, Array]]:
    """Take weight and bias out of the forces: one weight on both surfaces, and a bias in each episode.

    Parameters
    ----------
    folder : Path
        Of recordings.
    threshold : float
        Of contact, in newtons.

    Returns
    -------
    payload : Payload
    forces : dict
        Of each surface contact forces (N, 3) in the frame of the world, all NaN where they are not known.
    """
    surfaces = [read(folder, name) for name in SURFACES]
    F = np.concatenate([np.asarray(surface.demos.forces) for surface in surfaces])
    R = np.concatenate([surface.rotations for surface in surfaces])
    first = surfaces[0].demos.n_episodes
    episodes = np.concatenate([surfaces[0].demos.episodes, surfaces[1].demos.episodes + first])
    payload = constraints.find_payload(F, R, threshold, episodes=episodes, margin=MARGIN)
    f = payload.remove(F, R, episodes=episodes)
    f[np.concatenate([surface.stuck for surface in surfaces])] = np.nan
    parts = np.split(f, [len(surfaces[0].demos)])
    return payload, dict(zip(SURFACES, parts, strict=True))
