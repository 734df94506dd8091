"""The limit cycle, learnt from 40 movements: what `unconstrain demo` shows, and Fig. 3 of the paper.

The paper's movements are constrained throughout and recorded without noise (`draw_data`, `learn`, `plot_fields`). Those
of the demo are half free, and noisy, as recordings are (`draw_recordings`, `learn_shown`, `plot_shown`).
"""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from unconstrain import metrics, plot
from unconstrain.demonstrations import Demonstrations
from unconstrain.features import NormalizedRBF
from unconstrain.limit_cycle import LimitCycle, demonstrate
from unconstrain.plot.colors import DIRECT, LEARNT, TRUE
from unconstrain.policies import ParametricPolicy

SQUARE = ((-1.0, -1.0), (1.0, 1.0))
"""Corners of the region that is drawn."""

MOVEMENTS, FEW = 40, 4
"""Movements in a data set, and in a small one."""

WIDTH = 0.8
"""σ of the RBFs, twice the spacing of their 6 x 6 grid over [-1, 1]²: one for everything in this experiment."""


FREE, NOISE = 0.5, 0.05
"""Share of constraints that are left out in the demo's movements, and noise as a share of the actions' deviation."""

SHOWN = {
    "direct": "ordinary regression",
    "inconsistency": "inconsistency",
    "adaptive": "adaptive",
    "told": "told every constraint",
}
"""How the demo learns: by the three risks, and knowing all projections."""


def draw_recordings(seed: int) -> tuple[Demonstrations, Demonstrations]:
    """Simulate the demo's recordings: 40 movements to learn from, with noise, and 40 others, without.

    Parameters
    ----------
    seed : int
        Number of the data set.

    Returns
    -------
    training : Demonstrations
        40 movements, half of them free, with noise.
    test : Demonstrations
        40 others of the same kind, without noise.
    """
    first, second = (np.random.default_rng([seed, stream]) for stream in (3, 4))
    training = demonstrate(MOVEMENTS, noise=NOISE, free=FREE, random_state=first)
    return training, demonstrate(MOVEMENTS, free=FREE, random_state=second)


def learn_shown(training: Demonstrations, way: str) -> ParametricPolicy:
    """Learn the policy behind the demo's recordings.

    Parameters
    ----------
    training : Demonstrations
        With the true projections, if `way` is "told".
    way : str
        One of `SHOWN`.

    Returns
    -------
    ParametricPolicy
        Fitted.
    """
    X, U, episodes = training.states, training.actions, training.episodes
    if way != "told":
        return make_policy(way).fit(X, U, groups=episodes)
    assert training.projections is not None
    # Noise is in every direction, so what the constraint takes away is not recorded: it is known to be zero.
    seen = np.einsum("nij,nj->ni", training.projections, U)
    return make_policy("inconsistency").fit(X, seen, groups=episodes, projections=training.projections)


def draw_data(seed: int, noise: float = 0.0) -> tuple[Demonstrations, Demonstrations]:
    """Simulate a data set: 40 movements to learn from, and 40 others, without noise, to test on.

    Parameters
    ----------
    seed : int
        Number of the data set.
    noise : float
        Of the recorded actions to learn from, as for `limit_cycle.demonstrate`.

    Returns
    -------
    training : Demonstrations
        40 movements, with noise.
    test : Demonstrations
        40 others, without.
    """
    training = demonstrate(MOVEMENTS, noise=noise, random_state=np.random.default_rng([seed, 0]))
    return training, demonstrate(MOVEMENTS, random_state=np.random.default_rng([seed, 1]))


def make_policy(risk: str = "inconsistency") -> ParametricPolicy:
    """Make the model of this experiment: 36 normalised RBFs, λ by cross-validation of the risk.

    Parameters
    ----------
    risk : str
        That the policy is fitted by.

    Returns
    -------
    ParametricPolicy
        Not fitted yet.
    """
    axis = np.linspace(-1.0, 1.0, 6)
    centers = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    return ParametricPolicy(NormalizedRBF(centers=centers, width=WIDTH), risk=risk, alpha="cv")


def learn(
    training: Demonstrations, way: str = "inconsistency", movements: int = MOVEMENTS
) -> ParametricPolicy:
    """Learn the policy behind the first movements.

    Parameters
    ----------
    training : Demonstrations
        With the true policy, if `way` is "oracle".
    way : str
        "inconsistency", "direct", or "oracle", which is regression on the true policy itself.
    movements : int
        How many of them to learn from.

    Returns
    -------
    ParametricPolicy
        Fitted.
    """
    seen = training.select(training.episodes < movements)
    if way == "oracle":
        return make_policy("direct").fit(seen.states, seen.policy, groups=seen.episodes)
    return make_policy(way).fit(seen.states, seen.actions, groups=seen.episodes)


def measure_errors(policy: ParametricPolicy, test: Demonstrations) -> dict[str, float]:
    """Measure the paper's errors on movements that were not learnt from.

    Parameters
    ----------
    policy : ParametricPolicy
        Fitted.
    test : Demonstrations
        With the true policy and projections.

    Returns
    -------
    dict of str to float
        "nUPE" and "nCPE", without and with constraints, as shares of the true policy's variance.
    """
    truth, predicted = test.policy, policy.predict(test.states)
    assert truth is not None
    assert test.projections is not None
    return {
        "nUPE": metrics.normalized(metrics.unconstrained_policy_error(truth, predicted), truth),
        "nCPE": metrics.normalized(
            metrics.constrained_policy_error(truth, predicted, test.projections), truth
        ),
    }


def plot_fields(captions: Mapping[str, str] | None = None) -> Figure:
    """Plot the true policy, those learnt from 4 and from 40 movements, and ordinary regression, of data set 0.

    Parameters
    ----------
    captions : mapping, optional
        What to write below a panel, by what it shows: "inconsistency, 4 trajectories", and so on. By default the
        errors of that policy.

    Returns
    -------
    Figure
        Four panels side by side.
    """
    training, test = draw_data(0)
    panels = []
    for title, way, movements, color in (
        ("learnt, {} movements", "inconsistency", FEW, LEARNT),
        ("learnt, {} movements", "inconsistency", MOVEMENTS, LEARNT),
        ("ordinary regression", "direct", MOVEMENTS, DIRECT),
    ):
        policy = learn(training, way, movements)
        if captions is None:
            caption = _caption(measure_errors(policy, test))
        else:
            caption = captions[f"{way}, {movements} trajectories"]
        seen = training.select(training.episodes < movements)
        panels.append((title.format(movements), policy, seen, color, caption))
    return _plot_panels(panels)


def plot_shown(policies: Mapping[str, ParametricPolicy]) -> Figure:
    """Plot the true policy beside those that were learnt from the demo's recordings, of data set 0.

    Parameters
    ----------
    policies : mapping
        Fitted, by names of `SHOWN`.

    Returns
    -------
    Figure
        A panel for each, and one for the truth, side by side.
    """
    training, test = draw_recordings(0)
    return _plot_panels(
        [
            (
                SHOWN[way],
                policy,
                training,
                DIRECT if way == "direct" else LEARNT,
                _caption(measure_errors(policy, test)),
            )
            for way, policy in policies.items()
        ]
    )


def _caption(errors: Mapping[str, float]) -> str:
    return "   ".join(f"{name} {value:.2g}" for name, value in errors.items())


def _plot_panels(panels: Sequence[tuple[str, ParametricPolicy, Demonstrations, str, str]]) -> Figure:
    """Plot the true policy, and a panel for each title, policy, movements, colour and caption."""
    free = demonstrate(8, 300, constrained=False, random_state=np.random.default_rng([0, 2]))
    figure = Figure(figsize=(3.5 * (len(panels) + 1), 4.3), layout="constrained")
    first, *others = figure.subplots(1, len(panels) + 1)
    # The speed halfway between the cycle and the corners, where all are faster.
    longest = float(np.linalg.norm(LimitCycle()(np.array([[0.8, 0.8]]))))
    plot.policy(LimitCycle(), free, region=SQUARE, color=TRUE, full_speed=longest, label=None, ax=first)
    first.set_title("true policy", fontsize=12)
    first.set_xlabel("x1")
    for ax, (title, policy, shown, color, caption) in zip(others, panels, strict=True):
        plot.policy(policy, shown, region=SQUARE, color=color, full_speed=longest, label=None, ax=ax)
        ax.set_title(title, fontsize=12)
        ax.set_xlabel(f"x1\n{caption}")
    for ax in figure.axes:
        ax.set_aspect("equal", adjustable="box")
        ax.set(xlim=(-1.2, 1.2), ylim=(-1.2, 1.2), xticks=(-1, 0, 1), yticks=(-1, 0, 1))
    return figure
