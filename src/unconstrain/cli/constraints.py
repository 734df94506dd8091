"""`unconstrain constraints`: the directions in which recordings never move, the mechanism, and how sure that is."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from unconstrain.cli import outputs, recordings, reporting
from unconstrain.cli.command import command
from unconstrain.cli.declared import Number, Numbers
from unconstrain.errors import DataError, PolicyError
from unconstrain.progress import working

if TYPE_CHECKING:
    import numpy as np

    from unconstrain.constraints.mechanisms import Mechanism
    from unconstrain.demonstrations import Demonstrations

MODELS = ("constant", "linear", "rbf", "mechanism")
N_CENTERS = 10


@command(
    short_help="Find the constraint that recordings moved under.",
    epilog="For example:\n\n\b\nunconstrain constraints wipe.csv --state x,y,z --time t --out table.skops",
)
@recordings.recorded
@click.option(
    "--model",
    type=click.Choice(MODELS),
    default="constant",
    show_default=True,
    help="constant rows, or rows that vary with the state: linear, rbf, or those of the mechanism that is found.",
)
@click.option(
    "--rows",
    "n_constraints",
    type=click.IntRange(min=1),
    metavar="NUMBER",
    help="How many rows; by default as many as the motion tells (constant), or 1.",
)
@click.option(
    "--n-centers",
    type=click.IntRange(min=1),
    metavar="NUMBER",
    help=f"How many RBFs; {N_CENTERS} by default.",
)
@click.option(
    "--play",
    type=Number(),
    help="How far positions stray from a mechanism, in their unit; by default 1 % of the extent of a movement, or "
    "their noise if that is more.",
)
@click.option(
    "--between",
    type=Numbers(),
    metavar="FROM,TO",
    help="Only this part of each episode, in shares of its samples: 0.5,0.8, say, where a reach comes before.",
)
@outputs.out("constraint.skops", "Where the constraint is saved.")
@outputs.figure("Draw shares of motion and rows")
@outputs.overwrite
def constraints(
    recorded: recordings.Recorded,
    model: str,
    n_constraints: int | None,
    n_centers: int | None,
    play: float | None,
    between: list[float] | None,
    out: Path,
    figure: Path | None,
    overwrite: bool,
) -> None:
    """Find the constraint that recordings moved under: rows A with A u = 0, and of which mechanism they are.

    Where states hold positions in two or three dimensions, these are compared with a drawer (prismatic), a hinge, a
    plane, a sphere and a cylinder.
    """
    outputs.check_outputs(recorded.files, {"out": out, "figure": figure}, overwrite=overwrite)
    if n_centers is not None and model != "rbf":
        raise PolicyError(f"n_centers= is for --model rbf, and this is {model}")
    if n_constraints is not None and model == "mechanism":
        raise PolicyError("--rows is not for --model mechanism, whose kind says how many there are")
    from unconstrain import metrics
    from unconstrain.constraints.learnt import ConstantConstraint, FeatureConstraint, MechanismConstraint
    from unconstrain.constraints.learnt.base import LearntConstraint, held_out_projections
    from unconstrain.features import NormalizedRBF

    estimator: LearntConstraint
    if model == "constant":
        estimator = ConstantConstraint(n_constraints)
    elif model == "mechanism":
        estimator = MechanismConstraint(play)
    else:
        features = NormalizedRBF(n_centers or N_CENTERS) if model == "rbf" else None
        estimator = FeatureConstraint(features, n_constraints or 1)
    with working("reading"):
        demos = recorded.load()
    recordings.describe(demos)
    if between is not None:
        demos = _select_between(demos, between)
    with working("comparing mechanisms"):
        found, names = _find_mechanism(demos, play)
    if found is not None:
        reporting.say(found.describe(names, demos.episode_labels))
        if model != "mechanism" and found.kind != "none" and found.places == "one":
            reporting.say("  --model mechanism saves its rows")
    data, groups = (demos.states, demos.actions), demos.folds()
    with working("fitting"):
        learnt = estimator.fit(*data, groups=groups)
        error = metrics.projected_observation_error(
            demos.actions, held_out_projections(estimator, *data, groups)
        )
    learnt.save(out)
    if figure is not None:
        from unconstrain import plot
        from unconstrain.plot import figures

        plot.save(figures.draw_constraint(learnt, demos), figure)
    reporting.say(learnt.describe(demos.states, demos.action_names))
    reporting.say(
        "motion across the constraint, on what was held out: "
        f"{metrics.normalized(error, demos.actions):.2%} of the actions' variance (nPOE)"
    )
    if figure is not None:
        reporting.say(f"figure: {figure}")
    reporting.say(f"constraint: {out}")


def _select_between(demos: "Demonstrations", between: list[float]) -> "Demonstrations":
    """Select a part of each episode."""
    import numpy as np

    if len(between) != 2 or not 0.0 <= between[0] < between[1] <= 1.0:
        raise PolicyError("between= takes two shares, from 0 to 1 and the first below the second: 0.5,0.8")
    place = np.empty(len(demos))
    for code in range(demos.n_episodes):
        own = demos.episodes == code
        place[own] = (np.arange(own.sum()) + 0.5) / own.sum()
    return demos.select((place > between[0]) & (place < between[1]))


def _find_mechanism(demos: "Demonstrations", play: float | None) -> "tuple[Mechanism | None, list[str]]":
    """Find the mechanism of recordings that hold positions, and the names of these; None where there are none."""
    from unconstrain.constraints import find_mechanism

    columns, rotations = _positions(demos)
    if not columns:
        if play is not None:
            raise PolicyError("play= is for positions in two or three dimensions, and these states have none")
        return None, []
    names = [demos.state_names[i] for i in columns]
    try:
        found = find_mechanism(
            demos.states[:, columns], episodes=demos.episodes, rotations=rotations, play=play
        )
    except DataError as error:
        reporting.say(f"mechanism: not told, as {error}")
        return None, names
    return found, names


def _positions(demos: "Demonstrations") -> "tuple[list[int], np.ndarray | None]":
    """Return the columns of positions in two or three dimensions, and rotations that go with them."""
    from unconstrain.spaces import Numbers, Product, Rotation

    space = demos.space
    if isinstance(space, Numbers):
        return (list(range(space.n)) if space.n in (2, 3) else []), None
    if not isinstance(space, Product):
        return [], None
    parts = [(part, list(own)) for part, own in zip(space.parts, space.columns, strict=True)]
    numbers = [own for part, own in parts if isinstance(part, Numbers)]
    turns = [(part, own) for part, own in parts if isinstance(part, Rotation)]
    if len(numbers) != 1 or len(numbers[0]) not in (2, 3):
        return [], None
    if len(turns) != 1 or len(numbers[0]) != 3:
        return numbers[0], None
    part, own = turns[0]
    return numbers[0], part.rotations(demos.states[:, own]).as_matrix()
