"""Arguments in Python: every public function and estimator, by its signature, with one or two arguments spoiled."""

import inspect
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from sklearn.exceptions import NotFittedError
from sklearn.utils.validation import check_is_fitted

import unconstrain as uc
from tests.fuzz.engine import Case, check_sentence
from tests.fuzz.values import anything, pick, shown, spoiled
from unconstrain import storage
from unconstrain.errors import UnconstrainError

NAMESPACES = ("metrics", "constraints", "features", "moments", "plot")
"""Those of the public namespaces whose functions take arrays and numbers."""
ELSEWHERE = {
    "load",
    "open",
    "save",
    "load_policy",
    "load_compiled",
    "load_constraint",
    "view",
}
"""Functions about files, which other areas call."""
PROTOCOL = {
    "along", "basis", "gradient", "evaluate", "evaluate_rows", "place", "start", "finish", "resume", "observe",
    "posterior",
    "check_options", "get_params", "set_params", "get_metadata_routing", "model", "moments", "potential",
    "get_feature_names_out", "slopes", "compile_descent",
}  # fmt: skip
"""Methods that only other parts of the library call, with arguments that were checked already."""
HOW = {
    "checkpoint",
    "resumable",
    "n_jobs",
    "ax",
    "progress",
    "color",
    "style",
    "label",
    "labels",
    "direct",
    "against_time",
    "posterior",
    "stop_when",
}
"""Arguments that do not say what is computed: where it is drawn, how it looks; and objects that the library made."""
ESTIMATORS = (
    "ParametricPolicy", "LocallyLinearPolicy", "ConstantConstraint", "FeatureConstraint", "NullspaceComponent",
    "ConstraintChain", "NormalizedRBF",
)  # fmt: skip


def functions() -> dict[str, Callable]:
    """Every public function that takes no files, by its name."""
    found = {}
    for space in ("", *NAMESPACES):
        module = getattr(uc, space) if space else uc
        public = getattr(module, "__all__", None) or [
            name
            for name, value in vars(module).items()
            if inspect.isfunction(value) and value.__module__ == module.__name__
        ]
        for name in public:
            value = getattr(module, name)
            if isinstance(value, types.FunctionType) and name not in ELSEWHERE and name[0] != "_":
                found[f"{space}.{name}".lstrip(".")] = value
    return found


class Problem:
    """Samples that go together, and a valid value for each name of an argument.

    Arrays, numbers, texts and paths are spoiled. Objects of the library's own classes are not replaced by others: that
    is what type checkers are for.
    """

    def __init__(self, rng: np.random.Generator, folder: Path) -> None:
        count, n = int(pick(rng, (2, 5, 30, 60))), int(pick(rng, (1, 2, 3, 3)))
        d = n if rng.random() < 0.8 else int(rng.integers(1, 4))
        self.rng, self.folder, self.n, self.d, self.count = rng, folder, n, d, count
        self.X = rng.normal(size=(count, n))
        A = rng.normal(size=(count, 1, d)) * (rng.random((count, 1, 1)) < 0.7) * (d > 1)
        self.Pi = np.tanh(self.X @ rng.normal(size=(n, d))) + 0.1
        self.N = np.eye(d) - np.einsum("nki,nkj->nij", A, A) / np.maximum(
            np.einsum("nki,nki->n", A, A), 1e-300
        ).reshape(-1, 1, 1)
        self.U = np.einsum("nij,nj->ni", self.N, self.Pi)
        self.groups = np.sort(np.arange(count) % max(1, count // 8))
        self.A = A

    def demonstrations(self) -> Any:
        """The samples as demonstrations."""
        return uc.Demonstrations(self.X, self.U, self.groups, projections=self.N)

    def policy(self) -> Any:
        """A fitted policy."""
        return uc.ParametricPolicy(alpha=1e-3).fit(self.X, self.U)

    def constraint(self) -> Any:
        """A fitted constraint."""
        rng = np.random.default_rng(0)
        U = rng.normal(size=(20, self.d)) if self.d > 1 else rng.normal(size=(20, 2))
        return uc.ConstantConstraint(1).fit(rng.normal(size=(20, self.n)), U)

    def figure(self) -> Any:
        """An empty picture."""
        from matplotlib.figure import Figure

        return Figure()

    def value(self, function: str, name: str) -> Any:
        """A valid value of an argument; KeyError where none is known."""
        own = f"{function.rpartition('.')[2]}.{name}"
        of_one = {
            "constraint.learnt": self.constraint, "policy.region": lambda: [self.X.min(0), self.X.max(0)],
            "identifiability.coordinates": lambda: (0, 1), "comparison.other": lambda: lambda X: X,
            "fit_stream.recordings": lambda: [(self.X, self.U, self.groups)], "fit_stream.policy": uc.ParametricPolicy,
            "first_known.projections": lambda: [self.N, self.N],
            "select_policy.candidates": lambda: {"a": uc.ParametricPolicy(), "b": uc.ParametricPolicy(alpha=1.0)},
            "ConstraintChain.policy": uc.ParametricPolicy, "ConstraintChain.constraint": uc.ConstantConstraint,
            "Demonstrations.policy": lambda: self.Pi, "save.moments": lambda: self.policy().resume().moments(),
            "shown_by.policy": self.policy, "fit_stream.batch_rows": lambda: 7,
        }  # fmt: skip
        by_name: dict[str, Callable[[], Any]] = {
            "X": lambda: self.X, "states": lambda: self.X, "x": lambda: self.X[0], "start": lambda: self.X[0],
            "U": lambda: self.U, "y": lambda: self.U, "actions": lambda: self.U, "P": lambda: self.Pi,
            "Pi": lambda: self.Pi, "predictions": lambda: self.Pi, "learnt": lambda: self.N,
            "N": lambda: self.N, "projections": lambda: self.N, "A": lambda: self.A, "normals": lambda: self.A[:, 0],
            "jacobian": lambda: np.broadcast_to(np.eye(self.d), (self.count, self.d, self.d)).copy(),
            "forces": lambda: self.U * 3, "free": lambda: (self.U[:, 0] > 0).astype(float), "threshold": lambda: 0.5,
            "force_threshold": lambda: 0.5, "groups": lambda: self.groups, "episodes": lambda: self.groups,
            "conditions": lambda: self.groups, "sample_weight": lambda: np.linspace(0.1, 1.0, self.count),
            "d": lambda: self.d, "error": lambda: 0.5, "policy": self.policy, "demonstrations": self.demonstrations,
            "movement": self.demonstrations, "demos": self.demonstrations, "coordinates": lambda: (0, self.n - 1),
            "path": lambda: str(self.folder / "out.skops"),
            "parts": lambda: [self.demonstrations()], "low": lambda: self.X.min(0), "high": lambda: self.X.max(0) + 1,
            "time": lambda: np.arange(self.count) * 0.1, "action_names": lambda: [f"u{i}" for i in range(self.d)],
            "state_names": lambda: [f"x{i}" for i in range(self.n)], "steps": lambda: 20, "dt": lambda: 0.1,
            "k": lambda: 3, "which": lambda: 0, "min_speed": lambda: 1e-3, "samples": lambda: np.arange(self.count) > 0,
            "n_centers": lambda: 4, "width": lambda: 1.0, "n_constraints": lambda: 1, "alpha": lambda: 0.1,
            "return_std": lambda: True, "return_cov": lambda: True, "n_jobs": lambda: 1, "without": lambda: 0,
            "constraint": lambda: np.ones((1, self.d)), "random_state": lambda: 1, "figure": self.figure,
            "report": lambda: uc.identifiability(self.policy(), self.X, self.U), "levels": lambda: [0.1, 1.0],
            "worst": lambda: 2, "full_speed": lambda: 1.0,
            "features": lambda: None, "transformer": lambda: None, "component": lambda: None,
        }  # fmt: skip
        return (of_one.get(own) or by_name[name])()

    def arguments(self, function: str, call: Callable, spoil: float) -> dict[str, Any]:
        """Arguments of a call: what is needed and some of the rest, each spoiled with this probability."""
        given = {}
        for parameter in inspect.signature(call).parameters.values():
            if (
                parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)
                or parameter.name == "self"
            ):
                continue
            if parameter.name in HOW:
                continue
            needed = parameter.default is parameter.empty
            if not needed and self.rng.random() < 0.65:
                continue
            try:
                value = self.value(function, parameter.name)
            except KeyError:
                if not needed and self.rng.random() < 0.5:
                    continue
                value = anything(self.rng)
            else:
                if self.rng.random() < spoil:
                    plain = isinstance(value, np.ndarray)
                    if plain:
                        value = spoiled(self.rng, value)
                    elif not (type(value).__module__.startswith("unconstrain") or callable(value)):
                        value = anything(self.rng)
            given[parameter.name] = value
        return given


def stock(folder: Path) -> None:
    """Nothing is prepared."""


def case(rng: np.random.Generator, folder: Path, stock: Path) -> Case:
    """A function or a method, called with arguments of which some are spoiled."""
    import matplotlib

    matplotlib.use("agg")
    problem = Problem(rng, folder)
    way = rng.random()
    if way < 0.4:
        return _function(rng, problem)
    if way < 0.5:
        return _demonstrations(rng, problem)
    return _estimator(rng, problem)


def _function(rng: np.random.Generator, problem: Problem) -> Case:
    known = functions()
    name = pick(rng, sorted(known))
    arguments = problem.arguments(name, known[name], pick(rng, (0.0, 0.3, 0.6)))

    def check(result: Any) -> None:
        # Where a constraint is not known its projection is NaN.
        if not name.startswith("constraints.") and name != "metrics.normalized":
            _check_finite(result, arguments)

    return Case(_said(name, arguments), lambda: known[name](**arguments), check, _written([arguments]))


def _demonstrations(rng: np.random.Generator, problem: Problem) -> Case:
    arguments = problem.arguments("Demonstrations", uc.Demonstrations, pick(rng, (0.0, 0.3)))
    method = pick(rng, ("blocks", "episode", "folds", "moving", "select", "concatenate"))
    call = getattr(uc.Demonstrations, method)
    more = problem.arguments(f"Demonstrations.{method}", call, 0.5) if method != "concatenate" else {}

    def run() -> Any:
        demos = uc.Demonstrations(**arguments)
        repr(demos)
        if method == "concatenate":
            return uc.Demonstrations.concatenate([demos, problem.demonstrations()])
        return getattr(demos, method)(**more)

    return Case(f"{_said('Demonstrations', arguments)}.{_said(method, more)}", run)


def _estimator(rng: np.random.Generator, problem: Problem) -> Case:
    """An estimator that is made, perhaps fitted well, and then called up to three times."""
    name = pick(rng, ESTIMATORS)
    kind = getattr(uc, name)
    options = problem.arguments(name, kind, pick(rng, (0.0, 0.0, 0.5)))
    estimator = kind(**options)
    well = rng.random() < 0.6
    public = [
        m
        for m in dir(kind)
        if m[0] != "_"
        and (m, name) != ("compile", "NormalizedRBF")
        and m not in PROTOCOL
        and not m.startswith("set_")
        and inspect.isfunction(getattr(kind, m))
    ]
    calls = []
    for _ in range(int(rng.integers(1, 4))):
        method = pick(rng, ["fit", "fit", *public])
        calls.append(
            (method, problem.arguments(f"{name}.{method}", getattr(kind, method), pick(rng, (0.0, 0.3, 0.6))))
        )
    text = _said(name, options) + (".fit(X, U)" if well else "")
    text += "".join(f"\n    .{_said(method, given)}" for method, given in calls)

    def run() -> Any:
        if well:
            estimator.fit(problem.X) if name == "NormalizedRBF" else estimator.fit(problem.X, problem.U)
        for method, given in calls:
            before = _state(estimator)
            try:
                result = getattr(estimator, method)(**given)
            except (UnconstrainError, NotFittedError) as error:
                assert _state(estimator) == before, f"{method} raised, and the {name} is another than before"
                check_sentence(str(error))
                continue
            if method in ("fit", "partial_fit"):
                check_is_fitted(estimator)
                if hasattr(estimator, "predict") and name != "ConstraintChain" and "X" in given:
                    X = given["X"]
                    _check_finite(estimator.predict(X.states if isinstance(X, uc.Demonstrations) else X), {})
            elif method == "save":
                loader = uc.load_policy if "Policy" in name else uc.load_constraint
                assert type(loader(given["path"])) is kind
            elif method == "compile":
                _check_finite(result(problem.X), {})
            elif method != "rollout":
                _check_finite(result, given)
        return None

    return Case(text, run, writes=_written([given for _, given in calls]))


def _said(name: str, arguments: dict[str, Any]) -> str:
    return f"{name}({', '.join(f'{key}={shown(value)}' for key, value in arguments.items())})"


def _written(calls: list[dict[str, Any]]) -> set[str]:
    """The files that calls are told to write."""
    return {Path(str(given["path"])).name for given in calls if isinstance(given.get("path"), str | Path)}


def _state(value: Any) -> Any:
    """All that an object is, as something to be compared."""
    try:
        tree, arrays = storage.encode({k: v for k, v in vars(value).items() if k.endswith("_")})
    except UnconstrainError:
        return None
    return tree, {name: (array.shape, array.tobytes()) for name, array in arrays.items()}


def _check_finite(result: Any, arguments: dict[str, Any]) -> None:
    """Of finite numbers come finite numbers."""
    for value in arguments.values():
        try:
            array = np.asarray(value)
            if array.dtype.kind not in "biufUSOMm" or not np.isfinite(array.astype(float)).all():
                return
        except (TypeError, ValueError, OverflowError):
            continue
    for part in result if isinstance(result, tuple | list) else (result,):
        if isinstance(part, np.ndarray | float) and np.asarray(part).dtype.kind == "f":
            assert np.isfinite(part).all(), f"of finite numbers came {np.asarray(part).ravel()[:6]}"
