"""Networks of the user's own as ONNX models, written by PyTorch."""

import io
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from unconstrain import atomic
from unconstrain.errors import PolicyError
from unconstrain.networks.model import NetworkModel
from unconstrain.torch.backend import load_torch

OPSET = 17
AGREEMENT = 1e-3
"""How far the model may be from the network, in units of its largest action: single precision, and many layers."""


def export(network: NetworkModel, members: tuple[Mapping[str, Any], ...], path: Path) -> None:
    """Write networks as one ONNX model, input "x" (batch, n) and output "u" (batch, d), in their own precision.

    Parameters
    ----------
    network : NetworkModel
        Which.
    members : tuple of mapping of str to ndarray
        The parameters of each.
    path : Path
        An existing file is replaced.

    Raises
    ------
    PolicyError
        PyTorch or ONNX cannot write it, or it says otherwise than the network.
    """
    torch = load_torch()
    try:
        from onnx import load_model_from_string
        from onnx.reference import ReferenceEvaluator
    except ImportError:
        raise PolicyError(
            "writing ONNX needs the package onnx, which is not installed: pip install 'unconstrain[onnx]'"
        ) from None
    whole = _together(network, members)
    example = next(whole.parameters(), None)
    precision = torch.float32 if example is None else example.dtype
    X = network.center + network.spread * np.random.default_rng(0).standard_normal((8, network.n_states))
    x, file = torch.as_tensor(X).to(precision), io.BytesIO()
    try:
        with warnings.catch_warnings(), torch.no_grad():
            warnings.simplefilter("ignore")
            torch.onnx.export(
                whole,
                (x,),
                file,
                dynamo=False,
                opset_version=OPSET,
                input_names=["x"],
                output_names=["u"],
                dynamic_axes={"x": {0: "batch"}, "u": {0: "batch"}},
            )
        written = ReferenceEvaluator(load_model_from_string(file.getvalue())).run(None, {"x": x.numpy()})
    except Exception as error:  # PyTorch and ONNX raise nearly anything for what they cannot write
        reason = str(error).partition("\n")[0]
        raise PolicyError(f"PyTorch cannot write this network as ONNX: {reason:.200}") from None
    said = network.evaluate(X, members)
    off = float(np.abs(np.asarray(next(iter(written))) - said).max())
    if not off <= AGREEMENT * max(float(np.abs(said).max()), 1e-30):
        raise PolicyError(
            f"the ONNX model that PyTorch wrote is {off:.2g} from predict, so nothing was written"
        )
    with atomic.replacing(path) as temporary:
        temporary.write_bytes(file.getvalue())


def _together(network: NetworkModel, members: tuple[Mapping[str, Any], ...]) -> Any:
    """Make a module that standardises states, and returns the mean of all networks in units of the action."""
    torch = load_torch()
    Module: Any = torch.nn.Module

    class Together(Module):
        def __init__(self) -> None:
            super().__init__()
            self.members = torch.nn.ModuleList()
            for own in members:
                made = network.make()
                made.load_state_dict({name: torch.as_tensor(value) for name, value in own.items()})
                self.members.append(made)
            example = next(self.members.parameters(), None)
            precision = torch.float32 if example is None else example.dtype
            self.register_buffer("center", torch.as_tensor(network.center).to(precision))
            self.register_buffer("spread", torch.as_tensor(network.spread).to(precision))

        def forward(self, x: Any) -> Any:
            z = (x - self.center) / self.spread
            total = self.members[0](z)
            for member in list(self.members)[1:]:
                total = total + member(z)
            return total * (network.unit / len(self.members))

    return Together().eval()
