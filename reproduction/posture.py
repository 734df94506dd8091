"""A posture in 27 dimensions, with a wall in the way of the hands (section 4.4)."""

import os
from collections.abc import Iterable
from dataclasses import asdict
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from rich.console import Console

from reproduction import published
from reproduction.errors import both
from reproduction.outcome import Outcome, write_results
from reproduction.plants.barrier import CLEARANCE, Wall, blocking
from reproduction.plants.humanoid import Humanoid
from reproduction.robots import OUR_OWN, RobotChoice
from reproduction.trials import run_trials
from unconstrain import plot
from unconstrain.constraints import projection
from unconstrain.demonstrations import Demonstrations
from unconstrain.plot.colors import DIRECT, LEARNT, TRUE
from unconstrain.policies import ParametricPolicy

Array = NDArray[np.float64]

TRIALS = 100
KINDS = ("inconsistency", "direct")

WEIGHT = 0.05
"""W = 0.05 I in φ = (x - x_c)ᵀ W (x - x_c), so that π = -∇φ = -0.1 (x - x_c)."""

TILT = np.pi / 4
"""The wall is turned to the side and tilted by up to this, in radians, uniformly."""

NEAREST, FARTHEST = 0.3, 0.9
"""Where the wall stands, uniformly, as a share of the way from the hands at home to the hands outstretched."""

HELD_OUT = 0.2
"""Movements made for the test alone, as a share of those to learn from."""

CHOICES = (
    f"W = {WEIGHT:g} I, so that π = -∇φ = -{2 * WEIGHT:g} (x - x_c); the step is one, x ← x + u.",
    "Starts are N(q0, 0.1 I), clipped to the joint limits and free of self-collision.",
    f"The wall stands at {NEAREST:g} to {FARTHEST:g} of the way from the hands at home to the hands outstretched, "
    f"turned and tilted by up to {np.degrees(TILT):.0f}°, all uniformly; drawn anew while a hand would start in it.",
    f"A hand is blocked when nearer than {CLEARANCE:g} m to the wall and led nearer still: nᵀ J u = 0. A joint whose "
    "next step would leave its limits is held.",
    "The pelvis stands still: joint space is seen from there, and the wall is met by the arms and the waist.",
    f"Errors are taken on {HELD_OUT:.0%} as many other movements; λ is chosen among 25 values by the held-out risk of "
    "five folds of movements.",
)


def walls(humanoid: Humanoid, hands: Array, rng: np.random.Generator) -> Wall:
    """A wall in front of the robot for each of the hands' starts (S, 2, 3), drawn anew while a hand is too near.

    Where a hand starts so far out that no such wall leaves it room, the walls drawn move farther away.
    """
    (home, out), _ = humanoid.hand_motion(np.stack([humanoid.home, humanoid.outstretched]))
    points, normals = np.empty((2, len(hands), 3))
    for start, point, normal in zip(hands, points, normals, strict=True):
        for draw in count():
            farthest = FARTHEST + 0.1 * (draw // 100)
            share, yaw, pitch = rng.uniform([NEAREST, -TILT, -TILT], [farthest, TILT, TILT])
            point[:] = (1 - share) * home.mean(axis=0) + share * out.mean(axis=0)
            normal[:] = -np.cos(yaw) * np.cos(pitch), -np.sin(yaw) * np.cos(pitch), np.sin(pitch)
            if ((start - point) @ normal > CLEARANCE).all():
                break
    return Wall(points, normals)


def demonstrate(
    humanoid: Humanoid,
    n_episodes: int = 100,
    length: int = 100,
    *,
    random_state: int | np.random.Generator | None = None,
) -> tuple[Demonstrations, NDArray[np.bool_]]:
    """Movements towards the outstretched posture, `x ← x + N(x) π(x)`, with a wall in the way of the hands.

    A hand nearer to its movement's wall than `CLEARANCE`, that the policy would bring nearer still, must not move
    along the wall's normal n: `nᵀ J_hand(x) u = 0` is then a row of A, over the n joints. A joint at its limit is
    held.

    Returns
    -------
    demonstrations : Demonstrations
        ``n_episodes * length`` samples over the humanoid's joints, in radians and radians per step, with the true
        policy and projections. Time counts steps.
    blocked : array (N,) of bool
        Samples at which the wall stops a hand.
    """
    rng = np.random.default_rng(random_state)
    n = humanoid.n
    x = humanoid.start_postures(n_episodes, rng)
    wall = walls(humanoid, humanoid.hand_motion(x)[0], rng)
    states, wanted, actions = np.empty((3, n_episodes, length, n))
    N = np.empty((n_episodes, length, n, n))
    blocked = np.empty((n_episodes, length), dtype=bool)
    for k in range(length):
        states[:, k] = x
        wanted[:, k] = -2 * WEIGHT * (x - humanoid.outstretched)
        hands, J = humanoid.hand_motion(x)
        rows, touching = blocking(wall, hands, np.einsum("shdn,sn->shd", J, wanted[:, k]))
        A = np.einsum("shd,shdn->shn", rows[:, :, 0], J)
        N[:, k], actions[:, k] = _constrained(A, wanted[:, k], x, humanoid.robot.limits)
        blocked[:, k] = touching.any(axis=1)
        x = x + actions[:, k]
    demonstrations = Demonstrations(
        states=states.reshape(-1, n),
        actions=actions.reshape(-1, n),
        episodes=np.repeat(np.arange(n_episodes), length),
        time=np.tile(np.arange(float(length)), n_episodes),
        policy=wanted.reshape(-1, n),
        projections=N.reshape(-1, n, n),
        state_names=humanoid.robot.joints,
        action_names=humanoid.robot.joints,
    )
    return demonstrations, blocked.ravel()


def _constrained(A: Array, wanted: Array, x: Array, limits: Array) -> tuple[Array, Array]:
    """Projections N (S, n, n) and actions (S, n) under rows A (S, k, n), no joint led out of its limits (n, 2).

    A joint whose next step would leave them is held as well, which is one more row of A: its own unit vector.
    """
    free = np.ones(x.shape, dtype=bool)
    N, u = np.empty((*x.shape, x.shape[1])), np.empty(x.shape)
    changed = np.arange(len(x))
    while len(changed):
        still = free[changed]
        # Rows over the free joints alone project these; held joints do not move, whatever the others do.
        N[changed] = projection(A[changed] * still[:, None]) * (still[:, :, None] & still[:, None, :])
        u[changed] = np.einsum("sij,sj->si", N[changed], wanted[changed])
        leaving = (x + u < limits[:, 0]) | (x + u > limits[:, 1])
        leaving &= free & (u != 0)
        free &= ~leaving
        changed = np.flatnonzero(leaving.any(axis=1))
    return N, u


def trial(
    seed: int, choice: RobotChoice = OUR_OWN, n_episodes: int = 100, length: int = 100
) -> dict[str, Any]:
    """One data set: normalised errors of a linear policy on movements it has not seen, and what the wall did."""
    humanoid = choice.humanoid()
    held_out = max(1, round(HELD_OUT * n_episodes))
    everything, blocked = demonstrate(humanoid, n_episodes + held_out, length, random_state=seed)
    train = everything.select(everything.episodes < n_episodes)
    test = everything.select(everything.episodes >= n_episodes)
    result: dict[str, Any] = {}
    for kind in KINDS:
        policy = ParametricPolicy(risk=kind, alpha="cv").fit(
            train.states, train.actions, groups=train.episodes
        )
        result[kind] = both(test, policy.predict(test.states))
    blocked = blocked[: len(train)].reshape(n_episodes, length)
    result["samples the wall blocks"] = float(blocked.mean())
    result["movements that meet the wall"] = float(blocked.any(axis=1).mean())
    return result


def reproduce(
    out: Path,
    *,
    trials: int | None = None,
    jobs: int = 1,
    console: Console,
    robot: str | os.PathLike[str] | None = None,
    lock: str | Iterable[str] = (),
    hands: str | Iterable[str] = (),
) -> Outcome:
    """Run the trials, and write the table and the JSON of all trials into `out`.

    robot, lock, hands: another robot, as for `Humanoid.load`.
    """
    choice = RobotChoice.of(robot, lock, hands)
    n = choice.humanoid().n  # a robot that cannot be used is told at once
    settings = {"experiment": "posture", "robot": asdict(choice), "weight": WEIGHT, "version": 1}
    results = run_trials(
        partial(trial, choice=choice),
        trials or TRIALS, out / "trials.jsonl", settings=settings, jobs=jobs, console=console, label="posture",
    )  # fmt: skip
    table = _table(results)
    files = write_results(out, {"settings": settings, "trials": results}, table)
    plot.save(_figure(results), out / "errors.png")
    return Outcome(
        title=f"A posture in {n} dimensions, a wall in the hands' way (Sec. IV-D)",
        table=table,
        figures={
            out / "errors.png": "Normalised errors of every data set, and the published means (dashed)."
        },
        choices=CHOICES,
        findings=_findings(results, n),
        files=files,
    )


def _values(results: list[dict], kind: str, error: str) -> Array:
    return np.array([result[kind][error] for result in results])


def _table(results: list[dict]) -> str:
    lines = ["| risk | nUPE published | nUPE ours | nCPE ours |", "| --- | --- | --- | --- |"]
    for kind in KINDS:
        mean, deviation = published.POSTURE_NUPE[kind]
        ours = [_values(results, kind, error) for error in ("nUPE", "nCPE")]
        cells = [f"{values.mean():.2g} ± {values.std():.2g}" for values in ours]
        lines.append(f"| {kind} | {mean:.5f} ± {deviation:.5f} | {' | '.join(cells)} |")
    return "\n".join(lines) + f"\n\nMean ± standard deviation over {len(results)} data sets.\n"


def _findings(results: list[dict], n: int) -> tuple[str, ...]:
    ours, direct = (_values(results, kind, "nUPE").mean() for kind in KINDS)
    met = np.array([result["movements that meet the wall"] for result in results])
    share = np.array([result["samples the wall blocks"] for result in results])
    return (
        f"Mean nUPE {ours:.2g} with {n * (n + 1)} parameters (published "
        f"{published.POSTURE_NUPE['inconsistency'][0]:g}); direct regression {direct:.2g}, "
        f"{direct / ours:.0f} times that.",
        f"{100 * met.mean():.0f} % of the movements meet the wall; it blocks a hand at {100 * share.mean():.0f} % of "
        "the samples.",
    )


def _figure(results: list[dict]) -> Figure:
    figure = Figure(figsize=(7.0, 3.2), layout="constrained")
    ax = figure.subplots()
    for row, (kind, color) in enumerate(zip(KINDS, (LEARNT, DIRECT), strict=True)):
        values = _values(results, kind, "nUPE")
        ax.plot(values, np.full(len(values), row), "o", color=color, alpha=0.35, ms=6, mec="none")
        mean = published.POSTURE_NUPE[kind][0]
        ax.plot([mean, mean], [row - 0.3, row + 0.3], "--", color=TRUE, lw=1.2)
    ax.set(xscale="log", xlabel="nUPE", yticks=range(len(KINDS)), yticklabels=KINDS, ylim=(-0.6, 1.6))
    ax.grid(axis="x", alpha=0.3)
    return figure
