"""Methods on wiping, whole episodes held out: `python -m benchmarks rivals-wiping --data=FOLDER`."""

import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from benchmarks.rivals.learnt import Recorded
from benchmarks.rivals.methods import METHODS, Method, Option
from reproduction import markdown
from reproduction.real.wiping_recordings import SURFACES
from reproduction.real.wiping_transfer import STATES, Samples, of_state, project
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import UnconstrainError

SHOWN = ("position", "position and velocity (`--order 2`)")
"""Of the states of docs/real.md."""

COMPARED: Mapping[str, Method] = {
    name: METHODS[name]
    for name in (
        "ours: direct",
        "ours: adaptive",
        "ours: trees, adaptive",
        "GMR",
        "cloning: network",
        "cloning: trees",
    )
}
"""Those that have an action for a state, and need no goal and no labels."""


def measure(method: Method, option: Option, samples: Samples) -> float:
    """Measure the squared error of held-out episodes, as a share of what standing still makes."""
    U, P = samples.actions, np.empty_like(samples.actions)
    for label in np.unique(samples.groups):
        own = samples.groups == label
        demos = Demonstrations(samples.states[~own], U[~own], episodes=samples.groups[~own])
        learnt = method.learn(Recorded(demos), option)
        assert learnt is not None
        assert learnt.velocity is not None
        P[own] = learnt.velocity(samples.states[own])
    return float(np.sum((U - P) ** 2) / np.sum(U**2))


def print_table(folder: Path | None) -> None:
    """Print errors by surface and state; options of each surface are those of least error on the other."""
    if folder is None:
        raise UnconstrainError("wiping needs recordings: give --data=FOLDER, which holds wiping/demos_*.mat")
    told = project(folder)
    columns = [(surface, state) for state in SHOWN for surface in SURFACES]
    samples = {
        (surface, state): of_state(folder, surface, STATES[state], told[surface])
        for surface, state in columns
    }
    rows = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # iterations of networks and mixtures end before they converge
        for name, method in COMPARED.items():
            errors = {
                column: [measure(method, option, samples[column]) for option in method.options]
                for column in columns
            }
            cells = []
            for surface, state in columns:
                (other,) = (each for each in SURFACES if each != surface)
                cells.append(f"{errors[surface, state][int(np.argmin(errors[other, state]))]:.2f}")
            rows.append([name, *cells])
    print(markdown.table(["", *(f"{surface}, {state}" for surface, state in columns)], rows))
