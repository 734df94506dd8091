"""The generalised eigenvalues of (H, G): how far each direction of the policy was seen.

`H z = λ G z` with `zᵀGz = 1`: z is a change of the policy of size one on the data's states, λ the share of its square
that the recordings show. `0 <= H <= G` puts λ in [0, 1]; 1 was seen whole, 0 never.

G may be singular (more parameters than states; normalised RBFs, whose sum is fixed): directions that do not change
the policy on any of the states are no directions of the policy there, and are left out. They are those below
`RELATIVE_CUTOFF` of G's largest eigenvalue. Rounding of H then moves λ by about `ε / RELATIVE_CUTOFF`, 2e-6.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from unconstrain.diagnostics.information import Information
from unconstrain.parallel import map_shares

RELATIVE_CUTOFF = 1e-10

THRESHOLD = 1e-3
"""Directions of which less than this share was seen count as undetermined."""


@dataclass(frozen=True)
class Directions:
    """Of one model: λ ascending (R,), and the directions Z (P, R) with `ZᵀGZ = I`, `ZᵀHZ = diag(λ)`."""

    seen: np.ndarray
    vectors: np.ndarray


def shares_seen(information: Information) -> list[np.ndarray]:
    """λ ascending, of every model: a list of arrays (R,)."""
    return _of_every_model(information, lambda S, T, copies: np.clip(np.linalg.eigvalsh(S), 0.0, 1.0))


def directions(information: Information) -> list[Directions]:
    """λ and their directions, of every model."""

    def solve(S: np.ndarray, T: np.ndarray, copies: int) -> Directions:
        values, vectors = np.linalg.eigh(S)
        Z = T @ vectors.reshape(copies, -1, len(S))
        return Directions(np.clip(values, 0.0, 1.0), Z.reshape(-1, len(S)))

    return _of_every_model(information, solve)


def _of_every_model(information: Information, solve) -> list:
    """`solve(S, T, copies)` for each model, with `TᵀGT = I` on the range of a block of G and `S = TᵀHT`."""
    copies = information.copies

    def one(H: np.ndarray, G: np.ndarray):
        sizes, Q = np.linalg.eigh(G)
        kept = sizes > RELATIVE_CUTOFF * max(sizes[-1], 0.0)
        T = Q[:, kept] / np.sqrt(sizes[kept])
        P = len(G)
        blocks = H.reshape(copies, P, copies, P).swapaxes(1, 2)
        S = (T.T @ blocks @ T).swapaxes(1, 2).reshape(copies * T.shape[1], -1)
        return solve((S + S.T) / 2, T, copies)

    def share(models: Sequence[int]) -> list:
        return [(m, one(information.moments.H[m], information.whole[m])) for m in models]

    found = [pair for part in map_shares(share, range(len(information))) for pair in part]
    return [result for _, result in sorted(found, key=lambda pair: pair[0])]
