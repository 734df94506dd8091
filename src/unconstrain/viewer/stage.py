"""What all parts of the page share: what is shown, of which policy, from which start."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from unconstrain.policies.base import Policy
from unconstrain.stopping import Movement
from unconstrain.viewer.coordinates import Axes, Coordinates
from unconstrain.viewer.frame import Frame
from unconstrain.viewer.samples import Shown

Array = NDArray[np.float64]

LEARNT, DIRECT = "learnt policy", "ordinary regression"


class Part(Protocol):
    """Something in the scene that is drawn anew when what is shown changes."""

    def draw(self, stage: "Stage") -> None:
        """Draw it in place of what was drawn before."""
        ...


@dataclass
class Stage:
    """What is shown.

    Parameters
    ----------
    server : viser.ViserServer
        Where it is drawn.
    policies : mapping from str to Policy
        The learnt one first.
    shown : Shown
        The recorded samples.
    axes : Axes
        All numbers that can be shown.
    scenery : tuple of Coordinates and Frame
        Those that are shown, and the frame of the scene. They change together, while other threads draw.
    start : ndarray of shape (n,)
        Of the rollout.
    seconds : float
        How long a rollout lasts.
    interval : float
        Seconds between recorded samples.
    under : callable, optional
        From states (S, n) to rows (S, k, d) of a constraint under which rollouts may be.

    Attributes
    ----------
    name : str
        Which of the policies is shown.
    movement : Movement or None
        The newest rollout.
    updates : int
        How many rollouts there were.
    """

    server: Any
    policies: Mapping[str, Policy]
    shown: Shown
    axes: Axes
    scenery: tuple[Coordinates, Frame]
    start: Array
    seconds: float
    interval: float
    under: Callable[[Array], Array] | None = None
    name: str = LEARNT
    movement: Movement | None = None
    updates: int = 0
    listeners: list[Callable[[Movement], None]] = field(default_factory=list)

    @property
    def coordinates(self) -> Coordinates:
        """What is shown of states."""
        return self.scenery[0]

    @property
    def frame(self) -> Frame:
        """The frame of the scene."""
        return self.scenery[1]

    @property
    def policy(self) -> Policy:
        """The policy that is shown."""
        return self.policies[self.name]

    @property
    def states(self) -> Array:
        """The recorded states that are shown, (N, n)."""
        return self.shown.demos.states

    def places(self, X: Array, lift: float = 0.0) -> Array:
        """Return where states (N, n) are in the scene, (N, 3); see `Frame.to_scene`."""
        coordinates, frame = self.scenery
        return frame.to_scene(coordinates.place(X), lift)

    def set_movement(self, movement: Movement) -> None:
        """Keep a rollout, and tell all that wait for one.

        Parameters
        ----------
        movement : Movement
            The newest.
        """
        self.movement = movement
        self.updates += 1
        for listener in self.listeners:
            listener(movement)
