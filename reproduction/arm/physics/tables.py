"""The results in physics as Markdown, and what is to be said about them."""

from reproduction import markdown
from reproduction.arm.physics.trial import METHODS, NAMES, Result, collect
from reproduction.plants.arm_stage import SCENARIOS


def write_table(results: list[Result]) -> str:
    """Write the errors of the three ways to learn, and the distance from the ideal projection, for both scenarios."""
    errors, distances = [], []
    for scenario in SCENARIOS:
        cells = [
            markdown.mean_and_deviation(100 * collect(results, scenario, f"{name} {error}"), ".3g", ".2g")
            for error in ("nUPE", "nCPE")
            for name in METHODS
        ]
        errors.append([NAMES[scenario], *cells])
        median, most, away, touching = (
            collect(results, scenario, key).mean()
            for key in ("angle, median", "angle, 90 %", "off the projection", "touching")
        )
        distances.append(
            [NAMES[scenario], f"{median:.2f}°", f"{most:.1f}°", f"{away:.1%}", f"{touching:.0%}"]
        )
    ways = [f"{name} {error}" for error in ("nUPE", "nCPE") for name in METHODS]
    shares = ["angle, median", "angle, 90 % below", "r.m.s. difference, share of Nπ", "samples constrained"]
    return "\n\n".join(
        [
            f"x 10^-2, mean ± s.d. over {len(results)} data sets; trajectories from new starts.",
            markdown.table(["scenario", *ways], errors),
            "How far recorded actions are from Nπ of the ideal constraint, mean over data sets:",
            markdown.table(["scenario", *shares], distances),
        ]
    )


def list_findings(results: list[Result]) -> tuple[str, ...]:
    """Compare the three ways to learn, a sentence a scenario."""
    findings = []
    for scenario in SCENARIOS:
        direct, local, auto = (collect(results, scenario, f"{name} nUPE").mean() for name in METHODS)
        names = [result[scenario]["chosen"] for result in results]
        counts = ", ".join(f"{name} ({names.count(name)})" for name in dict.fromkeys(names))
        findings.append(
            f"{NAMES[scenario]}: nUPE {direct:.3g} by direct regression, {local:.3g} by inconsistency with local "
            f"models, {auto:.2g} with the model chosen by inconsistency: {counts}."
        )
    return tuple(findings)
