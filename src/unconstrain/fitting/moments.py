"""The sufficient statistics of a fit, and its solution.

For any policy linear in its parameters, `π(x) = Φ(x) w`, any of the risks is

    E(w) = Σ_n ω_n ‖Q_n u_n - V_n w‖² = s - 2 gᵀw + wᵀH w,        V_n = Q_n Φ(x_n)
    H = Σ ω_n V_nᵀ V_n,    g = Σ ω_n V_nᵀ Q_n u_n,    s = Σ ω_n ‖Q_n u_n‖²

and a decay λ of all parameters gives `w = (H + λI)⁻¹ g`; which of them decay, and to what, is said in `fitting.decay`.
Moments add: across blocks, episodes, folds, files and machines. Everything that is chosen or reported about a fit is
computed from them.

References
----------
Howard et al., ICRA 2009, equation (8).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from unconstrain.parallel import cut_blocks, map_shares
from unconstrain.storage import Kind, load_object, save_object

# λ relative to the mean eigenvalue of H. Rounding errors of g along directions where H is zero are then divided by
# enough to stay a millionth of the policy.
CLEAR_OF_ROUNDING = 1e-10


@dataclass
class Moments:
    """`H`, `g`, `s` and the counts behind them; local models have them stacked along leading axes.

    Parameters
    ----------
    H : ndarray of shape (..., P, P)
        Symmetric.
    g : ndarray of shape (..., P, K)
        K = 1, except for problems that share one H: the d dimensions of the action when nothing is projected.
    squares : ndarray of shape (...,)
        Sum s, in squared units of the action.
    weight : ndarray of shape (...,)
        `Σ ω_n`.
    n_samples : int
        How many samples were added.
    everywhere : Moments, optional
        Beside those of local models, the moments of the same features with every sample in full: what local models
        decay to is solved from them.
    """

    H: np.ndarray
    g: np.ndarray
    squares: np.ndarray
    weight: np.ndarray
    n_samples: int = 0
    everywhere: "Moments | None" = None

    @classmethod
    def zeros(cls, batch: tuple[int, ...], n_parameters: int, n_targets: int) -> "Moments":
        """Make the moments of no data.

        Parameters
        ----------
        batch : tuple of int
            Leading axes.
        n_parameters, n_targets : int
            P and K.

        Returns
        -------
        Moments
            Zeros.
        """
        return cls(
            H=np.zeros((*batch, n_parameters, n_parameters)),
            g=np.zeros((*batch, n_parameters, n_targets)),
            squares=np.zeros(batch),
            weight=np.zeros(batch),
        )

    def __add__(self, other: "Moments") -> "Moments":
        here, there = self.everywhere, other.everywhere
        return Moments(
            self.H + other.H,
            self.g + other.g,
            self.squares + other.squares,
            self.weight + other.weight,
            self.n_samples + other.n_samples,
            None if here is None or there is None else here + there,
        )

    def __getstate__(self) -> dict[str, Any]:
        # Of the symmetric H a triangle says everything, in files and on the way to other machines.
        P = self.H.shape[-1]
        return {
            "n_samples": self.n_samples,
            "triangle": self.H[..., *np.tril_indices(P)],
            "g": self.g,
            "squares": np.asarray(self.squares),
            "weight": np.asarray(self.weight),
            "everywhere": self.everywhere,
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.g, self.squares, self.weight = state["g"], state["squares"], state["weight"]
        self.n_samples, self.everywhere = int(state["n_samples"]), state["everywhere"]
        *batch, P, _ = self.g.shape
        triangle = state["triangle"]
        if triangle.shape != (*batch, P * (P + 1) // 2) or not (
            self.squares.shape == self.weight.shape == tuple(batch)
        ):
            raise ValueError("the shapes of moments do not go together")
        if self.everywhere is not None and self.everywhere.g.shape != self.g.shape[-2:]:
            raise ValueError("the shapes of moments do not go together")
        self.H = np.empty((*batch, P, P))
        rows, columns = np.tril_indices(P)
        self.H[..., rows, columns] = triangle
        self.H[..., columns, rows] = triangle

    @property
    def n_targets(self) -> int:
        """K."""
        return int(self.g.shape[-1])

    @staticmethod
    def sum(parts: Iterable["Moments"]) -> "Moments":
        """Add moments up.

        Parameters
        ----------
        parts : iterable of Moments
            At least one.

        Returns
        -------
        Moments
            Their sum.
        """
        first, *rest = parts
        total = first
        for part in rest:
            total = total + part
        return total

    def risk(self, w: np.ndarray) -> np.ndarray:
        """Compute the risk of candidates, `E(w) = s - 2 gᵀw + wᵀHw`, summed over samples.

        Parameters
        ----------
        w : ndarray of shape (..., P, L, K)
            L candidates.

        Returns
        -------
        ndarray of shape (..., L)
            Never below zero: what rounding leaves there is cut off.
        """
        *batch, P, L, K = w.shape
        Hw = (self.H @ w.reshape(*batch, P, L * K)).reshape(w.shape)
        error = np.einsum("...plk,...plk->...l", w, Hw - 2 * self.g[..., :, None, :])
        return np.maximum(error + self.squares[..., None], 0.0)

    def solve(self, alpha: float) -> np.ndarray:
        """Solve for `w = (H + λI)⁺ g` of least norm for one λ.

        Parameters
        ----------
        alpha : float
            Weight decay λ.

        Returns
        -------
        ndarray of shape (..., P, K)
            Parameters.

        Notes
        -----
        Where λ lifts H well clear of its rounding the equations are solved as they stand, at a tenth of the cost of
        the eigendecomposition that is needed otherwise, and for many λ.
        """
        P = self.H.shape[-1]
        mean_eigenvalue = np.trace(self.H, axis1=-2, axis2=-1) / P
        if np.all(alpha > CLEAR_OF_ROUNDING * mean_eigenvalue):
            return np.linalg.solve(self.H + alpha * np.eye(P), self.g)
        return self.decompose().solve([alpha])[..., 0, :]

    def decompose(self) -> "Spectrum":
        """Decompose H into eigenvectors, which solves for every λ at once.

        Returns
        -------
        Spectrum
            Of H and g.
        """
        if self.H.ndim == 2:
            values, vectors = np.linalg.eigh(self.H)
        else:
            stack = self.H.reshape(-1, *self.H.shape[-2:])
            values, vectors = np.empty(stack.shape[:2]), np.empty(stack.shape)

            def decompose(models: Sequence[slice]) -> None:
                for m in models:
                    values[m], vectors[m] = np.linalg.eigh(stack[m])

            map_shares(decompose, cut_blocks(len(stack), 8))
            values, vectors = values.reshape(self.H.shape[:-1]), vectors.reshape(self.H.shape)
        return Spectrum(values, vectors, vectors.swapaxes(-1, -2) @ self.g)


@dataclass(frozen=True)
class Spectrum:
    """`H = Q diag(values) Qᵀ` and `Qᵀg`: any λ costs one product from here.

    Parameters
    ----------
    values : ndarray of shape (..., P)
        Ascending.
    vectors : ndarray of shape (..., P, P)
        Q.
    along : ndarray of shape (..., P, K)
        `Qᵀg`.
    """

    values: np.ndarray
    vectors: np.ndarray
    along: np.ndarray

    @property
    def determined(self) -> np.ndarray:
        """Which eigenvectors the data say anything about, (..., P): those above the rounding of H.

        g lies in the range of H, so its part along all others is rounding, and left out it gives the
        minimum-norm solution for every λ, zero included.
        """
        floor = self.values.shape[-1] * np.finfo(np.float64).eps * self.values[..., -1:]
        return self.values > np.maximum(floor, 0.0)

    def solve(self, alphas: ArrayLike, toward: np.ndarray | None = None) -> np.ndarray:
        """Solve for `w = t + (H + λI)⁺ (g - Ht)` of least distance from t for several λ.

        Parameters
        ----------
        alphas : array_like of shape (L,)
            One λ for each.
        toward : ndarray of shape (P, L, K), optional
            Parameters t for each λ; by default zero.

        Returns
        -------
        ndarray of shape (..., P, L, K)
            Parameters for each λ.
        """
        alphas = np.asarray(alphas, dtype=np.float64)
        determined = self.determined[..., None]
        denominator = np.where(determined, self.values[..., None] + alphas, 1.0)
        if toward is None:
            scaled = self.along[..., :, None, :] * (determined / denominator)[..., None]
        else:
            P, L, K = toward.shape
            at = (self.vectors.swapaxes(-1, -2) @ toward.reshape(P, L * K)).reshape(
                *self.values.shape[:-1], P, L, K
            )
            pulled = self.along[..., :, None, :] + alphas[:, None] * at
            scaled = np.where(determined[..., None], pulled / denominator[..., None], at)
        *batch, P, L, K = scaled.shape
        return (self.vectors @ scaled.reshape(*batch, P, L * K)).reshape(scaled.shape)


def save(moments: Moments | Sequence[Moments | None], path: str | PathLike[str]) -> None:
    """Write moments to a file that `load` reads.

    Parameters
    ----------
    moments : Moments, or sequence of Moments or None
        One, or by fold as a policy's `moments_`.
    path : path
        An existing file is replaced.

    Raises
    ------
    UnconstrainError
        The place cannot be written to.
    """
    save_object(path, Kind.MOMENTS, moments if isinstance(moments, Moments) else list(moments))


def load(path: str | PathLike[str]) -> Moments | list[Moments | None]:
    """Read what `save` wrote.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    Moments, or list of Moments or None
        As they were given to `save`.

    Raises
    ------
    ArchiveError
        The file is missing, damaged, does not hold moments, or is from a newer release.
    """
    return load_object(path, Kind.MOMENTS, object, _check_moments)


def _check_moments(found: object) -> None:
    parts = found if isinstance(found, list) else [found]
    if not all(isinstance(part, Moments) or (part is None and part is not found) for part in parts):
        raise TypeError("it holds other things than moments")
