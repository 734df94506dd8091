"""Policies that blend over centres: radial basis functions, local linear models, and potentials.

Each has one row of numbers for every centre. The rows are added up with the activations as weights, and the last of
each row is a one, so that a single product gives all sums and their norm.
"""

from abc import abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy import add, divide, empty, exp, multiply, ndarray, subtract
from numpy.typing import ArrayLike

from unconstrain import loops
from unconstrain.deploy.compiled.base import CompiledPolicy, check_shapes
from unconstrain.errors import PolicyError
from unconstrain.receptive import normalized_activations

if TYPE_CHECKING:
    from unconstrain.deploy.onnx import Graph

# Where the activations' sum is less than this, their own precision (they are subnormal, or zero) is in doubt.
UNDERFLOW = 1e-200


class Centered(CompiledPolicy):
    """What blends over centres."""

    __slots__ = ()

    def _in_one_call(self, x: ndarray, out: ndarray | None) -> ndarray | None:
        """Act by the compiled loop; None where there is none, or it cannot."""
        columns, scale, rows, loop = self._parts[:4]
        if loop is None or (out is not None and out.shape != (self.n_actions,)):
            return None
        buffers = self._scratch.buffers
        written = empty(self.n_actions) if out is None else out
        try:
            return written if loop(columns, scale, rows, x, buffers[2], buffers[1], written) else None
        except TypeError:  # numbers of another kind than it was compiled for
            return None if x.dtype == np.float64 else self(x.astype(np.float64), out)

    def _sums(self, x: ndarray) -> tuple[Any, ...]:
        """Return the buffers, with `Σ_i K_i rows_i` in the second, times a factor that all sums share."""
        columns, scale, rows = self._parts[:3]
        buffers = self._scratch.buffers
        differences, sums, activations = buffers[:3]
        subtract(columns, x[:, None], differences)
        multiply(differences, differences, differences)
        scale.dot(differences, activations)
        exp(activations, activations)
        activations.dot(rows, sums)
        if not sums[-1] > UNDERFLOW:
            activations[:] = normalized_activations(x[None], self.arrays["centers"], self.arrays["width"])[0]
            activations.dot(rows, sums)
        return buffers

    def _dimensions(self, arrays: dict[str, ndarray]) -> tuple[int, int]:
        M, n = arrays["centers"].shape
        widths = arrays["width"]
        check_shapes(arrays, width=(n,))
        if not M or not (widths > 0).all():
            raise PolicyError("a compiled policy needs at least one centre, and widths above zero")
        for width in widths.tolist():
            if not 1e-150 < width < 1e150:
                raise PolicyError(f"a width of {width:.3g} cannot be squared: state it in another unit")
        return n, self._outputs(arrays, M, n)

    @abstractmethod
    def _outputs(self, arrays: dict[str, ndarray], M: int, n: int) -> int:
        """Check the arrays that are not the centres, and return d."""

    def _prepare(self, arrays: dict[str, ndarray]) -> tuple[Any, ...]:
        rows = self._rows(arrays)
        rows = np.column_stack([rows, np.ones(len(rows))])
        scale = -0.5 / arrays["width"] ** 2
        return np.ascontiguousarray(arrays["centers"].T), scale, np.ascontiguousarray(rows), self._loop()

    def _loop(self) -> Callable[..., bool] | None:
        """Return the step as one compiled call, where there is one."""
        return None

    @abstractmethod
    def _rows(self, arrays: dict[str, ndarray]) -> ndarray:
        """Lay out the numbers (M, k) that are blended."""

    def _buffers(self) -> tuple[ndarray, ...]:
        columns, _, rows = self._parts[:3]
        return np.empty_like(columns), np.empty(rows.shape[1]), np.empty(len(rows))

    def _blend(self, X: ndarray) -> ndarray:
        return normalized_activations(X, self.arrays["centers"], self.arrays["width"])

    def _typical_states(self, rng: np.random.Generator, count: int) -> ndarray:
        centers, width = self.arrays["centers"], self.arrays["width"]
        X = rng.standard_normal((count, self.n_states))
        return centers[rng.integers(len(centers), size=count)] + width * X


class RadialBasis(Centered):
    """`W b(x)`.

    Parameters
    ----------
    centers : array_like of shape (M, n)
        c_i.
    width : float or array_like of shape (n,)
        σ along each dimension, in its unit.
    weights : array_like of shape (d, M)
        W.
    """

    __slots__ = ()
    kind = "rbf"
    layout: ClassVar = {"centers": 2, "width": 1, "weights": 2}

    def __init__(self, centers: ArrayLike, width: ArrayLike, weights: ArrayLike) -> None:
        super().__init__(centers=centers, width=_widths(width, centers), weights=weights)

    def __call__(self, x: ArrayLike, out: ndarray | None = None) -> ndarray:
        """Act; see `CompiledPolicy`."""
        if type(x) is not ndarray or x.shape != self._shape:
            return self._otherwise(x, out)
        done = self._in_one_call(x, out)
        if done is not None:
            return done
        _, sums, _, actions = self._sums(x)
        try:
            return divide(actions, sums[-1], out)
        except (ValueError, TypeError) as error:
            raise self._bad_out(out) from error

    def magnitude(self, X: ndarray) -> float:
        """Return the largest term that is added up; see `CompiledPolicy`."""
        return float(np.abs(self.arrays["weights"]).max())

    def draw(self, graph: "Graph") -> None:
        """Draw the policy as an ONNX graph, `Softmax(e) Wᵀ`.

        Parameters
        ----------
        graph : Graph
            Its input is "x" and its output "u".
        """
        blend = graph.blend(self.arrays["centers"], self.arrays["width"])
        graph.node("MatMul", blend, graph.constant("weights", self.arrays["weights"].T), output="u")

    def _outputs(self, arrays: dict[str, ndarray], M: int, n: int) -> int:
        d = len(arrays["weights"])
        check_shapes(arrays, weights=(d, M))
        return d

    def _rows(self, arrays: dict[str, ndarray]) -> ndarray:
        return arrays["weights"].T

    def _loop(self) -> Callable[..., bool] | None:
        compiled = loops.load("blend")
        return None if compiled is None else compiled.radial

    def _buffers(self) -> tuple[ndarray, ...]:
        differences, sums, activations = super()._buffers()
        return differences, sums, activations, sums[:-1]

    def _many(self, X: ndarray) -> ndarray:
        return self._blend(X) @ self.arrays["weights"].T


class LocallyLinear(Centered):
    """`Σ_m b_m(x) (B_m x + t_m)`: the models are blended first, then applied once.

    Parameters
    ----------
    centers : array_like of shape (M, n)
        c_i.
    width : float or array_like of shape (n,)
        σ along each dimension, in its unit.
    coef : array_like of shape (M, d, n)
        B_m.
    intercept : array_like of shape (M, d)
        t_m.
    """

    __slots__ = ()
    kind = "local"
    layout: ClassVar = {"centers": 2, "width": 1, "coef": 3, "intercept": 2}

    def __init__(self, centers: ArrayLike, width: ArrayLike, coef: ArrayLike, intercept: ArrayLike) -> None:
        super().__init__(centers=centers, width=_widths(width, centers), coef=coef, intercept=intercept)

    def __call__(self, x: ArrayLike, out: ndarray | None = None) -> ndarray:
        """Act; see `CompiledPolicy`."""
        if type(x) is not ndarray or x.shape != self._shape:
            return self._otherwise(x, out)
        done = self._in_one_call(x, out)
        if done is not None:
            return done
        _, sums, _, coef, intercept = self._sums(x)
        try:
            out = coef.dot(x, out)
            add(out, intercept, out)
            return divide(out, sums[-1], out)
        except (ValueError, TypeError) as error:
            raise self._bad_out(out) from error

    def magnitude(self, X: ndarray) -> float:
        """Return the largest term that is added up; see `CompiledPolicy`."""
        coef, intercept = self.arrays["coef"], self.arrays["intercept"]
        return float((np.abs(X) @ np.abs(coef).max(axis=0).T + np.abs(intercept).max(axis=0)).max())

    def draw(self, graph: "Graph") -> None:
        """Draw the policy as an ONNX graph, `Σ_m Softmax(e)_m (B_m x + t_m)`.

        Parameters
        ----------
        graph : Graph
            Its input is "x" and its output "u".
        """
        coef, intercept = self.arrays["coef"], self.arrays["intercept"]
        M, d, n = coef.shape
        flat = graph.affine("x", coef.reshape(M * d, n), intercept.reshape(-1), "flat")
        local = graph.node("Reshape", flat, graph.constant("models", np.array([-1, M, d])), output="local")
        row = graph.constant("row", np.array([1]))
        blend = graph.blend(self.arrays["centers"], self.arrays["width"])
        blended = graph.node(
            "MatMul", graph.node("Unsqueeze", blend, row, output="rows"), local, output="blended"
        )
        graph.node("Squeeze", blended, row, output="u")

    def _outputs(self, arrays: dict[str, ndarray], M: int, n: int) -> int:
        d = arrays["intercept"].shape[1]
        check_shapes(arrays, coef=(M, d, n), intercept=(M, d))
        return d

    def _rows(self, arrays: dict[str, ndarray]) -> ndarray:
        return np.column_stack([arrays["coef"].reshape(len(arrays["coef"]), -1), arrays["intercept"]])

    def _loop(self) -> Callable[..., bool] | None:
        compiled = loops.load("blend")
        return None if compiled is None else compiled.local

    def _buffers(self) -> tuple[ndarray, ...]:
        differences, sums, activations = super()._buffers()
        d, n = self.n_actions, self.n_states
        return differences, sums, activations, sums[: d * n].reshape(d, n), sums[d * n : -1]

    def _many(self, X: ndarray) -> ndarray:
        coef, intercept = self.arrays["coef"], self.arrays["intercept"]
        local = (X @ coef.reshape(-1, self.n_states).T).reshape(len(X), *intercept.shape) + intercept
        return np.einsum("nm,nmd->nd", self._blend(X), local)


class Potential(Centered):
    """`-∇ wᵀb(x) = (Σ w_i b_i · Σ b_i c_i - Σ w_i b_i c_i) / σ²`, with centres counted from their mean.

    Parameters
    ----------
    centers : array_like of shape (M, n)
        c_i.
    width : float or array_like of shape (n,)
        σ along each dimension, in its unit.
    weights : array_like of shape (M,)
        w.
    """

    __slots__ = ()
    kind = "potential"
    layout: ClassVar = {"centers": 2, "width": 1, "weights": 1}

    def __init__(self, centers: ArrayLike, width: ArrayLike, weights: ArrayLike) -> None:
        super().__init__(centers=centers, width=_widths(width, centers), weights=weights)

    def __call__(self, x: ArrayLike, out: ndarray | None = None) -> ndarray:
        """Act; see `CompiledPolicy`."""
        if type(x) is not ndarray or x.shape != self._shape:
            return self._otherwise(x, out)
        _, sums, _, pulls, centre = self._sums(x)
        total, rate = sums[-1], self._parts[4]
        try:
            out = multiply(centre, sums[-2] / total, out)
            subtract(out, pulls, out)
            multiply(out, rate, out)
            return divide(out, total, out)
        except (ValueError, TypeError) as error:
            raise self._bad_out(out) from error

    def magnitude(self, X: ndarray) -> float:
        """Return the largest term that is added up; see `CompiledPolicy`."""
        away = self.arrays["centers"] - self.arrays["centers"].mean(axis=0)
        return float(np.abs(self.arrays["weights"]).max() * np.abs(away / self.arrays["width"] ** 2).max())

    def _outputs(self, arrays: dict[str, ndarray], M: int, n: int) -> int:
        check_shapes(arrays, weights=(M,))
        return n

    def _prepare(self, arrays: dict[str, ndarray]) -> tuple[Any, ...]:
        return (*super()._prepare(arrays), 1.0 / arrays["width"] ** 2)

    def _rows(self, arrays: dict[str, ndarray]) -> ndarray:
        away, weights = arrays["centers"] - arrays["centers"].mean(axis=0), arrays["weights"][:, None]
        return np.column_stack([weights * away, away, weights])

    def _buffers(self) -> tuple[ndarray, ...]:
        differences, sums, activations = super()._buffers()
        n = self.n_states
        return differences, sums, activations, sums[:n], sums[n : 2 * n]

    def _many(self, X: ndarray) -> ndarray:
        sums = self._blend(X) @ self._parts[2]
        n = self.n_states
        return (sums[:, -2, None] * sums[:, n : 2 * n] - sums[:, :n]) * self._parts[4]


def _widths(width: ArrayLike, centers: ArrayLike) -> ArrayLike:
    """Give each dimension the one width of all, where it is one."""
    return np.full(np.shape(centers)[-1:], width) if np.ndim(width) == 0 else width
