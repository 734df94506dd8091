"""C3D: markers of motion capture, with their rate and units."""

import struct
import tempfile
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pyarrow as pa

from unconstrain.errors import DataError
from unconstrain.memory import check_memory
from unconstrain.recordings.files import File
from unconstrain.recordings.formats.base import damage_named
from unconstrain.recordings.formats.parquet import UNIT
from unconstrain.recordings.formats.tabular import Tabular
from unconstrain.recordings.units import plain_unit


class C3D(Tabular):
    """Points `NAME.X`, `NAME.Y` and `NAME.Z`, and their `time` (s); a point that was not seen is missing.

    Parameters
    ----------
    file : File
    """

    suffixes: ClassVar[tuple[str, ...]] = (".c3d",)

    @classmethod
    def matches(cls, file: File) -> bool:
        """Whether the content is of this format, as its first bytes tell."""
        # The number of the block where parameters begin, and a mark.
        return len(file.magic) > 3 and 2 <= file.magic[0] < 9 and file.magic[1] == 0x50

    def load_table(self) -> tuple[Any, tuple[str, ...]]:
        """Return time and points, and notes on their units and on what is left out."""
        try:
            import ezc3d
        except ImportError:
            raise DataError(
                f"reading {self.file.shown} needs the package ezc3d, which is not installed: "
                "pip install 'unconstrain[c3d]'"
            ) from None
        shown = self.file.shown
        with damage_named(shown, "a C3D file"):
            promised = _check_header(self.file)
            with tempfile.TemporaryDirectory() as folder:
                path = Path(self.file.path)
                if not self.file.local:
                    path = Path(folder) / "points.c3d"
                    path.write_bytes(self.file.read())
                held = ezc3d.c3d(str(path))
            about = held["parameters"]["POINT"]
            points = np.asarray(held["data"]["points"], dtype=np.float64)
            residuals = np.asarray(held["data"]["meta_points"]["residuals"])
            first = int(held["header"]["points"]["first_frame"])
            rate = float(held["header"]["points"]["frame_rate"])
            n_channels = int(held["header"]["analogs"]["size"])
            n_points, n_frames = points.shape[1:]
            names = _names(about, n_points)
        if n_frames < promised:
            raise DataError(f"{shown} is damaged: it has {n_frames} frames of {promised}; export it again")
        if not n_points or not n_frames:
            raise DataError(f"{shown} holds no points, so there is nothing to learn from")
        if not rate > 0:
            raise DataError(f"{shown} does not say its rate: write it again with POINT:RATE")
        positions = np.where(residuals < 0, np.nan, points[:3])
        columns = {"time": pa.array((first + np.arange(n_frames)) / rate)}
        for i, name in enumerate(names):
            for j, axis in enumerate("XYZ"):
                columns[f"{name}.{axis}"] = pa.array(positions[j, i], from_pandas=True)
        unit = plain_unit(next(iter(about.get("UNITS", {}).get("value", [])), ""))
        notes = [f"time is made of the frame numbers and the rate of the header, {rate:g} Hz"]
        if n_channels:
            channels = f"{n_channels} analog channel" + ("s" if n_channels > 1 else "")
            notes.append(f"only points are read: {channels} left out")
        table = pa.table(columns)
        units = ["s", *[unit] * (len(columns) - 1)]
        fields = [
            field.with_metadata({UNIT: own.encode()}) for field, own in zip(table.schema, units, strict=True)
        ]
        return table.cast(pa.schema(fields)), tuple(notes)


def _names(about: Any, n_points: int) -> list[str]:
    """Return the names of points, which do not repeat; more than 255 of them have lists of their own."""
    lists = [
        about[key]["value"] for key in ("LABELS", *(f"LABELS{i}" for i in range(2, 300))) if key in about
    ]
    given = [str(name).strip() for each in lists for name in each][:n_points]
    given += [""] * (n_points - len(given))
    names: list[str] = []
    for i, name in enumerate(given):
        name = name or f"point{i + 1}"
        names.append(name if name not in names else f"{name} ({i + 1})")
    return names


def _check_header(file: File) -> int:
    """Check the sizes that the header promises before a reader makes room for them; return the number of frames."""
    head = file.begin(512)
    n_points, n_values, first, last = struct.unpack("<4H", head[2:10])
    n_frames = max(last - first + 1, 0)
    check_memory(
        16.0 * n_frames * (n_points * 4 + n_values), f"reading {file.shown}", "export fewer frames or markers"
    )
    return n_frames
