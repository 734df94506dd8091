"""Samples on their way into a fit: plain arrays, of any precision, not checked again."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Samples(NamedTuple):
    """States, actions, and what else is known of them.

    Parameters
    ----------
    states : ndarray of shape (N, n)
        Where the samples are.
    actions : ndarray of shape (N, d)
        What was done there.
    groups : ndarray of shape (N,), optional
        Episode labels.
    projections : ndarray of shape (N, d, d), optional
        The nullspace projections, all NaN where one is not known.
    weights : ndarray of shape (N,), optional
        Each multiplies the squared error of its sample.
    """

    states: NDArray[Any]
    actions: NDArray[Any]
    groups: NDArray[Any] | None = None
    projections: NDArray[np.float64] | None = None
    weights: NDArray[np.float64] | None = None

    def select(self, rows: NDArray[Any]) -> "Samples":
        """Select some of the samples.

        Parameters
        ----------
        rows : ndarray of int or bool
            Which.

        Returns
        -------
        Samples
            These.
        """
        taken = [None if each is None else each[rows] for each in self]
        return Samples(*taken)  # type: ignore[arg-type]
