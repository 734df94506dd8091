"""What a method is given, and what it gives back."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from unconstrain.demonstrations import Demonstrations
from unconstrain.policies import LocallyLinearPolicy
from unconstrain.policies.linear import LinearPolicy

Array = NDArray[np.float64]

Velocity = Callable[[Array], Array]
"""From states (N, n) to actions (N, n)."""


class Recorded(NamedTuple):
    """What a method learns from.

    Attributes
    ----------
    demos : Demonstrations
        States, noisy actions, episodes, times; true projections, which only those that are told look at.
    goal : ndarray of shape (n,) or None
        Where all movements lead; None where there is no such place.
    make_model : callable
        Makes the model that our own policies have here.
    """

    demos: Demonstrations
    goal: Array | None = None
    make_model: Callable[[], LinearPolicy] = LocallyLinearPolicy


class Learnt(Protocol):
    """What a method has learnt."""

    @property
    def velocity(self) -> Velocity | None:
        """The action for every state; None where there is none."""

    def follow(self, starts: Array, duration: float, dt: float) -> Array:
        """Move freely from starts (S, n): paths (S, T, n)."""


@dataclass(frozen=True)
class Field:
    """A method that has an action for every state."""

    velocity: Velocity

    def follow(self, starts: Array, duration: float, dt: float) -> Array:
        """Follow it by Euler's method."""
        paths = [np.array(starts)]
        for _ in range(round(duration / dt)):
            paths.append(paths[-1] + dt * self.velocity(paths[-1]))
        return np.stack(paths, axis=1)
