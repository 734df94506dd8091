"""Runs that have ended, kept in a file, so that a fit that was interrupted goes on from there."""

import os
from dataclasses import dataclass
from typing import Any

from unconstrain.errors import ArchiveError
from unconstrain.networks.inferring import Candidate
from unconstrain.storage import Kind, load_object, save_object


@dataclass
class Checkpoint:
    """How far a fit has come.

    Parameters
    ----------
    path : path or None
        The file; None for none.
    belongs_to : dict of str to str
        What is fitted to what.
    members : list of dict of str to Candidate
        The runs that have ended, by name, of each member.
    """

    path: str | os.PathLike[str] | None
    belongs_to: dict[str, str]
    members: list[dict[str, Candidate]]

    @classmethod
    def open(
        cls, path: str | os.PathLike[str] | None, belongs_to: dict[str, str], n_members: int
    ) -> "Checkpoint":
        """Read a checkpoint, or begin one.

        Parameters
        ----------
        path : path or None
            The file; None for none.
        belongs_to : dict of str to str
            What is fitted to what.
        n_members : int
            How many members there are.

        Returns
        -------
        Checkpoint
            Empty where there is no file.

        Raises
        ------
        ArchiveError
            The file is no checkpoint, damaged, or that of another fit.
        """
        blank = cls(path, belongs_to, [{} for _ in range(n_members)])
        if path is None or not os.path.exists(path):
            return blank
        found = load_object(path, Kind.CHECKPOINT, dict, _check)
        changed = [what for what, value in belongs_to.items() if found["belongs_to"].get(what) != value]
        if changed:
            raise ArchiveError(
                f"{os.fspath(path)} belongs to a fit with other {' and '.join(changed)}: delete it to start anew, "
                "or give another path"
            )
        return cls(path, belongs_to, found["members"])

    def write(self) -> None:
        """Write the file, where there is to be one.

        Raises
        ------
        UnconstrainError
            The place cannot be written to.
        """
        if self.path is not None:
            value = {"belongs_to": self.belongs_to, "members": self.members}
            save_object(self.path, Kind.CHECKPOINT, value, _check)


def _check(found: dict[str, Any]) -> None:
    """Raise something where a file does not hold what `write` writes."""
    if not all(isinstance(each, Candidate) for member in found["members"] for each in member.values()):
        raise TypeError("it holds no runs of networks")
    if not isinstance(found["belongs_to"], dict):
        raise TypeError("it does not say what it belongs to")
