"""Wiping on two surfaces, with wrench: phases, normals without and with the force, and policies carried over."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from reproduction.markdown import table
from reproduction.real.part import Outcome
from reproduction.real.wiping_contacts import CLEAN, FRICTIONLESS, RAW, TURNED, Wipe, find_wipes
from reproduction.real.wiping_recordings import RELEASE, SURFACES, THRESHOLD, read
from reproduction.real.wiping_transfer import (
    DIRECT,
    INFERRED,
    PAIRS,
    STATES,
    STROKE,
    TOLD,
    WAYS,
    Error,
    compare,
    find_verdict,
)
from unconstrain import plot
from unconstrain.constraints import Payload

TARGET = 10.0
"""Degrees between normals."""
CLEARLY = 0.005
OTHER_THRESHOLDS = ((8.0, 6.0), (10.0, 8.0), (14.0, 12.0))
PLACES = ("position", "position relative to the start")
AWAY = (("rim", "fender"), ("fender", "rim"))


def run(folder: Path, repetitions: int, out: Path, progress: Callable[[str], None]) -> Outcome:
    """Measure wiping; nothing is drawn at random, so that repetitions change nothing.

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
    progress("wiping: forces")
    payload, wipes = find_wipes(folder)
    errors = compare(folder, wipes, progress)
    picture = out / "wiping.png"
    plot.save(draw(folder, wipes), picture)
    return Outcome(
        "Wiping on two surfaces (rim, fender)",
        f"{tabulate_wipes(wipes)}\n\n{tabulate_errors(errors)}",
        (*_say_forces(folder, payload, wipes), *_say_transfer(errors), *_say_verdicts(folder, progress)),
        (picture,),
    )


def tabulate_wipes(wipes: list[Wipe]) -> str:
    """Write a line for each phase of wiping."""
    ways = (RAW, TURNED, CLEAN, FRICTIONLESS)
    header = [
        "surface",
        "no.",
        "wipe (s)",
        "extent (mm, s.d.)",
        "turns",
        *ways,
        "the hand's axis",
        "μ, and what it explains",
    ]
    rows = [
        [
            wipe.surface,
            wipe.episode,
            f"{wipe.begin:.1f} to {wipe.end:.1f}",
            " x ".join(f"{1e3 * each:.0f}" for each in wipe.spread),
            str(wipe.strokes),
            *(f"{wipe.angles[way]:.1f}°" for way in ways),
            f"{wipe.hand:.1f}°",
            f"{wipe.friction.coefficient:+.2f} ± {wipe.friction.uncertainty:.2f}, {wipe.friction.explained:.0%}",
        ]
        for wipe in wipes
    ]
    middle = [f"{np.median([wipe.angles[way] for wipe in wipes]):.1f}°" for way in ways]
    rows.append(["median", "", "", "", "", *middle, f"{np.median([wipe.hand for wipe in wipes]):.1f}°", ""])
    return table(header, rows)


def tabulate_errors(errors: dict[tuple[str, str, str, str], Error]) -> str:
    """Write a line for each state and way, with a column for each pair of surfaces."""
    header = ["state", "way", "rim, held out", "fender, held out", "rim → fender", "fender → rim"]
    rows = [
        [state, way, *(_both(errors[state, way, learnt, tried]) for learnt, tried in PAIRS)]
        for state in (*STATES, STROKE)
        for way in WAYS
        if (state, way, *PAIRS[0]) in errors
    ]
    rows.append(["any", "standing still", *["1.00"] * len(PAIRS)])
    return table(header, rows)


def _both(error: Error) -> str:
    return f"{error.whole:.2f}" + ("" if error.under is None else f" ({error.under:.2f})")


def _say_forces(folder: Path, payload: Payload, wipes: list[Wipe]) -> list[str]:
    said = []
    for name in SURFACES:
        surface = read(folder, name)
        said += [
            f"The library says: {note}." for note in surface.demos.notes if "the force stays the same" in note
        ]
    n, within = len(wipes), sum(wipe.angles[FRICTIONLESS] <= TARGET for wipe in wipes)
    told = ", ".join(f"{sum(wipe.surface == name for wipe in wipes)} on the {name}" for name in SURFACES)
    said.append(
        f"{n} phases of wiping are found ({told}), each in between an approach and a retreat, in the recordings whose "
        "force can be used."
    )
    said.append(
        "The wrench is in the frame of the hand: where the surface is tilted its direction makes sense only after it "
        "is turned by the hand's rotation. The sensor was zeroed as it hung, and what it feels as it tilts is a "
        f"weight of {payload.weight:.1f} N; below zero, more weight had been taken out beforehand than there is. Free "
        f"phases scatter by {payload.noise:.1f} N about it."
    )
    explained = np.median([wipe.friction.explained for wipe in wipes])
    said.append(
        f"No friction that opposes the motion is to be seen: μ is {min(w.friction.coefficient for w in wipes):+.2f} to "
        f"{max(w.friction.coefficient for w in wipes):+.2f} and explains {explained:.0%} (median) of the force along "
        "the motion. Taking all of that force out still turns the mean force nearer to the normal."
    )
    said.append(
        f"Within {TARGET:.0f}° of the normal of the plane through the points, which needs no force: {within} of {n} "
        f"phases, the furthest {max(wipe.angles[FRICTIONLESS] for wipe in wipes):.1f}°: "
        f"{'reached' if within == n else 'missed'} (target: all within {TARGET:.0f}°)."
    )
    others = []
    for threshold, release in OTHER_THRESHOLDS:
        angles = [wipe.angles[FRICTIONLESS] for wipe in find_wipes(folder, threshold, release)[1]]
        close = sum(angle <= TARGET for angle in angles)
        others.append(f"{close} of {len(angles)} with {threshold:g} and {release:g} N")
    said.append(
        f"Contact begins at {THRESHOLD:g} N and ends below {RELEASE:g} N, chosen by eye. Other thresholds: "
        f"{', '.join(others)}."
    )
    leaning = [wipe for wipe in wipes if wipe.angles[FRICTIONLESS] > TARGET]
    if leaning:
        said.append(
            "Where the force leans furthest from the normal of the plane, so does the hand that presses, by "
            f"{min(wipe.hand for wipe in leaning):.0f}° to {max(wipe.hand for wipe in leaning):.0f}°; force and hand "
            f"are {min(wipe.apart for wipe in leaning):.0f}° to {max(wipe.apart for wipe in leaning):.0f}° apart "
            "there. Either the surface is no plane within the wipe, or the pad passes on what the hand presses."
        )
    turns = {name: [wipe.strokes for wipe in wipes if wipe.surface == name] for name in SURFACES}
    said.append(
        f"The two are different movements: on the rim the hand turns round {min(turns['rim'])} to {max(turns['rim'])} "
        f"times within a wipe, on the fender {min(turns['fender'])} to {max(turns['fender'])} times, and returns "
        "through the air."
    )
    return said


def _say_transfer(errors: dict[tuple[str, str, str, str], Error]) -> list[str]:
    said = []
    ahead = [
        state
        for state in STATES
        if all(
            min(errors[state, way, *pair].whole for way in (TOLD, INFERRED) if (state, way, *pair) in errors)
            < errors[state, DIRECT, *pair].whole - CLEARLY
            for pair in AWAY
        )
    ]
    own = min(errors[state, way, "rim", "rim"].whole for state in PLACES for way in WAYS)
    other = min(errors[state, way, "fender", "fender"].whole for state in PLACES for way in WAYS)
    said.append(
        "Carried over to the other surface, policies told by force or inferred are better than direct ones in both "
        f"directions for {ahead[0] if ahead else 'no state'}: {'reached' if ahead else 'missed'} (target: above direct "
        "in both directions)."
    )
    said.append(
        f"Held out on the surface they were learnt on, policies of position make {own:.2f} (rim) and {other:.2f} "
        "(fender) of the squared error of standing still at best: position does not explain wiping, which is known "
        "before another surface is tried."
    )
    stroke = [errors[STROKE, DIRECT, *pair].whole for pair in PAIRS]
    said.append(
        "What explains wiping is place and speed along the stroke, in amplitudes and periods that are read off each "
        f"wipe itself: {stroke[0]:.2f} held out on the rim, {stroke[1]:.2f} on the fender; but {stroke[2]:.2f} and "
        f"{stroke[3]:.2f} across, as a scrub is no single stroke."
    )
    return said


def _say_verdicts(folder: Path, progress: Callable[[str], None]) -> list[str]:
    """Say what `fit` says of positions on each surface, before the other is tried."""
    said, warned = [], 0
    for name in SURFACES:
        progress(f"wiping: the verdict on {name}")
        verdict = find_verdict(folder, name)
        warned += not verdict.is_safe
        said.append(f"Of a policy of position learnt on the {name} the verdict is: {verdict}.")
    reached = "reached" if warned == len(SURFACES) else "missed"
    return [
        *said,
        f"The verdict says so before the user finds out: {reached} (target: it does, where errors are above).",
    ]


def draw(folder: Path, wipes: list[Wipe]) -> Figure:
    """Draw one recording of each surface from the side, its wipes in colour, with the normals of plane and force."""
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    for ax, (name, number) in zip(figure.subplots(1, 2), (("rim", "6"), ("fender", "3")), strict=True):
        demos = read(folder, name).demos
        own = demos.episodes == demos.episode_labels.index(number)
        P = demos.states[own]
        ax.plot(P[:, 0], P[:, 2], color="0.75", linewidth=0.8)
        for wipe in (wipe for wipe in wipes if (wipe.surface, wipe.episode) == (name, number)):
            Q = demos.states[wipe.rows]
            (line,) = ax.plot(Q[:, 0], Q[:, 2], linewidth=1.2)
            middle, normal = Q.mean(axis=0), wipe.axes[2] * np.sign(wipe.axes[2, 2])
            force = wipe.force / np.linalg.norm(wipe.force) * np.sign(wipe.force[2])
            for way, style in ((normal, "-"), (force, ":")):
                ax.annotate(
                    "", middle[[0, 2]] + 0.08 * way[[0, 2]], middle[[0, 2]],
                    arrowprops={"arrowstyle": "->", "color": line.get_color(), "linestyle": style},
                )  # fmt: skip
        ax.set(xlabel="x (m)", ylabel="z (m)", title=f"{name} no. {number}", aspect="equal")
    return figure
