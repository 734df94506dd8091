"""Where contact was: recorded movements, coloured by how surely nothing was in the way."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from numpy.typing import ArrayLike

from unconstrain.arrays import quote
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import PolicyError
from unconstrain.plot.axes import add_title, check_coordinates, get_axes, is_in_space, label_axes
from unconstrain.plot.colors import DIRECT, LEARNT
from unconstrain.plot.columns import name_columns
from unconstrain.plot.movements import draw_lines
from unconstrain.plot.thinning import split_episodes
from unconstrain.policies.base import Policy
from unconstrain.policies.inputs import as_demonstrations

BETWEEN = "#D9D9D9"
"""What could be either."""


def contact(
    policy: Policy,
    demos: Demonstrations | ArrayLike,
    U: ArrayLike | None = None,
    *,
    groups: ArrayLike | None = None,
    coordinates: Sequence[int] | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw recorded movements, each sample coloured by how surely nothing was in its way.

    Lines and dots are thinned to about 20,000 samples of at most 1,000 episodes; what was in the way is inferred from
    all of them.

    Parameters
    ----------
    policy : Policy
        Fitted with the adaptive risk.
    demos : Demonstrations, or array_like of shape (N, n)
        Recordings, or their states. Where projections are known, so is whether a sample was free.
    U : array_like of shape (N, d), optional
        Actions, beside states.
    groups : array_like of shape (N,), optional
        Episodes, beside states.
    coordinates : sequence of int, optional
        Which two states are drawn, or which three in space, as for `demonstrations`. Of a single state its first action
        is drawn against it.
    ax : Axes, optional
        Where to draw; new axes by default. A colour bar takes some of their room.

    Returns
    -------
    Axes
        With the movements.

    Raises
    ------
    DataError
        The recordings cannot be used, do not fit the policy, or have no such coordinates.
    PolicyError
        The policy was learnt by another risk, which infers no contact.
    """
    demos = as_demonstrations(demos, U, groups)
    shown = check_coordinates(coordinates, demos.states.shape[1], ax)
    if not isinstance(policy, Policy):
        raise PolicyError(f"contact is inferred by a policy of unconstrain, got {quote(policy)}")
    free = policy.free_probability(demos)
    ax = get_axes(ax, len(shown))
    single = len(shown) == 1
    places = np.column_stack([demos.states, demos.actions[:, 0]]) if single else demos.states[:, list(shown)]
    episodes = split_episodes(demos.episodes)
    if not single:
        draw_lines(ax, places, episodes, BETWEEN, "-", None)
    rows = np.concatenate(episodes)
    dots = _draw_dots(ax, places[rows], free[rows])
    ax.figure.colorbar(dots, ax=ax, label="probability that nothing was in the way", shrink=0.8)
    if single:
        ax.set(xlabel=name_columns(demos)[0], ylabel=demos.action_names[0])
    else:
        label_axes(ax, demos, shown)
    add_title(ax, f"Inferred contact: {np.mean(free):.0%} of the samples were free")
    return ax


def _draw_dots(ax: Any, places: np.ndarray, free: np.ndarray) -> Any:
    colors = LinearSegmentedColormap.from_list("contact", [DIRECT, BETWEEN, LEARNT])
    look: dict[str, Any] = {"s": 6, "lw": 0, "cmap": colors, "vmin": 0, "vmax": 1, "zorder": 2}
    if is_in_space(ax):
        look["depthshade"] = False  # colours stand for contact
    return ax.scatter(*places.T, c=free, **look)
