"""Spaces made again of what they say of themselves, as files hold it."""

from collections.abc import Mapping
from typing import Any

from unconstrain.errors import UnconstrainError
from unconstrain.spaces.angle import Angle
from unconstrain.spaces.base import Space
from unconstrain.spaces.numbers import Numbers
from unconstrain.spaces.phased import Phased
from unconstrain.spaces.product import Pose, Product
from unconstrain.spaces.rotation import Rotation
from unconstrain.spaces.second_order import SecondOrder


def from_description(about: Mapping[str, Any]) -> Space:
    """Make a space again of what `Space.describe` says.

    Parameters
    ----------
    about : mapping
        From `describe`.

    Returns
    -------
    Space
        The same.

    Raises
    ------
    UnconstrainError
        It describes none.
    """
    try:
        if "numbers" in about:
            return Numbers(int(about["numbers"]))
        if "angle" in about:
            return Angle(float(about["angle"]))
        if "rotation" in about:
            return Rotation(about["rotation"], about["frame"], bool(about["degrees"]))
        if "second_order" in about:
            return SecondOrder(from_description(about["second_order"]))
        if "phased" in about:
            return Phased(from_description(about["phased"]), float(about["duration"]))
        columns = tuple(tuple(int(i) for i in own) for own in about["columns"])
        if "pose" in about:
            return Pose((Numbers(3), from_description(about["pose"])), columns)
        return Product(tuple(from_description(part) for part in about["parts"]), columns)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise UnconstrainError(f"this describes no kind of state: {about!r:.80}") from error
