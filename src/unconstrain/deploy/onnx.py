"""Policies as ONNX models, for controllers and languages that have an ONNX runtime and no Python.

A model has one input "x" (batch, n) and one output "u" (batch, d), both float64, with any number of states in a batch.
Each kind of compiled policy that can be written so has a method `draw`, which builds its graph:

| kind   | graph                                    |
| ------ | ---------------------------------------- |
| linear | x Wᵀ + t                                 |
| rbf    | Softmax(e) Wᵀ                            |
| local  | Σ_m Softmax(e)_m (B_m x + t_m)           |
| network| Gemm and Tanh, layer by layer            |

The exponents are `e_i = (c_i - m)ᵀ(x - m) / σ² - ‖c_i - m‖² / 2σ²`, m the centres' mean: what is left of
`-‖x - c_i‖² / 2σ²` without the part that all centres share, which `Softmax` would take out anyway. That is one
product, and nothing overflows far from all centres.
"""

from os import PathLike
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from unconstrain import atomic
from unconstrain.deploy.compiled import CompiledPolicy
from unconstrain.errors import PolicyError
from unconstrain.version import __version__

if TYPE_CHECKING:
    from onnx import ModelProto

# Old enough for the runtimes on robots, new enough for everything the graphs need.
OPSET = 17
IR_VERSION = 8


@runtime_checkable
class Drawable(Protocol):
    """A compiled policy that can be written as an ONNX model."""

    def draw(self, graph: "Graph") -> None:
        """Build the graph that leads from "x" to "u".

        Parameters
        ----------
        graph : Graph
            An empty one.
        """
        ...


class Graph:
    """An ONNX graph that is being built. Everything in it has a name, and goes by it."""

    def __init__(self) -> None:
        self._nodes: list[Any] = []
        self._constants: list[Any] = []

    def constant(self, name: str, value: ArrayLike) -> str:
        """Add an array.

        Parameters
        ----------
        name : str
        value : array_like

        Returns
        -------
        str
            The name.
        """
        from onnx import numpy_helper

        self._constants.append(numpy_helper.from_array(np.ascontiguousarray(value), name))
        return name

    def node(self, operator: str, *inputs: str, output: str, **attributes: Any) -> str:
        """Add an operation.

        Parameters
        ----------
        operator : str
            One of ONNX's.
        *inputs : str
        output : str
            The name of its result.
        **attributes : int
            Of the operator.

        Returns
        -------
        str
            The name of its result.
        """
        from onnx import helper

        self._nodes.append(helper.make_node(operator, list(inputs), [output], name=output, **attributes))
        return output

    def affine(self, inputs: str, slopes: ArrayLike, offsets: ArrayLike, output: str) -> str:
        """Add a linear function.

        Parameters
        ----------
        inputs : str
            Name of an array (batch, n).
        slopes : array_like of shape (k, n)
        offsets : array_like of shape (k,)
        output : str
            Name of the result (batch, k).

        Returns
        -------
        str
            The name of the result.
        """
        parts = self.constant(f"{output}_slopes", slopes), self.constant(f"{output}_offsets", offsets)
        return self.node("Gemm", inputs, *parts, output=output, transB=1)

    def blend(self, centers: np.ndarray, width: np.ndarray) -> str:
        """Add the normalised activations of centres at "x".

        Parameters
        ----------
        centers : ndarray of shape (M, n)
        width : ndarray of shape (n,)

        Returns
        -------
        str
            The name of an array (batch, M).
        """
        mean = centers.mean(axis=0)
        away = self.node("Sub", "x", self.constant("mean", mean), output="away")
        scaled = (centers - mean) / width
        exponents = self.affine(away, scaled / width, -0.5 * np.sum(scaled**2, axis=1), "exponents")
        return self.node("Softmax", exponents, output="activations", axis=1)

    def model(self, n: int, d: int) -> "ModelProto":
        """Finish the graph.

        Parameters
        ----------
        n, d : int
            Dimensions of "x" and "u".

        Returns
        -------
        ModelProto
        """
        from onnx import TensorProto, helper

        graph = helper.make_graph(
            self._nodes,
            "policy",
            [helper.make_tensor_value_info("x", TensorProto.DOUBLE, ["batch", n])],
            [helper.make_tensor_value_info("u", TensorProto.DOUBLE, ["batch", d])],
            self._constants,
        )
        return helper.make_model(
            graph,
            opset_imports=[helper.make_opsetid("", OPSET)],
            ir_version=IR_VERSION,
            producer_name="unconstrain",
            producer_version=__version__,
        )


def save(step: CompiledPolicy, path: str | PathLike[str]) -> None:
    """Write a compiled policy as an ONNX model.

    Parameters
    ----------
    step : CompiledPolicy
    path : path
        An existing file is replaced.

    Raises
    ------
    PolicyError
        The package onnx is not installed, or policies of this kind cannot be written so.
    UnconstrainError
        The place cannot be written to.
    """
    if not isinstance(step, Drawable):
        raise PolicyError(
            "linear, NormalizedRBF and locally linear policies and networks can be written as ONNX, "
            f"this one is {step.kind}: use compile().save(path) instead"
        )
    try:
        from onnx import checker
    except ImportError:
        raise PolicyError(
            "writing ONNX needs the package onnx, which is not installed: pip install 'unconstrain[onnx]'"
        ) from None
    graph = Graph()
    step.draw(graph)
    model = graph.model(step.n_states, step.n_actions)
    checker.check_model(model, full_check=True)
    with atomic.replacing(path) as temporary:
        temporary.write_bytes(model.SerializeToString())
