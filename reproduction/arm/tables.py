"""The arm's results as Markdown, and what is to be said about them."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from reproduction import published
from reproduction.adaptive_column import ADAPTIVE, name_data_sets
from reproduction.arm.trial import CONSTRAINTS, POWERS, make_candidates, name_row
from reproduction.markdown import table

Results = Sequence[dict[str, dict[str, Any]]]
"""Numbers of one data set by row of the table."""

ERRORS = ("nUPE", "nCPE", "complementary nCPE")
NOT_PUBLISHED = "–"

NO_CONTACT = 0.999
"""Share of samples inferred to be free above which no contact was found: here every sample is constrained."""


def list_constraints(results: Results) -> list[str]:
    """List the constraints of these results, in their order."""
    return list(dict.fromkeys(key.partition(" ")[2] for key in results[0]))


def list_nonlinear(results: Results) -> list[tuple[float, str]]:
    """List the rows (p, constraint) whose policy is not linear."""
    return [(p, c) for p in POWERS[:2] for c in list_constraints(results)]


def collect(results: Results, p: float, constraint: str, key: str) -> np.ndarray:
    """Return one number of all trials, (trials,); that of the chosen candidate if `key` begins with "auto "."""
    rows = [result[name_row(p, constraint)] for result in results]
    if key.startswith("auto "):
        return np.array([each[f"{each['chosen']} {key.removeprefix('auto ')}"] for each in rows])
    return np.array([each[key] for each in rows])


def write_published_table(results: Results, adaptive: Results = ()) -> str:
    """Write Table I beside ours, then p = 2, then direct regression and the oracle.

    Parameters
    ----------
    results, adaptive : sequence of dict
        What the paper's risks measured on each data set, and what risk "adaptive" did, if anything.

    Returns
    -------
    str
        Markdown.
    """
    ours = [
        [
            f"{p}",
            constraint,
            *(
                cell
                for error in ERRORS
                for cell in (
                    _published(p, constraint, error),
                    _measured(collect(results, p, constraint, f"inconsistency {error}")),
                    *_adaptive(adaptive, p, constraint, error),
                )
            ),
        ]
        for p, constraint in list_nonlinear(results)
    ]
    linear = [
        [
            constraint,
            f"order {published.ARM_LINEAR_ORDER:.0e}",
            *(f"{collect(results, 2.0, constraint, f'inconsistency {error}').max():.1e}" for error in ERRORS),
            *(f"{collect(adaptive, 2.0, constraint, f'{ADAPTIVE} nUPE').max():.1e}" for _ in adaptive[:1]),
        ]
        for constraint in list_constraints(results)
    ]
    others = [
        [
            f"{p}",
            constraint,
            _hundredths(*published.ARM_DIRECT_NUPE[p]) if constraint == "1-2-3" else NOT_PUBLISHED,
            *(
                _measured(collect(results, p, constraint, key))
                for key in ("direct nUPE", "inconsistency nUPE", "inconsistency new nUPE", "oracle nUPE")
            ),
            f"{collect(results, p, constraint, 'local models').mean():.0f}",
        ]
        for p in POWERS
        for constraint in list_constraints(results)
    ]
    whose = ["published", "ours", *([ADAPTIVE] if adaptive else [])]
    columns = [f"{error} {each}" for error in ERRORS for each in whose]
    largest = [f"{error} ours, largest" for error in ERRORS]
    largest += [f"nUPE {ADAPTIVE}, largest"] if adaptive else []
    above = f"Errors x 10^-2, mean ± s.d.; ours over {name_data_sets(results)}"
    above += f", {ADAPTIVE} over the first {name_data_sets(adaptive)}." if adaptive else "."
    means = ["direct published", "direct", "inconsistency", "new starts", "oracle", "models"]
    return "\n\n".join(
        [
            above,
            table(["p", "constraint", *columns], ours),
            "For p = 2.0, not x 10^-2:",
            table(["constraint", "published, all errors", *largest], linear),
            "The same models by other means, and on trajectories from new starts; nUPE x 10^-2:",
            table(["p", "constraint", *means], others),
        ]
    )


def list_published_findings(results: Results, adaptive: Results = ()) -> tuple[str, ...]:
    """Say which of the published figures are reached, and which are not, and compare risk "adaptive"."""
    findings = []
    for p, constraint in list_nonlinear(results):
        if (p, constraint) not in published.ARM:
            continue
        beyond = []
        for error, (mean, spread) in published.ARM[p, constraint].items():
            ours = collect(results, p, constraint, f"inconsistency {error}").mean()
            if ours > mean + 2 * spread:
                beyond.append(f"{error} is {ours:.4f}, above {mean + 2 * spread:.4f}")
        verdict = " and ".join(beyond) or "all three columns are at most the published mean + 2 s.d."
        findings.append(f"p = {p}, {constraint}: {verdict}")
    worst = max(
        collect(results, 2.0, c, f"inconsistency {error}").max()
        for c in list_constraints(results)
        for error in ERRORS
    )
    findings.append(f"p = 2.0: the largest error of all is {worst:.1e}.")
    if set(list_constraints(results)) == set(CONSTRAINTS):
        findings += [_compare_order(results, p) for p in POWERS[:2]]
    if "1-2-3" in list_constraints(results):
        for p, (mean, _) in published.ARM_DIRECT_NUPE.items():
            direct = collect(results, p, "1-2-3", "direct nUPE").mean()
            findings.append(f"p = {p}, 1-2-3, direct: nUPE {direct:.3f} (published {mean:.3f}).")
    findings += [_compare_adaptive(results[: len(adaptive)], adaptive, p) for p in POWERS[:2] if adaptive]
    return tuple(findings)


def _compare_adaptive(results: Results, adaptive: Results, p: float) -> str:
    """Compare both risks on the same data sets, and count those in which no contact was found."""
    compared = []
    for constraint in list_constraints(results):
        mine, theirs = (
            collect(of, p, constraint, f"{risk} nUPE").mean()
            for of, risk in ((adaptive, ADAPTIVE), (results, "inconsistency"))
        )
        none = int(np.sum(collect(adaptive, p, constraint, "free") > NO_CONTACT))
        compared.append(
            f"{constraint} {100 * mine:.3g} ({100 * theirs:.3g}"
            + (f"; no contact in {none})" if none else ")")
        )
    return (
        f"p = {p}, nUPE x 10^-2 of {ADAPTIVE}, and in brackets of the inconsistency on the same "
        f"{name_data_sets(adaptive)}: {', '.join(compared)}."
    )


def _compare_order(results: Results, p: float) -> str:
    means = {c: collect(results, p, c, "inconsistency nUPE").mean() for c in CONSTRAINTS}
    ours = " > ".join(sorted(CONSTRAINTS, key=lambda c: -means[c]))
    theirs = " > ".join(sorted(CONSTRAINTS, key=lambda c: -published.ARM[p, c]["nUPE"][0]))
    return f"p = {p}, constraints by nUPE: {ours} (published {theirs})."


def write_auto_table(results: Results) -> str:
    """Write what was chosen, what it is worth, and what another candidate would have been worth."""
    names = list(make_candidates())
    choices, errors = [], []
    for p, constraint in list_nonlinear(results):
        chosen, best = _chosen_and_best(results, p, constraint)
        choices.append(
            [
                f"{p}",
                constraint,
                _published(p, constraint, "nUPE"),
                _measured(collect(results, p, constraint, "auto nUPE")),
                _gain(results, p, constraint),
                _counted(chosen),
                _counted(best),
            ]
        )
        means = [collect(results, p, constraint, f"{name} nUPE").mean() for name in names]
        errors.append([f"{p}", constraint, *(f"{100 * mean:.3g}" for mean in means)])
    columns = ["published", "chosen by inconsistency", "published / ours", "chosen", "best in truth"]
    return "\n\n".join(
        [
            f"nUPE x 10^-2, mean ± s.d.; ours over {len(results)} data sets.",
            table(["p", "constraint", *columns], choices),
            "Mean nUPE x 10^-2 of every candidate:",
            table(["p", "constraint", *names], errors),
        ]
    )


def list_auto_findings(results: Results) -> tuple[str, ...]:
    """Say how far below the published figures, and where the choice by inconsistency was not the best in truth."""
    gains = [_ratio(results, *key) for key in list_nonlinear(results) if key in published.ARM]
    findings = []
    if gains:
        findings.append(
            f"Mean nUPE is the published one divided by {min(gains):.0f} in the row where least is gained, and by "
            f"{np.median(gains):.0f} in the median row."
        )
    missed, regrets = 0, []
    for p, constraint in list_nonlinear(results):
        chosen, best = _chosen_and_best(results, p, constraint)
        ours = collect(results, p, constraint, "auto nUPE")
        least = np.min(
            [collect(results, p, constraint, f"{name} nUPE") for name in make_candidates()], axis=0
        )
        worse = np.array([a != b for a, b in zip(chosen, best, strict=True)])
        missed += int(worse.sum())
        regrets += list((ours / least)[worse])
    total = len(results) * len(list_nonlinear(results))
    findings.append(
        f"In {missed} of {total} data sets another candidate was nearer to the true policy than the one chosen"
        + (
            f": there the chosen one's nUPE was {np.median(regrets):.1f} times the least in the median and "
            f"{max(regrets):.1f} times at worst."
            if regrets
            else "."
        )
    )
    return tuple(findings)


def _chosen_and_best(results: Results, p: float, constraint: str) -> tuple[list[str], list[str]]:
    rows = [result[name_row(p, constraint)] for result in results]
    best = [min(make_candidates(), key=lambda name: each[f"{name} nUPE"]) for each in rows]
    return [each["chosen"] for each in rows], best


def _ratio(results: Results, p: float, constraint: str) -> float:
    return published.ARM[p, constraint]["nUPE"][0] / collect(results, p, constraint, "auto nUPE").mean()


def _gain(results: Results, p: float, constraint: str) -> str:
    return f"{_ratio(results, p, constraint):.0f}" if (p, constraint) in published.ARM else NOT_PUBLISHED


def _published(p: float, constraint: str, error: str) -> str:
    if (p, constraint) not in published.ARM:
        return NOT_PUBLISHED
    return _hundredths(*published.ARM[p, constraint][error])


def _adaptive(adaptive: Results, p: float, constraint: str, error: str) -> list[str]:
    """Write the cell of risk "adaptive", if there is one."""
    return [_measured(collect(adaptive, p, constraint, f"{ADAPTIVE} {error}"))] if adaptive else []


def _counted(names: list[str]) -> str:
    return ", ".join(f"{name} ({count})" for name, count in Counter(names).most_common())


def _measured(numbers: np.ndarray) -> str:
    return _hundredths(float(numbers.mean()), float(numbers.std()))


def _hundredths(mean: float, spread: float) -> str:
    if 100 * mean >= 0.1:
        return f"{100 * mean:.2f} ± {100 * spread:.2f}"
    return f"{100 * mean:.2g} ± {100 * spread:.2g}"
