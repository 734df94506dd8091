"""The arm's results as Markdown, and what is to be said about them."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from reproduction import published
from reproduction.arm_trials import CONSTRAINTS, POWERS, candidates, row

Results = Sequence[dict[str, dict[str, Any]]]

ERRORS = ("nUPE", "nCPE", "complementary nCPE")
NOT_PUBLISHED = "–"


def constraints(results: Results) -> list[str]:
    """The constraints of these results, in their order."""
    return list(dict.fromkeys(key.partition(" ")[2] for key in results[0]))


def nonlinear(results: Results) -> list[tuple[float, str]]:
    """Their rows (p, constraint) whose policy is not linear."""
    return [(p, c) for p in POWERS[:2] for c in constraints(results)]


def values(results: Results, p: float, constraint: str, key: str) -> np.ndarray:
    """One number of all trials, (trials,); that of the chosen candidate where `key` begins with "auto "."""
    rows = [result[row(p, constraint)] for result in results]
    if key.startswith("auto "):
        return np.array([each[f"{each['chosen']} {key.removeprefix('auto ')}"] for each in rows])
    return np.array([each[key] for each in rows])


def published_table(results: Results) -> str:
    """Table I beside ours, then direct regression and the oracle, then p = 2."""
    lines = [
        f"Errors x 10^-2, mean ± s.d.; ours over {len(results)} data sets.",
        "",
        _line(
            ["p", "constraint", *(f"{error} {whose}" for error in ERRORS for whose in ("published", "ours"))]
        ),
        _line(["---"] * 8),
    ]
    for p, constraint in nonlinear(results):
        cells = [f"{p}", constraint]
        for error in ERRORS:
            cells.append(_published(p, constraint, error))
            cells.append(_measured(values(results, p, constraint, f"inconsistency {error}")))
        lines.append(_line(cells))
    lines += [
        "",
        "For p = 2.0, not x 10^-2:",
        "",
        _line(["constraint", "published, all errors", *(f"{error} ours, largest" for error in ERRORS)]),
        _line(["---"] * 5),
    ]
    for constraint in constraints(results):
        worst = [values(results, 2.0, constraint, f"inconsistency {error}").max() for error in ERRORS]
        lines.append(
            _line([constraint, f"order {published.ARM_LINEAR_ORDER:.0e}", *(f"{w:.1e}" for w in worst)])
        )
    lines += [
        "",
        "The same models by other means, and on trajectories from new starts; nUPE x 10^-2:",
        "",
        _line(
            [
                "p",
                "constraint",
                "direct published",
                "direct",
                "inconsistency",
                "new starts",
                "oracle",
                "models",
            ]
        ),
        _line(["---"] * 8),
    ]
    for p in POWERS:
        for constraint in constraints(results):
            cells = [
                f"{p}",
                constraint,
                _hundredths(*published.ARM_DIRECT_NUPE[p]) if constraint == "1-2-3" else NOT_PUBLISHED,
                *(
                    _measured(values(results, p, constraint, key))
                    for key in ("direct nUPE", "inconsistency nUPE", "inconsistency new nUPE", "oracle nUPE")
                ),
                f"{values(results, p, constraint, 'local models').mean():.0f}",
            ]
            lines.append(_line(cells))
    return "\n".join(lines)


def published_findings(results: Results) -> tuple[str, ...]:
    """Which of the published figures are reached, and which are not."""
    findings = []
    for p, constraint in nonlinear(results):
        if (p, constraint) not in published.ARM:
            continue
        beyond = []
        for error, (mean, spread) in published.ARM[p, constraint].items():
            ours = values(results, p, constraint, f"inconsistency {error}").mean()
            if ours > mean + 2 * spread:
                beyond.append(f"{error} is {ours:.4f}, above {mean + 2 * spread:.4f}")
        said = " and ".join(beyond) or "all three columns are at most the published mean + 2 s.d."
        findings.append(f"p = {p}, {constraint}: {said}")
    worst = max(
        values(results, 2.0, c, f"inconsistency {error}").max()
        for c in constraints(results)
        for error in ERRORS
    )
    findings.append(f"p = 2.0: the largest error of all is {worst:.1e}.")
    if set(constraints(results)) == set(CONSTRAINTS):
        findings += [_order(results, p) for p in POWERS[:2]]
    if "1-2-3" in constraints(results):
        for p, (mean, _) in published.ARM_DIRECT_NUPE.items():
            direct = values(results, p, "1-2-3", "direct nUPE").mean()
            findings.append(f"p = {p}, 1-2-3, direct: nUPE {direct:.3f} (published {mean:.3f}).")
    return tuple(findings)


def _order(results: Results, p: float) -> str:
    means = {c: values(results, p, c, "inconsistency nUPE").mean() for c in CONSTRAINTS}
    ours = " > ".join(sorted(CONSTRAINTS, key=lambda c: -means[c]))
    theirs = " > ".join(sorted(CONSTRAINTS, key=lambda c: -published.ARM[p, c]["nUPE"][0]))
    return f"p = {p}, constraints by nUPE: {ours} (published {theirs})."


def auto_table(results: Results) -> str:
    """What was chosen, what it is worth, and what another candidate would have been worth."""
    names = list(candidates())
    lines = [
        f"nUPE x 10^-2, mean ± s.d.; ours over {len(results)} data sets.",
        "",
        _line(
            [
                "p",
                "constraint",
                "published",
                "chosen by inconsistency",
                "published / ours",
                "chosen",
                "best in truth",
            ]
        ),
        _line(["---"] * 7),
    ]
    for p, constraint in nonlinear(results):
        ours = values(results, p, constraint, "auto nUPE")
        chosen, best = _chosen_and_best(results, p, constraint)
        cells = [
            f"{p}",
            constraint,
            _published(p, constraint, "nUPE"),
            _measured(ours),
            _gain(results, p, constraint),
            _counted(chosen),
            _counted(best),
        ]
        lines.append(_line(cells))
    lines += [
        "",
        "Mean nUPE x 10^-2 of every candidate:",
        "",
        _line(["p", "constraint", *names]),
        _line(["---"] * (2 + len(names))),
    ]
    for p, constraint in nonlinear(results):
        means = [values(results, p, constraint, f"{name} nUPE").mean() for name in names]
        lines.append(_line([f"{p}", constraint, *(f"{100 * mean:.3g}" for mean in means)]))
    return "\n".join(lines)


def auto_findings(results: Results) -> tuple[str, ...]:
    """How far below the published figures, and where the choice by inconsistency was not the best in truth."""
    gains = [_ratio(results, *key) for key in nonlinear(results) if key in published.ARM]
    findings = []
    if gains:
        findings.append(
            f"Mean nUPE is the published one divided by {min(gains):.0f} in the row where least is gained, and by "
            f"{np.median(gains):.0f} in the median row."
        )
    missed, regrets = 0, []
    for p, constraint in nonlinear(results):
        chosen, best = _chosen_and_best(results, p, constraint)
        ours = values(results, p, constraint, "auto nUPE")
        least = np.min([values(results, p, constraint, f"{name} nUPE") for name in candidates()], axis=0)
        worse = np.array([a != b for a, b in zip(chosen, best, strict=True)])
        missed += int(worse.sum())
        regrets += list((ours / least)[worse])
    total = len(results) * len(nonlinear(results))
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
    rows = [result[row(p, constraint)] for result in results]
    best = [min(candidates(), key=lambda name: each[f"{name} nUPE"]) for each in rows]
    return [each["chosen"] for each in rows], best


def _ratio(results: Results, p: float, constraint: str) -> float:
    return published.ARM[p, constraint]["nUPE"][0] / values(results, p, constraint, "auto nUPE").mean()


def _gain(results: Results, p: float, constraint: str) -> str:
    return f"{_ratio(results, p, constraint):.0f}" if (p, constraint) in published.ARM else NOT_PUBLISHED


def _published(p: float, constraint: str, error: str) -> str:
    if (p, constraint) not in published.ARM:
        return NOT_PUBLISHED
    return _hundredths(*published.ARM[p, constraint][error])


def _counted(names: list[str]) -> str:
    return ", ".join(f"{name} ({count})" for name, count in Counter(names).most_common())


def _measured(numbers: np.ndarray) -> str:
    return _hundredths(float(numbers.mean()), float(numbers.std()))


def _hundredths(mean: float, spread: float) -> str:
    if 100 * mean >= 0.1:
        return f"{100 * mean:.2f} ± {100 * spread:.2f}"
    return f"{100 * mean:.2g} ± {100 * spread:.2g}"


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"
