"""What this package wrote itself: archives of demonstrations, and demonstrations that are in memory still."""

import hashlib
import math
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from unconstrain.demonstrations_file import FORMAT, NAMES
from unconstrain.errors import ArchiveError, DataError, UnconstrainError
from unconstrain.recordings.columns import Columns
from unconstrain.recordings.files import File
from unconstrain.recordings.formats.arrays import header_of, to_arrow
from unconstrain.recordings.formats.base import ColumnKey, Declared, OneFile
from unconstrain.recordings.table import Header
from unconstrain.spaces import from_description
from unconstrain.storage import Kind, read
from unconstrain.storage.archive import NOTE, damaged


class Saved(OneFile):
    """An archive that `Demonstrations.save` wrote, which is read as a whole.

    Parameters
    ----------
    file : File
    """

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the content is an archive of this package, of whatever kind."""
        head = file.begin(30 + len(NOTE))
        return head[:4] == b"PK\x03\x04" and head[30:] == NOTE.encode()

    def columns(self) -> Header:
        """Return the arrays (N,) and (N, k) as columns."""
        return self._described[0]

    def declared(self) -> Declared | None:
        """Return the roles of the arrays."""
        return self._described[1]

    @property
    def row_groups(self) -> tuple[int, ...]:
        """The number of samples."""
        return self._described[2]

    def read(
        self, columns: Sequence[ColumnKey], start: int = 0, stop: int | None = None
    ) -> Iterator[tuple[int, pa.RecordBatch]]:
        """Read samples of these columns as one piece, with its first row."""
        return self._read().read(columns, start, stop)

    @cached_property
    def _described(self) -> tuple[Header, Declared | None, tuple[int, ...]]:
        held = self._read()
        return held.columns(), held.declared(), held.row_groups

    def _read(self) -> "InMemory":
        if self.file.local:
            return self._read_from(self.file.path)
        with tempfile.TemporaryDirectory() as folder:
            copy = Path(folder) / self.file.name
            copy.write_bytes(self.file.read())
            return self._read_from(str(copy))

    def _read_from(self, path: str) -> "InMemory":
        try:
            about, arrays = read(path, Kind.DEMONSTRATIONS)
        except ArchiveError as error:
            raise DataError(str(error).replace(path, self.file.shown)) from error
        if "states" in arrays and arrays["states"].ndim == 0:
            raise damaged(self.file.shown, Kind.DEMONSTRATIONS, "it holds no states")
        return InMemory(arrays, about, self.file)


class InMemory(OneFile):
    """Demonstrations that are in memory already, read as a file would be.

    Parameters
    ----------
    arrays : mapping of str to array
        As `demonstrations_file.arrays_of` gives them.
    about : dict
        As `demonstrations_file.describe` gives it.
    file : File, optional
        Where they are from.
    """

    def __init__(
        self, arrays: Mapping[str, NDArray[Any]], about: dict[str, Any], file: File | None = None
    ) -> None:
        self.file = file or File("these demonstrations", "demonstrations", None)
        self._arrays, self._about = arrays, about

    def columns(self) -> Header:
        """Return the arrays (N,) and (N, k) as columns."""
        shapes = {name: (array.dtype, array.shape) for name, array in self._arrays.items()}
        return header_of(shapes, self.file.shown)

    def declared(self) -> Declared | None:
        """Return the roles of the arrays."""
        return declare(self._about, self.file.shown)

    @property
    def row_groups(self) -> tuple[int, ...]:
        """The number of samples."""
        return (len(self._arrays["states"]),)

    def read(
        self, columns: Sequence[ColumnKey], start: int = 0, stop: int | None = None
    ) -> Iterator[tuple[int, pa.RecordBatch]]:
        """Read samples of these columns as one piece, with its first row."""
        values = [to_arrow(self._arrays[name][start:stop]) for name, _ in columns]
        yield start, pa.RecordBatch.from_arrays(values, names=[name for name, _ in columns])

    def identity(self) -> str:
        """Say what tells these demonstrations from others: a digest of the arrays."""
        digest = hashlib.blake2b(digest_size=16)
        for name, array in self._arrays.items():
            digest.update(f"{name} {array.dtype} {array.shape}".encode())
            digest.update(np.ascontiguousarray(array).data)
        return digest.hexdigest()


def declare(about: Any, shown: str) -> Declared:
    """Read what `Demonstrations.save` says of the columns.

    Parameters
    ----------
    about : dict
        What lies beside the columns, as `demonstrations_file.describe` made it.
    shown : str
        The file, as the user calls it.

    Returns
    -------
    Declared

    Raises
    ------
    DataError
        It is damaged, or was written by a newer release.
    """
    try:
        newer = about["format"] > FORMAT
        names = {name: tuple(map(str, about[name])) for name in NAMES}
        roles = {
            str(role): keys if isinstance(keys, str) else list(map(str, keys))
            for role, keys in about["roles"].items()
        }
        state, action, episode = roles["states"], roles["actions"], roles["episodes"]
        single = [roles.get(role) for role in ("time", "free")]
        if not all(key is None or isinstance(key, str) for key in (*single, episode)):
            raise TypeError("one column is needed")
        force = roles.get("forces")
        projections = roles.get("projections")
        columns = Columns(state, action, single[0], episode)  # type: ignore[arg-type]
        space = from_description(about["space"]) if "space" in about else None
        noise = about.get("noise")
        noise = None if noise is None else float(noise)
        if noise is not None and not 0 <= noise < math.inf:
            raise ValueError("the noise is none")
    except (UnconstrainError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise DataError(f"{shown} is damaged and cannot be read as saved demonstrations") from error
    if newer:
        raise DataError(f"{shown} was written by a newer release of unconstrain; upgrade to read it")
    return Declared(
        columns,
        saved=True,
        policy=roles.get("policy"),
        force=force,
        free=single[1],  # type: ignore[arg-type]
        projections=projections,
        state_names=names["state_names"],
        action_names=names["action_names"],
        episode_labels=names["episode_labels"],
        space=space,
        notes=names["notes"],
        noise=noise,
    )
