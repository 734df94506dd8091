"""Where episodes begin in arrays that hold them one after the other: by their ends, their lengths, or by flags."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.recordings.formats.trees import Leaf, Odd

ENDS = frozenset({"episode_ends", "episode_end", "ep_ends", "traj_ends", "trajectory_ends"})
"""Arrays of the number of samples up to the end of each episode, as Diffusion Policy writes them."""

LENGTHS = frozenset(
    {"episode_lengths", "episode_length", "ep_lengths", "ep_len", "traj_lengths", "traj_lens"}
)
"""Arrays of the number of samples of each episode."""

LAST = frozenset({
    "done", "dones", "terminal", "terminals", "terminated", "termination", "terminations", "timeout", "timeouts",
    "truncated", "truncation", "truncations", "is_last", "is_terminal",
})  # fmt: skip
"""Flags of the last sample of an episode, as D4RL and Gym write them."""

FIRST = frozenset({"episode_start", "episode_starts", "is_first"})
"""Flags of the first sample of an episode."""

MOST_FLAGGED = 0.2
"""Share of flagged samples from which a flag says something else than where episodes end."""

Array = NDArray[Any]


@dataclass(frozen=True)
class Borders:
    """What may say where episodes begin.

    Parameters
    ----------
    kind : {"ends", "lengths", "first", "last"}
    paths : tuple of str
        The arrays that say it.
    leaves : tuple of Leaf
        The same arrays.
    """

    kind: str
    paths: tuple[str, ...]
    leaves: tuple[Leaf, ...]

    @property
    def text(self) -> str:
        """How episodes are told apart, as a sentence goes on."""
        how = {
            "ends": "which counts the samples up to the end of each",
            "lengths": "which counts the samples of each",
            "first": "which flags the first sample of each",
            "last": "which flags the last sample of each",
        }
        verb = how[self.kind] if len(self.paths) == 1 else how[self.kind].replace("flags", "flag")
        return f"{' or '.join(self.paths)}, {verb}"

    def episodes(self, fetch: Callable[[Leaf], Array], length: int) -> NDArray[np.int64] | None:
        """Return the number of the episode of each sample.

        Parameters
        ----------
        fetch : callable
            Reads an array.
        length : int
            How many samples there are.

        Returns
        -------
        ndarray of shape (length,) or None
            None where the arrays say no such thing.
        """
        arrays = [np.asarray(fetch(leaf)).reshape(-1).astype(np.float64) for leaf in self.leaves]
        begins = np.zeros(length, dtype=bool)
        if self.kind in ("ends", "lengths"):
            ends = arrays[0] if self.kind == "ends" else np.cumsum(arrays[0])
            if not (np.all(np.diff(ends, prepend=0) > 0) and ends[-1] == length):
                return None
            begins[ends[:-1].astype(np.int64)] = True
        else:
            flagged = np.any([each != 0 for each in arrays], axis=0)
            if not flagged.any() or float(np.mean(flagged)) > MOST_FLAGGED:
                return None
            # A flag that stays for some samples, as that of a success does, ends one episode.
            first = self.kind == "first"
            begins[1:] = flagged[1:] & ~flagged[:-1] if first else flagged[:-1] & ~flagged[1:]
        return np.cumsum(begins, dtype=np.int64)


def find_borders(arrays: Mapping[str, Leaf | Odd], length: int, separator: str) -> list[Borders]:
    """Find what may say where episodes begin, the surest first.

    Parameters
    ----------
    arrays : mapping of str to Leaf or Odd
        By path.
    length : int
        How many samples there are.
    separator : str
        Of paths.

    Returns
    -------
    list of Borders
    """
    found: dict[str, list[tuple[str, Leaf]]] = {}
    for path, leaf in arrays.items():
        name = path.rsplit(separator, 1)[-1].strip().lower()
        if not isinstance(leaf, Leaf) or leaf.kind.kind not in "biuf" or not leaf.size:
            continue
        for kind, names in (("ends", ENDS), ("lengths", LENGTHS), ("first", FIRST), ("last", LAST)):
            if name in names and (kind in ("ends", "lengths") or leaf.size == length):
                found.setdefault(kind, []).append((path, leaf))
    return [
        Borders(kind, tuple(path for path, _ in several), tuple(leaf for _, leaf in several))
        for kind in ("ends", "lengths", "first", "last")
        if (several := found.get(kind, [])[: None if kind == "last" else 1])
    ]
