"""Limits of states on the command line: in numbers, or those of a robot's joints."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from unconstrain.cli import reporting
from unconstrain.errors import DataError

if TYPE_CHECKING:
    from unconstrain.robots.robot import Robot

Pair = tuple[float | None, float | None]

EXAMPLE = 'write "-1:1,0:2", or by name "x=-1:1"; nothing before or after a colon is no limit there'


class LimitsType(click.ParamType):
    """Pairs `least:largest`, separated by commas, one a state or by name; or the path of a robot's file."""

    name = "limits"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Parse the text."""
        if not isinstance(value, str):
            return value
        if ":" not in value or Path(value).is_file():
            if not Path(value).is_file():
                self.fail(f"{value!r} is neither limits nor the file of a robot: {EXAMPLE}", param, ctx)
            return Path(value)
        parts = value.split(",")
        named = [part.rpartition("=") for part in parts]
        if any(name for name, _, _ in named):
            names = [name.strip() for name, _, _ in named]
            if len(set(names)) < len(names):
                self.fail(f"{value!r} names a state twice: {EXAMPLE}", param, ctx)
            return {name.strip(): self._parse_pair(pair, param, ctx) for name, _, pair in named}
        return [self._parse_pair(pair, param, ctx) for pair in parts]

    def _parse_pair(self, text: str, param: click.Parameter | None, ctx: click.Context | None) -> Pair:
        try:
            low, high = (float(number) if number.strip() else None for number in text.split(":"))
        except ValueError:
            self.fail(f"{text!r} is no pair of limits: {EXAMPLE}", param, ctx)
        if any(limit is not None and math.isnan(limit) for limit in (low, high)):
            self.fail(f"{text!r} is no pair of limits: {EXAMPLE}", param, ctx)
        return low, high


def read_limits(given: Any, names: Sequence[str]) -> Any:
    """Return limits as `rollout` takes them.

    Parameters
    ----------
    given : Path, list or dict
        As `LimitsType` returns them.
    names : sequence of str
        Of the states that have limits.

    Returns
    -------
    list or dict
        Pairs.

    Raises
    ------
    DataError
        A robot's joints do not go with the states, or it cannot be read.
    """
    if not isinstance(given, Path):
        return given
    from unconstrain.robots import Robot

    return _of_joints(Robot.load(given), names, given)


def _of_joints(robot: "Robot", names: Sequence[str], path: Path) -> Any:
    joints = dict(zip(robot.joints, robot.limits.tolist(), strict=True))
    shared = {name: joints[name] for name in names if name in joints}
    if shared:
        return shared
    if len(joints) != len(names):
        raise DataError(
            f"{path} has the joints {', '.join(joints)}, and the states are {', '.join(names)}: give limits= in "
            f'numbers, "{names[0]}=-1:1"'
        )
    pairs = ", ".join(f"{name} is {joint}" for name, joint in zip(names, joints, strict=True))
    reporting.say(
        f"note: limits are taken in the order of the joints, so {pairs}; --limits in numbers says otherwise"
    )
    return list(joints.values())
