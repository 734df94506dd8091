"""Whether every start leads to the goal: handwriting (LASA), plain and stabilised."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from reproduction.adaptive.recorded import SHOWN, join, list_files, load_demonstrations
from reproduction.markdown import table
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import UnconstrainError
from unconstrain.plot.colors import DIRECT, LEARNT, RECORDED, TRUE
from unconstrain.policies import LocallyLinearPolicy
from unconstrain.policies.base import Policy
from unconstrain.stability import Stability

TUNED_ON = ("Angle", "BendedLine", "Snake", "Sshape")
"""Shapes that the constants of `unconstrain.stability` were chosen on."""

GRID, INFLATED = 15, 1.1
"""Starts along each side of the box that holds all demonstrations, and by how much that is larger."""

PATHS = 6
"""Movements that are drawn along each side of that box."""

ARRIVED = 0.01
"""Share of the box's longer side within which a movement has to end."""

FAR = 0.1
"""Share of that side beyond which a state is far from the goal."""

DT, LONGEST = 0.02, 10.0
"""Seconds a step, and how long a movement may take, in durations of the longest demonstration."""


@dataclass(frozen=True)
class Row:
    """What was found of a shape.

    Attributes
    ----------
    shape : str
        Its name.
    starts : int
        How many movements were begun.
    plain, stable : float
        Share of them that end at the goal.
    off : float
        Half of the plain movements end farther from the goal than this, mm.
    latest : float
        When the last of the stabilised movements arrives, in durations of the longest demonstration.
    plain_error, stable_error : float
        Root mean square of the velocity's error on held-out demonstrations, mm/s.
    change, far_change : float
        Root mean square of what stabilising changes of the velocity there, mm/s; and where that is farther from the
        goal than 10 % of the box's longer side.
    speed : float
        Root mean square of the velocity there, mm/s.
    rises : int
        Steps over which the Lyapunov function rose.
    """

    shape: str
    starts: int
    plain: float
    stable: float
    off: float
    latest: float
    plain_error: float
    stable_error: float
    change: float
    far_change: float
    speed: float
    rises: int


def measure(folder: Path, shape: str, repetition: int) -> Row:
    """Learn a shape from four of its demonstrations, and follow the policy from everywhere.

    Parameters
    ----------
    folder : Path
        That holds `handwriting/*.mat`.
    shape : str
        Name of the file, without its suffix.
    repetition : int
        Which four are drawn.

    Returns
    -------
    Row
        What was found.

    Raises
    ------
    UnconstrainError
        The file is missing or damaged.
    """
    learnt = _learn(folder, shape, repetition)
    plain, stable, held_out = learnt.plain, learnt.stable, learnt.held_out
    starts = np.vstack([learnt.grid(GRID), learnt.begins])
    steps = int(LONGEST * learnt.duration / DT)
    ends, latest, rises = _follow(stable, starts, steps, learnt.size)
    off = _end(plain, starts, steps, learnt.size)
    far = np.linalg.norm(held_out.states, axis=1) > FAR * learnt.size
    own, changed = (policy.predict(held_out.states) for policy in (plain, stable))
    return Row(
        shape=shape,
        starts=len(starts),
        plain=float(np.mean(off <= ARRIVED * learnt.size)),
        stable=ends,
        off=float(np.median(off)),
        latest=latest / learnt.duration,
        plain_error=_root_mean_square(own - held_out.actions),
        stable_error=_root_mean_square(changed - held_out.actions),
        change=_root_mean_square(changed - own),
        far_change=_root_mean_square((changed - own)[far]),
        speed=_root_mean_square(held_out.actions),
        rises=rises,
    )


def merge(name: str, rows: list[Row]) -> Row:
    """Put rows of as many starts each together: means of shares and errors, the latest arrival, all rises."""

    def mean(field: str) -> float:
        return float(np.mean([getattr(row, field) for row in rows]))

    return Row(
        shape=name,
        starts=sum(row.starts for row in rows),
        plain=mean("plain"),
        stable=mean("stable"),
        off=mean("off"),
        latest=max(row.latest for row in rows),
        plain_error=mean("plain_error"),
        stable_error=mean("stable_error"),
        change=mean("change"),
        far_change=mean("far_change"),
        speed=mean("speed"),
        rises=sum(row.rises for row in rows),
    )


def list_shapes(folder: Path) -> list[str]:
    """List the shapes in a folder of recordings. Raises `UnconstrainError` where there are none."""
    shapes = [path.stem for path in list_files("handwriting", folder)]
    if not shapes:
        raise UnconstrainError(f"{folder} does not hold handwriting/*.mat: give the folder of recordings")
    return shapes


def tabulate(rows: list[Row]) -> str:
    """Write a table in Markdown, with a line for all shapes together."""
    everything = merge("all", rows)
    return table(
        (
            "shape",
            "starts",
            "reach the goal: plain",
            "stabilised",
            "plain ends off by",
            "the last after",
            "held-out error: plain",
            "stabilised",
            "changed by",
            "far from the goal",
            "of speed",
            "steps on which V rose",
        ),
        [
            (
                f"{row.shape}{' *' if row.shape in TUNED_ON else ''}",
                f"{row.starts}",
                f"{row.plain:.1%}",
                f"{row.stable:.1%}",
                f"{row.off:.1f}",
                f"{row.latest:.1f}",
                f"{row.plain_error:.2f}",
                f"{row.stable_error:.2f}",
                f"{row.change:.2f}",
                f"{row.far_change:.2f}",
                f"{row.speed:.1f}",
                f"{row.rises}",
            )
            for row in (*rows, everything)
        ],
    )


def plot_shapes(folder: Path, shapes: list[str]) -> Figure:
    """Plot where stabilised policies lead from everywhere, and the Lyapunov function's levels.

    Parameters
    ----------
    folder : Path
        That holds `handwriting/*.mat`.
    shapes : list of str
        A panel each.

    Returns
    -------
    Figure
        Recorded movements, rollouts, levels of V in grey, and the goal as a dot.
    """
    columns = min(len(shapes), 5)
    rows = -(-len(shapes) // columns)
    figure = Figure(figsize=(1.7 * columns, 1.8 * rows), layout="constrained")
    panels = np.ravel(figure.subplots(rows, columns, squeeze=False))
    for panel in panels[len(shapes) :]:
        panel.remove()
    for shape, panel in zip(shapes, panels, strict=False):
        learnt = _learn(folder, shape, 0)
        stability = learnt.stable.stability_
        assert isinstance(stability, Stability)
        fine = learnt.grid(60)
        x, y, levels = (each.reshape(60, 60) for each in (*fine.T, np.sqrt(stability.value(fine))))
        panel.contour(x, y, levels, levels=12, colors=RECORDED, linewidths=0.3)
        movement = learnt.stable.rollout(learnt.grid(PATHS), int(5 * learnt.duration / DT), DT)
        for path in movement.states.reshape(PATHS**2, -1, 2):
            panel.plot(*path.T, color=LEARNT, linewidth=0.4)
        for path in learnt.recorded:
            panel.plot(*path.T, color=DIRECT, linewidth=0.6)
        panel.plot(*stability.goal, "o", color=TRUE, markersize=3)
        panel.set(xticks=(), yticks=(), aspect="equal")
        panel.set_title(shape, fontsize=8)
    return figure


@dataclass(frozen=True)
class _Learnt:
    """A shape, learnt from some of its demonstrations."""

    plain: Policy
    stable: Policy
    held_out: Demonstrations
    recorded: list[np.ndarray]
    duration: float

    @property
    def begins(self) -> np.ndarray:
        """Where demonstrations begin, (7, n)."""
        return np.stack([path[0] for path in self.recorded])

    @property
    def size(self) -> float:
        """The longer side of the box that holds all demonstrations."""
        return float(np.ptp(np.vstack(self.recorded), axis=0).max())

    def grid(self, count: int) -> np.ndarray:
        """Spread states over that box, enlarged, (count², 2)."""
        low, high = (edge(np.vstack(self.recorded), axis=0) for edge in (np.min, np.max))
        margin = (INFLATED - 1.0) / 2 * (high - low)
        axes = [np.linspace(a, b, count) for a, b in zip(low - margin, high + margin, strict=True)]
        return np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, len(low))


def _learn(folder: Path, shape: str, repetition: int) -> _Learnt:
    path = folder / "handwriting" / f"{shape}.mat"
    pairs = load_demonstrations(path, "demos", transposed=True)
    times = load_times(path)
    order = np.random.default_rng(repetition).permutation(len(pairs))
    train, held_out = (join([pairs[i] for i in which]) for which in (order[:SHOWN], order[SHOWN:]))
    train = replace(train, time=np.concatenate([times[i] for i in order[:SHOWN]]))
    plain = LocallyLinearPolicy().fit(train)
    duration = max(float(t[-1]) for t in times)
    return _Learnt(plain, plain.stabilized("end", train), held_out, [X for X, _ in pairs], duration)


def _follow(policy: Policy, starts: np.ndarray, steps: int, size: float) -> tuple[float, float, int]:
    """Return the share of starts that end at the goal, when the last of them arrives, and on how many steps V rose."""
    movement = policy.rollout(starts, steps, DT)
    assert isinstance(policy.stability_, Stability)
    away = np.linalg.norm(movement.states, axis=1).reshape(len(starts), -1)
    values = policy.stability_.value(movement.states).reshape(len(starts), -1)
    rises = int(np.sum(values[:, 1:] > values[:, :-1]))
    outside = away > ARRIVED * size
    last = np.flatnonzero(outside.any(axis=0))
    return float(np.mean(~outside[:, -1])), DT * (last[-1] + 1) if len(last) else 0.0, rises


def _end(policy: Policy, starts: np.ndarray, steps: int, size: float) -> np.ndarray:
    """Return how far from the goal a policy that may diverge ends; none is followed beyond 100 times the size."""
    X = starts
    for _ in range(steps):
        going = np.linalg.norm(X, axis=1, keepdims=True) < 100 * size
        X = np.where(going, X + DT * policy.predict(np.where(going, X, 0.0)), X)
    return np.linalg.norm(X, axis=1)


def load_times(path: Path) -> list[np.ndarray]:
    """Load the times of every demonstration in a file of handwriting, s."""
    from scipy.io import loadmat

    return [np.asarray(one["t"], dtype=np.float64) for one in loadmat(path, simplify_cells=True)["demos"]]


def _root_mean_square(U: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(U**2, axis=1))))
