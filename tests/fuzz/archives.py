"""Archives: every kind of file that is saved, damaged byte by byte or rewritten by someone who knows the format."""

import io
import json
import os
import zipfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from sklearn.preprocessing import PolynomialFeatures

import unconstrain as uc
from tests.fuzz.engine import Case
from tests.fuzz.values import NUMBERS, TEXTS, damaged, pick, shown, spoiled, strange_place
from unconstrain.errors import UnconstrainError

LOADERS: dict[str, Callable[[Path], Any]] = {
    "policy": uc.load_policy,
    "compiled": uc.load_compiled,
    "constraint": uc.load_constraint,
    "moments": uc.moments.load,
    "demonstrations": lambda path: uc.load(path),
    "checkpoint": lambda path: _go_on(path),
}
"""How a file is loaded, by what its name begins with."""
NESTED = "a list in a list in a list"
"""Stands for them while the tree is a tree."""


def _recording(folder: Path) -> None:
    """A folder of Parquet files for the stream that a checkpoint belongs to."""
    from tests import written

    X, U, episodes, time = written.movements(6, smallest=8)
    written.write(folder, X, U, episodes, time, [40, 80])


def _go_on(checkpoint: Path, progress: Any = None) -> Any:
    recordings = uc.open(
        checkpoint.parent / "recording",
        state=["x0", "x1", "x2"],
        action=["u0", "u1", "u2"],
        episode="episode_index",
    )
    return uc.fit_stream(
        uc.ParametricPolicy(), recordings, checkpoint=checkpoint, checkpoint_seconds=0.0, progress=progress or False,
        batch_rows=10,
    )  # fmt: skip


def stock(folder: Path) -> None:
    """One good file of each kind, and of each class that can be in it."""
    rng = np.random.default_rng(0)
    X = rng.normal(size=(40, 2))
    U, groups = np.tanh(X) + 0.1, np.arange(40) // 10
    policies = {
        "linear": uc.ParametricPolicy(),
        "polynomial": uc.ParametricPolicy(PolynomialFeatures(2)),
        "rbf": uc.ParametricPolicy(uc.NormalizedRBF(4)),
        "splines": uc.ParametricPolicy(uc.DecoupledFeatures(4)),
        "potential": uc.ParametricPolicy(uc.PotentialFeatures(uc.NormalizedRBF(4))),
        "local": uc.LocallyLinearPolicy(n_centers=3, centers="kmeans"),
        "direct": uc.LocallyLinearPolicy(n_centers=3, centers="grid", risk="direct"),
        "corrected": uc.LocallyLinearPolicy(n_centers=3, centers="grid", risk="corrected"),
    }
    for name, policy in policies.items():
        policy.fit(X, U, groups=groups)
        policy.save(folder / f"policy-{name}")
        policy.save(folder / f"policy-{name}-resumable", resumable=True)
        with suppress(UnconstrainError):
            policy.compile().save(folder / f"compiled-{name}")
        uc.moments.save(policy.resume().moments(), folder / f"moments-{name}")
    constraints = {
        "constant": uc.ConstantConstraint(1),
        "feature": uc.FeatureConstraint(),
        "polynomial": uc.FeatureConstraint(PolynomialFeatures(1)),
    }
    for name, constraint in constraints.items():
        constraint.fit(X, U).save(folder / f"constraint-{name}")
    demos = uc.Demonstrations(X, U, groups, time=np.tile(np.arange(10.0), 4))
    for suffix in (".npz", ".parquet"):
        demos.save(folder / f"demonstrations-a{suffix}")
    _recording(folder / "recording")

    class Stopped(Exception):
        pass

    def stop(*args: Any) -> None:
        if (folder / "checkpoint-a").exists():
            raise Stopped

    with suppress(Stopped):
        _go_on(folder / "checkpoint-a", stop)
    if not (folder / "checkpoint-a").exists():
        raise RuntimeError("there is no checkpoint")


def case(rng: np.random.Generator, folder: Path, stock: Path) -> Case:
    """A file of the stock, damaged or rewritten, and read by the loader of its kind or of another."""
    name = pick(rng, sorted(path.name for path in stock.iterdir() if path.is_file()))
    path = folder / name
    content = (stock / name).read_bytes()
    path.write_bytes(content)
    kind = name.partition("-")[0]
    loader = kind if rng.random() < 0.9 else pick(rng, sorted(LOADERS))
    if loader == "checkpoint":
        os.symlink(stock / "recording", folder / "recording")
    way, whole = rng.random(), False
    if way < 0.05:
        done, whole = "whole", True
    elif way < 0.35:
        done = "damaged"
        path.write_bytes(damaged(rng, content))
    elif way < 0.42:
        done = strange_place(rng, path)
    elif zipfile.is_zipfile(path):
        done = _rewritten(rng, path)
    else:
        done = "damaged"
        path.write_bytes(damaged(rng, content))

    def run() -> Any:
        loaded = LOADERS[loader](path)
        _use(loaded)
        return loaded

    def check(loaded: Any) -> None:
        assert not whole or kind == loader or loaded is not None

    def whole_or_refused() -> Any:
        if whole and kind == loader:
            try:
                return run()
            except UnconstrainError as error:
                raise AssertionError(f"a good file was refused: {error}") from error
        return run()

    return Case(
        f"{loader} of {name}, {done}", whole_or_refused, check, {name} if loader == "checkpoint" else set()
    )


def _use(loaded: Any) -> None:
    """Do with what was loaded what it is for. A file that is not what a library wrote may be refused here too."""
    X = np.random.default_rng(1).normal(
        size=(5, getattr(loaded, "n_features_in_", getattr(loaded, "n_states", 2)))
    )
    with np.errstate(all="ignore"):
        if isinstance(loaded, uc.ParametricPolicy | uc.LocallyLinearPolicy):
            _try(lambda: loaded.predict(X))
            _try(lambda: loaded.predict(X, return_std=True))
            _try(lambda: loaded.rollout(X[0], steps=3, dt=0.1))
            _try(lambda: loaded.compile()(X))
            _try(lambda: repr(loaded))
            _try(lambda: loaded.partial_fit(X, loaded.predict(X) + 1))
        elif callable(loaded):
            loaded(X)
            loaded(X[0])
        elif hasattr(loaded, "rows"):
            _try(lambda: loaded.predict(X))
            _try(lambda: loaded.describe(X, [f"u{i}" for i in range(loaded.n_actions_)]))
        elif hasattr(loaded, "solve"):
            _try(lambda: loaded.solve(1e-3))
            _try(lambda: loaded + loaded)
        elif isinstance(loaded, uc.Demonstrations):
            repr(loaded)
            uc.ParametricPolicy(alpha=1.0).fit(loaded)


def _try(call: Callable[[], Any]) -> None:
    """Call what may find the object to be no good, as any object with strange attributes is."""
    with suppress(ValueError, TypeError, ArithmeticError, LookupError, AttributeError, RuntimeWarning):
        call()


def _rewritten(rng: np.random.Generator, path: Path) -> str:
    """Write the archive again with other values in its tree or in its arrays; say which."""
    with zipfile.ZipFile(path) as archive:
        members = {info.filename: archive.read(info) for info in archive.infolist()}
    done = []
    for _ in range(int(rng.integers(1, 3))):
        notes = [name for name in members if name.endswith(".json")]
        if notes and rng.random() < 0.6:
            try:
                note = json.loads(members[notes[0]])
                json.dumps(note)
            except RecursionError:
                continue  # it was nested already
            done.append(_change_tree(rng, note))
            deep = int(pick(rng, (3, 900, 100_000)))
            text = json.dumps(note).replace(f'"{NESTED}"', "[" * deep + "]" * deep)
            members[notes[0]] = text.encode("utf-8", "surrogatepass")
        else:
            name = pick(rng, sorted(n for n in members if n.endswith(".npy")) or [""])
            if not name:
                continue
            try:
                array = np.load(io.BytesIO(members[name]), allow_pickle=False)
            except ValueError:
                continue  # it was replaced by objects already
            if rng.random() < 0.1:
                del members[name]
                done.append(f"without {name}")
                continue
            other = spoiled(rng, array) if array.dtype.kind in "fiub" else pick(rng, TEXTS)
            with io.BytesIO() as file, suppress(TypeError, ValueError, OverflowError):
                np.save(file, np.asarray(other), allow_pickle=True)
                members[name] = file.getvalue()
            done.append(f"{name} = {shown(other)}")
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(zipfile.ZipInfo(name), content)
    return "; ".join(done)


def _change_tree(rng: np.random.Generator, tree: Any) -> str:
    """Change one place in a tree of JSON; say which."""
    places: list[tuple[Any, Any, str]] = []

    def walk(node: Any, at: str) -> None:
        items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
        for key, value in list(items):
            places.append((node, key, f"{at}.{key}"))
            walk(value, f"{at}.{key}")

    walk(tree, "")
    node, key, at = pick(rng, places)
    way = int(rng.integers(6))
    if way == 0:
        del node[key]
        return f"without {at}"
    if way == 1:
        other = pick(rng, places)
        node[key] = json.loads(json.dumps(other[0][other[1]]) if other[0] is not None else "null")
        return f"{at} as {other[2]}"
    if way == 2:
        node[key] = NESTED
        return f"{at} nested deeply"
    values = [v for v in NUMBERS if isinstance(v, bool | int | float | None) and abs(v or 0) < 2**70] + TEXTS
    node[key] = pick(rng, [*values, [], {}, [0], {"array": "none"}, [[]], -3, 10**6])
    return f"{at} = {shown(node[key])}"
