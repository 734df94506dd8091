"""Policies as ONNX models, for controllers and languages that have an ONNX runtime and no Python.

One input "x" (batch, n) and one output "u" (batch, d), both float64, with any number of states in a batch. The graph
is built from a compiled policy's arrays:

| kind   | graph                                                            |
| ------ | ---------------------------------------------------------------- |
| linear | x Wᵀ + t                                                         |
| rbf    | Softmax(-‖x - c_i‖² / 2σ²) Wᵀ                                    |
| local  | Σ_m Softmax(-‖x - c_m‖² / 2σ²)_m (B_m x + t_m)                   |

`Softmax` takes the largest exponent out first, so the model is finite far from all centres as well.
"""

from importlib.metadata import version
from pathlib import Path

import numpy as np

from unconstrain import atomic
from unconstrain.errors import PolicyError
from unconstrain.policies.compiled import CompiledPolicy, Linear, LocallyLinear, RadialBasis

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

    def blend() -> str:
        states = node("Unsqueeze", "x", constant("centre_axis", np.array([1])), output="states")
        away = node("Sub", states, constant("centers", a["centers"][None]), output="away")
        squared = node("ReduceSumSquare", away, output="squared", axes=[2], keepdims=0)
        exponents = node(
            "Mul", squared, constant("scale", np.array(-0.5 / a["width"] ** 2)), output="exponents"
        )
        return node("Softmax", exponents, output="activations", axis=1)

    if isinstance(step, Linear):
        turned = node("MatMul", "x", constant("coef", a["coef"].T), output="turned")
        node("Add", turned, constant("intercept", a["intercept"]), output="u")
    elif isinstance(step, RadialBasis):
        node("MatMul", blend(), constant("weights", a["weights"].T), output="u")
    else:
        # Blend the models, then apply what results: (batch, d, n + 1) times (batch, n + 1, 1).
        models = np.concatenate([a["coef"], a["intercept"][:, :, None]], axis=2).reshape(-1, d * (n + 1))
        flat = node("MatMul", blend(), constant("models", models), output="flat")
        blended = node("Reshape", flat, constant("shape", np.array([-1, d, n + 1])), output="blended")
        last = constant("last_axis", np.array([2]))
        column = node("Unsqueeze", "x", last, output="column")
        padding = constant("padding", np.array([0, 0, 0, 0, 1, 0]))
        extended = node("Pad", column, padding, constant("one", np.array(1.0)), output="extended")
        node("Squeeze", node("MatMul", blended, extended, output="applied"), last, output="u")

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
