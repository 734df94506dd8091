"""The report in sentences, for people who know their columns and not our symbols."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from unconstrain.diagnostics.report import Identifiability

NEGLIGIBLE = 0.1
"""Parts of a direction smaller than this are not named."""


def described(
    report: "Identifiability", state_names: Sequence[str], action_names: Sequence[str], k: int
) -> str:
    """Shares, bounds, the worst regions, the episodes and the next recordings, a line each."""
    lines = [
        *repr(report).splitlines(),
        "  (for a policy that the model can represent, recorded without noise)",
    ]
    lines += ["", "least known:"]
    for region in report.worst_regions(k):
        lines.append(
            f"  at {place(region.state, state_names)}: along {direction(region.direction, action_names)} to within "
            f"±{region.deviation:.3g}, where the policy's speed is {region.speed:.3g}; {region.seen:.1%} of the motion "
            "recorded near there went that way"
        )
    if report.recordings is not None and report.recordings.episodes is not None:
        lines += ["", *episodes(report)]
    lines += ["", "record next:"]
    for i, one in enumerate(report.next_recordings(k), 1):
        lines.append(
            f"  {i}. Start at {place(one.state, state_names)} and leave motion along "
            f"{direction(one.direction, action_names)} free: the policy is known there to within ±{one.deviation:.3g}, "
            f"and {one.gain:.1%} of the expected squared error left by then would go."
        )
    return "\n".join(lines)


def episodes(report: "Identifiability", most: int = 3) -> list[str]:
    """Which episodes hold most of what is determined, and which could be dropped."""
    found = report.contributions()
    held = sum(one.directions for one in found) or 1.0
    first = ", ".join(f"{one.episode} ({one.directions / held:.1%})" for one in found[:most])
    lines = [f"episodes that tell most: {first}"]
    spare = [str(one.episode) for one in found if one.droppable]
    if spare:
        named = ", ".join(spare[:10]) + (", ..." if len(spare) > 10 else "")
        lines.append(
            f"{len(spare)} of {len(found)} episodes could be dropped and as much would be determined: {named}"
        )
    else:
        lines.append(f"none of the {len(found)} episodes could be dropped without loss")
    return lines


def place(state: np.ndarray, names: Sequence[str]) -> str:
    """`x = 0.1, y = -0.2`."""
    return ", ".join(f"{name} = {value:.3g}" for name, value in zip(names, state, strict=True))


def direction(q: np.ndarray, names: Sequence[str]) -> str:
    """`0.98 z - 0.17 x`, the largest part first; `z` where that is all."""
    order = [i for i in np.argsort(-np.abs(q)).tolist() if abs(q[i]) >= NEGLIGIBLE]
    if len(order) == 1:
        return names[order[0]]
    first, *rest = order
    parts = [f"{q[first]:.2f} {names[first]}"]
    parts += [f"{'-' if q[i] < 0 else '+'} {abs(q[i]):.2f} {names[i]}" for i in rest]
    return " ".join(parts)
