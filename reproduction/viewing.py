"""The program's command `view`: an experiment in the browser, to stand in its way."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from reproduction.options import FEET, PATH, ROBOT, add_options, make_console
from unconstrain.cli.command import Command, Group

if TYPE_CHECKING:
    from rich.console import Console

    from reproduction.grasp.page import GraspPage
    from unconstrain.viewer.page import Page

HOST, PORT = "127.0.0.1", 8080
"""Those of `unconstrain.viewer.server`, which is not imported before it is needed."""

PERIOD = 6.3
"""Seconds that the limit cycle takes for one turn, about."""

SERVED = (
    click.option(
        "--port",
        type=click.IntRange(0, 65535),
        default=PORT,
        show_default=True,
        help="The port of the page; 0 for any that is free.",
    ),
    click.option(
        "--host",
        default=HOST,
        show_default=True,
        help="Where the page can be opened: on this computer only, or with 0.0.0.0 by all that reach it.",
    ),
)


@click.group("view", cls=Group)
def view() -> None:
    """Look at an experiment in the browser, and stand in its way: grasp, cycle."""


@view.command("grasp", cls=Command)
@click.option(
    "--policy",
    type=PATH,
    help="A saved policy over both hands' positions; without it one is learnt first.",
)
@click.option(
    "--movements",
    type=click.IntRange(min=5),
    default=100,
    show_default=True,
    help="Constrained movements to learn from.",
)
@click.option(
    "--risk",
    type=click.Choice(["inconsistency", "adaptive"]),
    default="inconsistency",
    show_default=True,
    help="What the policy is learnt by; adaptive takes ten seconds more.",
)
@add_options(*ROBOT, FEET, *SERVED)
def grasp(
    policy: Path | None,
    movements: int,
    risk: str,
    robot: Path | None,
    lock: str,
    hands: str,
    feet: str,
    port: int,
    host: str,
) -> None:
    """Let the robot grasp in real time, and drag the barrier before it."""
    from unconstrain.viewer import server

    server.check_port(host, port)  # before all that takes long
    from reproduction.grasp.page import GraspPage
    from reproduction.grasp.trial import learn, make_demonstrator, record_training
    from reproduction.plants.robot_choice import RobotChoice
    from unconstrain.policies import load_policy

    console = make_console()
    given = None if policy is None else load_policy(policy)
    demonstrator = make_demonstrator(RobotChoice.parse(robot, lock, hands, feet))
    with console.status(f"learning from {movements} constrained movements"):
        if given is None:
            recording, _ = record_training(demonstrator, 0, movements)
            policies = {
                f"learnt, {risk}": learn(recording.demonstrations, risk)[0],
                "ordinary regression": learn(recording.demonstrations, "direct")[0],
            }
        else:
            policies = {str(policy): given}
        page = GraspPage(demonstrator, policies | {"true policy": demonstrator.policy}, host=host, port=port)
    for note in page.robot.notes:
        console.print(f"note: {note}", soft_wrap=True)
    _serve(console, page, host)


@view.command("cycle", cls=Command)
@click.option(
    "--movements",
    type=click.IntRange(2, 40),
    default=40,
    show_default=True,
    help="Constrained movements to learn from.",
)
@click.option(
    "--risk",
    type=click.Choice(["adaptive", "inconsistency", "direct"]),
    default="adaptive",
    show_default=True,
    help="What the policy is learnt by.",
)
@add_options(*SERVED)
def cycle(movements: int, risk: str, port: int, host: str) -> None:
    """Follow the policy learnt from the toy's movements round the limit cycle, and drag a wall into its way."""
    from unconstrain.viewer import server

    server.check_port(host, port)
    from unconstrain.demo import draw_data, make_policy
    from unconstrain.viewer import view as open_page
    from unconstrain.viewer.obstacles import PLANE

    console = make_console()
    training, _ = draw_data(0)
    # What is known of simulated movements, their constraints, is not told.
    training = replace(training.select(training.episodes < movements), projections=None, policy=None)
    with console.status("learning"):
        page = open_page(make_policy(risk).fit(training), training, host=host, port=port)
    page.set_seconds(PERIOD)
    page.put_in_the_way(PLANE)
    for note in page.notes:
        console.print(f"note: {note}", soft_wrap=True)
    _serve(console, page, host)


def _serve(console: "Console", page: "GraspPage | Page", host: str) -> None:
    try:
        _say_where(console, page.url, host)
        page.wait()
    except KeyboardInterrupt:  # before it waits for one
        page.close()


def _say_where(console: "Console", url: str, host: str) -> None:
    console.print(f"page: {url}", soft_wrap=True)
    if host == HOST:
        port = url.rpartition(":")[2]
        console.print(
            f"from another computer: ssh -L {port}:localhost:{port} this-computer, then open the same address there",
            soft_wrap=True,
        )
    console.print("Ctrl-C ends it")
