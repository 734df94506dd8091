"""Write a figure as PNG, SVG or PDF, whole or not at all."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from unconstrain import atomic
from unconstrain.errors import UnconstrainError, show

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".svg", ".pdf")
"""How the name of a figure's file may end."""


def check_suffix(path: str | os.PathLike[str] | None) -> None:
    """Check that a figure can be written in the format that its name ends in.

    Parameters
    ----------
    path : path-like or None
        Where the figure is to be written; None is no figure.

    Raises
    ------
    UnconstrainError
        If the name ends in anything but `.png`, `.svg` or `.pdf`.
    """
    name = "" if path is None else atomic.as_path(path).name
    if path is not None and os.path.splitext(name)[1].lower() not in SUFFIXES:
        raise UnconstrainError(
            f"a figure cannot be written to {name!r}: end the name in {', '.join(SUFFIXES[:-1])} or "
            f"{SUFFIXES[-1]}"
        )


def save(figure: "Figure", path: str | os.PathLike[str]) -> Path:
    """Write a figure as PNG, SVG or PDF, whichever the name ends in; whole or not at all.

    Parameters
    ----------
    figure : Figure
        Of matplotlib.
    path : path-like
        Where to write it. The same figure gives the same file, whatever the date.

    Returns
    -------
    Path
        Where it was written.

    Raises
    ------
    UnconstrainError
        If the name ends in anything else, or cannot be written to, or what is given is no figure.
    """
    if not hasattr(figure, "savefig"):
        raise UnconstrainError(
            f"a figure is what ax.figure is, of the axes that were drawn on, not {show(figure)}"
        )
    check_suffix(path)
    path = Path(path)
    suffix = path.suffix.lower()
    # Without the date the same figure is the same file.
    metadata: dict[str, Any] = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(suffix, {})
    with atomic.replacing(path) as temporary:
        figure.savefig(temporary, format=suffix[1:], dpi=200, metadata=metadata)
    return path
