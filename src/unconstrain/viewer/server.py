"""viser, started on a port of this computer."""

import contextlib
import io
import logging
import socket
from typing import Any

from unconstrain.errors import UnconstrainError

HOST, PORT = "127.0.0.1", 8080
"""Only this computer can open the page, and others through SSH."""


def start(host: str = HOST, port: int = PORT) -> Any:
    """Start a server.

    Parameters
    ----------
    host : str
        The address to listen at.
    port : int
        The port; 0 for any that is free.

    Returns
    -------
    viser.ViserServer
        Without a picture.

    Raises
    ------
    UnconstrainError
        The extra `view` is not installed, or the port is taken.
    """
    try:
        import viser
    except ImportError as error:
        raise UnconstrainError(
            f"the page is shown by viser, which cannot be imported here ({error}): pip install 'unconstrain[view]'"
        ) from error
    check_port(host, port)
    # Without a handler, Python prints a traceback for whoever opens the port and speaks no HTTP.
    logging.getLogger("websockets.server").addHandler(logging.NullHandler())
    with contextlib.redirect_stdout(io.StringIO()):  # viser prints a panel of its own
        server = viser.ViserServer(host=host, port=port, label="unconstrain", verbose=False)
    # Colours are to be seen as they are in the legend: light from everywhere, and a little from the front for shape.
    server.scene.configure_environment_map(hdri=None)
    server.scene.configure_default_lights(enabled=False, cast_shadow=False)
    server.scene.add_light_ambient("/light/everywhere", intensity=2.3)
    server.scene.add_light_directional("/light/front", intensity=0.9, position=(1.0, -1.0, 3.0))
    server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium")
    return server


def stop(server: Any) -> None:
    """End a server.

    Parameters
    ----------
    server : viser.ViserServer
        From `start`.
    """
    with contextlib.redirect_stdout(io.StringIO()):  # viser prints a line of its own
        server.stop()


def check_port(host: str, port: int) -> None:
    """Raise `UnconstrainError` for a port that is taken: viser would take another, and say nothing."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            trial.bind((host, port))
        except socket.gaierror as error:
            raise UnconstrainError(
                f"{host!r} is no address of this computer ({error.strerror}): give another with host=, or leave it out"
            ) from None
        except OSError as error:
            reason = error.strerror or str(error)
            raise UnconstrainError(
                f"the page cannot be served at port {port} of {host} ({reason}): choose another with port=, or port=0 "
                "for any that is free"
            ) from None
