"""Write the recordings that ship with the package anew: ``python -m unconstrain.datasets FOLDER``."""

import sys
from pathlib import Path

from unconstrain.datasets.files import names
from unconstrain.datasets.writing import write

if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit("name the folder to write to: python -m unconstrain.datasets FOLDER")
    folder = Path(sys.argv[1])
    if not folder.is_dir():
        raise SystemExit(f"there is no folder {folder}: make it first")
    if taken := [name for name in names() if (folder / name).exists()]:
        raise SystemExit(f"{folder} holds {', '.join(taken)} already: name another folder")
    for written in write(folder):
        print(written)
