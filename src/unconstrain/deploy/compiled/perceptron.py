"""Networks of smooth units beside a linear term, and means of several: `π(x) = mean_e [L_e z + W_e h_e(z) + b_e]`."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from unconstrain.deploy.compiled.base import CompiledPolicy
from unconstrain.errors import PolicyError

if TYPE_CHECKING:
    from unconstrain.deploy.onnx import Graph


class Perceptron(CompiledPolicy):
    """The mean of E networks, `L z + W_K h_{K-1} + b_K` with `h_k = a(W_k h_{k-1} + b_k)` and `h_0 = z`.

    There are K layers, `a(s) = s / (1 + exp(-s))`, and `z = (x - center) / spread`.

    Parameters
    ----------
    weights : array_like of shape (E, P)
        Of each network `W_1, b_1, ..., W_K, b_K, L`, each row by row.
    sizes : array_like of shape (K + 1,)
        Numbers of states, of units in each hidden layer, and of actions.
    center, spread : array_like of shape (n,)
        By which states are standardised.
    """

    __slots__ = ()
    kind = "network"
    layout: ClassVar = {"weights": 2, "sizes": 1, "center": 1, "spread": 1}

    def __init__(self, weights: ArrayLike, sizes: ArrayLike, center: ArrayLike, spread: ArrayLike) -> None:
        super().__init__(weights=weights, sizes=sizes, center=center, spread=spread)

    @classmethod
    def of(
        cls, members: Sequence[Mapping[str, ndarray]], center: ArrayLike, spread: ArrayLike, unit: float
    ) -> Self:
        """Compile networks from their parameters.

        Parameters
        ----------
        members : sequence of mapping of str to ndarray
            Of each network, by the names that PyTorch has for them: ``layers.0.weight``, ..., ``straight.weight``.
        center, spread : array_like of shape (n,)
            By which states are standardised.
        unit : float
            What their actions are multiplied by.

        Returns
        -------
        Perceptron
            Of all of them.
        """
        rows = []
        for own in members:
            last = sum(name.startswith("layers.") and name.endswith(".weight") for name in own) - 1
            names = [f"layers.{k}.{part}" for k in range(last + 1) for part in ("weight", "bias")]
            outer = {f"layers.{last}.weight", f"layers.{last}.bias", "straight.weight"}
            rows.append(
                [
                    own[name].astype(np.float64).ravel() * (unit if name in outer else 1.0)
                    for name in (*names, "straight.weight")
                ]
            )
            sizes = [
                own["layers.0.weight"].shape[1],
                *(own[f"layers.{k}.weight"].shape[0] for k in range(last + 1)),
            ]
        return cls(np.stack([np.concatenate(row) for row in rows]), sizes, center, spread)

    def __call__(self, x: ArrayLike, out: ndarray | None = None) -> ndarray:
        """Act; see `CompiledPolicy`."""
        if type(x) is not ndarray or x.shape != self._shape:
            return self._otherwise(x, out)
        center, spread, inner, outer, offset, straight, _ = self._parts
        z, *buffers = self._scratch.buffers
        np.subtract(x, center, z)
        z /= spread
        h = z
        for (W, b), (a, half) in zip(inner, buffers, strict=True):
            np.matmul(W, h[..., None], a[..., None])
            a += b
            _smooth(a, half)
            h = a
        try:
            out = outer.dot(h.reshape(-1), out)
            out += straight.dot(z)
            out += offset
        except (ValueError, TypeError) as error:
            raise self._bad_out(out) from error
        return out

    def magnitude(self, X: ndarray) -> float:
        """Return the largest term that is added up; see `CompiledPolicy`."""
        center, spread, inner, outer, offset, straight, _ = self._parts
        z = (np.abs(X) + np.abs(center)) / spread
        h = z[None]
        for W, b in inner:
            h = h @ np.abs(W).swapaxes(1, 2) + np.abs(b)[:, None]
        layers = h.swapaxes(0, 1).reshape(len(X), -1) @ np.abs(outer).T
        return float((layers + z @ np.abs(straight).T + np.abs(offset)).max())

    def draw(self, graph: "Graph") -> None:
        """Draw the policy as an ONNX graph, the networks side by side.

        Parameters
        ----------
        graph : Graph
            Its input is "x" and its output "u".
        """
        from scipy.linalg import block_diag

        center, spread, inner, outer, offset, straight, _ = self._parts
        z = graph.node("Sub", "x", graph.constant("center", center), output="away")
        z = graph.node("Div", z, graph.constant("spread", spread), output="z")
        h, half = z, graph.constant("half", np.array(0.5))
        for k, (W, b) in enumerate(inner):
            together = W.reshape(-1, W.shape[2]) if k == 0 else block_diag(*W)
            a = graph.affine(h, together, b.ravel(), f"layer_{k}")
            halved = graph.node("Mul", a, half, output=f"half_{k}")
            bent = graph.node("Tanh", halved, output=f"tanh_{k}")
            h = graph.node(
                "Add", halved, graph.node("Mul", halved, bent, output=f"bent_{k}"), output=f"smooth_{k}"
            )
        layers = graph.affine(h, outer, offset, "layers")
        graph.node("Add", layers, graph.affine(z, straight, np.zeros_like(offset), "straight"), output="u")

    def _dimensions(self, arrays: dict[str, ndarray]) -> tuple[int, int]:
        sizes, n_weights = arrays["sizes"], arrays["weights"].shape
        whole = len(sizes) >= 3 and bool(((sizes >= 1) & (sizes == np.floor(sizes)) & (sizes < 2**24)).all())
        if not whole or n_weights != (max(n_weights[0], 1), _count([int(size) for size in sizes])):
            raise PolicyError("the weights of a compiled network must be as many as its layers have")
        n, d = int(sizes[0]), int(sizes[-1])
        if (
            arrays["center"].shape != (n,)
            or arrays["spread"].shape != (n,)
            or not (arrays["spread"] > 0).all()
        ):
            raise PolicyError(
                f"center and spread of a compiled network must have {n} numbers, spread above zero"
            )
        return n, d

    def _prepare(self, arrays: dict[str, ndarray]) -> tuple[Any, ...]:
        sizes = [int(size) for size in arrays["sizes"]]
        weights, E = arrays["weights"], len(arrays["weights"])
        layers, start = [], 0
        for n, m in pairwise(sizes):
            slopes = weights[:, start : start + n * m].reshape(E, m, n)
            start += n * m
            layers.append((slopes, weights[:, start : start + m]))
            start += m
        straight = weights[:, start:].reshape(E, sizes[-1], sizes[0]).mean(axis=0)
        *inner, (W, b) = layers
        outer = np.ascontiguousarray(W.swapaxes(0, 1).reshape(sizes[-1], -1)) / E
        return arrays["center"], arrays["spread"], inner, outer, b.mean(axis=0), straight, sizes

    def _buffers(self) -> tuple[Any, ...]:
        sizes, E = self._parts[-1], len(self.arrays["weights"])
        return np.empty(sizes[0]), *((np.empty((E, size)), np.empty((E, size))) for size in sizes[1:-1])

    def _many(self, X: ndarray) -> ndarray:
        center, spread, inner, outer, offset, straight, _ = self._parts
        z = (X - center) / spread
        h = z[None]
        for W, b in inner:
            a = h @ W.swapaxes(1, 2) + b[:, None]
            h = _smooth(a, np.empty_like(a))
        h = np.broadcast_to(h, (len(self.arrays["weights"]), *h.shape[1:]))
        return h.swapaxes(0, 1).reshape(len(X), -1) @ outer.T + z @ straight.T + offset

    def _typical_states(self, rng: np.random.Generator, count: int) -> ndarray:
        return self.arrays["center"] + self.arrays["spread"] * rng.standard_normal((count, self.n_states))


def _smooth(a: ndarray, half: ndarray) -> ndarray:
    """Replace s by `s / (1 + exp(-s)) = s/2 (1 + tanh(s/2))`, in place."""
    np.multiply(a, 0.5, half)
    np.tanh(half, a)
    a += 1.0
    a *= half
    return a


def _count(sizes: list[int]) -> int:
    layers = sum(a * b + b for a, b in pairwise(sizes))
    return layers + sizes[0] * sizes[-1]
