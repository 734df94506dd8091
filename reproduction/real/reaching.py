"""Reaches of an arm among boxes (CLAMP): learnt from bent and some free ones, tested on free ones.

The paper's Fig. 7 on a robot arm. Boxes are known and say which samples were free, or it is inferred.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray
from rich.console import Console
from scipy.spatial import KDTree

from reproduction.adaptive.recorded import (
    BENT_REACHES,
    FREE_REACHES,
    FREE_SHOWN,
    REACHING,
    join,
    list_reaching_splits,
    load_demonstrations,
)
from reproduction.markdown import table
from reproduction.real.part import Outcome
from reproduction.trials import run_trials
from unconstrain import identifiability, metrics, plot
from unconstrain.constraints import from_obstacles, obstacle_distances
from unconstrain.demonstrations import Demonstrations
from unconstrain.plot.colors import RECORDED, SERIES, TRUE
from unconstrain.policies import LocallyLinearPolicy
from unconstrain.policies.base import Policy

Array = NDArray[np.float64]

TITLE = "Reaching among boxes (CLAMP)"

WITHIN = 0.1
"""Metres from a box within which it may have bent a reach: bent ones pass at 0.04 to 0.08, free ones at 0.29."""

OTHERS = (0.2, 0.3)
"""Other such distances, to show what hangs on it."""

DT, LONGEST = 0.02, 600
"""Seconds a step of a simulated reach, and how many steps."""

DIRECT, INFERRED, FREE = (
    "ordinary regression",
    "boxes unknown, inferred",
    "the free reaches alone, ordinary regression",
)

KNOWN, ALONG, WITHOUT = (
    "boxes known, the others inferred",
    'boxes known, risk="inconsistency"',
    "boxes known, samples near them left out, ordinary regression",
)

KNOWN_GOAL, INFERRED_GOAL = 0.5, 1.0
"""Errors that were to be reached, as shares of ordinary regression's."""

SPLIT = f"bent and {FREE_SHOWN} free, on the other free"

FOUND = (
    *(f"{name} {what}" for name in ("model", "data") for what in ("width", "near bent", "near free")),
    "free share",
    "determined",
    "least seen",
)
"""What else is found for each pair, in metres or as shares."""

MOVING = 0.02
"""Speed in m/s below which a sample has no direction worth comparing."""


def run(folder: Path, repetitions: int, out: Path, progress: Callable[[str], None]) -> Outcome:
    """Learn from all bent and every two free reaches; there are ten such pairs. See `Run`."""
    pairs = min(repetitions, len(list_reaching_splits()[SPLIT]))
    progress(f"reaching: {pairs} pairs of free reaches")
    results = run_trials(
        partial(measure, folder),
        pairs,
        out / "reaching.jsonl",
        settings={"within": [WITHIN, *OTHERS], "dt": DT, "longest": LONGEST, "found": list(FOUND)},
        console=Console(stderr=True),
        label="reaching",
    )
    figure = plot.save(plot_reaches(folder), out / "reaching.png")
    return Outcome(TITLE, tabulate(results), describe(folder, results), (figure,))


def load(folder: Path) -> tuple[list[tuple[Array, Array]], list[tuple[Array, Array]]]:
    """Load positions and velocities of ten reaches, and the boxes: centres and sides, m."""
    from scipy.io import loadmat

    pairs = load_demonstrations(folder / REACHING, "dataset", transposed=False)
    boxes = loadmat(folder / REACHING, simplify_cells=True)["dataset"][0]["obs"]
    return pairs, [(np.asarray(box[:3]), np.asarray(box[3:])) for box in boxes]


def learn(way: str, demos: Demonstrations, boxes: list[tuple[Array, Array]], within: float) -> Policy:
    """Learn in one way."""
    known = from_obstacles(demos.states, boxes, within)
    if way == KNOWN:
        return LocallyLinearPolicy().fit(demos, projections=known)
    if way == ALONG:
        return LocallyLinearPolicy(risk="inconsistency").fit(demos, projections=known)
    if way == INFERRED:
        return LocallyLinearPolicy().fit(demos)
    kept = np.ones(len(demos), dtype=bool)
    if way == WITHOUT:
        kept &= np.isfinite(known[:, 0, 0])
    if way == FREE:
        kept &= demos.episodes >= len(BENT_REACHES)
    return LocallyLinearPolicy(risk="direct").fit(
        demos.states[kept], demos.actions[kept], groups=demos.episodes[kept]
    )


def measure(folder: Path, split: int) -> dict[str, Any]:
    """Learn from all bent and two free reaches, and measure errors on the other free ones.

    Parameters
    ----------
    folder : Path
        Of recordings.
    split : int
        Which two.

    Returns
    -------
    dict
        By way the measures of `compare`, and those of `FOUND`.
    """
    pairs, boxes = load(folder)
    shown, held_out = list_reaching_splits()[SPLIT][split]
    demos, tested = join([pairs[i] for i in shown]), [pairs[i] for i in held_out]
    result: dict[str, Any] = {}
    for way, within in list_ways():
        result[_name(way, within)] = compare(learn(way, demos, boxes, within), demos, tested)
    inferred, along = (learn(way, demos, boxes, WITHIN) for way in (INFERRED, ALONG))
    assert isinstance(inferred, LocallyLinearPolicy)
    known = from_obstacles(demos.states, boxes, WITHIN)
    report = identifiability(along, demos.states, demos.actions, projections=known)
    bent = demos.episodes < len(BENT_REACHES)
    X = np.vstack([each[0] for each in tested])
    for name, width in (("model", inferred.width_), ("data", report.reach)):
        near_bent, near_free = (
            np.asarray(KDTree(demos.states[own] / width).query(X / width)[0]) <= 1 for own in (bent, ~bent)
        )
        result |= {
            f"{name} width": float(np.mean(width)),
            f"{name} near bent": float(near_bent.mean()),
            f"{name} near free": float(near_free.mean()),
        }
    return result | {
        "free share": float(inferred.free_share_),
        "determined": float(report.determined_share),
        "least seen": float(np.median(report.unseen_directions(X).shares[:, 0])),
    }


def list_ways() -> list[tuple[str, float]]:
    """List what is compared: a way, and the distance from boxes that it goes by."""
    ways = [(way, WITHIN) for way in (DIRECT, INFERRED, KNOWN, ALONG, WITHOUT, FREE)]
    return ways + [(way, within) for within in OTHERS for way in (KNOWN, ALONG, WITHOUT)]


def compare(
    policy: Policy, demos: Demonstrations, tested: list[tuple[Array, Array]]
) -> tuple[float, float, float, float]:
    """Measure a policy on held-out reaches.

    Parameters
    ----------
    policy : Policy
        Fitted.
    demos : Demonstrations
        To these.
    tested : list of (ndarray, ndarray)
        Positions and velocities of each held-out reach.

    Returns
    -------
    tuple of float
        The error of the whole action, as a share of its variance; the same once the policy goes through each reach with
        the factor on its speed that suits best; the median angle between velocities, degrees; and how far from a reach
        the policy, made stable at the goal, leads from the same start, m (mean over the reach's samples).
    """
    X, U = (np.vstack([each[i] for each in tested]) for i in (0, 1))
    P = policy.predict(X)
    scaled, begin = P.copy(), 0
    for positions, velocities in tested:
        own = slice(begin, begin + len(positions))
        begin = own.stop
        scaled[own] *= max(np.sum(velocities * P[own]) / np.sum(P[own] ** 2), 0.0)
    lengths = np.linalg.norm(U, axis=1) * np.linalg.norm(P, axis=1)
    cosine = np.sum(U * P, axis=1)[lengths > 0] / lengths[lengths > 0]
    moving = np.linalg.norm(U, axis=1)[lengths > 0] > MOVING
    stable = policy.stabilized("end", demos)
    paths = stable.rollout(np.array([each[0][0] for each in tested]), LONGEST, DT).states
    off = [
        np.mean(KDTree(path).query(positions)[0])
        for path, (positions, _) in zip(paths.reshape(len(tested), -1, 3), tested, strict=True)
    ]
    return (
        metrics.normalized(metrics.direct(U, P), U),
        metrics.normalized(metrics.direct(U, scaled), U),
        float(np.degrees(np.median(np.arccos(np.clip(cosine[moving], -1.0, 1.0))))),
        float(np.mean(off)),
    )


def tabulate(results: list[dict[str, Any]]) -> str:
    """Write a table in Markdown, means over pairs of free reaches."""
    direct = _mean(results, DIRECT)[0]
    rows = []
    for way, within in list_ways():
        error, scaled, angle, off = _mean(results, _name(way, within))
        rows.append(
            (
                _name(way, within),
                f"{error:.3f}",
                f"{error / direct:.2f}",
                f"{scaled:.3f}",
                f"{angle:.0f}°",
                f"{100 * off:.1f}",
            )
        )
    header = ("learnt by", "error", "of direct's", "own speeds", "angle", "path off, cm")
    return table(header, rows)


def describe(folder: Path, results: list[dict[str, Any]]) -> tuple[str, ...]:
    """Say what of the goals was reached, and why not."""
    direct = _mean(results, DIRECT)[0]
    findings = []
    for way, goal in (
        (KNOWN, KNOWN_GOAL),
        (ALONG, KNOWN_GOAL),
        (WITHOUT, KNOWN_GOAL),
        (INFERRED, INFERRED_GOAL),
    ):
        share = _mean(results, _name(way, WITHIN))[0] / direct
        said = "reached" if share <= goal else "missed"
        findings.append(f"{way}: {share:.2f} of direct's error; at most {goal:.1f}: {said}")
    found = {name: float(np.mean([each[name] for each in results])) for name in FOUND}
    pairs, boxes = load(folder)
    free, bent = (np.mean([pairs[i][0][0][0] for i in each]) for each in (FREE_REACHES, BENT_REACHES))
    findings += [
        f"free reaches begin at x = {free:.2f} m and bent ones at {bent:.2f} m on average, on either side of the goal",
        f"of held-out samples {found['data near bent']:.0%} have a bent one within {found['data width']:.2f} m "
        f"(Scott's rule) and {found['data near free']:.0%} a free one: elsewhere no recording says what the policy "
        "does, but how the model extends two free reaches",
        f"receptive fields are {found['model width']:.2f} m wide, and {found['model near bent']:.0%} of held-out "
        "samples have a bent one within that: what happened on the other side of the goal counts there",
        f"uc.identifiability finds {found['determined']:.0%} of the policy's directions determined at recorded states, "
        f"by free flags and directions of motion; near held-out samples {found['least seen']:.0%} of the recorded "
        "motion went along the direction least seen (median; 33% if all were seen alike)",
        f"inference takes {found['free share']:.0%} of all samples for free, and so it is ordinary regression",
        _describe_contact(pairs, boxes),
        _describe_speeds(pairs, results),
    ]
    return tuple(findings)


def plot_reaches(folder: Path) -> Figure:
    """Plot the first pair from above and from the side: what was recorded, the boxes, and where policies lead."""
    pairs, boxes = load(folder)
    shown, held_out = list_reaching_splits()[SPLIT][0]
    demos = join([pairs[i] for i in shown])
    starts = np.array([pairs[i][0][0] for i in held_out])
    paths = {
        way: learn(way, demos, boxes, WITHIN)
        .stabilized("end", demos)
        .rollout(starts, LONGEST, DT)
        .states.reshape(len(starts), -1, 3)
        for way in (DIRECT, INFERRED, ALONG, WITHOUT)
    }
    figure = Figure(figsize=(7, 7.4), layout="constrained")
    panels = figure.subplots(2, 1, sharex=True)
    for panel, (i, j) in zip(panels, ((0, 1), (0, 2)), strict=True):
        for centre, sides in boxes:
            corner = centre - sides / 2
            panel.add_patch(
                Rectangle(
                    (corner[i], corner[j]), sides[i], sides[j], facecolor="#dddddd", edgecolor=TRUE, lw=0.5
                )
            )
        for k, (X, _) in enumerate(pairs):
            style = ("-" if k in shown else ":") if k not in BENT_REACHES else "--"
            label = {
                shown[0]: "recorded, bent",
                shown[-1]: "recorded, free",
                held_out[0]: "held out, free",
            }.get(k)
            panel.plot(X[:, i], X[:, j], style, color=RECORDED, linewidth=1, label=label)
        for (way, each), color, width in zip(paths.items(), SERIES, (2.5, 1, 1, 1), strict=True):
            for k, path in enumerate(each):
                panel.plot(path[:, i], path[:, j], color=color, lw=width, label=None if k else way)
        panel.plot(*pairs[0][0][-1, [i, j]], "o", color=TRUE, markersize=4)
        panel.set(xlabel="x (m)", ylabel=f"{'xyz'[j]} (m)", aspect="equal")
    figure.legend(*panels[0].get_legend_handles_labels(), fontsize=7, loc="outside upper center", ncols=2)
    return figure


def _describe_contact(pairs: list[tuple[Array, Array]], boxes: list[tuple[Array, Array]]) -> str:
    """Say how far motion near boxes runs along their surface, as contact would make it."""
    X, U = (np.vstack([pairs[k][i] for k in BENT_REACHES]) for i in (0, 1))
    distance, step = obstacle_distances(X, boxes), 1e-6
    moving = np.linalg.norm(U, axis=1) > MOVING
    near = (distance < WITHIN) & moving
    slopes = [
        (obstacle_distances(X[near] + e, boxes) - obstacle_distances(X[near] - e, boxes)) / (2 * step)
        for e in step * np.eye(3)
    ]
    along = np.einsum("dn,nd->n", np.array(slopes), U[near] / np.linalg.norm(U[near], axis=1, keepdims=True))
    return (
        f"within {WITHIN} m of a box {np.mean(along**2):.0%} of the squared motion is along its surface's normal, and "
        f"no sample is nearer than {100 * distance.min():.1f} cm: nothing slid along a surface, so N = I - n nᵀ is "
        "not true"
    )


def _describe_speeds(pairs: list[tuple[Array, Array]], results: list[dict[str, Any]]) -> str:
    """Say how far speeds differ between reaches that were made to last equally long, and what that costs."""
    speeds = [np.mean(np.linalg.norm(U, axis=1)) for _, U in pairs]
    means = {way: _mean(results, _name(way, WITHIN)) for way in (DIRECT, WITHOUT)}
    costs = " and ".join(f"{each[0]:.3f} to {each[1]:.3f}" for each in means.values())
    return (
        f"all reaches were resampled to last equally long, so their mean speeds are {min(speeds):.2f} to "
        f"{max(speeds):.2f} m/s, which no function of position can tell: with a factor of its own on each held-out "
        f"reach errors fall from {costs} (ordinary regression; near samples left out), so the ratio becomes "
        f"{means[WITHOUT][1] / means[DIRECT][1]:.2f}"
    )


def _name(way: str, within: float) -> str:
    return f"{way} ({within} m)" if way in (KNOWN, ALONG, WITHOUT) else way


def _mean(results: list[dict[str, Any]], name: str) -> Array:
    return np.mean([result[name] for result in results], axis=0)
