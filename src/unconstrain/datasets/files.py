"""Where the recordings that ship with the package lie."""

from pathlib import Path

from unconstrain.arrays import quote
from unconstrain.errors import DataError

FOLDER = Path(__file__).parent / "data"


def names() -> tuple[str, ...]:
    """Return the names of the recordings that ship with the package.

    Returns
    -------
    tuple of str
        Names of files, as `path` takes them.
    """
    return tuple(sorted(file.name for file in FOLDER.glob("*.csv")))


def path(name: str) -> Path:
    """Return where a recording lies that ships with the package, for `unconstrain.load` or the command line.

    Parameters
    ----------
    name : str
        One of `names`, such as "wiping.csv".

    Returns
    -------
    Path
        The file.

    Raises
    ------
    DataError
        If there is no recording of this name.
    """
    if name not in names():
        raise DataError(
            f"no recording that ships with the package is called {quote(name)}: {', '.join(names())}"
        )
    return FOLDER / name
