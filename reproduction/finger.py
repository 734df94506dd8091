"""The finger (section 4.0): the paper's Fig. 1, and what it leaves out, the policy learnt from several obstacles."""

import json
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from rich.console import Console

from reproduction.errors import both
from reproduction.outcome import Outcome
from reproduction.plants.finger import Box, Finger
from unconstrain import atomic, plot
from unconstrain.demonstrations import Demonstrations
from unconstrain.plot.colors import DIRECT, LEARNT, TRUE
from unconstrain.policies import ParametricPolicy

STARTS = ((0.9, 0.8, 0.7), (0.7, 1.0, 0.6), (1.0, 0.6, 0.8), (0.55, 1.1, 0.9))
"""The first is the movement drawn; the others fill the fields over two joints."""
OBSTACLE = Box((0.085, -0.022), (0.04, 0.022), -0.5, 0.003)
MOVEMENTS = 12
"""To learn from, by default: each from its own start, with its own obstacle in the way."""
LENGTH = 150

CHOICES = (
    "The finger has three phalanges of 45, 30 and 22 mm; its policy is π(q) = -q, in rad/s (the paper gives neither).",
    "Each movement to learn from has an obstacle of another place and angle in the way.",
)


def scenes(finger: Finger, movements: int, seed: int = 0) -> tuple[np.ndarray, list[tuple[Box]]]:
    """Starts (S, 3) and an obstacle each that the free movement would run into."""
    rng = np.random.default_rng(seed)
    starts: list[np.ndarray] = []
    boxes: list[tuple[Box]] = []
    while len(starts) < movements:
        start = rng.uniform(0.5, 1.1, 3)
        place = rng.uniform((0.05, -0.045), (0.1, -0.012))
        box = Box((place[0], place[1]), (0.04, 0.022), rng.uniform(-1.2, 0.4), 0.003)
        free = finger.demonstrate(start, length=40, rate=10.0).states
        clearance = finger.clearance(free, box)
        if clearance[0] > 0.002 and clearance.min() < -0.002:
            starts.append(start)
            boxes.append((box,))
    return np.array(starts), boxes


def reproduce(out: Path, *, trials: int | None = None, jobs: int = 1, console: Console) -> Outcome:
    """Draw Fig. 1 anew and learn from `trials` movements with as many obstacles; there is nothing to run in `jobs`."""
    finger = Finger()
    with console.status("the finger"):
        free = finger.demonstrate(STARTS, length=LENGTH)
        blocked = finger.demonstrate(STARTS, OBSTACLE, length=LENGTH)
        starts, boxes = scenes(finger, trials or MOVEMENTS)
        seen = finger.demonstrate(starts, boxes, length=LENGTH)
        unseen = finger.demonstrate(*scenes(finger, MOVEMENTS, seed=1), length=LENGTH)
        results = {}
        policies = {}
        for kind in ("inconsistency", "direct"):
            policies[kind] = ParametricPolicy(risk=kind, alpha="cv")
            policies[kind].fit(seen.states, seen.actions, groups=seen.episodes)
            results[kind] = both(unseen, policies[kind].predict(unseen.states))
        figure = figure_1(finger, free, blocked, seen, policies["inconsistency"], policies["direct"])
        out.mkdir(parents=True, exist_ok=True)
        png, svg = (plot.save(figure, out / f"fig1{suffix}") for suffix in (".png", ".svg"))
        with atomic.replacing(out / "errors.json") as temporary:
            temporary.write_text(json.dumps(results, indent=1) + "\n")
    held = np.linalg.norm(finger.policy(seen.states) - seen.actions, axis=1) > 1e-9
    lines = ["| learnt from constrained movements | nUPE | nCPE |", "| --- | --- | --- |"]
    lines += [f"| {kind} | {error['nUPE']:.2g} | {error['nCPE']:.2g} |" for kind, error in results.items()]
    return Outcome(
        title="The finger (Fig. 1)",
        table="\n".join(lines) + f"\n\nLinear policy, {seen.n_episodes} movements with an obstacle each; "
        f"errors on {unseen.n_episodes} others.\n",
        figures={
            png: "Fig. 1 anew: the free movement; the movement along an obstacle; both fields over two joints, "
            "recorded actions and the policy they come from; that learnt from several obstacles over the true one."
        },
        choices=CHOICES,
        findings=(
            f"{held.mean():.0%} of the samples learnt from slide along an obstacle.",
            f"nUPE {results['inconsistency']['nUPE']:.2g} by inconsistency, {results['direct']['nUPE']:.2g} directly.",
        ),
        files=(svg, out / "errors.json"),
    )


def figure_1(
    finger: Finger,
    free: Demonstrations,
    blocked: Demonstrations,
    seen: Demonstrations,
    learnt: ParametricPolicy,
    direct: ParametricPolicy,
) -> Figure:
    """Both movements, both fields over the two inner joints, and the learnt policy over the true one."""
    figure = Figure(figsize=(13.0, 6.6), layout="constrained")
    panels = figure.subplot_mosaic([["free", "fields", "learnt"], ["blocked", "fields", "learnt"]])
    for name, movement, box in (("free", free, None), ("blocked", blocked, OBSTACLE)):
        _movement(panels[name], finger, movement, box)
    panels["free"].set_title("(a) unconstrained", fontsize=11)
    panels["blocked"].set_title("(b) an obstacle in the way", fontsize=11)

    X = blocked.states[::12]
    _arrows(panels["fields"], X, finger.policy(X), DIRECT, "policy π")
    _arrows(panels["fields"], X, blocked.actions[::12], TRUE, "recorded u = Nπ")
    for movement, color, label in (
        (free, DIRECT, "free"),
        (blocked, TRUE, "along the obstacle"),
    ):
        plot.trajectory(
            movement.states, episodes=movement.episodes, color=color, label=label, ax=panels["fields"]
        )
    panels["fields"].set_title("(c) one policy, two behaviours", fontsize=11)

    picked = slice(None, None, 40)
    plot.trajectory(seen.states, episodes=seen.episodes, label="recorded movements", ax=panels["learnt"])
    X = seen.states[picked]
    _arrows(panels["learnt"], X, finger.policy(X), TRUE, "policy π", width=0.011)
    _arrows(panels["learnt"], X, direct.predict(X), DIRECT, "ordinary regression")
    _arrows(panels["learnt"], X, learnt.predict(X), LEARNT, "learnt", width=0.005)
    panels["learnt"].set_title(f"(d) learnt from {seen.n_episodes} obstacles", fontsize=11)
    for name in ("fields", "learnt"):
        panels[name].set(xlabel="joint 1 (rad)", ylabel="joint 2 (rad)")
        panels[name].set_aspect("equal", adjustable="datalim")
        panels[name].legend(frameon=False, fontsize=9, loc="upper left")
    return figure


def _movement(ax: Axes, finger: Finger, movement: Demonstrations, box: Box | None) -> None:
    if box is not None:
        ax.add_patch(Polygon(box.outline(), color="#444444"))
    postures = movement.episode(0).states
    frames = postures[np.linspace(0, len(postures) - 1, 6).astype(int)]
    for i, q in enumerate(frames):
        # Mixed with white, not transparent: phalanges overlap at the joints. As thick as it is, the finger touches.
        shade = 0.2 + 0.8 * i / (len(frames) - 1)
        face = 1 - shade * (1 - np.array(to_rgb(LEARNT)))
        for outline in finger.outlines(q):
            ax.add_patch(Polygon(outline, facecolor=tuple(face), edgecolor="white", lw=0.6, zorder=2 + i))
        ax.plot(*finger.joints(q[None])[0, :-1].T, "o", color="white", ms=2.5, zorder=2 + i)
    ax.set_aspect("equal")
    ax.set(xlim=(-0.012, 0.112), ylim=(-0.09, 0.018), xlabel="m", ylabel="m")


def _arrows(ax: Axes, X: np.ndarray, U: np.ndarray, color: str, label: str, width: float = 0.005) -> None:
    ax.quiver(
        X[:, 0], X[:, 1], U[:, 0], U[:, 1],
        angles="xy", scale_units="xy", scale=6.0, width=width, color=color, label=label, zorder=3,
    )  # fmt: skip
