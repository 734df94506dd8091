"""Recordings of people, whose policy and constraints nobody knows: handwriting, reaches, circles on surfaces."""

from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from reproduction.adaptive.likelihood import Spread, log_likelihood
from reproduction.adaptive.settings import Part, Reach, Result
from reproduction.adaptive.ways import ADAPTIVE, TOLD, Cell, describe_found, learn
from reproduction.constraints.surfaces import load_surfaces
from reproduction.recordings import CURVED, FLAT
from unconstrain import metrics
from unconstrain.demonstrations import Demonstrations
from unconstrain.errors import UnconstrainError
from unconstrain.fitting.solve import splits
from unconstrain.policies import LocallyLinearPolicy, ParametricPolicy
from unconstrain.policies.base import Policy

Array = NDArray[np.float64]

HANDWRITING, REACHING = Path("handwriting"), Path("reaching") / "reaching_cluttered.mat"
"""In the folder of recordings: a MATLAB file a shape (LASA); ten reaches among boxes (CLAMP)."""

SHOWN = 4
"""Demonstrations of a shape to learn from; the others are held out."""

FREE_REACHES, BENT_REACHES = tuple(range(5)), tuple(range(5, 10))
"""Demonstrations that stay far from any box, and those that pass close to one."""

FREE_SHOWN = 2
"""Free reaches to learn from, beside all bent ones; the other free ones are held out."""

SMOOTHING, BLOCKS = 25, 5
"""Samples (at 50 Hz) that the circle's centre is smoothed over, and blocks of each recording, a fold each."""

LIKELIHOOD = "log-likelihood"


def list_files(part: str, folder: Path) -> list[Path]:
    """List the files of a part in the folder of recordings."""
    if part == "handwriting":
        return sorted((folder / HANDWRITING).glob("*.mat"))
    wanted = {"reaching": (REACHING,), "surfaces": (Path(FLAT), Path(CURVED))}[part]
    return [folder / name for name in wanted if (folder / name).is_file()]


def find_missing(part: str, folder: Path) -> str | None:
    """Say what a part lacks in the folder of recordings, if anything."""
    found, wanted = len(list_files(part, folder)), {"surfaces": 2}.get(part, 1)
    if found >= wanted:
        return None
    names = {
        "handwriting": f"{HANDWRITING}/*.mat",
        "reaching": str(REACHING),
        "surfaces": f"{FLAT} and {CURVED}",
    }
    return f"{folder} does not hold {names[part]}"


def load_demonstrations(path: Path, listed: str, transposed: bool) -> list[tuple[Array, Array]]:
    """Load positions and velocities, (N, n) each, of every demonstration in a MATLAB file.

    Parameters
    ----------
    path : Path
        The file.
    listed : str
        The name of its list of demonstrations.
    transposed : bool
        Whether they are held a row a dimension.

    Returns
    -------
    list of (ndarray, ndarray)
        In the order of the file.

    Raises
    ------
    UnconstrainError
        It is no such file.
    """
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        found: Any = loadmat(path, simplify_cells=True)[listed]
        pairs = [[np.asarray(one[key], dtype=np.float64) for key in ("pos", "vel")] for one in found]
    except (OSError, MatReadError, ValueError, KeyError, TypeError, NotImplementedError) as error:
        raise UnconstrainError(
            f"{path} cannot be read as MATLAB's list {listed!r} of pos and vel: {error}"
        ) from error
    return [(X.T, U.T) if transposed else (X, U) for X, U in pairs]


def join(pairs: list[tuple[Array, Array]]) -> Demonstrations:
    """Make demonstrations of pairs of states and actions, an episode each."""
    X, U = (np.vstack(each) for each in zip(*pairs, strict=True))
    return Demonstrations(X, U, episodes=np.repeat(np.arange(len(pairs)), [len(x) for x, _ in pairs]))


def run_handwriting(ways: tuple[str, ...], folder: Path | None, seed: int) -> Result:
    """Learn every shape from four of its demonstrations, drawn at random: velocity errors on the others in mm/s."""
    assert folder is not None
    result: Result = {}
    for path in list_files("handwriting", folder):
        pairs = load_demonstrations(path, "demos", transposed=True)
        order = np.random.default_rng(seed).permutation(len(pairs))
        train, test = (join([pairs[i] for i in each]) for each in (order[:SHOWN], order[SHOWN:]))
        result[path.stem] = _measure(LocallyLinearPolicy(), ways, train, test, _velocity_error)
    return result


def list_reaching_splits() -> dict[str, list[tuple[list[int], list[int]]]]:
    """List what is learnt from and what is held out, by cell: numbers of demonstrations."""
    everything = (*FREE_REACHES, *BENT_REACHES)
    splits_of = {
        f"{name} reach left out": [([i for i in everything if i != k], [k]) for k in numbers]
        for name, numbers in (("free", FREE_REACHES), ("bent", BENT_REACHES))
    }
    splits_of[f"bent and {FREE_SHOWN} free, on the other free"] = [
        ([*BENT_REACHES, *shown], [i for i in FREE_REACHES if i not in shown])
        for shown in combinations(FREE_REACHES, FREE_SHOWN)
    ]
    return splits_of


def run_reaching(ways: tuple[str, ...], folder: Path | None, seed: int) -> Result:
    """Learn the k-th split of each kind: errors of the whole action, as shares of its variance."""
    assert folder is not None
    pairs = load_demonstrations(folder / REACHING, "dataset", transposed=False)
    result: Result = {}
    for cell, listed in list_reaching_splits().items():
        if seed < len(listed):
            train, test = (join([pairs[i] for i in each]) for each in listed[seed])
            result[cell] = _measure(LocallyLinearPolicy(), ways, train, test, _whole_error)
    return result


def run_surfaces(ways: tuple[str, ...], folder: Path | None, seed: int) -> Result:
    """Learn a finger's circles on two surfaces, relative to their centre: held-out likelihood, and transfer."""
    assert folder is not None
    flat, curved = (centre(demos) for demos in load_surfaces(folder))
    result: Result = {}
    for name, demos in (("flat", flat), ("curved", curved)):
        result[f"{name}, held-out blocks, {LIKELIHOOD}"] = _measure_blocks(ways, demos)
    for name, train, test in (("flat to curved", flat, curved), ("curved to flat", curved, flat)):
        blocked = Demonstrations(train.states, train.actions, episodes=train.blocks(BLOCKS))
        result[f"{name}, whole action"] = _measure(ParametricPolicy(), ways, blocked, test, _whole_error)
        result[f"{name}, along the motion"] = _measure(ParametricPolicy(), ways, blocked, test, _error_along)
    return result


def centre(demos: Demonstrations) -> Demonstrations:
    """Take out of each episode the slow drift of its circle's centre."""
    X, U = demos.states.copy(), demos.actions.copy()
    for k in range(demos.n_episodes):
        own = demos.episodes == k
        for each in (X, U):
            each[own] -= gaussian_filter1d(each[own], SMOOTHING, axis=0)
    return replace(demos, states=X, actions=U)


def _measure_blocks(ways: tuple[str, ...], demos: Demonstrations) -> Cell:
    """Measure the mean log-likelihood of samples in held-out blocks, nats a sample."""
    blocks = demos.blocks(BLOCKS)
    result: Cell = {}
    for way in _without_told(ways):
        total = 0.0
        for train, test in splits(len(demos), blocks):
            seen = Demonstrations(demos.states[train], demos.actions[train], episodes=blocks[train])
            learnt = learn(ParametricPolicy(), way, seen)
            spread = Spread.find(seen.actions, learnt.predict(seen.states))
            P = learnt.predict(demos.states[test])
            total += float(np.sum(log_likelihood(demos.actions[test], P, spread)))
        result[way] = total / len(demos)
    return result


def _measure(
    policy: Policy, ways: tuple[str, ...], train: Demonstrations, test: Demonstrations, error: Any
) -> Cell:
    """Learn in every way, and measure an error on what is held out."""
    result: Cell = {}
    for way in _without_told(ways):
        learnt = learn(policy, way, train)
        result[way] = error(test.actions, learnt.predict(test.states))
        if way == ADAPTIVE:
            result |= describe_found(learnt, train)
    return result


def _without_told(ways: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(way for way in ways if way != TOLD)


def _velocity_error(U: Array, P: Array) -> float:
    return float(np.sqrt(np.mean(np.sum((U - P) ** 2, axis=1))))


def _whole_error(U: Array, P: Array) -> float:
    return metrics.normalized(metrics.direct(U, P), U)


def _error_along(U: Array, P: Array) -> float:
    return 1.0 - metrics.explained(U, P)


RECORDED = {
    "handwriting": Part(
        title="Handwriting (LASA), nothing constrained",
        measure=f"root mean square error of the velocity in mm/s, on the demonstrations beside {SHOWN} learnt from",
        run=run_handwriting,
        settings={"shown": SHOWN, "model": "30 local models"},
        otherwise=Reach(direct=1.2),
        overall=Reach(direct=1.05),
        needs="data",
    ),
    "reaching": Part(
        title="Reaches among boxes (CLAMP)",
        measure="error of the whole action on held-out reaches, as a share of its variance",
        run=run_reaching,
        settings={"shown": FREE_SHOWN, "model": "30 local models"},
        overall=Reach(direct=1.0),
        needs="data",
        fixed=True,
    ),
    "surfaces": Part(
        title="A finger's circles on two surfaces, relative to their centre",
        measure="errors as shares of the action's variance, of the whole action and along the motion alone; "
        "log-likelihoods in nats a sample",
        run=run_surfaces,
        settings={"smoothing": SMOOTHING, "blocks": BLOCKS, "model": "linear"},
        trials=1,
        reaches={
            f"{name}, held-out blocks, {LIKELIHOOD}": Reach(likelihood=True) for name in ("flat", "curved")
        },
        otherwise=Reach(direct=1.0),
        needs="data",
        fixed=True,
    ),
}
"""The parts that look at recordings."""
