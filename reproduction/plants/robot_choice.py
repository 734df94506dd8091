"""The humanoid that an experiment is made with, as the user named it."""

import os
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

from reproduction.plants.humanoid import Humanoid, split_names


@dataclass(frozen=True)
class RobotChoice:
    """Names only, so that every process loads the robot itself; without a path, our own humanoid.

    Parameters
    ----------
    path : str or None
        Of the robot's file.
    lock, hands, feet : tuple of str
        As for `Humanoid.load`.
    """

    path: str | None = None
    lock: tuple[str, ...] = ()
    hands: tuple[str, ...] = ()
    feet: tuple[str, ...] = ()

    @classmethod
    def parse(
        cls,
        path: str | os.PathLike[str] | None = None,
        lock: str | Iterable[str] = (),
        hands: str | Iterable[str] = (),
        feet: str | Iterable[str] = (),
    ) -> "RobotChoice":
        """Understand what a command line gives: names in one string, with commas, or one by one."""
        path = None if path is None else os.fspath(path)
        return cls(path, split_names(lock), split_names(hands), split_names(feet))

    def load(self) -> Humanoid:
        """Load the robot, once in each process."""
        return _load(self)


OUR_OWN = RobotChoice()


@lru_cache(maxsize=1)
def _load(choice: RobotChoice) -> Humanoid:
    return Humanoid.load(choice.path, lock=choice.lock, hands=choice.hands, feet=choice.feet)
