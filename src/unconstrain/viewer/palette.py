"""What the colours of the page stand for: those of the pictures, as viser takes them."""

import numpy as np
from numpy.typing import NDArray

from unconstrain.plot import colors

LEARNT, DIRECT, RECORDED = colors.LEARNT, colors.DIRECT, colors.RECORDED

FREE, CONSTRAINED = "#009E73", "#CC79A7"
"""Recorded samples: free, and under a constraint."""
PATH, HELD = "#000000", "#E69F00"
"""The rollout, and where something is in its way."""
UNKNOWN = "#56B4E9"
"""What is not determined, and what to record next."""


def rgb(colour: str) -> tuple[int, int, int]:
    """Return a colour "#rrggbb" as three numbers to 255."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return red, green, blue


def blend(share: NDArray[np.float64], first: str, second: str) -> NDArray[np.uint8]:
    """Mix two colours.

    Parameters
    ----------
    share : ndarray of shape (N,)
        Of the second, 0 to 1.
    first, second : str
        As "#rrggbb".

    Returns
    -------
    ndarray of shape (N, 3)
        Numbers to 255.
    """
    a, b = np.array(rgb(first), dtype=float), np.array(rgb(second), dtype=float)
    return np.round(a + np.clip(share, 0.0, 1.0)[:, None] * (b - a)).astype(np.uint8)


def linear(colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Undo sRGB's curve, which viser's browser applies to a colour for each point or arrow, but not to one for all.

    Parameters
    ----------
    colours : ndarray of shape (..., 3)
        Numbers to 255, in sRGB.

    Returns
    -------
    ndarray of shape (..., 3)
        Numbers to 255 that are seen as these colours.
    """
    c = np.asarray(colours, dtype=np.float64) / 255.0
    return np.round(255.0 * np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)).astype(np.uint8)
