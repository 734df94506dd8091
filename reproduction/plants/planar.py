"""Arms of revolute joints in a plane: the smallest plants with task coordinates to constrain."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class PlanarArm:
    """Links in a chain, joint angles relative to the link before: ``θ_i = Σ_{j<=i} q_j``.

    Parameters
    ----------
    lengths : tuple of float
        Of the links, in metres.
    """

    lengths: tuple[float, ...] = (1.0, 1.0)

    def pose(self, Q: ArrayLike) -> NDArray[np.float64]:
        """Compute the hand's x and y (m) and its orientation (rad), (N, 3), at joint angles Q (N, d) in radians."""
        turned = np.cumsum(np.asarray(Q, dtype=np.float64), axis=1)
        reach = np.asarray(self.lengths)
        return np.stack([np.cos(turned) @ reach, np.sin(turned) @ reach, turned[:, -1]], axis=1)

    def jacobian(self, Q: ArrayLike) -> NDArray[np.float64]:
        """Compute the derivatives of `pose`, (N, 3, d): joint j moves all links from j on."""
        turned = np.cumsum(np.asarray(Q, dtype=np.float64), axis=1)
        reach = np.asarray(self.lengths)

        def beyond(each: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.cumsum(each[:, ::-1], axis=1)[:, ::-1]

        x, y = beyond(-np.sin(turned) * reach), beyond(np.cos(turned) * reach)
        return np.stack([x, y, np.ones_like(x)], axis=1)
