"""What a file of Rerun's holds: movements, fields, a rollout, and the numbers over time."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import DataError
from unconstrain.plot.arrows import find_full_speed, scale_arrows
from unconstrain.policies.base import Policy
from unconstrain.viewer import palette
from unconstrain.viewer.samples import judge

Array = NDArray[np.float64]

MOST_EPISODES, MOST_SAMPLES = 200, 200_000
"""More recordings, and more samples, are thinned evenly: a viewer has to stay fluent."""

JUMP = 0.5
"""Of the room's size: samples farther apart are not joined, such as those where an angle begins anew."""

ALONG = {1: 40, 2: 24, 3: 11}
"""Places along each dimension of the grid on which a field is drawn."""

MOST_ARROWS = 600
"""Where states have more than three dimensions, at so many recorded ones."""


@dataclass(frozen=True, eq=False)
class Room:
    """Where in space states are drawn.

    Parameters
    ----------
    axes : tuple of int
        Which states are drawn, one to three.
    names : tuple of str
        Of these.
    low, high : ndarray of shape (3,)
        The corners of the recorded states; 0 along what is missing of three dimensions.
    notes : tuple of str
        What is not drawn.
    """

    axes: tuple[int, ...]
    names: tuple[str, ...]
    low: Array
    high: Array
    notes: tuple[str, ...] = ()

    @classmethod
    def around(cls, demos: Demonstrations, coordinates: Sequence[int] | None) -> "Room":
        """Make the room of recordings, with the coordinates given or the first three."""
        n = demos.states.shape[1]
        axes = tuple(range(min(n, 3))) if coordinates is None else tuple(coordinates)
        if not 1 <= len(set(axes)) == len(axes) <= 3 or not all(i in range(n) for i in axes):
            raise DataError(
                f"coordinates= must be one to three different states of {n}, counted from 0, not {coordinates}"
            )
        names = tuple(demos.state_names[i] for i in axes)
        points = _padded(demos.states[:, axes])
        notes = (f"Of {n} states {', '.join(names)} are drawn.",) if n > len(axes) else ()
        return cls(axes, names, points.min(axis=0), points.max(axis=0), notes)

    @property
    def size(self) -> float:
        """The longest side of the recorded states; 1 where they are one point."""
        return float((self.high - self.low).max()) or 1.0

    def place(self, values: Array) -> Array:
        """Return what is drawn of states or velocities (N, n): points (N, 3)."""
        return _padded(values[:, self.axes])


def log_movements(stream: Any, policy: Policy, demos: Demonstrations, room: Room) -> list[str]:
    """Log recordings: their paths coloured by contact, a point that moves along each, and their numbers over time."""
    import rerun as rr

    chance, source = judge(policy, demos)
    notes = [f"Contact is {source}."]
    colors = contact_colors(chance, len(demos))
    shown = np.arange(demos.n_episodes)
    if len(shown) > MOST_EPISODES:
        shown = np.linspace(0, len(shown) - 1, MOST_EPISODES).round().astype(int)
        notes.append(f"Of {demos.n_episodes:,} recordings {MOST_EPISODES} are in the file, spread evenly.")
    rows = [np.flatnonzero(demos.episodes == code) for code in shown]
    every = -(-sum(map(len, rows)) // MOST_SAMPLES)
    if every > 1:
        notes.append(f"One sample of {every} is in the file.")
    if demos.time is None:
        notes.append("The recordings have no time: they are on the time line `sample` only.")
    points = room.place(demos.states)
    for code, own in zip(shown, rows, strict=True):
        kept = own[::every]
        name = rr.escape_entity_path_part(demos.episode_labels[code])
        indexes = [rr.TimeColumn("sample", sequence=kept.tolist())]
        if demos.time is not None:
            indexes.append(rr.TimeColumn("time", duration=demos.time[kept]))
        path, at = f"demonstrations/paths/{name}", f"demonstrations/now/{name}"
        # A line has one colour: a piece from each sample to the next has that of the first.
        pieces = np.stack([points[kept[:-1]], points[kept[1:]]], axis=1)
        near = np.linalg.norm(pieces[:, 1] - pieces[:, 0], axis=1) < JUMP * room.size
        line = rr.LineStrips3D(
            pieces[near].astype(np.float32), colors=colors[kept[:-1]][near], radii=rr.Radius.ui_points(1.5)
        )
        stream.log(path, line, static=True, strict=True)
        stream.log(at, rr.Points3D.from_fields(radii=rr.Radius.ui_points(5.0)), static=True, strict=True)
        columns = rr.Points3D.columns(positions=points[kept], colors=colors[kept])
        stream.send_columns(at, indexes, columns, strict=True)
        for kind, values, names in (
            ("states", demos.states, demos.state_names),
            ("actions", demos.actions, demos.action_names),
        ):
            _log_series(stream, f"{kind}/recorded/{name}", indexes, values[kept], names)
        if chance is not None:
            _log_series(
                stream, f"contact/recorded/{name}", indexes, chance[kept, None], ["probability of free"]
            )
    return notes


def log_field(stream: Any, policy: Policy, demos: Demonstrations, room: Room) -> list[str]:
    """Log the learnt field as arrows, and ordinary regression's beside it, both to one scale."""
    import rerun as rr

    if demos.states.shape != demos.actions.shape:
        return ["There is no field of arrows: the actions are not velocities of the states, one each."]
    states, spacing = _field_states(demos, room)
    fields = {"learnt": (policy, palette.LEARNT)}
    regression, notes = policy.ordinary_regression(), []
    if policy.risk == "direct":
        notes.append("The policy is ordinary regression itself.")
    elif regression is None:
        notes.append("Ordinary regression's field is missing: the policy does not hold it.")
    else:
        fields["ordinary_regression"] = (regression, palette.DIRECT)
    vectors = {
        name: room.place(each.predict(states).reshape(len(states), -1)) for name, (each, _) in fields.items()
    }
    full = find_full_speed(vectors["learnt"])
    for name, each in vectors.items():
        arrows = rr.Arrows3D(
            origins=room.place(states),
            vectors=spacing * scale_arrows(each, full),
            colors=palette.rgb(fields[name][1]),
            radii=0.06 * spacing,
        )
        stream.log(f"field/{name}", arrows, static=True, strict=True)
    notes.append(
        f"An arrow of the field {spacing:.3g} long is a speed of {full:.3g} or more; shorter ones are in proportion."
    )
    return notes


def log_rollout(stream: Any, movement: Demonstrations, demos: Demonstrations, room: Room) -> None:
    """Log a rollout: its paths, a point that moves along each, and its numbers, named as the recordings'."""
    import rerun as rr

    points = room.place(movement.states)
    for code in range(movement.n_episodes):
        own = np.flatnonzero(movement.episodes == code)
        name = str(code)
        path = rr.LineStrips3D(
            [points[own]], colors=palette.rgb(palette.PATH), radii=rr.Radius.ui_points(3.0)
        )
        stream.log(f"rollout/paths/{name}", path, static=True, strict=True)
        at = f"rollout/now/{name}"
        style = rr.Points3D.from_fields(radii=rr.Radius.ui_points(8.0), colors=palette.rgb(palette.PATH))
        stream.log(at, style, static=True, strict=True)
        if movement.time is None:
            continue
        indexes = [rr.TimeColumn("time", duration=movement.time[own])]
        stream.send_columns(at, indexes, rr.Points3D.columns(positions=points[own]), strict=True)
        for kind, values, names in (
            ("states", movement.states, demos.state_names),
            ("actions", movement.actions, demos.action_names),
        ):
            _log_series(
                stream, f"{kind}/rollout/{name}", indexes, values[own], [f"rollout {each}" for each in names]
            )


def contact_colors(chance: Array | None, count: int) -> NDArray[np.uint8]:
    """Return a colour a sample (N, 3), from that of constrained ones to that of free ones."""
    colors = np.tile(np.array(palette.rgb(palette.RECORDED), dtype=np.uint8), (count, 1))
    if chance is not None:
        known = ~np.isnan(chance)
        colors[known] = palette.blend(chance[known], palette.CONSTRAINED, palette.FREE)
    return colors


def _log_series(stream: Any, path: str, indexes: Any, values: Array, names: Any) -> None:
    import rerun as rr

    stream.log(path, rr.SeriesLines(names=list(names)), static=True, strict=True)
    stream.send_columns(path, indexes, rr.Scalars.columns(scalars=values), strict=True)


def _field_states(demos: Demonstrations, room: Room) -> tuple[Array, float]:
    """States at which a field is drawn, and how far they are from each other: a grid near the recorded ones."""
    from scipy.spatial import cKDTree  # slow to import

    X = demos.states
    n = X.shape[1]
    if n > 3:
        step = max(1, len(X) // MOST_ARROWS)
        return X[::step], room.size / ALONG[2]
    low, high = X.min(axis=0), X.max(axis=0)
    places = [np.linspace(a, b, ALONG[n] if b > a else 1) for a, b in zip(low, high, strict=True)]
    spacing = np.where(high > low, (high - low) / (ALONG[n] - 1), 1.0)
    grid = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1).reshape(-1, n)
    distance, _ = cKDTree(X / spacing).query(grid / spacing)
    return grid[distance <= 1.0], float(spacing[high > low].min(initial=room.size))


def _padded(points: Array) -> Array:
    return np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
