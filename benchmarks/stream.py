"""Learning from more rows than fit into memory: how fast beside reading alone, and in how much memory.

Every measurement runs in a process of its own, so that its memory is its own. The data, 7 states and 7 actions of
float32 a row in files of a million rows each, lie in a temporary folder as long as the benchmarks run.
"""

import json
import resource
import subprocess
import sys
import time
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pyarrow as pa
import pyarrow.dataset
import pyarrow.parquet as pq

import unconstrain as uc
from benchmarks.fits import _data
from benchmarks.ratio import Ratio, medians

ROWS = 20_000_000
ROWS_IN_FILE = 1_000_000
ROWS_IN_MEMORY = 2_000_000  # what the in-memory fit is timed on; its rate does not depend on it
STATE, ACTION = [f"x{i}" for i in range(7)], [f"u{i}" for i in range(7)]
GIB = 2**30


def linear(rows: int = ROWS) -> Ratio:
    """The linear policy, beside pyarrow reading the same columns and doing nothing with them."""
    ours, reading = _measured("linear-time", _folder(rows))["seconds"]
    return Ratio(
        "stream-linear", f"{rows:.0e} rows of 7+7 float32, linear", "pyarrow reading alone", ours / reading, 2.5,
        ours, reading,
    )  # fmt: skip


def local(rows: int = ROWS) -> Ratio:
    """Rows per second of 50 local models, beside those of `fit` with the data in memory."""
    rows = min(rows, ROWS_IN_MEMORY)
    ours, memory = _measured("local-time", _folder(rows))["seconds"]
    return Ratio(
        "stream-local", f"{rows:.0e} rows, 50 local models, rows/s", "fit in memory, rows/s", memory / ours, 0.8,
        ours, memory, True,
    )  # fmt: skip


def linear_memory(rows: int = ROWS) -> Ratio:
    """Peak resident memory of the linear policy's stream, all libraries included."""
    return _memory("linear", rows)


def local_memory(rows: int = ROWS) -> Ratio:
    """The same of 50 local models."""
    return _memory("local", rows)


def _memory(name: str, rows: int) -> Ratio:
    found = _measured(f"{name}-once", _folder(rows))
    return Ratio(
        f"stream-{name}-memory", f"{rows:.0e} rows, {name}: peak resident memory", "1 GiB", found["peak"] / GIB, 1.0,
        found["seconds"][0], 0.0,
    )  # fmt: skip


@cache
def _shelf() -> TemporaryDirectory:
    return TemporaryDirectory(prefix="unconstrain-stream-")


@cache
def _folder(rows: int) -> Path:
    """A folder of so many rows, written once."""
    folder = Path(_shelf().name) / str(rows)
    folder.mkdir()
    for i, start in enumerate(range(0, rows, ROWS_IN_FILE)):
        X, U = _data(min(ROWS_IN_FILE, rows - start), 7, seed=i)
        columns = {name: pa.array(values.astype(np.float32)) for name, values in zip(STATE, X.T, strict=True)}
        columns |= {
            name: pa.array(values.astype(np.float32)) for name, values in zip(ACTION, U.T, strict=True)
        }
        pq.write_table(pa.table(columns), folder / f"part-{i}.parquet")
    return folder


def _measured(task: str, folder: Path) -> dict:
    command = [sys.executable, "-m", "benchmarks.stream", task, str(folder)]
    done = subprocess.run(
        command, cwd=Path(__file__).parents[1], stdout=subprocess.PIPE, text=True, check=True
    )
    return json.loads(done.stdout)


def _read(folder: str) -> int:
    dataset = pyarrow.dataset.dataset(folder, format="parquet")
    return sum(batch.num_rows for batch in dataset.to_batches(columns=STATE + ACTION))


def _local_policy() -> uc.LocallyLinearPolicy:
    return uc.LocallyLinearPolicy(centers=_data(50, 7)[0], width=3**0.5, alpha=1e-6, risk="inconsistency")


def _stream(policy, folder: str):
    return uc.fit_stream(policy, uc.open(folder, state=STATE, action=ACTION))


def _child(task: str, folder: str) -> list[float]:
    if task == "linear-time":
        return medians(
            lambda: _stream(uc.ParametricPolicy(alpha=1e-6, risk="inconsistency"), folder),
            lambda: _read(folder),
            repeats=5,
        )
    if task == "local-time":
        table = pq.read_table(folder)
        X, U = (
            np.column_stack([table[name].to_numpy() for name in names]).astype(np.float64)
            for names in (STATE, ACTION)
        )
        del table
        return medians(lambda: _stream(_local_policy(), folder), lambda: _local_policy().fit(X, U), repeats=3)
    start = time.perf_counter()
    _stream({"linear-once": uc.ParametricPolicy, "local-once": _local_policy}[task](), folder)
    return [time.perf_counter() - start]


def peak() -> int:
    """Bytes. Not `ru_maxrss` where it can be helped: on Linux a process inherits that of the one that started it."""
    status = Path("/proc/self/status")
    if status.exists():
        (line,) = (line for line in status.read_text().splitlines() if line.startswith("VmHWM:"))
        return int(line.split()[1]) * 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


if __name__ == "__main__":
    seconds = _child(*sys.argv[1:])
    print(json.dumps({"seconds": seconds, "peak": peak()}))
