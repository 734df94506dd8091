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

    def order(self) -> NDArray[np.intp] | None:
        """Find an order in which each episode's samples follow each other, and keep their own order.

        Returns
        -------
        ndarray of shape (N,), int, or None
            Rows; None where that is so already.
        """
        if self.groups is None:
            return None
        _, first, label = np.unique(self.groups, return_index=True, return_inverse=True)
        if np.count_nonzero(label[1:] != label[:-1]) == len(first) - 1:
            return None
        return np.argsort(first[label], kind="stable")

    def select(self, rows: NDArray[Any] | slice) -> "Samples":
        """Select some of the samples.

        Parameters
        ----------
        rows : ndarray of int or bool, or slice
            Which.

        Returns
        -------
        Samples
            These.
        """
        taken = [None if each is None else each[rows] for each in self]
        return Samples(*taken)  # type: ignore[arg-type]
