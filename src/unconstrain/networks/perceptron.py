"""The network that is made unless another is given: layers of smooth units beside a linear term.

    p = L z + W_K h_{K-1} + b_K,    h_k = a(W_k h_{k-1} + b_k),    h_0 = z,    a(s) = s / (1 + exp(-s)),

for standardised states z. The linear term makes linear policies exact, and what lies between data more nearly straight.
"""

from collections.abc import Mapping
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.torch.backend import load_torch

Floats = NDArray[np.float64]


def make_perceptron(n: int, d: int, hidden: tuple[int, ...]) -> Any:
    """Make the network.

    Parameters
    ----------
    n, d : int
        Numbers of states and of actions.
    hidden : tuple of int
        Units in each hidden layer.

    Returns
    -------
    torch.nn.Module
        Its weights are drawn from PyTorch's own random numbers; the linear term begins with zeros.
    """
    return _module()(n, d, hidden)


def evaluate(w: Mapping[str, NDArray[Any]], Z: Floats) -> Floats:
    """Evaluate the network.

    Parameters
    ----------
    w : mapping of str to ndarray
        Its parameters, by the names that PyTorch has for them.
    Z : ndarray of shape (N, n)
        Standardised states.

    Returns
    -------
    ndarray of shape (N, d)
        In double precision.
    """
    h, last = Z, count_layers(w) - 1
    for k in range(last):
        a = h @ w[f"layers.{k}.weight"].T.astype(np.float64) + w[f"layers.{k}.bias"]
        h = 0.5 * a * (1 + np.tanh(0.5 * a))
    straight = Z @ w["straight.weight"].T.astype(np.float64)
    return straight + h @ w[f"layers.{last}.weight"].T.astype(np.float64) + w[f"layers.{last}.bias"]


def set_linear(w: Mapping[str, NDArray[Any]], slopes: Floats, intercept: Floats) -> dict[str, NDArray[Any]]:
    """Make the network a linear policy, `slopes @ z + intercept`, in which no hidden unit has a say.

    Parameters
    ----------
    w : mapping of str to ndarray
        Parameters.
    slopes : ndarray of shape (d, n)
        Of standardised states.
    intercept : ndarray of shape (d,)
        Where these are zero.

    Returns
    -------
    dict of str to ndarray
        Parameters, the hidden units' own as they were. Those of the linear policy keep double precision, in which the
        network is evaluated, though not descended.
    """
    last = count_layers(w) - 1
    weight, bias = f"layers.{last}.weight", f"layers.{last}.bias"
    new = {weight: np.zeros_like(w[weight]), bias: intercept, "straight.weight": slopes}
    return {name: new.get(name, value) for name, value in w.items()}


def count_layers(w: Mapping[str, NDArray[Any]]) -> int:
    """Count the layers that parameters belong to.

    Parameters
    ----------
    w : mapping of str to ndarray
        Parameters.

    Returns
    -------
    int
        The last one included, the linear term not.
    """
    return sum(name.startswith("layers.") and name.endswith(".weight") for name in w)


@cache
def _module() -> Any:
    nn = load_torch().nn
    Module: Any = nn.Module

    class Perceptron(Module):
        def __init__(self, n: int, d: int, hidden: tuple[int, ...]) -> None:
            super().__init__()
            sizes = (n, *hidden, d)
            self.layers = nn.ModuleList(nn.Linear(a, b) for a, b in pairwise(sizes))
            self.straight = nn.Linear(n, d, bias=False)
            nn.init.zeros_(self.straight.weight)

        def forward(self, z: Any) -> Any:
            h = z
            for layer in self.layers[:-1]:
                h = nn.functional.silu(layer(h))
            return self.straight(z) + self.layers[-1](h)

    return Perceptron
