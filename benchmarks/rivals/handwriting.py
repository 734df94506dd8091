"""Methods on handwriting, measured as published: `python -m benchmarks rivals-handwriting --data=FOLDER`."""

import warnings
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.progress import track

from benchmarks.rivals.learnt import Array, Field, Learnt, Recorded
from benchmarks.rivals.methods import RIVALS, Method, Option, choose
from benchmarks.rivals.primitives import check_installed
from reproduction import markdown
from reproduction.real import seds
from reproduction.real.handwriting import FINE, PUBLISHED, START, Shape
from reproduction.real.measures import DT, direction_error, simulate, velocity_error, warping_distance
from reproduction.stability import TUNED_ON, list_shapes
from unconstrain.errors import UnconstrainError
from unconstrain.policies import LocallyLinearPolicy

CHOSEN_IN = 1
"""Repetition whose shapes with a star options are chosen on; the published split is reported."""

NEAR = 0.05
"""A movement arrives if it ends as near to the goal, as a share of the extent of the shape."""


DIVERGED = 1e6
"""Mean DTW distance in mm from which on only that movements diverge is said."""


class Drawing(NamedTuple):
    """What is learnt from, and the shape that holds what is tested on."""

    recorded: Recorded
    shape: Shape


class Errors(NamedTuple):
    """RMSE and 1 - cos of velocities, DTW distances of movements to rest and stopped in time, and who arrives."""

    rmse: float
    direction: float
    dtw: float
    dtw_stopped: float
    arrives: float


def _ours(n_centers: int, recorded: Recorded, _: None) -> Field:
    policy = LocallyLinearPolicy(n_centers=n_centers).fit(recorded.demos)
    return Field(policy.stabilized("end", recorded.demos).held_for(DT).predict)


def _seds(recorded: Recorded, _: None) -> Field:
    return Field(seds.fit(recorded.demos.states, recorded.demos.actions, 0))


METHODS: Mapping[str, Method] = {
    "ours: 30 local models": Method(partial(_ours, 30)),
    f"ours: {FINE} local models": Method(partial(_ours, FINE)),
    "SEDS": Method(_seds),
    **{name: method for name, method in RIVALS.items() if "told" not in name},
}


Results = dict[str, tuple[Option, dict[str, Errors]]]
"""By method the option that was chosen, and errors by shape."""


def draw(folder: Path, name: str, repetition: int) -> Drawing:
    """Load a shape; all of them end at the origin."""
    shape = Shape.load(folder, name, repetition)
    return Drawing(Recorded(shape.demonstrations, np.zeros(2)), shape)


def measure(learnt: Learnt, drawing: Drawing) -> Errors:
    """Measure on the three demonstrations that were held out."""
    held_out, velocity = drawing.shape.held_out, learnt.velocity
    stopped = measure_stopped(learnt, drawing)
    extent = float(np.max(np.ptp(drawing.recorded.demos.states, axis=0)))
    rmse = direction = np.nan
    if velocity is None:
        paths = follow(learnt, drawing)
    else:
        X, U = (np.vstack([each[i] for each in held_out]) for i in (0, 1))
        P = velocity(X)
        rmse, direction = velocity_error(U, P), direction_error(U, P)
        paths = simulate(velocity, [X[START] for X, _, _ in held_out])
    arrives = [np.linalg.norm(path[-1]) <= NEAR * extent for path in paths]
    return Errors(rmse, direction, _compare(paths, drawing), stopped, float(np.mean(arrives)))


def measure_stopped(learnt: Learnt, drawing: Drawing) -> float:
    """Measure the DTW distance of movements that last as long as those learnt from do, on average."""
    return _compare(follow(learnt, drawing), drawing)


def follow(learnt: Learnt, drawing: Drawing) -> list[Array]:
    """Move from where movements that were held out begin, as long as those learnt from last on average."""
    duration = float(np.mean([t[-1] - t[START] for _, _, t in drawing.shape.shown]))
    return list(learnt.follow(np.array([X[START] for X, _, _ in drawing.shape.held_out]), duration, DT))


def _compare(paths: list[Array], drawing: Drawing) -> float:
    pairs = zip(paths, drawing.shape.held_out, strict=True)
    return float(np.mean([warping_distance(path, X) for path, (X, _, _) in pairs]))


def measure_all(folder: Path) -> Results:
    """Measure all methods on all shapes."""
    shapes = list_shapes(folder)
    tried = [draw(folder, name, CHOSEN_IN) for name in TUNED_ON if name in shapes]
    drawings = {name: draw(folder, name, 0) for name in shapes}
    found: Results = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # iterations of networks and mixtures end before they converge
        for name, method in track(
            METHODS.items(), "handwriting", transient=True, console=Console(stderr=True)
        ):
            option = choose(method, measure_stopped, tried)
            errors = {}
            for shape, drawing in drawings.items():
                learnt = method.learn(drawing.recorded, option)
                assert learnt is not None
                errors[shape] = measure(learnt, drawing)
            found[name] = option, errors
    return found


def print_table(folder: Path | None) -> None:
    """Print means over all shapes, and over those without a star."""
    if folder is None:
        raise UnconstrainError(
            "handwriting needs recordings: give --data=FOLDER, which holds handwriting/*.mat"
        )
    check_installed()
    print(tabulate(measure_all(folder)))


def tabulate(found: Results) -> str:
    """Write means over all shapes, and over those without a star, and the options, as Markdown."""
    rows = [
        [f"{name}, published", "26", f"{rmse:.2f}", f"{direction:.3f}", f"{dtw:.0f}", "", ""]
        for name, (rmse, direction, dtw) in PUBLISHED.items()
    ]
    for name, (_, errors) in found.items():
        for names in (list(errors), [shape for shape in errors if shape not in TUNED_ON]):
            if names:
                rows.append(_row(name, [errors[each] for each in names]))
    heads = ["", "shapes", "RMSE", "1 - cos", "DTW", "DTW, stopped in time, median", "arrives"]
    chosen = [f"{name} {option}" for name, (option, _) in found.items() if option is not None]
    return f"{markdown.table(heads, rows)}\n\nOptions: {'; '.join(chosen)}"


def _row(name: str, errors: list[Errors]) -> list[str]:
    rmse, direction, dtw, _, arrives = np.mean(errors, axis=0)
    shown = ["-", "-"] if np.isnan(rmse) else [f"{rmse:.2f}", f"{direction:.3f}"]
    stopped = np.median([each.dtw_stopped for each in errors])
    whole = f"{dtw:.0f}" if dtw < DIVERGED else "some diverge"
    return [name, f"{len(errors)}", *shown, whole, f"{stopped:.0f}", f"{arrives:.0%}"]
