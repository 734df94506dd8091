"""B-splines in each dimension of the state: their slopes, and what they are as polynomials between breaks."""

from math import factorial
from typing import Any

import numpy as np

from unconstrain.deploy.compiled import Additive
from unconstrain.errors import PolicyError

EXTRAPOLATIONS = ("linear", "constant", "continue")
"""Those under which splines are polynomials beyond their outer knots as well."""


class Splines:
    """What scikit-learn's `SplineTransformer` can do besides `transform`: see `features.bases`.

    Parameters
    ----------
    transformer : SplineTransformer
        Whose extrapolation is one of `EXTRAPOLATIONS`; fitted, before any method is called.
    """

    def __init__(self, transformer: Any) -> None:
        self.transformer = transformer

    def slopes(self, X: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Compute the slopes of all splines, `q_j b_i'(x_j)` for the splines of dimension j.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        directions : ndarray of shape (N, n)
            Directions q, one for each state.

        Returns
        -------
        ndarray of shape (N, M)
            Slopes of the M basis functions.
        """
        return (self._derivatives(X) * directions[:, :, None]).reshape(len(X), -1)

    def gradient(self, X: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Compute the gradient of `wᵀb(x)`.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        w : ndarray of shape (M,)
            Weights of the basis functions.

        Returns
        -------
        ndarray of shape (N, n)
            The gradient at each state.
        """
        return np.einsum("njk,jk->nj", self._derivatives(X), w.reshape(X.shape[1], -1))

    def compile(self, W: np.ndarray) -> Additive:
        """Compile the policy `W b(x)`.

        Parameters
        ----------
        W : ndarray of shape (d, M)
            Weights of the basis functions, a row for each action.

        Returns
        -------
        Additive
            The same policy, as arrays.

        Raises
        ------
        PolicyError
            The splines of degree 0 or 1 go on straight, which scikit-learn gets wrong.
        """
        splines = self.transformer
        if splines.degree < 2 and splines.extrapolation == "linear" and len(splines.bsplines_) > 1:
            raise PolicyError(
                "scikit-learn (as of 1.9) gets splines of degree 0 or 1 with linear extrapolation wrong in all but the "
                "first dimension, so they are not compiled: fit with degree 2 or more"
            )
        return self.combined(W.T.reshape(len(splines.bsplines_), -1, len(W)))

    def compile_descent(self, w: np.ndarray) -> Additive:
        """Compile the policy `-∇ wᵀb(x)`.

        Parameters
        ----------
        w : ndarray of shape (M,)
            Weights of the basis functions.

        Returns
        -------
        Additive
            The same policy, as arrays.
        """
        n = len(self.transformer.bsplines_)
        breaks, origins, heights = self._pieces(w.reshape(n, -1, 1))
        slopes = heights[:, :, 1:, 0] * np.arange(1, heights.shape[2])
        down = np.zeros((*slopes.shape, n))
        down[np.arange(n), :, :, np.arange(n)] = -slopes
        return Additive(breaks=breaks, origins=origins, polynomials=down)

    def combined(self, coefficients: np.ndarray) -> Additive:
        """Compile the policy that adds up functions of one dimension each.

        Parameters
        ----------
        coefficients : ndarray of shape (n, k, d)
            Of the k splines in each dimension.

        Returns
        -------
        Additive
            The same policy, as arrays.
        """
        breaks, origins, polynomials = self._pieces(coefficients)
        return Additive(breaks=breaks, origins=origins, polynomials=polynomials)

    def _derivatives(self, X: np.ndarray) -> np.ndarray:
        """Compute `b_i'(x_j)`, (N, n, k)."""
        splines = self.transformer
        columns = []
        for spline, x in zip(splines.bsplines_, X.T, strict=True):
            low, high = spline.t[spline.k], spline.t[-spline.k - 1]
            if splines.extrapolation == "continue":
                columns.append(spline(x, nu=1))
                continue
            columns.append(spline(np.clip(x, low, high), nu=1))
            if splines.extrapolation == "constant":
                columns[-1][(x < low) | (x > high)] = 0.0
        stacked = np.stack(columns, axis=1)
        return stacked if splines.include_bias else stacked[:, :, :-1]

    def _pieces(self, coefficients: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Write splines with coefficients (n, k, d) as polynomials: breaks, origins and polynomials of `Additive`.

        Between two knots the polynomial is the spline's Taylor series about the lower one; before the first and after
        the last it is the spline's extrapolation.
        """
        from scipy.interpolate import BSpline

        splines = self.transformer
        breaks, origins, polynomials = [], [], []
        for spline, own in zip(splines.bsplines_, coefficients, strict=True):
            knots, degree = spline.t, spline.k
            if not splines.include_bias:
                own = np.vstack([own, np.zeros((1, own.shape[1]))])
            whole = BSpline(knots, own, degree)
            edges = knots[degree : len(knots) - degree]
            starts = edges[:-1]
            taylor = [whole(starts, nu=p) / factorial(p) for p in range(degree + 1)]
            pieces = np.stack(taylor, axis=1)  # (K-1, p, d)
            if splines.extrapolation == "continue":
                outer, outer_origins = pieces[[0, -1]], starts[[0, -1]]
            else:
                outer, outer_origins = np.zeros((2, *pieces.shape[1:])), edges[[0, -1]]
                outer[:, 0] = whole(outer_origins)
                if splines.extrapolation == "linear" and degree > 0:
                    outer[:, 1] = whole(outer_origins, nu=1)
            # The last edge itself still belongs to the last spline.
            breaks.append(np.r_[edges[:-1], np.nextafter(edges[-1], np.inf)])
            origins.append(np.r_[outer_origins[0], starts, outer_origins[1]])
            polynomials.append(np.concatenate([outer[:1], pieces, outer[1:]]))
        return np.array(breaks), np.array(origins), np.array(polynomials)
