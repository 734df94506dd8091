"""Fig. 1 anew, and what the paper leaves out there: the policy learnt from several obstacles."""

from pathlib import Path

import numpy as np
from rich.console import Console

from reproduction import markdown
from reproduction.finger.figures import plot_figure_1
from reproduction.outcome import Outcome, make_folder, write_figures, write_json
from reproduction.plants.box import Box
from reproduction.plants.finger import Finger
from reproduction.scores import nupe_and_ncpe
from unconstrain.policies import ParametricPolicy

STARTS = ((0.9, 0.8, 0.7), (0.7, 1.0, 0.6), (1.0, 0.6, 0.8), (0.55, 1.1, 0.9))
"""The first is the movement drawn; the others fill the fields over two joints."""

OBSTACLE = Box((0.085, -0.022), (0.04, 0.022), -0.5, 0.003)

MOVEMENTS = 12
"""To learn from, by default: each from its own start, with its own obstacle in the way."""

LENGTH = 150
"""Samples of a movement."""

CHOICES = (
    "The finger has three phalanges of 45, 30 and 22 mm; its policy is π(q) = -q, in rad/s (the paper gives neither).",
    "Each movement to learn from has an obstacle of another place and angle in the way.",
)


def draw_scenes(finger: Finger, movements: int, seed: int = 0) -> tuple[np.ndarray, list[tuple[Box]]]:
    """Draw starts (S, 3), and for each an obstacle that the free movement would run into."""
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


def reproduce(
    out: Path,
    *,
    trials: int | None = None,
    jobs: int = 1,
    console: Console,
    movements: int = MOVEMENTS,
) -> Outcome:
    """Draw Fig. 1 anew, and learn from some movements with as many obstacles.

    There is one data set, so that `trials` and `jobs` change nothing.
    """
    make_folder(out)
    finger = Finger()
    with console.status("the finger"):
        free = finger.demonstrate(STARTS, length=LENGTH)
        blocked = finger.demonstrate(STARTS, OBSTACLE, length=LENGTH)
        seen = finger.demonstrate(*draw_scenes(finger, movements), length=LENGTH)
        test = finger.demonstrate(*draw_scenes(finger, MOVEMENTS, seed=1), length=LENGTH)
        errors, policies = {}, {}
        for risk in ("inconsistency", "direct", "adaptive"):
            policy = ParametricPolicy(risk=risk, alpha="cv")
            policies[risk] = policy.fit(seen.states, seen.actions, groups=seen.episodes)
            errors[risk] = nupe_and_ncpe(test, policy.predict(test.states))
        figure = plot_figure_1(
            finger, free, blocked, OBSTACLE, seen, policies["inconsistency"], policies["direct"]
        )
        shown, drawn = write_figures(
            out,
            {
                "fig1": (
                    figure,
                    "Fig. 1 anew: the free movement; the movement along an obstacle; both fields over two joints, "
                    "recorded actions and the policy they come from; that learnt from several obstacles over the "
                    "true one.",
                )
            },
        )
    held = np.linalg.norm(finger.policy(seen.states) - seen.actions, axis=1) > 1e-9
    table = markdown.table(
        ["learnt from constrained movements", "nUPE", "nCPE"],
        [[risk, f"{error['nUPE']:.2g}", f"{error['nCPE']:.2g}"] for risk, error in errors.items()],
    )
    return Outcome(
        title="The finger (Fig. 1)",
        table=f"{table}\n\nLinear policy, {seen.n_episodes} movements with an obstacle each; errors on "
        f"{test.n_episodes} others.\n",
        figures=shown,
        choices=CHOICES,
        findings=(
            f"{held.mean():.0%} of the samples learnt from slide along an obstacle.",
            f"nUPE {errors['inconsistency']['nUPE']:.2g} by inconsistency, {errors['direct']['nUPE']:.2g} directly, "
            f"{errors['adaptive']['nUPE']:.2g} by adaptive, which finds {policies['adaptive'].free_share_:.0%} of the "
            "samples free.",
        ),
        files=(*drawn, write_json(out / "errors.json", errors)),
    )
