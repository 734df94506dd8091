"""The report in sentences, for people who know their columns and not our symbols."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from unconstrain.notebook import format_sentences, format_table

if TYPE_CHECKING:
    from unconstrain.diagnostics.report import Identifiability

NEGLIGIBLE = 0.1
"""Components of a direction smaller than this are not named."""

MOST_NAMED = 10
"""How many droppable episodes are named."""


def describe(
    report: "Identifiability", state_names: Sequence[str], action_names: Sequence[str], k: int
) -> str:
    """Describe shares, bounds, the worst regions, the episodes and the next recordings, a line each.

    Parameters
    ----------
    report : Identifiability
        Of recordings at hand.
    state_names, action_names : sequence of str
        Names of the n states and the d actions.
    k : int
        How many regions and recordings to name.

    Returns
    -------
    str
        Several lines.
    """
    lines = [
        *repr(report).splitlines(),
        "  (for a policy that the model can represent, recorded without noise)",
    ]
    lines += ["", "least known:"]
    for region in report.worst_regions(k):
        lines.append(
            f"  at {format_state(region.state, state_names)}: along {format_direction(region.direction, action_names)} "
            f"to within ±{region.deviation:.3g}, where the policy's speed is {region.speed:.3g}; {region.share:.1%} of "
            "the motion recorded near there went that way"
        )
    if report.episodes is not None:
        lines += ["", *describe_episodes(report)]
    lines += ["", "record next:"]
    for i, one in enumerate(report.next_recordings(k), 1):
        lines.append(
            f"  {i}. Start at {format_state(one.state, state_names)} and leave motion along "
            f"{format_direction(one.direction, action_names)} free: the policy is known there to within "
            f"±{one.deviation:.3g}, and {one.gain:.1%} of the expected squared error left by then would go."
        )
    return "\n".join(lines)


def format_report(report: "Identifiability", k: int = 3) -> str:
    """Write shares, bounds, and the worst regions in HTML, which notebooks show.

    Parameters
    ----------
    report : Identifiability
        Of recordings, or of moments alone, whose regions are not known.
    k : int
        How many regions to name.

    Returns
    -------
    str
        HTML.
    """
    said = format_sentences(repr(report).splitlines())
    if report.samples is None:
        return said
    rows = [
        (
            format_state(region.state, report.state_names),
            format_direction(region.direction, report.action_names),
            f"±{region.deviation:.3g}",
            f"{region.speed:.3g}",
        )
        for region in report.worst_regions(k)
    ]
    return said + format_table(("known least at", "along", "to within", "policy's speed there"), rows)


def describe_episodes(report: "Identifiability", k: int = 3) -> list[str]:
    """Describe which episodes determine most, and which could be dropped.

    Parameters
    ----------
    report : Identifiability
        Of recordings whose episodes are known.
    k : int
        How many to name.

    Returns
    -------
    list of str
        Lines.
    """
    contributions = report.contributions()
    total = sum(one.directions for one in contributions) or 1.0
    largest = ", ".join(f"{one.episode} ({one.directions / total:.1%})" for one in contributions[:k])
    lines = [f"episodes that determine most: {largest}"]
    droppable = [str(one.episode) for one in contributions if one.droppable]
    if droppable:
        named = ", ".join(droppable[:MOST_NAMED]) + (", ..." if len(droppable) > MOST_NAMED else "")
        lines.append(
            f"{len(droppable)} of {len(contributions)} episodes could be dropped and as much would be determined: "
            f"{named}"
        )
    else:
        lines.append(f"none of the {len(contributions)} episodes could be dropped without loss")
    return lines


def format_state(state: np.ndarray, names: Sequence[str]) -> str:
    """Write a state as `x = 0.1, y = -0.2`.

    Parameters
    ----------
    state : ndarray of shape (n,)
        The state.
    names : sequence of str
        Names of its dimensions.

    Returns
    -------
    str
        Names and values.
    """
    return ", ".join(f"{name} = {value:.3g}" for name, value in zip(names, state, strict=True))


def format_direction(direction: np.ndarray, names: Sequence[str]) -> str:
    """Write a direction as `0.98 z - 0.17 x`, the largest component first, or as `z` where that is all.

    Parameters
    ----------
    direction : ndarray of shape (d,)
        Of length one.
    names : sequence of str
        Names of the actions.

    Returns
    -------
    str
        Components and names.
    """
    order = [i for i in np.argsort(-np.abs(direction)).tolist() if abs(direction[i]) >= NEGLIGIBLE]
    if len(order) == 1:
        return names[order[0]]
    first, *rest = order
    parts = [f"{direction[first]:.2f} {names[first]}"]
    parts += [f"{'-' if direction[i] < 0 else '+'} {abs(direction[i]):.2f} {names[i]}" for i in rest]
    return " ".join(parts)
