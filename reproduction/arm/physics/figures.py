"""Errors in physics, and frames of the arm."""

import numpy as np
from matplotlib.figure import Figure

from reproduction.arm.physics.trial import GAIN, METHODS, NAMES, POWER, Result, collect
from reproduction.plants import arm_dynamics
from reproduction.plants.arm import PowerPolicy
from reproduction.plants.arm_stage import GRIPPED, SCENARIOS, stage_episode
from reproduction.plants.rendering import Camera
from unconstrain.plot.colors import DIRECT, LEARNT, RECORDED

FRAMES = (0.0, 0.8, 3.9)
"""Seconds at which frames are drawn."""

VIEW = {"distance": 1.75, "azimuth": 140.0, "elevation": -14.0}
"""From where: metres and degrees."""


def plot_errors(results: list[Result]) -> Figure:
    """Plot the nUPE of every data set, by way of learning; log scale."""
    figure = Figure(figsize=(8.4, 3.8), layout="constrained")
    colors = {"direct": DIRECT, "inconsistency": RECORDED, "auto": LEARNT}
    for ax, scenario in zip(figure.subplots(1, 2, sharey=True), SCENARIOS, strict=True):
        for i, name in enumerate(METHODS):
            numbers = collect(results, scenario, f"{name} nUPE")
            spread = np.linspace(-0.18, 0.18, len(numbers)) if len(numbers) > 1 else [0.0]
            ax.plot(i + np.asarray(spread), numbers, ".", color=colors[name], alpha=0.6, ms=5)
            ax.plot([i - 0.25, i + 0.25], [numbers.mean()] * 2, color=colors[name], lw=2)
        ax.set_yscale("log")
        ax.set_xticks(range(3), ["direct", "inconsistency,\nlocal models", "inconsistency,\nmodel chosen"])
        ax.set_xlim(-0.5, 2.5)
        ax.set_title(NAMES[scenario], fontsize=10.5)
        ax.grid(axis="y", alpha=0.3)
    figure.axes[0].set_ylabel("nUPE, new starts")
    return figure


def render_frames(seed: int = 0) -> Figure:
    """Render frames of each scenario, from the first movement of data set `seed`. Raises `NoOpenGL`."""
    figure = Figure(figsize=(9.0, 6.4), layout="constrained")
    for axes, scenario in zip(figure.subplots(2, len(FRAMES)), SCENARIOS, strict=True):
        recording = arm_dynamics.demonstrate(
            scenario, PowerPolicy(POWER, GAIN), 1, encoder_noise=0.0, random_state=seed
        )
        demos = recording.demonstrations
        robot = stage_episode(scenario, demos.states[0], recording.tables[0])
        middle = 0.6 if scenario == GRIPPED else -0.65
        with Camera(robot.model, 720, 640, at=(0.0, 0.0, middle), **VIEW) as view:
            for ax, second in zip(axes, FRAMES, strict=True):
                ax.imshow(view.picture(demos.states[round(second * arm_dynamics.RATE)]))
                ax.set_title(f"{NAMES[scenario]}, {second:g} s", fontsize=9.5)
                ax.set_axis_off()
    return figure
