"""Which humanoid an experiment is made with, as the user named it."""

import os
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

from reproduction.plants.humanoid import Humanoid, names


@dataclass(frozen=True)
class RobotChoice:
    """Names only, so that every process loads the robot itself. Without a path: the one shipped with the library."""

    path: str | None = None
    lock: tuple[str, ...] = ()
    hands: tuple[str, ...] = ()
    feet: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        path: str | os.PathLike[str] | None = None,
        lock: str | Iterable[str] = (),
        hands: str | Iterable[str] = (),
        feet: str | Iterable[str] = (),
    ) -> "RobotChoice":
        """From what a command line gives: names in one string, with commas, or one by one."""
        path = None if path is None else os.fspath(path)
        return cls(path, names(lock), names(hands), names(feet))

    def humanoid(self) -> Humanoid:
        """The robot, loaded once in each process."""
        return _loaded(self)


OUR_OWN = RobotChoice()


@lru_cache(maxsize=1)
def _loaded(choice: RobotChoice) -> Humanoid:
    return Humanoid.load(choice.path, lock=choice.lock, hands=choice.hands, feet=choice.feet)
