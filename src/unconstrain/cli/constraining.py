"""The option for a constraint that was learnt before."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from unconstrain.cli.declared import option

if TYPE_CHECKING:
    from unconstrain.demonstrations import Demonstrations

constraint = option(
    "--constraint",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="A constraint that `unconstrain constraints` saved, under which all of it was recorded.",
    section="Recordings",
)
"""Decorator of a command that reads recordings."""


def tell(demos: "Demonstrations", path: Path | None) -> "Demonstrations":
    """Give recordings the projections of the constraint in a file, if one is given."""
    if path is None:
        return demos
    from unconstrain.constraints.learnt import load_constraint
    from unconstrain.constraints.learnt.recorded_under import tell_constraint

    return tell_constraint(demos, load_constraint(path))
