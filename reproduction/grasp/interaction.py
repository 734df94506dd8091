"""The grasp, to be interfered with: a policy moves the robot while what is in its way is changed."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from reproduction.grasp.figures import stage
from reproduction.plants.barrier import Barrier, make_central
from reproduction.plants.grasping import FREQUENCY, Demonstrator, constrain
from reproduction.plants.scene import Scene
from reproduction.plants.whole_body import WholeBody
from unconstrain.errors import PolicyError, UnconstrainError
from unconstrain.simulation import Policy, simulate

Array = NDArray[np.float64]

GAP, MIDDLE, NOTHING = "a barrier with a gap", "a barrier in the middle", "nothing"
"""What may be in the way: the first is what was learnt from, the second was never recorded."""

START_WIDTH = 0.25
"""Of the gap, in metres: the mean of those learnt from."""

FORESEEN, FORESEEN_RATE = 2.4, 25.0
"""For how many seconds the hands' way is foreseen, and in how many steps a second."""


@dataclass(frozen=True)
class InTheWay:
    """What is in the way.

    Parameters
    ----------
    kind : str
        `GAP`, `MIDDLE` or `NOTHING`.
    width : float
        Of the gap, or of the barrier in the middle, in metres.
    aside : float
        How far either is moved to the left, in metres.
    """

    kind: str = GAP
    width: float = START_WIDTH
    aside: float = 0.0


class Interaction:
    """A robot led by a policy over its hands' positions, and a barrier that can be changed at any time.

    Parameters
    ----------
    demonstrator : Demonstrator
        Whose robot and scene are shown.
    policies : mapping from str to policy
        Objects with ``predict(X)``, or callables ``X -> U``, from hand positions (N, 6) to hand velocities (N, 6), by
        name; the first leads.
    random_state : int, Generator or None
        For the postures that `restart` draws.

    Raises
    ------
    PolicyError
        A policy is not over six states.

    Attributes
    ----------
    in_the_way : InTheWay
        Changed by `change`.
    body : WholeBody
        The robot; another one after `restart`.
    policy : str
        The name of the one that leads.
    seconds : float
        Since the start.
    held : ndarray of shape (2,), bool
        Which hand the barrier held in the last step.
    """

    def __init__(
        self,
        demonstrator: Demonstrator,
        policies: Mapping[str, Policy],
        random_state: int | np.random.Generator | None = 0,
    ):
        self.demonstrator = demonstrator
        for name, policy in policies.items():
            known = getattr(policy, "n_features_in_", 6)
            if known != 6:
                raise PolicyError(
                    f"{name} was learnt over {known} states, and the grasp is led by a policy over six, the positions "
                    "of both hands: give one that was learnt from such"
                )
        self.policies = {name: _compile(policy) for name, policy in policies.items()}
        self.policy = next(iter(self.policies))
        self.model = stage(demonstrator)
        self.in_the_way = InTheWay()
        self._rng = np.random.default_rng(random_state)
        self.body = WholeBody(demonstrator.humanoid, self.model)
        self.body.stand(demonstrator.humanoid.home)
        self.seconds, self.held = 0.0, np.zeros(2, dtype=bool)

    @property
    def scene(self) -> Scene:
        """Where table, ball and barrier are."""
        return self.demonstrator.scene

    @property
    def obstacle(self) -> Barrier | None:
        """The barrier as it stands now, or None."""
        way, scene = self.in_the_way, self.scene
        if way.kind == NOTHING:
            return None
        if way.kind == GAP:
            return scene.with_gap([way.width], centre=way.aside)
        middle = make_central(
            1, scene.origin[0] + scene.barrier_x, scene.table_top,
            thickness=scene.thickness, width=way.width, height=scene.height,
        )  # fmt: skip
        moved = np.array([0.0, way.aside, 0.0])
        return Barrier(middle.low + moved, middle.high + moved)

    def change(self, **changes: str | float) -> InTheWay:
        """Change what is in the way.

        Parameters
        ----------
        **changes : str or float
            `kind`, `width` and `aside` of `InTheWay`; widths and places beyond the table are brought back to its edge.

        Returns
        -------
        InTheWay
            As it is now.

        Raises
        ------
        UnconstrainError
            There is no such kind.
        """
        wanted, span = replace(self.in_the_way, **changes), self.scene.span  # type: ignore[arg-type]
        if wanted.kind not in (GAP, MIDDLE, NOTHING):
            raise UnconstrainError(f"{wanted.kind!r} cannot be in the way: give {GAP}, {MIDDLE} or {NOTHING}")
        width = float(np.clip(wanted.width, 0.0, span))
        aside = float(np.clip(wanted.aside, -span / 2, span / 2))
        self.in_the_way = replace(wanted, width=width, aside=aside)
        return self.in_the_way

    def restart(self) -> None:
        """Stand in another random posture, before the barrier."""
        self.body = self.demonstrator.draw_starts(1, self._rng, self.model)[0]
        self.seconds, self.held = 0.0, np.zeros(2, dtype=bool)

    def step(self) -> float:
        """Move for one sample's time, under the barrier as it stands now, and return the faster hand's speed in m/s."""
        recording = self.demonstrator.record(
            self.obstacle, [self.body], policy=self.policies[self.policy], duration=1 / FREQUENCY
        )
        self.seconds += 1 / FREQUENCY
        self.held = recording.blocked[-1]
        return float(np.linalg.norm(recording.demonstrations.actions[-1].reshape(2, 3), axis=1).max())

    def foresee(self) -> tuple[Array, NDArray[np.bool_]]:
        """Follow the policy from where the hands are, as if the body could always follow.

        Returns
        -------
        ways : ndarray of shape (T, 2, 3)
            Of the hands, in metres.
        held : ndarray of shape (T, 2), bool
            Where the barrier holds a hand.
        """
        obstacle, held = self.obstacle, list[NDArray[np.bool_]]()

        def project(sample: int, X: Array, wanted: Array) -> Array:
            N, stopped = constrain(obstacle, X, wanted)
            held.append(stopped[0])
            return N

        steps = round(FORESEEN * FORESEEN_RATE)
        policy = self.policies[self.policy]
        movement = simulate(policy, self.body.hands.reshape(1, 6), steps, 1 / FORESEEN_RATE, project=project)
        return movement.states.reshape(-1, 2, 3), np.stack(held[: len(movement)])

    @property
    def to_go(self) -> float:
        """How far the farther hand is from where it grasps, in metres."""
        away = self.body.hands - self.scene.grasp.reshape(2, 3)
        return float(np.linalg.norm(away, axis=1).max())


def _compile(policy: Policy) -> Policy:
    """Take the compiled step of a policy that has one: a single state at a time is what it is fast for."""
    try:
        step = policy.compile()  # type: ignore[union-attr]
    except (AttributeError, PolicyError):
        return policy
    return lambda X: step(X)
