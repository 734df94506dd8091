"""`unconstrain view`: watch a learnt policy, and stand in its way."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from unconstrain.errors import UnconstrainError
from unconstrain.policies import load_policy


def view(
    name: Annotated[str, typer.Argument(help="grasp.", metavar="EXPERIMENT")] = "grasp",
    policy: Annotated[
        Path | None,
        typer.Option(
            "--policy", help="A saved policy over both hands' positions; without it one is learnt first."
        ),
    ] = None,
    movements: Annotated[
        int, typer.Option("--movements", min=5, help="Constrained movements to learn from.")
    ] = 100,
    robot: Annotated[Path | None, typer.Option("--robot", help="Your robot, MJCF or URDF.")] = None,
    lock: Annotated[str, typer.Option("--lock", help="Joints of it to lock, by commas.")] = "",
    hands: Annotated[str, typer.Option("--hands", help="Its hand frames, LEFT,RIGHT.")] = "",
    feet: Annotated[
        str, typer.Option("--feet", help="Its foot bodies, LEFT,RIGHT; without them the base stands still.")
    ] = "",
) -> None:
    """Open MuJoCo's viewer: the learnt policy moves the robot, and keys change the barrier's gap."""
    from reproduction import grasp, grasp_viewer
    from reproduction.robots import RobotChoice

    if name != "grasp":
        raise UnconstrainError(f"there is nothing to view in {name!r}: the experiment with a viewer is grasp")
    console = Console()
    grasp_viewer.check_display()
    demonstrator = grasp.demonstrator_of(RobotChoice.of(robot, lock, hands, feet))
    if policy is not None:
        learnt = load_policy(policy)
    else:
        console.print(f"learning from {movements} constrained movements")
        learnt, _ = grasp.learn(grasp.training(demonstrator, 0, movements)[0].demonstrations, "inconsistency")
    console.print(grasp_viewer.HELP)
    grasp_viewer.view(demonstrator, learnt)
