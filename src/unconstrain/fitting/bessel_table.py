"""Smooth functions of one number, as polynomials on short intervals: in place of Bessel functions, which take long.

The functions here have no singularity nearer to the real axis than 2.4, the first zero of the Bessel function of
order 0, so that a polynomial of degree 10 on an interval of a quarter is as good as double precision.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

STEP, DEGREE = 0.25, 10


@dataclass(frozen=True)
class Table:
    """Several functions on `[begin, end)`.

    Parameters
    ----------
    begin, end : float
        Multiples of `STEP`.
    coefficients : tuple of ndarray of shape (DEGREE + 1, K)
        Of each function, on K intervals, of powers of a number from -1 to 1.
    """

    begin: float
    end: float
    coefficients: tuple[Floats, ...]

    @classmethod
    def of(cls, functions: Callable[[Floats], tuple[Floats, ...]], begin: float, end: float) -> "Table":
        """Interpolate at the Chebyshev points of each interval.

        Parameters
        ----------
        functions : callable
            Returns values (N,) of each function at numbers (N,).
        begin, end : float
            Multiples of `STEP`.

        Returns
        -------
        Table
            Of these functions.
        """
        points = np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
        middles = np.arange(begin, end, STEP) + STEP / 2
        at = middles + 0.5 * STEP * points[:, None]
        chebyshev = np.polynomial.chebyshev
        # Interpolation is a product with one matrix, the same on all intervals.
        to_series = np.linalg.inv(chebyshev.chebvander(points, DEGREE))
        to_powers = np.zeros((DEGREE + 1, DEGREE + 1))
        for k in range(DEGREE + 1):
            to_powers[: k + 1, k] = chebyshev.cheb2poly(np.eye(DEGREE + 1)[k, : k + 1])
        values = functions(at.ravel())
        return cls(begin, end, tuple(to_powers @ (to_series @ value.reshape(at.shape)) for value in values))

    def __call__(self, x: Floats) -> list[Floats]:
        """Evaluate all functions.

        Parameters
        ----------
        x : ndarray of shape (N,)
            Numbers from `begin` to `end`.

        Returns
        -------
        list of ndarray of shape (N,)
            The value of each function.
        """
        scaled = (x - self.begin) / STEP
        interval = scaled.astype(np.intp)
        scaled -= interval
        scaled *= 2
        scaled -= 1
        results = []
        for rows in self.coefficients:
            value = rows[-1].take(interval)
            for row in rows[-2::-1]:
                value *= scaled
                value += row.take(interval)
            results.append(value)
        return results
