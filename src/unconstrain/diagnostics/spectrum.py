"""The generalised eigenvalues of (H, G): which share of each direction of the policy was observed.

`H z = λ G z` with `zᵀGz = 1`: z is a change of the policy of size one on the data's states, λ the share of its square
that the recordings show. `0 <= H <= G` puts λ in [0, 1]: 1 was observed in full, 0 not at all.

G may be singular (more parameters than states; normalised RBFs, whose sum is fixed). Directions that do not change the
policy on any of the states are no directions of the policy there, and are left out: those below `RELATIVE_CUTOFF` of
G's largest eigenvalue. Rounding of H then moves λ by about `ε / RELATIVE_CUTOFF`, 2e-6.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from unconstrain.diagnostics.information import Information
from unconstrain.parallel import map_shares

T = TypeVar("T")

RELATIVE_CUTOFF = 1e-10

THRESHOLD = 1e-3
"""Directions of which a smaller share was observed count as undetermined."""


@dataclass(frozen=True)
class Directions:
    """The directions of one model, and the share of each that was observed.

    Parameters
    ----------
    shares : ndarray of shape (R,)
        Shares λ, ascending.
    vectors : ndarray of shape (P, R)
        Z, with `ZᵀGZ = I` and `ZᵀHZ = diag(λ)`.
    """

    shares: np.ndarray
    vectors: np.ndarray


def compute_shares(information: Information) -> list[np.ndarray]:
    """Compute the share of each direction that was observed.

    Parameters
    ----------
    information : Information
        Of S models.

    Returns
    -------
    list of ndarray of shape (R,)
        Shares λ of each model, ascending.
    """

    def solve(S: np.ndarray, T: np.ndarray, copies: int) -> np.ndarray:
        return np.clip(np.linalg.eigvalsh(S), 0.0, 1.0)

    return _solve_each(information, solve)


def compute_directions(information: Information) -> list[Directions]:
    """Compute the directions of a policy and the share of each that was observed.

    Parameters
    ----------
    information : Information
        Of S models.

    Returns
    -------
    list of Directions
        One for each model.
    """

    def solve(S: np.ndarray, T: np.ndarray, copies: int) -> Directions:
        values, vectors = np.linalg.eigh(S)
        Z = T @ vectors.reshape(copies, -1, len(S))
        return Directions(np.clip(values, 0.0, 1.0), Z.reshape(-1, len(S)))

    return _solve_each(information, solve)


def _solve_each(information: Information, solve: Callable[[np.ndarray, np.ndarray, int], T]) -> list[T]:
    """Call `solve(S, T, copies)` for each model, with `TᵀGT = I` on the range of a block of G and `S = TᵀHT`."""
    copies, observed = information.copies, information.observed

    def solve_one(H: np.ndarray, G: np.ndarray) -> T:
        sizes, Q = np.linalg.eigh(G)
        kept = sizes > RELATIVE_CUTOFF * max(sizes[-1], 0.0)
        whitening = Q[:, kept] / np.sqrt(sizes[kept])
        P = len(G)
        blocks = H.reshape(copies, P, copies, P).swapaxes(1, 2)
        S = (whitening.T @ blocks @ whitening).swapaxes(1, 2).reshape(copies * whitening.shape[1], -1)
        return solve((S + S.T) / 2, whitening, copies)

    def solve_share(models: Sequence[int]) -> list[tuple[int, T]]:
        return [(m, solve_one(observed[m], information.whole[m])) for m in models]

    results = [pair for part in map_shares(solve_share, range(len(information))) for pair in part]
    return [result for _, result in sorted(results, key=lambda pair: pair[0])]
