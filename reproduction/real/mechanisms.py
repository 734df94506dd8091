"""Which mechanism recordings moved under: a lid, circles on two surfaces, wiping, handwriting, reaches."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import unconstrain as uc
from reproduction.markdown import table
from reproduction.real.part import Outcome
from reproduction.recordings import CURVED, FLAT
from unconstrain import plot
from unconstrain.constraints import Mechanism, find_mechanism
from unconstrain.demonstrations import Demonstrations

Array = NDArray[np.float64]

LID = "reaching/box_closing.mat"
SECOND = 0.5
"""The lid is pushed in the second half of each recording; the reach is over before."""
OVER = 0.1
"""The push is over where the speed has fallen to this share of its highest."""


def run(folder: Path, repetitions: int, out: Path, progress: Callable[[str], None]) -> Outcome:
    """Name the mechanisms; nothing is drawn at random, so that repetitions change nothing.

    Parameters
    ----------
    folder : Path
        Of recordings.
    repetitions : int
        Not used.
    out : Path
        For the picture.
    progress : callable
        Takes sentences.

    Returns
    -------
    Outcome
    """
    progress("mechanisms: lid")
    lid = uc.load(folder / LID, state="pos", action="vel", time="time", episode="episode")
    pushed = lid.select(find_push(lid))
    found = {
        "lid, the push": find_mechanism(pushed.states, episodes=pushed.episodes),
        "lid, all of it": find_mechanism(lid.states, episodes=lid.episodes),
    }
    for name, file in (("circles on a flat surface", FLAT), ("circles on a curved surface", CURVED)):
        progress(f"mechanisms: {name}")
        demos = uc.load(
            folder / file, state=[1, 2, 3], time="rosbagTimestamp", window=0.2, max_speed=1, min_duration=1
        )
        found[name] = find_mechanism(demos.states, episodes=demos.episodes)
    progress("mechanisms: reaches")
    reaches = uc.load(
        folder / "reaching" / "reaching_cluttered.mat",
        state="pos",
        action="vel",
        time="time",
        episode="episode",
    )
    found["reaches among boxes"] = find_mechanism(reaches.states, episodes=reaches.episodes)
    alone = [
        find_mechanism(reaches.episode(code).states).kind != "none" for code in range(reaches.n_episodes)
    ]
    letters = {}
    for path in sorted((folder / "handwriting").glob("*.mat")):
        progress(f"mechanisms: handwriting, {path.stem}")
        demos = uc.load(path, state="pos", action="vel", time="t", episode="episode")
        letters[path.stem] = find_mechanism(demos.states, episodes=demos.episodes)
    picture = out / "lid.png"
    plot.save(draw(lid, pushed, found["lid, the push"]), picture)
    return Outcome(
        "Lid (hinge), and other mechanisms",
        tabulate(found, letters),
        (*_say(lid, pushed, found, letters), _say_alone(alone)),
        (picture,),
    )


def find_push(lid: Demonstrations) -> NDArray[np.intp]:
    """Find the rows of the push: from where the hand is slowest after the reach to where it has come to rest."""
    rows = []
    for code in range(lid.n_episodes):
        own = np.flatnonzero(lid.episodes == code)
        speed = np.linalg.norm(lid.actions[own], axis=1)
        half = int(SECOND * len(own))
        fastest = half + int(np.argmax(speed[half:]))
        # The second rise of the speed is the push, wherever the second half begins within the end of the reach.
        if fastest == half:
            fastest = half + int(np.argmin(speed[half : half + half // 2]))
            fastest += int(np.argmax(speed[fastest:]))
        first = int(np.argmax(speed[:half]))
        begin = first + int(np.argmin(speed[first:fastest]))
        end = fastest + int(np.argmax(speed[fastest:] < OVER * speed[fastest]))
        rows.append(own[begin:end])
    return np.concatenate(rows)


def tabulate(found: dict[str, Mechanism], letters: dict[str, Mechanism]) -> str:
    """Write a line for each kind of recording."""
    rows = [
        [
            name,
            mechanism.kind + (", another place in each" if mechanism.places == "each" else ""),
            "" if mechanism.kind == "none" else f"{mechanism.share:.0%}",
            "" if mechanism.kind == "none" else f"{mechanism.distance / mechanism.extent:.1%}",
            _others(mechanism),
        ]
        for name, mechanism in found.items()
    ]
    named = sum(mechanism.kind != "none" for mechanism in letters.values())
    rows.append([f"handwriting, {len(letters)} shapes", f"none of {len(letters) - named}", "", "", ""])
    return table(
        ["recording", "mechanism", "share on it", "distance, of the extent", "log-likelihood a point"], rows
    )


def _others(mechanism: Mechanism) -> str:
    kinds = [each for each in mechanism.candidates if each.kind != "none"]
    return ", ".join(
        f"{each.kind}{' (several places)' if each.places == 'each' else ''} {each.likelihood:+.2f}"
        for each in kinds
    )


def _say(
    lid: Demonstrations, pushed: Demonstrations, found: dict[str, Mechanism], letters: dict[str, Mechanism]
) -> list[str]:
    push = found["lid, the push"]
    said = [
        f"The lid, its push: {push.describe(lid.state_names).splitlines()[0].removeprefix('mechanism: ')}."
    ]
    if push.kind == "hinge":
        axis = ", ".join(f"{each:.2f}" for each in push.shapes[0].direction)
        angles = np.degrees(push.turned)
        said.append(
            f"Its axis points along ({axis}), standard error {np.degrees(push.uncertainty[0]):.0f}°. Arcs of "
            f"{angles.min():.0f}° to {angles.max():.0f}° hardly tell where it is: radius "
            f"{100 * push.shapes[0].radius:.0f} cm, standard error of the place {100 * push.uncertainty[1]:.0f} cm, "
            f"and {_count_against(pushed, push)} of {pushed.n_episodes} arcs curve the other way than most."
        )
    reached = "reached" if push.kind == "hinge" else "missed"
    said.append(f"The lid is named {push.kind}: {reached} (target: hinge with its axis).")
    kinds = []
    for early in (-10, -5, 0, 5, 10):
        moved = find_push(lid) + early
        kinds.append(find_mechanism(lid.states[moved], episodes=lid.episodes[moved]).kind)
    said.append(
        f"With the push taken from 1.6 s earlier to 1.6 s later, in steps of 0.8 s, the lid is {', '.join(kinds)}."
    )
    flat = found["circles on a flat surface"].kind
    said.append(
        f"Circles that a person drew freely on a flat surface are named {flat}, not a hinge, as they are not exact: "
        f"{'reached' if flat == 'plane' else 'missed'} (target: plane)."
    )
    named = [f"{name} {each.kind}" for name, each in letters.items() if each.kind != "none"]
    said.append(
        f"Of {len(letters)} shapes of handwriting {len(named)} are given a mechanism"
        f"{f' ({chr(44).join(named)})' if named else ''}: {'missed' if named else 'reached'} (target: none)."
    )
    return said


def _say_alone(alone: list[bool]) -> str:
    """Say how many single movements are given a mechanism."""
    n = sum(alone)
    return (
        f"Of {len(alone)} reaches, each by itself, {n} are given a mechanism, with the remark that it was found in a "
        "single movement, and that one made freely lies near some line, arc or surface as well: "
        f"{'missed' if n else 'reached'} (target: none)."
    )


def _count_against(pushed: Demonstrations, push: Mechanism) -> int:
    """Count the arcs whose centre lies on the other side than most."""
    outward = []
    for code in range(pushed.n_episodes):
        away = (
            pushed.states[pushed.episodes == code].mean(axis=0)
            - push.shapes[min(code, len(push.shapes) - 1)].point
        )
        outward.append(away / np.linalg.norm(away))
    sides = np.array(outward) @ np.median(outward, axis=0) > 0
    return int(min(sides.sum(), (~sides).sum()))


def draw(lid: Demonstrations, pushed: Demonstrations, push: Mechanism) -> Figure:
    """Draw the push of each demonstration and the arcs found, in the plane that they turn in."""
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    for code in range(lid.n_episodes):
        P = lid.states[lid.episodes == code]
        left.plot(P[:, 0], P[:, 2], color="0.75", linewidth=0.8)
        Q = pushed.states[pushed.episodes == code]
        (line,) = left.plot(Q[:, 0], Q[:, 2], linewidth=1.5)
        right.plot(Q[:, 0], Q[:, 2], ".", markersize=3, color=line.get_color())
        if push.kind == "hinge":
            shape = push.shapes[code if len(push.shapes) > 1 else 0]
            away = (
                Q
                - shape.residuals(Q)[:, 1:] * shape.rows(Q)[:, 1]
                - shape.residuals(Q)[:, :1] * shape.direction
            )
            right.plot(away[:, 0], away[:, 2], color=line.get_color(), linewidth=0.8)
    left.set(xlabel="x (m)", ylabel="z (m)", title="reach and push", aspect="equal")
    right.set(
        xlabel="x (m)", ylabel="z (m)", title="the push, and arcs of one radius and direction", aspect="equal"
    )
    return figure
