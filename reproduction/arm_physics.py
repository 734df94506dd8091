"""The arm in physics: recorded from MuJoCo's dynamics, with nothing of the method in the loop."""

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console

from reproduction import arm_trials
from reproduction.errors import both
from reproduction.outcome import Outcome
from reproduction.plants import arm_dynamics
from reproduction.plants.arm import PowerPolicy
from reproduction.plants.arm_dynamics import GRIPPED, SCENARIOS, TABLE
from reproduction.plants.rendering import Camera, NoOpenGL
from reproduction.trials import run_trials
from unconstrain import atomic, plot
from unconstrain.plot.colors import DIRECT, LEARNT, RECORDED
from unconstrain.robots import import_mujoco
from unconstrain.selection import select_policy

TRIALS = 50
EPISODES, NEW_EPISODES = 50, 12
POWER, GAIN = 1.8, 0.5

NAMES = {GRIPPED: "hand gripped (1-2-3)", TABLE: "hand on a table"}
METHODS = ("direct", "inconsistency", "auto")

FRAMES = (0.0, 0.8, 3.9)
VIEW = {"distance": 1.75, "azimuth": 140.0, "elevation": -14.0}
"""Seconds at which frames are drawn, and from where: metres and degrees."""

SETTINGS = {
    "episodes": EPISODES,
    "new episodes": NEW_EPISODES,
    "p": POWER,
    "gain": GAIN,
    "servo": arm_dynamics.SERVO_GAIN,
    "noise": arm_dynamics.ENCODER_NOISE,
    "window": arm_dynamics.WINDOW,
}

CHOICES = (
    f"p = {POWER}; a step of the paper lasts 0.1 s, so π = -{GAIN} ∇Φ in rad/s.",
    f"{EPISODES} trajectories of 4 s at 50 Hz to learn from, and {NEW_EPISODES} from new starts to test on.",
    f"Servo gain {arm_dynamics.SERVO_GAIN:g} N m s/rad in all joints; gravity compensated, as the arm's own "
    "controller does; the table without friction.",
    f"Encoder noise {arm_dynamics.ENCODER_NOISE:g} rad; velocities by Savitzky-Golay over {arm_dynamics.WINDOW:g} s.",
    "The arm hangs over the table, so that its policy leads the hand down to it; the table's depth is uniform in "
    f"{arm_dynamics.DEPTH[0]:g} to {arm_dynamics.DEPTH[1]:g} m below the base, its tilt up to "
    f"{np.degrees(arm_dynamics.TILT):.0f}°, both drawn for each trajectory.",
)


def trial(scenarios: tuple[str, ...], seed: int, episodes: int = EPISODES) -> dict[str, dict[str, Any]]:
    """One data set of each scenario: errors of three ways to learn, and how ideal the physics was."""
    return {scenario: _trial(scenario, seed, episodes) for scenario in scenarios}


def _trial(scenario: str, seed: int, episodes: int) -> dict[str, Any]:
    new = max(1, episodes * NEW_EPISODES // EPISODES)
    recording = arm_dynamics.demonstrate(
        scenario, PowerPolicy(POWER, GAIN), episodes + new, random_state=seed
    )
    everything = recording.demonstrations
    training = everything.select(everything.episodes < episodes)
    test = everything.select(everything.episodes >= episodes)
    X, U, groups = training.states, training.actions, training.episodes
    found = select_policy(arm_trials.candidates(), X, U, groups=groups)
    policies = {
        "direct": arm_trials.local_models("direct").fit(X, U, groups=groups),
        "inconsistency": found.policies["locally linear"],
        "auto": found.policy,
    }
    result: dict[str, Any] = {"chosen": found.name}
    for name, policy in policies.items():
        result |= {
            f"{name} {error}": value for error, value in both(test, policy.predict(test.states)).items()
        }
    angle = np.degrees(recording.off_projection())
    away = np.sum((everything.actions - recording.ideal) ** 2) / np.sum(recording.ideal**2)
    if scenario == TABLE:
        forces = np.linalg.norm(recording.contact_force[recording.touching], axis=1)
        result["force, median"] = float(np.median(forces))
    return result | {
        "angle, median": float(np.nanmedian(angle)),
        "angle, 90 %": float(np.nanpercentile(angle, 90)),
        "off the projection": float(np.sqrt(away)),
        "touching": float(recording.touching.mean()),
    }


def reproduce(out: Path, *, trials: int | None, jobs: int, console: Console) -> Outcome:
    """Both scenarios over 50 data sets, or as many as asked for. Raises `UnconstrainError` without the extra `sim`."""
    import_mujoco()
    results = run_trials(
        partial(trial, SCENARIOS),
        TRIALS if trials is None else trials,
        out / "physics.jsonl",
        settings=SETTINGS,
        jobs=jobs,
        console=console,
        label="arm, physics",
    )
    written = out / "physics.json"
    with atomic.replacing(written) as temporary:
        temporary.write_text(json.dumps({"settings": SETTINGS, "trials": results}, indent=1))
    pictures, files = {}, [written, out / "physics.jsonl"]
    caption = f"nUPE in physics: {len(results)} data sets of each scenario."
    pictures[plot.save(error_figure(results), out / "physics.png")] = caption
    files.append(plot.save(error_figure(results), out / "physics.svg"))
    findings = _findings(results)
    try:
        frames = frame_figure()
        pictures[plot.save(frames, out / "frames.png")] = (
            "Frames of the first movement: the hand gripped, and sliding on a table."
        )
    except NoOpenGL as error:
        findings = (*findings, f"No frames: {error}.")
    return Outcome(
        title="The arm in physics",
        table=table(results),
        figures=pictures,
        choices=CHOICES,
        findings=findings,
        files=tuple(files),
    )


def table(results: list[dict[str, dict[str, Any]]]) -> str:
    """Errors of the three ways to learn, and the distance from the ideal projection, for both scenarios."""
    lines = [
        f"x 10^-2, mean ± s.d. over {len(results)} data sets; trajectories from new starts.",
        "",
        "| scenario | "
        + " | ".join(f"{name} {error}" for error in ("nUPE", "nCPE") for name in METHODS)
        + " |",
        "| --- " * 7 + "|",
    ]
    for scenario in SCENARIOS:
        cells = []
        for error in ("nUPE", "nCPE"):
            for name in METHODS:
                numbers = 100 * _numbers(results, scenario, f"{name} {error}")
                cells.append(f"{numbers.mean():.3g} ± {numbers.std():.2g}")
        lines.append(f"| {NAMES[scenario]} | " + " | ".join(cells) + " |")
    lines += [
        "",
        "How far recorded actions are from Nπ of the ideal constraint, mean over data sets:",
        "",
        "| scenario | angle, median | angle, 90 % below | r.m.s. difference, share of Nπ | samples constrained |",
        "| --- " * 5 + "|",
    ]
    for scenario in SCENARIOS:
        median, most, away, touching = (
            _numbers(results, scenario, key).mean()
            for key in ("angle, median", "angle, 90 %", "off the projection", "touching")
        )
        lines.append(f"| {NAMES[scenario]} | {median:.2f}° | {most:.1f}° | {away:.1%} | {touching:.0%} |")
    return "\n".join(lines)


def _findings(results: list[dict[str, dict[str, Any]]]) -> tuple[str, ...]:
    findings = []
    for scenario in SCENARIOS:
        direct, local, auto = (_numbers(results, scenario, f"{name} nUPE").mean() for name in METHODS)
        names = [result[scenario]["chosen"] for result in results]
        counts = ", ".join(f"{name} ({names.count(name)})" for name in dict.fromkeys(names))
        findings.append(
            f"{NAMES[scenario]}: nUPE {direct:.3g} by direct regression, {local:.3g} by inconsistency with local "
            f"models, {auto:.2g} with the model chosen by inconsistency: {counts}."
        )
    return tuple(findings)


def error_figure(results: list[dict[str, dict[str, Any]]]) -> Figure:
    """nUPE of every data set, by way of learning; log scale."""
    figure = Figure(figsize=(8.4, 3.8), layout="constrained")
    colors = {"direct": DIRECT, "inconsistency": RECORDED, "auto": LEARNT}
    for ax, scenario in zip(figure.subplots(1, 2, sharey=True), SCENARIOS, strict=True):
        for i, name in enumerate(METHODS):
            numbers = _numbers(results, scenario, f"{name} nUPE")
            spread = np.linspace(-0.18, 0.18, len(numbers)) if len(numbers) > 1 else [0.0]
            ax.plot(i + np.asarray(spread), numbers, ".", color=colors[name], alpha=0.6, ms=5)
            ax.plot([i - 0.25, i + 0.25], [numbers.mean()] * 2, color=colors[name], lw=2)
        ax.set_yscale("log")
        ax.set_xticks(range(3), ["direct", "inconsistency,\nlocal models", "inconsistency,\nmodel chosen"])
        ax.set_xlim(-0.5, 2.5)
        ax.set_title(NAMES[scenario], fontsize=10.5)
        ax.grid(axis="y", alpha=0.3)
    figure.axes[0].set_ylabel("nUPE, new starts")
    return figure


def frame_figure(seed: int = 0) -> Figure:
    """Rendered frames of each scenario, from the first movement of data set `seed`. Raises `NoOpenGL`."""
    figure = Figure(figsize=(9.0, 6.4), layout="constrained")
    for axes, scenario in zip(figure.subplots(2, len(FRAMES)), SCENARIOS, strict=True):
        recording = arm_dynamics.demonstrate(
            scenario, PowerPolicy(POWER, GAIN), 1, encoder_noise=0.0, random_state=seed
        )
        demos = recording.demonstrations
        robot = arm_dynamics.staged(recording, scenario, episode=0)
        middle = 0.6 if scenario == GRIPPED else -0.65
        with Camera(robot.model, 720, 640, at=(0.0, 0.0, middle), **VIEW) as view:
            for ax, second in zip(axes, FRAMES, strict=True):
                ax.imshow(view.picture(demos.states[round(second * arm_dynamics.RATE)]))
                ax.set_title(f"{NAMES[scenario]}, {second:g} s", fontsize=9.5)
                ax.set_axis_off()
    return figure


def _numbers(results: list[dict[str, dict[str, Any]]], scenario: str, key: str) -> np.ndarray:
    return np.array([result[scenario][key] for result in results])
