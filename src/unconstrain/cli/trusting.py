"""Policies whose files hold parts of regressors that have to be trusted by name, on the command line."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from unconstrain.errors import ArchiveError, UntrustedArchiveError

if TYPE_CHECKING:
    from unconstrain.policies.base import Policy

trusted = click.option(
    "--trusted",
    multiple=True,
    metavar="NAME",
    help="What a policy made of a regressor may hold, sklearn.tree._tree.Tree for one; the error that asks for it has "
    "the names. May be given several times.",
)
"""Decorator of a command that reads a policy, and is called with `trusted=(name, ...)`."""


def load(path: Path, names: Sequence[str]) -> "Policy":
    """Read a saved policy.

    Parameters
    ----------
    path : Path
        The file.
    names : sequence of str
        What it may hold besides the closed list.

    Returns
    -------
    Policy
        Fitted.

    Raises
    ------
    ArchiveError
        It cannot be read, or holds something that is not trusted.
    """
    from unconstrain.policies import load_policy

    try:
        return load_policy(path, trusted=list(names))
    except UntrustedArchiveError as error:
        if any(
            ":" in name for name in error.names
        ):  # code of the user's own, which only a program can import
            raise
        options = " ".join(f"--trusted {name}" for name in error.names)
        raise ArchiveError(
            f"{path} holds {', '.join(error.names)}, which unconstrain does not know: if you trust the file's source, "
            f"add {options}"
        ) from None
