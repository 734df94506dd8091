"""What files that this package wrote say of their own columns."""

import json
from typing import Any

from unconstrain.demonstrations_file import FORMAT, NAMES
from unconstrain.errors import DataError
from unconstrain.recordings.columns import Columns
from unconstrain.recordings.formats.base import Declared


def declare(text: str | bytes, shown: str) -> Declared:
    """Read what `Demonstrations.save` says of the columns.

    Parameters
    ----------
    text : str or bytes
        The JSON that lies beside the columns.
    shown : str
        The file, as the user calls it.

    Returns
    -------
    Declared

    Raises
    ------
    DataError
        It is damaged, or was written by a newer release.
    """
    try:
        about: dict[str, Any] = json.loads(text)
        newer = about["format"] > FORMAT
        names = {name: tuple(map(str, about[name])) for name in NAMES}
        roles = {
            str(role): keys if isinstance(keys, str) else list(map(str, keys))
            for role, keys in about["roles"].items()
        }
        state, action, episode = roles["states"], roles["actions"], roles["episodes"]
        single = [roles.get(role) for role in ("time", "free")]
        if not all(key is None or isinstance(key, str) for key in (*single, episode)):
            raise TypeError("one column is needed")
        force = roles.get("forces")
        projections = roles.get("projections")
        columns = Columns(state, action, single[0], episode)  # type: ignore[arg-type]
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise DataError(f"{shown} is damaged and cannot be read as saved demonstrations") from error
    if newer:
        raise DataError(f"{shown} was written by a newer release of unconstrain; upgrade to read it")
    return Declared(
        columns,
        saved=True,
        policy=roles.get("policy"),
        force=force,
        free=single[1],  # type: ignore[arg-type]
        projections=projections,
        state_names=names["state_names"],
        action_names=names["action_names"],
        episode_labels=names["episode_labels"],
        notes=names["notes"],
    )
