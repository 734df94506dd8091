"""The linear policy, `π(x) = W x + t`."""

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy import add, ndarray
from numpy.typing import ArrayLike

from unconstrain.deploy.compiled.base import CompiledPolicy, check_shapes

if TYPE_CHECKING:
    from unconstrain.deploy.onnx import Graph


class Linear(CompiledPolicy):
    """`W x + t`.

    Parameters
    ----------
    coef : array_like of shape (d, n)
        W.
    intercept : array_like of shape (d,)
        t.
    """

    __slots__ = ()
    kind = "linear"
    layout: ClassVar = {"coef": 2, "intercept": 1}

    def __init__(self, coef: ArrayLike, intercept: ArrayLike) -> None:
        super().__init__(coef=coef, intercept=intercept)

    def __call__(self, x: ArrayLike, out: ndarray | None = None) -> ndarray:
        """Act; see `CompiledPolicy`."""
        if type(x) is not ndarray or x.shape != self._shape:
            return self._otherwise(x, out)
        coef, intercept = self._parts
        try:
            out = coef.dot(x, out)
            return add(out, intercept, out)
        except (ValueError, TypeError) as error:
            raise self._bad_out(out) from error

    def magnitude(self, X: ndarray) -> float:
        """Return the largest term that is added up; see `CompiledPolicy`."""
        return float((np.abs(X) @ np.abs(self.arrays["coef"]).T + np.abs(self.arrays["intercept"])).max())

    def draw(self, graph: "Graph") -> None:
        """Draw the policy as an ONNX graph, `x Wᵀ + t`.

        Parameters
        ----------
        graph : Graph
            Its input is "x" and its output "u".
        """
        graph.affine("x", self.arrays["coef"], self.arrays["intercept"], "u")

    def _dimensions(self, arrays: dict[str, ndarray]) -> tuple[int, int]:
        d, n = arrays["coef"].shape
        check_shapes(arrays, intercept=(d,))
        return n, d

    def _prepare(self, arrays: dict[str, ndarray]) -> tuple[Any, ...]:
        return arrays["coef"], arrays["intercept"]

    def _many(self, X: ndarray) -> ndarray:
        return X @ self.arrays["coef"].T + self.arrays["intercept"]
