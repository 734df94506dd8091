"""Handwriting (LASA) as Figueroa and Billard measure it: four demonstrations to learn from, three to test on."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from rich.console import Console

from reproduction.adaptive.recorded import SHOWN, join, load_demonstrations
from reproduction.markdown import table
from reproduction.real import seds
from reproduction.real.measures import DT, direction_error, simulate, velocity_error, warping_distance
from reproduction.real.part import Outcome
from reproduction.stability import TUNED_ON, list_shapes, load_times
from reproduction.trials import run_trials
from unconstrain import plot
from unconstrain.demonstrations import Demonstrations
from unconstrain.plot.colors import DIRECT, LEARNT, RECORDED
from unconstrain.policies import LocallyLinearPolicy
from unconstrain.policies.base import Policy
from unconstrain.selection import select_policy

Array = NDArray[np.float64]

TITLE = "Handwriting (LASA)"

SUBSAMPLE = 2
"""Every second of the 1000 samples is learnt from and tested on, as published."""

START = 19
"""Simulated movements begin at this sample of those, as published: the pen hardly moves before."""

FINE = 80
"""Local models of the finer policy; chosen among 8 to 80 on the shapes with a star."""

PUBLISHED = {"PC-GMM LPV-DS": (5.19, 0.062, 1749.0), "SEDS": (6.34, 0.099, 3954.0)}
"""RMSE in mm/s, 1 - cos, DTW distance in mm."""

DEFAULT, LOCAL, AUTO, SEDS = (
    "`LocallyLinearPolicy()`",
    f"`n_centers={FINE}`",
    '`select_policy("auto")`',
    "our SEDS",
)

EVERY_TIME, ONCE = (DEFAULT, LOCAL), (AUTO, SEDS)
"""What is learnt in every repetition, and what in the first only: it takes ten times as long."""

NAMES = ("RMSE", "1 - cos", "DTW")


@dataclass(frozen=True)
class Shape:
    """Four demonstrations of a shape to learn from, three to test on, each of positions, velocities and times."""

    shown: list[tuple[Array, Array, Array]]
    held_out: list[tuple[Array, Array, Array]]

    @classmethod
    def load(cls, folder: Path, name: str, repetition: int) -> "Shape":
        """Load a shape; repetition 0 is the published split, in the others four are drawn at random."""
        path = folder / "handwriting" / f"{name}.mat"
        pairs = load_demonstrations(path, "demos", transposed=True)
        listed = [
            (X[::SUBSAMPLE], U[::SUBSAMPLE], t[::SUBSAMPLE])
            for (X, U), t in zip(pairs, load_times(path), strict=True)
        ]
        order = range(len(listed))
        if repetition:
            order = np.random.default_rng(repetition).permutation(len(listed)).tolist()
        return cls([listed[i] for i in order[:SHOWN]], [listed[i] for i in order[SHOWN:]])

    @property
    def demonstrations(self) -> Demonstrations:
        """What is learnt from."""
        joined = join([(X, U) for X, U, _ in self.shown])
        return replace(joined, time=np.concatenate([t for _, _, t in self.shown]))


def run(folder: Path, repetitions: int, out: Path, progress: Callable[[str], None]) -> Outcome:
    """Learn every shape from four demonstrations, drawn again in each repetition; see `Run`."""
    shapes = list_shapes(folder)
    trial = partial(measure, folder, shapes)
    settings = {"shapes": shapes, "fine": FINE, "ways": [*EVERY_TIME, *ONCE]}
    progress(f"handwriting: {len(shapes)} shapes, {repetitions} times")
    results = run_trials(
        trial,
        repetitions,
        out / "handwriting.jsonl",
        settings=settings,
        console=Console(stderr=True),
        label="handwriting",
    )
    figure = plot.save(plot_movements(folder, shapes), out / "handwriting.png")
    return Outcome(TITLE, tabulate(shapes, results), describe(shapes, results), (figure,))


def measure(folder: Path, shapes: list[str], repetition: int) -> dict[str, Any]:
    """Learn and measure all shapes once.

    Parameters
    ----------
    folder : Path
        That holds `handwriting/*.mat`.
    shapes : list of str
        Their names.
    repetition : int
        Which four demonstrations are learnt from, see `Shape.load`.

    Returns
    -------
    dict
        By what was learnt, "test" or "train", and shape: RMSE, 1 - cos and the DTW distance.
    """
    ways = EVERY_TIME if repetition else (*EVERY_TIME, *ONCE)
    result: dict[str, Any] = {way: {"test": {}, "train": {}} for way in ways}
    for name in shapes:
        shape = Shape.load(folder, name, repetition)
        for way in ways:
            velocity = learn(way, shape.demonstrations, repetition)
            for where, listed in (("test", shape.held_out), ("train", shape.shown)):
                result[way][where][name] = compare(velocity, listed)
    return result


def learn(way: str, demos: Demonstrations, seed: int) -> Callable[[Array], Array]:
    """Learn a system that ends where the demonstrations end, and return what gives its velocities."""
    if way == SEDS:
        return seds.fit(demos.states, demos.actions, seed)
    policy: Policy
    if way == AUTO:
        policy = select_policy("auto", demos).policy
    else:
        policy = (LocallyLinearPolicy(n_centers=FINE) if way == LOCAL else LocallyLinearPolicy()).fit(demos)
    return policy.stabilized("end", demos).held_for(DT).predict


def compare(
    velocity: Callable[[Array], Array], listed: list[tuple[Array, Array, Array]]
) -> tuple[float, float, float]:
    """Compute RMSE, 1 - cos and the DTW distance of a system to demonstrations."""
    X, U = (np.vstack([each[i] for each in listed]) for i in (0, 1))
    P = velocity(X)
    paths = simulate(velocity, [X[START] for X, _, _ in listed])
    distances = [warping_distance(path, X) for path, (X, _, _) in zip(paths, listed, strict=True)]
    return velocity_error(U, P), direction_error(U, P), float(np.mean(distances))


def tabulate(shapes: list[str], results: list[dict[str, Any]]) -> str:
    """Write two tables in Markdown: means over shapes, and each shape."""
    n = len(results)
    times = f"{n} repetition{'s' * (n > 1)}"
    rows = [
        (name, "26 shapes, 10 repetitions", *_cells(values), "", "", "") for name, values in PUBLISHED.items()
    ]
    for way in results[0]:
        means = [_mean(shapes, results[:1], way, where) for where in ("test", "train")]
        rows.append((way, f"{len(shapes)} shapes, published split", *_cells(means[0]), *_cells(means[1])))
        if n > 1 and way in EVERY_TIME:
            means = [_mean(shapes, results, way, where) for where in ("test", "train")]
            rows.append((way, f"{len(shapes)} shapes, {times}", *_cells(means[0]), *_cells(means[1])))
    overall = table(("learnt by", "over", *NAMES, *(f"{name}, train" for name in NAMES)), rows)
    each = table(
        ("shape", *(f"{name}: {way}" for way in EVERY_TIME for name in NAMES)),
        [
            (
                f"{shape}{' *' if shape in TUNED_ON else ''}",
                *(cell for way in EVERY_TIME for cell in _cells(_mean([shape], results, way, "test"))),
            )
            for shape in shapes
        ],
    )
    return f"{overall}\n\nEach shape, on its test demonstrations, mean over {times}:\n\n{each}"


def describe(shapes: list[str], results: list[dict[str, Any]]) -> tuple[str, ...]:
    """Say what of the goals was reached, and how far the measures are those that were published."""
    published = PUBLISHED["PC-GMM LPV-DS"]
    findings = []
    for way in (way for way in results[0] if way != SEDS):
        over = results if way in EVERY_TIME else results[:1]
        for which, names in (
            ("all shapes", shapes),
            ("the shapes without a star", [shape for shape in shapes if shape not in TUNED_ON]),
        ):
            if not names:
                continue
            ours = _mean(names, over, way, "test")
            missed = [name for name, a, b in zip(NAMES, ours, published, strict=True) if not a < b]
            said = f"missed in {' and '.join(missed)}" if missed else "reached"
            findings.append(
                f"{way} on {which}, {len(over)} repetition{'s' * (len(over) > 1)}: {', '.join(_cells(ours))}; below "
                f"PC-GMM's {', '.join(_cells(published))}: {said}"
            )
    if SEDS in results[0]:
        test, train = (_mean(shapes, results[:1], SEDS, where) for where in ("test", "train"))
        findings.append(
            f"the measures, fed a SEDS of our own: {', '.join(_cells(test))} on test and {', '.join(_cells(train))} on "
            f"train demonstrations; published are {', '.join(_cells(PUBLISHED['SEDS']))}"
        )
    return tuple(findings)


def plot_movements(folder: Path, shapes: list[str]) -> Figure:
    """Plot where the finer policy leads from where test demonstrations begin, beside these; the published split."""
    columns = min(len(shapes), 5)
    rows = -(-len(shapes) // columns)
    figure = Figure(figsize=(1.7 * columns, 1.7 * rows), layout="constrained")
    panels = np.ravel(figure.subplots(rows, columns, squeeze=False))
    for panel in panels[len(shapes) :]:
        panel.remove()
    for name, panel in zip(shapes, panels, strict=False):
        shape = Shape.load(folder, name, 0)
        velocity = learn(LOCAL, shape.demonstrations, 0)
        for path in simulate(velocity, [X[START] for X, _, _ in shape.held_out]):
            panel.plot(*path.T, color=LEARNT, linewidth=0.7)
        for listed, color in ((shape.shown, RECORDED), (shape.held_out, DIRECT)):
            for X, _, _ in listed:
                panel.plot(*X.T, color=color, linewidth=0.5)
        panel.set(xticks=(), yticks=(), aspect="equal")
        panel.set_title(name, fontsize=8)
    return figure


def _mean(shapes: list[str], results: list[dict[str, Any]], way: str, where: str) -> Array:
    return np.mean([result[way][where][shape] for result in results for shape in shapes], axis=0)


def _cells(values: Any) -> tuple[str, str, str]:
    return f"{values[0]:.2f}", f"{values[1]:.3f}", f"{values[2]:.0f}"
