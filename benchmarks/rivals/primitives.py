"""Dynamic movement primitives (DMP): a spring to the goal, and a force that is a function of time.

The package is `movement_primitives`. A movement is imitated by itself there. Of several movements the weights are
averaged, which is least squares over all of them, since all have the same basis in time relative to their length.

References
----------
A. J. Ijspeert, J. Nakanishi, H. Hoffmann, P. Pastor, S. Schaal, *Dynamical Movement Primitives: Learning Attractor
Models for Motor Behaviors*, Neural Computation 25(2), 2013.
"""

from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np

from benchmarks.rivals.learnt import Array, Recorded, Velocity
from unconstrain.errors import UnconstrainError

NEEDS = ("movement_primitives", "pytransform3d")

SAMPLES = 200
"""Of each movement, evenly in time."""


@dataclass(frozen=True)
class Primitive:
    """A fitted DMP. It has no action for a state: what it does there depends on when it began, and where.

    Attributes
    ----------
    weights : ndarray of shape (n, K)
        Of the force.
    goal : ndarray of shape (n,)
    smooth : bool
        Whether forces are scaled smoothly (Pastor et al., 2009).
    """

    weights: Array
    goal: Array
    smooth: bool
    velocity: Velocity | None = None

    def follow(self, starts: Array, duration: float, dt: float) -> Array:
        """Move to the goal within the duration, from rest at each start."""
        paths = []
        for start in starts:
            dmp = make(self.weights.shape, duration, dt, self.smooth)
            dmp.forcing_term.weights_[:] = self.weights
            dmp.configure(start_y=start, goal_y=self.goal)
            paths.append(dmp.open_loop()[1])
        return np.stack(paths)


def check_installed() -> None:
    """Raise `UnconstrainError` where the package is missing."""
    if any(find_spec(name) is None for name in NEEDS):
        raise UnconstrainError(f"DMP needs packages that are not installed: pip install {' '.join(NEEDS)}")


def make(shape: tuple[int, ...], duration: float, dt: float, smooth: bool) -> Any:
    """Make a DMP of n dimensions and K weights in each."""
    from movement_primitives.dmp import DMP

    n, weights = shape
    return DMP(n, execution_time=duration, dt=dt, n_weights_per_dim=weights, smooth_scaling=smooth)


def learn(recorded: Recorded, option: tuple[int, bool]) -> Primitive | None:
    """Imitate the movements, with so many weights and smoothly scaled or not; None where there is no goal."""
    if recorded.goal is None:
        return None
    check_installed()
    demos, (weights, smooth) = recorded.demos, option
    assert demos.time is not None
    found = []
    for episode in np.unique(demos.episodes):
        own = demos.episodes == episode
        t, X = demos.time[own] - demos.time[own][0], demos.states[own]
        even = np.linspace(0.0, t[-1], SAMPLES)
        Y = np.stack([np.interp(even, t, x) for x in X.T], axis=1)
        dmp = make((X.shape[1], weights), t[-1], even[1], smooth)
        dmp.imitate(even, Y)
        found.append(dmp.forcing_term.weights_.copy())
    return Primitive(np.mean(found, axis=0), recorded.goal, smooth)
