"""Demonstrations as notebooks show them."""

from typing import TYPE_CHECKING

import numpy as np

from unconstrain.notebook import format_sentences, format_table

if TYPE_CHECKING:
    from unconstrain.demonstrations import Demonstrations

MOST_COLUMNS, MOST_NOTES = 12, 5
"""What is listed at most of states and of actions each, and of notes."""


def to_html(demos: "Demonstrations") -> str:
    """Write demonstrations in HTML: how many there are, what range each column has, and the first notes.

    Parameters
    ----------
    demos : Demonstrations
        The demonstrations.

    Returns
    -------
    str
        HTML.
    """
    optional = ("time", "policy", "projections", "forces", "free")
    extras = [what for what in optional if getattr(demos, what) is not None]
    said = [
        f"{len(demos):,} samples in {demos.n_episodes:,} episode{'' if demos.n_episodes == 1 else 's'}",
        f"states: {demos.space.words}",
        *([f"with {', '.join(extras)}"] if extras else []),
    ]
    rows = []
    for kind, names, values in (
        ("state", demos.state_names, demos.states),
        ("action", demos.action_names, demos.actions),
    ):
        for name, column in zip(names[:MOST_COLUMNS], values.T, strict=False):
            rows.append((kind, name, *(f"{f(column):.4g}" for f in (np.min, np.mean, np.max))))
        if len(names) > MOST_COLUMNS:
            rows.append((kind, f"... {len(names) - MOST_COLUMNS} more", "", "", ""))
    # A movement that was rolled out may have had to stop.
    stopped = [
        f"episode {stop.episode} stopped after {stop.time:.3g} s: {stop.reason}"
        for stop in getattr(demos, "stopped", ())[:MOST_NOTES]
    ]
    more = len(demos.notes) - MOST_NOTES
    notes = [*demos.notes[:MOST_NOTES], *([f"... {more} more notes"] if more > 0 else [])]
    return (
        format_sentences(["; ".join(said)])
        + format_table(("", "", "least", "mean", "most"), rows)
        + format_sentences([*stopped, *notes])
    )
