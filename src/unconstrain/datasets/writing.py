"""How the recordings that ship with the package were made."""

from pathlib import Path

import numpy as np

from unconstrain.datasets import trolley, wiping


def write(folder: Path) -> tuple[Path, ...]:
    """Simulate the recordings and write them as CSV, over those that are there.

    Parameters
    ----------
    folder : Path
        An existing folder.

    Returns
    -------
    tuple of Path
        The files.
    """
    made = {
        "trolley.csv": (trolley.simulate_trolley(), trolley),
        "wiping.csv": (wiping.simulate_wiping(), wiping),
    }
    for name, (rows, module) in made.items():
        np.savetxt(
            folder / name,
            rows,
            delimiter=",",
            fmt=list(module.FORMAT),
            header=",".join(module.COLUMNS),
            comments="",
        )
    return tuple(folder / name for name in made)
