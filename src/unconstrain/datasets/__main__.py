"""Write the recordings that ship with the package anew: ``python -m unconstrain.datasets FOLDER``."""

import sys
from pathlib import Path

from unconstrain.datasets.writing import write

if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit("name the folder to write to: python -m unconstrain.datasets FOLDER")
    for written in write(Path(sys.argv[1])):
        print(written)
