"""What the turning of the hand says of a mechanism: a hinge turns it, a drawer does not."""

import numpy as np
from numpy.typing import NDArray

from unconstrain.constraints.mechanisms.shapes import Shape

Array = NDArray[np.float64]

LOOSENESS = np.radians(3.0)
"""How far a hand turns within what it holds: a standard deviation about each axis."""
FREE = -3.0 * np.log(np.pi)
"""Logarithm of the density of a hand that may turn in any way, about each axis within a half turn."""


def log_density(shape: Shape | None, P: Array, R: Array, known: NDArray[np.bool_]) -> Array:
    """Compute the logarithm of the density of the rotations of one episode: kept, turned by the hinge, or any.

    Parameters
    ----------
    shape : Shape or None
        None where there is no mechanism.
    P : ndarray of shape (N, 3)
        Positions, in the order of time.
    R : ndarray of shape (N, 3, 3)
        Rotations of the hand, from its own frame to that of the positions.
    known : ndarray of shape (N,), bool
        From these samples it is read how the hand holds the thing.

    Returns
    -------
    ndarray of shape (N,)
        Of the way that explains the known samples best.
    """
    best, most = np.full(len(P), FREE), FREE * known.sum()
    ways = [np.zeros(len(P))]
    if shape is not None and shape.kind == "hinge":
        ways.append(shape.angles(P))
    for angles in ways:
        size = _strays(angles, None if shape is None else shape.direction, R, known)
        density = -0.5 * (size / LOOSENESS) ** 2 - 3.0 * np.log(np.sqrt(2.0 * np.pi) * LOOSENESS)
        density = np.logaddexp(np.log(0.95) + density, np.log(0.05) + FREE)
        if density[known].sum() > most:
            best, most = density, density[known].sum()
    return best


def describe(shape: Shape, P: Array, R: Array) -> str:
    """Say how the hand turned along a mechanism.

    Parameters
    ----------
    shape : Shape
        A hinge or a line.
    P : ndarray of shape (N, 3)
        Positions of one episode, in the order of time.
    R : ndarray of shape (N, 3, 3)
        Rotations of the hand.

    Returns
    -------
    str
        A clause.
    """
    everything = np.ones(len(P), dtype=bool)
    kept = _strays(np.zeros(len(P)), shape.direction, R, everything)
    if shape.kind == "hinge":
        turned = _strays(shape.angles(P), shape.direction, R, everything)
        if _size(turned) < min(_size(kept), 2.0 * LOOSENESS):
            return f"the hand turns with it, to within {np.degrees(_size(turned)):.2g}°"
    if _size(kept) < 2.0 * LOOSENESS:
        return f"the hand keeps its orientation, to within {np.degrees(_size(kept)):.2g}°"
    return f"the hand turns by itself, by {np.degrees(_size(kept)):.2g}° (root mean square)"


def _strays(angles: Array, axis: Array | None, R: Array, known: NDArray[np.bool_]) -> Array:
    """Compute by which angle each rotation differs from one that is turned by given angles about an axis."""
    from scipy.spatial.transform import Rotation  # slow to import

    turned = Rotation.from_matrix(R)
    if axis is not None and angles.any():
        turned = Rotation.from_rotvec(-angles[:, None] * axis) * turned
    return np.atleast_1d((turned * turned[known].mean().inv()).magnitude())


def _size(angles: Array) -> float:
    return float(np.sqrt(np.mean(angles**2)))
