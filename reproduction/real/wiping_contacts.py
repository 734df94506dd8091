"""Phases of wiping, and whether the force in each points along the normal of the plane through its points."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reproduction.real.wiping_recordings import RELEASE, SURFACES, THRESHOLD, clean_forces, read
from unconstrain import constraints
from unconstrain.constraints import Friction, Payload

Array = NDArray[np.float64]

SHORTEST = 2.0
"""Seconds: a shorter contact is a touch on the way."""


@dataclass(frozen=True)
class Wipe:
    """A phase of wiping.

    Parameters
    ----------
    surface : str
    episode : str
    rows : ndarray of int
        Samples of the surface's demonstrations.
    begin, end : float
        Seconds.
    spread : ndarray of shape (3,)
        Standard deviations of the points along the plane's axes, in metres, the largest first.
    axes : ndarray of shape (3, 3)
        Those axes as rows; the last is the normal.
    force : ndarray of shape (3,)
        Mean force, without weight, bias and what lies along the motion.
    angles : dict
        Angles in degrees between the normal and the mean force, by what was done to the force.
    hand, apart : float
        Angles in degrees of the hand's own axis to the normal, and to the mean force without friction.
    friction : Friction
        As estimated.
    strokes : int
        How often the motion along the longest axis turns round.
    """

    surface: str
    episode: str
    rows: NDArray[np.intp]
    begin: float
    end: float
    spread: Array
    axes: Array
    force: Array
    angles: dict[str, float]
    hand: float
    apart: float
    friction: Friction
    strokes: int


RAW, TURNED, CLEAN, FRICTIONLESS = (
    "as measured, axes of the hand taken for the world's",
    "turned into the world's frame",
    "weight and bias out",
    "friction out too",
)


def find_wipes(
    folder: Path, threshold: float = THRESHOLD, release: float = RELEASE
) -> tuple[Payload, list[Wipe]]:
    """Find the phases of wiping on both surfaces.

    Parameters
    ----------
    folder : Path
        Of recordings.
    threshold, release : float
        Of contact, in newtons.

    Returns
    -------
    payload : Payload
        The weight and the biases.
    wipes : list of Wipe
    """
    payload, clean = clean_forces(folder, threshold)
    wipes = []
    for name in SURFACES:
        demos = read(folder, name).demos
        f = clean[name]
        touching, _ = constraints.contact(
            np.nan_to_num(f), threshold, release=release, episodes=demos.episodes
        )
        assert demos.time is not None
        for code, label in enumerate(demos.episode_labels):
            own = np.flatnonzero(demos.episodes == code)
            edges = np.flatnonzero(np.diff(np.concatenate([[0], touching[own] == 1, [0]])))
            for begin, end in zip(edges[::2], edges[1::2], strict=True):
                rows = own[begin:end]
                times = demos.time[rows[[0, -1]]]
                if times[1] - times[0] >= SHORTEST:
                    wipes.append(_measure(folder, name, label, rows, f[rows]))
    return payload, wipes


def _measure(folder: Path, name: str, label: str, rows: NDArray[np.intp], f: Array) -> Wipe:
    surface = read(folder, name)
    demos = surface.demos
    assert demos.forces is not None
    assert demos.time is not None
    P, V = demos.states[rows], demos.actions[rows]
    _, values, axes = np.linalg.svd(P - P.mean(axis=0), full_matrices=False)
    raw = demos.forces[rows]
    turned = np.einsum("nij,nj->ni", surface.rotations[rows], raw)
    speed = np.linalg.norm(V, axis=1)
    moves = speed > 0.1 * np.sqrt(np.mean(speed**2))
    along = V[moves] / speed[moves, None]
    frictionless = f[moves] - np.einsum("nm,nm->n", f[moves], along)[:, None] * along
    angles = {
        what: _angle(mean, axes[2])
        for what, mean in (
            (RAW, raw.mean(axis=0)),
            (TURNED, turned.mean(axis=0)),
            (CLEAN, f.mean(axis=0)),
            (FRICTIONLESS, frictionless.mean(axis=0)),
        )
    }
    hand = surface.rotations[rows][:, :, 2].mean(axis=0)
    begin, end = demos.time[rows[[0, -1]]].tolist()
    force = frictionless.mean(axis=0)
    return Wipe(
        name, label, rows, begin, end, values / np.sqrt(len(P)), axes, force, angles, _angle(hand, axes[2]),
        _angle(hand, force), constraints.find_friction(f, V, RELEASE), _turns(V @ axes[0]),
    )  # fmt: skip


def _angle(a: Array, b: Array) -> float:
    return float(np.degrees(np.arccos(abs(a @ b) / (np.linalg.norm(a) * np.linalg.norm(b)))))


def _turns(speed: Array) -> int:
    """Count how often a speed changes its sign, beyond a fifth of its root mean square."""
    clear = speed[np.abs(speed) > 0.2 * np.sqrt(np.mean(speed**2))]
    return int(np.sum(clear[1:] * clear[:-1] < 0))
