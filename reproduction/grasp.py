"""Grasping a ball through a gap in a barrier (section 4.3, Table II)."""

import os
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from sklearn.preprocessing import PolynomialFeatures

from reproduction import published
from reproduction.errors import ncpe, nupe
from reproduction.outcome import Outcome, write_results
from reproduction.plants.barrier import CLEARANCE, Barrier
from reproduction.plants.grasping import (
    ALPHA,
    DURATION,
    RATE,
    SIGMA_SQUARED,
    Demonstrator,
    Recording,
    constrain,
)
from reproduction.robots import OUR_OWN, RobotChoice
from reproduction.trials import run_trials
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import UnconstrainError
from unconstrain.features import PotentialFeatures
from unconstrain.policies import LocallyLinearPolicy, ParametricPolicy
from unconstrain.policies.base import Policy
from unconstrain.selection import candidates, select_policy

Array = NDArray[np.float64]

TRIALS = 50
COLUMNS = tuple(published.GRASP)

GAP_MEAN, GAP_DEVIATION = 0.25, 0.1
"""The gap's width is drawn from this Gaussian for each movement, in metres."""

N_MODELS = 150

POTENTIAL_DEGREE = 4
"""Of the polynomial potential: the expert's is a Gaussian, even and nearly a parabola over the table."""

HELD_OUT = 0.2
"""Movements made for each test alone, as a share of those to learn from."""


def columns(demonstrator: Demonstrator, test: Demonstrations, P: Array) -> dict[str, float]:
    """Table II's three columns for predictions P (N, 6) at held-out states: one error, three projections of it."""
    assert test.policy is not None
    unseen, _ = constrain(demonstrator.scene.central(len(test)), test.states, test.policy)
    errors = (ncpe(test, P), ncpe(test, P, unseen), nupe(test, P))
    return dict(zip(COLUMNS, errors, strict=True))


def model(kind: str, name: str = "local") -> Policy | dict[str, Policy]:
    """The model of either approach, `kind` "inconsistency" or "direct"; λ by cross-validation of that.

    name: "local" for the 150 local models with centres by k-means, "potential" for a potential that is a polynomial of
    degree 4 in the hands' positions, "auto" for a choice of candidates, these two among them.
    """
    local = LocallyLinearPolicy(centers="kmeans", n_centers=N_MODELS, risk=kind, alpha="cv")
    if name == "local":
        return local
    potential = ParametricPolicy(
        PotentialFeatures(PolynomialFeatures(POTENTIAL_DEGREE)), risk=kind, alpha="cv"
    )
    if name == "potential":
        return potential
    if name == "auto":
        return {**candidates(6, 6), "150 local models": local, "quartic potential": potential}
    raise UnconstrainError(f"there is no model {name!r} for the grasp: choose local, potential or auto")


def learn(D: Demonstrations, kind: str, name: str = "local") -> tuple[Policy, str]:
    """The policy learnt from demonstrations, and what it is called: for "auto" that of the chosen candidate."""
    made = model(kind, name)
    if isinstance(made, dict):
        chosen = select_policy(made, D.states, D.actions, groups=D.episodes)
        return chosen.policy, chosen.name
    return made.fit(D.states, D.actions, groups=D.episodes), name


@lru_cache(maxsize=1)
def demonstrator_of(choice: RobotChoice) -> Demonstrator:
    """The demonstrator with the robot chosen, made once in each process."""
    return Demonstrator(choice.humanoid())


def trial(
    seed: int,
    choice: RobotChoice = OUR_OWN,
    name: str = "local",
    n_episodes: int = 100,
    duration: float = DURATION,
) -> dict[str, Any]:
    """One data set: normalised errors of both approaches, and what happened in it.

    The errors named as Table II's columns are those at the states of held-out movements under training constraints,
    projected as each column says. Those that end in "moving" are errors along movements the expert makes under the
    column's own constraint. "direct" always has the 150 local models.
    """
    demonstrator, rng = demonstrator_of(choice), np.random.default_rng(seed)
    held_out = max(2, round(HELD_OUT * n_episodes))
    train, _ = training(demonstrator, rng, n_episodes, duration)
    test, _ = training(demonstrator, rng, held_out, duration)
    barred = demonstrator.scene.central(held_out)
    around = demonstrator.record(barred, demonstrator.starts(held_out, rng), duration=duration)
    free = demonstrator.record(None, demonstrator.starts(held_out, rng), duration=duration)

    result: dict[str, Any] = {}
    for kind in ("inconsistency", "direct"):
        policy, chosen = learn(train.demonstrations, kind, name if kind == "inconsistency" else "local")
        errors = columns(demonstrator, test.demonstrations, policy.predict(test.demonstrations.states))
        for movements, column in ((around, COLUMNS[1]), (free, COLUMNS[2])):
            M = movements.demonstrations
            errors[f"{column}, moving"] = ncpe(M, policy.predict(M.states))
        result[kind] = errors
        result[f"{kind} model"] = chosen
    return result | {
        "movements that meet the barrier": train.movements_blocked,
        "samples the barrier blocks": float(train.blocked.any(axis=1).mean()),
        "movements that meet the unseen barrier": around.movements_blocked,
        "tracking error": train.tracking,
    }


def training(
    demonstrator: Demonstrator,
    random_state: int | np.random.Generator | None,
    n: int = 100,
    duration: float = DURATION,
) -> tuple[Recording, Barrier]:
    """n movements through gaps of random width, and the barriers they met."""
    rng = np.random.default_rng(random_state)
    obstacle = demonstrator.scene.with_gap(rng.normal(GAP_MEAN, GAP_DEVIATION, n))
    return demonstrator.record(obstacle, demonstrator.starts(n, rng), duration=duration), obstacle


def reproduce(
    out: Path,
    *,
    trials: int | None = None,
    jobs: int = 1,
    console: Console,
    model: str = "local",
    robot: str | os.PathLike[str] | None = None,
    lock: str | Iterable[str] = (),
    hands: str | Iterable[str] = (),
    feet: str | Iterable[str] = (),
    video: str | os.PathLike[str] | None = None,
) -> Outcome:
    """Run the trials, and write Table II, Figs. 5 and 6, and the JSON of all trials into `out`.

    model: "local", "potential" or "auto". robot, lock, hands, feet: another robot, as for `Humanoid.load`.
    video: an .mp4 file to write as well. Without OpenGL the pictures of the robot are left out, and that is said.
    """
    from reproduction import grasp_figures, grasp_video

    trials = trials or TRIALS
    choice = RobotChoice.of(robot, lock, hands, feet)
    demonstrator = demonstrator_of(choice)  # a robot that cannot be used is told at once
    _checked_model(model)
    settings = {"experiment": "grasp", "model": model, "robot": asdict(choice), "rate": RATE, "version": 1}
    results = run_trials(
        partial(trial, choice=choice, name=model),
        trials, out / "trials.jsonl", settings=settings, jobs=jobs, console=console, label="grasp",
    )  # fmt: skip
    table = _table(results)
    written = write_results(out, {"settings": settings, "trials": results}, table)

    console.print("drawing data set 0")
    recording, obstacle = training(demonstrator, 0)
    policies: dict[str, Any] = {"expert": demonstrator.policy}
    policies["inconsistency"], _ = learn(recording.demonstrations, "inconsistency", model)
    policies["direct"], _ = learn(recording.demonstrations, "direct")
    pictures = grasp_figures.write(out, demonstrator, recording, obstacle, policies)
    files = [*written, *pictures.files]
    if video is not None:
        console.print(f"filming into {video}")
        files.append(grasp_video.write(video, demonstrator, policies))
    for sentence in pictures.left_out:
        console.print(sentence)
    return Outcome(
        title="Grasping a ball through a gap (Table II, Figs. 5 and 6)",
        table=table,
        figures=pictures.shown,
        choices=_choices(demonstrator),
        findings=(*_findings(results), *pictures.left_out),
        files=tuple(files),
    )


def _checked_model(name: str) -> None:
    model("inconsistency", name)


def _values(results: list[dict], kind: str, column: str) -> Array:
    return np.array([result[kind][column] for result in results])


def _table(results: list[dict]) -> str:
    lines = [
        "| test | direct published | direct ours | inconsistency published | inconsistency ours | direct / ours |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for column in results[0]["direct"]:
        cells = [column]
        for kind in ("direct", "inconsistency"):
            known = published.GRASP.get(column, {}).get(kind)
            values = _values(results, kind, column)
            cells += [
                f"{known[0]:.4f} ± {known[1]:.4f}" if known else "",
                f"{values.mean():.2g} ± {values.std():.2g}" if values.mean() < 1e-4
                else f"{values.mean():.4f} ± {values.std():.4f}",
            ]  # fmt: skip
        ratio = _values(results, "direct", column).mean() / _values(results, "inconsistency", column).mean()
        lines.append(f"| {' | '.join(cells)} | {ratio:.0f} |")
    return (
        "\n".join(lines)
        + f"\n\nMean ± standard deviation over {len(results)} data sets. The first three rows are errors at the states "
        "of held-out movements, under the projections named; those that end in “moving” are errors along movements the "
        "expert makes under that constraint.\n"
    )


def _findings(results: list[dict]) -> tuple[str, ...]:
    met, share, unseen, tracking = (
        np.array([result[fact] for result in results])
        for fact in (
            "movements that meet the barrier",
            "samples the barrier blocks",
            "movements that meet the unseen barrier",
            "tracking error",
        )
    )
    chosen = Counter(result["inconsistency model"] for result in results)
    return (
        *(
            f"{column}: {_values(results, 'inconsistency', column).mean():.2g} "
            f"(published {published.GRASP[column]['inconsistency'][0]:g}); direct is "
            f"{_values(results, 'direct', column).mean() / _values(results, 'inconsistency', column).mean():.0f} times "
            "worse."
            for column in COLUMNS
        ),
        f"Model: {', '.join(f'{name} ({count} of {len(results)})' for name, count in chosen.items())}.",
        f"{100 * met.mean():.0f} % of the movements meet the barrier (at least {100 * met.min():.0f} % in every data "
        f"set); it blocks a hand at {100 * share.mean():.0f} % of the samples. The unseen barrier is met by "
        f"{100 * unseen.mean():.0f} %.",
        f"Whole-body control: the hands' realised velocity differs from the commanded by {tracking.mean():.1e} of it "
        f"(root mean square), {tracking.max():.1e} at most.",
    )


def _choices(demonstrator: Demonstrator) -> tuple[str, ...]:
    scene = demonstrator.scene
    feet = "the feet stay on the floor" if demonstrator.humanoid.feet else "the base stands still"
    return (
        f"π = -{RATE:g} ∇φ with α = {ALPHA:g}, σ² = {SIGMA_SQUARED:g}: the sign is that of an attractor, and the rate "
        f"brings the hands to the ball in {DURATION:g} s.",
        f"A hand is blocked when nearer than {CLEARANCE:g} m to the barrier and led nearer still; the normal is the "
        "direction from the barrier's nearest point, so that a hand can slide around an edge.",
        f"From the middle between the hands at home: the ball {scene.ball[0]:g} m ahead and {-scene.ball[2]:g} m "
        f"lower, the table's edge {scene.table_edge:g} m and the barrier {scene.barrier_x:g} m ahead. The barrier is "
        f"{scene.thickness:g} m thick, {scene.span:g} m wide and {scene.height:g} m high; the unseen one, in the "
        f"middle and without a gap, {scene.central_width:g} m wide. A hand grasps {scene.palm:g} m beside the ball.",
        f"Starts have both hands in front of any barrier's reach by {scene.margin:g} m, above the table, and each on "
        f"its own side. {feet.capitalize()}: a random posture is brought to stand as near to it as that allows.",
        f"Widths of gaps below zero mean no gap. {HELD_OUT:.0%} as many movements as learnt from are held out for each "
        "test.",
        "Recorded velocity is J q̇ of the joint velocities that mink found, at the recorded position.",
        f"Local models: {N_MODELS} centres by k-means, σ 1.5 times their mean spacing; λ among 25 values by "
        "inconsistency held out in five folds of movements (for the direct approach by its own risk).",
        f"Potential: a polynomial of degree {POTENTIAL_DEGREE} (--model potential; a candidate of --model auto).",
    )
