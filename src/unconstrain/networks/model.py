"""A network without its parameters, which policies, inference and rollouts ask as they ask any other model."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain.errors import PolicyError
from unconstrain.networks import perceptron
from unconstrain.torch.backend import load_torch

Floats = NDArray[np.float64]
Parameters = Mapping[str, NDArray[Any]]

ROWS = 2**14
"""States that go through a network at a time."""


@dataclass(frozen=True)
class NetworkModel:
    """Networks over states as a space lays them out; where there are several, their mean.

    Parameters
    ----------
    n_states, n_actions : int
        n and d.
    center, spread : ndarray of shape (n,)
        By which states are standardised.
    unit : float
        What a length of one is for the network, in units of the action.
    hidden : tuple of int
        Units of the hidden layers of the perceptron.
    module : None, callable or torch.nn.Module
        None for the perceptron; what makes another network of n and d; or one.
    """

    n_states: int
    n_actions: int
    center: Floats
    spread: Floats
    unit: float
    hidden: tuple[int, ...]
    module: Any = None

    scale = None
    width = None

    def make(self) -> Any:
        """Make a network.

        Returns
        -------
        torch.nn.Module
            From standardised states to actions in the unit.

        Raises
        ------
        PolicyError
            What was given makes no network.
        """
        from copy import deepcopy

        Module = load_torch().nn.Module
        if self.module is None:
            return perceptron.make_perceptron(self.n_states, self.n_actions, self.hidden)
        if isinstance(self.module, Module):
            return deepcopy(self.module)
        try:
            made = self.module(self.n_states, self.n_actions)
        except TypeError as error:
            raise PolicyError(
                "module must be a torch.nn.Module, or a class or function that makes one of the numbers of states and "
                f"actions, but calling it with {self.n_states} and {self.n_actions} raises: {error}"
            ) from None
        if not isinstance(made, Module):
            raise PolicyError(f"module made {type(made).__name__}, which is no torch.nn.Module")
        return made

    def lay_out(self, X: Floats) -> Floats:
        """Lay states out as the network sees them; see `Model.lay_out`."""
        return X

    def standardize(self, Z: Floats) -> Floats:
        """Standardise states.

        Parameters
        ----------
        Z : ndarray of shape (N, n)
            As a space lays them out.

        Returns
        -------
        ndarray of shape (N, n)
            As the network takes them.
        """
        return (np.asarray(Z, dtype=np.float64) - self.center) / self.spread

    def evaluate(self, X: Floats, w: tuple[Parameters, ...]) -> Floats:
        """Evaluate the mean of all networks.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        w : tuple of mapping
            The parameters of each network by their names.

        Returns
        -------
        ndarray of shape (N, d)
            Actions, in double precision.
        """
        return self.evaluate_each(X, w).mean(axis=0)

    def evaluate_each(self, X: Floats, w: tuple[Parameters, ...]) -> Floats:
        """Evaluate every network by itself.

        Parameters
        ----------
        X : ndarray of shape (N, n)
            States.
        w : tuple of mapping
            The parameters of each of E networks by their names.

        Returns
        -------
        ndarray of shape (E, N, d)
            Actions.
        """
        Z = self.standardize(X)
        found = np.empty((len(w), len(Z), self.n_actions))
        for start in range(0, len(Z), ROWS):
            rows = slice(start, start + ROWS)
            for e, own in enumerate(w):
                found[e, rows] = self._forward(Z[rows], own)
        return self.unit * found

    def compile(self, w: tuple[Parameters, ...]) -> Any:
        """Compile the policy for a control loop; see `Model.compile`."""
        from unconstrain.deploy.compiled import Perceptron

        if self.module is not None:
            raise PolicyError(
                "a network of your own cannot be compiled for NumPy: use policy.to_onnx(path), or predict"
            )
        return Perceptron.of(w, self.center, self.spread, self.unit)

    def _forward(self, Z: Floats, w: Parameters) -> Floats:
        if self.module is None:
            return perceptron.evaluate(w, Z)
        torch = load_torch()
        network = self._network
        example = next(network.parameters(), None)
        precision = torch.float32 if example is None else example.dtype
        state = {name: torch.as_tensor(value) for name, value in w.items()}
        with torch.no_grad():
            made = torch.func.functional_call(network, state, torch.as_tensor(Z).to(precision))
        return np.asarray(check_output(made, len(Z), self.n_actions).double().numpy())

    @cached_property
    def _network(self) -> Any:
        return self.make().cpu().eval()

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_network"}


def check_output(made: Any, n_samples: int, d: int) -> Any:
    """Check what a network returned.

    Parameters
    ----------
    made : object
        What it returned.
    n_samples, d : int
        The shape it has to have.

    Returns
    -------
    Tensor of shape (N, d)
        The same.

    Raises
    ------
    PolicyError
        It is something else.
    """
    shape = tuple(getattr(made, "shape", ()))
    if shape != (n_samples, d):
        raise PolicyError(
            f"the network must return actions ({n_samples}, {d}) for {n_samples} states, and it returned "
            f"{type(made).__name__} of shape {shape}"
        )
    return made
