"""The figures that the command line writes: pictures of `unconstrain.plot` side by side."""

from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from unconstrain.constraints.learnt.base import LearntConstraint
from unconstrain.demonstrations import Demonstrations
from unconstrain.diagnostics.report import Identifiability
from unconstrain.plot.colors import DIRECT, LEARNT, TRUE
from unconstrain.plot.columns import find_velocities, share_scale
from unconstrain.plot.constraints import constraint
from unconstrain.plot.contacts import contact
from unconstrain.plot.diagnostics import identifiability
from unconstrain.plot.movements import rollout
from unconstrain.plot.policies import comparison, policy
from unconstrain.policies.base import Policy
from unconstrain.policies.inferred import finds_no_contact

MOST_COORDINATES = 3
"""Pairs of so many states are drawn, where there are more."""
MOST_ALONE = 6
"""So many states at most have panels of their own."""


def draw_policy(learnt: Policy, demos: Demonstrations) -> Figure:
    """Draw a policy over recordings, beside ordinary regression where that differs, and the contact it infers.

    Parameters
    ----------
    learnt : Policy
        Fitted.
    demos : Demonstrations
        Recordings. Of more than two states, every pair of the first three is drawn.

    Returns
    -------
    Figure
        With a panel for each pair of states, and one of `contact` where the policy was fitted with the adaptive risk.

    Raises
    ------
    PolicyError
        The policy's actions do not match those of the demonstrations.
    """
    n = demos.states.shape[1]
    pairs = _pair(n)
    infers = learnt.solution_.belief is not None
    # Without contact both are the same.
    same = learnt.risk == "direct" or finds_no_contact(learnt)
    several = not same and learnt.ordinary_regression() is not None
    count = len(pairs) + infers
    shape = (2, 2) if count > 2 else (1, count)
    figure = Figure(figsize=(5.0 * shape[1], 4.6 * shape[0]), layout="constrained")
    panels = figure.subplots(*shape, squeeze=False).ravel()
    for ax, pair in zip(panels, pairs, strict=False):
        draw = comparison if several else policy
        draw(learnt, demos, coordinates=pair, ax=ax)
    if infers:
        contact(learnt, demos, ax=panels[len(pairs)])
    for ax in panels[count:]:
        ax.remove()
    if n > MOST_COORDINATES:
        figure.suptitle(f"The first {MOST_COORDINATES} of {n} states", fontsize=11)
    return figure


def draw_rollout(movement: Demonstrations, demos: Demonstrations | None = None) -> Figure:
    """Draw where a rollout leads: its path over the first two states, and every state against time.

    Parameters
    ----------
    movement : Demonstrations
        With time.
    demos : Demonstrations, optional
        Recordings to draw behind the path.

    Returns
    -------
    Figure
        With two panels, or one of a single state; states that share no scale have panels of their own.
    """
    n = movement.states.shape[1]
    figure = Figure(figsize=(5.0 if n == 1 else 10.0, 4.4), layout="constrained")
    if n == 1:
        rollout(movement, demos, ax=figure.subplots())
        return figure
    # Degrees over metres would make a flat line of the metres.
    together = n > MOST_ALONE or share_scale(movement, range(n))
    grid = figure.add_gridspec(1 if together else n, 2)
    rollout(movement, demos, ax=figure.add_subplot(grid[:, 0]))
    for i in range(1 if together else n):
        ax = figure.add_subplot(grid[i, 1])
        rollout(movement, coordinates=None if together else (i,), against_time=True, ax=ax)
        if not together:
            ax.set_title("")
        if not together and i < n - 1:
            ax.tick_params(labelbottom=False)
            ax.set_xlabel("")
    return figure


def draw_identifiability(report: Identifiability) -> Figure:
    """Draw how far a policy is determined over the states, and how much of each of its directions was observed.

    Parameters
    ----------
    report : Identifiability
        Of recordings.

    Returns
    -------
    Figure
        With a panel for each pair of the first three states, and one of the observed shares.

    Raises
    ------
    DataError
        The report is of moments alone.
    """
    n = report.policy.n_features_in_
    pairs = _pair(n)
    shape = (2, 2) if len(pairs) > 1 else (1, 2)
    figure = Figure(figsize=(5.0 * shape[1], 4.4 * shape[0]), layout="constrained")
    *panels, last = figure.subplots(*shape).ravel()
    for ax, pair in zip(panels, pairs, strict=True):
        identifiability(report, coordinates=pair, ax=ax)
    _draw_spectrum(last, report)
    if n > MOST_COORDINATES:
        figure.suptitle(f"The first {MOST_COORDINATES} of {n} states", fontsize=11)
    return figure


def draw_constraint(learnt: LearntConstraint, demos: Demonstrations) -> Figure:
    """Draw how the motion is shared out among directions, and the rows of a constraint over the recorded states.

    Parameters
    ----------
    learnt : ConstantConstraint, FeatureConstraint or MechanismConstraint
        A fitted constraint.
    demos : Demonstrations
        What it was learnt from.

    Returns
    -------
    Figure
        With two panels.
    """
    figure = Figure(figsize=(10.0, 4.4), layout="constrained")
    _draw_shares(figure.add_subplot(1, 2, 1), learnt)
    velocities = find_velocities(demos.space, demos.actions.shape[1])
    in_space = len(velocities) == 3 and None not in velocities
    constraint(learnt, demos, ax=figure.add_subplot(1, 2, 2, projection="3d" if in_space else None))
    return figure


def _pair(n: int) -> list[tuple[int, int] | None]:
    """Return the pairs of coordinates that are drawn, or None for the only one."""
    return [*combinations(range(min(n, MOST_COORDINATES)), 2)] or [None]


def _draw_spectrum(ax: Axes, report: Identifiability) -> None:
    values = report.spectrum
    ax.plot(np.maximum(values[::-1], 1e-8), np.arange(1, len(values) + 1) / len(values), color=LEARNT)
    ax.axvline(report.threshold, color=TRUE, ls="--", lw=1, label="counts as determined from here on")
    ax.set_xscale("log")
    ax.set(
        xlabel="share of a direction that was observed",
        ylabel="share of directions observed so much",
    )
    ax.set_ylim(0, 1.02)
    ax.legend(frameon=False, fontsize=8, loc="lower left")
    ax.set_title("Directions of the policy", fontsize=10.5)
    ax.grid(alpha=0.3)


def _draw_shares(ax: Axes, learnt: LearntConstraint) -> None:
    """Draw how much of the motion there was along each direction, the constrained ones marked."""
    shares, k, d = learnt.shares_, learnt.n_constraints_, learnt.n_actions_
    every = len(shares) == d
    bars = shares if every else np.append(shares, 1.0 - shares.sum())
    names = [f"{i + 1}" for i in range(len(shares))] + ([] if every else ["all others"])
    ax.bar(names, 100 * bars, color=[DIRECT] * k + [LEARNT] * (len(bars) - k))
    for i, share in enumerate(bars):
        ax.annotate(f"{share:.2%}", (i, 100 * share), ha="center", va="bottom", fontsize=9)
    ax.set(xlabel="direction, from the least moved in", ylabel="share of motion (%)")
    ax.set_title(f"Motion along {d} directions, {k} of them constrained", fontsize=10.5)
    ax.margins(y=0.1)
