"""One format for everything that is saved: policies, constraints, moments, demonstrations, checkpoints.

A file is a zip that NumPy can open: one `.npy` for each array, and `unconstrain.json`, which says what the file holds,
in which layout, which release wrote it, and how the arrays belong together. Nothing in a file is code, and nothing in
it is looked up or called: a name of a class only chooses from a closed list (`classes`) or from what the caller passes
as trusted.

- `archive` writes and reads the file, and says everything that can be wrong with one.
- `encoding` turns objects into a tree of plain values and named arrays, and back.
- `classes` lists the classes that files may hold.
"""

from unconstrain.storage.archive import Kind, damaged, kind_of, read, write
from unconstrain.storage.encoding import decode, encode, foreign_parts
from unconstrain.storage.objects import load_object, save_object

__all__ = [
    "Kind",
    "damaged",
    "decode",
    "encode",
    "foreign_parts",
    "kind_of",
    "load_object",
    "read",
    "save_object",
    "write",
]
