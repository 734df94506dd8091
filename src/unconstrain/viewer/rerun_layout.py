"""How Rerun's viewer opens: the movements in space, states and actions over time, and the notes."""

from typing import Any

import numpy as np

from unconstrain.demonstrations import Demonstrations
from unconstrain.viewer.rerun_entities import Room

FARTHER = 1.3
"""How far the eye is from the middle of what was recorded, in longest sides of it."""


def lay_out(demos: Demonstrations, room: Room, *, has_rollout: bool) -> Any:
    """Make the blueprint of a file.

    Parameters
    ----------
    demos : Demonstrations
        Of which the first recording is shown over time.
    room : Room
        Where states are drawn.
    has_rollout : bool
        Whether it is shown over time as well.

    Returns
    -------
    rerun.blueprint.Blueprint
        For `send_blueprint`.
    """
    import rerun as rr
    import rerun.blueprint as rrb

    first = rr.escape_entity_path_part(demos.episode_labels[0])
    flat = len(room.axes) < 3
    middle = (room.low + room.high) / 2
    # States of two dimensions are looked at from above, as in a picture on paper.
    away = np.array([0.0, 0.0, 1.0]) if flat else np.array([0.7, -1.0, 0.7])
    eye = rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        position=middle + FARTHER * room.size * away,
        look_target=middle,
        eye_up=(0.0, 1.0, 0.0) if flat else (0.0, 0.0, 1.0),
    )
    space = rrb.Spatial3DView(
        name=", ".join(room.names),
        contents=["+ /demonstrations/**", "+ /field/**", "+ /rollout/**"],
        overrides={"field/ordinary_regression": rrb.EntityBehavior(visible=False)},
        background=[255, 255, 255],
        line_grid=rrb.LineGrid3D(visible=True, color=[225, 225, 225]),
        eye_controls=eye,
    )
    series = [
        rrb.TimeSeriesView(
            name=f"{kind} of {demos.episode_labels[0]}" + (", and of the rollout" if has_rollout else ""),
            contents=[f"+ /{kind}/recorded/{first}", f"+ /{kind}/rollout/**"],
        )
        for kind in ("states", "actions")
    ]
    contact = rrb.TimeSeriesView(
        name=f"probability of free, {demos.episode_labels[0]}", contents=[f"+ /contact/recorded/{first}"]
    )
    notes = rrb.TextDocumentView(name="notes", origin="/notes")
    side = rrb.Vertical(*series, rrb.Tabs(contact, notes), row_shares=[3, 3, 2])
    return rrb.Blueprint(
        rrb.Horizontal(space, side, column_shares=[3, 2]),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline="sample" if demos.time is None else "time"),
        collapse_panels=True,
    )
