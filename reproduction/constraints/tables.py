"""Constraints learnt and measured as Markdown, and what is to be said about them."""

from typing import Any

import numpy as np

from reproduction import markdown
from reproduction.constraints.measured import GRASPS
from reproduction.constraints.settings import KINDS
from reproduction.constraints.surfaces import Surfaces
from reproduction.constraints.trial import NOISE, SWEPT

Results = list[dict[str, Any]]

EXACT = 1e-20
"""Errors below this are rounding."""

MEASURED = {
    "arm on a table, model chosen": ("arm", "inconsistency", "forces", 5),
    "arm on a table, local models": ("arm", "inconsistency, local models", "forces, local models", 5),
    f"grasp, {GRASPS} movements": ("grasp", "inconsistency", "projections", 50),
}
"""By name: the plant, the error by inconsistency, the error with the constraints, and the ratio aimed at."""


def write_learnt_table(results: Results) -> str:
    """Write the errors of the constraints learnt in every setting."""
    rows = []
    for name in _list_settings(results):
        ppe, poe = (np.array([result[name][error] for result in results]) for error in ("nPPE", "nPOE"))
        found = sorted({result[name]["rows"] for result in results})
        rows.append(
            [
                name,
                ", ".join(map(str, found)),
                f"{np.median(ppe):.1e}",
                f"{ppe.max():.1e}",
                f"{np.median(poe):.1e}",
            ]
        )
    header = ["constraint, policy", "rows found", "nPPE, median", "nPPE, worst", "nPOE, median"]
    table = markdown.table(header, rows)
    return f"{table}\n\nWithout noise, over {len(results)} data sets; held-out movements."


def write_chain_table(results: Results) -> str:
    """Write the errors of the policy beneath a task, by way to learn it."""
    rows = []
    for name in results[0]["chain"]:
        values = np.array([result["chain"][name] for result in results])
        rows.append([name, f"{np.median(values):.2g}", f"{values.max():.2g}"])
    return markdown.table(["a task beneath which the policy moves", "nUPE, median", "nUPE, worst"], rows)


def list_learnt_findings(results: Results) -> tuple[str, ...]:
    """Say how exactly constraints were found, without noise and with."""
    worst = max(result[name]["nPPE"] for result in results for name in _list_settings(results))
    exact = np.mean([result[name]["nPPE"] < EXACT for result in results for name in _list_settings(results)])
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


def write_measured_table(results: Results) -> str:
    """Write what knowing the constraints is worth."""
    rows = []
    for name, (plant, without, with_, aim) in MEASURED.items():
        a, b = _collect_measured(results, plant, without), _collect_measured(results, plant, with_)
        means = [markdown.mean_and_deviation(values, ".2g", ".1g") for values in (a, b)]
        rows.append([name, *means, f"{a.mean() / b.mean():.3g}", f"{aim}"])
    header = ["data", "nUPE by inconsistency", "nUPE with the constraints", "ratio of means", "aimed at"]
    return markdown.table(header, rows) + (
        f"\n\nMean ± standard deviation over {len(results)} data sets, on movements from new starts. The arm's "
        "constraints are read off a noisy force sensor; the grasp's are the true projections."
    )


def list_measured_findings(results: Results) -> tuple[str, ...]:
    """Say how many times the error falls with the constraints, and whether that was aimed at."""
    sentences = []
    for name, (plant, without, with_, aim) in MEASURED.items():
        ratio = (
            _collect_measured(results, plant, without).mean()
            / _collect_measured(results, plant, with_).mean()
        )
        verdict = "reached" if ratio >= aim else "missed"
        sentences.append(
            f"{name}: the error falls {ratio:.3g} times with the constraints; {aim} times was aimed at, {verdict}."
        )
    return tuple(sentences)


def write_surfaces_table(surfaces: Surfaces) -> str:
    """Write the errors of constraints and policies on the recorded surfaces."""
    constraints = [
        [surface, name, f"{error:.4f}"]
        for surface, errors in (("flat", surfaces.flat_errors), ("curved", surfaces.curved_errors))
        for name, error in errors.items()
    ]
    policies = [
        [surface, error.model, error.way, f"{error.along:.3f}", f"{error.constrained:.3f}"]
        for surface, errors in surfaces.policies.items()
        for error in errors
    ]
    header = ["surface", "policy", "learnt with", "along the action", "under the learnt constraint"]
    return "\n\n".join(
        [
            markdown.table(["surface", "constraint", "nPOE, held out"], constraints),
            markdown.table(header, policies),
            "Policy errors on held-out blocks, as shares of the actions' variance: (r - û·π)², and ‖N(u - π)‖² with "
            "the learnt N.",
        ]
    )


def list_surfaces_findings(surfaces: Surfaces) -> tuple[str, ...]:
    """Compare what was found on the surfaces with what is known of them."""
    changes = []
    for surface, errors in surfaces.policies.items():
        by_way = {(error.model, error.way): error.constrained for error in errors}
        for model in dict.fromkeys(error.model for error in errors):
            change = by_way[model, "learnt constraint"] / by_way[model, "inconsistency"] - 1
            changes.append(f"{change:+.0%} ({surface}, {model})")
    return (
        f"Flat surface: the direction hardly moved in is {surfaces.angle:.1f}° from the normal of the plane through "
        f"the points, with a standard error of {surfaces.uncertainty:.1f}°; {surfaces.shares[0]:.1%} of the motion is "
        "along it.",
        f"Curved surface: {surfaces.best} RBFs bring the held-out nPOE from "
        f"{surfaces.curved_errors['constant row']:.3f} (constant) to {min(surfaces.curved_errors.values()):.3f}.",
        f"Policies with the learnt projections: held-out error under the constraint {', '.join(changes)}. A policy of "
        "position alone explains little of these recordings either way: the finger passes the same places in different "
        "directions.",
    )


def _list_settings(results: Results) -> list[str]:
    return [name for name in results[0] if name != "chain" and not name.endswith(", noise")]


def _collect_measured(results: Results, plant: str, name: str) -> np.ndarray:
    return np.array([result[plant][name] for result in results])
