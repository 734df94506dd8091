"""Ways to spread a pass over a cluster, and what each takes: ours, what it was, and what it might be."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from benchmarks.far.costs import Costs
from benchmarks.far.measured import ROW_BYTES, Machine, measure
from benchmarks.far.simulation import Outcome, simulate
from unconstrain.scaling.dividing import LEAST_ROWS, divide, rows_of_part
from unconstrain.scaling.tree import Tree, plant

GROUP_ROWS = 1_000_000
"""Rows of a row group, as Parquet is usually written."""

FILE_BYTES, FILE_SENT = 1e9, 220
"""Of a file: its size, assumed, and what workers are told of it, measured."""

NETWORK, STORAGE, STORE = 10e9 / 8, 1e9, 100e9
"""Assumed, bytes a second: between two machines, from storage to one worker, and from it to all of them together."""

DELAY, SPREAD = 5e-4, 0.1
"""Assumed: seconds that a message takes, and by what share times of parts vary."""

MESSAGE = 2e-5
"""Seconds that the event loop and TCP take for a message. Measured: with these, 2,000 parts on two workers cost the
scheduler 0.30 ms a task here, as they do one in a process of its own."""

UNKNOWN = 48
"""Bytes that Dask takes for the size of an object that does not say it."""


@dataclass(frozen=True)
class Design:
    """A way to spread a pass.

    Parameters
    ----------
    name : str
    folds : int
        Five with ``alpha="cv"``, one with a number.
    parts_per_worker : int, optional
        How many parts a worker gets; by default as `distributed.fit` decides.
    arity : int
        How many sums are added in a task.
    one_by_one : bool
        Whether each task is sent in a message of its own.
    says_sizes : bool
        Whether Dask knows how large sums are.
    digits : float
        Bytes of a number on its way, as a share of those of float64.
    """

    name: str
    folds: int = 5
    parts_per_worker: int | None = None
    arity: int = 2
    one_by_one: bool = False
    says_sizes: bool = True
    digits: float = 1.0


OURS = Design("ours")
DESIGNS = (
    Design(
        "before: 4 parts a worker, tasks one by one, sizes unknown", 5, 4, one_by_one=True, says_sizes=False
    ),
    Design("4 parts a worker, sizes unknown", 5, 4, says_sizes=False),
    Design("4 parts a worker", 5, 4),
    OURS,
    Design("16 parts a worker", 5, 16),
    Design("eight sums added at a time", arity=8),
    Design("float32 on the way", digits=0.5),
    Design("one fold (λ a number)", folds=1),
)


@dataclass(frozen=True)
class Rows:
    """Rows of files with row groups of one size, as far as dividing them is concerned."""

    n_rows: int
    whole_episodes_for: None = None
    relabels: bool = False
    is_along_episodes: bool = False

    @property
    def row_groups(self) -> tuple[int, ...]:
        return _groups(self.n_rows)


@cache
def _groups(n_rows: int) -> tuple[int, ...]:
    return (GROUP_ROWS,) * (n_rows // GROUP_ROWS)


def costs_of(
    machine: Machine, P: int, n_rows: int, n_workers: int, design: Design, slower: float = 1.0
) -> Costs:
    """Put together what a pass costs; rows take `slower` times as long as by the inconsistency."""
    model = machine.models[P]
    packed = design.folds * model.packed * design.digits
    files = max(n_rows * ROW_BYTES / FILE_BYTES, 1)
    return Costs(
        row=machine.decoding + model.row * slower,
        row_bytes=ROW_BYTES,
        storage=min(STORAGE, STORE / n_workers),
        result=design.folds * model.in_memory if design.says_sizes else UNKNOWN,
        packed=packed,
        packing=design.folds * model.packing,
        adding=design.folds * model.adding,
        setup=files * FILE_SENT + 8 * P,
        network=NETWORK,
        delay=DELAY,
        message=MESSAGE,
        spread=SPREAD,
    )


def plan(n_rows: int, n_workers: int, design: Design) -> tuple[Tree, dict[Any, int]]:
    """Plant the tasks of a pass as `distributed.fit` does; return them, and the rows of each part."""
    source: Any = Rows(n_rows)
    if design.parts_per_worker is None:
        wanted = rows_of_part(source, n_workers)
    else:
        wanted = -(-n_rows // (design.parts_per_worker * n_workers))
    parts = list(divide(source, max(LEAST_ROWS, wanted), None))
    grow: Callable[..., Tree] = plant if design.arity == 2 else _bushy(design.arity)
    tree = grow((_nothing,), parts, _nothing, _nothing)
    return tree, {key: part.stop - part.start for key, part in zip(tree.parts, parts, strict=True)}


@cache
def carry_out(P: int, n_rows: int, n_workers: int, design: Design = OURS, slower: float = 1.0) -> Outcome:
    """Simulate a pass."""
    costs = costs_of(measure(), P, n_rows, n_workers, design, slower)
    return simulate(*plan(n_rows, n_workers, design), n_workers, costs, one_by_one=design.one_by_one)


def _bushy(arity: int) -> Callable[..., Tree]:
    """Return what plants a tree in which so many sums are added in a task."""

    def grow(setup: tuple, parts: Sequence[Any], sum_of_part: Any, sum_of_several: Any) -> Tree:
        tree = plant(setup, parts, sum_of_part, sum_of_several)
        tasks = {key: task for key, task in tree.tasks.items() if not key[0].startswith("sum_of_two")}
        level = list(tree.parts)
        while len(level) > 1:
            groups = [level[i : i + arity] for i in range(0, len(level), arity)]
            level = []
            for group in groups:
                key = (f"sum_of_several-{tree.parts[0][0]}", len(tasks))
                tasks[key] = (sum_of_several, *group)
                level.append(key)
        return Tree(tasks, tree.parts, level[0])

    return grow


def _nothing(*_: Any) -> None:
    """Stand for what tasks do, which simulated workers only take time for."""
