"""Recordings on disk for the tests of streams: the same samples, cut into files in different ways."""

import json
import time
from itertools import pairwise

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq


def movements(n_episodes=23, seed=0, n=3, smallest=20):
    """States (N, n), actions (N, n), episode numbers (N,) and seconds (N,) of smooth movements, float64."""
    rng = np.random.default_rng(seed)
    X, U, episodes, time = [], [], [], []
    for e in range(n_episodes):
        t = np.arange(rng.integers(smallest, 3 * smallest)) * 0.02
        start, wave = rng.uniform(-1, 1, n), rng.uniform(1, 3, n)
        X.append(start + np.sin(np.outer(t, wave)))
        U.append(np.cos(np.outer(t, wave)) * wave * (rng.random((len(t), 1)) < 0.9))  # some samples rest
        episodes.append(np.full(len(t), 100 + 7 * e))
        time.append(t)
    return np.concatenate(X), np.concatenate(U), np.concatenate(episodes), np.concatenate(time)


def touched(U, episodes, seed=0):
    """What is known of constraints on actions (N, 3): as files hold it, by column.

    Noisy forces of a contact in the middle of each episode, flags that say free for some samples, and projections, of
    which every third is not known, as lists and row by row.
    """
    rng = np.random.default_rng(seed)
    forces, free = 0.1 * rng.normal(size=U.shape), np.zeros(len(U))
    N = np.empty((len(U), 3, 3))
    for label in np.unique(episodes):
        own = np.flatnonzero(episodes == label)
        # Across the motion, as a constraint is; where it rests, across the motion before or after.
        moves = np.flatnonzero(U[own].any(axis=1))
        nearest = moves[np.abs(np.arange(len(own))[:, None] - moves).argmin(axis=1)]
        normal = np.cross(U[own][nearest], rng.normal(size=3))
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        contact = own[len(own) // 4 : len(own) // 4 + rng.integers(3, len(own) // 2)]
        forces[contact] += rng.uniform(1.0, 6.0) * normal[contact - own[0]]
        free[own[-4:]] = 1.0
        N[own] = np.eye(3) - normal[:, :, None] * normal[:, None]
        # Where the next movement begins elsewhere, actions that are differentiated are no motion along anything.
        N[own[:6]] = N[own[-6:]] = np.nan
    N[rng.random(len(U)) < 1 / 3] = np.nan
    rows = [None if np.isnan(row).any() else row for row in N.reshape(-1, 9)]
    return {
        **{f"f{j}": forces[:, j] for j in range(3)},
        "free": free,
        "N": pa.array(rows, pa.list_(pa.float64())),
        **{f"n{j}": N.reshape(-1, 9)[:, j] for j in range(9)},
    }


def write(folder, X, U, episodes, time, cuts, *, lists=False, kind=np.float64, more=None, **options):
    """Parquet files `part-0.parquet`, ..., cut at these rows; with `more` columns."""
    folder.mkdir(exist_ok=True)
    bounds = [0, *cuts, len(X)]
    for i, (a, b) in enumerate(pairwise(bounds)):
        if lists:
            columns = {
                "observation.state": pa.FixedSizeListArray.from_arrays(
                    X[a:b].astype(kind).ravel(), X.shape[1]
                ),
                "action": pa.array(U[a:b].astype(kind).tolist(), pa.list_(pa.from_numpy_dtype(kind))),
            }
        else:
            columns = {f"x{j}": pa.array(X[a:b, j].astype(kind)) for j in range(X.shape[1])}
            columns |= {f"u{j}": pa.array(U[a:b, j].astype(kind)) for j in range(U.shape[1])}
        columns |= {"episode_index": pa.array(episodes[a:b]), "timestamp": pa.array(time[a:b])}
        columns |= {name: pa.array(values[a:b]) for name, values in (more or {}).items()}
        columns |= {"note": pa.array(["never read"] * (b - a))}
        pq.write_table(pa.table(columns), folder / f"part-{i}.parquet", **options)
    return folder


def lerobot(folder, X, U, episodes, time, version="v3.0", names=None):
    """A LeRobot dataset: in v3.0 files of several episodes, in v2.1 one file an episode."""
    (folder / "meta").mkdir(parents=True)
    (folder / "data" / "chunk-000").mkdir(parents=True)
    labels = np.unique(episodes)
    k, d = X.shape[1], U.shape[1]
    single = {"dtype": "int64", "shape": [1], "names": None}
    info = {
        "codebase_version": version,
        "total_frames": len(X),
        "total_episodes": len(labels),
        "fps": 50,
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "features": {
            "observation.state": {"dtype": "float32", "shape": [k], "names": names},
            "action": {"dtype": "float32", "shape": [d], "names": names},
            "episode_index": single,
            "timestamp": {"dtype": "float32", "shape": [1], "names": None},
        },
    }
    (folder / "meta" / "info.json").write_text(json.dumps(info))
    together = 5 if version.startswith("v3") else 1
    for i, some in enumerate(labels[j : j + together] for j in range(0, len(labels), together)):
        rows = np.isin(episodes, some)
        table = pa.table(
            {
                "observation.state": pa.FixedSizeListArray.from_arrays(X[rows].astype(np.float32).ravel(), k),
                "action": pa.FixedSizeListArray.from_arrays(U[rows].astype(np.float32).ravel(), d),
                "timestamp": pa.array(time[rows].astype(np.float32)),
                "episode_index": pa.array(np.searchsorted(labels, episodes[rows])),
                "task_index": pa.array(np.zeros(rows.sum(), dtype=np.int64)),
            }
        )
        name = f"file-{i:03d}.parquet" if together > 1 else f"episode_{i:06d}.parquet"
        pq.write_table(table, folder / "data" / "chunk-000" / name)
    return folder


def slowly(X):
    """Features that take their time; here, where worker processes can import it."""
    time.sleep(0.05)
    return np.tanh(X)
