"""Sums of functions of one state each, made of polynomials between breaks: `π(x) = Σ_j f_j(x_j)`."""

from typing import Any, ClassVar

import numpy as np
from numpy import multiply, ndarray, subtract
from numpy.typing import ArrayLike

from unconstrain.deploy.compiled.base import CompiledPolicy, check_shapes
from unconstrain.errors import PolicyError


class Additive(CompiledPolicy):
    """`Σ_j f_j(x_j)`, each f_j from R to R^d by polynomials between breaks.

    Between breaks k-1 and k of dimension j (before the first and after the last where k is 0 or K) it is
    `Σ_p polynomials[j, k, p] (x_j - origins[j, k])^p`. A state on a break belongs to what comes after it.

    Parameters
    ----------
    breaks : array_like of shape (n, K)
        In order.
    origins : array_like of shape (n, K + 1)
        Of each piece.
    polynomials : array_like of shape (n, K + 1, degree + 1, d)
        Their coefficients, from the constant on.
    """

    __slots__ = ()
    kind = "additive"
    layout: ClassVar = {"breaks": 2, "origins": 2, "polynomials": 4}

    def __init__(self, breaks: ArrayLike, origins: ArrayLike, polynomials: ArrayLike) -> None:
        super().__init__(breaks=breaks, origins=origins, polynomials=polynomials)

    def __call__(self, x: ArrayLike, out: ndarray | None = None) -> ndarray:
        """Act; see `CompiledPolicy`."""
        if type(x) is not ndarray or x.shape != self._shape:
            return self._otherwise(x, out)
        breaks, origins, polynomials, first, ones = self._parts
        above, powers, piece = self._scratch.buffers
        np.greater_equal(x[:, None], breaks, above)
        above.dot(ones, piece)  # how many breaks lie below, which is the piece
        index = piece.astype(np.intp)
        index += first
        offset = subtract(x, origins[index])
        for p in range(1, powers.shape[1]):
            multiply(powers[:, p - 1], offset, powers[:, p])
        try:
            return powers.reshape(-1).dot(polynomials[index].reshape(-1, self.n_actions), out)
        except (ValueError, TypeError) as error:
            raise self._bad_out(out) from error

    def magnitude(self, X: ndarray) -> float:
        """Return the largest term that is added up; see `CompiledPolicy`."""
        offsets, polynomials = self._pieces(X)
        powers = np.abs(offsets)[..., None] ** np.arange(polynomials.shape[2])
        return float(np.einsum("njp,njpd->nd", powers, np.abs(polynomials)).max())

    def _dimensions(self, arrays: dict[str, ndarray]) -> tuple[int, int]:
        n, pieces, _, d = arrays["polynomials"].shape
        check_shapes(arrays, breaks=(n, pieces - 1), origins=(n, pieces))
        if not (np.diff(arrays["breaks"], axis=1) >= 0).all():
            raise PolicyError("the breaks of a compiled policy must be in order")
        return n, d

    def _prepare(self, arrays: dict[str, ndarray]) -> tuple[Any, ...]:
        n, pieces, order, d = arrays["polynomials"].shape
        return (
            arrays["breaks"],
            arrays["origins"].reshape(-1),
            arrays["polynomials"].reshape(-1, order, d),
            np.arange(n) * pieces,
            np.ones(pieces - 1),
        )

    def _buffers(self) -> tuple[ndarray, ...]:
        n, pieces, order, _ = self.arrays["polynomials"].shape
        return np.empty((n, pieces - 1)), np.ones((n, order)), np.empty(n)

    def _pieces(self, X: ndarray) -> tuple[ndarray, ndarray]:
        """Find each state's offset from its piece's origin (N, n), and the piece's polynomial (N, n, p, d)."""
        breaks, origins, polynomials, first, _ = self._parts
        piece = np.column_stack(
            [np.searchsorted(b, x, side="right") for b, x in zip(breaks, X.T, strict=True)]
        )
        return X - origins[piece + first], polynomials[piece + first]

    def _many(self, X: ndarray) -> ndarray:
        offsets, polynomials = self._pieces(X)
        result = polynomials[:, :, -1]
        for p in range(polynomials.shape[2] - 2, -1, -1):
            result = result * offsets[..., None] + polynomials[:, :, p]
        return result.sum(axis=1)

    def _typical_states(self, rng: np.random.Generator, count: int) -> ndarray:
        low, high = self.arrays["breaks"][:, 0], self.arrays["breaks"][:, -1]
        return low + (high - low) * rng.uniform(-0.2, 1.2, size=(count, self.n_states))
