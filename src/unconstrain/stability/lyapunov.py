"""Functions that fall towards a goal and have no other critical point: a quadratic and asymmetric quadratics."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Lyapunov:
    """`V(e) = eᵀP₀e + Σ_l max(0, q_l)²` with `q_l = eᵀP_l(e - μ_l)`.

    e is how far a state is from the goal. P₀ is positive definite and the others are positive semidefinite, so along
    every ray from the goal V rises: `eᵀ∇V ≥ 2V`. A term counts on one side of the goal only, so that V can be steep on
    one side and flat on another.

    Parameters
    ----------
    matrices : ndarray of shape (L + 1, d, d)
        P₀ to P_L, symmetric.
    offsets : ndarray of shape (L, d)
        μ₁ to μ_L.

    References
    ----------
    S. M. Khansari-Zadeh and A. Billard, "Learning control Lyapunov function to ensure stability of dynamical
    system-based robot reaching motions", Robotics and Autonomous Systems 62(6), 2014.
    """

    matrices: Array
    offsets: Array

    def value(self, E: Array) -> Array:
        """Compute V.

        Parameters
        ----------
        E : ndarray of shape (N, d)
            From the goal to the states.

        Returns
        -------
        ndarray of shape (N,)
            Zero at the goal only.
        """
        near = self.near(E)
        quadratic = np.einsum("ni,ni->n", near.products[:, 0], near.E)
        return near.unit**2 * (quadratic + near.unit**2 * np.sum(near.parts**2, axis=1))

    def gradient(self, E: Array) -> Array:
        """Compute ∇V.

        Parameters
        ----------
        E : ndarray of shape (N, d)
            From the goal to the states.

        Returns
        -------
        ndarray of shape (N, d)
            Zero at the goal only.
        """
        near = self.near(E)
        return near.gradient * near.unit[:, None] ** 3

    def near(self, E: Array) -> "Near":
        """Compute what V and its derivatives are made of, in a unit in which nothing overflows."""
        unit = np.maximum(1.0, np.abs(E).max(axis=1, initial=0.0))
        E = E / unit[:, None]
        products = np.einsum("lij,nj->nli", self.matrices, E)
        linear = self._linear / unit[:, None, None]
        parts = np.maximum(0.0, np.einsum("nli,ni->nl", products[:, 1:] - linear, E))
        slopes = 2.0 * products[:, 1:] - linear
        gradient = 2.0 * (products[:, 0] / unit[:, None] ** 2 + np.einsum("nl,nli->ni", parts, slopes))
        return Near(unit, E, products, parts, slopes, gradient)

    def longest_share(self, near: "Near", W: Array) -> Array:
        """Compute how much of a step may be taken so that V falls all the way.

        Parameters
        ----------
        near : Near
            Of the states.
        W : ndarray of shape (N, d)
            Steps, in the same unit. V falls where they begin.

        Returns
        -------
        ndarray of shape (N,)
            From 0 to 1. A share of it, and all of it, takes off V at least half of what the slope promises.

        Notes
        -----
        With m the largest second derivative of V on the way, V after a share s of the step is at most
        `V + s V' + s² m / 2`, so `s = -V' / m`. On the way `q_l` is convex and its slope goes one way, so that
        both are largest at an end.
        """
        bends = np.einsum("lij,nj->nli", self.matrices, W)
        curved = np.einsum("nli,ni->nl", bends, W)
        first = np.einsum("nli,ni->nl", near.slopes, W)
        # Where q is below zero it is not known here, and what it adds on the way is at most this.
        last = np.maximum(0.0, near.parts + first + curved[:, 1:])
        steep = np.maximum(np.abs(first), np.abs(first + 2.0 * curved[:, 1:]))
        reached = (near.parts > 0) | (last > 0)
        bound = 2.0 * curved[:, 0] / near.unit**2 + np.sum(
            reached * (2.0 * steep**2 + 4.0 * np.maximum(near.parts, last) * curved[:, 1:]), axis=1
        )
        falls = -np.einsum("ni,ni->n", near.gradient, W)
        share = np.divide(falls, bound, out=np.ones_like(falls), where=bound > 0)
        return np.clip(share, 0.0, 1.0)

    @property
    def _linear(self) -> Array:
        return np.einsum("lij,lj->li", self.matrices[1:], self.offsets)


class Near(NamedTuple):
    """What V is made of at N states, in units of `unit` (N,), which is at least one."""

    unit: Array
    E: Array
    products: Array
    parts: Array
    slopes: Array
    gradient: Array
