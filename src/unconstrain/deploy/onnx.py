"""Policies as ONNX models, for controllers and languages that have an ONNX runtime and no Python.

One input "x" (batch, n) and one output "u" (batch, d), both float64, with any number of states in a batch. The graph
is built from a compiled policy's arrays:

| kind   | graph                                    |
| ------ | ---------------------------------------- |
| linear | x Wᵀ + t                                 |
| rbf    | Softmax(e) Wᵀ                            |
| local  | Σ_m Softmax(e)_m (B_m x + t_m)           |

with the exponents `e_i = (c_i - m)ᵀ(x - m) / σ² - ‖c_i - m‖² / 2σ²`, m the centres' mean: what is left of
`-‖x - c_i‖² / 2σ²` without the part that all centres share, which `Softmax` would take out anyway. That is one
product, and nothing overflows far from all centres.
"""

from importlib.metadata import version
from pathlib import Path

import numpy as np

from unconstrain import atomic
from unconstrain.deploy.compiled import CompiledPolicy, Linear, LocallyLinear, RadialBasis
from unconstrain.errors import PolicyError

# Old enough for the runtimes on robots, new enough for everything the graphs need.
OPSET = 17
IR_VERSION = 8


def save(step: CompiledPolicy, path: str | Path) -> None:
    """Write the compiled policy to `path` as an ONNX model.

    Raises `PolicyError` without the package onnx, and for kinds other than linear, rbf and local.
    """
    if not isinstance(step, Linear | RadialBasis | LocallyLinear):
        raise PolicyError(
            "linear, NormalizedRBF and locally linear policies can be written as ONNX, "
            f"this one is {step.kind}: use compile().save(path) instead"
        )
    try:
        from onnx import checker
    except ImportError:
        raise PolicyError(
            "writing ONNX needs the package onnx, which is not installed: pip install 'unconstrain[onnx]'"
        ) from None
    model = _model(step)
    checker.check_model(model, full_check=True)
    with atomic.replacing(path) as temporary:
        temporary.write_bytes(model.SerializeToString())


def _model(step: CompiledPolicy):
    from onnx import TensorProto, helper, numpy_helper

    a, n, d = step.arrays, step.n_states, step.n_actions
    nodes, constants = [], []

    def constant(name: str, value) -> str:
        constants.append(numpy_helper.from_array(np.ascontiguousarray(value), name))
        return name

    def node(operator: str, *inputs: str, output: str, **attributes) -> str:
        nodes.append(helper.make_node(operator, list(inputs), [output], name=output, **attributes))
        return output

    def affine(inputs: str, slopes, offsets, output: str) -> str:
        return node(
            "Gemm", inputs, constant(f"{output}_slopes", slopes), constant(f"{output}_offsets", offsets), output=output,
            transB=1,
        )  # fmt: skip

    def blend() -> str:
        mean = a["centers"].mean(axis=0)
        centers = (a["centers"] - mean) / a["width"]
        away = node("Sub", "x", constant("mean", mean), output="away")
        exponents = affine(away, centers / a["width"], -0.5 * np.sum(centers**2, axis=1), "exponents")
        return node("Softmax", exponents, output="activations", axis=1)

    if isinstance(step, Linear):
        affine("x", a["coef"], a["intercept"], "u")
    elif isinstance(step, RadialBasis):
        node("MatMul", blend(), constant("weights", a["weights"].T), output="u")
    else:
        M = len(a["centers"])
        flat = affine("x", a["coef"].reshape(M * d, n), a["intercept"].reshape(-1), "flat")
        local = node("Reshape", flat, constant("models", np.array([-1, M, d])), output="local")
        row = constant("row", np.array([1]))
        blended = node("MatMul", node("Unsqueeze", blend(), row, output="rows"), local, output="blended")
        node("Squeeze", blended, row, output="u")

    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info("x", TensorProto.DOUBLE, ["batch", n])],
        [helper.make_tensor_value_info("u", TensorProto.DOUBLE, ["batch", d])],
        constants,
    )
    return helper.make_model(
        graph,
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
        producer_name="unconstrain",
        producer_version=version("unconstrain"),
    )
