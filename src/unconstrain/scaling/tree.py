"""The tasks of a pass on a cluster, as Dask takes them: parts are summed, and neighbours added until one is left."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any
from uuid import uuid4

Key = tuple[str, int]


@dataclass(frozen=True)
class Tree:
    """Tasks, each under its key.

    Parameters
    ----------
    tasks : dict
        What Dask calls a graph: by key a tuple of a function and its arguments, which may be keys of other tasks.
    parts : tuple of key
        Of the tasks that sum a part each, in the order of the parts.
    total : key
        Of the task whose result is the sum of all.
    """

    tasks: dict[Key, tuple[Any, ...]]
    parts: tuple[Key, ...]
    total: Key


def plant(
    setup: tuple[Any, ...],
    parts: Sequence[Any],
    sum_of_part: Callable[[Any, Any], Any],
    sum_of_two: Callable[[Any, Any], Any],
) -> Tree:
    """Make the tasks of a pass.

    All of them go to the scheduler in one message. Sent one by one they cost it more than twice the time, and it is the
    scheduler that limits how many workers can be kept busy.

    Parameters
    ----------
    setup : tuple
        A function and its arguments: a task whose result every part needs. It is a task, and not scattered data, so
        that what a lost worker held of it can be made again.
    parts : sequence
        At least one.
    sum_of_part : callable
        Given the setup and a part, returns its sum.
    sum_of_two : callable
        Given two sums, returns theirs.

    Returns
    -------
    Tree
        Under keys that no other pass has.
    """
    run = uuid4().hex
    begun = (f"setup-{run}", 0)
    tasks: dict[Key, tuple[Any, ...]] = {begun: setup}
    leaves = [(f"sum_of_part-{run}", i) for i in range(len(parts))]
    tasks.update({key: (sum_of_part, begun, part) for key, part in zip(leaves, parts, strict=True)})
    level = leaves
    while len(level) > 1:
        pairs = []
        for one, other in zip(level[::2], level[1::2], strict=False):
            key = (f"sum_of_two-{run}", len(tasks))
            tasks[key] = (sum_of_two, one, other)
            pairs.append(key)
        level = pairs + level[len(level) - len(level) % 2 :]
    return Tree(tasks, tuple(leaves), level[0])
