"""Constraints learnt, measured, and used: beyond the paper, up to what later papers on learning constraints show."""

import os
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from reproduction import constraints_figures
from reproduction.constraints_surfaces import BLOCKS, Surfaces, found
from reproduction.constraints_trials import (
    ARM_EPISODES,
    ARM_LENGTH,
    CONDITIONS,
    EPISODES,
    GRASP_MODELS,
    GRASPS,
    KINDS,
    LENGTH,
    MARGIN,
    NOISE,
    PHYSICS_EPISODES,
    SENSOR_NOISE,
    SWEPT,
    THRESHOLD,
    measured_trial,
    trial,
)
from reproduction.outcome import Outcome, write_results
from reproduction.trials import run_trials
from unconstrain import plot
from unconstrain.errors import UnconstrainError
from unconstrain.robots import import_mujoco

TRIALS = 50
RECORDINGS = Path("../shared/data")
EXACT = 1e-20
"""Errors below this are rounding."""

CHOICES = (
    f"2-D and planar arms: {EPISODES} movements of {LENGTH} samples; 7-DOF arm: {ARM_EPISODES} of {ARM_LENGTH}. Learnt "
    "from one half of the movements, tested on the other, without noise.",
    "Parabolas have rows (-2 a x1, 1) with 0.2 < |a| < 2; the features are (x, 1). Arms have their task Jacobian as "
    "features, and the number of rows is found, not given.",
    f"The chain: {CONDITIONS} random constraints, each a task whose velocity varies as much as the policy.",
    f"Measured: {PHYSICS_EPISODES} movements of the arm in physics over tables, a force sensor with noise of "
    f"{SENSOR_NOISE:g} N in each axis, contact above {THRESHOLD:g} N, {MARGIN} samples around each landing unknown; "
    f"{GRASPS} movements of the humanoid through the gap, {GRASP_MODELS} local models.",
    f"Recordings: errors on {BLOCKS} blocks of each recording, held out in five folds.",
)


def reproduce(
    out: Path,
    *,
    trials: int | None = None,
    jobs: int = 1,
    console: Console,
    data: str | os.PathLike[str] = RECORDINGS,
) -> Outcome:
    """Run the trials, and write tables, figures and the JSON of all trials into `out`.

    data: the folder of the recorded surfaces; where it is missing they are left out, and that is said. What needs the
    extra `sim` is left out likewise.
    """
    trials = trials or TRIALS
    settings = {"experiment": "constraints", "noise": NOISE, "version": 1}
    results = run_trials(
        trial, trials, out / "trials.jsonl", settings=settings, jobs=jobs, console=console, label="learnt"
    )
    kept: dict[str, Any] = {"settings": settings, "trials": results}
    tables, findings = [_learnt_table(results), _chain_table(results)], list(_findings(results))
    pictures = {
        "noise": (
            constraints_figures.noise(results),
            "nPPE against noise on the actions; medians and quartiles.",
        ),
        "rows": (
            constraints_figures.rows(results),
            "Which of the six task coordinates are found to be fixed.",
        ),
    }
    try:
        import_mujoco()
    except UnconstrainError as error:
        findings.append(f"Measured constraints are left out: {error}.")
    else:
        measured = run_trials(
            measured_trial, trials, out / "measured.jsonl",
            settings=settings | {"sensor": [SENSOR_NOISE, THRESHOLD, MARGIN], "grasps": [GRASPS, GRASP_MODELS]},
            jobs=jobs, console=console, label="measured",
        )  # fmt: skip
        kept["measured"] = measured
        tables.append(_measured_table(measured))
        findings += _measured_findings(measured)
        pictures["measured"] = (
            constraints_figures.measured(measured),
            "nUPE of each data set, by what is known.",
        )
    surfaces = found(Path(data))
    if surfaces is None:
        findings.append(f"The recorded surfaces are left out: they are not in {Path(data)}.")
    else:
        tables.append(_surfaces_table(surfaces))
        findings += _surfaces_findings(surfaces)
        caption = "The recorded surfaces, with the normals learnt; the held-out error by number of RBFs."
        pictures["surfaces"] = (constraints_figures.surfaces(surfaces), caption)

    table = "\n\n".join(tables) + "\n"
    files = write_results(out, kept, table)
    shown = {plot.save(figure, out / f"{name}.png"): caption for name, (figure, caption) in pictures.items()}
    drawn = [plot.save(figure, out / f"{name}.svg") for name, (figure, _) in pictures.items()]
    return Outcome(
        title="Constraints learnt, measured and used",
        table=table,
        figures=shown,
        choices=CHOICES,
        findings=tuple(findings),
        files=(*files, *drawn),
    )


def _settings(results: list[dict]) -> list[str]:
    return [name for name in results[0] if name != "chain" and not name.endswith(", noise")]


def _learnt_table(results: list[dict]) -> str:
    lines = [
        "| constraint, policy | rows found | nPPE, median | nPPE, worst | nPOE, median |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name in _settings(results):
        ppe, poe = (np.array([result[name][error] for result in results]) for error in ("nPPE", "nPOE"))
        rows = sorted({result[name]["rows"] for result in results})
        lines.append(
            f"| {name} | {', '.join(map(str, rows))} | {np.median(ppe):.1e} | {ppe.max():.1e} | {np.median(poe):.1e} |"
        )
    return "\n".join(lines) + f"\n\nWithout noise, over {len(results)} data sets; held-out movements."


def _chain_table(results: list[dict]) -> str:
    lines = ["| a task beneath which the policy moves | nUPE, median | nUPE, worst |", "| --- | --- | --- |"]
    for name in results[0]["chain"]:
        values = np.array([result["chain"][name] for result in results])
        lines.append(f"| {name} | {np.median(values):.2g} | {values.max():.2g} |")
    return "\n".join(lines)


def _findings(results: list[dict]) -> tuple[str, ...]:
    worst = max(result[name]["nPPE"] for result in results for name in _settings(results))
    exact = np.mean([result[name]["nPPE"] < EXACT for result in results for name in _settings(results)])
    named = np.mean(
        [
            np.allclose(
                result[f"7-DOF arm, {kind}"]["features"],
                np.isin(np.arange(1, 7), [int(row) for row in kind.split("-")]),
                atol=1e-6,
            )
            for result in results
            for kind in KINDS
        ]
    )
    at = NOISE.index(0.1)
    noisy = ", ".join(
        f"{np.nanmedian([result[f'{name}, noise'][at]['nPPE'] for result in results]):.1e} ({name})"
        for name in SWEPT
    )
    return (
        f"Without noise {exact:.0%} of the constraints are found to rounding (nPPE below {EXACT:g}), the worst with "
        f"{worst:.1e}.",
        f"The fixed rows of the 7-DOF arm's six task coordinates are named rightly in {named:.0%} of the data sets.",
        f"With noise of 10 % of the actions the median nPPE is {noisy}.",
    )


def _measured(results: list[dict], plant: str, name: str) -> np.ndarray:
    return np.array([result[plant][name] for result in results])


MEASURED = {
    "arm on a table, model chosen": ("arm", "inconsistency", "forces", 5),
    "arm on a table, local models": ("arm", "inconsistency, local models", "forces, local models", 5),
    f"grasp, {GRASPS} movements": ("grasp", "inconsistency", "projections", 50),
}
"""By name: the plant, the error by inconsistency, the error with the constraints, and the ratio aimed at."""


def _measured_table(results: list[dict]) -> str:
    lines = [
        "| data | nUPE by inconsistency | nUPE with the constraints | ratio of means | aimed at |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name, (plant, without, with_, aim) in MEASURED.items():
        a, b = _measured(results, plant, without), _measured(results, plant, with_)
        lines.append(
            f"| {name} | {a.mean():.2g} ± {a.std():.1g} | {b.mean():.2g} ± {b.std():.1g} | {a.mean() / b.mean():.3g} "
            f"| {aim} |"
        )
    return "\n".join(lines) + (
        f"\n\nMean ± standard deviation over {len(results)} data sets, on movements from new starts. The arm's "
        "constraints are read off a noisy force sensor; the grasp's are the true projections."
    )


def _measured_findings(results: list[dict]) -> tuple[str, ...]:
    sentences = []
    for name, (plant, without, with_, aim) in MEASURED.items():
        ratio = _measured(results, plant, without).mean() / _measured(results, plant, with_).mean()
        verdict = "reached" if ratio >= aim else "missed"
        sentences.append(
            f"{name}: the error falls {ratio:.3g} times with the constraints; {aim} times was aimed at, {verdict}."
        )
    return tuple(sentences)


def _surfaces_table(surfaces: Surfaces) -> str:
    lines = ["| surface | constraint | nPOE, held out |", "| --- | --- | --- |"]
    for surface, errors in (("flat", surfaces.flat_errors), ("curved", surfaces.curved_errors)):
        lines += [f"| {surface} | {name} | {error:.4f} |" for name, error in errors.items()]
    lines += [
        "",
        "| surface | policy | learnt with | along the action | under the learnt constraint |",
        "| --- | --- | --- | --- | --- |",
    ]
    for surface, errors in surfaces.policies.items():
        for key in errors:
            kind, way, error = key.split(", ")
            if error == "inconsistency":
                lines.append(
                    f"| {surface} | {kind} | {way} | {errors[key]:.3f} | {errors[f'{kind}, {way}, constrained']:.3f} |"
                )
    return "\n".join(lines) + (
        "\n\nPolicy errors on held-out blocks, as shares of the actions' variance: (r - û·π)², and ‖N(u - π)‖² with "
        "the learnt N."
    )


def _surfaces_findings(surfaces: Surfaces) -> tuple[str, ...]:
    flat, curved = surfaces.policies["flat"], surfaces.policies["curved"]
    changes = ", ".join(
        f"{errors[f'{kind}, learnt constraint, constrained'] / errors[f'{kind}, inconsistency, constrained'] - 1:+.0%} "
        f"({name}, {kind})"
        for name, errors in (("flat", flat), ("curved", curved))
        for kind in ("local models", "RBFs")
    )
    return (
        f"Flat surface: the direction hardly moved in is {surfaces.angle:.1f}° from the normal of the plane through "
        f"the points, with a standard error of {surfaces.uncertainty:.1f}°; {surfaces.shares[0]:.1%} of the motion is "
        "along it.",
        f"Curved surface: {surfaces.best} RBFs bring the held-out nPOE from "
        f"{surfaces.curved_errors['constant row']:.3f} (constant) to {min(surfaces.curved_errors.values()):.3f}.",
        f"Policies with the learnt projections: held-out error under the constraint {changes}. A policy of position "
        "alone explains little of these recordings either way: the finger passes the same places in different "
        "directions.",
    )
