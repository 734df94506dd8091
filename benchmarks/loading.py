"""Files into demonstrations, beside what their libraries take to read the same numbers and do nothing with them.

Seven states, seven velocities, the time and the episode of each sample, in episodes of a thousand samples, with the
roles of all columns given. With velocities in the file `load` differentiates nothing; `load-csv-positions` reads the
same file without them, where it does. All in processor time of all threads, in turns within one process: what else the
machine does counts less then. `LOAD_MEGABYTES=1000 python -m benchmarks load-csv` measures a text of a gigabyte.
"""

import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import unconstrain as uc
from benchmarks.ratio import Ratio
from benchmarks.stream import peak

MEGABYTES = float(os.environ.get("LOAD_MEGABYTES", "100"))
"""Of text."""

BYTES_A_ROW = 280
SAMPLES = 1000
"""In an episode."""

ARRAY_ROWS = 1_000_000
MESSAGES = 40_000
STATE, ACTION = [f"x{i}" for i in range(7)], [f"u{i}" for i in range(7)]


def csv() -> Ratio:
    """A text, beside pyarrow reading the same columns."""
    import pyarrow.csv

    path = _csv()
    columns = pyarrow.csv.ConvertOptions(include_columns=[*STATE, *ACTION, "t", "run"])
    return _ratio(
        "load-csv",
        f"uc.load of a CSV of {path.stat().st_size / 1e6:.0f} MB, velocities recorded",
        "pyarrow.csv.read_csv of these columns",
        lambda: _load(path),
        lambda: pyarrow.csv.read_csv(path, convert_options=columns),
        1.3,
    )


def csv_positions() -> Ratio:
    """The same text without its velocities, which are then the derivative of the states."""
    import pyarrow.csv

    path = _csv()
    columns = pyarrow.csv.ConvertOptions(include_columns=[*STATE, "t", "run"])
    return _ratio(
        "load-csv-positions",
        f"uc.load of states alone of {path.stat().st_size / 1e6:.0f} MB, differentiated",
        "pyarrow.csv.read_csv of these columns",
        lambda: uc.load(path, state=STATE, time="t", episode="run"),
        lambda: pyarrow.csv.read_csv(path, convert_options=columns),
        1.3,
    )


def csv_memory() -> Ratio:
    """Peak memory of loading the text, beside its columns in double precision; in a process of its own."""
    path = _csv()
    command = [sys.executable, "-m", "benchmarks.loading", str(path)]
    done = subprocess.run(
        command, cwd=Path(__file__).parents[1], stdout=subprocess.PIPE, text=True, check=True
    )
    found = json.loads(done.stdout)
    columns = 8.0 * found["samples"] * (len(STATE) + len(ACTION) + 2)
    return Ratio(
        "load-csv-memory",
        f"uc.load of a CSV of {path.stat().st_size / 1e6:.0f} MB: most memory taken",
        "its columns in double precision",
        found["taken"] / columns,
        3.0,
        found["seconds"],
        0.0,
    )


def hdf5() -> Ratio:
    """Episodes as groups of an HDF5 file, as robomimic writes them."""
    import h5py

    path = _shelf() / "many.hdf5"
    X, U, t = _movements(ARRAY_ROWS)
    with h5py.File(path, "w") as file:
        for i in range(ARRAY_ROWS // SAMPLES):
            own = slice(i * SAMPLES, (i + 1) * SAMPLES)
            group = file.create_group(f"data/demo_{i}")
            group["x"], group["u"], group["t"] = X[own], U[own], t[own]

    def bare() -> list[np.ndarray]:
        with h5py.File(path, "r") as file:
            return [group[name][()] for group in file["data"].values() for name in ("x", "u", "t")]

    return _ratio(
        "load-hdf5", f"uc.load of {ARRAY_ROWS:.0e} samples in HDF5", "h5py reading the same arrays",
        lambda: uc.load(path, state="x", action="u", time="t"), bare, 1.5,
    )  # fmt: skip


def matlab() -> Ratio:
    """Episodes as an array of structs in a MATLAB file, compressed."""
    import scipy.io

    path = _shelf() / "many.mat"
    X, U, t = _movements(ARRAY_ROWS)
    episodes = np.array(
        [(X[at : at + SAMPLES], U[at : at + SAMPLES], t[at : at + SAMPLES]) for at in range(0, ARRAY_ROWS, SAMPLES)],
        dtype=[("x", object), ("u", object), ("t", object)],
    )  # fmt: skip
    scipy.io.savemat(path, {"demos": episodes}, do_compression=True)  # as MATLAB does
    return _ratio(
        "load-matlab", f"uc.load of {ARRAY_ROWS:.0e} samples in MATLAB", "scipy.io.loadmat",
        lambda: uc.load(path, state="x", action="u", time="t"), lambda: scipy.io.loadmat(path), 1.5,
    )  # fmt: skip


def mcap() -> Ratio:
    """Messages of joint states in an MCAP file, beside the same library decoding the same messages."""
    from rosbags.highlevel import AnyReader
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    folder = _shelf() / "bag"
    store = get_typestore(Stores.ROS2_HUMBLE)
    joints, header, stamp = (
        store.types[name]
        for name in ("sensor_msgs/msg/JointState", "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    )
    X, U, _ = _movements(MESSAGES)
    names, none = [f"joint{i}" for i in range(7)], np.zeros(0)
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/joint_states", joints.__msgtype__, typestore=store)
        for i in range(MESSAGES):
            at = i * 10_000_000
            seconds, rest = divmod(at, 1_000_000_000)
            message = joints(header(stamp(seconds + 1, rest), ""), names, X[i], U[i], none)
            writer.write(connection, at + 1_000_000_000, store.serialize_cdr(message, joints.__msgtype__))
    (path,) = folder.glob("*.mcap")

    def bare() -> list:
        with AnyReader([path], default_typestore=store) as reader:
            messages = reader.messages(reader.connections)
            return [reader.deserialize(data, connection.msgtype) for connection, _, data in messages]

    return _ratio(
        "load-mcap", f"uc.load of {MESSAGES} joint states in MCAP", "rosbags decoding the same messages",
        lambda: uc.load(path, state="position", action="velocity"), bare, 1.5,
    )  # fmt: skip


def _ratio(
    name: str, work: str, against: str, ours: Callable[[], object], bare: Callable[[], object], reach: float
) -> Ratio:
    mine, theirs = _processor_medians(ours, bare)
    return Ratio(name, work, f"{against}, processor time", mine / theirs, reach, mine, theirs)


def _processor_medians(*calls: Callable[[], object], repeats: int = 5) -> list[float]:
    """Median processor seconds of each call, in turns after a warm-up."""
    for call in calls:
        call()
    times: list[list[float]] = [[] for _ in calls]
    for _ in range(repeats):
        for own, call in zip(times, calls, strict=True):
            start = time.process_time()
            call()
            own.append(time.process_time() - start)
    return [statistics.median(own) for own in times]


@cache
def _csv() -> Path:
    import pyarrow as pa
    import pyarrow.csv

    path = _shelf() / "many.csv"
    count = int(MEGABYTES * 1e6 / BYTES_A_ROW)
    X, U, t = _movements(count)
    columns = {"t": t.round(4), "run": np.arange(count) // SAMPLES}
    columns |= dict(zip(STATE, X.T, strict=True)) | dict(zip(ACTION, U.T, strict=True))
    pyarrow.csv.write_csv(pa.table(columns), path)
    return path


def _movements(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States (N, 7), velocities (N, 7), and time (N,) within episodes that swing at seven frequencies, with noise."""
    rng = np.random.default_rng(0)
    t = np.arange(count) % SAMPLES * 0.01
    phase = rng.uniform(0, 6, count // SAMPLES + 1)[np.arange(count) // SAMPLES]
    angle = t[:, None] * np.arange(1.0, 8.0) + phase[:, None]
    noise = 1e-3 * rng.standard_normal((2, count, 7))
    return np.sin(angle) + noise[0], np.arange(1.0, 8.0) * np.cos(angle) + noise[1], t


@cache
def _folder() -> TemporaryDirectory:
    return TemporaryDirectory(prefix="unconstrain-loading-")


def _shelf() -> Path:
    return Path(_folder().name)


BENCHMARKS: dict[str, Callable[[], Ratio]] = {
    "load-csv": csv,
    "load-csv-positions": csv_positions,
    "load-csv-memory": csv_memory,
    "load-hdf5": hdf5,
    "load-matlab": matlab,
    "load-mcap": mcap,
}


def _load(path: str | Path) -> uc.Demonstrations:
    return uc.load(path, state=STATE, action=ACTION, time="t", episode="run")


if __name__ == "__main__":
    with TemporaryDirectory() as folder, open(sys.argv[1], "rb") as text:
        beginning = Path(folder) / "beginning.csv"
        beginning.write_bytes(text.read(1_000_000).rpartition(b"\n")[0] + b"\n")
        _load(beginning)  # with all libraries that it takes
    before, start = peak(), time.process_time()
    loaded = _load(sys.argv[1])
    spent = time.process_time() - start
    print(json.dumps({"taken": peak() - before, "samples": len(loaded), "seconds": spent}))
