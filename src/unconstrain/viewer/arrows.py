"""Arrows: their shape, and how they are turned."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SIDES = 8
SHAFT, HEAD, HEAD_BEGINS = 0.035, 0.11, 0.62
"""Radii of an arrow of length one, and where its head begins."""


def shape() -> tuple[Array, NDArray[np.uint32]]:
    """Make an arrow of length one along x.

    Returns
    -------
    vertices : ndarray of shape (V, 3)
        Points.
    faces : ndarray of shape (F, 3)
        Triangles of them, seen from both sides.
    """
    angles = 2 * np.pi * np.arange(SIDES) / SIDES
    circle = np.stack([np.zeros(SIDES), np.cos(angles), np.sin(angles)], axis=1)
    along = np.array([1.0, 0.0, 0.0])
    rings = [SHAFT * circle, SHAFT * circle + HEAD_BEGINS * along, HEAD * circle + HEAD_BEGINS * along]
    vertices = np.concatenate([*rings, along[None]])
    faces = []
    for k in range(SIDES):
        j = (k + 1) % SIDES
        for ring in (0, 1):
            a, b = ring * SIDES + k, ring * SIDES + j
            faces += [[a, b, a + SIDES], [b, b + SIDES, a + SIDES]]
        faces.append([2 * SIDES + k, 2 * SIDES + j, 3 * SIDES])
    return vertices, np.array(faces, dtype=np.uint32)


def turns(V: Array) -> Array:
    """Compute the rotations that turn the x axis along vectors.

    Parameters
    ----------
    V : ndarray of shape (N, 3)
        Vectors; zero is along x.

    Returns
    -------
    ndarray of shape (N, 4)
        Unit quaternions, w first.
    """
    length = np.linalg.norm(V, axis=1, keepdims=True)
    unit = np.divide(V, length, out=np.tile([1.0, 0.0, 0.0], (len(V), 1)), where=length > 0)
    half = np.stack([1.0 + unit[:, 0], np.zeros(len(V)), -unit[:, 2], unit[:, 1]], axis=1)
    backwards = half[:, 0] < 1e-9
    half[backwards] = [0.0, 0.0, 0.0, 1.0]
    return half / np.linalg.norm(half, axis=1, keepdims=True)
