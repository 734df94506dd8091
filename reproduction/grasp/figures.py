"""Figs. 5 and 6: the robot reaches through the gap, and the ways of its hands without any."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from numpy.typing import NDArray

from reproduction.plants.barrier import Barrier
from reproduction.plants.grasping import FREQUENCY, Demonstrator, Recording
from reproduction.plants.rendering import Camera, NoOpenGL
from reproduction.plants.scene import BALL_DIAMETER, show
from reproduction.plants.whole_body import WholeBody, make_floating
from unconstrain import plot
from unconstrain.plot.colors import DIRECT, LEARNT, TRUE
from unconstrain.simulation import Policy

Array = NDArray[np.float64]

LABELS = {"expert": "expert", "inconsistency": "learnt by inconsistency", "direct": "learnt directly"}

UNSEEN_WIDTH, UNSEEN_ASIDE = 0.32, 0.04
"""The gap never trained on, in metres."""

FRAMES, PIXELS = 6, 480
SHOWN_MOVEMENTS = 10

VIEW = {"distance": 1.65, "azimuth": 155.0, "elevation": -24.0}
"""How the robot is looked at: from the front, aside and above, in metres and degrees."""


def stage(demonstrator: Demonstrator) -> Any:
    """Compile the `mujoco.MjModel` of the robot with table, ball and barrier around it."""
    spec = make_floating(demonstrator.humanoid)
    demonstrator.scene.furnish(spec)
    return spec.compile()


def place_camera(demonstrator: Demonstrator, model: Any, width: int, height: int) -> Camera:
    """Place the camera of all pictures of the grasp: it looks at the robot's chest over the table's edge."""
    x, y, z = demonstrator.scene.origin
    return Camera(model, width, height, at=(x + 0.08, y, z + 0.07), **VIEW)


def make_unseen_gap(demonstrator: Demonstrator) -> Barrier:
    """Make a gap that is moved aside, where all gaps learnt from were in the middle."""
    return demonstrator.scene.with_gap([UNSEEN_WIDTH], centre=UNSEEN_ASIDE)


def record_from_home(
    demonstrator: Demonstrator, policy: Policy, obstacle: Barrier | None, duration: float = 3.0
) -> Recording:
    """Record the robot's movement from its home posture by a policy over the hands' positions."""
    body = WholeBody(demonstrator.humanoid)
    body.stand(demonstrator.humanoid.home)
    return demonstrator.record(obstacle, [body], policy=policy, duration=duration)


def render_reaching_through(
    demonstrator: Demonstrator, recording: Recording, obstacle: Barrier, movement: int
) -> Figure:
    """Render Fig. 5: six frames of a recorded movement, evenly spaced in time, under the obstacle it met."""
    model = stage(demonstrator)
    show(model, obstacle, movement)
    postures = recording.postures[movement]
    at = np.linspace(0, len(postures) - 1, FRAMES).round().astype(int)
    figure = Figure(figsize=(9.6, 6.6), layout="constrained")
    with place_camera(demonstrator, model, PIXELS, PIXELS) as view:
        for ax, k in zip(figure.subplots(2, FRAMES // 2).ravel(), at, strict=True):
            ax.imshow(view.picture(postures[k]))
            ax.set_title(f"{k / FREQUENCY:.1f} s", fontsize=10)
            ax.set_axis_off()
    return figure


def plot_unconstrained_reaching(
    demonstrator: Demonstrator, training: Recording, policies: dict[str, Policy]
) -> Figure:
    """Plot Fig. 6: free movements by each of the policies, from above and from the side, over ten training movements.

    `policies` maps "expert", "inconsistency" and "direct" to callables or fitted policies over hand positions.
    """
    style = {
        "expert": {"color": TRUE, "ls": (0, (4, 2)), "lw": 2.0, "zorder": 5},
        "inconsistency": {"color": LEARNT, "ls": "-", "lw": 2.6, "zorder": 4},
        "direct": {"color": DIRECT, "ls": "-", "lw": 2.0, "zorder": 3},
    }
    paths = {
        name: record_from_home(demonstrator, policy, None).demonstrations.states.reshape(-1, 2, 3)
        for name, policy in policies.items()
    }
    X = training.demonstrations.states.reshape(training.demonstrations.n_episodes, -1, 2, 3)

    scene = demonstrator.scene
    figure = Figure(figsize=(10.4, 4.7), layout="constrained")
    for ax, (i, j), title in zip(
        figure.subplots(1, 2), ((1, 0), (0, 2)), ("From above", "From the side (left hand)"), strict=True
    ):
        shown_hands = (0, 1) if title == "From above" else (0,)
        ball = scene.ball_centre
        ax.add_patch(
            Circle((ball[i], ball[j]), BALL_DIAMETER / 2, fc="#E69F00", alpha=0.45, ec="none", label="ball")
        )
        face = scene.origin[0] + scene.barrier_x - scene.thickness / 2
        if j == 0:
            ax.axhspan(
                face, face + scene.thickness, color="#B9C3D4", alpha=0.7, lw=0, label="barrier's place"
            )
            ax.invert_xaxis()
        else:
            ax.axhline(scene.table_top, color="#8C6D4F", lw=3, solid_capstyle="butt", label="table")
            ax.add_patch(
                Rectangle(
                    (face, scene.table_top), scene.thickness, scene.height, fc="#B9C3D4", alpha=0.7, ec="none"
                )
            )
        for k, movement in enumerate(X[:SHOWN_MOVEMENTS]):
            for hand in shown_hands:
                first = k == 0 and hand == 0
                ax.plot(
                    *movement[:, hand, [i, j]].T, color="#CC79A7", lw=1.0, alpha=0.9, zorder=2,
                    label="training, constrained" if first else None,
                )  # fmt: skip
                ax.plot(*movement[0, hand, [i, j]], "o", color="#CC79A7", ms=2.5, zorder=2)
        for name, path in paths.items():
            for hand in shown_hands:
                ax.plot(*path[:, hand, [i, j]].T, label=name if hand == 0 else None, **style[name])
                ax.plot(
                    *path[-1, hand, [i, j]],
                    "o",
                    color=style[name]["color"],
                    ms=5,
                    zorder=style[name]["zorder"],
                )
        ax.set(xlabel=f"{'xyz'[i]} / m", ylabel=f"{'xyz'[j]} / m", title=title)
        ax.set_aspect("equal", adjustable="datalim")
        ax.grid(alpha=0.25)
    shown = {
        label: handle
        for ax in figure.axes
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)
    }
    figure.legend(
        shown.values(), shown, loc="outside lower center", ncols=len(shown), frameon=False, fontsize=9
    )
    return figure


def render_unseen_gap(demonstrator: Demonstrator, policies: dict[str, Policy]) -> Figure:
    """Render each policy at its end through a gap never trained on, and half way there: a row for each time."""
    model = stage(demonstrator)
    obstacle = make_unseen_gap(demonstrator)
    show(model, obstacle)
    ways = {
        name: record_from_home(demonstrator, policy, obstacle).postures[0]
        for name, policy in policies.items()
    }
    figure = Figure(figsize=(9.6, 6.6), layout="constrained")
    axes = figure.subplots(2, len(ways))
    with place_camera(demonstrator, model, PIXELS, PIXELS) as view:
        for column, (name, postures) in enumerate(ways.items()):
            for row, k in enumerate((round(0.25 * len(postures)), len(postures) - 1)):
                ax = axes[row, column]
                ax.imshow(view.picture(postures[k]))
                ax.set_title(f"{LABELS[name]}, {k / FREQUENCY:.1f} s", fontsize=10)
                ax.set_axis_off()
    return figure


@dataclass(frozen=True)
class Pictures:
    """The pictures that were drawn.

    Attributes
    ----------
    shown : dict of Path to str
        PNG files with their captions.
    files : tuple of Path
        Other files.
    left_out : tuple of str
        A sentence for what could not be drawn.
    """

    shown: dict[Path, str]
    files: tuple[Path, ...]
    left_out: tuple[str, ...] = ()


def write_pictures(
    out: Path, demonstrator: Demonstrator, training: Recording, obstacle: Barrier, policies: dict[str, Policy]
) -> Pictures:
    """Write Figs. 5 and 6, and the policies before an unseen gap, into the folder `out`.

    Fig. 5 shows the first training movement that meets the barrier and reaches the ball.
    """
    reaching = plot_unconstrained_reaching(demonstrator, training, policies)
    plot.save(reaching, out / "fig6.png")
    plot.save(reaching, out / "fig6.svg")
    captions = {
        "fig5": "Fig. 5 anew: a constrained demonstration; the robot reaches through the gap for the ball.",
        "fig6": "Fig. 6 anew: unconstrained reaching by the expert and both learnt policies, over ten of the "
        "constrained movements they learnt from.",
        "unseen": f"Through a gap never trained on, moved aside by {100 * UNSEEN_ASIDE:g} cm.",
    }
    ways = training.demonstrations.states.reshape(training.demonstrations.n_episodes, -1, 6)
    arrived = np.linalg.norm(ways[:, -1] - demonstrator.scene.grasp, axis=1) < 0.05
    met = training.blocked.any(axis=1).reshape(len(ways), -1).any(axis=1)
    movement = int(np.argmax(2 * arrived + 1 * met))
    left_out: tuple[str, ...] = ()
    drawn = ["fig6"]
    try:
        plot.save(render_reaching_through(demonstrator, training, obstacle, movement), out / "fig5.png")
        plot.save(render_unseen_gap(demonstrator, policies), out / "unseen.png")
        drawn = list(captions)
    except NoOpenGL as error:
        left_out = (f"Pictures of the robot are left out: {error}.",)
    return Pictures({out / f"{name}.png": captions[name] for name in drawn}, (out / "fig6.svg",), left_out)
